/// Schedules of learning rate and epsilon, for all configurations that have these.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <tuple>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::agents {

/// How alpha and epsilon go from their first to their final values.
enum class Schedule {
  linear,       ///< by the same difference in equal parts of the progress
  exponential,  ///< by the same factor in equal parts of the progress; no final value may be 0
};
constexpr std::array<std::string_view, 2> words_of(Schedule) noexcept {
  return {"linear", "exponential"};
}

/// Learning rate, discount and policy, of any configuration with members of these names.
template <class Config>
constexpr auto learning_fields() noexcept {
  return std::tuple_cat(
      std::tuple(
          core::field("learning_rate", &Config::learning_rate, "alpha.", core::above_up_to(0, 1)),
          core::field("discount", &Config::discount, "gamma.", core::within(0, 1))),
      core::nested_fields(&Config::policy));
}

/// Final values, schedule and random actions, of any configuration with members of these names.
template <class Config>
constexpr auto schedule_fields() noexcept {
  return std::tuple(
      core::field(
          "max_action_repeat", &Config::max_action_repeat,
          "Steps that a random action may last. Not in the paper, which has 1: with "
          "more, it is kept for at least k steps with probability 1 / k. With a linear readout "
          "each episode that terminates halves it, down to 5.",
          core::within(1, 1000000)),
      core::field("final_learning_rate", &Config::final_learning_rate,
                  "What alpha becomes as the agent's progress goes from 0 to 1; by default it "
                  "stays. Not in the paper.",
                  core::above_up_to(0, 1)),
      core::field("final_epsilon", &Config::final_epsilon,
                  "What epsilon becomes as the agent's progress goes from 0 to 1; by default it "
                  "stays. Not in the paper.",
                  core::within(0, 1)),
      core::field("schedule", &Config::schedule,
                  "How alpha and epsilon approach their final values: `linear`, or `exponential`, "
                  "first * (final / first) ** progress, with no final value of 0. For any other "
                  "function of the progress: `sdnn.agents.Schedule`."),
      core::field("exploration_fraction", &Config::exploration_fraction,
                  "Part of the progress in which epsilon goes to final_epsilon, where it then "
                  "stays. Not in the paper.",
                  core::above_up_to(0, 1)),
      core::field("start_steps", &Config::start_steps,
                  "First steps of the agent's life in which every action is random, whatever "
                  "epsilon. Not in the paper, which has 0: a rare success is found before the "
                  "greedy actions have learned to do nothing.",
                  core::within(0, 1 << 30)));
}

namespace detail {

/// The scheduled value at a progress in [0, 1], between the first value and the last.
inline double scheduled(double first, const std::optional<double>& last, Schedule schedule,
                        double progress) noexcept {
  if (!last) return first;
  if (schedule == Schedule::linear) return (1.0 - progress) * first + progress * *last;
  if (progress == 1.0) return *last;  // without rounding
  return first * core::exp(progress * core::log(*last / first));
}

/// Whether alpha and epsilon follow the progress, and not the number of steps.
template <class Config>
bool follows_progress(const Config& config) noexcept {
  if constexpr (requires { config.schedule_steps; }) return config.schedule_steps == 0;
  return true;
}

}  // namespace detail

/// Alpha at a progress in [0, 1]; the first value if it does not follow the progress.
template <class Config>
double learning_rate_at(const Config& config, double progress) noexcept {
  if constexpr (requires { config.schedule; }) {
    if (detail::follows_progress(config)) {
      return detail::scheduled(config.learning_rate, config.final_learning_rate, config.schedule,
                               progress);
    }
  }
  return config.learning_rate;
}
/// Epsilon at a progress in [0, 1]; the first value if it does not follow it; 0 without epsilon.
template <class Config>
double epsilon_at(const Config& config, double progress) noexcept {
  if constexpr (requires { config.policy; }) {
    if (!detail::follows_progress(config)) return config.policy.epsilon;
    return detail::scheduled(config.policy.epsilon, config.final_epsilon, config.schedule,
                             std::min(1.0, progress / config.exploration_fraction));
  } else {
    return 0.0;
  }
}

/// Returns the configuration. Throws std::invalid_argument naming a field out of range or useless.
template <class Config>
Config checked_schedule(const Config& config) {
  core::check_fields(config);
  if (!detail::follows_progress(config)) {
    core::require(config.schedule == Schedule::linear, "schedule",
                  "linear where schedule_steps is not 0", "exponential");
    core::require(config.exploration_fraction == 1.0, "exploration_fraction",
                  "1 where schedule_steps is not 0", config.exploration_fraction);
  }
  if (config.schedule == Schedule::exponential && config.final_epsilon) {
    const char* const expected = "greater than 0 where the schedule is exponential";
    core::require(config.policy.epsilon > 0.0, "epsilon", expected, config.policy.epsilon);
    core::require(*config.final_epsilon > 0.0, "final_epsilon", expected, *config.final_epsilon);
  }
  return config;
}

/// The progress of an agent, and alpha and epsilon if callers have set them, against the schedule.
struct Rates {
  double progress = 0.0;
  std::optional<double> set_learning_rate, set_epsilon;

  template <class Config>
  double learning_rate(const Config& config) const noexcept {
    return set_learning_rate.value_or(learning_rate_at(config, progress));
  }
  template <class Config>
  double epsilon(const Config& config) const noexcept {
    return set_epsilon.value_or(epsilon_at(config, progress));
  }
};

/// Base of agents whose learning rate and epsilon may change. After each change it calls
/// `apply_rates(change)` of the derived class, where change(agent) makes the same change in another
/// agent, such as the one of a Controller.
template <class Agent>
class WithRates {
 public:
  /// Sets the share of the training that is done, in [0, 1], which scheduled alpha and epsilon
  /// follow. Throws std::invalid_argument outside.
  void set_progress(double progress) {
    core::require_in_range("progress", progress, 0.0, 1.0);
    rates_.progress = progress;
    apply([progress](auto& other) { other.set_progress(progress); });
  }
  double progress() const noexcept { return rates_.progress; }
  /// Sets alpha or epsilon to a constant that does not depend on the progress; without a value, it
  /// follows the schedule again. Throws std::invalid_argument outside (0, 1] and [0, 1].
  void set_learning_rate(std::optional<double> rate) {
    const double tried = rate.value_or(1.0);
    core::require(tried > 0.0 && tried <= 1.0, "learning_rate", "in (0, 1], or None", tried);
    rates_.set_learning_rate = rate;
    apply([rate](auto& other) { other.set_learning_rate(rate); });
  }
  /// Fixes epsilon, or lets it follow the schedule again if there is no value.
  void set_epsilon(std::optional<double> epsilon) {
    const double tried = epsilon.value_or(0.0);
    core::require(tried >= 0.0 && tried <= 1.0, "epsilon", "in [0, 1], or None", tried);
    rates_.set_epsilon = epsilon;
    apply([epsilon](auto& other) { other.set_epsilon(epsilon); });
  }
  /// Takes over the rates of another agent.
  void set_rates(const Rates& rates) {
    rates_ = rates;
    apply([&rates](auto& other) { other.set_rates(rates); });
  }

 protected:
  /// Lists what is saved of the rates; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize_rates(Self& self, Archive& archive) {
    auto& rates = self.rates_;
    archive.number("progress", rates.progress);
    archive.number("learning_rate", rates.set_learning_rate);
    archive.number("epsilon", rates.set_epsilon);
    if constexpr (Archive::kReads) {
      archive.expect(rates.progress >= 0.0 && rates.progress <= 1.0, "progress", "in [0, 1]");
      const double rate = rates.set_learning_rate.value_or(1.0);
      archive.expect(rate > 0.0 && rate <= 1.0, "learning_rate", "in (0, 1]");
      const double epsilon = rates.set_epsilon.value_or(0.0);
      archive.expect(epsilon >= 0.0 && epsilon <= 1.0, "epsilon", "in [0, 1]");
    }
  }

  Rates rates_;

 private:
  void apply(const auto& change) { static_cast<Agent&>(*this).apply_rates(change); }
};

}  // namespace sdnn::agents
