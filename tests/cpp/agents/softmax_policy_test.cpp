#include "sdnn/agents/softmax_policy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "sdnn/agents/detail/softmax.hpp"
#include "sdnn/approximators/detail/thermometers.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents::detail {
namespace {

constexpr int kBits = 24;

std::vector<SoftmaxTerm> softmax_of(const std::vector<double>& preferences,
                                    ActionMask allowed = {}) {
  std::vector<std::int64_t> units;
  for (const double h : preferences) units.push_back(std::llround(std::ldexp(h, kBits)));
  std::vector<SoftmaxTerm> terms(units.size());
  softmax(units, allowed, kBits, terms);
  return terms;
}

// Probabilities and slopes are integers in units of 1 / 65536.
TEST(Softmax, EqualsItsFormulaInFloatingPoint) {
  core::Random random(1, core::Stream::weights);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> preferences(1 + random.below(7));
    for (double& h : preferences) h = 4.0 * random.normal();
    std::vector<double> p;
    for (const double h : preferences) p.push_back(std::exp(h));
    const double sum = std::accumulate(p.begin(), p.end(), 0.0);
    double entropy = 0.0;
    for (double& probability : p) {
      probability /= sum;
      entropy -= probability * std::log(probability);
    }
    const auto terms = softmax_of(preferences);
    for (std::size_t a = 0; a < p.size(); ++a) {
      EXPECT_NEAR(terms[a].probability / 65536.0, p[a], 3e-5);
      EXPECT_NEAR(terms[a].entropy_slope / 65536.0, p[a] * (std::log(p[a]) + entropy), 4e-4);
    }
  }
}

TEST(Softmax, EqualPreferencesAreExactlyEven) {
  for (const SoftmaxTerm& term : softmax_of({3.0, 3.0, 3.0, 3.0})) {
    EXPECT_EQ(term.weight, 1U << 30);        // exp(0), in units of 2^-30
    EXPECT_EQ(term.probability, 65536 / 4);  // in units of 2^-16
    EXPECT_EQ(term.entropy_slope, 0);
  }
}

TEST(Softmax, AMaskedActionHasProbabilityZero) {
  const std::uint8_t allowed[] = {0, 1, 1};
  const auto terms = softmax_of({9.0, 1.0, 1.0}, allowed);
  EXPECT_EQ(terms[0].weight, 0U);
  EXPECT_EQ(terms[0].entropy_slope, 0);
  EXPECT_EQ(terms[1].probability, 65536 / 2);  // in units of 2^-16
  core::Random random(1, core::Stream::exploration);
  for (int i = 0; i < 50; ++i) EXPECT_NE(draw_term(terms, random), 0U);
}

TEST(Softmax, PreferencesFarBelowTheBestAreNeverDrawn) {
  const auto terms = softmax_of({0.0, -60.0, 1e5});
  EXPECT_EQ(terms[2].probability, 65536);  // 1, in units of 2^-16
  EXPECT_EQ(terms[0].weight + terms[1].weight, 0U);
}

TEST(Softmax, ActionsAreDrawnByTheirProbability) {
  const auto terms = softmax_of({0.0, std::log(3.0)});
  core::Random random(1, core::Stream::exploration);
  int n_second = 0;
  for (int i = 0; i < 10000; ++i) n_second += draw_term(terms, random) == 1 ? 1 : 0;
  EXPECT_NEAR(n_second / 10000.0, 0.75, 0.02);
}

// An input has three units over five bins: thresholds between bins 0 and 1, at bin 2, between bins
// 3 and 4. The second input has none.
TEST(Thermometers, UnitsWithThresholdsAboveTheBinAreNegative) {
  const approximators::Thermometers thermometers(3, {5, 0});
  ASSERT_EQ(thermometers.n_columns(), 3U);
  const std::vector<std::vector<std::int8_t>> expected{
      {-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {1, 1, -1}, {1, 1, 1}};
  std::vector<std::int8_t> signs(3, 7);
  for (coding::Bin bin = 0; bin < 5; ++bin) {
    const coding::Bin bins[] = {bin, 0};
    EXPECT_EQ(thermometers.write(bins, signs.data()), 3U);
    EXPECT_EQ(signs, expected[static_cast<std::size_t>(bin)]) << bin;
  }
  const coding::Bin missing[] = {5, 0};  // a bin beyond the last
  EXPECT_EQ(thermometers.write(missing, signs.data()), 0U);
  EXPECT_EQ(signs, std::vector<std::int8_t>(3, 0));
}

// Five weights of probabilities: of three actions of dimension 0, then of two of dimension 1. An
// offset is in distances of neighbouring actions.
TEST(SoftmaxPolicy, TheMeanOfAnActionAndItsNeighboursIsWeightedByProbabilities) {
  const SoftmaxPolicy policy({3, 2}, 64);
  auto workspace = policy.workspace();
  const std::uint32_t weights[] = {1, 4, 3, 2, 1};
  for (std::size_t row = 0; row < 5; ++row) workspace.terms[row].weight = weights[row];
  EXPECT_EQ(policy.mean_offset(workspace, 0, 1), 0.25);  // (3 - 1) / (1 + 4 + 3)
  // 1 / (2 + 1) in units of 1 / 65536, rounded down; the first action has one neighbour only.
  EXPECT_EQ(policy.mean_offset(workspace, 1, 0), 65535.0 / 3 / 65536.0);
}

// Preferences that `learn` keeps equal those of a copy that has to compute them. Rate and weight of
// the entropy are 0.1 and 0.01 in units of 2^-16, the decay is 0.99 * 0.9 in units of 2^-13.
TEST(SoftmaxPolicy, PreferencesAreThoseOfTheWeightsAfterEveryStep) {
  const std::size_t only[] = {1};
  const approximators::LinearSDNN net({.n_inputs = 2, .n_pattern_units = 64}, only, 1);
  auto present = net.workspace();
  auto next = net.workspace();
  SoftmaxPolicy policy({3, 4}, net.n_slots());
  auto trace = policy.trace();
  auto workspace = policy.workspace();
  auto of_copy = policy.workspace();
  core::Random random(1, core::Stream::exploration);
  net.read(std::vector{0.5, 0.5}, present);
  for (int t = 0; t < 40; ++t) {
    net.read(std::vector{random.uniform(), random.uniform()}, next);
    policy.read_and_keep(present.code(), workspace);
    policy.allow({}, workspace);
    const std::size_t action[] = {random.below(3), random.below(4)};
    const bool is_last = t % 10 == 9;
    policy.learn(present.code(), workspace, action, trace,
                 {.error = SoftmaxPolicy::kErrorOne, .rate = 6554, .entropy = 655, .decay = 7299},
                 is_last ? nullptr : &next.code());
    SoftmaxPolicy copy({3, 4}, net.n_slots());
    core::restore(copy, core::state_of(policy));
    for (const auto* read : {&next, &present}) {
      policy.read(read->code(), workspace);
      copy.read(read->code(), of_copy);
      EXPECT_EQ(workspace.preferences, of_copy.preferences) << t;
    }
    std::swap(present, next);
  }
  EXPECT_NE(workspace.preferences, std::vector<std::int64_t>(7));
}

}  // namespace
}  // namespace sdnn::agents::detail
