/// Permutations of the units of patterns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// The order of the units of a permuted pattern: its unit k is unit `permutation[k]` of the
/// pattern.
///
/// Source: sigma_mu_nu of section 3.1 (layer 3).
using Permutation = std::vector<std::uint32_t>;

/// A uniformly random permutation of `n` units.
inline Permutation random_permutation(std::size_t n, core::Random& random) {
  Permutation permutation(n);
  std::iota(permutation.begin(), permutation.end(), 0U);
  random.shuffle(std::span(permutation));
  return permutation;
}

/// The permutation that undoes `permutation`.
inline Permutation inverse(const Permutation& permutation) {
  Permutation result(permutation.size());
  for (std::size_t k = 0; k < permutation.size(); ++k) {
    result[permutation[k]] = static_cast<std::uint32_t>(k);
  }
  return result;
}

/// Throws std::invalid_argument unless the permutation has each of the numbers 0 to `n_units` - 1
/// exactly once.
inline void require_permutation(const Permutation& permutation, std::size_t n_units) {
  core::require(permutation.size() == n_units, "permutation",
                std::to_string(n_units) + " units long", permutation.size());
  std::vector<bool> seen(n_units, false);
  for (const std::uint32_t unit : permutation) {
    core::require(unit < n_units && !seen[unit], "permutation", "every unit number exactly once",
                  unit);
    seen[unit] = true;
  }
}

/// A table with every pattern permuted. Throws std::invalid_argument as require_permutation does.
inline PatternTable permuted(const PatternTable& table, const Permutation& permutation) {
  require_permutation(permutation, table.n_units());
  PatternTable result(table.n_bins(), table.n_units());
  for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
    core::interruption_point();
    const core::BitLayer pattern = table[bin];
    for (std::size_t k = 0; k < permutation.size(); ++k) {
      if (pattern[permutation[k]]) result.set(bin, k);
    }
  }
  return result;
}

}  // namespace sdnn::coding
