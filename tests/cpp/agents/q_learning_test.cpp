#include "sdnn/agents/q_learning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

#include "agents/random_task.hpp"
#include "agents/small_q_learning.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents::small_q_learning {
namespace {

TEST(QLearning, CorrectsValuesByEquationOneAsWorkedByHand) {
  Agent agent(five_cells(), {}, 1);  // alpha = 0.5, gamma = 0.9
  const auto q = [&](int s, std::size_t a) { return agent.network().value(cell(s), a); };
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

// The next state's value is taken before the correction, also when it is the same state.
TEST(QLearning, ATransitionToTheSameStateUsesItsOldValue) {
  LookupTable table = five_cells();
  table.update(cell(3), 0, 4.0);
  Agent agent(table, {}, 1);
  agent.learn(cell(3), 0, 2.0, cell(3), false);
  EXPECT_DOUBLE_EQ(agent.network().value(cell(3), 0), 0.5 * 4.0 + 0.5 * (2.0 + 0.9 * 4.0));
}

// Rewards 1, 2, 4, then 8 at the goal; the best value in cell 2 is 16; gamma = 1/2, alpha = 1.
TEST(QLearning, NStepReturnsAreLearnedOnceAfterNSteps) {
  LookupTable table = five_cells();
  table.update(cell(2), 1, 16.0);
  Agent agent(table, {.learning_rate = 1.0, .discount = 0.5, .n_steps = 2}, 1);
  const auto q = [&](int s) { return agent.network().value(cell(s), 0); };
  agent.begin_episode();
  agent.learn(cell(0), 0, 1.0, cell(1), false);
  EXPECT_EQ(q(0), 0.0);  // pending
  agent.learn(cell(1), 0, 2.0, cell(2), false);
  EXPECT_EQ(q(0), 1.0 + 0.5 * 2.0 + 0.25 * 16.0);
  EXPECT_EQ(q(1), 0.0);
  agent.learn(cell(2), 0, 4.0, cell(3), false);
  EXPECT_EQ(q(1), 2.0 + 0.5 * 4.0);  // Q of cell 3 is 0
  agent.learn(cell(3), 0, 8.0, cell(4), true);
  EXPECT_EQ(q(2), 4.0 + 0.5 * 8.0);
  EXPECT_EQ(q(3), 8.0);
  const LookupTable learned = agent.network();
  agent.begin_episode();  // nothing is pending after a termination
  EXPECT_EQ(agent.network(), learned);
}

// alpha = 1, gamma = 1/2, returns of five steps; the best value in cell 2 is 16.
TEST(QLearning, PendingStepsAreLearnedBeforeANewEpisodeAndATransitionFromAnotherState) {
  LookupTable table = five_cells();
  table.update(cell(2), 1, 16.0);
  for (const bool begins_episode : {true, false}) {
    Agent agent(table, {.learning_rate = 1.0, .discount = 0.5, .n_steps = 5}, 1);
    const auto q = [&](int s) { return agent.network().value(cell(s), 0); };
    agent.learn(cell(0), 0, 1.0, cell(1), false);
    agent.learn(cell(1), 0, 2.0, cell(2), false);
    EXPECT_EQ(agent.network(), table);
    if (begins_episode) {
      agent.begin_episode();
      EXPECT_EQ(q(1), 2.0 + 0.5 * 16.0);
    }
    agent.learn(cell(3), 0, 8.0, cell(4), true);  // the last transition led to cell 2
    EXPECT_EQ(q(0), 1.0 + 0.5 * 2.0 + 0.25 * 16.0);
    EXPECT_EQ(q(1), 2.0 + 0.5 * 16.0);
    EXPECT_EQ(q(3), 8.0);
  }
}

TEST(QLearning, GreedyFirstStepsAreCountedFromTheBeginningOfAnEpisode) {
  LookupTable table = five_cells(3);
  table.update(cell(0), 2, 1.0);
  Agent agent(table, {.policy = {.epsilon = 1.0, .n_greedy_steps = 4}}, 3);
  int others = 0;
  for (int episode = 0; episode < 50; ++episode) {
    agent.begin_episode();
    for (int step = 0; step < 4; ++step) EXPECT_EQ(agent.act(cell(0)), 2U);
    for (int step = 4; step < 8; ++step) others += agent.act(cell(0)) != 2;
  }
  EXPECT_GT(others, 90);  // two thirds of 200 are expected: 2 of 3 actions are not greedy
}

// The state includes pending steps of 3-step returns: bad transitions are refused before that.
TEST(QLearning, RefusesBadTransitionsAndChangesNothing) {
  using Vectors = QLearning<RBFNetwork>;
  Vectors agent(
      {RBFNetwork({.n_inputs = 1, .n_actions = 3}), RBFNetwork({.n_inputs = 1, .n_actions = 2})},
      {.n_steps = 3, .value_range = ValueRange::adaptive}, 1);
  agent.learn(cell(0), Indices{2, 1}, 1.0, cell(1), false);
  const core::State before = core::state_of(agent);
  for (const Indices& bad : {Indices{}, Indices{1}, Indices(40, 0), Indices{3, 0}, Indices{0, 2}}) {
    EXPECT_THROW(agent.learn(cell(0), bad, 1.0, cell(1), false), std::invalid_argument);
  }
  const std::vector<double> longer(40, 0.5), shorter;
  EXPECT_THROW(agent.learn(longer, Indices{0, 0}, 1.0, cell(1), false), std::invalid_argument);
  EXPECT_THROW(agent.learn(shorter, Indices{0, 0}, 1.0, cell(1), false), std::invalid_argument);
  EXPECT_THROW(agent.learn(cell(0), Indices{0, 0}, 1.0, longer, false), std::invalid_argument);
  for (const double bad : {testing::kNaN, testing::kInfinity}) {
    EXPECT_THROW(agent.learn(cell(0), Indices{0, 0}, bad, cell(1), false), std::invalid_argument);
  }
  for (const Position& bad : {Position{2.0}, Position{-0.1}}) {
    EXPECT_THROW(agent.learn(bad, Indices{0, 0}, 1.0, cell(1), false), std::invalid_argument);
    EXPECT_THROW(agent.learn(cell(0), Indices{0, 0}, 1.0, bad, false), std::invalid_argument);
  }
  EXPECT_THROW((void)agent.act(longer), std::invalid_argument);
  EXPECT_THROW((void)agent.act(Position{testing::kNaN}), std::invalid_argument);
  EXPECT_THROW((void)agent.act(shorter, false), std::invalid_argument);
  EXPECT_EQ(core::state_of(agent), before);
}

// Two successive draws of 2^17 actions are hardly ever equal, so equal actions are repetitions.
TEST(QLearning, ARandomActionLastsKOrMoreStepsWithProbabilityOneKth) {
  constexpr int kLongest = 8, kDraws = 20000;
  Agent agent(LookupTable(1, 1, 1 << 17),
              {.policy = {.epsilon = 1.0, .n_greedy_steps = 0}, .max_action_repeat = kLongest}, 4);
  std::array<int, kLongest + 1> at_least{};  // actions that lasted k steps or more
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

TEST(QLearning, ARepeatedActionEndsWithTheEpisodeAndNotWithEvaluations) {
  LookupTable table(1, 1, 1 << 17);  // 2^17 actions: only repeated ones are equal
  table.update(cell(0), 5, 1.0);     // the greedy action
  Agent agent(table, {.policy = {.epsilon = 1.0, .n_greedy_steps = 0}, .max_action_repeat = 1000},
              1);
  int n_kept = 0;
  for (int i = 0; i < 200; ++i) {
    agent.begin_episode();
    const std::size_t action = agent.act(cell(0));
    for (int j = 0; j < 3; ++j) EXPECT_EQ(agent.act(cell(0), false), 5U);
    n_kept += agent.act(cell(0)) == action;
    Agent begun = agent;
    begun.begin_episode();
    EXPECT_NE(begun.act(cell(0)), action);  // a new random one of 2^17
  }
  // P(two steps or more) is 1/2; five standard deviations of 200 trials are 5 sqrt(200 / 4) = 35.4.
  EXPECT_NEAR(n_kept, 100, 36);
}

TEST(QLearning, StartStepsAreRandomAndLaterOnesGreedy) {
  LookupTable table(1, 1, 1 << 17);
  table.update(cell(0), 5, 1.0);  // the greedy action
  for (const int longest : {1, 7}) {
    Agent agent(table,
                {.policy = {.epsilon = 0.0}, .max_action_repeat = longest, .start_steps = 50}, 1);
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
    EXPECT_EQ(n_repeated > 5, longest > 1);  // 2^17 actions: only repeated ones are equal
    agent.begin_episode();                   // ends the repetition of an action
    for (int i = 0; i < 20; ++i) EXPECT_EQ(agent.act(cell(0)), 5U);
  }
}

TEST(QLearning, ARefusedStateDoesNotCountAsAStartStep) {
  OneDimension<QLearning<RBFNetwork>> agent(RBFNetwork({.n_inputs = 1}),
                                            {.policy = {.epsilon = 0.0}, .start_steps = 1}, 1);
  EXPECT_THROW((void)agent.act({{2.0}}), std::invalid_argument);
  EXPECT_EQ(testing::number_of<std::int32_t>(core::state_of(agent), "n_random_left"), 1);
  (void)agent.act(cell(0));
  EXPECT_FALSE(core::state_of(agent).contains("n_random_left"));
}

TEST(QLearning, WithoutRepeatedActionsTheirRandomStreamIsNotUsed) {
  OneDimension<QLearning<RBFNetwork>> agent(RBFNetwork({.n_inputs = 1}),
                                            {.policy = {.epsilon = 1.0, .n_greedy_steps = 0}}, 1);
  const core::State before = core::state_of(agent);
  for (int i = 0; i < 10; ++i) (void)agent.act(cell(0));
  const core::State after = core::state_of(agent);
  EXPECT_EQ(after.at("repetitions.words"), before.at("repetitions.words"));
  EXPECT_NE(after.at("policy.exploration.words"), before.at("policy.exploration.words"));
}

// gamma = 1/2. The range is a quarter wider than that of known returns: first 8 * 5/4 = 10. Before
// 32 are known, sums of past rewards stand for them: a reward plus gamma times the last sum.
TEST(QLearning, AnAdaptiveRangeOfValuesFollowsTheRewards) {
  OneDimension<QLearning<SDNNC>> agent(SDNNC(small_network(), 1),
                                       {.discount = 0.5, .value_range = ValueRange::adaptive}, 1);
  const auto scale = [&agent]() -> const auto& { return agent.network().output_scale(); };
  const std::vector<double> state = {0.3, 0.6};
  agent.learn(state, 0, 0.0, state, false);
  EXPECT_EQ(scale().q_low(), -16.0);  // the configured range, as all returns were 0
  EXPECT_EQ(scale().q_high(), 16.0);
  agent.learn(state, 0, 8.0, state, false);
  EXPECT_EQ(scale().q_low(), 0.0);
  EXPECT_EQ(scale().q_high(), 10.0);
  for (int t = 0; t < 40; ++t) agent.learn(state, 0, -20.0, state, true);
  EXPECT_EQ(scale().q_low(), -16.0 - (10.0 + 16.0) / 4);  // for the first sum, -20 + 8 / 2 = -16
  for (int t = 0; t < 400; ++t) agent.learn(state, 0, 1.0, state, t % 2 == 1);
  // Episodes of two steps with returns of 1 + 1/2 and 1.
  EXPECT_EQ(scale().q_low(), 0.0);
  EXPECT_EQ(scale().q_high(), 1.5 * 1.25);

  OneDimension<QLearning<SDNNC>> with_fixed_range(SDNNC(small_network(), 1), {.discount = 0.5}, 1);
  with_fixed_range.learn(state, 0, 1000.0, state, false);
  EXPECT_EQ(with_fixed_range.network().output_scale().q_high(), small_network().q_high);
}

// Greedy acts take the action of the highest averaged value, acts in learning that of the highest
// present value, which differ now and then.
TEST(QLearning, GreedyActionsFollowAveragedValues) {
  approximators::SDNNCConfig config = small_network();
  config.averaging_interval = 5;
  QLearning<SDNNC> averaging({SDNNC(config, 3), SDNNC(config, 4)},
                             {.learning_rate = 1.0, .policy = {.tie_rule = TieRule::lowest}}, 3);
  core::Random random(1, core::Stream::weights);
  std::vector<double> state = {0.2, 0.8}, values(7);
  auto workspaces = averaging.workspace().networks;
  int n_other = 0;
  for (int t = 0; t < 300; ++t) {
    for (double& x : state) x = random.uniform();
    const double reward = 16.0 * random.uniform() - 8.0;
    averaging.learn(state, Indices{random.below(7), random.below(7)}, reward, state, true);
    const Indices greedy = testing::copied(averaging.act(state, false));
    const auto learning_action = averaging.act(state);
    for (std::size_t d = 0; d < 2; ++d) {
      averaging.networks()[d].averaged_values(state, workspaces[d], values);
      ASSERT_EQ(greedy[d], std::ranges::max_element(values) - values.begin());
      n_other += greedy[d] != learning_action[d];
    }
  }
  EXPECT_GT(n_other, 0);
}

// Two dimensions, of 2 and 3 actions: Q_0 = 2 and Q_1 = 6 for action (1, 2), whose mean is 4.
TEST(QLearning, ACorrectionMovesEveryDimensionByTheErrorOfTheMean) {
  LookupTable first = five_cells(2), second = five_cells(3);
  first.update(cell(0), 1, 2.0);
  second.update(cell(0), 2, 6.0);
  QLearning<LookupTable> agent({first, second}, {.learning_rate = 0.5, .discount = 0.5}, 1);
  agent.learn(cell(0), Indices{1, 2}, 8.0, cell(1), true);
  EXPECT_EQ(agent.networks()[0].value(cell(0), 1), 4.0);  // rate 1/2 towards 2 + (8 - 4)
  EXPECT_EQ(agent.networks()[1].value(cell(0), 2), 8.0);  // rate 1/2 towards 6 + (8 - 4)
  EXPECT_EQ(agent.networks()[0].value(cell(0), 0), 0.0);
  EXPECT_EQ(agent.networks()[1].value(cell(0), 1), 0.0);
  agent.learn(cell(1), Indices{0, 0}, 1.0, cell(0), false);  // the best value is (4 + 8) / 2
  EXPECT_EQ(agent.networks()[0].value(cell(1), 0), 0.5 * (1.0 + 0.5 * (4.0 + 8.0) / 2.0));
}

TEST(QLearning, DimensionsHaveDifferentSeedsAndTheFirstThatOfTheAgent) {
  EXPECT_EQ(seed_of_dimension(7, 0), 7U);
  std::set<std::uint64_t> seeds;
  for (std::size_t d = 0; d < 100; ++d) seeds.insert(seed_of_dimension(7, d));
  for (std::size_t d = 1; d < 100; ++d) seeds.insert(seed_of_dimension(8, d));
  EXPECT_EQ(seeds.size(), 100U + 99);
}

TEST(QLearning, RefusesNetworksOfDifferentInputs) {
  using Tables = std::vector<LookupTable>;
  EXPECT_THROW(QLearning<LookupTable>(Tables{}, {}, 1), std::invalid_argument);
  EXPECT_THROW(QLearning<LookupTable>(Tables{LookupTable(1, 2, 2), LookupTable(2, 2, 2)}, {}, 1),
               std::invalid_argument);
}

/// Learns 300 steps between random states, and calls check(state) after each step.
template <class Check>
void learn_at_random(OneDimension<QLearning<SDNNC>>& agent, const Check& check) {
  core::Random random(4, core::Stream::exploration);
  std::vector<double> state(2), next(2);
  for (int step = 0; step < 300; ++step) {
    for (double& x : next) x = random.uniform();
    agent.learn(state, agent.act(state), random.uniform() - 0.4, next, step % 20 == 19);
    state = next;
    check(state);
  }
}

// Where values rise with counts of firing units, counts are compared and values not computed.
TEST(QLearning, TheBestActionByCountsIsTheBestByValues) {
  for (const int n_actions : {0, 7}) {
    for (const TieRule rule : {TieRule::uniform, TieRule::lowest, TieRule::middle}) {
      for (const double tolerance : {0.0, 1.0, 2.5}) {
        auto config = small_network();
        config.n_actions = n_actions;
        const EpsilonGreedyConfig policy{.tie_rule = rule, .tie_tolerance = tolerance};
        OneDimension<QLearning<SDNNC>> agent(SDNNC(config, 3), {.policy = policy}, 3);
        ASSERT_TRUE(agent.network().values_rise());
        auto workspace = agent.workspace();
        const EpsilonGreedy by_values(policy, 1);
        core::Random ties(9, core::Stream::ties), same_ties = ties;
        learn_at_random(agent, [&](const std::vector<double>& state) {
          const std::size_t action = agent.best_action(state, workspace, ties);
          ASSERT_EQ(action, by_values.best_action(agent.values(state, workspace), same_ties));
          if (rule == TieRule::uniform) return;  // best_of draws ties from the agent's own stream
          std::vector<std::uint8_t> mask(agent.n_actions(0));
          for (std::size_t a = 0; a < mask.size(); ++a) mask[a] = a % 5 == 2 ? 1 : 0;
          std::vector<double> values = agent.workspace().values[0];
          std::ranges::copy(agent.values(state, workspace), values.begin());
          exclude(mask, values);
          agent.read(state, workspace);
          ASSERT_EQ(agent.best_of(workspace, mask), by_values.best_action(values, same_ties));
        });
      }
    }
  }
}

// In a range this narrow and far from 0, rounding makes the values of successive counts equal.
TEST(QLearning, ValuesThatDoNotRiseWithCountsAreComparedThemselves) {
  auto config = small_network();
  config.q_low = -7.262490008916344e+16;
  config.q_high = -7.26249000891634e+16;
  OneDimension<QLearning<SDNNC>> agent(SDNNC(config, 3), {}, 3);
  ASSERT_FALSE(agent.network().values_rise());
  auto workspace = agent.workspace();
  core::Random ties(9, core::Stream::ties);
  learn_at_random(agent, [&](const std::vector<double>& state) {
    const std::size_t action = agent.best_action(state, workspace, ties);
    const auto values = agent.values(state, workspace);
    ASSERT_EQ(values[action], *std::ranges::max_element(values));
  });
}

}  // namespace
}  // namespace sdnn::agents::small_q_learning
