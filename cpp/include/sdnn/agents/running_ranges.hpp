/// Ranges that follow the mean and the deviation of observed variables.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// Ranges of variables that change with each observation: the mean of all observations so far, plus
/// and minus 2.5 standard deviations.
///
/// Source: Welford, B. (1962), for the moments; normalized observations of streaming learners, as
/// in Elsayed, M., Vasan, G., Mahmood, A. R. (2024), with bounded ends.
class RunningRanges {
 public:
  explicit RunningRanges(std::size_t n_variables)
      : counts_(n_variables), means_(n_variables), squares_(n_variables) {}

  /// Takes an observation into account; missing readings are left out. Shape: (n_variables,).
  void note(std::span<const double> observation) noexcept {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (!std::isfinite(observation[i])) continue;
      const double x = std::clamp(observation[i], -kLargest, kLargest);
      counts_[i] = std::min(counts_[i] + 1, kMostNoted);
      const double difference = x - means_[i];
      means_[i] += difference / static_cast<double>(counts_[i]);
      squares_[i] += difference * (x - means_[i]);
    }
  }

  /// The ends of a variable's present range. Before its second observation, the deviation is 1.
  std::pair<double, double> operator[](std::size_t i) const noexcept {
    const double mean = means_[i];
    const double least = std::max(kRounding * std::abs(mean), kSmallest);
    double deviation = std::max(1.0, least);
    if (counts_[i] > 1) {
      const auto n_more = static_cast<double>(counts_[i] - 1);
      deviation = std::max(std::sqrt(squares_[i] / n_more), least);
    }
    return {mean - kDeviations * deviation, mean + kDeviations * deviation};
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    const std::size_t n = self.counts_.size();
    archive.fixed("counts", {n}, self.counts_);
    archive.fixed("means", {n}, self.means_);
    archive.fixed("squares", {n}, self.squares_);
    if constexpr (Archive::kReads) {
      const auto is_count = [](std::int64_t count) { return count >= 0 && count <= kMostNoted; };
      const auto is_mean = [](double mean) { return std::abs(mean) <= kLargest; };
      const auto is_square = [](double sum) { return sum >= 0.0 && std::isfinite(sum); };
      archive.expect(std::ranges::all_of(self.counts_, is_count), "counts", "in [0, 2^40]");
      archive.expect(std::ranges::all_of(self.means_, is_mean), "means", "in [-1e140, 1e140]");
      archive.expect(std::ranges::all_of(self.squares_, is_square), "squares",
                     "finite, not below 0");
    }
  }

 private:
  static constexpr double kDeviations = 2.5;
  static constexpr double kRounding = 1e-6;    // least deviation, relative to the mean
  static constexpr double kSmallest = 1e-140;  // least deviation, so that ranges can be divided by
  static constexpr double kLargest = 1e140;    // largest value, so that squares can be summed
  static constexpr std::int64_t kMostNoted = std::int64_t{1}
                                             << 40;  // a constant share from then on

  std::vector<std::int64_t> counts_;
  std::vector<double> means_;
  std::vector<double> squares_;  ///< sums of squared differences from the mean
};

}  // namespace sdnn::agents
