/// The paper's code of numbers and angles: interpolation between random anchor patterns.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// Parameters of a code by anchor interpolation.
struct AnchorConfig {
  int n_units = 2000;         ///< units per pattern
  int n_anchor_patterns = 9;  ///< p_1 .. p_9; the last one ends the chain and has no bin
  int n_interpolated = 44;    ///< patterns between two neighbouring anchors
  bool balanced = true;  ///< anchors have equal numbers of +1 and -1; false: independent fair units
  bool circular = false;  ///< last anchor = first: for angles
};

/// Makes (n_anchor_patterns - 1) * (n_interpolated + 1) patterns, which lead from each anchor to
/// the next. The bins of an anchor begin with the anchor itself; the last anchor has no bins.
///
/// The units in which two neighbouring anchors differ flip in a random order, in n_interpolated + 1
/// nearly equal portions: the j-th ends at floor(j * differing / (n_interpolated + 1)).
///
/// Source: section 3.1 (layer 2); method.md, section 1.2. Throws std::invalid_argument naming the
/// impossible field.
inline PatternTable anchor_patterns(const AnchorConfig& config, core::Random& random) {
  core::require_in_range("n_units", config.n_units, 2, 1 << 24);
  core::require_in_range("n_anchor_patterns", config.n_anchor_patterns, 2, 10000);
  core::require_in_range("n_interpolated", config.n_interpolated, 0, 10000);
  const auto n_anchors = static_cast<std::size_t>(config.n_anchor_patterns);
  const auto n_portions = static_cast<std::size_t>(config.n_interpolated) + 1;
  PatternTable anchors(n_anchors, static_cast<std::size_t>(config.n_units));
  for (std::size_t i = 0; i < n_anchors; ++i) fill_random(anchors, i, config.balanced, random);
  if (config.circular) anchors.copy(0, n_anchors - 1);

  PatternTable table((n_anchors - 1) * n_portions, anchors.n_units());
  for (std::size_t i = 0; i + 1 < n_anchors; ++i) {
    std::vector<std::size_t> differing;
    for (std::size_t k = 0; k < anchors.n_units(); ++k) {
      if (anchors[i][k] != anchors[i + 1][k]) differing.push_back(k);
    }
    random.shuffle(std::span(differing));
    const std::size_t first = i * n_portions;
    anchors[i].for_each_set([&](std::size_t k) { table.set(first, k); });
    std::size_t n_flipped = 0;
    for (std::size_t j = 1; j < n_portions; ++j) {
      core::interruption_point();
      table.copy(first + j - 1, first + j);
      for (; n_flipped < j * differing.size() / n_portions; ++n_flipped) {
        table.flip(first + j, differing[n_flipped]);
      }
    }
  }
  return table;
}

}  // namespace sdnn::coding
