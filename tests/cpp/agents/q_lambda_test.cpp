#include "sdnn/agents/q_lambda.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "agents/random_task.hpp"
#include "instruction_sets.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using approximators::LinearSDNN;
using approximators::LinearSDNNConfig;
using Indices = std::vector<std::size_t>;
using State = std::vector<double>;

QLambda agent_of(const QLambdaConfig& config, std::vector<std::size_t> n_actions = {3},
                 int window = 1, std::uint64_t seed = 1) {
  return {
      LinearSDNN(
          {.n_inputs = 2, .n_pattern_units = 40, .action_window = window, .averaging_interval = 3},
          n_actions, seed),
      config, seed};
}

/// Q(state, action).
double q(const QLambda& agent, const State& state, std::size_t action) {
  auto workspace = agent.workspace();
  return agent.values(state, workspace)[action];
}

/// Steps between random states, with random rewards; a tenth of them terminates.
void learn_at_random(QLambda& agent, int n_steps, std::uint64_t seed) {
  core::Random random(seed, core::Stream::useless_inputs);
  State state{random.uniform(), random.uniform()};
  for (int step = 0; step < n_steps; ++step) {
    const auto action = agent.act(state);
    const State next{random.uniform(), random.uniform()};
    const bool terminated = random.below(10) == 0;
    agent.learn(state, action, random.normal(), next, terminated);
    state = next;
    if (terminated) agent.begin_episode();
  }
}

// With a discount of 1/2, a learning rate of 1 and no trace: Q(a, 0) = 1 + 8 / 2.
TEST(QLambda, TargetsOfOneStepAreAsWorkedByHand) {
  QLambda agent = agent_of({.learning_rate = 1.0,
                            .discount = 0.5,
                            .trace_decay = 0.0,
                            .bootstrap = Bootstrap::sarsa,
                            .final_learning_rate = {}});
  const State a{0.1, 0.1}, b{0.9, 0.9};
  agent.learn(b, Indices{2}, 8.0, b, true);
  EXPECT_NEAR(q(agent, b, 2), 8.0, 1e-3);
  agent.learn(a, Indices{0}, 1.0, b, false);
  EXPECT_EQ(q(agent, a, 0), 0.0);  // pending until the next action is known
  agent.learn(b, Indices{2}, 8.0, b, true);
  EXPECT_NEAR(q(agent, a, 0), 5.0, 0.5);
}

// gamma = 1/2: the next value is discounted by 1/4 over two steps, by sqrt(1/2) over half a step.
TEST(QLambda, DurationsDiscountTargets) {
  const State a{0.1, 0.1}, b{0.9, 0.9};
  for (const auto& [dt, remaining] : {std::pair(2.0, 0.25), std::pair(0.5, std::sqrt(0.5))}) {
    QLambda agent = agent_of({.learning_rate = 1.0, .discount = 0.5, .final_learning_rate = {}});
    agent.learn(b, Indices{2}, 8.0, b, true);
    agent.learn(a, Indices{0}, 1.0, b, false, 0, {}, dt);
    EXPECT_NEAR(q(agent, a, 0), 1.0 + remaining * 8.0, 1e-3);
  }
  QLambda agent = agent_of({});
  for (const double bad : {0.0, -1.0, 1e-4, 1e7, testing::kNaN, testing::kInfinity}) {
    const core::State before = core::state_of(agent);
    EXPECT_THROW(agent.learn(a, Indices{0}, 1.0, b, false, 0, {}, bad), std::invalid_argument);
    EXPECT_EQ(core::state_of(agent), before);
  }
}

// With alpha = 1 and gamma = 1/2, an error of 8 after two transitions moves the first one's value
// by lambda times the discount of the first transition, not that of the second.
TEST(QLambda, TracesDecayByTheDurationOfTheTransitionBefore) {
  const State a{0.1, 0.1}, b{0.5, 0.9}, c{0.9, 0.4};
  for (const double dt : {1.0, 3.0}) {
    QLambda agent = agent_of({.learning_rate = 1.0,
                              .discount = 0.5,
                              .trace_decay = 0.5,
                              .traces = TraceKind::replacing,
                              .final_learning_rate = {}},
                             {3}, 1, 2);
    agent.learn(a, Indices{0}, 0.0, b, false, 0, {}, dt);
    agent.learn(b, Indices{1}, 8.0, c, true, 0, {}, 7.0);
    EXPECT_NEAR(q(agent, a, 0), 0.5 * std::pow(0.5, dt) * 8.0, 0.01);
  }
}

// After t steps rates have gone t / (t + schedule_steps) of the way to their final values.
TEST(QLambda, RatesAreHalfwayAfterScheduleSteps) {
  QLambda agent = agent_of({.learning_rate = 1.0,
                            .policy = {.epsilon = 0.5, .n_greedy_steps = 0},
                            .schedule_steps = 100,
                            .final_learning_rate = 0.5,
                            .final_epsilon = 0.25});
  EXPECT_EQ(agent.learning_rate(), 1.0);
  learn_at_random(agent, 100, 1);
  EXPECT_EQ(agent.learning_rate(), 0.75);
  EXPECT_EQ(agent.epsilon(), 0.375);
  agent.set_learning_rate(0.125);
  EXPECT_EQ(agent.learning_rate(), 0.125);
  agent.set_learning_rate({});
  EXPECT_EQ(agent.learning_rate(), 0.75);
}

QLambdaConfig with_tolerance(double tolerance) {
  return {.policy = {.epsilon = 0.0,
                     .n_greedy_steps = 0,
                     .tie_rule = TieRule::lowest,
                     .tie_tolerance = tolerance},
          .final_learning_rate = {}};
}

// Rewards of 1 and 0.8 tie within 0.25, of 1 and 0.7 do not, at any scale of rewards.
TEST(QLambda, TheToleranceOfTiesIsInUnitsOfValues) {
  const State a{0.1, 0.1};
  for (const double scale : {1.0, 1e-300, 1e250}) {
    QLambda agent = agent_of(with_tolerance(0.25 * scale));
    const auto first_after = [&](double reward) {
      agent.learn(a, Indices{0}, reward * scale, a, true);
      EXPECT_NEAR(q(agent, a, 0) / scale, reward, 0.01);
      return agent.act(a).front();
    };
    EXPECT_EQ(agent.act(a).front(), 0U);
    agent.learn(a, Indices{2}, scale, a, true);
    EXPECT_EQ(first_after(0.8), 0U);
    EXPECT_EQ(first_after(0.7), 2U);
    // A value of 100 makes the unit of values at least 2^4 times as large.
    const auto exponent = agent.readout().exponent();
    agent.learn(a, Indices{1}, 100.0 * scale, a, true);
    EXPECT_EQ(agent.act(a).front(), 1U);
    agent.learn(a, Indices{1}, 0.0, a, true);
    EXPECT_GE(*agent.readout().exponent(), *exponent + 4);
    EXPECT_EQ(first_after(0.8), 0U);
    EXPECT_EQ(first_after(0.7), 2U);
  }
}

// The tolerance makes all allowed actions tie, of which the lowest is taken.
TEST(QLambda, MaskedActionsNeverTie) {
  const State a{0.1, 0.1};
  QLambda agent = agent_of(with_tolerance(1e308));
  agent.learn(a, Indices{2}, 1e-300, a, true);
  EXPECT_EQ(agent.act(a, true, 0, std::vector<std::uint8_t>{0, 1, 1}).front(), 1U);
}

// A mask has 0 or 1 for each of 3 + 2 actions, and allows at least one in both dimensions.
TEST(QLambda, RefusesMasksOfWrongSizeOrValues) {
  QLambda agent = agent_of({}, {3, 2});
  auto workspace = agent.workspace();
  core::Random ties(1, core::Stream::ties);
  const State state{0.25, 0.75};
  for (const std::vector<std::uint8_t>& mask :
       {std::vector<std::uint8_t>{1, 1, 1}, {0, 0, 0, 1, 1}, {1, 2, 1, 1, 1}}) {
    EXPECT_THROW((void)agent.act(state, true, 0, mask), std::invalid_argument);
    EXPECT_THROW((void)agent.act(state, false, 0, mask), std::invalid_argument);
    EXPECT_THROW((void)agent.best_action(state, workspace, ties, mask), std::invalid_argument);
    EXPECT_THROW((void)agent.best_of(workspace, mask), std::invalid_argument);
    EXPECT_THROW(agent.learn(state, Indices{0, 0}, 0.0, state, false, 0, mask),
                 std::invalid_argument);
  }
  const std::vector<std::uint8_t> only{0, 0, 1, 1, 0};
  EXPECT_TRUE(std::ranges::equal(agent.best_action(state, workspace, ties, only), Indices{2, 0}));
}

// n_symbols is 0 for an input that is a number.
TEST(QLambda, EpsilonDecaysToZeroButStaysConstantForSymbolsOnly) {
  const QLambdaConfig config{.policy = {.epsilon = 0.5, .n_greedy_steps = 0},
                             .schedule_steps = 100};
  EXPECT_EQ(agent_of(config).final_epsilon(), 0.0);
  const std::vector<std::size_t> n_actions{3};
  const auto with_symbols = [&](std::vector<int> n_symbols, QLambdaConfig learning) {
    return QLambda(LinearSDNN({.n_inputs = 2, .n_symbols = std::move(n_symbols)}, n_actions, 1),
                   learning, 1);
  };
  EXPECT_EQ(with_symbols({4, 0}, config).final_epsilon(), 0.0);
  QLambda agent = with_symbols({4, 3}, config);
  EXPECT_EQ(agent.final_epsilon(), 0.5);
  learn_at_random(agent, 100, 1);
  EXPECT_EQ(agent.epsilon(), 0.5);
  QLambdaConfig with_final = config;
  with_final.final_epsilon = 0.25;
  EXPECT_EQ(with_symbols({4, 3}, with_final).final_epsilon(), 0.25);
}

TEST(QLambda, LearnsTheSameBitsOnEveryInstructionSet) {
  for (const auto traces : {TraceKind::dutch, TraceKind::replacing}) {
    std::vector<std::vector<std::int32_t>> learned;
    testing::on_every_instruction_set([&](auto) {
      QLambda agent = agent_of({.traces = traces}, /*n_actions=*/{5, 2}, /*window=*/2);
      learn_at_random(agent, 300, 2);
      const auto weights = agent.readout().weights();
      learned.emplace_back(weights.begin(), weights.end());
    });
    for (const auto& weights : learned) EXPECT_EQ(weights, learned.front());
  }
}

/// The number of steps of the longest random action, after `n_ended` episodes have ended.
int longest_action(QLambda agent, int n_ended) {
  const State state{0.5, 0.5};
  for (int i = 0; i < n_ended; ++i) agent.learn(state, Indices{0, 0}, 1.0, state, true);
  agent.set_epsilon(1.0);
  Indices last;
  int longest = 0, n = 0;
  for (int i = 0; i < 5000; ++i) {
    if (i % 1000 == 0) agent.begin_episode();  // before excursions begin, after 2,000 steps
    const Indices action = testing::copied(agent.act(state));
    n = action == last ? n + 1 : 1;  // of 250^2 actions, two successive ones are hardly ever equal
    last = action;
    longest = std::max(longest, n);
  }
  return longest;
}

// longest_action(agent, n) is the number of steps of the longest random action after n ends.
TEST(QLambda, EveryEndOfAnEpisodeHalvesTheLongestRandomActionDownToFiveSteps) {
  const std::vector<std::size_t> many{250, 250};  // actions of two dimensions
  const auto agent = [&](int longest) { return agent_of({.max_action_repeat = longest}, many); };
  EXPECT_EQ(longest_action(agent(100), 0), 100);
  EXPECT_EQ(longest_action(agent(100), 1), 50);
  EXPECT_EQ(longest_action(agent(100), 2), 25);
  EXPECT_EQ(longest_action(agent(100), 7), 5);
  EXPECT_EQ(longest_action(agent(100), 40), 5);
  EXPECT_EQ(longest_action(agent(3), 7), 3);
}

// In long episodes some explorations are excursions: several steps of actions with the lowest
// value, so that an agent that would stay in good states learns about others. With epsilon 1 these
// are one exploration in four: 1 to 5 steps, since ends of episodes have shortened the 20, and 3 on
// average. Random actions last 1 + 1/2 + ... + 1/5 = 2.3 steps on average, so the share of
// excursions is 3 / (3 + 3 * 2.3), about 600 of 2,000 steps.
TEST(QLambda, StepsOfExcursionsAreTheWorstOnesAndAreLearnedOnlyIfTheyTerminate) {
  QLambda agent = agent_of({.max_action_repeat = 20}, /*n_actions=*/{5}, /*window=*/2);
  learn_at_random(agent, 100, 2);
  agent.set_epsilon(1.0);
  agent.begin_episode();
  const State state{0.3, 0.6};
  auto workspace = agent.workspace();
  int n_left_out = 0;
  for (int i = 0; i < 4000; ++i) {
    const Indices action = testing::copied(agent.act(state));
    const QLambda before = agent;
    agent.learn(state, action, 1.0, state, false);
    if (agent.n_learned() > before.n_learned()) continue;
    ++n_left_out;
    EXPECT_GE(i, 2000);  // no excursion begins in the first 2,000 steps of an episode
    const auto values = agent.values(state, workspace);
    EXPECT_EQ(values[action[0]], std::ranges::min(values));
    QLambda ended = before;
    ended.learn(state, action, 1.0, state, true);
    EXPECT_EQ(ended.n_learned(), before.n_learned() + 1);
  }
  EXPECT_GT(n_left_out, 500);  // of the 2,000 steps that may be steps of excursions
  EXPECT_LT(n_left_out, 1500);
}

// Ended episodes are counted up to 20.
TEST(QLambda, RefusesStatesWithAnImpossibleNumberOfEndedEpisodes) {
  QLambda ended = agent_of({.max_action_repeat = 100}, {250, 250});
  for (int i = 0; i < 40; ++i) ended.learn({{0.5, 0.5}}, Indices{0, 0}, 1.0, {{0.5, 0.5}}, true);
  const core::State good = core::state_of(ended);
  for (const int bad : {-1, 21}) {
    testing::expect_refused(ended, testing::with_number(good, "n_ended", bad),
                            "state: n_ended must be in [0, 20]");
  }
}

// Ten rewards of 0, then one of 1: twenty more steps are random. In such a search each action lasts
// for 1 to max_action_repeat / 2 = 5 of them; of 200^2 actions, new ones are hardly ever equal.
TEST(QLambda, SearchesTwiceAsLongAfterTheFirstRewardAsBeforeIt) {
  const State state{0.5, 0.5};
  QLambda agent = agent_of({.max_action_repeat = 10}, {200, 200});
  for (int i = 0; i < 10; ++i) agent.learn(state, Indices{0, 0}, 0.0, state, i % 3 == 2);
  agent.learn(state, Indices{0, 0}, 1.0, state, true);
  EXPECT_EQ(testing::number_of<std::int32_t>(core::state_of(agent), "n_random_left"), 20);
  Indices last;
  int run = 0;
  for (int i = 0; i < 20; ++i) {
    const Indices action = testing::copied(agent.act(state));
    run = action == last ? run + 1 : 1;
    last = action;
    EXPECT_LE(run, 5);  // with actions of up to 10 steps it would reach 8
  }
  EXPECT_FALSE(core::state_of(agent).contains("n_random_left"));
}

// In a joint trace the reward of 1 would raise Q(a, 0) to 0.73, about gamma lambda = 0.99 * 0.8.
TEST(QLambda, EnvironmentsHaveSeparateTraces) {
  QLambda together = agent_of({});
  together.set_n_environments(2);
  const State a{0.1, 0.1}, b{0.5, 0.5};
  together.learn(a, Indices{0}, 0.0, b, false, 0);
  together.learn(b, Indices{1}, 1.0, b, true, 1);  // no trace of environment 0 carries it back
  EXPECT_NEAR(q(together, a, 0), 0.0, 0.3);        // similar codes share some weights
  together.set_n_environments(1);
  EXPECT_THROW(together.learn(a, Indices{0}, 0.0, b, false, 1), std::invalid_argument);
}

// Dutch traces need the value before the last correction, which other environments would change.
TEST(QLambda, DutchTracesAreReplacingOnesInSeveralEnvironments) {
  const auto state_after = [](TraceKind traces, std::size_t n_environments) {
    QLambda agent = agent_of({.traces = traces});
    agent.set_n_environments(n_environments);
    core::Random random(1, core::Stream::useless_inputs);
    State state{0.5, 0.5};
    for (int step = 0; step < 100; ++step) {
      const State next{random.uniform(), random.uniform()};
      agent.learn(state, Indices{random.below(3)}, random.normal(), next, false);
      state = next;
    }
    return core::state_of(agent);
  };
  EXPECT_EQ(state_after(TraceKind::dutch, 2), state_after(TraceKind::replacing, 2));
  EXPECT_NE(state_after(TraceKind::dutch, 1), state_after(TraceKind::replacing, 1));
}

// The agent has 2 inputs in [0, 1] and 3 actions of one dimension; rewards are up to 1e300.
TEST(QLambda, RefusesBadTransitionsAndSettingsAndLearnsNothing) {
  QLambda agent = agent_of({});
  const State a{0.1, 0.1};
  const core::State before = core::state_of(agent);
  EXPECT_THROW(agent.learn({{0.1}}, Indices{0}, 0.0, a, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{3}, 0.0, a, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{0, 0}, 0.0, a, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{0}, 1e301, a, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{0}, 0.0, State{0.1, 1.1}, false), std::invalid_argument);
  EXPECT_THROW(agent.act(State{0.1, 1.1}), std::invalid_argument);
  EXPECT_EQ(core::state_of(agent), before);
  EXPECT_THROW(agent_of({.trace_decay = 1.1}), std::invalid_argument);
  EXPECT_THROW(agent_of({}, {}), std::invalid_argument);
  EXPECT_THROW(agent_of({}, {0}), std::invalid_argument);
}

TEST(LinearSDNN, RefusesTablesBeyondTheMemoryLimit) {
  const std::size_t n_actions[] = {3};
  EXPECT_THROW(LinearSDNN({.n_inputs = 2, .max_table_bytes = 1000}, n_actions, 1),
               std::length_error);
}

}  // namespace
}  // namespace sdnn::agents
