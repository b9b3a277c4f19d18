/// The concept that every agent models, for trials.
#pragma once

#include <concepts>
#include <cstddef>
#include <span>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// An agent with states in [0, 1]^l and one action dimension.
///
/// | expression                                              | meaning                            |
/// |---------------------------------------------------------|------------------------------------|
/// | agent.n_inputs()                                        | l, the size of a state             |
/// | agent.begin_episode()                                   | the next act is an episode's first |
/// | agent.act(state, explore)                               | the action to take; without        |
/// |                                                         | `explore` a best one, and then     |
/// |                                                         | later learning is not affected     |
/// | agent.normalized_action(action)                         | the action as a number in [-1, 1], |
/// |                                                         | from one end of its range to the   |
/// |                                                         | other                              |
/// | agent.learn(state, action, reward, next, terminated)    | learns the transition              |
///
/// The caller begins each episode: learn does not, even after a transition that terminated.
template <class A>
concept Agent = requires(A agent, const A& const_agent, std::span<const double> state,
                         double reward, bool flag) {
  { const_agent.n_inputs() } -> std::convertible_to<std::size_t>;
  agent.begin_episode();
  { const_agent.normalized_action(agent.act(state, flag)) } -> std::convertible_to<double>;
  agent.learn(state, agent.act(state, flag), reward, state, flag);
};

}  // namespace sdnn::agents
