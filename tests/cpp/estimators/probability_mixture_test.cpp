#include "sdnn/estimators/probability_mixture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "estimators/streams.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn {
namespace {

using estimators::ProbabilityMixture;
using testing::kMax;
using Numbers = std::vector<double>;

Numbers mixed(const ProbabilityMixture& mixture, const Numbers& shares, const Numbers& scores) {
  Numbers out(shares.size());
  mixture.mix(shares, scores, out);
  return out;
}

TEST(ProbabilityMixture, SharesAloneAreTheProbabilities) {
  const ProbabilityMixture mixture(0);  // without scorers
  const Numbers out = mixed(mixture, {0.25, 0.75}, {});
  EXPECT_NEAR(out[0], 0.25, 1e-15);
  EXPECT_EQ(mixture.weights(), Numbers{1.0});
}

// Experts are the shares themselves, and softmaxes of the scorer's scores times 3, 6 and 12; the
// second weight is the sum of those of the three softmaxes.
TEST(ProbabilityMixture, WeightsAreTheLikelihoodsOfSharesAndThreeSteepnesses) {
  ProbabilityMixture mixture(1);
  mixture.learn(Numbers{0.5, 0.5}, Numbers{0.1, 0.6}, 1);
  // The true class 1 has the share 0.5, and by scores 0.5 apart the logistic of 0.5 * steepness.
  Numbers likelihoods{0.5};
  for (const double steepness : {3.0, 6.0, 12.0}) {
    likelihoods.push_back(1.0 / (1.0 + std::exp(-0.5 * steepness)));
  }
  const double total = std::accumulate(likelihoods.begin(), likelihoods.end(), 0.0);
  EXPECT_NEAR(mixture.weights()[0], likelihoods[0] / total, 1e-15);
  EXPECT_NEAR(mixture.weights()[1], 1.0 - likelihoods[0] / total, 1e-15);
  double expected = 0.0;
  for (const double likelihood : likelihoods) expected += likelihood * likelihood / total;
  EXPECT_NEAR(mixed(mixture, {0.5, 0.5}, {0.1, 0.6})[1], expected, 1e-15);
}

// Each of two scorers is always sure of one class; weight 0 is that of the shares. Without the
// discount of earlier labels, 500 of class 0 would outweigh the later 300 of class 1. No weight
// reaches 1, because every expert keeps 0.001.
TEST(ProbabilityMixture, WeightsFollowADriftThatChangesTheBetterExpert) {
  ProbabilityMixture mixture(2);
  const Numbers shares{0.5, 0.5}, scores{1.0, 0.0, 0.0, 1.0};
  for (int i = 0; i < 500; ++i) mixture.learn(shares, scores, 0);
  EXPECT_GT(mixture.weights()[1], 0.98);
  for (int i = 0; i < 300; ++i) mixture.learn(shares, scores, 1);
  EXPECT_GT(mixture.weights()[2], 0.98);
}

TEST(ProbabilityMixture, ProbabilitiesArePositiveAndSumToOneForAnyNumbers) {
  ProbabilityMixture mixture(1);
  const Numbers extremes{0.0, 1.0, -kMax, kMax, 1e300, 5e-324, -3.0};
  for (std::size_t i = 0; i < 1000; ++i) {
    const Numbers shares{extremes[i % 7], extremes[(i / 2) % 7], extremes[(i / 5) % 7]};
    const Numbers scores{extremes[(i / 3) % 7], extremes[i % 7], extremes[(i / 11) % 7]};
    const Numbers out = mixed(mixture, shares, scores);
    ASSERT_NEAR(std::accumulate(out.begin(), out.end(), 0.0), 1.0, 1e-12);
    for (const double probability : out) ASSERT_GT(probability, 0.0);
    mixture.learn(shares, scores, i % 3);
  }
}

TEST(ProbabilityMixture, RestoresItsStateAndRefusesWrongArguments) {
  ProbabilityMixture mixture(1), other(1);
  for (int i = 0; i < 30; ++i) mixture.learn(Numbers{0.2, 0.8}, Numbers{i % 2 * 1.0, 0.5}, 1);
  core::restore(other, core::state_of(mixture));
  EXPECT_EQ(other.weights(), mixture.weights());
  EXPECT_EQ(mixture.n_scorers(), 1U);
  EXPECT_THROW(ProbabilityMixture(1001), std::invalid_argument);
  EXPECT_THROW(mixture.learn(Numbers{1.0}, Numbers{1.0}, 1), std::invalid_argument);
  EXPECT_THROW(mixed(mixture, {1.0}, {}), std::invalid_argument);
  EXPECT_THROW(mixed(mixture, {}, {}), std::invalid_argument);
  EXPECT_THROW(mixed(mixture, {1.0}, {NAN}), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn
