#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "agents/random_task.hpp"
#include "agents/small_q_learning.hpp"
#include "allocation_count.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "states.hpp"

namespace sdnn::agents::small_q_learning {
namespace {

// With two-step returns, gamma = 1/2 and alpha = 1, a step is pending until the next one. Rewards
// are 1 and 2 in environment 0, 8 and 8 in environment 1, which is the state's second input.
TEST(QLearning, EnvironmentsHaveSeparatePendingSteps) {
  LookupTable table(2, 5, 2);
  Agent agent(table, {.learning_rate = 1.0, .discount = 0.5, .n_steps = 2}, 1);
  agent.set_n_environments(2);
  EXPECT_EQ(agent.n_environments(), 2U);
  const auto at = [](int i, int environment) {
    return std::array{(i + 0.5) / 5.0, environment == 0 ? 0.1 : 0.9};
  };
  const auto q = [&](int i, int environment) {
    return agent.network().value(at(i, environment), 0);
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
  agent.begin_episode(1);  // learns pending steps of this environment only
  EXPECT_EQ(q(1, 0), 0.0);
  EXPECT_EQ(q(1, 1), 8.0);
  agent.set_n_environments(1);
  EXPECT_EQ(q(1, 0), 0.0);
  agent.begin_episode();
  EXPECT_EQ(q(1, 0), 2.0);
}

TEST(QLearning, PendingStepsOfRemovedEnvironmentsAreLearned) {
  Agent agent(five_cells(), {.learning_rate = 1.0, .n_steps = 5}, 1);
  agent.set_n_environments(3);
  agent.learn(cell(2), 1, 4.0, cell(3), false, 2);
  EXPECT_EQ(agent.network().value(cell(2), 1), 0.0);
  agent.set_n_environments(2);
  EXPECT_EQ(agent.network().value(cell(2), 1), 4.0);
}

// Other environments do nothing here. Tensors without a copy for each environment are shared.
TEST(QLearning, EachOfSeveralEnvironmentsLearnsLikeASingleOne) {
  auto alone = agent_of_two_dimensions();
  testing::RandomTask<decltype(alone)> task(2, 9);
  for (int t = 0; t < 300; ++t) task.step(alone);
  for (const std::size_t environment : {0U, 2U}) {
    auto one_of_four = agent_of_two_dimensions();
    one_of_four.set_n_environments(4);
    testing::RandomTask<decltype(alone)> same_task(2, 9, environment);
    for (int t = 0; t < 300; ++t) same_task.step(one_of_four);
    const core::State state = core::state_of(one_of_four);
    const std::string prefix =
        environment == 0 ? "" : "environment." + std::to_string(environment) + ".";
    for (const auto& [name, tensor] : core::state_of(alone)) {
      const bool is_shared = !state.contains("environment.1." + name);
      EXPECT_EQ(state.at(is_shared ? name : prefix + name), tensor) << name;
    }
    EXPECT_NE(state.at(prefix + "n_step_buffer.next_state"),
              state.at("environment.1.n_step_buffer.next_state"));
  }
}

TEST(QLearning, RefusesInconsistentStatesOfEnvironments) {
  auto agent = sdnn_agent();
  agent.set_n_environments(3);
  const std::vector<double> state = {0.5, 0.5};
  for (int t = 0; t < 20; ++t) (void)agent.act(state);  // until no random start step is left
  agent.learn(state, 0, 1.0, state, false, 2);
  testing::expect_damaged_states_refused(agent);
  const core::State good = core::state_of(agent);
  const auto refused = [&](const core::State& bad, const std::string& message) {
    testing::expect_refused(agent, bad, "state: environment.2." + message);
  };
  constexpr std::int64_t kNoAction = 7;  // the last action is 6
  refused(testing::with_number(good, "environment.2.kept_action", kNoAction),
          "kept_action must be an action");
  // Without environment 1 the environments end at 0, and the first tensor of 2 is one too many.
  core::State bad = good;
  std::erase_if(bad, [](const auto& item) { return item.first.starts_with("environment.1."); });
  testing::expect_refused(agent, bad, "state: environment.2.kept_action must not be there");
}

TEST(QLearning, ARestoredAgentAllocatesNothing) {
  testing::expect_that_a_restored_agent_allocates_nothing(sdnn_agent, testing::allocation_count);
  testing::expect_that_a_restored_agent_allocates_nothing(rbf_agent, testing::allocation_count);
}

// The agent has 7 actions, 20 start steps, 4-step returns and actions of up to 5 steps.
TEST(QLearning, RefusesInconsistentStates) {
  auto agent = sdnn_agent();
  testing::RandomTask<OneDimension<QLearning<SDNNC>>> task(2, 7);
  const core::State at_the_start = core::state_of(agent);
  while (core::state_of(agent).contains("n_random_left")) task.step(agent);
  // Until an action is repeated while two steps are pending.
  while (testing::number_of<std::int32_t>(core::state_of(agent), "n_kept") == 0 ||
         core::state_of(agent).at("n_step_buffer.rewards").size() < 2) {
    task.step(agent);
  }
  agent.set_learning_rate(std::nullopt);  // damage then includes these optional numbers
  agent.set_epsilon(std::nullopt);
  testing::expect_damaged_states_refused(agent);
  const core::State good = core::state_of(agent);
  using testing::with_number;
  const auto refused = [&](const core::State& bad, const std::string& message) {
    testing::expect_refused(agent, bad, "state: " + message);
  };
  refused(with_number(good, "n_step_buffer.actions", std::int64_t{7}, 1),
          "n_step_buffer.actions must be of actions");
  refused(with_number(good, "kept_action", std::int64_t{7}), "kept_action must be an action");
  refused(with_number(at_the_start, "n_random_left", 21),
          "n_random_left must be in [0, start_steps]");
  refused(with_number(good, "n_kept", 5), "n_kept must be in [0, max_action_repeat)");
  refused(with_number(good, "progress", 1.1), "progress must be in [0, 1]");
  core::State bad = good;
  bad["kept_action"] = testing::tensor_of<std::int64_t>({0, 0});
  refused(bad, "kept_action must be one per dimension");
  bad = good;  // four steps are pending in a buffer of four, where the next step has no place
  bad["n_step_buffer.rewards"] = testing::tensor_of(std::vector<double>(4, 0.0));
  bad["n_step_buffer.actions"] = testing::tensor_of(std::vector<std::int64_t>(4, 0));
  bad["n_step_buffer.states"] = testing::tensor_of(std::vector<double>(8, 0.0));
  refused(bad, "n_step_buffer.rewards must be fewer than n_steps");
  bad = good;
  for (std::size_t i = 0; i < 4; ++i) {
    bad = with_number(bad, "policy.ties.words", std::uint64_t{0}, i);
  }
  refused(bad, "policy.ties.words must be not all 0");
}

}  // namespace
}  // namespace sdnn::agents::small_q_learning
