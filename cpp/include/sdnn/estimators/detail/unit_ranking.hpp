/// Counts of firing units, and the units nearest to their threshold.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::estimators {

namespace detail {

SDNN_WIDE_VECTORS_BEGIN

/// The body of the kernel count_firing (see below), compiled for each instruction set.
SDNN_INLINE std::int32_t count_firing_body(const std::int32_t* potentials,
                                           std::size_t size) noexcept {
  std::int32_t count = 0;
  for (std::size_t i = 0; i < size; ++i) count += potentials[i] > 0 ? 1 : 0;
  return count;
}

/// The body of the kernel rank_units (see below), compiled for each instruction set.
SDNN_INLINE std::int32_t rank_units_body(const std::int32_t* potentials, std::size_t size,
                                         bool firing, int n_bits, std::int32_t limit,
                                         std::int32_t* keys) noexcept {
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  std::int32_t least = kNone;
  std::size_t i = 0;
#if SDNN_LANES
  using Vector = core::IntegerRegister<std::int32_t>::Vector;
  constexpr std::size_t kSize = core::IntegerRegister<std::int32_t>::kSize;
  const Vector none = Vector{} + kNone;
  const Vector limits = Vector{} + limit;
  // With all ones, ^ flip inverts a mask, and (p ^ flip) - flip negates p; with zeros they do
  // nothing.
  const Vector flip = Vector{} - (firing ? 0 : 1);
  Vector lowest = none;
  Vector index{};
  for (std::size_t k = 0; k < kSize; ++k) index[k] = static_cast<std::int32_t>(k);
  for (; i + kSize <= size; i += kSize) {
    Vector p;
    std::memcpy(&p, potentials + i, sizeof p);
    const Vector selected = (Vector)(p > 0) ^ flip;
    Vector distance = (p ^ flip) - flip;
    const Vector near = (Vector)(distance < limits);
    distance = (distance & near) | (limits & ~near);
    const Vector key = (((distance << n_bits) | index) & selected) | (none & ~selected);
    std::memcpy(keys + i, &key, sizeof key);
    const Vector lower = (Vector)(key < lowest);
    lowest = (key & lower) | (lowest & ~lower);
    index += static_cast<std::int32_t>(kSize);
  }
  for (std::size_t k = 0; k < kSize; ++k) least = lowest[k] < least ? lowest[k] : least;
#endif
  for (; i < size; ++i) {
    const std::int32_t distance = std::min(firing ? potentials[i] : -potentials[i], limit);
    keys[i] =
        (potentials[i] > 0) == firing ? distance << n_bits | static_cast<std::int32_t>(i) : kNone;
    least = keys[i] < least ? keys[i] : least;
  }
  return least;
}

/// The body of the kernel least_above (see below), compiled for each instruction set.
SDNN_INLINE std::int32_t least_above_body(const std::int32_t* values, std::size_t size,
                                          std::int32_t floor) noexcept {
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  std::int32_t least = kNone;
  std::size_t i = 0;
#if SDNN_LANES
  using Vector = core::IntegerRegister<std::int32_t>::Vector;
  constexpr std::size_t kSize = core::IntegerRegister<std::int32_t>::kSize;
  const Vector floors = Vector{} + floor;
  Vector lowest = Vector{} + kNone;
  for (; i + kSize <= size; i += kSize) {
    Vector v;
    std::memcpy(&v, values + i, sizeof v);
    const Vector lower = (Vector)(v < lowest) & (Vector)(v > floors);
    lowest = (v & lower) | (lowest & ~lower);
  }
  for (std::size_t k = 0; k < kSize; ++k) least = lowest[k] < least ? lowest[k] : least;
#endif
  for (; i < size; ++i) least = values[i] > floor && values[i] < least ? values[i] : least;
  return least;
}

SDNN_WIDE_VECTORS_END

}  // namespace detail

/// Counts the potentials above 0.
SDNN_KERNEL(std::int32_t, count_firing, (const std::int32_t* potentials, std::size_t size),
            (potentials, size))

/// Sets keys that order units by their distance from the threshold and then by index: keys[i] =
/// distance << n_bits | i for the units that fire (`firing`) or else for those that do not, and
/// INT32_MAX for the others. Distances above `limit` count as `limit`. Returns the smallest key.
SDNN_KERNEL(std::int32_t, rank_units,
            (const std::int32_t* potentials, std::size_t size, bool firing, int n_bits,
             std::int32_t limit, std::int32_t* keys),
            (potentials, size, firing, n_bits, limit, keys))

/// Returns the smallest value above `floor`, or INT32_MAX if there is none.
SDNN_KERNEL(std::int32_t, least_above,
            (const std::int32_t* values, std::size_t size, std::int32_t floor),
            (values, size, floor))

}  // namespace sdnn::estimators
