/// Greedy actions in the units of a task.
#pragma once

#include <cstddef>
#include <vector>

#include "sdnn/agents/actions.hpp"

namespace sdnn::agents::detail {

/// Moves the greedy action of an agent with a policy, in the units of a box, from the most probable
/// one to the mean of it and its neighbours: an action may be better between two that are learned.
/// `read` are the arguments of the agent's `mean_offset` that name the state. Shapes:
/// (n_dimensions,).
template <class Agent, class... Read>
void move_to_mean(const Actions& actions, const Agent& agent, std::vector<double>& in_units,
                  const std::vector<std::size_t>& indices, const Read&... read) {
  if constexpr (requires(std::size_t d) { agent.mean_offset(read..., d, d); }) {
    for (std::size_t d = 0; d < in_units.size(); ++d) {
      in_units[d] = actions.beside_index(indices[d], agent.mean_offset(read..., d, indices[d]), d);
    }
  }
}

/// Writes the greedy action of an agent, for the state that was read into its own workspace `read`,
/// into a controller's workspace.
template <class Agent, class Action, class Workspace, class Read>
void take_greedy(const Actions& actions, const Agent& agent, const Action& action,
                 Workspace& workspace, const Read& read) {
  actions.take(action, workspace.action, workspace.indices);
  move_to_mean(actions, agent, workspace.action, workspace.indices, read);
}

}  // namespace sdnn::agents::detail
