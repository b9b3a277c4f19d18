/// A task of random states and rewards for agents.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::testing {

/// V(state) of a fuzzy agent.
template <class Agent>
double value_of(const Agent& agent, const std::vector<double>& state) {
  auto workspace = agent.workspace();
  double sum = 0.0;
  for (std::size_t d = 0; d < agent.n_dimensions(); ++d) {
    sum += agent.values(state, workspace, d)[0];
  }
  return sum / static_cast<double>(agent.n_dimensions());
}

/// A copy of an action, whose span is valid until the next act.
template <class Number>
std::vector<Number> copied(std::span<const Number> action) {
  return {action.begin(), action.end()};
}
template <class Number>
  requires std::is_arithmetic_v<Number>
Number copied(Number action) {
  return action;
}

/// A task of random states and rewards, which are equal for equal agents in tasks of equal seeds.
template <class Agent>
class RandomTask {
 public:
  using Action = decltype(copied(std::declval<Agent&>().act({})));

  RandomTask(std::size_t n_inputs, std::uint64_t seed, std::size_t environment = 0)
      : environment_(environment),
        random_(seed, core::Stream::sensor_noise),
        state_(n_inputs, 0.5) {}

  /// Takes the next of three steps: begins an episode, lets the agent act, or lets it learn.
  /// Returns the action of the agent, if it acted.
  std::optional<Action> step(Agent& agent) {
    if (begins_episode_) {
      agent.begin_episode(environment_);
      begins_episode_ = false;
      return std::nullopt;
    }
    if (!has_acted_) {
      if (random_.below(8) == 0) (void)agent.act(state_, false, environment_);
      action_ = copied(agent.act(state_, true, environment_));
      has_acted_ = true;
      return action_;
    }
    has_acted_ = false;
    std::vector<double> next(state_.size());
    for (double& x : next) x = static_cast<double>(random_.below(9)) / 8.0;
    const bool terminated = random_.below(16) == 0;
    // A reward in 32 is eight times as large, so that ranges which follow the rewards grow.
    const double scale = random_.below(32) == 0 ? 32.0 : 4.0;
    const double reward = scale * static_cast<double>(random_.below(5)) - 2.0 * scale;
    agent.learn(state_, action_, reward, next, terminated, environment_);
    state_ = std::move(next);
    begins_episode_ = terminated || random_.below(16) == 0;
    if constexpr (requires { agent.set_progress(0.0); }) {
      if (random_.below(8) == 0) agent.set_progress(random_.uniform());
      if (random_.below(16) == 0) agent.set_learning_rate(rate());
      if (random_.below(16) == 0) agent.set_epsilon(rate());
    }
    return std::nullopt;
  }

 private:
  /// A random rate in (0, 1], or none, so that the rate follows the progress.
  std::optional<double> rate() {
    if (random_.below(2) == 0) return std::nullopt;
    return 1.0 - random_.uniform();
  }

  std::size_t environment_;
  core::Random random_;
  std::vector<double> state_;
  Action action_{};
  bool has_acted_ = false;  // and not learned yet
  bool begins_episode_ = true;
};

/// Expects that an agent acts and learns after it is restored without allocating memory.
template <class Make>
void expect_that_a_restored_agent_allocates_nothing(const Make& make, auto allocation_count) {
  auto agent = make();
  RandomTask<decltype(make())> task(agent.n_inputs(), 7);
  for (int t = 0; t < 100; ++t) task.step(agent);
  core::restore(agent, core::state_of(agent));
  agent.begin_episode();
  core::Random random(5, core::Stream::weights);
  std::vector<double> state(agent.n_inputs()), next(agent.n_inputs());
  const std::size_t before = allocation_count();
  for (int t = 0; t < 300; ++t) {
    for (double& x : next) x = random.uniform();
    agent.learn(state, agent.act(state), 4.0 * random.uniform(), next, false);
    state.swap(next);
  }
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace sdnn::testing
