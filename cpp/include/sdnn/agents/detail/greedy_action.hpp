/// Greedy actions in the units of a task.
#pragma once

#include <cstddef>
#include <vector>

#include "sdnn/agents/actions.hpp"

namespace sdnn::agents::detail {

/// Moves the greedy action of a softmax policy in a box from the most probable action to the mean
/// of it and its neighbours, because the best action may lie between two of the learned ones.
/// `read` is the workspace of the state for the agent's `mean_offset`. Shapes: (n_dimensions,).
template <class Agent, class... Read>
void move_to_mean(const Actions& actions, const Agent& agent, std::vector<double>& in_units,
                  const std::vector<std::size_t>& indices, const Read&... read) {
  if constexpr (requires(std::size_t d) { agent.mean_offset(read..., d, d); }) {
    for (std::size_t d = 0; d < in_units.size(); ++d) {
      in_units[d] = actions.beside_index(indices[d], agent.mean_offset(read..., d, indices[d]), d);
    }
  }
}

/// Writes a greedy action, in units of the task, into a controller's workspace. `read` is the
/// agent's workspace with the state.
template <class Agent, class Action, class Workspace, class Read>
void take_greedy(const Actions& actions, const Agent& agent, const Action& action,
                 Workspace& workspace, const Read& read) {
  actions.take(action, workspace.action, workspace.indices);
  move_to_mean(actions, agent, workspace.action, workspace.indices, read);
}

}  // namespace sdnn::agents::detail
