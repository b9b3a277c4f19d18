#include "sdnn/agents/actor_critic.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "agents/random_task.hpp"
#include "sdnn/agents/detail/make_actor_critic.hpp"
#include "sdnn/approximators/detail/state_wiring.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using Indices = std::vector<std::size_t>;
using State = std::vector<double>;

ActorCritic actor_critic_of(const ActorCriticConfig& config, const Indices& n_actions = {3},
                            std::uint64_t seed = 1) {
  const approximators::LinearSDNNConfig network{.n_inputs = 2, .n_pattern_units = 40};
  return detail::make_actor_critic(network, config, n_actions,
                                   approximators::code_books_of(network, seed),
                                   detail::thermometers_of(network, config), seed);
}

std::vector<double> probabilities(const ActorCritic& agent, const State& state) {
  auto workspace = agent.workspace();
  const auto values = agent.values(state, workspace);
  return {values.begin(), values.end()};
}

/// Learns steps between random states, with a reward of 1 for the last of three actions.
void learn_at_random(ActorCritic& agent, int n_steps, std::uint64_t seed) {
  core::Random random(seed, core::Stream::useless_inputs);
  State state{random.uniform(), random.uniform()};
  for (int step = 0; step < n_steps; ++step) {
    const Indices action = testing::copied(agent.act(state));
    const State next{random.uniform(), random.uniform()};
    const bool terminated = random.below(10) == 0;
    agent.learn(state, action, action.front() == 2 ? 1.0 : 0.0, next, terminated);
    state = next;
    if (random.below(20) == 0) agent.begin_episode();
  }
}

// With alpha = 1 and no trace, a critic's value is its target after a single transition.
TEST(ActorCritic, WithRateOneTheCriticLearnsRewardPlusDiscountedValue) {
  ActorCritic agent = actor_critic_of(
      {.learning_rate = 1.0, .discount = 0.5, .trace_decay = 0.0, .final_learning_rate = {}});
  const State a{0.1, 0.1}, b{0.9, 0.9};
  agent.learn(b, Indices{2}, 8.0, b, true);
  EXPECT_NEAR(agent.value(b), 8.0, 1e-3);
  const double before = agent.value(b);
  agent.learn(a, Indices{0}, 1.0, b, false);
  EXPECT_NEAR(agent.value(a), 1.0 + 0.5 * before, 1e-3);
}

TEST(ActorCritic, ForbiddenActionsAreNeitherTakenNorLearned) {
  ActorCritic agent = actor_critic_of({});
  const std::uint8_t mask[] = {0, 1, 0};
  const State a{0.3, 0.3};
  for (int i = 0; i < 30; ++i) {
    EXPECT_EQ(agent.act(a, i % 2 == 0, 0, mask).front(), 1U);
    agent.learn(a, Indices{1}, 1.0, a, false, 0, mask);
  }
  const auto p = probabilities(agent, a);
  EXPECT_EQ(p[0], p[1]);  // one allowed action has a gradient of 0
}

// Scales are powers of two, by which products are exact: even the last bits must be equal.
TEST(ActorCritic, ProbabilitiesDoNotDependOnTheScaleOfRewards) {
  std::vector<double> p;
  for (const double scale : {1.0, 0x1p40, 0x1p-40}) {
    ActorCritic agent = actor_critic_of({});
    core::Random random(1, core::Stream::useless_inputs);
    State state{0.5, 0.5};
    for (int step = 0; step < 300; ++step) {
      const State next{random.uniform(), random.uniform()};
      agent.learn(state, Indices{random.below(std::size_t{3})}, scale * random.normal(), next,
                  random.below(10) == 0);
      state = next;
    }
    if (p.empty()) p = probabilities(agent, {0.4, 0.6});
    EXPECT_EQ(probabilities(agent, {0.4, 0.6}), p) << scale;
  }
}

// Environment 0 rewards action 0 in state a, environment 1 punishes action 1 in state b, in turns.
// In a joint trace each reward would also change the other state's preferences, and the probability
// of action 0 in state a would be 0.58 instead of 0.83.
TEST(ActorCritic, EnvironmentsHaveSeparateTraces) {
  ActorCritic agent = actor_critic_of({});
  agent.set_n_environments(2);
  const State a{0.1, 0.1}, b{0.9, 0.9};
  for (int i = 0; i < 20; ++i) {
    agent.learn(a, Indices{0}, 1.0, a, false, 0);
    agent.learn(b, Indices{1}, -1.0, b, false, 1);
  }
  agent.begin_episode(1);
  EXPECT_GT(probabilities(agent, a)[0], 0.75);
  EXPECT_GT(probabilities(agent, a)[0], probabilities(agent, b)[0]);
  EXPECT_THROW(agent.begin_episode(2), std::invalid_argument);
}

// The agent has 3 actions and 1 environment; rewards are up to 1e300, and states in [0, 1].
TEST(ActorCritic, RefusesBadTransitionsAndChangesNothing) {
  ActorCritic agent = actor_critic_of({});
  learn_at_random(agent, 50, 1);
  const core::State before = core::state_of(agent);
  const State a{0.1, 0.1};
  EXPECT_THROW(agent.learn(a, Indices{3}, 0.0, a, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{0}, testing::kInfinity, a, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{0}, 1e301, a, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{0}, 0.0, State{0.1, 1.1}, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(a, Indices{0}, 0.0, a, false, 1), std::invalid_argument);
  EXPECT_EQ(core::state_of(agent), before);
}

}  // namespace
}  // namespace sdnn::agents
