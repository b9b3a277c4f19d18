/// A weighted mean of several estimates of the probabilities of classes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::estimators {

/// A mixture that weights candidates by the likelihood of recent labels: e to the discounted sum of
/// the logarithms of the probabilities that they gave to the labels.
///
/// The first candidate is an estimate of the shares of classes. Each scorer gives a score for every
/// class; softmax(3 score), softmax(6 score) and softmax(12 score) are three candidates, so that
/// the steepness is learned, too. Results have the same bits on every machine.
///
/// Source: as PredictionMixture, for the logarithmic loss, with which the weights are a posterior.
class ProbabilityMixture {
 public:
  /// Makes a mixture of shares and `n_scorers` scorers, all with equal weights. Throws
  /// std::invalid_argument for more than 1,000 scorers.
  explicit ProbabilityMixture(std::size_t n_scorers) : losses_(1 + kSteepnesses * n_scorers) {
    core::require_in_range("n_scorers", n_scorers, 0, kMostScorers);
  }

  std::size_t n_scorers() const noexcept { return (losses_.size() - 1) / kSteepnesses; }

  /// The weights of the shares and of each scorer, which sum to 1. Shape: (1 + n_scorers,).
  std::vector<double> weights() const {
    const std::vector<double> of_candidates = candidate_weights();
    std::vector<double> weights(1 + n_scorers());
    weights[0] = of_candidates[0];
    for (std::size_t k = 1; k < of_candidates.size(); ++k) {
      weights[1 + (k - 1) / kSteepnesses] += of_candidates[k];
    }
    return weights;
  }

  /// Writes the probabilities of classes, which sum to 1.
  ///
  /// Shapes: shares, out (n_classes,), scores (n_scorers, n_classes). Throws std::invalid_argument
  /// for other sizes, and numbers that are not finite.
  void mix(std::span<const double> shares, std::span<const double> scores,
           std::span<double> out) const {
    core::require_size("out", out.size(), shares.size());
    const std::vector<double> weights = candidate_weights();
    const std::vector<double> candidates = probabilities(shares, scores);
    std::ranges::fill(out, 0.0);
    for (std::size_t k = 0; k < weights.size(); ++k) {
      for (std::size_t c = 0; c < out.size(); ++c) {
        out[c] += weights[k] * candidates[k * out.size() + c];
      }
    }
    normalize(out);
  }

  /// Updates the weights by the probabilities that the candidates give to the label, the index of a
  /// class. Shapes and errors: see mix.
  void learn(std::span<const double> shares, std::span<const double> scores, std::size_t label) {
    core::require_below("label", label, shares.size());
    const std::vector<double> candidates = probabilities(shares, scores);
    for (std::size_t k = 0; k < losses_.size(); ++k) {
      losses_[k] = kDiscount * losses_[k] - core::log(candidates[k * shares.size() + label]);
    }
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.fixed("losses", {self.losses_.size()}, self.losses_);
    if constexpr (Archive::kReads) {
      const auto is_loss = [](double loss) { return loss >= 0.0 && loss <= kLargestLoss; };
      archive.expect(std::ranges::all_of(self.losses_, is_loss), "losses", "in [0, 1e6]");
    }
  }

 private:
  static constexpr std::size_t kSteepnesses = 3;  ///< candidates of a scorer: 3, 6 and 12
  static constexpr double kSteepness = 3.0;       ///< the smallest
  static constexpr std::size_t kMostScorers = 1000;
  static constexpr double kDiscount = 0.99;  ///< factor of a loss for each later sample
  /// An estimate is at least kLeastProbability, or kLeastOfAll / n_classes if that is less, so that
  /// no label has an infinite loss.
  static constexpr double kLeastProbability = 1e-3, kLeastOfAll = 0.1;
  static constexpr double kLeastWeight = 1e-3;  ///< so that an expert can recover after a drift
  static constexpr double kLargestLoss = 1e6;

  /// Divides values by their sum.
  static void normalize(std::span<double> values) noexcept {
    double sum = 0.0;
    for (const double value : values) sum += value;
    for (double& value : values) value /= sum;
  }

  /// The weights of the candidates: the shares, then each scorer with each steepness.
  std::vector<double> candidate_weights() const {
    const double least = *std::ranges::min_element(losses_);
    std::vector<double> weights;
    for (const double loss : losses_) weights.push_back(core::exp(least - loss));
    normalize(weights);
    for (double& weight : weights) weight = std::max(weight, kLeastWeight);
    normalize(weights);
    return weights;
  }

  /// Returns the probabilities of classes of all candidates, shape (n_candidates, n_classes). Each
  /// is raised to the least probability, and then the candidate's are normalized again.
  std::vector<double> probabilities(std::span<const double> shares,
                                    std::span<const double> scores) const {
    const std::size_t n = shares.size();
    core::require(n > 0, "shares", "of at least one class", n);
    core::require_size("scores", scores.size(), n_scorers() * n);
    for (const double share : shares) core::require_finite("shares", share);
    for (const double score : scores) core::require_finite("scores", score);
    std::vector<double> all(losses_.size() * n);
    std::ranges::copy(shares, all.begin());
    for (std::size_t scorer = 0; scorer < n_scorers(); ++scorer) {
      const auto of_scorer = scores.subspan(scorer * n, n);
      const double largest = *std::ranges::max_element(of_scorer);
      double* const first = &all[(1 + scorer * kSteepnesses) * n];
      for (std::size_t c = 0; c < n; ++c) {
        const double raised = core::exp(kSteepness * (of_scorer[c] - largest));
        first[c] = raised;
        first[n + c] = raised * raised;  // twice the steepness squares the exponential
        first[2 * n + c] = first[n + c] * first[n + c];
      }
    }
    const double least = std::min(kLeastProbability, kLeastOfAll / static_cast<double>(n));
    for (std::size_t k = 0; k < losses_.size(); ++k) {
      const std::span<double> of_candidate(&all[k * n], n);
      if (k > 0) normalize(of_candidate);
      for (double& value : of_candidate) value = std::clamp(value, least, 1.0);
      normalize(of_candidate);
    }
    return all;
  }

  std::vector<double> losses_;  ///< discounted sums of negative log likelihoods
};

}  // namespace sdnn::estimators
