#include "sdnn/agents/q_learning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "agents/lives.hpp"
#include "allocation_count.hpp"
#include "approximators/lookup_table.hpp"
#include "sdnn/approximators/decoupled.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"
#include "threads.hpp"

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
  table.update(cell(2), 1, 20.0);
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
  table.update(cell(3), 0, 4.0);
  Agent agent(table, {}, 1);
  agent.learn(cell(3), 0, 2.0, cell(3), false);
  EXPECT_DOUBLE_EQ(agent.action_value().value(cell(3), 0), 0.5 * 4.0 + 0.5 * (2.0 + 0.9 * 4.0));
}

// Rewards 1, 2, 4, then the goal with 8; gamma = 1/2, alpha = 1: every number is exact.
TEST(QLearning, OfSeveralStepsATransitionIsLearnedOnceWhenTheyAreKnown) {
  LookupTable table(1, 5, 2);
  table.update(cell(2), 1, 16.0);
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
  table.update(cell(2), 1, 16.0);
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
  table.update(cell(2), 1, 16.0);
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
  table.update(cell(0), 2, 1.0);
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

using approximators::Decoupled;
using approximators::RBFNetwork;
using approximators::SDNNC;
using Indices = std::vector<std::size_t>;

TEST(QLearning, ABadTransitionLeavesTheWholeStateAsItWas) {
  using Vectors = QLearning<Decoupled<RBFNetwork>>;
  Vectors agent(Decoupled<RBFNetwork>({RBFNetwork({.n_inputs = 1, .n_actions = 3}),
                                       RBFNetwork({.n_inputs = 1, .n_actions = 2})}),
                {.value_range = ValueRange::seen}, 1);
  agent.learn(cell(0), Indices{2, 1}, 1.0, cell(1), false);
  const core::State before = core::state_of(agent);
  for (const Indices& bad : {Indices{}, Indices{1}, Indices(40, 0), Indices{3, 0}, Indices{0, 2}}) {
    EXPECT_THROW(agent.learn(cell(0), bad, 1.0, cell(1), false), std::invalid_argument);
  }
  const std::vector<double> longer(40, 0.5), shorter;
  EXPECT_THROW(agent.learn(longer, Indices{0, 0}, 1.0, cell(1), false), std::invalid_argument);
  EXPECT_THROW(agent.learn(shorter, Indices{0, 0}, 1.0, cell(1), false), std::invalid_argument);
  EXPECT_THROW(agent.learn(cell(0), Indices{0, 0}, 1.0, longer, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(cell(0), Indices{0, 0}, testing::kNaN, cell(1), false),
               std::invalid_argument);
  EXPECT_THROW((void)agent.act(longer), std::invalid_argument);
  EXPECT_THROW((void)agent.act(Position{testing::kNaN}), std::invalid_argument);
  EXPECT_THROW((void)agent.act(shorter, false), std::invalid_argument);
  EXPECT_EQ(core::state_of(agent), before);
}

// With so many actions two drawn one after the other are the same hardly ever.
TEST(QLearning, ARandomActionLastsKStepsWithProbabilityOneKth) {
  constexpr int kLongest = 8, kDraws = 20000;
  Agent agent(LookupTable(1, 1, 1 << 17),
              {.policy = {.epsilon = 1.0, .n_greedy_steps = 0}, .max_repetitions = kLongest}, 4);
  std::array<int, kLongest + 1> at_least{};
  std::size_t last = agent.act(cell(0));
  int lasted = 1;
  for (int n = 0; n < kDraws;) {
    const std::size_t action = agent.act(cell(0));
    if (action == last) {
      ASSERT_LT(lasted++, kLongest);
      continue;
    }
    for (std::size_t k = 1; k <= static_cast<std::size_t>(lasted); ++k) ++at_least[k];
    last = action;
    lasted = 1;
    ++n;
  }
  for (int k = 1; k <= kLongest; ++k) {
    const double p = 1.0 / k;
    EXPECT_NEAR(at_least[static_cast<std::size_t>(k)], kDraws * p,
                5.0 * std::sqrt(kDraws * p * (1.0 - p)) + 1e-9)
        << k;
  }
}

TEST(QLearning, AKeptActionEndsWithTheEpisodeAndEvaluationDoesNotUseItUp) {
  LookupTable table(1, 1, 1 << 17);
  table.update(cell(0), 5, 1.0);
  Agent agent(table, {.policy = {.epsilon = 1.0, .n_greedy_steps = 0}, .max_repetitions = 1000}, 1);
  int n_kept = 0;
  for (int i = 0; i < 200; ++i) {
    agent.begin_episode();
    const std::size_t action = agent.act(cell(0));
    for (int j = 0; j < 3; ++j) EXPECT_EQ(agent.act(cell(0), false), 5U);
    n_kept += agent.act(cell(0)) == action;
    Agent begun = agent;
    begun.begin_episode();
    EXPECT_NE(begun.act(cell(0)), action);
  }
  EXPECT_NEAR(n_kept, 100, 36);  // P(d >= 2)
}

TEST(QLearning, TheFirstStepsOfALifeAreRandom) {
  LookupTable table(1, 1, 1 << 17);
  table.update(cell(0), 5, 1.0);
  for (const int longest : {1, 7}) {
    Agent agent(table,
                {.policy = {.epsilon = 0.0}, .max_repetitions = longest, .n_random_steps = 50}, 1);
    std::size_t last = 5;
    int n_repeated = 0;
    for (int i = 0; i < 50; ++i) {
      if (i % 20 == 19) agent.begin_episode();
      EXPECT_EQ(agent.act(cell(0), false), 5U);
      const std::size_t action = agent.act(cell(0));
      EXPECT_NE(action, 5U);
      n_repeated += action == last;
      last = action;
    }
    EXPECT_EQ(n_repeated > 5, longest > 1);
    agent.begin_episode();  // ends what may be kept
    for (int i = 0; i < 20; ++i) EXPECT_EQ(agent.act(cell(0)), 5U);
  }
  EXPECT_EQ(message({.n_random_steps = -1}), "n_random_steps must be in [0, 1073741824], got -1");
}

TEST(QLearning, ABadStateIsNoneOfTheFirstSteps) {
  QLearning<RBFNetwork> agent(RBFNetwork({.n_inputs = 1}),
                              {.policy = {.epsilon = 0.0}, .n_random_steps = 1}, 1);
  EXPECT_THROW((void)agent.act({{2.0}}), std::invalid_argument);
  EXPECT_EQ(testing::number_of<std::int32_t>(core::state_of(agent), "n_random_left"), 1);
  (void)agent.act(cell(0));
  EXPECT_FALSE(core::state_of(agent).contains("n_random_left"));
}

TEST(QLearning, WithoutRepetitionsTheirStreamIsNotTouched) {
  QLearning<RBFNetwork> agent(RBFNetwork({.n_inputs = 1}),
                              {.policy = {.epsilon = 1.0, .n_greedy_steps = 0}}, 1);
  const core::State before = core::state_of(agent);
  for (int i = 0; i < 10; ++i) (void)agent.act(cell(0));
  const core::State after = core::state_of(agent);
  EXPECT_EQ(after.at("repetitions.words"), before.at("repetitions.words"));
  EXPECT_NE(after.at("policy.exploration.words"), before.at("policy.exploration.words"));
}

TEST(QLearning, RatesGoInAStraightLineWithProgress) {
  Agent agent(LookupTable(1, 5, 2),
              {.learning_rate = 0.5,
               .policy = {.epsilon = 0.75},
               .final_learning_rate = 0.25,
               .final_epsilon = 0.0},
              1);
  EXPECT_EQ(agent.progress(), 0.0);
  EXPECT_EQ(agent.learning_rate(), 0.5);
  EXPECT_EQ(agent.epsilon(), 0.75);
  agent.set_progress(0.25);
  EXPECT_EQ(agent.learning_rate(), 0.4375);
  EXPECT_EQ(agent.epsilon(), 0.5625);
  agent.learn(cell(0), 0, 16.0, cell(1), true);
  EXPECT_EQ(agent.action_value().value(cell(0), 0), 7.0);
  agent.set_progress(1.0);
  EXPECT_EQ(agent.learning_rate(), 0.25);
  EXPECT_EQ(agent.epsilon(), 0.0);
  for (const double bad : {-1e-9, 1.0000001, testing::kNaN}) {
    EXPECT_THROW(agent.set_progress(bad), std::invalid_argument);
  }
  EXPECT_EQ(agent.progress(), 1.0);
  agent.set_progress(0.0);  // nothing is left of what was
  EXPECT_EQ(agent.learning_rate(), 0.5);
  Agent steady(LookupTable(1, 5, 2), {}, 1);
  steady.set_progress(0.9);
  EXPECT_EQ(steady.learning_rate(), 0.5);
  EXPECT_EQ(steady.epsilon(), 0.1);
}

TEST(QLearning, NamesWhatIsImpossibleOfWhatIsNotInThePaper) {
  EXPECT_EQ(message({.max_repetitions = 0}), "max_repetitions must be in [1, 1000000], got 0");
  EXPECT_EQ(message({.final_learning_rate = 0.0}), "final_learning_rate must be in (0, 1], got 0");
  EXPECT_EQ(message({.final_learning_rate = testing::kNaN}),
            "final_learning_rate must be in (0, 1], got nan");
  EXPECT_EQ(message({.final_epsilon = 1.5}), "final_epsilon must be in [0, 1], got 1.5");
}

/// A network of which counts from 4 to 36 stand for values from -16 to 16: all whole numbers.
approximators::SDNNCConfig network() {
  return {.n_inputs = 2,
          .n_pattern_units = 16,
          .n_anchor_patterns = 3,
          .n_interpolated = 3,
          .n_hidden_units = 60,
          .n_active_units = 40,
          .n_actions = 7,
          .q_low = -16.0,
          .q_high = 16.0,
          .u_low = 4,
          .u_high = 36};
}

// gamma = 1/2: the first sum is 8, so the range is 8 and a quarter more.
TEST(QLearning, TheRangeOfValuesFollowsTheRewards) {
  QLearning<SDNNC> agent(SDNNC(network(), 1), {.discount = 0.5, .value_range = ValueRange::seen},
                         1);
  const auto expect_range = [&agent](double low, double high) {
    EXPECT_EQ(agent.action_value().output_scale().q_low(), low);
    EXPECT_EQ(agent.action_value().output_scale().q_high(), high);
  };
  const std::vector<double> state = {0.3, 0.6};
  agent.learn(state, 0, 0.0, state, false);
  expect_range(-16.0, 16.0);  // nothing is known yet
  agent.learn(state, 0, 8.0, state, false);
  expect_range(0.0, 10.0);
  agent.learn(state, 0, -20.0, state, false);  // -20 + 8 / 2 = -16, and (10 + 16) / 4
  expect_range(-22.5, 10.0);
  agent.begin_episode();
  agent.learn(state, 0, 10.0, state, true);
  expect_range(-22.5, 10.0);
  for (int i = 0; i < 5; ++i) agent.learn(state, 0, 10.0, state, true);  // nothing followed
  expect_range(-22.5, 10.0);

  QLearning<SDNNC> given(SDNNC(network(), 1), {.discount = 0.5}, 1);
  given.learn(state, 0, 1000.0, state, false);
  EXPECT_EQ(given.action_value().output_scale().q_high(), 16.0);
}

QLearningConfig everything() {
  return {.policy = {.epsilon = 0.3, .n_greedy_steps = 2},
          .n_steps = 4,
          .max_repetitions = 5,
          .final_learning_rate = 0.25,
          .final_epsilon = 0.0,
          .value_range = ValueRange::seen,
          .n_random_steps = 20};
}

QLearning<SDNNC> sdnn_agent() {
  approximators::SDNNCConfig config = network();
  config.rounding = approximators::Rounding::random;
  config.averaging_interval = 9;
  return {SDNNC(config, 3), everything(), 3};
}

QLearning<RBFNetwork> rbf_agent() {
  return {RBFNetwork({.n_inputs = 2, .n_bases = 3, .n_actions = 7, .gradient_rate = 0.5}),
          everything(), 3};
}

QLearning<Decoupled<SDNNC>> vector_agent() {
  approximators::SDNNCConfig config = network();
  config.rounding = approximators::Rounding::random;
  std::vector<SDNNC> parts = {SDNNC(config, 3)};
  config.n_actions = 5;
  parts.emplace_back(config, approximators::seed_of_dimension(3, 1));
  return {Decoupled<SDNNC>(std::move(parts)), everything(), 3};
}

TEST(QLearning, GreedyActionsFollowTheAverageWhereThereIsOne) {
  approximators::SDNNCConfig config = network();
  config.averaging_interval = 5;
  QLearning<Decoupled<SDNNC>> averaging(
      Decoupled<SDNNC>({SDNNC(config, 3), SDNNC(config, 4)}),
      {.learning_rate = 1.0, .policy = {.tie_rule = TieRule::lowest}}, 3);
  core::Random random(1, core::Stream::weights);
  std::vector<double> state = {0.2, 0.8}, values(7);
  auto workspaces = averaging.action_value().workspace().parts;
  int n_other = 0;
  for (int t = 0; t < 300; ++t) {
    for (double& x : state) x = random.uniform();
    const double reward = 16.0 * random.uniform() - 8.0;
    averaging.learn(state, {random.below(7), random.below(7)}, reward, state, true);
    const auto greedy = averaging.act(state, false);
    const auto own = averaging.act(state);
    for (std::size_t d = 0; d < 2; ++d) {
      averaging.action_value().part(d).averaged_values(state, workspaces[d], values);
      ASSERT_EQ(greedy[d], std::ranges::max_element(values) - values.begin());
      n_other += greedy[d] != own[d];
    }
  }
  EXPECT_GT(n_other, 0);
}

// Between two updates many threads may choose greedy actions; equal ties streams, equal actions.
TEST(QLearning, ManyThreadsMayChooseGreedyActions) {
  auto agent = vector_agent();
  testing::World<decltype(agent)> world(agent.n_inputs(), 7);
  for (int t = 0; t < 300; ++t) world.tick(agent);
  const auto greedy_actions = [](const auto& learned) {
    core::Random random(5, core::Stream::sensor_noise), ties(1, core::Stream::evaluation_ties);
    auto workspace = learned.workspace();
    std::vector<double> state(learned.n_inputs());
    std::vector<std::vector<std::size_t>> actions;
    for (int i = 0; i < 50; ++i) {
      for (double& x : state) x = random.uniform();
      actions.push_back(learned.best_action(state, workspace, ties));
    }
    return actions;
  };
  const auto alone = agent;
  const auto expected = greedy_actions(alone);
  for (const auto& actions :
       testing::in_threads(4, [&](std::size_t) { return greedy_actions(agent); })) {
    EXPECT_EQ(actions, expected);
  }
}

TEST(QLearning, BestActionIsThatOfActWithoutExploring) {
  approximators::SDNNCConfig config = network();
  config.averaging_interval = 5;
  QLearning agent(SDNNC(config, 3), {.policy = {.tie_rule = TieRule::lowest}}, 3);
  testing::World<decltype(agent)> world(agent.n_inputs(), 7);
  for (int t = 0; t < 300; ++t) world.tick(agent);
  auto workspace = agent.workspace();
  core::Random ties(1, core::Stream::ties), random(5, core::Stream::sensor_noise);
  std::vector<double> state(agent.n_inputs());
  std::set<std::size_t> taken;
  for (int i = 0; i < 100; ++i) {
    for (double& x : state) x = random.uniform();
    const std::size_t action = agent.best_action(state, workspace, ties);
    EXPECT_EQ(action, agent.act(state, false));
    taken.insert(action);
  }
  EXPECT_GT(taken.size(), 1U);
}

TEST(QLearning, ALifeCanBeCutAnywhere) {
  testing::expect_that_a_life_can_be_cut(sdnn_agent);
  testing::expect_that_a_life_can_be_cut(rbf_agent);
  testing::expect_that_a_life_can_be_cut(vector_agent);
}

TEST(QLearning, ALifeInSeveralEnvironmentsCanBeCutAnywhere) {
  testing::expect_that_a_life_can_be_cut(rbf_agent, 2);
  testing::expect_that_a_life_can_be_cut(vector_agent, 3);
}

// As OfSeveralStepsATransitionIsLearnedOnceWhenTheyAreKnown, while another environment goes its
// way.
TEST(QLearning, EachEnvironmentHasStepsThatWait) {
  LookupTable table(2, 5, 2);
  Agent agent(table, {.learning_rate = 1.0, .discount = 0.5, .n_steps = 2}, 1);
  agent.set_n_environments(2);
  EXPECT_EQ(agent.n_environments(), 2U);
  const auto at = [](int i, int environment) {
    return std::array{(i + 0.5) / 5.0, environment == 0 ? 0.1 : 0.9};
  };
  const auto q = [&](int i, int environment) {
    return agent.action_value().value(at(i, environment), 0);
  };
  for (int i = 0; i < 2; ++i) {
    for (const int e : {0, 1}) {
      agent.learn(at(i, e), 0, e == 0 ? i + 1.0 : 8.0, at(i + 1, e), false,
                  static_cast<std::size_t>(e));
    }
  }
  EXPECT_EQ(q(0, 0), 1.0 + 0.5 * 2.0);
  EXPECT_EQ(q(0, 1), 8.0 + 0.5 * 8.0);
  EXPECT_EQ(q(1, 0), 0.0);
  agent.begin_episode(1);  // of the other nothing is learned
  EXPECT_EQ(q(1, 0), 0.0);
  EXPECT_EQ(q(1, 1), 8.0);
  agent.set_n_environments(1);
  EXPECT_EQ(q(1, 0), 0.0);
  agent.begin_episode();
  EXPECT_EQ(q(1, 0), 2.0);
}

TEST(QLearning, WhatWaitsOfEnvironmentsThatAreNoMoreIsLearned) {
  Agent agent(LookupTable(1, 5, 2), {.learning_rate = 1.0, .n_steps = 5}, 1);
  agent.set_n_environments(3);
  agent.learn(cell(2), 1, 4.0, cell(3), false, 2);
  EXPECT_EQ(agent.action_value().value(cell(2), 1), 0.0);
  agent.set_n_environments(2);
  EXPECT_EQ(agent.action_value().value(cell(2), 1), 4.0);
}

// All that other environments share with it is drawn and learned here, and in nobody's name.
TEST(QLearning, AnyOneOfSeveralEnvironmentsIsLikeTheOnlyOne) {
  auto alone = vector_agent();
  testing::World<decltype(alone)> world(2, 9);
  for (int t = 0; t < 300; ++t) world.tick(alone);
  for (const std::size_t environment : {0U, 2U}) {
    auto one_of_four = vector_agent();
    one_of_four.set_n_environments(4);
    testing::World<decltype(alone)> same_world(2, 9, environment);
    for (int t = 0; t < 300; ++t) same_world.tick(one_of_four);
    const core::State state = core::state_of(one_of_four);
    const std::string before =
        environment == 0 ? "" : "environment." + std::to_string(environment) + ".";
    for (const auto& [name, tensor] : core::state_of(alone)) {
      const bool is_shared = !state.contains("environment.1." + name);
      EXPECT_EQ(state.at(is_shared ? name : before + name), tensor) << name;
    }
    EXPECT_NE(state.at(before + "waiting.next_state"),
              state.at("environment.1.waiting.next_state"));
  }
}

TEST(QLearning, RefusesEnvironmentsThatAreNone) {
  Agent agent(LookupTable(1, 5, 2), {}, 1);
  agent.set_n_environments(2);
  EXPECT_THROW((void)agent.act(cell(0), true, 2), std::invalid_argument);
  EXPECT_THROW((void)agent.act(cell(0), false, 2), std::invalid_argument);
  EXPECT_THROW(agent.begin_episode(2), std::invalid_argument);
  EXPECT_THROW(agent.learn(cell(0), 0, 1.0, cell(1), false, 2), std::invalid_argument);
  EXPECT_THROW(agent.set_n_environments(0), std::invalid_argument);
  EXPECT_THROW(agent.set_n_environments((1U << 20U) + 1U), std::invalid_argument);
  EXPECT_EQ(agent.n_environments(), 2U);
  EXPECT_EQ(agent.action_value(), LookupTable(1, 5, 2));
}

TEST(QLearning, RefusesAStateOfEnvironmentsThatDoesNotFit) {
  auto agent = rbf_agent();
  agent.set_n_environments(3);
  for (int t = 0; t < 20; ++t) (void)agent.act(std::vector{0.5, 0.5});  // until none is left
  testing::expect_that_damage_is_refused(agent);
  const core::State good = core::state_of(agent);
  const auto refused = [&](const core::State& bad, const std::string& message) {
    testing::expect_refused(agent, bad, "state: environment.2." + message);
  };
  refused(testing::with_number(good, "environment.2.step", -1), "step must be 0 or more");
  refused(testing::with_number(good, "environment.2.kept_action", std::int64_t{7}),
          "kept_action must be an action");
  refused(testing::with_number(good, "environment.2.range.sum", testing::kNaN),
          "range.sum must be a finite sum");
  core::State bad = good;  // a second one is missing
  std::erase_if(bad, [](const auto& item) { return item.first.starts_with("environment.1."); });
  testing::expect_refused(agent, bad, "state: environment.2.kept_action must not be there");
}

TEST(QLearning, RatesFallByEqualFactorsWithAnExponentialSchedule) {
  const QLearningConfig config{.learning_rate = 1.0,
                               .policy = {.epsilon = 0.5},
                               .final_learning_rate = 0.0625,
                               .final_epsilon = 0.125,
                               .schedule = Schedule::exponential};
  Agent agent(LookupTable(1, 5, 2), config, 1);
  EXPECT_EQ(agent.learning_rate(), 1.0);
  agent.set_progress(0.5);
  EXPECT_DOUBLE_EQ(agent.learning_rate(), 0.25);
  EXPECT_DOUBLE_EQ(agent.epsilon(), 0.25);
  agent.set_progress(0.75);
  EXPECT_DOUBLE_EQ(agent.learning_rate(), 0.125);
  EXPECT_EQ(config.learning_rate_at(0.75), agent.learning_rate());
  EXPECT_EQ(config.epsilon_at(0.75), agent.epsilon());
  agent.set_progress(1.0);
  EXPECT_EQ(agent.learning_rate(), 0.0625);
  EXPECT_EQ(agent.epsilon(), 0.125);
  const Agent steady(LookupTable(1, 5, 2), {.schedule = Schedule::exponential}, 1);
  EXPECT_EQ(steady.config().learning_rate_at(0.7), 0.5);
}

TEST(QLearning, AnExponentialScheduleStaysBetweenItsEnds) {
  core::Random random(3, core::Stream::weights);
  for (int i = 0; i < 2000; ++i) {
    const double first = 1.0 - random.uniform();
    const double last = i % 3 == 0 ? first : 1e-300 + random.uniform() * random.uniform();
    const QLearningConfig config{
        .learning_rate = first, .final_learning_rate = last, .schedule = Schedule::exponential};
    const double progress = random.uniform();
    const double rate = config.learning_rate_at(progress);
    ASSERT_GE(rate, std::min(first, last));
    ASSERT_LE(rate, std::max(first, last));
    ASSERT_NEAR(std::log(rate), (1.0 - progress) * std::log(first) + progress * std::log(last),
                1e-11);
    ASSERT_EQ(config.learning_rate_at(0.0), first);
    ASSERT_EQ(config.learning_rate_at(1.0), last);
  }
}

TEST(QLearning, EpsilonMayReachItsFinalValueBeforeTheEnd) {
  const QLearningConfig config{.learning_rate = 1.0,
                               .policy = {.epsilon = 0.5},
                               .final_learning_rate = 0.5,
                               .final_epsilon = 0.125,
                               .exploration_fraction = 0.25};
  Agent agent(LookupTable(1, 5, 2), config, 1);
  EXPECT_EQ(agent.epsilon(), 0.5);
  agent.set_progress(0.125);
  EXPECT_EQ(agent.epsilon(), 0.3125);
  EXPECT_EQ(agent.learning_rate(), 0.9375);
  for (const double progress : {0.25, 0.3, 1.0}) {
    agent.set_progress(progress);
    EXPECT_EQ(agent.epsilon(), 0.125);
  }
  QLearningConfig exponential = config;
  exponential.schedule = Schedule::exponential;
  EXPECT_DOUBLE_EQ(exponential.epsilon_at(0.125), 0.25);
  EXPECT_EQ(exponential.epsilon_at(0.3), 0.125);
  EXPECT_EQ(message({.exploration_fraction = 0.0}),
            "exploration_fraction must be in (0, 1], got 0");
  EXPECT_EQ(message({.exploration_fraction = 1.5}),
            "exploration_fraction must be in (0, 1], got 1.5");
  const Agent steady(LookupTable(1, 5, 2), {.exploration_fraction = 0.25}, 1);
  EXPECT_EQ(steady.config().epsilon_at(0.1), 0.1);
}

TEST(QLearning, AnExponentialScheduleHasNoEndAtZero) {
  EXPECT_EQ(message({.final_epsilon = 0.0, .schedule = Schedule::exponential}),
            "final_epsilon must be greater than 0 where the schedule is exponential, got 0");
  EXPECT_EQ(
      message(
          {.policy = {.epsilon = 0.0}, .final_epsilon = 0.5, .schedule = Schedule::exponential}),
      "epsilon must be greater than 0 where the schedule is exponential, got 0");
  EXPECT_EQ(message({.policy = {.epsilon = 0.0}, .schedule = Schedule::exponential}), "no error");
}

TEST(QLearning, RatesThatAreSetStayWhateverTheProgress) {
  Agent agent(LookupTable(1, 5, 2),
              {.learning_rate = 0.5, .final_learning_rate = 0.25, .final_epsilon = 0.0}, 1);
  agent.set_learning_rate(0.75);
  EXPECT_EQ(agent.learning_rate(), 0.75);
  agent.set_progress(1.0);
  EXPECT_EQ(agent.learning_rate(), 0.75);
  EXPECT_EQ(agent.epsilon(), 0.0);
  agent.learn(cell(0), 0, 16.0, cell(1), true);
  EXPECT_EQ(agent.action_value().value(cell(0), 0), 12.0);
  agent.set_epsilon(1.0);
  agent.set_learning_rate(std::nullopt);
  EXPECT_EQ(agent.learning_rate(), 0.25);
  EXPECT_EQ(agent.epsilon(), 1.0);
  for (const double bad : {-0.1, 1.1, testing::kNaN}) {
    EXPECT_THROW(agent.set_learning_rate(bad), std::invalid_argument);
    EXPECT_THROW(agent.set_epsilon(bad), std::invalid_argument);
  }
  EXPECT_THROW(agent.set_learning_rate(0.0), std::invalid_argument);
  EXPECT_EQ(agent.epsilon(), 1.0);
  auto saved = rbf_agent();
  EXPECT_FALSE(core::state_of(saved).contains("learning_rate"));
  saved.set_learning_rate(0.75);
  saved.set_epsilon(0.5);
  const core::State good = core::state_of(saved);
  for (const double bad : {0.0, 1.1, testing::kNaN}) {
    testing::expect_refused(saved, testing::with_number(good, "learning_rate", bad),
                            "state: learning_rate must be in (0, 1]");
  }
  testing::expect_refused(saved, testing::with_number(good, "epsilon", -0.1),
                          "state: epsilon must be in [0, 1]");
  auto other = rbf_agent();
  core::restore(other, good);
  EXPECT_EQ(other.learning_rate(), 0.75);
  EXPECT_EQ(other.epsilon(), 0.5);
}

TEST(QLearning, ARestoredAgentAllocatesNothing) {
  testing::expect_that_a_restored_agent_allocates_nothing(sdnn_agent, testing::allocation_count);
  testing::expect_that_a_restored_agent_allocates_nothing(rbf_agent, testing::allocation_count);
}

// All numbers are multiples of 1/4: the errors of one dimension have no rounding.
TEST(QLearning, OfOneDimensionDoesWhatAnAgentWithoutDimensionsDoes) {
  const QLearningConfig config{
      .discount = 0.5, .policy = {.epsilon = 0.3, .n_greedy_steps = 2}, .max_repetitions = 3};
  QLearning<SDNNC> plain(SDNNC(network(), 3), config, 3);
  QLearning<Decoupled<SDNNC>> decoupled(Decoupled<SDNNC>({SDNNC(network(), 3)}), config, 3);
  testing::World<QLearning<SDNNC>> world(2, 9);
  testing::World<QLearning<Decoupled<SDNNC>>> same_world(2, 9);
  for (int t = 0; t < 4000; ++t) {
    const auto action = world.tick(plain);
    const auto same = same_world.tick(decoupled);
    ASSERT_EQ(same, action ? std::optional(Indices{*action}) : std::nullopt) << t;
  }
  EXPECT_GT(plain.action_value().correction_counts().changed, 1000U);
  core::State state;
  for (const auto& [name, tensor] : core::state_of(decoupled)) {
    const std::string part = "action_value.0.";
    state.emplace(name.starts_with(part) ? "action_value." + name.substr(part.size()) : name,
                  tensor);
  }
  EXPECT_EQ(core::state_of(plain), state);
}

TEST(QLearning, RefusesAStateThatDoesNotFit) {
  auto agent = sdnn_agent();
  testing::World<QLearning<SDNNC>> world(2, 7);
  const core::State young = core::state_of(agent);
  while (core::state_of(agent).contains("n_random_left")) world.tick(agent);
  while (testing::number_of<std::int32_t>(core::state_of(agent), "n_kept") == 0 ||
         core::state_of(agent).at("waiting.rewards").size() < 2) {
    world.tick(agent);
  }
  agent.set_learning_rate(std::nullopt);  // what may be missing
  agent.set_epsilon(std::nullopt);
  testing::expect_that_damage_is_refused(agent);
  const core::State good = core::state_of(agent);
  using testing::with_number;
  const auto refused = [&](const core::State& bad, const std::string& message) {
    testing::expect_refused(agent, bad, "state: " + message);
  };
  for (const std::int64_t bad : {-1, 7}) {
    refused(with_number(good, "waiting.actions", bad, 1), "waiting.actions must be of actions");
    refused(with_number(good, "kept_action", bad), "kept_action must be an action");
  }
  refused(with_number(good, "waiting.rewards", testing::kNaN, 1), "waiting.rewards must be finite");
  refused(with_number(good, "waiting.states", testing::kNaN, 3),
          "waiting.states must be in [0, 1]");
  for (const int bad : {-1, 21}) {
    refused(with_number(young, "n_random_left", bad),
            "n_random_left must be in [0, n_random_steps]");
  }
  refused(with_number(good, "step", -1), "step must be 0 or more");
  refused(with_number(good, "n_kept", -1), "n_kept must be in [0, max_repetitions)");
  refused(with_number(good, "n_kept", 5), "n_kept must be in [0, max_repetitions)");
  for (const double bad : {testing::kNaN, -0.1, 1.1}) {
    refused(with_number(good, "progress", bad), "progress must be in [0, 1]");
  }
  refused(with_number(good, "range.low", testing::kNaN), "range.low must be finite");
  core::State bad = good;
  bad["kept_action"] = testing::tensor_of<std::int64_t>({0, 0});
  refused(bad, "kept_action must be one per dimension");
  bad = good;  // as many as the ring has places: the next would have none
  bad["waiting.rewards"] = testing::tensor_of(std::vector<double>(4, 0.0));
  bad["waiting.actions"] = testing::tensor_of(std::vector<std::int64_t>(4, 0));
  bad["waiting.states"] = testing::tensor_of(std::vector<double>(8, 0.0));
  refused(bad, "waiting.rewards must be fewer than n_steps");
  bad = good;
  for (std::size_t i = 0; i < 4; ++i) {
    bad = with_number(bad, "policy.ties.words", std::uint64_t{0}, i);
  }
  refused(bad, "policy.ties.words must be not all 0");
}

}  // namespace
}  // namespace sdnn::agents
