/// The state of an acrobot.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::environments {

/// The state (theta1, theta2, theta1_dot, theta2_dot), in rad and rad/s. theta1 = 0 hangs down;
/// theta2 is relative to link 1.
using AcrobotState = Eigen::Vector4d;

/// Returns the angle plus the whole number of turns that brings it into [-pi, pi).
///
/// std::remainder is exact by IEEE 754, hence equal on all platforms; an angle within the interval
/// is returned unchanged.
inline double wrap_angle(double angle) noexcept {
  if (angle >= -core::kPi && angle < core::kPi) return angle;
  const double wrapped = std::remainder(angle, core::kTwoPi);
  return wrapped >= core::kPi ? -core::kPi : wrapped;
}

/// Returns the state with its angles in [-pi, pi). Throws std::invalid_argument unless every number
/// is finite.
inline AcrobotState wrapped(const AcrobotState& state) {
  for (const double value : state) core::require_finite("state", value);
  return {wrap_angle(state[0]), wrap_angle(state[1]), state[2], state[3]};
}

}  // namespace sdnn::environments
