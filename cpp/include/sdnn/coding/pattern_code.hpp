/// Layer 2: each input's value becomes one of a book of binary patterns.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// The number of a sub-range of [0, 1], and of the pattern assigned to it.
using Bin = std::uint16_t;

/// How one input is coded (spec section 1, item 2).
struct PatternCodeConfig {
  int n_pattern_units = 200;     ///< m, units per pattern
  int n_anchor_patterns = 9;     ///< p_1 .. p_9; the last is not assigned to a bin
  int n_interpolated = 44;       ///< patterns between two neighbouring anchors
  bool balanced_anchors = true;  ///< as many +1 as -1; false: independent fair units
  bool circular = false;         ///< last anchor = first: for angles
};

/// The patterns of one input: `n_bins` of them, each of `n_pattern_units` units (set = +1).
///
/// Source: section 3.1 (layer 2); spec section 1, item 2.
template <std::size_t Capacity>
class CodeBook {
 public:
  using Pattern = core::BitLayer<Capacity>;

  /// A book of given patterns, one per bin, all of the same size.
  ///
  /// Throws std::invalid_argument if there is none, too many, or if their sizes differ.
  explicit CodeBook(std::vector<Pattern> patterns) : patterns_(std::move(patterns)) {
    core::require_in_range("n_bins", patterns_.size(), 1, 65535);
    for (const Pattern& pattern : patterns_) {
      core::require(pattern.size() == n_pattern_units(), "patterns", "all of one size",
                    pattern.size());
    }
  }

  std::size_t n_bins() const noexcept { return patterns_.size(); }
  std::size_t n_pattern_units() const noexcept { return patterns_.front().size(); }
  const Pattern& operator[](Bin bin) const noexcept {
    assert(bin < patterns_.size());
    return patterns_[bin];
  }

  /// The bin of `value` among `n_bins` equal half-open parts of [0, 1]; 1 falls into the last.
  Bin bin_of(double value) const noexcept {
    assert(value >= 0.0 && value <= 1.0);
    const auto bin = static_cast<std::size_t>(value * static_cast<double>(n_bins()));
    return static_cast<Bin>(bin < n_bins() ? bin : n_bins() - 1);
  }

 private:
  std::vector<Pattern> patterns_;
};

/// One random anchor pattern of `n_units` units; balanced means floor(n_units / 2) units are on.
template <std::size_t Capacity>
core::BitLayer<Capacity> random_pattern(std::size_t n_units, bool balanced, core::Random& random) {
  core::BitLayer<Capacity> pattern(n_units);
  if (!balanced) {
    for (std::size_t k = 0; k < n_units; ++k) pattern.set(k, random.below(2) == 1);
    return pattern;
  }
  std::vector<std::size_t> order(n_units);
  for (std::size_t k = 0; k < n_units; ++k) order[k] = k;
  random.shuffle(std::span(order));
  for (std::size_t k = 0; k < n_units / 2; ++k) pattern.set(order[k]);
  return pattern;
}

/// A code book by anchor interpolation: (n_anchor_patterns - 1) * (n_interpolated + 1) patterns.
///
/// Between neighbouring anchors the units in which they differ flip in a random order; the j-th of
/// n_interpolated + 1 nearly equal portions ends at floor(j * differing / (n_interpolated + 1)).
///
/// Source: section 3.1 (layer 2). Throws std::invalid_argument naming the field that is impossible,
/// std::length_error if the capacity is too small.
template <std::size_t Capacity>
CodeBook<Capacity> anchor_interpolation(const PatternCodeConfig& config, core::Random& random) {
  core::require_in_range("n_pattern_units", config.n_pattern_units, 2, 1 << 20);
  core::require_in_range("n_anchor_patterns", config.n_anchor_patterns, 2, 10000);
  core::require_in_range("n_interpolated", config.n_interpolated, 0, 10000);
  const auto n_portions = static_cast<std::size_t>(config.n_interpolated) + 1;
  const auto n_anchors = static_cast<std::size_t>(config.n_anchor_patterns);
  core::require((n_anchors - 1) * n_portions <= 65535,
                "(n_anchor_patterns - 1) * (n_interpolated + 1)", "at most 65535",
                (n_anchors - 1) * n_portions);

  std::vector<core::BitLayer<Capacity>> anchors;
  for (std::size_t i = 0; i < n_anchors; ++i) {
    anchors.push_back(random_pattern<Capacity>(static_cast<std::size_t>(config.n_pattern_units),
                                               config.balanced_anchors, random));
  }
  if (config.circular) anchors.back() = anchors.front();

  std::vector<core::BitLayer<Capacity>> patterns;
  patterns.reserve((n_anchors - 1) * n_portions);
  for (std::size_t i = 0; i + 1 < n_anchors; ++i) {
    std::vector<std::size_t> differing;
    (anchors[i] ^ anchors[i + 1]).for_each_set([&](std::size_t k) { differing.push_back(k); });
    random.shuffle(std::span(differing));
    core::BitLayer<Capacity> pattern = anchors[i];
    std::size_t flipped = 0;
    for (std::size_t j = 0; j < n_portions; ++j) {
      for (; flipped < j * differing.size() / n_portions; ++flipped) {
        pattern.flip(differing[flipped]);
      }
      patterns.push_back(pattern);
    }
  }
  return CodeBook<Capacity>(std::move(patterns));
}

}  // namespace sdnn::coding
