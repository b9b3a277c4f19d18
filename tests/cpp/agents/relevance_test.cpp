#include "sdnn/agents/relevance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/agents/detail/binary_groups.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {
namespace {

using State = std::vector<double>;

/// Appends a transition with an action of one dimension.
void append(RandomExperience& experience, const State& state, double action, double reward,
            const State& next, bool ends = false) {
  experience.states.insert(experience.states.end(), state.begin(), state.end());
  experience.next_states.insert(experience.next_states.end(), next.begin(), next.end());
  experience.actions.resize(1);
  experience.actions[0].push_back(action);
  experience.rewards.push_back(reward);
  experience.ends.push_back(ends);
}

/// Inputs are a position, a velocity that actions change, and `n_noise` autoregressive noises with
/// the coefficient `memory`. With `is_rewarded`, positions above 0.8 are rewarded.
RandomExperience pushed_mass(std::size_t n, std::size_t n_noise, double memory, bool is_rewarded,
                             std::uint64_t seed) {
  core::Random random(seed, core::Stream::useless_inputs);
  RandomExperience experience{.n_inputs = 2 + n_noise, .circular = std::vector<bool>(2 + n_noise)};
  double position = 0.5, velocity = 0.0, action = 0.0;
  std::vector<double> noise(n_noise, 0.5);
  const auto inputs = [&] {
    State state{position, 0.5 + 5.0 * velocity};
    state.insert(state.end(), noise.begin(), noise.end());
    return state;
  };
  for (std::size_t t = 0; t < n; ++t) {
    const State state = inputs();
    if (random.below(4) == 0) action = static_cast<double>(random.below(3)) - 1.0;
    velocity = std::clamp(velocity + 0.005 * action, -0.1, 0.1);
    position += velocity;
    const bool ends = position < 0.0 || position > 1.0;
    position = std::clamp(position, 0.0, 1.0);
    for (double& x : noise) {
      x = std::clamp(
          0.5 + memory * (x - 0.5) + std::sqrt(1.0 - memory * memory) * 0.15 * random.normal(), 0.0,
          1.0);
    }
    append(experience, state, action, is_rewarded && position > 0.8 ? 1.0 : 0.0, inputs(), ends);
    if (ends) {
      position = 0.3 + 0.4 * random.uniform();
      velocity = 0.0;
    }
  }
  return experience;
}

std::vector<bool> relevant(const RandomExperience& experience) {
  return Relevance(experience).inputs(std::vector<bool>(experience.n_inputs));
}

// Inputs 0 and 1 are position and velocity of a mass that actions push, the others are noise.
TEST(Relevance, KeepsInputsThatActionsOrRewardsDependOn) {
  int n_noise_kept = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const double memory : {0.0, 0.95}) {
      for (const bool is_rewarded : {false, true}) {
        const auto experience = pushed_mass(1000, 8, memory, is_rewarded, seed);
        const std::vector<bool> kept = relevant(experience);
        EXPECT_TRUE(kept[0]) << seed << ' ' << memory << ' ' << is_rewarded;
        EXPECT_TRUE(kept[1]) << seed << ' ' << memory << ' ' << is_rewarded;
        n_noise_kept += static_cast<int>(std::count(kept.begin() + 2, kept.end(), true));
      }
    }
  }
  EXPECT_LE(n_noise_kept, 0.05 * 10 * 2 * 2 * 8);  // 5 % of all noise inputs
}

TEST(Relevance, KeepsAllInputsIfNoneIsRelevantOrBelow100Transitions) {
  RandomExperience motionless =
      pushed_mass(500, 3, /*memory=*/0.0, /*is_rewarded=*/false, /*seed=*/1);
  std::ranges::fill(motionless.states, 0.5);
  std::ranges::fill(motionless.next_states, 0.5);
  EXPECT_EQ(relevant(motionless), std::vector<bool>(5, true));
  EXPECT_EQ(relevant(pushed_mass(99, 3, /*memory=*/0.0, /*is_rewarded=*/true, /*seed=*/1)),
            std::vector<bool>(5, true));
}

// Position and velocity of a pushed mass, then three noises, of which the second is listed.
TEST(Relevance, KeepsListedInputsAndThoseThatPredictThem) {
  const auto experience = pushed_mass(1000, 3, /*memory=*/0.0, /*is_rewarded=*/false, /*seed=*/1);
  EXPECT_EQ(Relevance(experience).inputs({false, false, false, true, false}),
            (std::vector<bool>{true, true, false, true, false}));
  RandomExperience still = experience;  // without actions; the position is the only listed input
  std::ranges::fill(still.actions[0], 0.0);
  EXPECT_EQ(Relevance(still).inputs({true, false, false, false, false}),
            (std::vector<bool>{true, true, false, false, false}));
}

// A reward if inputs 1 and 4 are both below or both above 1/2: neither is informative alone.
TEST(Relevance, FindsInputsThatMatterOnlyTogether) {
  int n_noise_kept = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    core::Random random(seed, core::Stream::useless_inputs);
    RandomExperience experience{.n_inputs = 6, .circular = std::vector<bool>(6)};
    State state(6, 0.5);
    for (int t = 0; t < 1000; ++t) {
      State next(6);
      for (double& x : next) x = random.uniform();
      const double reward = (state[1] > 0.5) == (state[4] > 0.5) ? 1.0 : 0.0;
      append(experience, state, /*action=*/0.0, reward, next);
      state = next;
    }
    experience.actions.clear();  // only the reward decides
    const std::vector<bool> kept = relevant(experience);
    EXPECT_TRUE(kept[1] && kept[4]) << seed;
    n_noise_kept += static_cast<int>(std::ranges::count(kept, true)) - 2;
  }
  EXPECT_LE(n_noise_kept, 0.05 * 10 * 4);  // 5 % of all other inputs
}

// Inputs 0 and 1 are position and velocity of a mass that actions push, the others are noise.
TEST(Relevance, KeepsHardlyAnyOfManyNoiseInputs) {
  int n_noise_kept = 0;
  for (const std::size_t n_noise : {30U, 100U, 300U}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const std::vector<bool> kept =
          relevant(pushed_mass(1000, n_noise, /*memory=*/0.0, /*is_rewarded=*/false, seed));
      EXPECT_TRUE(kept[0] && kept[1]) << n_noise << ' ' << seed;
      n_noise_kept += static_cast<int>(std::ranges::count(kept, true)) - 2;
    }
  }
  EXPECT_LE(n_noise_kept, 2);  // of 1,290; about 40 without a correction for multiple comparisons
}

/// The experience with its inputs in another order.
RandomExperience permuted(const RandomExperience& experience,
                          const std::vector<std::size_t>& order) {
  RandomExperience result = experience;
  for (std::size_t k = 0; k < experience.states.size(); ++k) {
    const std::size_t i = k % order.size();
    result.states[k] = experience.states[k - i + order[i]];
    result.next_states[k] = experience.next_states[k - i + order[i]];
  }
  return result;
}

TEST(Relevance, DoesNotDependOnTheOrderOfInputs) {
  for (const std::size_t n_noise : {5U, 40U}) {  // below 25 inputs, and with stricter evidence
    const RandomExperience experience =
        pushed_mass(600, n_noise, /*memory=*/0.9, /*is_rewarded=*/true, /*seed=*/4);
    const std::vector<bool> kept = relevant(experience);
    core::Random random(2, core::Stream::useless_inputs);
    std::vector<std::size_t> order(experience.n_inputs);
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    random.shuffle(std::span(order));
    const std::vector<bool> kept_of_permuted = relevant(permuted(experience, order));
    for (std::size_t i = 0; i < order.size(); ++i) {
      EXPECT_EQ(kept_of_permuted[i], kept[order[i]]) << n_noise << ' ' << i;
    }
  }
}

/// Two one-hot vectors of `n_cells` inputs: a cell that actions move on a line, and a random cell.
RandomExperience two_walks(std::size_t n, std::size_t n_cells, std::uint64_t seed) {
  core::Random random(seed, core::Stream::useless_inputs);
  RandomExperience experience{.n_inputs = 2 * n_cells, .circular = std::vector<bool>(2 * n_cells)};
  std::size_t cell = 0, other_cell = 0;
  const auto inputs = [&] {
    State state(2 * n_cells, 0.0);
    state[cell] = state[n_cells + other_cell] = 1.0;
    return state;
  };
  for (std::size_t t = 0; t < n; ++t) {
    const State state = inputs();
    const auto action = static_cast<double>(random.below(2));
    if (action > 0.0 && cell + 1 < n_cells) ++cell;
    if (action == 0.0 && cell > 0) --cell;
    other_cell = random.below(n_cells);
    append(experience, state, action, /*reward=*/-1.0, inputs());
  }
  return experience;
}

// The first of two one-hot vectors is a cell that actions move, the second a random cell.
TEST(Relevance, KeepsOrLeavesOutOneHotVectorsAsAWhole) {
  for (const std::size_t n_cells : {5U, 40U}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      std::vector<bool> expected(n_cells, true);
      expected.resize(2 * n_cells, false);
      EXPECT_EQ(relevant(two_walks(1000, n_cells, seed)), expected) << n_cells << ' ' << seed;
    }
  }
}

TEST(Relevance, JudgesTwoBinaryInputsSeparately) {
  // Actions set the first input, chance the second; the third is the reward. Inputs with two
  // values, such as 0.2 and 0.8, are binary, and three or more of them are judged as a group. If
  // these two were one, the second would be kept with the first for all seeds.
  int n_kept_by_chance = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    core::Random random(seed, core::Stream::useless_inputs);
    RandomExperience experience{.n_inputs = 3, .circular = std::vector<bool>(3)};
    State state(3, 0.0);
    for (int t = 0; t < 1000; ++t) {
      const auto action = static_cast<double>(random.below(2));
      const State next{action, random.below(2) == 0 ? 0.2 : 0.8, random.uniform()};
      append(experience, state, action, /*reward=*/state[2], next);
      state = next;
    }
    const std::vector<bool> kept = relevant(experience);
    EXPECT_TRUE(kept[0] && kept[2]) << seed;
    n_kept_by_chance += kept[1] ? 1 : 0;
  }
  EXPECT_LE(n_kept_by_chance, 3);  // of ten seeds: chance rarely seems to matter
}

// The last argument shifts the actions, to show what chance alone gives.
TEST(BinaryGroups, SteeringIsHowMuchTheActionImprovesThePredictionOfTheNextSymbol) {
  // From each of two symbols action 0 leads to symbol 1, action 1 to symbol 2.
  const detail::BinaryGroup group{.symbols = {1, 1, 2, 2}, .next_symbols = {1, 2, 1, 2}};
  const std::vector<std::uint8_t> actions{0, 1, 0, 1};
  // With the action: 4 groups of 1^2 / 1. Without it: 2 groups of (1^2 + 1^2) / 2.
  EXPECT_EQ(detail::steering(group, actions, 0), 2.0);
  // A step later actions are swapped, which separates symbols as well; equal actions separate none.
  EXPECT_EQ(detail::steering(group, actions, 1), 2.0);
  EXPECT_EQ(detail::steering(group, std::vector<std::uint8_t>(4), 0), 0.0);
  // Actions 0, 0, 1, 1 follow from the symbols: 4 groups become the same 2.
  EXPECT_EQ(detail::steering(group, std::vector<std::uint8_t>{0, 0, 1, 1}, 0), 0.0);
}

using Groups = std::vector<std::vector<std::size_t>>;

Groups groups_of(const std::vector<double>& states, const std::vector<double>& next_states,
                 std::size_t n_inputs) {
  Groups groups;
  for (const auto& group : detail::binary_groups(states, next_states, n_inputs)) {
    groups.push_back(group.inputs);
  }
  return groups;
}

TEST(BinaryGroups, HoldInputsThatAreNeverOnTogether) {
  // A row per state. Input 3 is a number; inputs 0, 2 and 4 are one-hot, as are 1, 5 and 6.
  const std::vector<double> states{1, 1, 0, 0.3, 0, 0, 0,  //
                                   0, 0, 1, 0.5, 0, 1, 0,  //
                                   0, 0, 0, 0.7, 1, 0, 1};
  const std::vector<double> next_states{0, 1, 1, 0.5, 0, 0, 0,  //
                                        1, 0, 0, 0.5, 0, 0, 1,  //
                                        1, 0, 0, 0.5, 0, 1, 0};
  EXPECT_EQ(groups_of(states, next_states, 7), (Groups{{0, 2, 4}, {1, 5, 6}}));
}

TEST(BinaryGroups, TheLastOneHoldsAllInputsThatAreOnTogether) {
  const std::vector<double> states{0.2, 0.2, 0.2, 0.1,  //
                                   0.2, 0.2, 0.2, 0.2,  //
                                   0.8, 0.8, 0.8, 0.3};
  EXPECT_EQ(groups_of(states, states, 4), (Groups{{0, 1, 2}}));  // input 3 has three values
  // Two binary inputs are no group.
  EXPECT_EQ(groups_of(std::vector{0.0, 0.0, 0.5, 1.0, 1.0, 0.7},
                      std::vector{0.0, 1.0, 0.9, 1.0, 0.0, 0.8}, 3),
            Groups());
}

TEST(BinaryGroups, HoldConstantsAtAnEndOfTheirRange) {
  // The second was never on, the third never left the middle, the last was always on.
  const std::vector<double> states{1, 0, 0.5, 0, 0, 1,  //
                                   0, 0, 0.5, 1, 0, 1};
  EXPECT_EQ(groups_of(states, states, 6), (Groups{{0, 1, 3, 4}}));
}

TEST(Relevance, TreatsAnAngleThatWrapsAroundAsASmallChange) {
  // The second input is the speed of the angle, which goes round and round; the third is noise.
  core::Random random(3, core::Stream::useless_inputs);
  RandomExperience experience{.n_inputs = 3, .circular = {true, false, false}};
  double angle = 0.0;
  for (int t = 0; t < 2000; ++t) {
    const State state{angle, random.uniform(), random.uniform()};
    angle += 0.3 * state[1];
    angle -= std::floor(angle);
    append(experience, state, 0.0, std::cos(6.2831853 * angle), {angle, 0.5, 0.5});
  }
  EXPECT_EQ(relevant(experience), (std::vector<bool>{true, true, false}));
}

}  // namespace
}  // namespace sdnn::agents
