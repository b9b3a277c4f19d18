/// How a controller checks a transition, and learns from a teacher.
#pragma once

#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

inline void Controller::check(std::span<const double> observation, std::span<const double> action,
                              double reward, std::span<const double> next_observation,
                              bool terminated, std::size_t environment,
                              ActionMask next_mask) const {
  actions_.require_mask("next_mask", terminated ? ActionMask() : next_mask);
  core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
  require_environment(environment);
  observations_.require_readings("observation", observation);
  actions_.require_action(action);
  observations_.require_readings("next_observation", next_observation);
  if (is_warming_up()) return;
  std::vector<double> state(observations_.n_inputs());
  observations_.scale(observation, state);
  observations_.scale(next_observation, state, "next_observation");
}

inline void Controller::end_warm_up_of_teacher() {
  constexpr double kHeadroomOfTeacher = 2.0;
  core::require(warm_up_ && warm_up_->size() > 0, "warm-up", "one with transitions", "none");
  end_warm_up(kHeadroomOfTeacher);
}

inline void Controller::imitate(std::span<const double> observation, std::span<const double> action,
                                double value, double margin) {
  core::require_in_range("value", value, -kLargestReward, kLargestReward);
  const auto held = readings_.filled(observation, 0, false, held_);
  actions_.require_action(action);
  std::vector<std::size_t> indices;
  for (std::size_t d = 0; d < action.size(); ++d) {
    indices.push_back(actions_.index_of(action[d], d));
  }
  last_states_.read(observations_, 0, held, state_, true);
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

}  // namespace sdnn::agents
