/// An order of queries in which consecutive queries are similar.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace sdnn::estimators {

namespace detail {

/// Returns the position of a point on a Hilbert curve through a cube with 2^n_bits points on each
/// side. `axes` has the point's coordinates, and is overwritten. Requires axes.size() * n_bits
/// <= 64.
///
/// Source: Skilling 2004, "Programming the Hilbert curve": from the highest bit down, the
/// reflections and exchanges of axes in the sub-cubes are undone; then the bits are Gray decoded
/// and interleaved.
inline std::uint64_t hilbert_index(std::span<std::uint32_t> axes, int n_bits) noexcept {
  const std::size_t n = axes.size();
  const std::uint32_t top = std::uint32_t{1} << (n_bits - 1);
  for (std::uint32_t bit = top; bit > 1; bit >>= 1) {
    const std::uint32_t below = bit - 1;
    for (std::size_t i = 0; i < n; ++i) {
      if ((axes[i] & bit) != 0) {
        axes[0] ^= below;
      } else {
        const std::uint32_t exchanged = (axes[0] ^ axes[i]) & below;
        axes[0] ^= exchanged;
        axes[i] ^= exchanged;
      }
    }
  }
  for (std::size_t i = 1; i < n; ++i) axes[i] ^= axes[i - 1];
  std::uint32_t mask = 0;
  for (std::uint32_t bit = top; bit > 1; bit >>= 1) {
    if ((axes[n - 1] & bit) != 0) mask ^= bit - 1;
  }
  std::uint64_t index = 0;
  for (int bit = n_bits - 1; bit >= 0; --bit) {
    for (std::size_t i = 0; i < n; ++i) index = index << 1 | ((axes[i] ^ mask) >> bit & 1);
  }
  return index;
}

/// Returns the length of a walk through the queries: the sum over steps and inputs of the
/// difference of bins, each counted as `cap` at most.
inline std::uint64_t walk_length(std::span<const std::int32_t> bins, std::size_t n_inputs,
                                 std::span<const std::uint32_t> order, std::int32_t cap) noexcept {
  std::uint64_t length = 0;
  for (std::size_t q = 1; q < order.size(); ++q) {
    const std::int32_t* const from = bins.data() + order[q - 1] * n_inputs;
    const std::int32_t* const to = bins.data() + order[q] * n_inputs;
    for (std::size_t i = 0; i < n_inputs; ++i) {
      length += static_cast<std::uint64_t>(std::min(std::abs(to[i] - from[i]), cap));
    }
  }
  return length;
}

}  // namespace detail

/// Returns an order of the queries in which few bins change between consecutive queries: the given
/// order or a Hilbert curve, whichever is shorter. Shapes: bins (n_queries, n_inputs). Cost: a
/// sort.
inline std::vector<std::uint32_t> query_order(std::span<const std::int32_t> bins,
                                              std::size_t n_inputs) {
  constexpr std::int32_t kCap = 64;  // more distant patterns have little in common
  const std::size_t n_queries = bins.size() / n_inputs;
  std::vector<std::uint32_t> given_order(n_queries);
  std::iota(given_order.begin(), given_order.end(), std::uint32_t{0});
  const std::uint64_t given_length = detail::walk_length(bins, n_inputs, given_order, kCap);
  // With up to 1.5 bins a step, as for queries on a lattice, another order would save little.
  if (n_queries < 3 || given_length <= n_queries + n_queries / 2) return given_order;

  std::int32_t largest = 1;
  for (const std::int32_t bin : bins) largest = std::max(largest, bin);
  const auto n_bits = static_cast<int>(std::bit_width(static_cast<std::uint32_t>(largest)));
  const std::size_t n_axes = std::min<std::size_t>(n_inputs, 64);
  // A position on the curve has 64 bits, so with many inputs only the highest bits of bins are
  // kept.
  const int kept = std::min({n_bits, 31, static_cast<int>(64 / n_axes)});  // bins are below 2^31
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(n_queries);
  std::vector<std::uint32_t> axes(n_axes);
  for (std::size_t q = 0; q < n_queries; ++q) {
    for (std::size_t i = 0; i < n_axes; ++i) {
      axes[i] = static_cast<std::uint32_t>(bins[q * n_inputs + i]) >> (n_bits - kept);
    }
    keys[q] = {detail::hilbert_index(axes, kept), given_order[q]};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> hilbert_order(n_queries);
  std::transform(keys.begin(), keys.end(), hilbert_order.begin(),
                 [](const auto& key) { return key.second; });
  return detail::walk_length(bins, n_inputs, hilbert_order, kCap) < given_length ? hilbert_order
                                                                                 : given_order;
}

}  // namespace sdnn::estimators
