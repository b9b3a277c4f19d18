/// Limits of the regressions that learn from a stream of samples: no number overflows, and outliers
/// do little damage.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::estimators::detail {

inline constexpr double kLargest = std::numeric_limits<double>::max();
/// The number of samples up to which a mean size is a plain mean; later it is an exponential mean
/// with the same weight of a new sample.
inline constexpr double kSizeMemory = 100.0;
/// The number of samples after which sizes are limited; before, their mean is too uncertain.
inline constexpr double kFewSizes = 20.0;

/// Returns the nearest finite number; NaN stays NaN.
inline double finite(double x) noexcept { return std::clamp(x, -kLargest, kLargest); }

/// Checks the ranges of inputs that are added to `n_others` other inputs. Throws
/// std::invalid_argument naming the impossible argument.
inline void require_ranges(std::span<const double> low, std::span<const double> high,
                           std::size_t n_others) {
  core::require_size("high", high.size(), low.size());
  core::require_in_range("n_inputs", n_others + low.size(), 0, 4096);
  for (std::size_t i = 0; i < low.size(); ++i) {
    core::require_finite("low", low[i]);
    core::require_finite("high", high[i]);
    core::require(low[i] <= high[i], "high", "at least low", high[i]);
  }
}

/// Returns the number of outputs after `n_added` are added to `n_others`. Throws
/// std::invalid_argument unless it is in [1, 2^20].
inline std::size_t n_outputs_with(std::size_t n_added, std::size_t n_others) {
  const std::size_t n = n_others + n_added, most = std::size_t{1} << 20;
  core::require_in_range("n_outputs", std::max(n, n_added), 1, most);  // n may have overflowed
  return n;
}

/// Returns the signed distance of an input from the middle of a range, in widths of the range. It
/// is 0 for a missing input, NaN, and for a range of a single value.
inline double scaled(double input, double middle, double half_width) noexcept {
  if (std::isnan(input) || half_width == 0.0) return 0.0;
  return (finite(input) / 2.0 - middle / 2.0) / half_width;
}

/// Returns a target or an error, clipped to `multiple` times the mean size of earlier ones, and
/// updates that mean. `n_samples` counts the samples so far, including the current one, up to
/// kSizeMemory.
inline double limited(double x, double multiple, double n_samples, double& mean_size) noexcept {
  const double limit = n_samples > kFewSizes ? finite(multiple * mean_size) : kLargest;
  const double result = limit > 0.0 ? std::clamp(x, -limit, limit) : finite(x);
  mean_size += (std::abs(result) - mean_size) / n_samples;
  return result;
}

}  // namespace sdnn::estimators::detail
