/// lambda(k): the goal tolerance of the acrobot's task, which falls with the learning episode k.
#pragma once

#include <cmath>
#include <string_view>
#include <tuple>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::environments {

/// The formula of lambda(k); the paper's is garbled in print.
enum class GoalScheduleKind {
  inverse_linear,  ///< 1 / (1 + k / scale): the default reading
  inverse_sqrt,    ///< 1 / sqrt(1 + k): continuous at k = 10000
  constant,        ///< `constant_value` for every k
};

struct GoalScheduleConfig {
  GoalScheduleKind kind = GoalScheduleKind::inverse_linear;
  double scale = 100.0;         ///< of inverse_linear, in episodes, > 0
  int last_episode = 10000;     ///< the formula holds up to this episode, `floor` beyond; >= 0
  double floor = 0.01;          ///< lambda beyond `last_episode`, >= 0
  double constant_value = 1.0;  ///< of constant, >= 0

  static constexpr auto fields() noexcept {
    return std::tuple(core::field("kind", &GoalScheduleConfig::kind),
                      core::field("scale", &GoalScheduleConfig::scale),
                      core::field("last_episode", &GoalScheduleConfig::last_episode),
                      core::field("floor", &GoalScheduleConfig::floor),
                      core::field("constant_value", &GoalScheduleConfig::constant_value));
  }
  bool operator==(const GoalScheduleConfig&) const = default;
};

/// lambda as a function of the number of the learning episode.
///
/// Source: the paper's section on the acrobot task, goal condition |theta1_dot| < 3 pi lambda and
/// |theta2_dot| < 5 pi lambda.
class GoalSchedule {
 public:
  /// Throws std::invalid_argument if a number is outside its range.
  explicit GoalSchedule(const GoalScheduleConfig& config = {}) : config_(config) {
    core::require_positive("scale", config.scale);
    core::require(config.last_episode >= 0, "last_episode", "at least 0", config.last_episode);
    require_factor("floor", config.floor);
    require_factor("constant_value", config.constant_value);
  }

  /// lambda of the 1-based learning episode `episode`. Throws std::invalid_argument below 1.
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
  static void require_factor(std::string_view name, double value) {
    core::require(std::isfinite(value) && value >= 0.0, name, "finite and at least 0", value);
  }

  GoalScheduleConfig config_;
};

}  // namespace sdnn::environments
