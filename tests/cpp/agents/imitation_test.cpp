#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/agents/actor_critic.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/detail/make_actor_critic.hpp"
#include "sdnn/agents/detail/q_lambda_episode.hpp"
#include "sdnn/agents/q_lambda.hpp"
#include "sdnn/approximators/detail/state_wiring.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using approximators::LinearSDNN;
using approximators::LinearSDNNConfig;
using Indices = std::vector<std::size_t>;
using State = std::vector<double>;

const State kState{0.1, 0.1};

QLambda q_lambda_of(const Indices& n_actions = {3}, int window = 1,
                    const QLambdaConfig& config = {.final_learning_rate = {}}) {
  return {
      LinearSDNN(
          {.n_inputs = 2, .n_pattern_units = 40, .action_window = window, .averaging_interval = 3},
          n_actions, 1),
      config, 1};
}

ActorCritic imitating_actor_critic(const Indices& n_actions = {3}) {
  const LinearSDNNConfig network{.n_inputs = 2, .n_pattern_units = 40};
  const ActorCriticConfig config{.learning_rate = 1.0, .final_learning_rate = {}};
  return detail::make_actor_critic(network, config, n_actions,
                                   approximators::code_books_of(network, 1),
                                   detail::thermometers_of(network, config), 1);
}

template <class Agent>
std::vector<double> values(const Agent& agent, const State& state, std::size_t d = 0) {
  auto workspace = agent.workspace();
  const auto row = agent.values(state, workspace, d);
  return {row.begin(), row.end()};
}

// With a learning rate of 1 all values become 8, the return. Then the imitated action 2 rises above
// the best other one, of equal ones the first, by a tenth of the margin of 1, since a call closes a
// tenth of the gap: half of it is added to one and subtracted from the other.
TEST(Imitation, MovesAllValuesToTheReturnAndTheBestTwoApart) {
  QLambda agent = q_lambda_of();
  agent.imitate(kState, Indices{2}, 8.0, 1.0);
  const std::vector<double> q = values(agent, kState);
  EXPECT_NEAR(q[0], 8.0 - 0.05, 1e-3);
  EXPECT_NEAR(q[1], 8.0, 1e-3);
  EXPECT_NEAR(q[2], 8.0 + 0.05, 1e-3);
  EXPECT_EQ(agent.n_learned(), 1);
}

// SARSA learns a transition when the next action is known, so it keeps the last one pending. Its
// reward is 4, and values of the next state are nearly 0. imitate(state, action, return, margin).
TEST(Imitation, LearnsThePendingTransition) {
  const QLambdaConfig sarsa{.discount = 0.5,
                            .trace_decay = 0.0,
                            .bootstrap = Bootstrap::sarsa,
                            .final_learning_rate = {}};
  QLambda agent = q_lambda_of(/*n_actions=*/{3}, /*window=*/1, sarsa);
  agent.learn(kState, Indices{0}, 4.0, State{0.9, 0.9}, false);
  EXPECT_EQ(values(agent, kState)[0], 0.0);  // pending
  agent.imitate(State{0.9, 0.2}, Indices{1}, 0.0, 1e-3);
  EXPECT_NEAR(values(agent, kState)[0], 4.0, 0.5);
}

// A fresh policy is even: a step of 1 moves preferences by 1 - 1/3 and by -1/3.
TEST(Imitation, OfAnActorMovesPreferencesByTheGradientOfItsLogProbability) {
  ActorCritic agent = imitating_actor_critic();
  agent.imitate(kState, Indices{1}, 5.0);
  const double up = std::exp(2.0 / 3.0), down = std::exp(-1.0 / 3.0);
  const std::vector<double> p = values(agent, kState);
  EXPECT_NEAR(p[1], up / (up + 2.0 * down), 1e-3);
  EXPECT_NEAR(p[0], down / (up + 2.0 * down), 1e-3);
  EXPECT_NEAR(agent.value(kState), 5.0, 1e-3);
}

TEST(Imitation, GivesTheSameBitsOnEveryInstructionSetAndAfterASave) {
  const auto learn_and_imitate = [](auto& agent, std::uint64_t seed) {
    core::Random random(seed, core::Stream::useless_inputs);
    for (int i = 0; i < 100; ++i) {
      const State state{random.uniform(), random.uniform()};
      agent.imitate(state, Indices{random.below(std::size_t{3}), random.below(std::size_t{5})},
                    100.0 * random.normal(), 1.0);
      const auto action = agent.act(state);
      agent.learn(state, action, random.normal(), State{0.5, 0.5}, false);
    }
  };
  const auto expect_equal = [&learn_and_imitate](const auto& make) {
    std::vector<core::State> states;
    testing::on_every_instruction_set([&](const auto&) {
      auto agent = make();
      learn_and_imitate(agent, 1);
      auto restored = make();
      core::restore(restored, core::state_of(agent));
      learn_and_imitate(agent, 2);
      learn_and_imitate(restored, 2);
      states.push_back(core::state_of(agent));
      EXPECT_EQ(states.back(), core::state_of(restored));
    });
    for (const core::State& state : states) EXPECT_EQ(state, states.front());
  };
  expect_equal([] { return q_lambda_of(/*n_actions=*/{3, 5}, /*window=*/2); });
  expect_equal([] { return imitating_actor_critic({3, 5}); });
}

// Arguments are a state in [0, 1], one of 3 actions, a finite return, and a margin above 0.
TEST(Imitation, RefusesBadActionsAndReturnsAndChangesNothing) {
  QLambda agent = q_lambda_of();
  agent.imitate(kState, Indices{0}, 1.0, 1.0);
  const core::State before = core::state_of(agent);
  EXPECT_THROW(agent.imitate(State{0.1, 1.1}, Indices{0}, 1.0, 1.0), std::invalid_argument);
  EXPECT_THROW(agent.imitate(kState, Indices{3}, 1.0, 1.0), std::invalid_argument);
  EXPECT_THROW(agent.imitate(kState, Indices{0}, testing::kNaN, 1.0), std::invalid_argument);
  EXPECT_THROW(agent.imitate(kState, Indices{0}, 1.0, 0.0), std::invalid_argument);
  EXPECT_THROW(agent.imitate(kState, Indices{0}, 1.0, testing::kNaN), std::invalid_argument);
  EXPECT_EQ(core::state_of(agent), before);
}

ControllerConfig config_of(AnyApproximatorConfig approximator, AnyLearningConfig learning) {
  return {.approximator = approximator,
          .learning = learning,
          .seed = 3,
          .observation = {.low = {-10.0, -testing::kInfinity}, .high = {10.0, testing::kInfinity}},
          .action = {.low = {-1.0}, .high = {1.0}},
          .warm_up_steps = 30};
}

// A teacher's transitions may end a warm-up early, which finds the range of the second variable.
// Afterwards imitate is refused with an observation of one variable, and a return beyond 1e300.
TEST(Imitation, RefusesToEndAWarmUpWithoutTransitionsOrTwice) {
  const LinearSDNNConfig small{.n_pattern_units = 20, .averaging_interval = 0};
  Controller agent(config_of(small, QLambdaConfig{}));
  EXPECT_THROW(agent.end_warm_up_of_teacher(), std::invalid_argument);
  agent.learn(State{0.0, 2.0}, State{1.0}, 1.0, State{0.0, 3.0}, false);
  agent.learn(State{0.0, 3.0}, State{1.0}, 1.0, State{0.0, 4.0}, true);
  agent.end_warm_up_of_teacher();
  ASSERT_FALSE(agent.is_warming_up());
  EXPECT_EQ(agent.observations().low()[0], -10.0);  // known before
  EXPECT_THROW(agent.imitate(State{0.0}, State{1.0}, 1.0, 1.0), std::invalid_argument);
  EXPECT_THROW(agent.imitate(State{0.0, 3.0}, State{1.0}, 1e301, 1.0), std::invalid_argument);
  EXPECT_THROW(agent.end_warm_up_of_teacher(), std::invalid_argument);
}

// Imitation moves weights of single actions, which RBF networks of states and actions lack.
TEST(Imitation, IsRefusedByControllersOfRBFNetworks) {
  ControllerConfig config =
      config_of(approximators::RBFNetworkConfig{.n_bases = 3}, QLearningConfig{});
  config.observation = {.low = {-1.0, -1.0}, .high = {1.0, 1.0}};
  Controller agent(config);
  EXPECT_THROW(agent.imitate(State{0.0, 0.0}, State{1.0}, 1.0, 1.0), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::agents
