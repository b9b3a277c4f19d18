/// The gains of an observer whose sensors and model are noisy.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents::detail {

/// Gains are clipped, since those of an unstable model grow without limit.
inline constexpr double kLargestGain = 100.0;

/// Returns the gains of the steady Kalman filter, shape (n, n): entry (i, j) is how far estimate i
/// moves by the error of the prediction of observation j. `transition` (n, n) is the linear model
/// of the next state. Sensors have independent noise of variances `noise` (n,), above 0; the
/// model's own errors have `drift` times these variances: the larger, the nearer to 1 are the
/// gains.
///
/// Source: Kalman, R. (1960); observations are used one by one, so that no matrix is inverted.
inline std::vector<double> steady_gains(const std::vector<double>& transition,
                                        const std::vector<double>& noise, double drift) {
  constexpr int kSteps = 100;  // enough for the gains of a stable model to settle (chosen)
  const std::size_t n = noise.size();
  std::vector<double> covariance(n * n), product(n * n), column(n);
  for (std::size_t i = 0; i < n; ++i) covariance[i * n + i] = noise[i];
  for (int step = 0; step < kSteps; ++step) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        double sum = 0.0;
        for (std::size_t k = 0; k < n; ++k) sum += transition[i * n + k] * covariance[k * n + j];
        product[i * n + j] = sum;
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = i == j ? drift * noise[i] : 0.0;
        for (std::size_t k = 0; k < n; ++k) sum += product[i * n + k] * transition[j * n + k];
        covariance[i * n + j] = covariance[j * n + i] = sum;
      }
    }
    for (std::size_t k = 0; k < n; ++k) {
      const double variance = covariance[k * n + k] + noise[k];
      for (std::size_t i = 0; i < n; ++i) column[i] = covariance[i * n + k];
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) {
          covariance[i * n + j] -= column[i] * column[j] / variance;
        }
      }
    }
  }
  for (std::size_t k = 0; k < n * n; ++k) {
    covariance[k] = std::clamp(covariance[k] / noise[k % n], -kLargestGain, kLargestGain);
  }
  return covariance;
}

}  // namespace sdnn::agents::detail
