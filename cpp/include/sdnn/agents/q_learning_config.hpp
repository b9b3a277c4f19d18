/// The parameters of Q-learning.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <tuple>

#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/core/config_fields.hpp"

namespace sdnn::agents {

/// Whether the range of values is the approximator's, or follows the rewards.
enum class ValueRange {
  fixed,     ///< as the approximator was made
  adaptive,  ///< that of ReturnRange, where the approximator has a range
};
constexpr std::array<std::string_view, 2> words_of(ValueRange) noexcept {
  return {"fixed", "adaptive"};
}

/// The agent's parameters; the defaults are the paper's (section 4.2).
struct QLearningConfig {
  double learning_rate = 0.5;
  double discount = 0.9;
  EpsilonGreedyConfig policy = {};
  int n_steps = 1;
  int max_action_repeat = 1;
  std::optional<double> final_learning_rate = {};
  std::optional<double> final_epsilon = {};
  ValueRange value_range = ValueRange::fixed;
  Schedule schedule = Schedule::linear;
  double exploration_fraction = 1.0;
  int start_steps = 0;

  static constexpr auto fields() noexcept {
    return std::tuple_cat(
        learning_fields<QLearningConfig>(),
        std::tuple(
            core::field("n_steps", &QLearningConfig::n_steps,
                        "Rewards in a target before it bootstraps. Not in the paper, which "
                        "has 1: with more, a transition is learned, once, when so many "
                        "steps are known or the episode ends.",
                        core::within(1, 1000)),
            core::field(
                "value_range", &QLearningConfig::value_range,
                "Whether Q has the approximator's range, q_low to q_high (`fixed`), "
                "or one that follows the returns of late (`adaptive`): rare ones are "
                "clipped, and time limits end no return. An RBF network has no range. Not in the "
                "paper.")),
        schedule_fields<QLearningConfig>());
  }
  bool operator==(const QLearningConfig&) const = default;
};

}  // namespace sdnn::agents
