#include "sdnn/agents/return_range.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

/// An environment whose rewards the range follows; `note` returns whether the range has moved.
struct RewardStream {
  explicit RewardStream(double discount) : range(discount), rewards(range.no_rewards()) {}

  bool note(double reward, bool terminated = false, double dt = 1.0) {
    return range.note(reward, terminated, rewards, dt);
  }
  /// An episode with a reward of 1 in each step.
  void note_episode(int n_steps, double reward = 1.0, bool terminates = true) {
    for (int t = 1; t <= n_steps; ++t) note(reward, terminates && t == n_steps);
  }

  ReturnRange range;
  ReturnRange::Rewards rewards;
};

void expect_range(const ReturnRange& range, double low, double high) {
  EXPECT_EQ(range.low(), low);
  EXPECT_EQ(range.high(), high);
}

// gamma = 15/16: every number is exact. `note` returns whether the range has moved. At first it has
// to contain the sums of past rewards: each reward plus gamma times the sum before, as in 5 + 15.
TEST(ReturnRange, GrowsAtFirstByAQuarterMoreThanNeeded) {
  RewardStream environment(0.9375);  // no returns before 64 steps
  EXPECT_FALSE(environment.range.is_known());
  EXPECT_FALSE(environment.note(0.0));
  EXPECT_FALSE(environment.range.is_known());
  EXPECT_TRUE(environment.note(16.0));  // 16 + 16 / 4
  EXPECT_TRUE(environment.range.is_known());
  expect_range(environment.range, 0.0, 20.0);
  EXPECT_FALSE(environment.note(5.0));  // 5 + 15 = 20, still inside
  EXPECT_TRUE(environment.note(5.25));  // 5.25 + 18.75 = 24, and 24 / 4
  expect_range(environment.range, 0.0, 30.0);
  EXPECT_TRUE(environment.note(-42.5));  // -42.5 + 22.5 = -20, and (30 + 20) / 4
  expect_range(environment.range, -32.5, 30.0);
}

// The return of a reward of 1 every 100 steps is 1 / (1 - 0.99^100) = 1.58, and of 1 in each tenth
// of a step 1 / (1 - 0.99^0.1) = 995.5; without durations it would be 100 for both.
TEST(ReturnRange, DiscountsByDurations) {
  RewardStream rare(0.99), frequent(0.99);
  for (int i = 0; i < 20000; ++i) {
    rare.note(1.0, false, 100.0);
    frequent.note(1.0, false, 0.1);
  }
  const double margin = 1.25;
  EXPECT_GE(rare.range.high(), 1.57);
  EXPECT_LE(rare.range.high(), 1.6 * margin);
  EXPECT_GE(frequent.range.high(), 990.0);
  EXPECT_LE(frequent.range.high(), 1000.0 * margin);
}

// The range contains 0, and is a quarter wider than needed.
TEST(ReturnRange, OfNegativeRewardsEndsAtZero) {
  RewardStream environment(1.0);
  EXPECT_TRUE(environment.note(-4.0));
  expect_range(environment.range, -5.0, 0.0);
}

// Episodes of one step: returns are rewards, from -20 to 79. The lowest twentieth and the highest
// fiftieth count as rare; without these five and two the returns are -15 to 77, a width of 92.
// Above there is room for a quarter of it.
TEST(ReturnRange, ContainsAllButTheRarestReturns) {
  RewardStream environment(0.5);
  for (int i = 1; i <= 100; ++i) environment.note(i - 21.0, true);
  EXPECT_LE(environment.range.low(), -15.0);
  EXPECT_GE(environment.range.low(), -17.0);  // that of fewer returns is kept where it fits
  EXPECT_GE(environment.range.high(), 77.0);
  EXPECT_LE(environment.range.high(), 77.0 + 92.0 / 4);
}

// Rewards of -200, then of -1: the range may be twice as wide as the lowest return needs.
TEST(ReturnRange, ShrinksWithReturns) {
  const double sum_of_15_steps = (1.0 - std::pow(0.99, 15)) / (1.0 - 0.99);
  RewardStream environment(0.99);
  for (int i = 0; i < 200; ++i) environment.note_episode(15, -200.0);
  EXPECT_LT(environment.range.low(), -200.0 * 0.75 * sum_of_15_steps);
  for (int i = 0; i < 400; ++i) environment.note_episode(15, -1.0);
  EXPECT_GT(environment.range.low(), -2.1 * sum_of_15_steps);
  EXPECT_LE(environment.range.low(), -sum_of_15_steps + 1.0);
  EXPECT_EQ(environment.range.high(), 0.0);
}

// A return counts as at most one width beyond the range: two widths, and a margin of a quarter.
TEST(ReturnRange, OneOutlierWidensItAtMostTwoAndAHalfTimes) {
  for (const double outlier : {1e3, 1e6, -1e3, -1e6, 1e300}) {
    for (const bool terminates : {true, false}) {
      RewardStream environment(0.99);
      for (int i = 0; i < 400; ++i) environment.note_episode(50, 1.0, terminates);
      const double width = environment.range.high() - environment.range.low();
      environment.note(outlier);
      for (int i = 0; i < 400; ++i) {
        environment.note_episode(50, 1.0, terminates);
        EXPECT_LE(environment.range.high() - environment.range.low(), 2.5 * width) << outlier;
      }
    }
  }
}

// The return of a reward of 1 in each step is 100, whatever the limit; a terminated episode's less.
TEST(ReturnRange, TruncatedEpisodesCountWithTheirFutureRewards) {
  for (const int limit : {10, 50, 200, 1000}) {
    RewardStream limited(0.99), ended(0.99);
    for (int i = 0; i < 20000 / limit; ++i) {
      limited.note_episode(limit, 1.0, false);
      ended.note_episode(limit);
    }
    EXPECT_GE(limited.range.high(), 100.0) << limit;
    EXPECT_LE(limited.range.high(), 100.0 * 1.25 + 1.0) << limit;
    const double discounted_sum = (1.0 - std::pow(0.99, limit)) / (1.0 - 0.99);
    EXPECT_GE(ended.range.high(), 0.9 * discounted_sum) << limit;
    EXPECT_LE(ended.range.high(), 1.5 * discounted_sum) << limit;
  }
}

TEST(ReturnRange, IsKnownFromTheFirstOfRareRewards) {
  RewardStream environment(0.99);
  for (int i = 0; i < 500; ++i) environment.note_episode(20, 0.0);
  EXPECT_FALSE(environment.range.is_known());
  environment.note(1.0, true);
  expect_range(environment.range, 0.0, 1.25);  // a quarter wider than needed
}

TEST(ReturnRange, EnvironmentsHaveSeparateRewards) {
  ReturnRange range(1.0);
  ReturnRange::Rewards first = range.no_rewards(), second = range.no_rewards();
  EXPECT_TRUE(range.note(8.0, false, first));
  EXPECT_FALSE(range.note(9.0, false, second));  // 17 if it were the same episode
  expect_range(range, 0.0, 10.0);
}

TEST(ReturnRange, MovesFewerThan40TimesIn10000Steps) {
  RewardStream environment(0.9);
  core::Random random(1, core::Stream::weights);
  int n_moves = 0;
  for (int i = 0; i < 10000; ++i) {
    n_moves += environment.note(std::exp(10.0 * random.uniform()) - 100.0, random.below(30) == 0);
  }
  EXPECT_LT(n_moves, 40);
}

// Sums of rewards are clipped to 1e300; the margin is a quarter of the width, at most 2e300.
TEST(ReturnRange, StaysFiniteWithHugeRewards) {
  RewardStream environment(1.0);
  for (int i = 0; i < 9000; ++i)
    environment.note(1e300 * (i / 700 % 2 == 0 ? 1.0 : -1.0), i % 2000 == 0);
  EXPECT_LT(environment.range.high(), 1.7e300);
  EXPECT_GT(environment.range.low(), -1.7e300);
  ReturnRange restored(1.0);
  core::restore(restored, core::state_of(environment.range));  // a range this wide can be saved
  EXPECT_EQ(core::state_of(restored), core::state_of(environment.range));
}

TEST(ReturnRange, RefusesInconsistentStates) {
  constexpr std::size_t kFewest = 32, kMost = 256;  // returns that are remembered after 1,000
  RewardStream environment(0.5);
  for (int i = 0; i < 1000; ++i) environment.note(8.0, i % 2 == 0);
  ReturnRange& range = environment.range;
  testing::expect_damaged_states_refused(range);
  const core::State good = core::state_of(range);
  const auto refused = [&](const core::State& bad, const std::string& name) {
    testing::expect_refused(range, bad, "state: " + name + " must be ");
  };
  for (const double bad : {testing::kNaN, testing::kInfinity, -testing::kInfinity}) {
    for (const char* name : {"low", "high", "returns"}) {
      refused(testing::with_number(good, name, bad), name);
    }
  }
  refused(testing::with_number(good, "low", 1.0), "low");
  refused(testing::with_number(good, "high", -1.0), "high");
  refused(testing::with_number(good, "oldest", std::uint64_t{kMost}), "oldest");
  refused(testing::with_number(good, "due", std::uint64_t{1} << 40), "due");
  core::State bad = good;
  bad["returns"] = testing::tensor_of(std::vector<double>(kMost + 1, 0.0));
  refused(bad, "returns");
  bad["returns"] = testing::tensor_of(std::vector<double>(kFewest - 1, 0.0));
  refused(bad, "oldest");  // that of a full list
  bad["oldest"] = core::state_of(ReturnRange(0.5)).at("oldest");
  refused(bad, "returns");
}

}  // namespace
}  // namespace sdnn::agents
