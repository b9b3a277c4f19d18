#include "sdnn/approximators/linear_sdnn.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "approximators/with_workspace.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn::approximators {
namespace {

using Numbers = std::vector<double>;
const std::vector<std::size_t> kNActions{3, 2};  // of two dimensions of actions

LinearSDNNConfig small_readout(int n_inputs) {
  return {.n_inputs = n_inputs,
          .n_pattern_units = 70,  // no multiple of a word
          .n_anchor_patterns = 4,
          .n_interpolated = 6,
          .action_window = 2,
          .averaging_interval = 3};
}

void learn_at_random(LinearSDNN& readout, int n_steps, core::Random& random) {
  auto workspace = readout.workspace();
  auto trace = readout.trace();
  readout.fit_unit(1.0);
  for (int t = 0; t < n_steps; ++t) {
    readout.read(testing::random_state(readout.n_inputs(), random), workspace);
    const std::vector<std::size_t> action{random.below(3), random.below(2)};
    readout.learn(workspace.code(), action, trace,
                  {.error = readout.units_of(random.uniform() - 0.5), .rate = 1 << 14});
  }
}

Numbers values_of_all(const LinearSDNN& readout, const Numbers& state, bool averaged) {
  auto workspace = readout.workspace();
  Numbers all;
  for (std::size_t d = 0; d < kNActions.size(); ++d) {
    Numbers values(kNActions[d]);
    readout.values(state, workspace, values, d, averaged);
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

// The values of the first n inputs, present and averaged, are those of all inputs after one or two
// more were added.
TEST(LinearSDNN, KeepsItsValuesWhenInputsAreAdded) {
  for (int n_first = 2; n_first <= 5; ++n_first) {
    core::Random random(7, core::Stream::weights);
    LinearSDNN readout(small_readout(n_first), kNActions, 5);
    const auto first = static_cast<std::size_t>(n_first);
    for (int n = n_first + 1; n <= n_first + 4; n += 1 + n % 2) {  // one or two inputs more
      learn_at_random(readout, 30, random);
      LinearSDNN extended(small_readout(n), kNActions, 5, first);
      extended.continue_from(readout);
      for (int t = 0; t < 20; ++t) {
        Numbers state = testing::random_state(extended.n_inputs(), random);
        for (const bool averaged : {false, true}) {
          const Numbers values = values_of_all(extended, state, averaged);
          const Numbers before = values_of_all(
              readout, {state.begin(), state.begin() + static_cast<int>(readout.n_inputs())},
              averaged);
          EXPECT_EQ(values, before) << n_first << " to " << n;
          EXPECT_NE(values, Numbers(values.size(), 0.0));
        }
      }
      readout = extended;
    }
  }
}

// Arguments are settings, actions, seed and the number of inputs before any were added, 2.
TEST(LinearSDNN, InputsAddedOneByOneAreWiredLikeInputsAddedAtOnce) {
  core::Random random(7, core::Stream::weights);
  LinearSDNN two(small_readout(2), kNActions, 5);
  learn_at_random(two, 30, random);
  LinearSDNN five(small_readout(5), kNActions, 5, 2), four(small_readout(4), kNActions, 5, 2);
  four.continue_from(two);
  five.continue_from(four);
  LinearSDNN at_once(small_readout(5), kNActions, 5, 2);
  at_once.continue_from(two);
  EXPECT_TRUE(std::ranges::equal(five.weights(), at_once.weights()));
  core::Random same_random = random;
  learn_at_random(five, 30, random);
  learn_at_random(at_once, 30, same_random);
  EXPECT_TRUE(std::ranges::equal(five.weights(), at_once.weights()));
}

// The default number falls with the number of pairs, 300 * 299 for 300 inputs, so that without its
// lower limit it would be 0. For more inputs, that number does not fit in an int.
TEST(LinearSDNN, HasAtLeast64PatternUnitsWithManyInputs) {
  for (const int n_inputs : {300, 50'000, std::numeric_limits<int>::max()}) {
    EXPECT_EQ(with_pattern_units({.n_inputs = n_inputs}).n_pattern_units, 64) << n_inputs;
  }
}

// Counts that are negative, and counts that further steps would overflow.
TEST(LinearSDNN, RefusesStatesWithImpossibleCounts) {
  core::Random random(7, core::Stream::weights);
  LinearSDNN readout(small_readout(2), kNActions, 5);
  learn_at_random(readout, 9, random);
  const core::State good = core::state_of(readout);
  for (const std::string name : {"n_steps", "n_snapshots"}) {
    for (const std::int64_t bad : {std::int64_t{-1}, std::numeric_limits<std::int64_t>::max()}) {
      testing::expect_refused(readout, testing::with_number(good, name, bad),
                              "state: " + name + " must be in [0, ");
    }
  }
}

}  // namespace
}  // namespace sdnn::approximators
