/// Linear regression that learns from one sample at a time and forgets old ones.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/estimators/detail/stream_limits.hpp"

namespace sdnn::estimators {

/// Recursive least squares with exponential forgetting, for any number of outputs.
///
/// Inputs are scaled to distances from the middle of their first range, in half widths. A missing
/// input, NaN, counts as the middle. The ranges grow with the inputs, at each sample by at most
/// their width on either side; inputs beyond that are clipped. Outputs are clipped to the range of
/// the learned targets, widened by a fifth on either side. Errors may be limited to a multiple of
/// their mean size. Thus no number overflows, and outliers do little damage.
///
/// All sums have a fixed order, so that results have the same bits on every machine.
///
/// Source: Haykin, S. (2002). Adaptive Filter Theory, chapter 9, with a bound on the trace of the
/// covariance, which would otherwise grow without limit along directions that no input has.
/// Cost: learning needs 3 (n_inputs + 1)^2 multiplications and additions.
class RecursiveLeastSquares {
 public:
  static constexpr double kUnlimited = std::numeric_limits<double>::infinity();

  /// Takes the first ranges of the inputs, shape (n_inputs,) each. A sample that is n samples old
  /// has the weight forgetting^n. `error_limit` is the largest error in mean sizes of errors.
  /// Throws std::invalid_argument naming the impossible argument.
  RecursiveLeastSquares(std::span<const double> low, std::span<const double> high,
                        std::size_t n_outputs, double forgetting, double error_limit = kUnlimited)
      : forgetting_(forgetting), error_limit_(error_limit) {
    core::require_in_range("forgetting", forgetting, 0.5, 1.0);
    core::require(error_limit >= 1.0, "error_limit", "at least 1", error_limit);
    covariance_ = {kFirstVariance};
    add_outputs(n_outputs);
    add_inputs(low, high);
  }

  std::size_t n_inputs() const noexcept { return low_.size(); }
  std::size_t n_outputs() const noexcept { return origins_.size(); }

  /// Adds inputs after the others, without a change of any prediction. Throws
  /// std::invalid_argument naming the impossible argument.
  void add_inputs(std::span<const double> low, std::span<const double> high) {
    detail::require_ranges(low, high, n_inputs());
    const std::size_t n_before = n_inputs() + 1, n = n_before + low.size();
    std::vector<double> covariance(n * n), weights(n_outputs() * n);
    for (std::size_t row = 0; row < n; ++row) covariance[row * n + row] = kFirstVariance;
    for (std::size_t row = 0; row < n_before; ++row) {
      std::copy_n(&covariance_[row * n_before], n_before, &covariance[row * n]);
    }
    for (std::size_t output = 0; output < n_outputs(); ++output) {
      std::copy_n(&weights_[output * n_before], n_before, &weights[output * n]);
    }
    covariance_ = std::move(covariance);
    weights_ = std::move(weights);
    for (std::size_t i = 0; i < low.size(); ++i) {
      low_.push_back(low[i]);
      high_.push_back(high[i]);
      middle_.push_back(low[i] / 2.0 + high[i] / 2.0);
      half_width_.push_back(high[i] / 2.0 - low[i] / 2.0);
    }
  }

  /// Adds outputs after the others, as if all targets so far had been 0. Throws
  /// std::invalid_argument naming the impossible argument.
  void add_outputs(std::size_t n) {
    const std::size_t size = detail::n_outputs_with(n, n_outputs());
    origins_.resize(size);
    lowest_.resize(size);
    highest_.resize(size);
    mean_errors_.resize(size);
    weights_.resize(size * (n_inputs() + 1));
  }

  /// Predicts the outputs for a sample; 0 before the first one. Shapes: inputs (n_inputs,), outputs
  /// (n_outputs,). Throws std::invalid_argument for another size. Thread safety: calls may run at
  /// the same time.
  void predict(std::span<const double> inputs, std::span<double> outputs) const {
    core::require_size("inputs", inputs.size(), n_inputs());
    core::require_size("outputs", outputs.size(), n_outputs());
    std::vector<double> columns(n_inputs() + 1);
    scale(inputs, columns);
    for (std::size_t o = 0; o < n_outputs(); ++o) outputs[o] = output(o, columns);
  }

  /// Learns a sample. Shapes: inputs (n_inputs,), targets (n_outputs,), finite. Throws
  /// std::invalid_argument for another size, and targets that are not finite.
  void learn(std::span<const double> inputs, std::span<const double> targets) {
    core::require_size("inputs", inputs.size(), n_inputs());
    core::require_size("targets", targets.size(), n_outputs());
    for (const double target : targets) core::require_finite("targets", target);
    const std::size_t n = n_inputs() + 1;
    std::vector<double> columns(n), gains(n);
    widen(inputs);
    scale(inputs, columns);
    const double variance = product(columns, gains);
    const double factor = 1.0 / (forgetting_ + variance);
    if (n_learned_ == 0.0) {
      std::ranges::copy(targets, origins_.begin());
      std::ranges::copy(targets, lowest_.begin());
      std::ranges::copy(targets, highest_.begin());
    }
    n_learned_ = std::min(n_learned_ + 1.0, detail::kSizeMemory);
    for (std::size_t o = 0; o < n_outputs(); ++o) {
      const double predicted = unlimited_output(o, columns);
      const double error =
          detail::limited(targets[o] - predicted, error_limit_, n_learned_, mean_errors_[o]);
      const double learned = detail::finite(predicted + error);
      lowest_[o] = std::min(lowest_[o], learned);
      highest_[o] = std::max(highest_[o], learned);
      correct(o, gains, factor * error);
    }
    update_covariance(gains, factor);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    const std::size_t n = self.n_inputs(), n_outputs = self.n_outputs(), n_columns = n + 1;
    archive.number("n_learned", self.n_learned_);
    archive.finite("low", {n}, self.low_);
    archive.finite("high", {n}, self.high_);
    archive.finite("middle", {n}, self.middle_);
    archive.finite("half_width", {n}, self.half_width_);
    archive.finite("covariance", {n_columns, n_columns}, self.covariance_);
    archive.finite("weights", {n_outputs, n_columns}, self.weights_);
    archive.finite("origins", {n_outputs}, self.origins_);
    archive.finite("lowest", {n_outputs}, self.lowest_);
    archive.finite("highest", {n_outputs}, self.highest_);
    archive.finite("mean_errors", {n_outputs}, self.mean_errors_);
    if constexpr (Archive::kReads) {
      const auto expect_least = [&archive](const char* name, const std::vector<double>& values,
                                           const std::vector<double>& least) {
        const bool holds = std::ranges::equal(values, least, std::greater_equal<>());
        archive.expect(holds, name, "at least the lowest");
      };
      archive.expect(self.n_learned_ >= 0.0 && self.n_learned_ <= detail::kSizeMemory, "n_learned",
                     "in [0, 100]");
      expect_least("high", self.high_, self.low_);
      expect_least("half_width", self.half_width_, std::vector<double>(n));
      expect_least("highest", self.highest_, self.lowest_);
      expect_least("mean_errors", self.mean_errors_, std::vector<double>(n_outputs));
    }
  }

 private:
  static constexpr double kFirstVariance = 10.0;  ///< of a weight, if errors have the variance 1
  static constexpr double kLargestMean = 100.0;   ///< limit of the mean of the weights' variances
  static constexpr double kMargin = 0.2;  ///< by which outputs may leave the range of targets, as a
                                          ///< share of it
  static constexpr double kFarthest = 1e6;  ///< limit of scaled inputs, in half widths

  /// Clips an input to its range, extended by its width on either side.
  double clipped(std::size_t i, double input) const noexcept {
    const double width = high_[i] - low_[i];
    return std::clamp(detail::finite(input), detail::finite(low_[i] - width),
                      detail::finite(high_[i] + width));
  }

  /// Widens the ranges so that they contain the inputs. Where the first range is a single value,
  /// the half width becomes the distance of the first other value.
  void widen(std::span<const double> inputs) noexcept {
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (std::isnan(inputs[i])) continue;
      const bool is_constant = half_width_[i] == 0.0;
      const double input = is_constant ? detail::finite(inputs[i]) : clipped(i, inputs[i]);
      low_[i] = std::min(low_[i], input);
      high_[i] = std::max(high_[i], input);
      if (is_constant) half_width_[i] = detail::finite(std::abs(input - middle_[i]));
    }
  }

  /// Writes the scaled inputs and, as the first column, 1.
  void scale(std::span<const double> inputs, std::span<double> columns) const noexcept {
    columns[0] = 1.0;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const double distance = detail::scaled(clipped(i, inputs[i]), middle_[i], half_width_[i]);
      columns[i + 1] = std::clamp(2.0 * distance, -kFarthest, kFarthest);
    }
  }

  /// Returns output o, clipped to the range of its targets with the margin. Shape: columns
  /// (n_inputs + 1,), as scale writes them.
  double output(std::size_t o, std::span<const double> columns) const noexcept {
    const double margin = kMargin * (highest_[o] / 2.0 - lowest_[o] / 2.0) * 2.0;
    return std::clamp(unlimited_output(o, columns), detail::finite(lowest_[o] - margin),
                      detail::finite(highest_[o] + margin));
  }

  /// Returns output o before it is clipped; its error is learned.
  double unlimited_output(std::size_t o, std::span<const double> columns) const noexcept {
    const double* const weights = &weights_[o * columns.size()];
    double sum = 0.0;
    for (std::size_t i = 0; i < columns.size(); ++i) sum += weights[i] * columns[i];
    const double value = origins_[o] + sum;
    return std::isnan(value) ? origins_[o] : detail::finite(value);
  }

  /// Writes P x, and returns x^T P x, the variance of an output at the columns x, P being the
  /// covariance. If rounding errors have made it negative or too large, the covariance is reset.
  double product(std::span<const double> columns, std::span<double> out) {
    const std::size_t n = columns.size();
    const auto multiply = [&] {
      std::ranges::fill(out, 0.0);
      for (std::size_t row = 0; row < n; ++row) {
        const double* const covariances = &covariance_[row * n];
        const double column = columns[row];
        for (std::size_t i = 0; i < n; ++i) out[i] += covariances[i] * column;
      }
      double sum = 0.0;
      for (std::size_t i = 0; i < n; ++i) sum += columns[i] * out[i];
      return sum;
    };
    const double variance = multiply();
    if (variance >= 0.0 && variance < detail::kLargest) return variance;
    reset_covariance();
    return multiply();
  }

  /// Sets the covariance to that before the first sample.
  void reset_covariance() noexcept {
    const std::size_t n = n_inputs() + 1;
    std::ranges::fill(covariance_, 0.0);
    for (std::size_t row = 0; row < n; ++row) covariance_[row * n + row] = kFirstVariance;
  }

  /// Adds `size` times the gains to the weights of output o, which become 0 if one is not finite.
  void correct(std::size_t o, std::span<const double> gains, double size) noexcept {
    double* const weights = &weights_[o * gains.size()];
    for (std::size_t i = 0; i < gains.size(); ++i) weights[i] += gains[i] * size;
    if (!core::are_finite({weights, gains.size()})) std::fill_n(weights, gains.size(), 0.0);
  }

  /// Updates the covariance of the weights by a sample. Forgetting lets it grow in directions in
  /// which inputs do not vary, so its trace is limited; it is reset if it has overflowed.
  void update_covariance(std::span<const double> gains, double factor) noexcept {
    const std::size_t n = gains.size();
    const double growth = 1.0 / forgetting_;
    double trace = 0.0;
    for (std::size_t row = 0; row < n; ++row) {
      double* const covariances = &covariance_[row * n];
      for (std::size_t i = 0; i < n; ++i) {  // the order of factors keeps it symmetric
        covariances[i] = (covariances[i] - gains[row] * gains[i] * factor) * growth;
      }
      trace += covariances[row];
    }
    const double largest = kLargestMean * static_cast<double>(n);
    if (!(trace >= 0.0 && trace < detail::kLargest)) {
      reset_covariance();
    } else if (trace > largest) {
      for (double& covariance : covariance_) covariance *= largest / trace;
    }
  }

  double forgetting_;
  double error_limit_;
  double n_learned_ = 0.0;                ///< at most detail::kSizeMemory
  std::vector<double> low_, high_;        ///< ranges of the inputs
  std::vector<double> middle_;            ///< of the first range, as its half width
  std::vector<double> half_width_;        ///< 0 while an input has had a single value
  std::vector<double> covariance_;        ///< (n_inputs + 1, n_inputs + 1)
  std::vector<double> weights_;           ///< (n_outputs, n_inputs + 1)
  std::vector<double> origins_;           ///< first target of each output
  std::vector<double> lowest_, highest_;  ///< ranges of the targets
  std::vector<double> mean_errors_;
};

}  // namespace sdnn::estimators
