#include "sdnn/agents/q_learning.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "approximators/lookup_table.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {
namespace {

using testing::LookupTable;
using Agent = QLearning<LookupTable>;
using Position = std::array<double, 1>;

/// The middle of cell `i` of five.
Position cell(int i) { return {(i + 0.5) / 5.0}; }

TEST(QLearning, EquationOneByHand) {
  Agent agent(LookupTable(1, 5, 2), {}, 1);  // alpha = 0.5, gamma = 0.9
  const auto q = [&](int s, std::size_t a) { return agent.action_value().value(cell(s), a); };
  agent.learn(cell(1), 0, 10.0, cell(2), true);  // 0.5 * 0 + 0.5 * 10
  EXPECT_EQ(q(1, 0), 5.0);
  agent.learn(cell(1), 0, 10.0, cell(2), true);  // 0.5 * 5 + 0.5 * 10
  EXPECT_EQ(q(1, 0), 7.5);
  agent.learn(cell(0), 1, -5.0, cell(1), false);  // 0.5 * 0 + 0.5 * (-5 + 0.9 * 7.5)
  EXPECT_DOUBLE_EQ(q(0, 1), 0.875);
  agent.learn(cell(0), 1, 0.0, cell(1), false);  // 0.5 * 0.875 + 0.5 * 0.9 * 7.5
  EXPECT_DOUBLE_EQ(q(0, 1), 3.8125);
  EXPECT_EQ(q(0, 0), 0.0);
  EXPECT_EQ(q(1, 1), 0.0);
}

TEST(QLearning, ATerminatedTransitionDoesNotBootstrapATruncatedOneDoes) {
  LookupTable table(1, 5, 2);
  table.correct(cell(2), 1, 20.0);
  Agent terminated(table, {}, 1);
  Agent truncated(table, {}, 1);
  terminated.learn(cell(1), 0, 1.0, cell(2), true);
  truncated.learn(cell(1), 0, 1.0, cell(2), false);
  EXPECT_EQ(terminated.action_value().value(cell(1), 0), 0.5);
  EXPECT_EQ(truncated.action_value().value(cell(1), 0), 9.5);  // 0.5 * (1 + 0.9 * 20)
}

// The next state's value is taken before the correction, also when it is the same state.
TEST(QLearning, ATransitionToItselfUsesTheOldValue) {
  LookupTable table(1, 5, 2);
  table.correct(cell(3), 0, 4.0);
  Agent agent(table, {}, 1);
  agent.learn(cell(3), 0, 2.0, cell(3), false);
  EXPECT_DOUBLE_EQ(agent.action_value().value(cell(3), 0), 0.5 * 4.0 + 0.5 * (2.0 + 0.9 * 4.0));
}

// Rewards 1, 2, 4, then the goal with 8; gamma = 1/2, alpha = 1: every number is exact.
TEST(QLearning, OfSeveralStepsATransitionIsLearnedOnceWhenTheyAreKnown) {
  LookupTable table(1, 5, 2);
  table.correct(cell(2), 1, 16.0);
  Agent agent(table, {.learning_rate = 1.0, .discount = 0.5, .n_steps = 2}, 1);
  const auto q = [&](int s) { return agent.action_value().value(cell(s), 0); };
  agent.begin_episode();
  agent.learn(cell(0), 0, 1.0, cell(1), false);
  EXPECT_EQ(q(0), 0.0);  // waits
  agent.learn(cell(1), 0, 2.0, cell(2), false);
  EXPECT_EQ(q(0), 1.0 + 0.5 * 2.0 + 0.25 * 16.0);
  EXPECT_EQ(q(1), 0.0);
  agent.learn(cell(2), 0, 4.0, cell(3), false);
  EXPECT_EQ(q(1), 2.0 + 0.5 * 4.0);  // Q of cell 3 is 0
  agent.learn(cell(3), 0, 8.0, cell(4), true);
  EXPECT_EQ(q(2), 4.0 + 0.5 * 8.0);
  EXPECT_EQ(q(3), 8.0);
  const LookupTable learned = agent.action_value();
  agent.begin_episode();  // nothing waits after a termination
  EXPECT_EQ(agent.action_value(), learned);
}

TEST(QLearning, WhatWaitsAtTheTimeLimitIsLearnedWhenTheNextEpisodeBegins) {
  LookupTable table(1, 5, 2);
  table.correct(cell(2), 1, 16.0);
  Agent agent(table, {.learning_rate = 1.0, .discount = 0.5, .n_steps = 5}, 1);
  const auto q = [&](int s) { return agent.action_value().value(cell(s), 0); };
  agent.learn(cell(0), 0, 1.0, cell(1), false);
  agent.learn(cell(1), 0, 2.0, cell(2), false);
  EXPECT_EQ(agent.action_value(), table);
  agent.begin_episode();
  EXPECT_EQ(q(0), 1.0 + 0.5 * 2.0 + 0.25 * 16.0);
  EXPECT_EQ(q(1), 2.0 + 0.5 * 16.0);
  agent.learn(cell(3), 0, 8.0, cell(4), true);  // of another episode
  EXPECT_EQ(q(3), 8.0);
  EXPECT_EQ(q(1), 2.0 + 0.5 * 16.0);
}

TEST(QLearning, ATransitionFromElsewhereBeginsAnew) {
  LookupTable table(1, 5, 2);
  table.correct(cell(2), 1, 16.0);
  Agent agent(table, {.learning_rate = 1.0, .discount = 0.5, .n_steps = 3}, 1);
  const auto q = [&](int s) { return agent.action_value().value(cell(s), 0); };
  agent.learn(cell(0), 0, 1.0, cell(1), false);
  agent.learn(cell(1), 0, 2.0, cell(2), false);
  EXPECT_EQ(agent.action_value(), table);
  agent.learn(cell(3), 0, 8.0, cell(4), true);  // not from cell 2
  EXPECT_EQ(q(0), 1.0 + 0.5 * 2.0 + 0.25 * 16.0);
  EXPECT_EQ(q(1), 2.0 + 0.5 * 16.0);
  EXPECT_EQ(q(3), 8.0);
}

TEST(QLearning, WhatCouldNotBeLearnedLaterIsRefusedAtOnce) {
  Agent agent(LookupTable(1, 5, 2), {.n_steps = 3}, 1);
  EXPECT_THROW(agent.learn(Position{1.5}, 0, 1.0, cell(1), false), std::invalid_argument);
  EXPECT_THROW(agent.learn(cell(0), 0, 1.0, Position{1.5}, false), std::invalid_argument);
  agent.begin_episode();
  EXPECT_EQ(agent.action_value(), LookupTable(1, 5, 2));
  for (const int bad : {0, -1, 1001}) {
    EXPECT_THROW(Agent(LookupTable(1, 5, 2), {.n_steps = bad}, 1), std::invalid_argument);
  }
}

/// A corridor of five cells; action 1 goes right, 0 left (not past the ends). Leaving cell 3 to the
/// right ends in the goal, with reward 1.
struct Corridor {
  static int next(int s, std::size_t a) { return a == 1 ? s + 1 : (s > 0 ? s - 1 : 0); }
  static bool is_goal(int s) { return s == 4; }
};

TEST(QLearning, ASmallDecisionProcessIsSolvedExactly) {
  Agent agent(LookupTable(1, 5, 2), {.learning_rate = 1.0, .discount = 0.9}, 1);
  for (int sweep = 0; sweep < 6; ++sweep) {
    for (int s = 0; s < 4; ++s) {
      for (const std::size_t a : {0U, 1U}) {
        const int next = Corridor::next(s, a);
        agent.learn(cell(s), a, Corridor::is_goal(next) ? 1.0 : 0.0, cell(next),
                    Corridor::is_goal(next));
      }
    }
  }
  std::array<double, 5> best{};  // V*(s) = 0.9^(3 - s)
  best[3] = 1.0;
  for (const std::size_t s : {2U, 1U, 0U}) best[s] = 0.9 * best[s + 1];
  for (int s = 0; s < 4; ++s) {
    const auto left = static_cast<std::size_t>(Corridor::next(s, 0));
    EXPECT_EQ(agent.action_value().value(cell(s), 1), best[static_cast<std::size_t>(s)]) << s;
    EXPECT_EQ(agent.action_value().value(cell(s), 0), 0.9 * best[left]) << s;
  }
}

TEST(QLearning, ByActingItFindsTheValuesOfTheSmallProcess) {
  Agent agent(LookupTable(1, 5, 2), {.policy = {.epsilon = 0.5, .n_greedy_steps = 0}}, 9);
  for (int episode = 0; episode < 2000; ++episode) {
    agent.begin_episode();
    for (int s = 0; !Corridor::is_goal(s);) {
      const std::size_t action = agent.act(cell(s));
      const int next = Corridor::next(s, action);
      agent.learn(cell(s), action, Corridor::is_goal(next) ? 1.0 : 0.0, cell(next),
                  Corridor::is_goal(next));
      s = next;
    }
  }
  for (int s = 0; s < 4; ++s) {
    EXPECT_NEAR(agent.action_value().value(cell(s), 1), std::pow(0.9, 3 - s), 1e-9);
    EXPECT_EQ(agent.act(cell(s), false), 1U);
  }
}

TEST(QLearning, StepsAreCountedFromTheBeginningOfAnEpisode) {
  LookupTable table(1, 5, 3);
  table.correct(cell(0), 2, 1.0);
  Agent agent(table, {.policy = {.epsilon = 1.0, .n_greedy_steps = 4}}, 3);
  int others = 0;
  for (int episode = 0; episode < 50; ++episode) {
    agent.begin_episode();
    for (int step = 0; step < 4; ++step) EXPECT_EQ(agent.act(cell(0)), 2U);
    for (int step = 4; step < 8; ++step) others += agent.act(cell(0)) != 2;
  }
  EXPECT_GT(others, 90);  // of 200, two thirds are expected
}

TEST(QLearning, EvaluationDoesNotDisturbLearning) {
  Agent alone(LookupTable(1, 5, 2), {.policy = {.epsilon = 0.3, .n_greedy_steps = 1}}, 6);
  Agent evaluated = alone;
  core::Random world(1, core::Stream::weights);
  for (int episode = 0; episode < 100; ++episode) {
    alone.begin_episode();
    evaluated.begin_episode();
    for (int step = 0; step < 6; ++step) {
      for (int i = 0; i < episode % 3; ++i) (void)evaluated.act(cell(i % 5), false);
      const Position state = cell(static_cast<int>(world.below(5)));
      const Position next = cell(static_cast<int>(world.below(5)));
      const std::size_t action = alone.act(state);
      ASSERT_EQ(action, evaluated.act(state));
      const double reward = world.uniform() < 0.1 ? 1.0 : 0.0;
      alone.learn(state, action, reward, next, false);
      evaluated.learn(state, action, reward, next, false);
    }
  }
  EXPECT_EQ(alone.action_value(), evaluated.action_value());
}

std::string message(const QLearningConfig& config) {
  try {
    Agent(LookupTable(1, 5, 2), config, 1);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(QLearning, NamesWhatIsImpossible) {
  EXPECT_EQ(message({.learning_rate = 0.0}), "learning_rate must be in (0, 1], got 0");
  EXPECT_EQ(message({.learning_rate = std::nan("")}), "learning_rate must be in (0, 1], got nan");
  EXPECT_EQ(message({.discount = 1.01}), "discount must be in [0, 1], got 1.01");
  EXPECT_EQ(message({.policy = {.epsilon = -1.0}}), "epsilon must be in [0, 1], got -1");
}

TEST(QLearning, ABadTransitionTeachesNothing) {
  Agent agent(LookupTable(1, 5, 2), {}, 1);
  const LookupTable before = agent.action_value();
  for (const double reward : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(agent.learn(cell(0), 0, reward, cell(1), false), std::invalid_argument);
  }
  EXPECT_THROW(agent.learn(Position{2.0}, 0, 1.0, cell(1), false), std::invalid_argument);
  EXPECT_THROW(agent.learn(cell(0), 0, 1.0, Position{-0.1}, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(std::vector<double>{0.1, 0.2}, 0, 1.0, cell(1), false),
               std::invalid_argument);
  EXPECT_EQ(agent.action_value(), before);
}

}  // namespace
}  // namespace sdnn::agents
