/// Functions of Observer that refine it, and the test whether last changes explain the next ones.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "sdnn/agents/detail/least_squares.hpp"
#include "sdnn/agents/detail/observer.hpp"
#include "sdnn/agents/detail/steady_gains.hpp"
#include "sdnn/agents/relevance.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::agents::detail {

/// Fits gains to the model and the model to the gains in turns, and keeps those that predict best.
/// A model that takes observations for states has the noise of two sensor readings in its errors,
/// that before and that after the step. Half of its squared errors is the estimate of the noise.
inline void Observer::refine(const RandomExperience& experience) {
  const Series series = coordinates_of(experience);
  Observer next = *this;
  next.fit_weights(series, series.observed);
  next.set_gain(1.0);
  std::vector<double> noise = next.mean_squares(series);
  for (double& square : noise) square = std::max(square, kLeastError) / 2.0;
  for (int round = 0; round < kRefinements; ++round) {
    const std::vector<double> transition = next.transition(series);
    for (const double drift : kDrifts) {
      next.gains_ = steady_gains(transition, noise, drift);
      next.log_error_ = next.log_error(series);
      if (next.log_error_ < log_error_) *this = next;
    }
    next.weights_ = instrumental_weights(series);
  }
  find_range(estimates_of(series));
}

inline double Observer::share_of_last_changes(const RandomExperience& experience) const {
  const Series series = coordinates_of(experience);
  std::vector<double> with, without, linear, changes, features;
  if (n_features() > kMostFeaturesWithProducts) return 0.0;
  for (std::size_t t = 1; t < series.size(); ++t) {
    if (series.begins[t]) continue;
    const auto state = series.row(series.observed, t);
    find_features(series.actions_at(t), state, features);
    linear.insert(linear.end(), features.begin(), features.end());
    for (std::size_t i = 1, n = features.size(); i < n; ++i) {
      for (std::size_t j = i; j < n; ++j) features.push_back(features[i] * features[j]);
    }
    without.insert(without.end(), features.begin(), features.end());
    with.insert(with.end(), features.begin(), features.end());
    const auto last = series.row(series.observed, t - 1), next = series.row(series.next, t);
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      with.push_back(difference(state[i], last[i], i));
      changes.push_back(difference(next[i], state[i], i));
    }
  }
  if (changes.size() < kFewestTransitions * n_inputs()) return 0.0;
  std::vector<double> shares(n_inputs(), 1.0);
  for (const bool is_first : {true, false}) {
    const auto before = explained(without, changes, is_first);
    const auto by_linear = explained(linear, changes, is_first);
    const auto after = explained(with, changes, is_first);
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      const double share = after[i] - std::max({before[i], by_linear[i], 0.0});
      shares[i] = std::min(shares[i], after[i] < kLeastExplained ? 0.0 : share);
    }
  }
  return std::ranges::max(shares);
}

/// Returns the linear model's matrix from a state to the next one, shape (n_inputs, n_inputs).
/// Angles, whose cosine and sine are features, have their mean slope in the series.
inline std::vector<double> Observer::transition(const Series& series) const {
  const std::size_t n = n_inputs();
  std::vector<double> matrix(n * n);
  for (std::size_t j = 0, feature = 1; j < n; ++j, ++feature) {
    double cosine = 0.0, sine = 0.0;  // means over the series
    if (circular_[j]) {
      for (std::size_t t = 0; t < series.size(); ++t) {
        const core::SinCos turn = core::sin_cos(series.observed[t * n + j]);
        cosine += turn.cos / static_cast<double>(series.size());
        sine += turn.sin / static_cast<double>(series.size());
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      const double* const weight = &weights_[feature * n + i];
      matrix[i * n + j] =
          (i == j ? 1.0 : 0.0) + (circular_[j] ? weight[n] * cosine - weight[0] * sine : weight[0]);
    }
    if (circular_[j]) ++feature;
  }
  return matrix;
}

/// Fits the model by two-stage least squares. Noise in the observed features would bias a plain
/// fit. Features of the predicted states do not share this noise: the first stage replaces the
/// observed features by the part that those explain, the second fits the changes to it.
inline std::vector<double> Observer::instrumental_weights(const Series& series) const {
  const std::size_t n = n_inputs();
  std::vector<double> errors, predicted(n), instruments, features, changes, row;
  run(series, [](const auto&) {}, [&](std::size_t, double error) { errors.push_back(error); });
  for (std::size_t t = 1; t < series.size(); ++t) {
    if (series.begins[t]) continue;
    const auto observed = series.row(series.observed, t), next = series.row(series.next, t);
    for (std::size_t i = 0; i < n; ++i) {
      predicted[i] = observed[i] - errors[(t - 1) * n + i];
      changes.push_back(difference(next[i], observed[i], i));
    }
    find_features(series.actions_at(t), predicted, row);
    instruments.insert(instruments.end(), row.begin(), row.end());
    find_features(series.actions_at(t), observed, row);
    features.insert(features.end(), row.begin(), row.end());
  }
  const std::size_t size = changes.size() / n, width = n_features();
  if (size == 0) return weights_;
  const auto first_stage = least_squares(instruments, features, size);
  for (std::size_t t = 0; t < size; ++t) {
    for (std::size_t k = 0; k < width; ++k) {
      double explained = 0.0;
      for (std::size_t i = 0; i < width; ++i) {
        explained += instruments[t * width + i] * first_stage[i * width + k];
      }
      features[t * width + k] = explained;
    }
  }
  return least_squares(features, changes, size);
}

/// Returns for each input the share of squared changes that a linear model of the features explains
/// in one half of the transitions, if it is fitted to the other: to the first half if `is_first`.
inline std::vector<double> Observer::explained(const std::vector<double>& features,
                                               const std::vector<double>& changes,
                                               bool is_first) const {
  const std::size_t n = changes.size() / n_inputs(), width = features.size() / n, half = n / 2;
  const std::size_t begin = is_first ? 0 : n - half, first = is_first ? n - half : 0;
  const auto rows = [begin, half](const std::vector<double>& values, std::size_t n_columns) {
    const auto start = values.begin() + offset(begin * n_columns);
    return std::vector<double>(start, start + offset(half * n_columns));
  };
  const auto weights = least_squares(rows(features, width), rows(changes, n_inputs()), half);
  std::vector<double> errors(n_inputs()), squares(n_inputs()), shares;
  for (std::size_t t = first; t < first + half; ++t) {
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      double error = changes[t * n_inputs() + i];
      squares[i] += error * error;
      for (std::size_t k = 0; k < width; ++k) {
        error -= weights[k * n_inputs() + i] * features[t * width + k];
      }
      errors[i] += error * error;
    }
  }
  for (std::size_t i = 0; i < n_inputs(); ++i) {
    shares.push_back(squares[i] > 0.0 ? 1.0 - errors[i] / squares[i] : 0.0);
  }
  return shares;
}

}  // namespace sdnn::agents::detail
