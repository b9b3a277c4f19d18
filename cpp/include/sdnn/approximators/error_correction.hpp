/// The units that the paper's learning rule corrects.
#pragma once

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/instruction_set.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif

namespace sdnn::approximators {

namespace detail {

/// The constants of the distance of a unit with potential h from its threshold, the unsigned number
/// (h ^ flip) + offset, in a search for active (h > 0) or inactive units.
///
/// For active units flip is 0 and the distance is h - 1; for inactive units flip has all bits set,
/// and ~h + 1 = -h. A unit that is not searched for has a negative result, which as an unsigned
/// number is at least 2^31: it is never the nearest.
struct DistanceOf {
  explicit DistanceOf(bool active) noexcept : flip(active ? 0 : -1), offset(active ? -1 : 1) {}

  std::int32_t flip;
  std::int32_t offset;
};

/// Returns the first unit with the smallest distance below 2^31, or `size` if there is none. Units
/// that must not be selected have larger distances; see DistanceOf.
inline std::size_t nearest_unit_portable(const std::int32_t* potentials, std::size_t size,
                                         const DistanceOf& of) noexcept {
  std::uint32_t nearest = std::uint32_t{1} << 31;
  std::size_t unit = size;
  for (std::size_t k = 0; k < size; ++k) {
    const auto distance =
        static_cast<std::uint32_t>(potentials[k] ^ of.flip) + static_cast<std::uint32_t>(of.offset);
    if (distance < nearest) {
      nearest = distance;
      unit = k;
    }
  }
  return unit;
}

#if SDNN_X86_KERNELS

/// Implements nearest_unit eight units at a time: first the least distance, then the first unit
/// that has it. The last group is the last eight units, which may overlap the group before.
[[SDNN_TARGET_AVX2]] inline std::size_t nearest_unit_avx2(const std::int32_t* potentials,
                                                          std::size_t size,
                                                          const DistanceOf& of) noexcept {
  if (size < 8) return nearest_unit_portable(potentials, size, of);
  const __m256i flip = _mm256_set1_epi32(of.flip);
  const __m256i offset = _mm256_set1_epi32(of.offset);
  // The first unit of the group that begins at k, moved back if fewer than eight follow.
  const auto first_of = [size](std::size_t k) { return k + 8 <= size ? k : size - 8; };
  const auto distances = [&](std::size_t first) __attribute__((always_inline, target("avx2"))) {
    const auto* const at = reinterpret_cast<const __m256i*>(potentials + first);
    return _mm256_add_epi32(_mm256_xor_si256(_mm256_loadu_si256(at), flip), offset);
  };
  __m256i least = distances(0);
  for (std::size_t k = 8; k < size; k += 8) least = _mm256_min_epu32(least, distances(first_of(k)));
  // Each step compares a register with its rearranged self; then all eight lanes have the least.
  least = _mm256_min_epu32(least, _mm256_permute2x128_si256(least, least, 1));
  least = _mm256_min_epu32(least, _mm256_shuffle_epi32(least, 0b01001110));
  least = _mm256_min_epu32(least, _mm256_shuffle_epi32(least, 0b10110001));
  if (_mm256_cvtsi256_si32(least) < 0) return size;  // 2^31 or more
  for (std::size_t k = 0;; k += 8) {
    const __m256i is_least = _mm256_cmpeq_epi32(distances(first_of(k)), least);
    const auto mask = static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(is_least)));
    if (mask != 0) return first_of(k) + static_cast<std::size_t>(std::countr_zero(mask));
  }
}

[[SDNN_TARGET_AVX2]] inline std::size_t nearest_unit_avx512(const std::int32_t* potentials,
                                                            std::size_t size,
                                                            const DistanceOf& of) noexcept {
  return nearest_unit_avx2(potentials, size, of);
}

#endif  // SDNN_X86_KERNELS

}  // namespace detail

SDNN_KERNEL_NEON(std::size_t, nearest_unit,
                 (const std::int32_t* potentials, std::size_t size, const detail::DistanceOf& of),
                 (potentials, size, of))

/// Returns the first of the active (or inactive) units that are nearest to their threshold; `size`
/// if there are no such units.
SDNN_DISPATCH(std::size_t, nearest_unit,
              (const std::int32_t* potentials, std::size_t size, const detail::DistanceOf& of),
              (potentials, size, of))

/// Selects the units of a window whose correction moves the number of active ones by `deficit`.
///
/// The window is split in index order into |deficit| contiguous subsets, cut at floor(i * size /
/// |deficit|). Each subset gives the unit nearest to its threshold among the inactive ones (deficit
/// > 0: they should become active) or the active ones (deficit < 0), the lowest index first; a
/// subset without such a unit gives none. Nothing is selected when deficit is 0.
///
/// Source: Fig. 2, steps 1 and 2. Shapes: potentials (n',), of the window's units; `selected` is
/// overwritten with positions in the window. Requires |deficit| <= n' and |potential| < 2^31.
inline void select_units(std::span<const std::int32_t> potentials, int deficit,
                         std::vector<std::uint32_t>& selected) {
  selected.clear();
  const auto n_subsets = static_cast<std::size_t>(std::abs(deficit));
  assert(n_subsets <= potentials.size());
  const detail::DistanceOf of(deficit < 0);
  const auto begin_of = [&](std::uint64_t i) {  // with 64 bits, so that no product overflows
    return static_cast<std::size_t>(i * potentials.size() / n_subsets);
  };
  for (std::size_t i = 0; i < n_subsets; ++i) {
    const std::size_t begin = begin_of(i);
    const std::size_t end = begin_of(i + 1);
    const std::size_t unit = begin + nearest_unit(potentials.data() + begin, end - begin, of);
    if (unit != end) selected.push_back(static_cast<std::uint32_t>(unit));
  }
}

}  // namespace sdnn::approximators
