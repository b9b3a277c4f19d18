/// Linear least squares with sums in a fixed order: the same bits on every machine.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents::detail {

/// Returns the weights W, shape (n_features, n_targets), with the smallest squared error of
/// features W = targets, in n rows each. A ridge of a millionth of the largest diagonal entry keeps
/// the normal equations solvable. Requires that n > 0 divides the sizes of both lists.
///
/// Source: the normal equations, by a Cholesky decomposition; Golub, G., Van Loan, C. (1996), 4.2.
inline std::vector<double> least_squares(const std::vector<double>& features,
                                         const std::vector<double>& targets, std::size_t n) {
  constexpr double kRidge = 1e-6;
  const std::size_t n_features = features.size() / n, n_targets = targets.size() / n;
  std::vector<double> matrix(n_features * n_features), weights(n_features * n_targets);
  for (std::size_t t = 0; t < n; ++t) {
    const double* const row = &features[t * n_features];
    for (std::size_t i = 0; i < n_features; ++i) {
      for (std::size_t j = 0; j <= i; ++j) matrix[i * n_features + j] += row[i] * row[j];
      for (std::size_t k = 0; k < n_targets; ++k) {
        weights[i * n_targets + k] += row[i] * targets[t * n_targets + k];
      }
    }
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < n_features; ++i) {
    largest = std::max(largest, matrix[i * n_features + i]);
  }
  const double ridge = kRidge * std::max(largest, 1e-300);  // not 0, even for features of 0
  for (std::size_t i = 0; i < n_features; ++i) {            // the Cholesky factor, in place
    for (std::size_t j = 0; j <= i; ++j) {
      double& entry = matrix[i * n_features + j];
      if (i == j) entry += ridge;
      for (std::size_t k = 0; k < j; ++k) {
        entry -= matrix[i * n_features + k] * matrix[j * n_features + k];
      }
      entry =
          i == j ? std::sqrt(std::max(entry, ridge * kRidge)) : entry / matrix[j * n_features + j];
    }
  }
  for (std::size_t k = 0; k < n_targets; ++k) {  // forward, then backward substitution
    for (std::size_t i = 0; i < n_features; ++i) {
      double& weight = weights[i * n_targets + k];
      for (std::size_t j = 0; j < i; ++j) {
        weight -= matrix[i * n_features + j] * weights[j * n_targets + k];
      }
      weight /= matrix[i * n_features + i];
    }
    for (std::size_t i = n_features; i-- > 0;) {
      double& weight = weights[i * n_targets + k];
      for (std::size_t j = i + 1; j < n_features; ++j) {
        weight -= matrix[j * n_features + i] * weights[j * n_targets + k];
      }
      weight /= matrix[i * n_features + i];
    }
  }
  return weights;
}

}  // namespace sdnn::agents::detail
