/// Codes of symbols and angles: balanced patterns with given pairwise correlations.
#pragma once

#include <algorithm>
#include <array>
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

/// Prefetches a value that will be read soon, if the compiler supports it.
inline void prefetch([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address);
#endif
}

/// A search for patterns whose inner products approach given ones: it swaps two units of a pattern
/// where that does not raise the squared error. Patterns are bytes, +1 and -1.
class CorrelationSearch {
 public:
  /// Rounds the required correlations to inner products of signs, which are integers. Shapes:
  /// correlations (n_bins, n_bins).
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

  /// Starts pattern i as a copy of the preceding pattern whose required correlation with it is the
  /// largest in size, inverted if that is negative. If all are 0, it starts as a random balanced
  /// pattern.
  void begin(std::size_t i, core::Random& random) {
    std::size_t nearest = i;
    for (std::size_t j = 0; j < i; ++j) {
      if (nearest == i || std::llabs(wanted(i, j)) > std::llabs(wanted(i, nearest))) nearest = j;
    }
    std::vector<std::int8_t> pattern(n_units_);
    if (nearest != i && wanted(i, nearest) != 0) {
      const std::int8_t factor = wanted(i, nearest) > 0 ? 1 : -1;
      for (std::size_t k = 0; k < n_units_; ++k) {
        pattern[k] = static_cast<std::int8_t>(factor * unit(k)[nearest]);
      }
    } else {
      for (std::size_t k = 0; k < n_units_; ++k) pattern[k] = k < n_units_ / 2 ? 1 : -1;
      random.shuffle(std::span(pattern));
    }
    for (std::size_t k = 0; k < n_units_; ++k) unit(k)[i] = pattern[k];
    for (std::size_t j = 0; j < i; ++j) {
      core::interruption_point();
      std::int64_t product = 0;
      for (std::size_t k = 0; k < n_units_; ++k) product += std::int64_t{pattern[k]} * unit(k)[j];
      products_[i * n_bins_ + j] = products_[j * n_bins_ + i] = product;
    }
  }

  /// Tries `n_proposals` swaps of two random units in patterns whose numbers `draw_pattern()`
  /// returns, judged by the products with the first `n_others` patterns. Some swaps are drawn in
  /// advance, so that their units are prefetched from memory.
  template <class DrawPattern>
  void propose(std::size_t n_proposals, std::size_t n_others, core::Random& random,
               DrawPattern draw_pattern) {
    std::array<Swap, kDrawnAhead> swaps;
    for (std::size_t done = 0; done < n_proposals; done += swaps.size()) {
      if (done % kProposalsPerPoint == 0) core::interruption_point();
      const std::size_t n_drawn = std::min(swaps.size(), n_proposals - done);
      const std::span drawn(swaps.data(), n_drawn);
      for (auto& swap : drawn) {
        swap.pattern = draw_pattern();
        swap.k = random.below(n_units_);
        swap.l = random.below(n_units_);
        prefetch(unit(swap.k));
        prefetch(unit(swap.l));
      }
      for (const auto& swap : drawn) try_swap(swap, n_others);
    }
  }

  /// All patterns, one after another.
  std::vector<std::int8_t> patterns() const {
    std::vector<std::int8_t> by_pattern(signs_.size());
    for (std::size_t k = 0; k < n_units_; ++k) {
      for (std::size_t i = 0; i < n_bins_; ++i) by_pattern[i * n_units_ + k] = unit(k)[i];
    }
    return by_pattern;
  }

 private:
  /// A proposal to exchange units k and l of a pattern.
  struct Swap {
    std::size_t pattern, k, l;
  };
  static constexpr std::size_t kDrawnAhead = 32;           // swaps whose units are prefetched
  static constexpr std::size_t kProposalsPerPoint = 4096;  // between two interruption points

  /// Swaps a +1 and a -1 of a pattern, unless that raises the squared error of its products with
  /// the first `n_others`.
  void try_swap(const Swap& swap, std::size_t n_others) {
    const auto [i, k, l] = swap;
    std::int8_t* const unit_k = unit(k);
    std::int8_t* const unit_l = unit(l);
    if (unit_k[i] == unit_l[i]) return;
    const std::int64_t twice = unit_l[i] - unit_k[i];  // by which unit k changes: 2 or -2
    const auto step = [&](std::size_t j) { return twice * (unit_k[j] - unit_l[j]); };
    const std::int64_t* const products = &products_[i * n_bins_];
    const std::int64_t* const wanted = &wanted_[i * n_bins_];
    // A product p moves by step s, and its squared error by (p + s - w)^2 - (p - w)^2.
    std::int64_t change = 0;
    const auto add = [&](std::size_t from, std::size_t to) {
      for (std::size_t j = from; j < to; ++j) {
        change += step(j) * (2 * (products[j] - wanted[j]) + step(j));
      }
    };
    add(0, std::min(i, n_others));
    add(i + 1, n_others);
    if (change > 0) return;
    for (std::size_t j = 0; j < n_others; ++j) {
      if (j == i) continue;
      products_[i * n_bins_ + j] += step(j);
      products_[j * n_bins_ + i] = products_[i * n_bins_ + j];
    }
    std::swap(unit_k[i], unit_l[i]);
  }

  /// The signs of unit k in all patterns. They are adjacent, as a swap needs those of two units.
  std::int8_t* unit(std::size_t k) noexcept { return signs_.data() + k * n_bins_; }
  const std::int8_t* unit(std::size_t k) const noexcept { return signs_.data() + k * n_bins_; }

  std::int64_t wanted(std::size_t i, std::size_t j) const noexcept {
    return wanted_[i * n_bins_ + j];
  }

  std::size_t n_bins_;
  std::size_t n_units_;
  std::vector<std::int8_t> signs_;      // (n_units, n_bins)
  std::vector<std::int64_t> products_;  // (n_bins, n_bins)
  std::vector<std::int64_t> wanted_;
};

}  // namespace detail

/// Balanced patterns whose pairwise correlations approach a given symmetric matrix.
///
/// Each pattern starts as a copy of its most correlated predecessor and is then improved by swaps
/// of two units, first against its predecessors and finally against all patterns. Only integers are
/// compared, so the same seed gives the same patterns everywhere. A matrix that no patterns can
/// have is approached in the least squares sense.
///
/// Source: Horie et al. 2014 (for the purpose; the search is ours). Shapes: correlations (n_bins,
/// n_bins). Cost: about 40 n_units n_bins^2 steps, at most some 10^9. Throws std::invalid_argument
/// if n_units is odd, or the matrix is not symmetric with unit diagonal and entries in [-1, 1].
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
  // 20 proposals for each unit of a pattern, or fewer if these would take more than 4e8 steps (both
  // are chosen): a proposal takes up to n_bins steps, and there are n_bins patterns.
  const std::uint64_t affordable = 400'000'000 / (std::uint64_t{n_bins} * n_bins * units) + 1;
  const std::size_t n_proposals =
      units * static_cast<std::size_t>(std::min<std::uint64_t>(20, affordable));
  for (std::size_t i = 0; i < n_bins; ++i) {
    search.begin(i, random);
    search.propose(n_proposals, i, random, [i] { return i; });
  }
  search.propose(n_proposals * n_bins, n_bins, random, [&] { return random.below(n_bins); });
  return PatternTable::from_signs(search.patterns(), n_bins, units);
}

}  // namespace sdnn::coding
