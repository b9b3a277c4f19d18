#include "sdnn/agents/relevance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdnn/core/random.hpp"

namespace sdnn::agents {
namespace {

/// A position that a velocity moves, which actions change; and noise, which remembers `memory` of
/// itself. Rewards come near position 1, if at all.
RandomExperience pushed_mass(std::size_t n, std::size_t n_noise, double memory, bool is_rewarded,
                             std::uint64_t seed) {
  core::Random random(seed, core::Stream::useless_inputs);
  RandomExperience experience{.n_inputs = 2 + n_noise, .circular = std::vector<bool>(2 + n_noise)};
  experience.actions.resize(1);
  double position = 0.5, velocity = 0.0, action = 0.0;
  std::vector<double> noise(n_noise, 0.5);
  const auto note = [&](std::vector<double>& rows) {
    rows.push_back(position);
    rows.push_back(0.5 + 5.0 * velocity);
    rows.insert(rows.end(), noise.begin(), noise.end());
  };
  for (std::size_t t = 0; t < n; ++t) {
    note(experience.states);
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
    note(experience.next_states);
    experience.actions[0].push_back(action);
    experience.rewards.push_back(is_rewarded && position > 0.8 ? 1.0 : 0.0);
    experience.ends.push_back(ends);
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

TEST(Relevance, KeepsWhatActionsAndRewardsHaveToDoWith) {
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
  EXPECT_LE(n_noise_kept, 16);  // of 320
}

TEST(Relevance, KeepsEverythingWhereNothingIsFoundOrLittleIsKnown) {
  RandomExperience nothing = pushed_mass(500, 3, 0.0, false, 1);
  std::ranges::fill(nothing.states, 0.5);
  std::ranges::fill(nothing.next_states, 0.5);
  EXPECT_EQ(relevant(nothing), std::vector<bool>(5, true));
  EXPECT_EQ(relevant(pushed_mass(99, 3, 0.0, true, 1)), std::vector<bool>(5, true));
}

TEST(Relevance, KeepsWhatIsKnownToMatterAndWhatItDependsOn) {
  const auto experience = pushed_mass(1000, 3, 0.0, false, 1);
  EXPECT_EQ(Relevance(experience).inputs({false, false, false, true, false}),
            (std::vector<bool>{true, true, false, true, false}));
  RandomExperience still = experience;  // neither actions nor rewards: the position is known
  std::ranges::fill(still.actions[0], 0.0);
  EXPECT_EQ(Relevance(still).inputs({true, false, false, false, false}),
            (std::vector<bool>{true, true, false, false, false}));
}

TEST(Relevance, FindsInputsThatMatterOnlyTogether) {
  int n_noise_kept = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    core::Random random(seed, core::Stream::useless_inputs);
    RandomExperience experience{.n_inputs = 6, .circular = std::vector<bool>(6)};
    std::vector<double> state(6, 0.5);
    for (int t = 0; t < 1000; ++t) {
      experience.states.insert(experience.states.end(), state.begin(), state.end());
      experience.rewards.push_back((state[1] > 0.5) == (state[4] > 0.5) ? 1.0 : 0.0);
      experience.ends.push_back(false);
      for (double& x : state) x = random.uniform();
      experience.next_states.insert(experience.next_states.end(), state.begin(), state.end());
    }
    const std::vector<bool> kept = relevant(experience);
    EXPECT_TRUE(kept[1] && kept[4]) << seed;
    n_noise_kept += static_cast<int>(std::ranges::count(kept, true)) - 2;
  }
  EXPECT_LE(n_noise_kept, 2);  // of 40
}

TEST(Relevance, AnAngleThatPassesItsEndHasMovedLittle) {
  // The angle moves by what the second input tells, all round; the third is noise.
  core::Random random(3, core::Stream::useless_inputs);
  RandomExperience experience{.n_inputs = 3, .circular = {true, false, false}};
  experience.actions.resize(1);
  double angle = 0.0;
  for (int t = 0; t < 2000; ++t) {
    const double speed = random.uniform();
    experience.states.insert(experience.states.end(), {angle, speed, random.uniform()});
    angle += 0.3 * speed;
    angle -= std::floor(angle);
    experience.next_states.insert(experience.next_states.end(), {angle, 0.5, 0.5});
    experience.actions[0].push_back(0.0);
    experience.rewards.push_back(std::cos(6.2831853 * angle));
    experience.ends.push_back(false);
  }
  EXPECT_EQ(relevant(experience), (std::vector<bool>{true, true, false}));
}

}  // namespace
}  // namespace sdnn::agents
