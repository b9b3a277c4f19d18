/// Whether two variables are the cosine and the sine of an angle.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents::detail {

inline constexpr double kNearCircle = 1e-3;  // single precision and some rounding
// Around the circle: with noise of a tenth of the range the correlation of squares is -0.65, and
// that of a radius that moves smoothly is above 0.5.
inline constexpr std::size_t kFewest = 200;  // steps
inline constexpr double kLargestBias = 0.15, kLeastOpposed = 0.5, kMostAlike = 0.2;

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

/// With noise: the squares are opposed, and their sum is 1 on the average and not, as that of a
/// radius that moves would be, alike before and after a step.
inline bool is_around_circle(const std::vector<double>& cosines, const std::vector<double>& sines) {
  const std::size_t n = cosines.size() / 2;
  if (n < kFewest) return false;
  const auto mean_of = [](std::size_t count, const auto& term) {
    double sum = 0.0;  // in this order on every machine
    for (std::size_t t = 0; t < count; ++t) sum += term(t);
    return sum / static_cast<double>(count);
  };
  const auto square = [](double x) { return x * x; };
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
  const double alike = mean_of(n, [&](std::size_t t) { return radius(t) * radius(n + t); });
  return -xy > kLeastOpposed * std::sqrt(xx * yy) && std::abs(alike) < kMostAlike * rr;
}

}  // namespace sdnn::agents::detail
