/// Codes of numbers: chains of patterns in which neighbours are similar.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// Parameters of a random-inverse code.
struct RandomInverseConfig {
  int n_units = 2000;  ///< n, units per pattern; even
  int n_bins = 1001;   ///< q, patterns
  int n_flipped = 5;   ///< r, units of each sign that differ between neighbours
};

/// Makes a chain of balanced patterns, one per bin: the first is random, and each further pattern
/// is its predecessor with `n_flipped` random units of each sign flipped.
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
  fill_random(table, 0, true, random);

  // The numbers of the units of each sign. Each bin moves the units to flip to the front of both
  // lists, and then exchanges these fronts, because the flipped units have the other sign.
  std::vector<std::size_t> positive;
  std::vector<std::size_t> negative;
  for (std::size_t k = 0; k < n_units; ++k) {
    (table.sign(0, k) > 0 ? positive : negative).push_back(k);
  }
  for (std::size_t bin = 1; bin < table.n_bins(); ++bin) {
    core::interruption_point();
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

}  // namespace sdnn::coding
