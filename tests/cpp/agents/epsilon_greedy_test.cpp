#include "sdnn/agents/epsilon_greedy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <vector>

#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using Row = std::vector<float>;

/// How often the first step takes each action, in `n` selections.
std::vector<int> counts_of(EpsilonGreedy policy, const Row& values, int n) {
  std::vector<int> counts(values.size());
  for (int i = 0; i < n; ++i) ++counts[policy.select(values, 0)];
  return counts;
}

std::size_t best_by(TieRule rule, const Row& values) {
  return EpsilonGreedy({.tie_rule = rule}, 1).select(values, 0);
}

// Eight values are compared at a time, then a rest of up to seven, so sizes have every remainder.
TEST(BestValue, IsTheLargestAtAnyIndex) {
  for (std::size_t size = 1; size < 70; ++size) {
    for (std::size_t at = 0; at < size; ++at) {
      std::vector<double> values(size, -3.0);
      values[at] = -1.5;
      EXPECT_EQ(best_value(std::span<const double>(values)), -1.5) << size << " " << at;
      Row floats(values.begin(), values.end());
      EXPECT_EQ(best_value(std::span<const float>(floats)), -1.5F) << size << " " << at;
    }
  }
}

TEST(BestValue, MayBeInfinite) {
  using testing::kInfinity;
  EXPECT_EQ(best_value(std::span<const double>(std::vector{0.0, kInfinity, -kInfinity})),
            kInfinity);
  EXPECT_EQ(best_value(std::span<const double>(std::vector(9, -kInfinity))), -kInfinity);
}

TEST(EpsilonGreedy, EveryTieRuleTakesASingleBestAction) {
  const Row values = {-3.0, 0.5, -1.0, 0.25};
  for (const TieRule rule : {TieRule::uniform, TieRule::lowest, TieRule::middle}) {
    EXPECT_EQ(best_by(rule, values), 1U);
  }
}

TEST(EpsilonGreedy, LowestTakesTheFirstOfTiedActions) {
  EXPECT_EQ(best_by(TieRule::lowest, {0, 2, 1, 2, 2}), 1U);
  EXPECT_EQ(best_by(TieRule::lowest, {0, 0, 0}), 0U);
}

TEST(EpsilonGreedy, MiddleTakesTheMiddleOfTheFirstLongestRunOfTies) {
  EXPECT_EQ(best_by(TieRule::middle, {0, 1, 1, 0, 1, 1, 1, 0}), 5U);
  EXPECT_EQ(best_by(TieRule::middle, {1, 1, 0, 1, 1}), 0U);  // even: rounded down; the first run
  EXPECT_EQ(best_by(TieRule::middle, {0, 1, 1, 1, 1}), 2U);
  EXPECT_EQ(best_by(TieRule::middle, Row(601)), 300U);  // a new network: no torque
  EXPECT_EQ(best_by(TieRule::middle, {1, 0, 1, 0, 2}), 4U);
}

TEST(EpsilonGreedy, ValuesWithinTheToleranceOfTheBestAreTies) {
  const Row values = {0.0, 0.75, 0.75, 0.5, 0.0, 1.0, 0.0};
  const auto selected = [&](TieRule rule, double tolerance) {
    return EpsilonGreedy({.tie_rule = rule, .tie_tolerance = tolerance}, 1).select(values, 0);
  };
  EXPECT_EQ(selected(TieRule::middle, 0.0), 5U);   // the best one alone
  EXPECT_EQ(selected(TieRule::middle, 0.25), 1U);  // the longest run of ties: 1 and 2
  EXPECT_EQ(selected(TieRule::middle, 0.5), 2U);   // 1, 2 and 3
  EXPECT_EQ(selected(TieRule::lowest, 0.5), 1U);
  const int n = 3000;
  const auto counts = counts_of(EpsilonGreedy({.tie_tolerance = 0.25}, 1), values, n);
  EXPECT_EQ(counts[1] + counts[2] + counts[5], n);
  const double sigma = std::sqrt(n / 3.0 * 2.0 / 3.0);
  for (const std::size_t action : {1U, 2U, 5U}) EXPECT_NEAR(counts[action], n / 3, 5 * sigma);
  for (const double bad : {-0.1, std::nan(""), testing::kInfinity}) {
    EXPECT_THROW(EpsilonGreedy({.tie_tolerance = bad}, 1), std::invalid_argument);
  }
}

TEST(EpsilonGreedy, UniformTakesEveryTiedActionEquallyOften) {
  const int n = 40000;
  const auto counts =
      counts_of(EpsilonGreedy({.tie_rule = TieRule::uniform}, 5), {1, 0, 1, 1, 0, 1}, n);
  EXPECT_EQ(counts[1] + counts[4], 0);
  const double sigma = std::sqrt(n * 0.25 * 0.75);
  for (const std::size_t action : {0U, 2U, 3U, 5U})
    EXPECT_NEAR(counts[action], 0.25 * n, 5 * sigma);
}

TEST(EpsilonGreedy, FirstStepsAreGreedyAndLaterOnesRandomWithProbabilityEpsilon) {
  EpsilonGreedy policy({}, 2);  // epsilon 0.1 after 10 steps
  Row values(50);
  values[7] = 1.0F;
  int others_early = 0, others_late = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    others_early += policy.select(values, i % 10) != 7;
    others_late += policy.select(values, 10 + i % 40) != 7;
  }
  EXPECT_EQ(others_early, 0);
  const double p = 0.1 * 49 / 50;  // one of 50 random actions is the best one
  EXPECT_NEAR(others_late, n * p, 5 * std::sqrt(n * p * (1 - p)));
}

TEST(EpsilonGreedy, RandomActionsAreUniformOverAllActions) {
  const EpsilonGreedy policy({.epsilon = 1.0, .n_greedy_steps = 0}, 3);
  const int n = 40000;
  for (const int count : counts_of(policy, {5, 0, 0, 0, 0}, n))
    EXPECT_NEAR(count, 0.2 * n, 5 * std::sqrt(n * 0.2 * 0.8));
}

TEST(EpsilonGreedy, EvaluationDoesNotChangeTheActionsOfLearning) {
  EpsilonGreedy alone({.n_greedy_steps = 5}, 8), evaluated = alone;
  const Row tied(30);
  for (int i = 0; i < 500; ++i) {
    for (int j = 0; j < i % 4; ++j) (void)evaluated.best_action(tied, evaluated.ties(false));
    EXPECT_EQ(alone.select(tied, i % 20), evaluated.select(tied, i % 20)) << i;
  }
}

TEST(EpsilonGreedy, EqualSeedsGiveEqualActionsAndOtherSeedsDifferentOnes) {
  EpsilonGreedy first({}, 1), same({}, 1), other_seed({}, 2);
  const Row tied(601);
  int differ = 0;
  for (int i = 0; i < 100; ++i) {
    const std::size_t action = first.select(tied, i);
    EXPECT_EQ(action, same.select(tied, i));
    differ += action != other_seed.select(tied, i);
  }
  EXPECT_GT(differ, 90);  // two of 601 random actions are rarely equal
}

// The maximum of values with NaN may be NaN or a number: values are refused or the number selected.
TEST(EpsilonGreedy, AnActionWithNaNIsNeverTaken) {
  for (const TieRule rule : {TieRule::uniform, TieRule::lowest, TieRule::middle}) {
    EXPECT_THROW(best_by(rule, {}), std::invalid_argument);
    EXPECT_THROW(best_by(rule, Row(2, std::nanf(""))), std::invalid_argument);
    for (std::size_t at = 0; at < 20; ++at) {
      Row values(20, 1.0F);
      values[at] = std::nanf("");
      try {
        EXPECT_NE(best_by(rule, values), at);
      } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(), "values must be numbers, got nan");
      }
    }
  }
}

}  // namespace
}  // namespace sdnn::agents
