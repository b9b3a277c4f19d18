/// Codes of symbols and angles: balanced patterns with given pairwise correlations.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

namespace detail {

inline constexpr std::size_t kProposalsPerPoint = 4096;

/// Patterns as bytes and their inner products, moved towards wanted ones by swaps of two units.
class CorrelationSearch {
 public:
  CorrelationSearch(std::span<const double> correlations, std::size_t n_bins, std::size_t n_units)
      : n_bins_(n_bins),
        n_units_(n_units),
        signs_(n_bins * n_units),
        products_(n_bins * n_bins),
        wanted_(n_bins * n_bins) {
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
      wanted_[i] = std::llround(correlations[i] * static_cast<double>(n_units));
    }
  }

  /// Starts pattern i as a copy of the most alike of those before it, inverted if unlike.
  void begin(std::size_t i, core::Random& random) {
    std::size_t nearest = i;
    for (std::size_t j = 0; j < i; ++j) {
      if (nearest == i || std::llabs(wanted(i, j)) > std::llabs(wanted(i, nearest))) nearest = j;
    }
    auto pattern = signs(i);
    if (nearest != i && wanted(i, nearest) != 0) {
      const std::int8_t factor = wanted(i, nearest) > 0 ? 1 : -1;
      for (std::size_t k = 0; k < n_units_; ++k) {
        pattern[k] = static_cast<std::int8_t>(factor * signs(nearest)[k]);
      }
    } else {
      for (std::size_t k = 0; k < n_units_; ++k) pattern[k] = k < n_units_ / 2 ? 1 : -1;
      random.shuffle(pattern);
    }
    for (std::size_t j = 0; j < i; ++j) {
      core::interruption_point();
      std::int64_t product = 0;
      for (std::size_t k = 0; k < n_units_; ++k) product += std::int64_t{pattern[k]} * signs(j)[k];
      products_[i * n_bins_ + j] = products_[j * n_bins_ + i] = product;
    }
  }

  /// Proposes to swap a +1 and a -1 of pattern i; keeps the swap unless it raises the squared
  /// error against the first `n_others` patterns.
  void propose(std::size_t i, std::size_t n_others, core::Random& random) {
    auto pattern = signs(i);
    const std::size_t k = random.below(n_units_);
    const std::size_t l = random.below(n_units_);
    if (pattern[k] == pattern[l]) return;
    std::int64_t change = 0;
    for (std::size_t j = 0; j < n_others; ++j) {
      if (j == i) continue;
      const std::int64_t step = product_step(i, j, k, l);
      change += step * (2 * (product(i, j) - wanted(i, j)) + step);
    }
    if (change > 0) return;
    for (std::size_t j = 0; j < n_others; ++j) {
      if (j == i) continue;
      products_[i * n_bins_ + j] += product_step(i, j, k, l);
      products_[j * n_bins_ + i] = products_[i * n_bins_ + j];
    }
    std::swap(pattern[k], pattern[l]);
  }

  std::span<const std::int8_t> all_signs() const noexcept { return signs_; }

 private:
  std::span<std::int8_t> signs(std::size_t i) noexcept {
    return {signs_.data() + i * n_units_, n_units_};
  }
  std::int64_t product(std::size_t i, std::size_t j) const noexcept {
    return products_[i * n_bins_ + j];
  }
  std::int64_t wanted(std::size_t i, std::size_t j) const noexcept {
    return wanted_[i * n_bins_ + j];
  }
  /// How the product of patterns i and j moves when units k and l of pattern i swap.
  std::int64_t product_step(std::size_t i, std::size_t j, std::size_t k, std::size_t l) noexcept {
    return std::int64_t{signs(i)[l] - signs(i)[k]} * (signs(j)[k] - signs(j)[l]);
  }

  std::size_t n_bins_;
  std::size_t n_units_;
  std::vector<std::int8_t> signs_;      // (n_bins, n_units)
  std::vector<std::int64_t> products_;  // (n_bins, n_bins)
  std::vector<std::int64_t> wanted_;
};

}  // namespace detail

/// Balanced patterns whose pairwise correlations approach a given symmetric matrix.
///
/// Each pattern starts as a copy of its most alike predecessor and is then improved by swaps of two
/// units, first against its predecessors and at last against all. Only integers are compared, so
/// the same seed gives the same patterns everywhere. A matrix that no patterns can have is
/// approached in the least squares sense.
///
/// Source: Horie et al. 2014 (the purpose; the search is ours). Shapes: correlations
/// (n_bins, n_bins). Cost: about 40 n_units n_bins^2 steps, at most some 10^9. Throws
/// std::invalid_argument if n_units is odd, or the matrix is not symmetric with unit diagonal and
/// entries in [-1, 1].
inline PatternTable correlation_matrix_patterns(int n_units, std::span<const double> correlations,
                                                std::size_t n_bins, core::Random& random) {
  core::require_in_range("n_units", n_units, 2, 1 << 24);
  core::require(n_units % 2 == 0, "n_units", "even", n_units);
  core::require_in_range("n_bins", n_bins, 1, 4096);
  core::require(correlations.size() == n_bins * n_bins, "correlations", "a square matrix",
                correlations.size());
  for (std::size_t i = 0; i < n_bins; ++i) {
    core::interruption_point();
    for (std::size_t j = 0; j < n_bins; ++j) {
      const std::string name = "correlations[" + std::to_string(i) + ", " + std::to_string(j) + "]";
      const double value = correlations[i * n_bins + j];
      core::require_in_range(name, value, -1.0, 1.0);
      core::require(i != j || value == 1.0, name, "1 on the diagonal", value);
      core::require(value == correlations[j * n_bins + i], name, "symmetric", value);
    }
  }
  const auto units = static_cast<std::size_t>(n_units);
  detail::CorrelationSearch search(correlations, n_bins, units);
  const std::size_t affordable = 400'000'000 / (units * n_bins * n_bins) + 1;
  const std::size_t n_proposals = units * std::min<std::size_t>(20, affordable);
  for (std::size_t i = 0; i < n_bins; ++i) {
    search.begin(i, random);
    for (std::size_t p = 0; p < n_proposals; ++p) {
      if (p % detail::kProposalsPerPoint == 0) core::interruption_point();
      search.propose(i, i, random);
    }
  }
  for (std::size_t p = 0; p < n_proposals * n_bins; ++p) {
    search.propose(random.below(n_bins), n_bins, random);
  }
  return PatternTable::from_signs(search.all_signs(), n_bins, units);
}

}  // namespace sdnn::coding
