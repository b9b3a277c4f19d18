/// How long one step of an agent takes, whatever kind of agent it is.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/agent.hpp"
#include "sdnn/core/random.hpp"
#include "tools/stopwatch.hpp"

namespace sdnn::tools {

/// The times of `n_repetitions` whole steps at random states: learning the transition from the
/// state before to a new one, then acting, with exploration, in the new one.
///
/// States are uniform in [0, 1)^d and rewards in [-1, 1), both from `seed`; nothing terminates, and
/// all steps are one episode. Drawing is not timed, nor is the first act. A new state is new to the
/// agent's memory too: give each call a seed of its own. An agent that never learned can be quicker
/// than one at work, so measure after an untimed call. Throws std::invalid_argument unless
/// n_repetitions is in [0, kMaxRepetitions], and as the agent does.
template <agents::Agent Agent>
Times time_agent_steps(Agent& agent, int n_repetitions, std::uint64_t seed) {
  core::Random random(seed, core::Stream::exploration);
  std::vector<double> before(agent.n_inputs());
  std::vector<double> state(agent.n_inputs());
  const auto draw_state = [&] {
    for (double& value : state) value = random.uniform();
  };
  decltype(agent.act(std::span<const double>(state), true)) action{};
  double reward = 0.0;
  return time_each(
      n_repetitions,
      [&](int i) {
        if (i == 0) {
          draw_state();
          agent.begin_episode();
          action = agent.act(state, true);
        }
        std::swap(before, state);
        draw_state();
        reward = 2.0 * random.uniform() - 1.0;
      },
      [&](int) {
        agent.learn(before, action, reward, state, false);
        action = agent.act(state, true);
      });
}

}  // namespace sdnn::tools
