/// Codes of numbers: chains of patterns in which neighbours are alike.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// How a random-inverse code is made.
struct RandomInverseConfig {
  int n_units = 2000;  ///< n, units per pattern; even
  int n_bins = 1001;   ///< q, patterns
  int n_flipped = 5;   ///< r, units of each sign that differ between neighbours
};

/// The first pattern is random and balanced; each next one flips `n_flipped` units of each sign.
///
/// Source: Nonaka, Tanaka, Morita 2011. The expected correlation of patterns d bins apart is
/// (1 - 4 n_flipped / n_units)^d. Throws std::invalid_argument naming the impossible field.
inline PatternTable random_inverse_patterns(const RandomInverseConfig& config,
                                            core::Random& random) {
  core::require_in_range("n_units", config.n_units, 2, 1 << 24);
  core::require(config.n_units % 2 == 0, "n_units", "even", config.n_units);
  core::require_in_range("n_bins", config.n_bins, 1, 1 << 24);
  core::require_in_range("n_flipped", config.n_flipped, 0, config.n_units / 2);
  const auto n_units = static_cast<std::size_t>(config.n_units);
  const auto n_flipped = static_cast<std::size_t>(config.n_flipped);
  PatternTable table(static_cast<std::size_t>(config.n_bins), n_units);
  fill_balanced(table, 0, random);

  // Units of each sign, in an order that only the draws below change.
  std::vector<std::size_t> positive;
  std::vector<std::size_t> negative;
  for (std::size_t k = 0; k < n_units; ++k) {
    (table.sign(0, k) > 0 ? positive : negative).push_back(k);
  }
  for (std::size_t bin = 1; bin < table.n_bins(); ++bin) {
    table.copy(bin - 1, bin);
    for (auto* const units : {&positive, &negative}) {
      for (std::size_t i = 0; i < n_flipped; ++i) {  // the first n_flipped of a partial shuffle
        std::swap((*units)[i], (*units)[i + random.below(units->size() - i)]);
        table.flip(bin, (*units)[i]);
      }
    }
    std::swap_ranges(positive.begin(), positive.begin() + static_cast<std::ptrdiff_t>(n_flipped),
                     negative.begin());
  }
  return table;
}

/// How a code by anchor interpolation is made.
struct AnchorConfig {
  int n_units = 2000;         ///< units per pattern
  int n_anchor_patterns = 9;  ///< random patterns; the last one ends the chain
  int n_interpolated = 44;    ///< patterns between two neighbouring anchors
  bool circular = false;      ///< last anchor = first: for angles
};

/// The paper's code of layer 2: (n_anchor_patterns - 1) * (n_interpolated + 1) patterns.
///
/// The same draws and patterns as anchor_interpolation, without its compiled capacity.
/// Throws std::invalid_argument naming the impossible field.
inline PatternTable anchor_patterns(const AnchorConfig& config, core::Random& random) {
  core::require_in_range("n_units", config.n_units, 2, 1 << 24);
  core::require_in_range("n_anchor_patterns", config.n_anchor_patterns, 2, 10000);
  core::require_in_range("n_interpolated", config.n_interpolated, 0, 10000);
  const auto n_units = static_cast<std::size_t>(config.n_units);
  const auto n_anchors = static_cast<std::size_t>(config.n_anchor_patterns);
  const auto n_portions = static_cast<std::size_t>(config.n_interpolated) + 1;
  PatternTable anchors(n_anchors, n_units);
  for (std::size_t i = 0; i < n_anchors; ++i) fill_balanced(anchors, i, random);
  if (config.circular) anchors.copy(0, n_anchors - 1);

  PatternTable table((n_anchors - 1) * n_portions, n_units);
  for (std::size_t i = 0; i + 1 < n_anchors; ++i) {
    std::vector<std::size_t> differing;
    for (std::size_t k = 0; k < n_units; ++k) {
      if (anchors.sign(i, k) != anchors.sign(i + 1, k)) differing.push_back(k);
    }
    random.shuffle(std::span(differing));
    for (std::size_t j = 0; j < n_portions; ++j) {
      const std::size_t bin = i * n_portions + j;
      for (std::size_t k = 0; k < n_units; ++k) {
        if (table.sign(bin, k) != anchors.sign(i, k)) table.flip(bin, k);
      }
      for (std::size_t d = 0; d < j * differing.size() / n_portions; ++d) {
        table.flip(bin, differing[d]);
      }
    }
  }
  return table;
}

}  // namespace sdnn::coding
