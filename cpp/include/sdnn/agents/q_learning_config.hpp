/// The parameters of Q-learning.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <tuple>

#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::agents {

/// Whether the range of values is the approximator's, or follows the rewards.
enum class ValueRange {
  fixed,     ///< as the approximator was made
  adaptive,  ///< that of ReturnRange, where the approximator has a range
};
constexpr std::array<std::string_view, 2> words_of(ValueRange) noexcept {
  return {"fixed", "adaptive"};
}

/// How alpha and epsilon go from their first to their final values.
enum class Schedule {
  linear,       ///< in a straight line
  exponential,  ///< by the same factor in equal parts of the progress; no end may be 0
};
constexpr std::array<std::string_view, 2> words_of(Schedule) noexcept {
  return {"linear", "exponential"};
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

  /// Alpha and epsilon at a progress in [0, 1].
  double learning_rate_at(double progress) const noexcept {
    return between(learning_rate, final_learning_rate, progress);
  }
  double epsilon_at(double progress) const noexcept {
    return between(policy.epsilon, final_epsilon, std::min(1.0, progress / exploration_fraction));
  }

  static constexpr auto fields() noexcept {
    return std::tuple_cat(
        std::tuple(
            core::field("learning_rate", &QLearningConfig::learning_rate, "alpha.",
                        core::above_up_to(0, 1)),
            core::field("discount", &QLearningConfig::discount, "gamma.", core::within(0, 1))),
        core::nested_fields(&QLearningConfig::policy),
        std::tuple(
            core::field("n_steps", &QLearningConfig::n_steps,
                        "Rewards in a target before it bootstraps. Not in the paper, which has 1: "
                        "with more, a transition is learned, once, when so many steps are known or "
                        "the episode ends.",
                        core::within(1, 1000)),
            core::field("max_action_repeat", &QLearningConfig::max_action_repeat,
                        "Steps that a random action may last. Not in the paper, which has 1: with "
                        "more, it is kept for at least k steps with probability 1 / k.",
                        core::within(1, 1000000)),
            core::field(
                "final_learning_rate", &QLearningConfig::final_learning_rate,
                "What alpha becomes as the agent's progress goes from 0 to 1; by default it "
                "stays. Not in the paper.",
                core::above_up_to(0, 1)),
            core::field(
                "final_epsilon", &QLearningConfig::final_epsilon,
                "What epsilon becomes as the agent's progress goes from 0 to 1; by default it "
                "stays. Not in the paper.",
                core::within(0, 1)),
            core::field(
                "value_range", &QLearningConfig::value_range,
                "Whether Q has the approximator's range, q_low to q_high (`fixed`), or one "
                "that grows with the discounted sums of the rewards that come (`adaptive`). Not "
                "in the paper."),
            core::field(
                "schedule", &QLearningConfig::schedule,
                "How alpha and epsilon go to their final values: `linear`: in a straight "
                "line; `exponential`: by the same factor in equal parts of the progress, "
                "first * (final / first) ** progress. A constant rate is the common choice "
                "where the task itself changes; a line is what most libraries of deep "
                "Q-learning take for epsilon; an exponential spends more of the training near "
                "a small final value, which must not be 0. Any other function of the "
                "progress: `sdnn.agents.Schedule`."),
            core::field(
                "exploration_fraction", &QLearningConfig::exploration_fraction,
                "Part of the progress in which epsilon goes to final_epsilon, where it then "
                "stays. Not in the paper.",
                core::above_up_to(0, 1)),
            core::field(
                "start_steps", &QLearningConfig::start_steps,
                "First steps of the agent's life in which every action is random, whatever "
                "epsilon. Not in the paper, which has 0: a rare success is found before the "
                "greedy actions have learned to do nothing.",
                core::within(0, 1 << 30))));
  }
  bool operator==(const QLearningConfig&) const = default;

 private:
  double between(double first, const std::optional<double>& last, double progress) const noexcept {
    if (!last) return first;
    if (schedule == Schedule::linear) return (1.0 - progress) * first + progress * *last;
    if (progress == 1.0) return *last;  // without rounding
    return first * core::exp(progress * core::log(*last / first));
  }
};

}  // namespace sdnn::agents
