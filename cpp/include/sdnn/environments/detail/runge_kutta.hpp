/// The classical fourth-order Runge-Kutta step.
#pragma once

#include <array>
#include <cstddef>

#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::environments {

/// The state after a time `step` of y' = derivative(y), given the slope at the start.
///
/// `Real` is double or core::Lanes; the derivative has to be inlined for wide lanes. The slope at
/// the start is an argument, because a caller that uses every state has already computed most of
/// it. The error of a step is O(step^5). It allocates nothing.
/// Source: Kutta 1901; the weights are 1/6, 1/3, 1/3, 1/6.
template <class Real, std::size_t Size, class Derivative>
SDNN_INLINE std::array<Real, Size> runge_kutta_step(const Derivative& derivative,
                                                    const std::array<Real, Size>& start,
                                                    const std::array<Real, Size>& start_slope,
                                                    double step) noexcept {
  using Vector = std::array<Real, Size>;
  const auto moved = [&start](double time, const Vector& slope) SDNN_INLINE_LAMBDA {
    Vector result;
    core::unrolled<Size>([&](std::size_t i)
                             SDNN_INLINE_LAMBDA { result[i] = start[i] + time * slope[i]; });
    return result;
  };
  const double half = 0.5 * step;
  const Vector second = derivative(moved(half, start_slope));
  const Vector third = derivative(moved(half, second));
  const Vector fourth = derivative(moved(step, third));
  Vector end;
  core::unrolled<Size>([&](std::size_t i) SDNN_INLINE_LAMBDA {
    const Real sum = (start_slope[i] + fourth[i]) + 2.0 * (second[i] + third[i]);
    end[i] = start[i] + step * (1.0 / 6.0) * sum;
  });
  return end;
}

}  // namespace sdnn::environments
