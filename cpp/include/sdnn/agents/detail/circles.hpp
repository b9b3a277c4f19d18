/// Whether two variables are the cosine and the sine of an angle.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents::detail {

inline constexpr double kNearCircle = 1e-3;  // allows for single precision and some rounding
/// Thresholds (chosen) for noisy points (x, y) around a circle: of the number of steps, of
/// |E[x^2 + y^2] - 1|, of minus the correlation of x^2 and y^2, and of the autocorrelation of the
/// radius. With noise of a tenth of the range the correlation is -0.65; a moving radius has an
/// autocorrelation above 0.5.
inline constexpr std::size_t kFewest = 200;
inline constexpr double kLargestBias = 0.15, kLeastOpposed = 0.5, kMostAlike = 0.2;

/// Returns the finite readings of variable i, or {0} without any. Shape: (n, n_variables).
inline std::vector<double> column(std::span<const double> observations, std::size_t n_variables,
                                  std::size_t i) {
  std::vector<double> values;
  for (; i < observations.size(); i += n_variables) {
    if (std::isfinite(observations[i])) values.push_back(observations[i]);
  }
  if (values.empty()) values.push_back(0.0);
  return values;
}

/// Returns the readings of variables i and j in all steps before and after which both are present.
/// The first half of each list is from before the steps and the second half from after them, as in
/// Observations::fit.
inline std::pair<std::vector<double>, std::vector<double>> columns(
    std::span<const double> observations, std::size_t n_variables, std::size_t i, std::size_t j) {
  const std::size_t half = observations.size() / n_variables / 2 * n_variables;
  const auto is_read = [&](std::size_t row) {
    return std::isfinite(observations[row + i]) && std::isfinite(observations[row + j]);
  };
  std::pair<std::vector<double>, std::vector<double>> columns;
  for (const std::size_t first : {std::size_t{0}, half}) {
    for (std::size_t row = 0; row < half; row += n_variables) {
      if (!is_read(row) || !is_read(half + row)) continue;
      columns.first.push_back(observations[first + row + i]);
      columns.second.push_back(observations[first + row + j]);
    }
  }
  return columns;
}

/// Whether all points are on the unit circle, and move.
inline bool is_on_circle(const std::vector<double>& cosines, const std::vector<double>& sines) {
  if (cosines.empty()) return false;
  for (std::size_t t = 0; t < cosines.size(); ++t) {
    const double distance = cosines[t] * cosines[t] + sines[t] * sines[t] - 1.0;
    if (!(std::abs(distance) < kNearCircle)) return false;
  }
  const auto moves = [](const std::vector<double>& values) {
    const auto [least, most] = std::ranges::minmax(values);
    return most - least > kNearCircle;
  };
  return moves(cosines) && moves(sines);
}

/// Whether points lie on the unit circle apart from noise: the squares of both coordinates have a
/// negative correlation, their sum is 1 on average, and the deviations of the sum before and after
/// a step are uncorrelated, unlike those of a radius that moves.
inline bool is_around_circle(const std::vector<double>& cosines, const std::vector<double>& sines) {
  const std::size_t n = cosines.size() / 2;
  if (n < kFewest) return false;
  const auto mean_of = [](std::size_t count, const auto& term) {
    double sum = 0.0;  // a plain loop adds in the same order on every machine
    for (std::size_t t = 0; t < count; ++t) sum += term(t);
    return sum / static_cast<double>(count);
  };
  const auto square = [](double x) { return x * x; };
  // x and y are the mean squares of both coordinates, and dx and dy deviations from them.
  const double x = mean_of(2 * n, [&](std::size_t t) { return square(cosines[t]); });
  const double y = mean_of(2 * n, [&](std::size_t t) { return square(sines[t]); });
  if (!(std::abs(x + y - 1.0) < kLargestBias)) return false;
  const auto dx = [&](std::size_t t) { return square(cosines[t]) - x; };
  const auto dy = [&](std::size_t t) { return square(sines[t]) - y; };
  const auto radius = [&](std::size_t t) { return dx(t) + dy(t); };
  const double xx = mean_of(2 * n, [&](std::size_t t) { return square(dx(t)); });
  const double yy = mean_of(2 * n, [&](std::size_t t) { return square(dy(t)); });
  const double xy = mean_of(2 * n, [&](std::size_t t) { return dx(t) * dy(t); });
  const double rr = mean_of(2 * n, [&](std::size_t t) { return square(radius(t)); });
  const double autocovariance =
      mean_of(n, [&](std::size_t t) { return radius(t) * radius(n + t); });
  return -xy > kLeastOpposed * std::sqrt(xx * yy) && std::abs(autocovariance) < kMostAlike * rr;
}

}  // namespace sdnn::agents::detail
