/// The schedule of the goal tolerance lambda(k) of the acrobot, which decreases with the learning
/// episode k.
#pragma once

#include <array>
#include <cmath>
#include <string_view>
#include <tuple>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::environments {

/// The formula of lambda(k); the paper's is garbled in print.
enum class GoalScheduleKind {
  inverse_linear,  ///< 1 / (1 + k / scale): the default, an assumption
  inverse_sqrt,    ///< 1 / sqrt(1 + k): at k = 10000 about 0.01, the constant of later episodes
  constant,        ///< `constant_value` for every k
};
constexpr std::array<std::string_view, 3> words_of(GoalScheduleKind) noexcept {
  return {"inverse_linear", "inverse_sqrt", "constant"};
}

/// The schedule of the goal tolerance lambda(k) over learning episodes k (section 4.1).
struct GoalScheduleConfig {
  GoalScheduleKind kind = GoalScheduleKind::inverse_linear;
  double scale = 100.0;
  int last_episode = 10000;
  double floor = 0.01;
  double constant_value = 1.0;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("kind", &GoalScheduleConfig::kind,
                    "`inverse_linear`: 1 / (1 + k / scale); `inverse_sqrt`: 1 / sqrt(1 + k); or "
                    "`constant`: constant_value. An assumption: the formula is garbled in print."),
        core::field("scale", &GoalScheduleConfig::scale, "Episodes; of `inverse_linear`.",
                    core::above(0)),
        core::field("last_episode", &GoalScheduleConfig::last_episode,
                    "The formula holds up to this episode; lambda is floor beyond.",
                    core::at_least(0)),
        core::field("floor", &GoalScheduleConfig::floor, "lambda beyond last_episode.",
                    core::at_least(0)),
        core::field("constant_value", &GoalScheduleConfig::constant_value, "lambda of `constant`.",
                    core::at_least(0)));
  }
  bool operator==(const GoalScheduleConfig&) const = default;
};

/// The goal tolerance lambda as a function of the number of the learning episode: the goal requires
/// |theta1_dot| < 3 pi lambda and |theta2_dot| < 5 pi lambda.
///
/// Source: the paper's section on the acrobot task.
class GoalSchedule {
 public:
  /// Throws std::invalid_argument if a number is outside its range.
  explicit GoalSchedule(const GoalScheduleConfig& config = {}) : config_(config) {
    core::check_fields(config);
  }

  /// Returns lambda in the learning episode with this number, from 1. Throws std::invalid_argument
  /// below 1.
  double operator()(int episode) const {
    core::require(episode >= 1, "episode", "at least 1", episode);
    if (config_.kind == GoalScheduleKind::constant) return config_.constant_value;
    if (episode > config_.last_episode) return config_.floor;
    const double k = static_cast<double>(episode);
    if (config_.kind == GoalScheduleKind::inverse_sqrt) return 1.0 / std::sqrt(1.0 + k);
    return 1.0 / (1.0 + k / config_.scale);
  }

  const GoalScheduleConfig& config() const noexcept { return config_; }

 private:
  GoalScheduleConfig config_;
};

}  // namespace sdnn::environments
