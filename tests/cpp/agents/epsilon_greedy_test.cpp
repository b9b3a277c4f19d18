#include "sdnn/agents/epsilon_greedy.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace sdnn::agents {
namespace {

using Row = std::vector<double>;

std::size_t best_by(TieRule rule, const Row& values) {
  return EpsilonGreedy({.tie_rule = rule}, 1).select(values, 0, true);
}

TEST(EpsilonGreedy, ASingleBestActionIsTakenByEveryRule) {
  const Row values = {-3.0, 0.5, -1.0, 0.25};
  for (const TieRule rule : {TieRule::uniform, TieRule::lowest, TieRule::middle}) {
    EXPECT_EQ(best_by(rule, values), 1U);
  }
}

TEST(EpsilonGreedy, LowestTakesTheFirstOfTheTied) {
  EXPECT_EQ(best_by(TieRule::lowest, {0, 2, 1, 2, 2}), 1U);
  EXPECT_EQ(best_by(TieRule::lowest, {0, 0, 0}), 0U);
}

TEST(EpsilonGreedy, MiddleTakesTheMiddleOfTheFirstWidestRun) {
  EXPECT_EQ(best_by(TieRule::middle, {0, 1, 1, 0, 1, 1, 1, 0}), 5U);
  EXPECT_EQ(best_by(TieRule::middle, {1, 1, 0, 1, 1}), 0U);  // even: rounded down; the first run
  EXPECT_EQ(best_by(TieRule::middle, {0, 1, 1, 1, 1}), 2U);
  EXPECT_EQ(best_by(TieRule::middle, Row(601, 0.0)), 300U);  // a new network: no torque
  EXPECT_EQ(best_by(TieRule::middle, {1, 0, 1, 0, 2}), 4U);
}

TEST(EpsilonGreedy, UniformTakesEveryTiedActionEquallyOften) {
  EpsilonGreedy policy({.tie_rule = TieRule::uniform}, 5);
  const Row values = {1, 0, 1, 1, 0, 1};
  std::array<int, 6> taken{};
  const int n = 40000;
  for (int i = 0; i < n; ++i) ++taken[policy.select(values, 0, true)];
  EXPECT_EQ(taken[1] + taken[4], 0);
  const double sigma = std::sqrt(n * 0.25 * 0.75);
  for (const std::size_t action : {0U, 2U, 3U, 5U}) EXPECT_NEAR(taken[action], n / 4, 5 * sigma);
}

TEST(EpsilonGreedy, TheFirstStepsAreGreedyAndLaterOnesRandomWithProbabilityEpsilon) {
  EpsilonGreedy policy({}, 2);  // epsilon 0.1 after 10 steps
  Row values(50, 0.0);
  values[7] = 1.0;
  int others_early = 0;
  int others_late = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    others_early += policy.select(values, i % 10, true) != 7;
    others_late += policy.select(values, 10 + i % 40, true) != 7;
  }
  EXPECT_EQ(others_early, 0);
  const double p = 0.1 * 49 / 50;  // a random action may be the best one
  EXPECT_NEAR(others_late, n * p, 5 * std::sqrt(n * p * (1 - p)));
}

TEST(EpsilonGreedy, RandomActionsAreUniformOverAllActions) {
  EpsilonGreedy policy({.epsilon = 1.0, .n_greedy_steps = 0}, 3);
  const Row values = {5, 0, 0, 0, 0};
  std::array<int, 5> taken{};
  const int n = 40000;
  for (int i = 0; i < n; ++i) ++taken[policy.select(values, 0, true)];
  for (const int count : taken) EXPECT_NEAR(count, n / 5, 5 * std::sqrt(n * 0.2 * 0.8));
}

TEST(EpsilonGreedy, WithoutExplorationEveryStepIsGreedy) {
  EpsilonGreedy policy({.epsilon = 1.0, .n_greedy_steps = 0}, 4);
  for (int step = 0; step < 100; ++step) EXPECT_EQ(policy.select(Row{0, 1, 0}, step, false), 1U);
}

TEST(EpsilonGreedy, EvaluationDoesNotDisturbTheStreamsOfLearning) {
  EpsilonGreedy alone({.n_greedy_steps = 5}, 8);
  EpsilonGreedy evaluated({.n_greedy_steps = 5}, 8);
  const Row tied(30, 0.0);
  for (int i = 0; i < 500; ++i) {
    for (int j = 0; j < i % 4; ++j) (void)evaluated.select(tied, i % 20, false);
    EXPECT_EQ(alone.select(tied, i % 20, true), evaluated.select(tied, i % 20, true)) << i;
  }
}

TEST(EpsilonGreedy, TheSameSeedGivesTheSameActionsAndAnotherSeedOthers) {
  EpsilonGreedy first({}, 1), same({}, 1), other({}, 2);
  const Row tied(601, 0.0);
  int differ = 0;
  for (int i = 0; i < 100; ++i) {
    const std::size_t action = first.select(tied, i, true);
    EXPECT_EQ(action, same.select(tied, i, true));
    differ += action != other.select(tied, i, true);
  }
  EXPECT_GT(differ, 90);
}

std::string message(const EpsilonGreedyConfig& config) {
  try {
    EpsilonGreedy(config, 1);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(EpsilonGreedy, NamesWhatIsImpossible) {
  EXPECT_EQ(message({.epsilon = 1.5}), "epsilon must be in [0, 1], got 1.5");
  EXPECT_EQ(message({.epsilon = std::nan("")}), "epsilon must be in [0, 1], got nan");
  EXPECT_EQ(message({.n_greedy_steps = -1}), "n_greedy_steps must be in [0, 1073741824], got -1");
  EpsilonGreedy policy({}, 1);
  EXPECT_THROW((void)policy.select(Row{}, 0, true), std::invalid_argument);
  for (const TieRule rule : {TieRule::uniform, TieRule::lowest, TieRule::middle}) {
    EXPECT_THROW((void)best_by(rule, Row(3, std::numeric_limits<double>::quiet_NaN())),
                 std::invalid_argument);
  }
}

}  // namespace
}  // namespace sdnn::agents
