/// A weighted mean of several predictions, whose weights follow their recent errors.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::estimators {

/// A mixture that weights experts by the inverse eighth power of their discounted mean squared
/// errors.
///
/// These are the posterior probabilities of experts whose errors are normal with unknown variances
/// estimated from 16 samples. An error is limited to five times the root mean square of the worst
/// expert's errors, so that an outlier does not make all experts alike. Results have the same bits
/// on every machine.
///
/// Source: Littlestone, N., Warmuth, M. K. (1994). The weighted majority algorithm. Information and
/// Computation 108, with the discounts of Herbster, M., Warmuth, M. K. (1998). Tracking the best
/// expert. Machine Learning 32.
class PredictionMixture {
 public:
  /// Takes the weights before any sample, up to a factor. Shape: (n_experts,). Throws
  /// std::invalid_argument without experts, for more than 1,000, and for weights outside [1, 1e6].
  explicit PredictionMixture(std::vector<double> priors)
      : priors_(std::move(priors)), losses_(priors_.size()) {
    core::require_in_range("n_experts", n_experts(), 1, kMostExperts);
    for (const double prior : priors_) core::require_in_range("priors", prior, 1.0, 1e6);
  }

  std::size_t n_experts() const noexcept { return losses_.size(); }

  /// The weights of the experts, which sum to 1. Shape: (n_experts,).
  std::vector<double> weights() const {
    const std::size_t n = n_experts();
    std::vector<double> weights = priors_;
    const double total = std::accumulate(losses_.begin(), losses_.end(), 0.0);
    if (total > 0.0) {
      // The mean loss of all experts is added as that of kPriorSamples samples, so that the first
      // few errors do not decide.
      const double common = kPriorSamples * (total / static_cast<double>(n)) / count_;
      const double least = *std::ranges::min_element(losses_) + common;
      for (std::size_t k = 0; k < n; ++k) {
        const double ratio = least / (losses_[k] + common);
        const double square = ratio * ratio, fourth = square * square;
        weights[k] *= fourth * fourth;
      }
    }
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (double& weight : weights) weight /= sum;
    return weights;
  }

  /// The weighted mean of finite predictions. Shape: (n_experts,). Throws std::invalid_argument for
  /// another size, and predictions that are not finite.
  double mix(std::span<const double> predictions) const {
    require_predictions(predictions);
    const std::vector<double> shares = weights();
    double sum = 0.0;
    for (std::size_t k = 0; k < n_experts(); ++k) sum += shares[k] * predictions[k];
    const auto [lowest, highest] = std::ranges::minmax_element(predictions);
    return std::clamp(sum, *lowest, *highest);
  }

  /// Updates the experts' losses by the errors of their predictions. Shape: (n_experts,). Throws
  /// std::invalid_argument for another size, and numbers that are not finite.
  void learn(std::span<const double> predictions, double target) {
    require_predictions(predictions);
    core::require_finite("target", target);
    const double worst = *std::ranges::max_element(losses_);
    double limit = std::numeric_limits<double>::max();
    if (count_ > kFewSamples && worst > 0.0) {
      const double of_worst = kLargestError * std::sqrt(worst / count_);
      limit = std::min(limit, std::ldexp(of_worst, exponent_));
    }
    std::vector<double> errors(n_experts());
    double largest = 0.0;
    for (std::size_t k = 0; k < n_experts(); ++k) {
      errors[k] = std::min(std::abs(predictions[k] - target), limit);
      largest = std::max(largest, errors[k]);
    }
    if (largest > 0.0) choose_unit(std::ilogb(largest), worst);
    for (std::size_t k = 0; k < n_experts(); ++k) {
      const double error = std::ldexp(errors[k], -exponent_);
      losses_[k] = kDiscount * losses_[k] + error * error;
    }
    count_ = kDiscount * count_ + 1.0;
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("count", self.count_);
    archive.number("exponent", self.exponent_);
    archive.fixed("losses", {self.n_experts()}, self.losses_);
    if constexpr (Archive::kReads) {
      const bool is_count = self.count_ >= 0.0 && self.count_ <= 1.0 / (1.0 - kDiscount);
      archive.expect(is_count, "count", "in [0, 100]");
      archive.expect(std::abs(self.exponent_) <= kLargestExponent, "exponent", "in [-1100, 1100]");
      const auto is_loss = [](double loss) { return loss >= 0.0 && loss <= kLargestLoss; };
      archive.expect(std::ranges::all_of(self.losses_, is_loss), "losses", "in [0, 1e200]");
    }
  }

 private:
  static constexpr std::size_t kMostExperts = 1000;
  static constexpr double kDiscount = 0.99;     ///< factor of a squared error per later sample
  static constexpr double kPriorSamples = 5.0;  ///< of the mean loss, added to each expert's
  static constexpr double kFewSamples = 10.0;  ///< discounted number after which errors are limited
  static constexpr double kLargestError = 5.0;  ///< in root mean squares
  static constexpr double kLargestLoss = 1e200;
  static constexpr double kSmallestLoss = 1e-200;
  static constexpr int kLargestExponent = 1100;  ///< a double's exponent is at most 1,074 in size
  static constexpr int kMostBits = 200;          ///< an error below 2^200 units has a finite square

  void require_predictions(std::span<const double> predictions) const {
    core::require_size("predictions", predictions.size(), n_experts());
    for (const double prediction : predictions) core::require_finite("predictions", prediction);
  }

  /// Chooses 2^exponent, the size of the largest error, as the unit of errors if their squares
  /// would otherwise leave the range of doubles; `worst` is the largest loss.
  void choose_unit(int exponent, double worst) noexcept {
    if (worst > kSmallestLoss && exponent < exponent_ + kMostBits) return;
    const int change = std::clamp(2 * (exponent_ - exponent), -kLargestExponent, kLargestExponent);
    for (double& loss : losses_) loss = std::min(std::ldexp(loss, change), kLargestLoss);
    exponent_ = exponent;
  }

  double count_ = 0.0;          ///< discounted number of samples
  std::int32_t exponent_ = 0;   ///< errors are in units of 2^exponent_
  std::vector<double> priors_;  ///< weights before any sample, up to a factor
  std::vector<double> losses_;  ///< discounted sums of squared errors
};

}  // namespace sdnn::estimators
