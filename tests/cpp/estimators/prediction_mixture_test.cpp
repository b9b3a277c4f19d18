#include "sdnn/estimators/prediction_mixture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "estimators/streams.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn {
namespace {

using estimators::PredictionMixture;
using testing::kMax;
using Numbers = std::vector<double>;

TEST(PredictionMixture, WeightsAreTheInverseEighthPowerOfErrorsMixedWithTheirMean) {
  PredictionMixture mixture(Numbers(2, 1.0));
  EXPECT_EQ(mixture.mix(Numbers{1.0, 4.0}), 2.5);
  mixture.learn(Numbers{0.0, 1.0}, 2.0);
  // Squared errors 4 and 1, of mean 2.5, which counts as much as five samples.
  const double ratio = std::pow((1.0 + 5 * 2.5) / (4.0 + 5 * 2.5), 8);
  EXPECT_NEAR(mixture.weights()[0], ratio / (1.0 + ratio), 1e-15);
  EXPECT_NEAR(mixture.mix(Numbers{1.0, 4.0}), (ratio + 4.0) / (ratio + 1.0), 1e-14);
}

TEST(PredictionMixture, StartsWithThePriorsAndEqualErrorsKeepThem) {
  PredictionMixture mixture(Numbers{3.0, 1.0});
  EXPECT_EQ(mixture.weights(), (Numbers{0.75, 0.25}));
  mixture.learn(Numbers{0.0, 0.0}, 1.0);
  EXPECT_EQ(mixture.weights(), (Numbers{0.75, 0.25}));
}

// Experts predict 0.1 and 1; targets are 0, then 1. Each sample discounts the earlier squared
// errors by 0.99. Undiscounted, those of the first expert would still be less in the end: 172, from
// 1000 * 0.1^2 + 200 * 0.9^2, against 1000.
TEST(PredictionMixture, WeightsFollowADriftThatChangesTheBetterExpert) {
  PredictionMixture mixture(Numbers(2, 1.0));
  for (int i = 0; i < 1000; ++i) mixture.learn(Numbers{0.1, 1.0}, 0.0);
  EXPECT_GT(mixture.weights()[0], 0.99);
  for (int i = 0; i < 200; ++i) mixture.learn(Numbers{0.1, 1.0}, 1.0);
  EXPECT_GT(mixture.weights()[1], 0.99);
}

// The first of two experts is better, until a target of 1e300, for which both are equally wrong. An
// error counts as five times the worst expert's root mean square error at most; an unlimited one
// would outweigh all others, and leave both experts a weight of 0.5.
TEST(PredictionMixture, AnOutlierDoesNotMakeExpertsAlike) {
  PredictionMixture mixture(Numbers(2, 1.0));
  for (int i = 0; i < 200; ++i) mixture.learn(Numbers{0.1, 0.3}, 0.0);
  mixture.learn(Numbers{0.1, 0.3}, 1e300);
  EXPECT_GT(mixture.weights()[0], 0.8);
}

// Predictions and targets are multiplied by powers of two.
TEST(PredictionMixture, WeightsDoNotDependOnTheUnitOfTargets) {
  const int exponents[]{-1000, -500, 0, 500, 1000};
  std::vector<Numbers> weights;
  for (const int exponent : exponents) {
    PredictionMixture mixture(Numbers(3, 1.0));
    for (int i = 0; i < 50; ++i) {
      const auto scaled = [&](double x) { return std::ldexp(x, exponent); };
      mixture.learn(Numbers{scaled(i % 3), scaled(1.5), scaled(i % 4)}, scaled(i % 5));
    }
    weights.push_back(mixture.weights());
  }
  for (const Numbers& other : weights) EXPECT_EQ(other, weights[0]);
}

// Indices of different speeds combine the extremes.
TEST(PredictionMixture, StaysFiniteForAnyNumbers) {
  const Numbers extremes{0.0, 1.0, -1.0, 5e-324, 1e300, -kMax, kMax, 1e-200, -1e154, 0.0, 0.0};
  PredictionMixture mixture(Numbers(3, 1.0));
  for (std::size_t i = 0; i < 5000; ++i) {
    const Numbers each{extremes[i % 11], extremes[(i / 3) % 11], extremes[(i / 31) % 11]};
    const double mixed = mixture.mix(each);
    ASSERT_GE(mixed, *std::ranges::min_element(each));
    ASSERT_LE(mixed, *std::ranges::max_element(each));
    mixture.learn(each, extremes[(i * i / 7) % 11]);
    for (const double weight : mixture.weights()) ASSERT_TRUE(weight >= 0.0 && weight <= 1.0);
  }
  for (int i = 0; i < 100; ++i) mixture.learn(Numbers{0.0, 0.0, 0.0}, 0.0);
  EXPECT_EQ(mixture.mix(Numbers{0.0, 0.0, 0.0}), 0.0);
}

TEST(PredictionMixture, RestoresItsStateAndRefusesWrongArguments) {
  PredictionMixture mixture(Numbers{4.0, 1.0}), other = mixture;
  for (int i = 0; i < 30; ++i) mixture.learn(Numbers{0.1, i % 3 * 1.0}, 0.0);
  core::restore(other, core::state_of(mixture));
  EXPECT_EQ(other.weights(), mixture.weights());
  EXPECT_THROW(PredictionMixture(Numbers{}), std::invalid_argument);
  EXPECT_THROW(PredictionMixture(Numbers{0.5}), std::invalid_argument);
  EXPECT_THROW(mixture.learn(Numbers{0.0}, 1.0), std::invalid_argument);
  EXPECT_THROW(mixture.learn(Numbers{0.0, 0.0}, INFINITY), std::invalid_argument);
  EXPECT_THROW(mixture.mix(Numbers{0.0, NAN}), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn
