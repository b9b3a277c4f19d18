#include "sdnn/agents/fuzzy_q_learning.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "agents/one_dimension.hpp"
#include "agents/random_task.hpp"
#include "allocation_count.hpp"
#include "errors.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using approximators::FuzzyRules;
using Fuzzy = testing::OneDimension<FuzzyQLearning>;
using Numbers = std::vector<double>;
using State = Numbers;

constexpr EpsilonGreedyConfig kGreedy{.epsilon = 0.0, .tie_rule = TieRule::lowest};

std::vector<float> values_of_rules(const Fuzzy& agent) {
  const auto values = agent.rules().table();
  return {values.data(), values.data() + values.size()};
}

// With one input, sets at 0, 1/2, 1; actions -1, 0, 1. At 0.125 rules 0 and 1 have the truth values
// 3/4 and 1/4. alpha = 0.5 and gamma = 0.9; V is the mean of the best values by truth.
TEST(FuzzyQLearning, AStepMovesValuesOfFiredRulesAsWorkedByHand) {
  FuzzyRules rules({.n_inputs = 1, .n_sets = 3, .n_actions = 3});
  rules.set_value(0, 2, 4.0F);  // rule 0 picks +1
  rules.set_value(1, 0, 2.0F);  // rule 1 picks -1
  rules.set_value(2, 1, 8.0F);
  Fuzzy agent(rules, {.policy = kGreedy}, 1);
  const State state = {0.125}, next = {0.75};
  EXPECT_EQ(agent.act(state), 0.5);                // 3/4 (+1) + 1/4 (-1)
  EXPECT_EQ(testing::value_of(agent, next), 5.0);  // (2 + 8) / 2
  // Q = 3/4 4 + 1/4 2 = 3.5; step = 0.5 (1 + 0.9 5 - 3.5) = 1.
  agent.learn(state, 0.5, 1.0, next, false);
  EXPECT_EQ(agent.rules().values(0)[2], 4.75F);
  EXPECT_EQ(agent.rules().values(1)[0], 2.25F);
  EXPECT_EQ(agent.rules().values(2)[1], 8.0F);
  // Terminated: step = 0.5 (10 - (3/4 4.75 + 1/4 2.25)) = 2.9375.
  agent.learn(state, 0.5, 10.0, next, true);
  EXPECT_EQ(agent.rules().values(0)[2], 4.75F + 0.75F * 2.9375F);
  EXPECT_EQ(agent.rules().values(1)[0], 2.25F + 0.25F * 2.9375F);
  for (const std::size_t untouched : {0U, 1U}) EXPECT_EQ(agent.rules().values(0)[untouched], 0.0F);
}

// Each of 16 rules explores with epsilon = 0.1; a random one of 21 actions may be the best one.
TEST(FuzzyQLearning, RulesExploreIndependentlyAfterTheGreedyFirstSteps) {
  FuzzyRules rules({.n_inputs = 4});
  for (std::size_t rule = 0; rule < rules.n_rules(); ++rule) {
    rules.set_value(rule, 7, 1.0F);
  }
  Fuzzy agent(rules, {}, 5);
  const State state = {0.3, 0.3, 0.3, 0.3};
  int random_picks = 0;
  for (int episode = 0; episode < 500; ++episode) {
    agent.begin_episode();
    for (int step = 0; step < 20; ++step) {
      agent.act(state);
      int others = 0;
      for (const std::size_t action : agent.dimension().picked()) others += action != 7;
      if (step < 10) {
        EXPECT_EQ(others, 0);
      }
      random_picks += others;
    }
  }
  const double n = 500.0 * 10 * 16, p = 0.1 * 20 / 21;  // 10 steps of 500 episodes, 16 rules
  EXPECT_NEAR(random_picks, n * p, 5 * std::sqrt(n * p * (1 - p)));
}

// An input at the centre of a set fires one rule, with the truth value 1. alpha = 0.5, gamma lambda
// = 0.9 * 0.5; e are the traces of rules 0 and 1.
TEST(FuzzyQLearning, TracesDecayByDiscountTimesLambdaAsWorkedByHand) {
  Fuzzy agent(FuzzyRules({.n_inputs = 1, .n_sets = 3, .n_actions = 1}),
              {.trace_decay = 0.5, .policy = kGreedy}, 1);
  const auto act_and_learn = [&agent](double s, double reward, double next,
                                      bool terminated = false) {
    agent.learn(State{s}, agent.act(State{s}), reward, State{next}, terminated);
  };
  const auto value_of_rule = [&agent](std::size_t rule) { return agent.rules().values(rule)[0]; };
  act_and_learn(0.0, 0.0, 0.5);
  EXPECT_EQ(value_of_rule(0), 0.0F);
  act_and_learn(0.5, 2.0, 1.0);  // step = 0.5 2; e = 0.45, 1
  EXPECT_EQ(value_of_rule(0), 0.45F);
  EXPECT_EQ(value_of_rule(1), 1.0F);
  act_and_learn(0.0, 1.0, 1.0);  // step = 0.5 (1 - 0.45F); e = 0.45^2 + 1, 0.45
  const double step = 0.5 * (1.0 - static_cast<double>(0.45F));
  EXPECT_FLOAT_EQ(value_of_rule(0), static_cast<float>(0.45 + step * 1.2025));
  EXPECT_FLOAT_EQ(value_of_rule(1), static_cast<float>(1.0 + step * 0.45));
  act_and_learn(1.0, 4.0, 1.0, true);  // step = 0.5 * 4; the traces end with the episode
  const float v1 = value_of_rule(1);
  EXPECT_EQ(value_of_rule(2), 2.0F);
  act_and_learn(1.0, 4.0, 1.0, true);
  EXPECT_EQ(value_of_rule(1), v1);
}

TEST(FuzzyQLearning, AStepAllocatesNothingWithAndWithoutTraces) {
  for (const double trace_decay : {0.0, 1.0}) {  // 0: without traces
    Fuzzy agent(FuzzyRules({.n_inputs = 4}), {.trace_decay = trace_decay}, 1);
    core::Random random(3, core::Stream::ties);
    State state(4), next(4);
    const std::size_t before = testing::allocation_count();
    for (int i = 0; i < 1000; ++i) {
      for (double& x : next) x = random.uniform();
      const double action = agent.act(state);
      agent.learn(state, action, 1e-3 * random.uniform(), next, false);
      state.swap(next);
    }
    EXPECT_EQ(testing::allocation_count(), before);
  }
}

TEST(FuzzyQLearning, RefusesTracesThatDoNotDecay) {
  const FuzzyQLearningConfig config{.discount = 1.0, .trace_decay = 1.0};
  EXPECT_EQ(testing::message_of([&] { Fuzzy(FuzzyRules({.n_inputs = 1}), config, 1); }),
            "trace_decay must be at most 0.99 / discount, got 1");
}

// 2^16 rules fire in each step, and a trace that decays by 0.99 lasts for hundreds of steps.
TEST(FuzzyQLearning, RefusesTooManyTracesBeforeItAllocatesMemory) {
  const FuzzyRules rules({.n_inputs = 16, .n_sets = 2, .n_actions = 2});
  EXPECT_THROW(Fuzzy(rules, {.discount = 1.0, .trace_decay = 0.99}, 1), std::length_error);
  EXPECT_EQ(Fuzzy(rules, {}, 1).n_inputs(), 16U);
}

TEST(FuzzyQLearning, RefusesBadTransitionsAndLearnsNothing) {
  Fuzzy agent(FuzzyRules({.n_inputs = 2}), {}, 1);
  const State state = {0.3, 0.6}, other = {0.3, 0.7}, bad = {0.3, 1.7};
  const auto learn = [&agent](const State& s, double a, double r, const State& next) {
    return testing::message_of([&] { agent.learn(s, a, r, next, false); });
  };
  EXPECT_EQ(learn(state, 0.0, 1.0, other),
            "state must be that of the last exploring act, got another");
  const double action = agent.act(state);
  (void)agent.act(other, false);
  EXPECT_EQ(learn(other, action, 1.0, state),
            "state must be that of the last exploring act, got another");
  EXPECT_EQ(learn(state, 2.0, 1.0, other), "action must be that of the last exploring act, got 2");
  EXPECT_EQ(learn(state, action, std::nan(""), other), "reward must be finite, got nan");
  EXPECT_EQ(learn(state, action, 1.0, bad), "state[1] must be in [0, 1], got 1.7");
  EXPECT_THROW(agent.learn(state, action, 1e300, other, false), std::overflow_error);
  EXPECT_THROW((void)agent.act(bad), std::invalid_argument);
  for (const float value : values_of_rules(agent)) EXPECT_EQ(value, 0.0F);
  EXPECT_EQ(learn(state, action, 1.0, other), "no error");
}

Fuzzy agent_with_traces() {
  return {FuzzyRules({.n_inputs = 2, .n_sets = 4, .n_actions = 5}),
          {.trace_decay = 0.8, .policy = {.epsilon = 0.3, .n_greedy_steps = 2}},
          3};
}

// Values are floats, which a reward of 1e300 would make infinite.
TEST(FuzzyQLearning, ARefusedRewardDoesNotChangeTraces) {
  Fuzzy agent = agent_with_traces(), without_refusals = agent_with_traces();
  const State state = {0.3, 0.6}, next = {0.3, 0.7};
  for (int step = 0; step < 20; ++step) {
    const double action = agent.act(state);
    EXPECT_EQ(without_refusals.act(state), action);
    EXPECT_THROW(agent.learn(state, action, 1e300, next, false), std::overflow_error);
    agent.learn(state, action, 1.0, next, false);
    without_refusals.learn(state, action, 1.0, next, false);
  }
  EXPECT_EQ(values_of_rules(agent), values_of_rules(without_refusals));
}

// Two environments in which different rules fire learn as if each were alone.
TEST(FuzzyQLearning, EnvironmentsHaveSeparateLastActionsAndTraces) {
  const FuzzyQLearningConfig config{.trace_decay = 0.5, .policy = kGreedy};
  const FuzzyRules rules({.n_inputs = 2, .n_sets = 4, .n_actions = 3});
  Fuzzy both(rules, config, 1);
  std::vector<Fuzzy> alone(2, both);
  both.set_n_environments(2);
  EXPECT_EQ(both.n_environments(), 2U);
  core::Random random(4, core::Stream::weights);
  std::vector<State> states = {{0.1, 0.1}, {0.9, 0.9}};
  const int n_steps[] = {20, 33};  // of an episode
  for (int i = 0; i < 300; ++i) {
    Numbers actions;
    for (const std::size_t e : {0U, 1U}) {
      if (i % n_steps[e] == 0) {
        both.begin_episode(e);
        alone[e].begin_episode();
      }
      actions.push_back(both.act(states[e], true, e));
      ASSERT_EQ(actions[e], alone[e].act(states[e]));
      ASSERT_EQ(both.last_action(e), alone[e].last_action());
    }
    for (const std::size_t e : {0U, 1U}) {
      State next = {random.uniform() / 3.0, random.uniform() / 3.0};
      if (e == 1) next = {1.0 - next[0], 1.0 - next[1]};
      const double size = random.uniform(), reward = e == 1 ? -size : size;
      const bool terminated = i % n_steps[e] == n_steps[e] - 1;
      both.learn(states[e], actions[e], reward, next, terminated, e);
      alone[e].learn(states[e], actions[e], reward, next, terminated);
      states[e] = next;
    }
  }
  for (const double x : {0.05, 0.2, 0.3}) {
    const State low = {x, x / 2.0}, high = {1.0 - x, 0.8};
    EXPECT_EQ(testing::value_of(both, low), testing::value_of(alone[0], low));
    EXPECT_EQ(testing::value_of(both, high), testing::value_of(alone[1], high));
  }
  const State& low_state = states[0];
  EXPECT_THROW(both.learn(low_state, both.act(low_state), 1.0, low_state, false, 1),
               std::invalid_argument);
  EXPECT_THROW((void)both.act(low_state, true, 2), std::invalid_argument);
  EXPECT_THROW((void)both.act(low_state, false, 2), std::invalid_argument);
  EXPECT_THROW(both.begin_episode(2), std::invalid_argument);
  EXPECT_THROW(both.set_n_environments(0), std::invalid_argument);
}

TEST(FuzzyQLearning, ARestoredAgentAllocatesNothing) {
  testing::expect_that_a_restored_agent_allocates_nothing(agent_with_traces,
                                                          testing::allocation_count);
}

// An agent learns only the action of its last act, which a state from before it does not have.
TEST(FuzzyQLearning, ARestoredStateWithoutAnActionForgetsTheLastOne) {
  Fuzzy agent = agent_with_traces();
  const core::State fresh = core::state_of(agent);
  const State state = {0.3, 0.6};
  const double action = agent.act(state);
  core::restore(agent, fresh);
  EXPECT_THROW(agent.learn(state, action, 1.0, state, false), std::invalid_argument);
  EXPECT_EQ(agent.act(state), action);
}

// The agent has 4^2 rules, of which 2^2 fire in a step, and 5 actions.
TEST(FuzzyQLearning, RefusesInconsistentStates) {
  Fuzzy agent = agent_with_traces();
  agent.begin_episode();
  for (const State& state : {State{0.3, 0.6}, State{0.9, 0.1}}) {
    const double action = agent.act(state);
    agent.learn(state, action, 1.0, State{0.9, 0.1}, false);
  }
  (void)agent.act(State{0.2, 0.3});
  testing::expect_damaged_states_refused(agent);
  const core::State good = core::state_of(agent);
  ASSERT_EQ(good.at("eligibilities").size(), 2U * 4);  // 4 rules in each of two steps
  using testing::with_number;
  const auto refused = [&](const core::State& bad, const std::string& message) {
    testing::expect_refused(agent, bad, "state: " + message);
  };
  for (const double bad : {-1.5, 1.5}) {
    refused(with_number(good, "last_state", bad, 1), "last_state must be in [0, 1]");
    refused(with_number(good, "last_action", bad), "last_action must be in [-1, 1]");
  }
  refused(with_number(good, "traced", std::int64_t{16}, 2), "traced must be of rules and actions");
  refused(with_number(good, "traced", std::int64_t{5}, 3), "traced must be of rules and actions");
  refused(with_number(good, "picked", std::int64_t{5}, 3), "picked must be of actions");
  core::State bad = good;
  bad["picked"] = testing::tensor_of<std::int64_t>({0, 0});
  refused(bad, "picked must be one per rule that fired");
  bad = good;
  bad["traced"] = testing::tensor_of<std::int64_t>({0, 0});
  refused(bad, "traced must be two per eligibility");
  // Traces that decay by 0.9 * 0.8 a step are forgotten long before there are 100,000 of them.
  bad["traced"] = testing::tensor_of(std::vector<std::int64_t>(200000, 0));
  bad["eligibilities"] = testing::tensor_of(std::vector<double>(100000, 1.0));
  refused(bad, "eligibilities must be not too many");
}

FuzzyRules small_rules() { return FuzzyRules({.n_inputs = 2, .n_sets = 4, .n_actions = 5}); }
constexpr FuzzyQLearningConfig kTraced{.trace_decay = 0.7,
                                       .policy = {.epsilon = 0.3, .n_greedy_steps = 0}};

Fuzzy agent_of_one_dimension(std::uint64_t seed) { return {small_rules(), kTraced, seed}; }

FuzzyQLearning agent_of_two_action_dimensions() {
  return {std::vector<FuzzyRules>{small_rules(), small_rules()}, kTraced, 1};
}

TEST(FuzzyQLearning, DimensionsOfAnActionLearnLikeSeparateAgents) {
  FuzzyQLearning both = agent_of_two_action_dimensions();
  Fuzzy first = agent_of_one_dimension(1), second = agent_of_one_dimension(seed_of_dimension(1, 1));
  EXPECT_EQ(both.n_dimensions(), 2U);
  EXPECT_EQ(both.n_inputs(), 2U);
  Numbers state = {0.2, 0.9};
  for (int t = 0; t < 200; ++t) {
    const Numbers action = testing::copied(both.act(state));
    ASSERT_EQ(action, (Numbers{first.act(state), second.act(state)}));
    ASSERT_EQ(testing::copied(both.last_action()), action);
    ASSERT_EQ(testing::value_of(both, state),
              (testing::value_of(first, state) + testing::value_of(second, state)) / 2.0);
    const double reward = action[0] - action[1];
    const Numbers next = {0.5 + 0.4 * action[0], 0.5 + 0.4 * action[1]};
    both.learn(state, action, reward, next, t % 9 == 8);
    first.learn(state, action[0], reward, next, t % 9 == 8);
    second.learn(state, action[1], reward, next, t % 9 == 8);
    state = next;
    if (t % 9 != 8) continue;
    both.begin_episode();
    first.begin_episode();
    second.begin_episode();
  }
  EXPECT_EQ(core::state_of(both.dimensions()[0]), core::state_of(first));
  EXPECT_EQ(core::state_of(both.dimensions()[1]), core::state_of(second));
}

TEST(FuzzyQLearning, RefusesRulesOfDifferentInputs) {
  const std::vector<FuzzyRules> rules = {FuzzyRules({.n_inputs = 2}), FuzzyRules({.n_inputs = 3})};
  EXPECT_THROW(FuzzyQLearning(rules, {}, 1), std::invalid_argument);
  EXPECT_THROW(FuzzyQLearning(std::vector<FuzzyRules>{}, {}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::agents
