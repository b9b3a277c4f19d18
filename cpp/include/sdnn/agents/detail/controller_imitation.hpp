/// Functions of Controller that check and learn transitions, and those that learn from a teacher.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

inline void Controller::check(std::span<const double> observation, std::span<const double> action,
                              double reward, std::span<const double> next_observation,
                              bool terminated, std::size_t environment, ActionMask next_mask,
                              double dt) const {
  actions_.require_mask("next_mask", terminated ? ActionMask() : next_mask);
  core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
  require_duration(dt);
  require_environment(environment);
  observations_.require_readings("observation", observation);
  actions_.require_action(action);
  observations_.require_readings("next_observation", next_observation);
  if (is_warming_up()) return;
  std::vector<double> state(observations_.n_inputs());
  observations_.scale(observation, state);
  observations_.scale(next_observation, state, "next_observation");
}

/// Whether the agent itself acts in the present episode, so that transitions are not from a log.
/// For agents that treat both alike it is always true.
inline bool Controller::has_acted(std::size_t environment) const {
  return std::visit(
      [environment](const auto& agent) {
        if constexpr (requires { agent.has_acted(environment); }) {
          return agent.has_acted(environment);
        }
        return true;
      },
      *agent_);
}

inline std::uint64_t Controller::n_learned() const {
  if (warm_up_) return is_on_policy(config_.learning) ? 0 : warm_up_->size();
  const auto of_agent = [this](const auto& agent) {
    if constexpr (requires { agent.n_learned(); }) {
      return static_cast<std::uint64_t>(agent.n_learned());
    }
    return reward_scale_.n_rewards();
  };
  return std::visit(of_agent, *agent_);
}

/// Writes the indices of an action into indices_: those of the last exploring act if it took the
/// same action, because rounding can make several indices the same action. Fuzzy
/// agents can learn no other action: it must be the last one.
inline void Controller::find_indices(std::span<const double> action, std::size_t environment) {
  actions_.require_action(action);
  if (auto* const fuzzy = std::get_if<FuzzyQLearning>(&*agent_)) {
    actions_.take(fuzzy->last_action(environment), action_, indices_);
    core::require(fuzzy->explored_in(state_, environment) && std::ranges::equal(action, action_),
                  "observation and action", "those of the last exploring act", "others");
    return;
  }
  if (last_actions_.find(environment, action, indices_)) return;
  for (std::size_t d = 0; d < action.size(); ++d) indices_[d] = actions_.index_of(action[d], d);
}

/// Learns the transition of state_, indices_ and next_state_, unless its reward is refused. At the
/// end of a window of rewards, an integer agent may make its unit of values smaller.
inline void Controller::learn_scaled(double reward, bool terminated, std::size_t environment,
                                     ActionMask next_mask, bool is_own, double dt) {
  RewardScale scale = reward_scale_;  // unchanged if the agent throws
  if (!scale.accepts(reward)) {
    reward_scale_ = scale;
    return;
  }
  std::visit(
      [&](auto& agent) {
        agent.learn(state_, learned_action(agent, environment), reward, next_state_, terminated,
                    environment, next_mask, dt);
        if constexpr (requires { agent.note_logged(); }) {
          if (!is_own) agent.note_logged();
        }
      },
      *agent_);
  const auto size_in_window = scale.end_window();
  reward_scale_ = scale;
  if (!size_in_window) return;
  std::visit(
      [&](auto& agent) {
        if constexpr (requires { agent.refine_unit(0, 0); }) {
          agent.refine_unit(*size_in_window, *scale.size());
        }
      },
      *agent_);
}

inline void Controller::end_warm_up_of_teacher() {
  constexpr double kHeadroomOfTeacher = 2.0;
  core::require(warm_up_ && warm_up_->size() > 0, "warm-up", "one with transitions", "none");
  end_warm_up(kHeadroomOfTeacher);
}

inline void Controller::imitate(std::span<const double> observation, std::span<const double> action,
                                double value, double margin) {
  core::require_in_range("value", value, -kLargestReward, kLargestReward);
  const auto filled = readings_.filled(observation, 0, false, held_);
  actions_.require_action(action);
  std::vector<std::size_t> indices;
  for (std::size_t d = 0; d < action.size(); ++d) {
    indices.push_back(actions_.index_of(action[d], d));
  }
  last_states_.read(observations_, 0, filled, state_, true);
  std::visit(
      [&](auto& agent) {
        if constexpr (requires { agent.imitate(state_, indices, value, margin); }) {
          agent.imitate(state_, indices, value, margin);
        } else {
          core::require(false, "agent", "one with a linear readout", "another one");
        }
      },
      *agent_);
  if (observations_.is_running()) observations_.note(observation);
  if (!history().is_none()) {
    last_states_.keep(observations_, 0, true);
    last_states_.note_action(0, action, true);
  }
  readings_.note(held_, 0, false);
}

inline void Controller::follow_teacher(std::span<const double> observation,
                                       std::span<const double> action) {
  const auto filled = readings_.filled(observation, 0, false, held_);
  actions_.require_action(action);
  last_states_.read(observations_, 0, filled, state_, true);
  last_states_.keep(observations_, 0, true);
  last_states_.note_action(0, action, true);
  readings_.note(held_, 0, false);
}

}  // namespace sdnn::agents
