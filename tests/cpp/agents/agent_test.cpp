#include "sdnn/agents/agent.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "agents/one_dimension.hpp"
#include "approximators/lookup_table.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::agents {
namespace {

static_assert(Agent<QLearning<testing::LookupTable>>);
static_assert(Agent<QLearning<approximators::SDNNC>>);
static_assert(Agent<QLearning<approximators::RBFNetwork>>);
static_assert(Agent<FuzzyQLearning>);
static_assert(!Agent<approximators::RBFNetwork>);

// With epsilon 1 at least four of five actions of the later 200 steps should not be the best one.
template <Agent A>
void expect_random_actions_after_terminated_transitions(A agent) {
  const std::vector<double> state = {0.3}, next = {0.6};
  agent.begin_episode();
  agent.learn(state, agent.act(state), 1.0, next, false);  // the only greedy step
  const auto best = agent.act(state, false);
  int n_exploring = 0;
  for (int i = 0; i < 200; ++i) {
    const auto action = agent.act(state);
    n_exploring += action != best;
    agent.learn(state, action, 0.0, next, true);
  }
  EXPECT_GT(n_exploring, 50);  // far fewer than expected, but impossible if steps were greedy
}

// Only begin_episode does; with epsilon 1 all other steps are random.
TEST(Agent, ATerminatedTransitionDoesNotRestartTheGreedyFirstSteps) {
  const EpsilonGreedyConfig policy{
      .epsilon = 1.0, .n_greedy_steps = 1, .tie_rule = TieRule::lowest};
  expect_random_actions_after_terminated_transitions(
      testing::OneDimension<QLearning<testing::LookupTable>>(testing::LookupTable(1, 2, 5),
                                                             {.policy = policy}, 1));
  expect_random_actions_after_terminated_transitions(testing::OneDimension<FuzzyQLearning>(
      approximators::FuzzyRules({.n_inputs = 1}), {.policy = policy}, 1));
}

}  // namespace
}  // namespace sdnn::agents
