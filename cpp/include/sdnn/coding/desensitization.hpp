/// Layer 3: one input's pattern, desensitized by another's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// A ternary pattern: unit k is 0 where `active` is off, else +1 or -1 as `positive` is on or off.
template <std::size_t Capacity>
struct TernaryPattern {
  core::BitLayer<Capacity> active;
  core::BitLayer<Capacity> positive;  ///< a subset of `active`

  friend bool operator==(const TernaryPattern&, const TernaryPattern&) = default;
};

/// x_mu desensitized by x_nu (already permuted): neutral where the modifier is -1.
///
/// Source: section 3.1 (layer 3): x^mu(nu)_k = (1 + (sigma x^nu)_k) / 2 * x^mu_k.
template <std::size_t Capacity>
TernaryPattern<Capacity> desensitize(const core::BitLayer<Capacity>& x_mu,
                                     const core::BitLayer<Capacity>& by) {
  return {by, x_mu & by};
}

/// Unit k of a permuted pattern is unit `permutation[k]` of the pattern.
using Permutation = std::vector<std::uint32_t>;

/// `pattern` with its units permuted. Throws std::invalid_argument if the sizes differ.
template <std::size_t Capacity>
core::BitLayer<Capacity> permute(const core::BitLayer<Capacity>& pattern,
                                 const Permutation& permutation) {
  core::require(permutation.size() == pattern.size(), "permutation", "as long as the pattern",
                permutation.size());
  core::BitLayer<Capacity> permuted(pattern.size());
  for (std::size_t k = 0; k < permutation.size(); ++k) permuted.set(k, pattern[permutation[k]]);
  return permuted;
}

/// The permutation that undoes `permutation`.
inline Permutation inverse(const Permutation& permutation) {
  Permutation result(permutation.size());
  for (std::size_t k = 0; k < permutation.size(); ++k) {
    result[permutation[k]] = static_cast<std::uint32_t>(k);
  }
  return result;
}

/// A uniformly random permutation of `n` units.
inline Permutation random_permutation(std::size_t n, core::Random& random) {
  Permutation permutation(n);
  std::iota(permutation.begin(), permutation.end(), 0U);
  random.shuffle(std::span(permutation));
  return permutation;
}

}  // namespace sdnn::coding
