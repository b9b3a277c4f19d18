/// The classical fourth-order Runge-Kutta step.
#pragma once

#include <array>
#include <cstddef>

namespace sdnn::environments {

/// The state after a time `step` of y' = derivative(y), given the slope at the start.
///
/// The slope at the start is asked for because a caller that looks at every state it passes through
/// has most of it already. The error of one step is O(step^5). Nothing is allocated.
/// Source: Kutta 1901; the weights are 1/6, 1/3, 1/3, 1/6.
template <std::size_t Size, class Derivative>
std::array<double, Size> runge_kutta_step(const Derivative& derivative,
                                          const std::array<double, Size>& start,
                                          const std::array<double, Size>& start_slope,
                                          double step) noexcept {
  using Vector = std::array<double, Size>;
  const auto moved = [&start](double time, const Vector& slope) {
    Vector result;
    for (std::size_t i = 0; i < Size; ++i) result[i] = start[i] + time * slope[i];
    return result;
  };
  const double half = 0.5 * step;
  const Vector second = derivative(moved(half, start_slope));
  const Vector third = derivative(moved(half, second));
  const Vector fourth = derivative(moved(step, third));
  Vector end;
  for (std::size_t i = 0; i < Size; ++i) {
    const double sum = (start_slope[i] + fourth[i]) + 2.0 * (second[i] + third[i]);
    end[i] = start[i] + step * (1.0 / 6.0) * sum;
  }
  return end;
}

}  // namespace sdnn::environments
