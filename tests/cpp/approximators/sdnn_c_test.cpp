#include "sdnn/approximators/sdnn_c.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "allocation_count.hpp"
#include "approximators/small_sdnn_c.hpp"
#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::approximators::small_sdnn_c {
namespace {

// Thresholds are -200 and 200 in turns, beyond the sums of the small initial weights. So every
// other unit fires, 150 in each window of 300, which is the middle of the range from -20 to 20.
TEST(SDNNC, QIsExactlyZeroEverywhereAtTheStart) {
  for (const int n_inputs : {4, 6}) {
    Network network({.n_inputs = n_inputs}, 7);
    core::Random random(3, core::Stream::weights);
    const std::vector<double> zeros(601, 0.0);
    for (int i = 0; i < 150; ++i) {
      const State state = random_state(static_cast<std::size_t>(n_inputs), random);
      ASSERT_EQ(values(network, state), zeros);
    }
  }
}

// A lattice of 8 stores parameters in eighths: thresholds of -10 and 10, weights up to 1/2.
TEST(SDNNC, UniformInitialWeightsStayWithinTheirLimitOnTheLattice) {
  SDNNCConfig config = small_config();
  config.lattice = 8;
  config.initial_weights = InitialWeights::uniform;
  config.initial_weight_limit = 0.5;
  config.initial_threshold = 10.0;
  const Network network(config, 1);
  int largest = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    EXPECT_EQ(network.hidden_layer().threshold(i), i % 2 == 0 ? -8 * 10 : 8 * 10);
    for (std::size_t j = 0; j < network.state_code().n_columns(); ++j) {
      largest = std::max(largest, std::abs(network.weight(i, j)));
    }
  }
  EXPECT_EQ(largest, 8 / 2);
}

// The unit is the value of one more firing unit. A deficit of a quarter of it is lost by rounding
// half up, corrected by a whole unit by rounding away, and so in a quarter of all networks by
// rounding at random.
TEST(SDNNC, RoundingDecidesOnFractionsOfAUnit) {
  const State state = {0.1, 0.5, 0.9};
  const auto units_moved = [&](Rounding rounding, double units, std::uint64_t seed) {
    SDNNCConfig config = small_config();
    config.initial_threshold = 2.0;  // less than a correction, so that each makes a unit fire
    config.rounding = rounding;
    Network network(config, seed);
    const double unit = network.output_scale()(31) - network.output_scale()(30);
    const double before = network.value(state, 3);
    network.update(state, 3, before + units * unit);
    return static_cast<int>(std::lround((network.value(state, 3) - before) / unit));
  };
  EXPECT_EQ(units_moved(Rounding::half_up, 0.25, 5), 0);
  EXPECT_EQ(units_moved(Rounding::half_up, 0.5, 5), 1);
  EXPECT_EQ(units_moved(Rounding::half_up, -0.5, 5), 0);
  EXPECT_EQ(units_moved(Rounding::away, 0.25, 5), 1);
  EXPECT_EQ(units_moved(Rounding::away, -0.25, 5), -1);
  EXPECT_EQ(units_moved(Rounding::away, 2.0, 5), 2);
  EXPECT_EQ(units_moved(Rounding::away, 0.0, 5), 0);
  int up = 0, down = 0;
  constexpr int kNetworks = 400;
  for (std::uint64_t seed = 0; seed < kNetworks; ++seed) {
    const int rise = units_moved(Rounding::random, 0.25, seed);
    EXPECT_TRUE(rise == 0 || rise == 1);
    up += rise;
    down -= units_moved(Rounding::random, -1.75, seed);
  }
  const double sigma = std::sqrt(kNetworks * 0.25 * 0.75);
  EXPECT_NEAR(up, 0.25 * kNetworks, 5 * sigma);
  EXPECT_NEAR(down, 1.75 * kNetworks, 5 * sigma);
}

// Weights of two bytes have separate storage and sums, which must not allocate on first use either.
// On a lattice of 64 a correction changes weights by 64 steps, so that two can reach 128, beyond a
// byte.
TEST(SDNNC, LearningLargeWeightsAllocatesNothing) {
  SDNNCConfig config = small_config();
  config.lattice = 64;
  config.initial_threshold = 0.0;
  Network network(config, 1);
  network.warm_caches();
  core::Random random(6, core::Stream::weights);
  std::vector<double> out(network.n_actions());
  State state = random_state(3, random);
  const std::size_t before = testing::allocation_count();
  for (int step = 0; step < 300; ++step) {
    network.values(state, out);
    network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
    for (double& value : state) value = random.uniform();
  }
  EXPECT_EQ(testing::allocation_count(), before);
  EXPECT_GT(network.hidden_layer().n_high_bytes(), 1000U);
  EXPECT_EQ(values(network, state), values_by_masks(network, state));
}

TEST(SDNNC, CopiesShareNothingThatIsLearned) {
  Network original(small_config(), 3);
  const State state = {0.2, 0.4, 0.6};
  original.update(state, 5, 9.0);
  const std::vector<double> before = values(original, state);
  const std::vector<std::int32_t> potentials_before = potentials(original, state);
  Network copy = original;
  EXPECT_EQ(values(copy, state), before);
  expect_equal_parameters(copy, original);
  for (int i = 0; i < 100; ++i) copy.update(state, 5, -20.0);
  EXPECT_NE(values(copy, state), before);
  EXPECT_EQ(values(original, state), before);
  EXPECT_EQ(potentials(original, state), potentials_before);
  original = copy;
  EXPECT_EQ(values(original, state), values(copy, state));
}

TEST(SDNNC, RefusesParametersOfWrongValueOrNumberAndKeepsItsOwn) {
  Network network(small_config(), 3);
  const Network before = network;
  const std::vector<std::int32_t> thresholds(network.hidden_layer().n_units(), 1);
  std::vector<std::int32_t> weights(thresholds.size() * network.state_code().n_columns());
  weights.back() = 1 << 20;
  EXPECT_THROW(network.set_parameters(weights, thresholds), std::invalid_argument);
  expect_equal_parameters(network, before);
  weights.pop_back();
  EXPECT_THROW(network.set_parameters(weights, thresholds), std::invalid_argument);
}

// warm_caches touches all memory before the first step, and counts no pass over the weights.
TEST(SDNNC, WarmCachesChangeNothing) {
  Network cold(small_config(), 5);
  Network warm = cold;
  warm.warm_caches();
  EXPECT_EQ(warm.own_workspace().cache().counts().full, 0U);
  const State state = {0.3, 0.6, 0.2};
  for (Network* const network : {&cold, &warm}) network->update(state, 70, 12.0);
  expect_equal_parameters(cold, warm);
  EXPECT_EQ(values(cold, state), values(warm, state));
}

TEST(SDNNC, TheEndsOfTheUnitIntervalAreStates) {
  Network network(small_config(), 1);
  EXPECT_EQ(values(network, {0.0, 0.0, 0.0}).size(), 200U - 60 + 1);  // windows of 60 units
  EXPECT_EQ(values(network, {1.0, 1.0, 1.0}), values(network, {0.9999, 0.9999, 0.9999}));
  EXPECT_EQ(values(network, {-0.0, 0.0, 0.0}), values(network, {0.0, 0.0, 0.0}));
}

// The network has three inputs in [0, 1] and 200 - 60 + 1 = 141 actions.
TEST(SDNNC, ABadArgumentChangesNothing) {
  Network network(small_config(), 1);
  const Network before = network;
  const State good = {0.1, 0.2, 0.3};
  for (const double bad : {testing::kNaN, -1e-300, 1.0000001, testing::kInfinity}) {
    const State state = {0.1, bad, 0.3};
    EXPECT_THROW((void)network.value(state, 0), std::invalid_argument);
    EXPECT_THROW(network.update(state, 0, 1.0), std::invalid_argument);
    EXPECT_THROW((void)values(network, state), std::invalid_argument);
    EXPECT_THROW((void)potentials(network, state), std::invalid_argument);
  }
  EXPECT_THROW(network.update(good, 0, testing::kNaN), std::invalid_argument);
  EXPECT_THROW(network.update(good, 141, 1.0), std::invalid_argument);
  EXPECT_THROW((void)network.value(good, 141), std::invalid_argument);
  EXPECT_THROW((void)network.value(State{0.1, 0.2}, 0), std::invalid_argument);
  std::vector<double> short_row(140);
  EXPECT_THROW(network.values(good, short_row), std::invalid_argument);
  expect_equal_parameters(network, before);
  EXPECT_EQ(values(network, good), values_by_masks(network, good));
}

// A value keeps its share of the way from the low to the high end of the range.
TEST(SDNNC, AnotherRangeScalesTheValues) {
  Network network(small_config(), 1);
  core::Random random(6, core::Stream::ties);
  const State state = random_state(3, random);
  network.update(state, 3, 9.0);
  const std::vector<double> before = values(network, state);
  const double low = network.output_scale().q_low(), high = network.output_scale().q_high();
  network.set_output_range(100.0, 300.0);
  const std::vector<double> after = values(network, state);
  for (std::size_t a = 0; a < before.size(); ++a) {
    EXPECT_NEAR((after[a] - 100.0) / 200.0, (before[a] - low) / (high - low), 1e-12);
    EXPECT_EQ(after[a], network.value(state, a));
  }
  for (const auto& [bad_low, bad_high] : {std::pair(1.0, 1.0), std::pair(testing::kNaN, 2.0),
                                          std::pair(-1e302, 1.0), std::pair(0.0, 1e302)}) {
    EXPECT_THROW(network.set_output_range(bad_low, bad_high), std::invalid_argument);
  }
  EXPECT_EQ(values(network, state), after);
  network.set_output_range(low, high);
  EXPECT_EQ(values(network, state), before);
}

// 30 units for values from 0 to 30; Q = 15 everywhere at the start.
TEST(SDNNC, CountsTheOutcomesOfCorrections) {
  Network network({.n_inputs = 2,
                   .n_pattern_units = 40,
                   .n_hidden_units = 60,
                   .n_active_units = 30,
                   .q_low = 0.0,
                   .q_high = 30.0,
                   .u_low = 0,
                   .u_high = 30},
                  1);
  const State state = {0.2, 0.7};
  const auto expect_counts = [&network](unsigned changed, unsigned rounded, unsigned outside) {
    EXPECT_EQ(network.correction_counts().changed, changed);
    EXPECT_EQ(network.correction_counts().rounded_away, rounded);
    EXPECT_EQ(network.correction_counts().out_of_range, outside);
  };
  ASSERT_EQ(network.value(state, 0), 15.0);
  network.update(state, 0, 15.0);
  expect_counts(0, 0, 0);  // the target is the value
  network.update(state, 0, 15.4);
  expect_counts(0, 1, 0);  // 0.4 units round to 0
  network.update(state, 0, 16.0);
  expect_counts(1, 1, 0);  // a unit more fires
  network.update(state, 0, 31.0);
  expect_counts(2, 1, 1);  // clipped to 30, and changed
}

TEST(SDNNC, RefusesAStateThatDoesNotFit) {
  Network network({.n_inputs = 2,
                   .n_pattern_units = 8,
                   .n_anchor_patterns = 3,
                   .n_interpolated = 3,
                   .n_hidden_units = 12,
                   .n_active_units = 6},
                  1);
  testing::expect_damaged_states_refused(network);
  const core::State good = core::state_of(network);
  EXPECT_EQ(good.at("weights").shape, (std::vector<std::size_t>{12, 2 * 8}));  // units, columns
  // Weights beyond their limit of 16383, thresholds of 2^30 in size, and a low end of the range
  // that is not finite, not below the high end of 20, or so large that values would not be finite.
  const auto refused = [&](const core::State& bad, const std::string& message) {
    testing::expect_refused(network, bad, "state: " + message);
  };
  using testing::with_number;
  refused(with_number(good, "weights", std::int16_t{32767}, 100), "weights must be such that ");
  refused(with_number(good, "weights", std::int16_t{-32768}, 100), "weights must be such that ");
  refused(with_number(good, "thresholds", std::int32_t{1} << 30, 3), "thresholds must be of less");
  refused(with_number(good, "thresholds", std::numeric_limits<std::int32_t>::min(), 3),
          "thresholds must be of less");
  for (const double bad : {testing::kNaN, 20.0, -testing::kInfinity, 1e302}) {
    refused(with_number(good, "output_range", bad, 0), "output_range must be such that q_");
  }
}

}  // namespace
}  // namespace sdnn::approximators::small_sdnn_c
