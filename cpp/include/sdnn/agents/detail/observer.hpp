/// Estimates of the inputs that noisy sensors observe, by a model of how they change.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/detail/least_squares.hpp"
#include "sdnn/agents/detail/steady_gains.hpp"
#include "sdnn/agents/relevance.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::agents::detail {

/// An observer that estimates inputs from noisy observations. In each step it predicts the change
/// of each input by a linear model, fitted by least squares, of the estimates (of angles, their
/// cosine and sine) and the action. Then it moves each estimate from its prediction towards the
/// observation by a constant share, the gain: of eight candidates the one with the smallest
/// prediction errors in the experience, which is 1 for exact sensors. `refine` replaces the gain by
/// those of a Kalman filter, a gain for each pair of inputs, by which each error moves all
/// estimates.
///
/// Estimates are in coordinates of the model: angles in radians, other inputs in standard
/// deviations from their mean.
///
/// Source: Luenberger, D. (1964), for observers of constant gain; the model is fitted to the
/// estimates of the model before, as in Ljung, L., Soderstrom, T. (1983), pseudo-linear regression.
/// Refined models are fitted by instrumental variables, as in Soderstrom, T., Stoica, P. (1983).
class Observer {
 public:
  static constexpr std::size_t kMostInputs = 16;
  static constexpr std::size_t kFewestTransitions = 100;

  Observer() = default;
  /// Fits the linear model and the gain. Requires inputs and transitions within the limits above.
  explicit Observer(const RandomExperience& experience) : circular_(experience.circular) {
    find_scale(experience);
    find_actions(experience);
    const Series series = coordinates_of(experience);
    std::vector<double> estimates = series.observed;
    double least_error = std::numeric_limits<double>::infinity();
    double error_without = 0.0;
    for (int round = 0; round < kRounds; ++round) {
      Observer candidate = *this;
      candidate.fit_weights(series, estimates);
      for (const double gain : kGains) {
        candidate.set_gain(gain);
        const double error = candidate.log_error(series);
        if (round == 0 && gain == 1.0) error_without = error;
        if (error >= least_error) continue;
        least_error = error;
        *this = candidate;
      }
      estimates = estimates_of(series);
    }
    log_error_ = least_error;
    log_error_without_ = error_without;
    find_range(estimates);
  }

  std::size_t n_inputs() const noexcept { return circular_.size(); }
  /// The gain of the first input by its own error; after the constructor, of all inputs.
  double gain() const noexcept { return gains_.empty() ? 1.0 : gains_.front(); }
  /// How much the mean logarithm of squared prediction errors falls if estimates replace inputs.
  double improvement() const noexcept {
    return (log_error_without_ - log_error_) / static_cast<double>(n_inputs());
  }

  /// Fits a gain for each pair of inputs, and the model anew, by instrumental variables: noise in
  /// the observed features makes a plain fit underestimate their effect. Fitted to a random policy,
  /// models are wrong elsewhere, so kDrifts keeps gains from being too small. Takes the
  /// constructor's experience.
  void refine(const RandomExperience& experience);

  /// The estimates of an episode's first state. Shapes: (n_inputs,).
  void begin(std::span<const double> state, std::span<double> estimates) const noexcept {
    for (std::size_t i = 0; i < n_inputs(); ++i) estimates[i] = coordinate(state[i], i);
  }
  /// Moves estimates to the next state: predicts it from the action, and corrects the prediction by
  /// the observed `state`. Shapes: (n_dimensions,), (n_inputs,); `features` is scratch memory.
  void follow(std::span<const double> action, std::span<const double> state,
              std::span<double> estimates, std::vector<double>& features) const {
    predict(action, estimates, features);
    features.resize(n_inputs());
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      features[i] = difference(coordinate(state[i], i), estimates[i], i);
    }
    correct(estimates, features);
  }
  /// The state, in [0, 1], that estimates stand for. Shapes: (n_inputs,).
  void state_of(std::span<const double> estimates, std::span<double> state) const noexcept {
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      if (circular_[i]) {
        const double turns = estimates[i] / core::kTwoPi;
        state[i] = within(turns - std::floor(turns), 0.0, 1.0);
      } else {
        state[i] = within((estimates[i] - low_[i]) / (high_[i] - low_[i]), 0.0, 1.0);
      }
    }
  }

  /// Returns which share of an input's squared changes the last changes of all inputs explain,
  /// beyond the share that a fit to the present state, the action and their products of two
  /// explains. The input with the largest share counts. Such a share is evidence of a velocity that
  /// is not observed.
  ///
  /// A fit to each half of the experience explains the other half, and the smaller share counts. An
  /// input counts only if 70 % of its squared changes are explained with the last changes: a hidden
  /// velocity explains nearly all, while last changes can also stand in for products of three
  /// inputs, which the fit lacks. Returns 0 with too many products or few transitions.
  double share_of_last_changes(const RandomExperience& experience) const;

  /// Lists the saved members; see core/state.hpp. Which inputs are angles is known from the task.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.numbers("means", self.means_);
    archive.numbers("deviations", self.deviations_);
    const std::size_t n_dimensions = self.n_levels_.size();
    archive.numbers("n_levels", self.n_levels_);
    if constexpr (Archive::kReads) {
      archive.expect(self.n_levels_.size() == n_dimensions, "n_levels", "one for each dimension");
    }
    archive.numbers("levels", self.levels_);
    archive.numbers("weights", self.weights_);
    archive.numbers("gains", self.gains_);
    archive.numbers("low", self.low_);
    archive.numbers("high", self.high_);
    if constexpr (Archive::kReads) self.check(archive);
  }
  /// Makes an observer whose fitted members are restored from a state.
  Observer(std::vector<bool> circular, std::size_t n_dimensions)
      : circular_(std::move(circular)), n_levels_(n_dimensions) {}

 private:
  /// The experience in coordinates of the model.
  struct Series {
    std::size_t n_inputs, n_dimensions;
    std::vector<double> observed = {}, next = {};  ///< (n, n_inputs)
    std::vector<double> actions = {};              ///< (n, n_dimensions)
    std::vector<bool> begins = {};  ///< (n,): whether a transition is its episode's first

    std::size_t size() const noexcept { return begins.size(); }
    std::span<const double> row(const std::vector<double>& rows, std::size_t t) const {
      return std::span(rows).subspan(t * n_inputs, n_inputs);
    }
    std::span<const double> actions_at(std::size_t t) const {
      return std::span(actions).subspan(t * n_dimensions, n_dimensions);
    }
  };

  /// Candidates from exact to very noisy sensors, each about 0.7 times the one before.
  static constexpr double kGains[] = {1.0, 0.7, 0.5, 0.35, 0.25, 0.175, 0.125, 0.09};
  /// Candidates for the variance of the model's own errors, in variances of the sensors' noise.
  static constexpr double kDrifts[] = {3.0, 1.0, 0.3, 0.1, 0.03};
  // Chosen constants.
  static constexpr int kRounds = 3;       // fits of a model to the estimates of the model before
  static constexpr int kRefinements = 4;  // fits of gains to the model, then of the model to these
  static constexpr std::size_t kMostTransitions = 20'000;       // that are used, to limit the time
  static constexpr std::size_t kMostLevels = 8;                 // more actions count as a number
  static constexpr std::size_t kMostFeaturesWithProducts = 17;  // 153 with 16 * 17 / 2 products
  static constexpr double kLeastExplained = 0.7;                // see share_of_last_changes
  static constexpr double kFarthest = 6.0;       // of estimates from the mean, in deviations
  static constexpr double kLargestChange = 3.0;  // of an estimate in a step, in deviations
  static constexpr double kLeastError = 1e-6;    // added to squares, so that logarithms are finite
  static constexpr double kHeadroom = 0.25;      // of ranges at each end, in widths
  static constexpr double kLeastWidth = 1e-3;    // of a range, so that it can be divided by
  static constexpr double kLeastDeviation = 1e-9;  // inputs with less count as constant

  /// Clips x to [low, high]. NaN, which damaged files can lead to, becomes low.
  static double within(double x, double low, double high) noexcept {
    return x > low ? std::min(x, high) : low;
  }
  double coordinate(double x, std::size_t i) const noexcept {
    return circular_[i] ? core::kTwoPi * x : (x - means_[i]) / deviations_[i];
  }
  /// The first coordinate minus the second; of angles the shorter way.
  double difference(double first, double second, std::size_t i) const noexcept {
    const double change = first - second;
    return circular_[i] ? change - core::kTwoPi * std::round(change / core::kTwoPi) : change;
  }

  /// Finds the means and standard deviations by which numbers become coordinates.
  void find_scale(const RandomExperience& experience) {
    const auto n = static_cast<double>(experience.size());
    means_.assign(n_inputs(), 0.0);
    deviations_.assign(n_inputs(), 0.0);
    for (std::size_t k = 0; k < experience.states.size(); ++k) {
      means_[k % n_inputs()] += experience.states[k] / n;
    }
    for (std::size_t k = 0; k < experience.states.size(); ++k) {
      const double x = experience.states[k] - means_[k % n_inputs()];
      deviations_[k % n_inputs()] += x * x / n;
    }
    for (double& deviation : deviations_) {
      deviation = deviation > kLeastDeviation * kLeastDeviation ? std::sqrt(deviation) : 1.0;
    }
  }

  /// Fits the ranges of the estimates, with a quarter of their width added at each end. They are
  /// not the ranges of the observations, because estimates vary less than noisy observations.
  void find_range(const std::vector<double>& estimates) {
    low_.assign(n_inputs(), kFarthest);
    high_.assign(n_inputs(), -kFarthest);
    for (std::size_t k = 0; k < estimates.size(); ++k) {
      const std::size_t i = k % n_inputs();
      low_[i] = std::min(low_[i], estimates[k]);
      high_[i] = std::max(high_[i], estimates[k]);
    }
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      const double width = std::max(high_[i] - low_[i], kLeastWidth);
      low_[i] -= kHeadroom * width;
      high_[i] += kHeadroom * width;
    }
  }

  /// Decides how actions become features: by an indicator for each of up to kMostLevels different
  /// actions, or else by the number minus the middle of all. In the first case levels_ has all
  /// actions but the last, whose indicator would follow from the others; in the second the middle.
  void find_actions(const RandomExperience& experience) {
    for (const std::vector<double>& actions : experience.actions) {
      std::vector<double> levels = actions;
      std::ranges::sort(levels);
      levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
      if (levels.size() > kMostLevels) levels = {(levels.front() + levels.back()) / 2.0};
      n_levels_.push_back(static_cast<std::int32_t>(levels.size()));
      levels_.insert(levels_.end(), levels.begin(), levels.end());
      if (levels.size() == 1) continue;
      levels_.pop_back();
      --n_levels_.back();
    }
  }

  /// The transitions in the observer's coordinates, up to kMostTransitions of them.
  Series coordinates_of(const RandomExperience& experience) const {
    const std::size_t n = std::min(experience.size(), kMostTransitions);
    Series series{n_inputs(), experience.actions.size()};
    for (std::size_t k = 0; k < n * n_inputs(); ++k) {
      series.observed.push_back(coordinate(experience.states[k], k % n_inputs()));
      series.next.push_back(coordinate(experience.next_states[k], k % n_inputs()));
    }
    for (std::size_t t = 0; t < n; ++t) {
      for (const auto& actions : experience.actions) series.actions.push_back(actions[t]);
      series.begins.push_back(t == 0 || experience.ends[t - 1]);
    }
    return series;
  }

  std::size_t n_features() const noexcept {
    const auto n_angles = static_cast<std::size_t>(std::ranges::count(circular_, true));
    return 1 + n_inputs() + n_angles + levels_.size();
  }

  /// Lists the features of the linear model: 1, the estimates, and those of the action.
  void find_features(std::span<const double> action, std::span<const double> estimates,
                     std::vector<double>& features) const {
    features.assign(1, 1.0);
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      if (circular_[i]) {
        const core::SinCos turn = core::sin_cos(estimates[i]);
        features.push_back(turn.cos);
        features.push_back(turn.sin);
      } else {
        features.push_back(estimates[i]);
      }
    }
    for (std::size_t d = 0, first = 0; d < n_levels_.size(); ++d) {
      const auto n = static_cast<std::size_t>(n_levels_[d]);
      for (std::size_t k = first; k < first + n; ++k) {
        features.push_back(n == 1 ? action[d] - levels_[k] : (action[d] == levels_[k] ? 1.0 : 0.0));
      }
      first += n;
    }
  }
  /// Moves estimates to the predicted ones after an action.
  void predict(std::span<const double> action, std::span<double> estimates,
               std::vector<double>& features) const {
    find_features(action, estimates, features);
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      double change = 0.0;
      for (std::size_t k = 0; k < features.size(); ++k) {
        change += weights_[k * n_inputs() + i] * features[k];
      }
      estimates[i] += within(change, -kLargestChange, kLargestChange);
      if (circular_[i]) {
        estimates[i] -= core::kTwoPi * std::round(estimates[i] / core::kTwoPi);
      } else {
        estimates[i] = within(estimates[i], -kFarthest, kFarthest);
      }
    }
  }

  void set_gain(double gain) {
    gains_.assign(n_inputs() * n_inputs(), 0.0);
    for (std::size_t i = 0; i < n_inputs(); ++i) gains_[i * n_inputs() + i] = gain;
  }
  /// Moves predicted estimates by the errors of the predictions. Shapes: (n_inputs,).
  void correct(std::span<double> estimates, std::span<const double> errors) const noexcept {
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      double change = 0.0;
      for (std::size_t j = 0; j < n_inputs(); ++j) {
        const double error = i == j ? errors[j] : within(errors[j], -kFarthest, kFarthest);
        change += gains_[i * n_inputs() + j] * error;
      }
      estimates[i] += change;
    }
  }

  std::vector<double> transition(const Series& series) const;
  std::vector<double> instrumental_weights(const Series& series) const;

  /// Fits the model, by least squares, to the changes from the estimates to the next observations.
  void fit_weights(const Series& series, const std::vector<double>& estimates) {
    std::vector<double> features, changes, row;
    for (std::size_t t = 0; t < series.size(); ++t) {
      const auto estimate = series.row(estimates, t), next = series.row(series.next, t);
      find_features(series.actions_at(t), estimate, row);
      features.insert(features.end(), row.begin(), row.end());
      for (std::size_t i = 0; i < n_inputs(); ++i) {
        changes.push_back(difference(next[i], estimate[i], i));
      }
    }
    weights_ = least_squares(features, changes, series.size());
  }

  /// Runs the observer over a series. Calls `with(estimates)` before each transition, then
  /// `error(i, difference)` for each input i, with the next observation minus its prediction.
  void run(const Series& series, const auto& with, const auto& error) const {
    std::vector<double> estimates(n_inputs()), errors(n_inputs()), features;
    for (std::size_t t = 0; t < series.size(); ++t) {
      core::interruption_point();
      if (series.begins[t]) std::ranges::copy(series.row(series.observed, t), estimates.begin());
      with(estimates);
      predict(series.actions_at(t), estimates, features);
      const auto next = series.row(series.next, t);
      for (std::size_t i = 0; i < n_inputs(); ++i) {
        errors[i] = difference(next[i], estimates[i], i);
        error(i, errors[i]);
      }
      correct(estimates, errors);
    }
  }
  /// The observer's estimates of all states of a series, row by row.
  std::vector<double> estimates_of(const Series& series) const {
    std::vector<double> rows;
    run(
        series,
        [&](const auto& estimates) { rows.insert(rows.end(), estimates.begin(), estimates.end()); },
        [](std::size_t, double) {});
    return rows;
  }
  /// The mean squared errors of predictions of each input.
  std::vector<double> mean_squares(const Series& series) const {
    std::vector<double> squares(n_inputs());
    run(
        series, [](const auto&) {},
        [&](std::size_t i, double error) { squares[i] += error * error; });
    for (double& square : squares) square /= static_cast<double>(series.size());
    return squares;
  }
  /// The sum over inputs of the logarithm of the mean squared error of predictions.
  double log_error(const Series& series) const {
    double sum = 0.0;
    for (const double square : mean_squares(series)) sum += core::log(square + kLeastError);
    return sum;
  }

  std::vector<double> explained(const std::vector<double>& features,
                                const std::vector<double>& changes, bool is_first) const;
  static std::ptrdiff_t offset(std::size_t n) noexcept { return static_cast<std::ptrdiff_t>(n); }

  /// Checks what was read from a file.
  void check(const auto& archive) const {
    const auto is_near = [](double x) { return x >= -1.0 && x <= 2.0; };
    const auto is_wide = [](double x) { return x >= kLeastDeviation / 2.0 && x <= 2.0; };
    archive.expect(means_.size() == n_inputs() && std::ranges::all_of(means_, is_near), "means",
                   "in [-1, 2] for each input");
    archive.expect(deviations_.size() == n_inputs() && std::ranges::all_of(deviations_, is_wide),
                   "deviations", "in [5e-10, 2] for each input");
    std::size_t n = 0;
    for (const std::int32_t levels : n_levels_) {
      archive.expect(levels >= 1 && levels < static_cast<std::int32_t>(kMostLevels), "n_levels",
                     "in [1, 7]");
      n += static_cast<std::size_t>(levels);
    }
    archive.expect(levels_.size() == n && core::are_finite(levels_), "levels",
                   "finite, n_levels in all");
    archive.expect(weights_.size() == n_features() * n_inputs() && core::are_finite(weights_),
                   "weights", "a finite number for each feature and input");
    archive.expect(low_.size() == n_inputs() && core::are_finite(low_), "low",
                   "a finite number for each input");
    archive.expect(high_.size() == n_inputs() && core::are_finite(high_) &&
                       std::ranges::equal(low_, high_, std::less<>()),
                   "high", "for each input a finite number above low");
    const auto is_gain = [](double x) { return std::abs(x) <= kLargestGain; };
    archive.expect(gains_.size() == n_inputs() * n_inputs() && std::ranges::all_of(gains_, is_gain),
                   "gains", "in [-100, 100] for each pair of inputs");
  }

  std::vector<bool> circular_;
  std::vector<double> means_, deviations_;  ///< of states
  /// The features of actions, see find_actions: their number in each dimension, and for each the
  /// action that it indicates or, if it is the only one, the number that is subtracted.
  std::vector<std::int32_t> n_levels_ = {};
  std::vector<double> levels_ = {};
  std::vector<double> weights_ = {};          ///< (n_features, n_inputs)
  std::vector<double> gains_ = {};            ///< (n_inputs, n_inputs)
  std::vector<double> low_ = {}, high_ = {};  ///< of estimates
  double log_error_ = 0.0,
         log_error_without_ = 0.0;  ///< with estimates, and with observations only
};

}  // namespace sdnn::agents::detail

#include "sdnn/agents/detail/observer_fit.hpp"
