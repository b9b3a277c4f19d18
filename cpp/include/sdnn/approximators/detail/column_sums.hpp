/// Kernels on the weights of a block of units, for each instruction set. They add columns of
/// weights to potentials, change columns of weights, and find the largest weight of each unit.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif
#if SDNN_NEON_KERNELS
#include <arm_neon.h>
#endif

namespace sdnn::approximators {

/// The number of hidden units whose weights are adjacent: a cache line of bytes for each column.
inline constexpr std::size_t kBlockUnits = 64;

/// A list of columns for the kernels, as *places*: a place is the byte offset of a column in its
/// block divided by kPlaceBytes, because a load instruction can multiply an index by 8. The list is
/// padded with the place of a column of zeros to a multiple of kAtOnce. The places of the first
/// columns in the next block follow, for prefetching.
class ColumnPlaces {
 public:
  static constexpr std::size_t kMost = 1024;
  static constexpr std::size_t kAtOnce = 8;
  /// How many columns ahead the kernels prefetch; chosen for the latency of a shared last-level
  /// cache.
  static constexpr std::size_t kPrefetchAhead = 64;
  static constexpr std::size_t kPlaceBytes = 8;

  /// Takes up to kMost columns of a block whose column `zeros` has only zeros.
  ColumnPlaces(std::span<const std::uint32_t> columns, std::size_t zeros) noexcept
      : size_(core::round_up(columns.size(), kAtOnce)) {
    assert(columns.size() <= kMost);
    static constexpr auto kFactor = static_cast<std::uint32_t>(kBlockUnits / kPlaceBytes);
    const auto end = std::ranges::transform(columns, places_.begin(), [](std::uint32_t column) {
                       return column * kFactor;
                     }).out;
    std::uint32_t* const padded_end = places_.data() + size_;
    std::fill(std::to_address(end), padded_end, static_cast<std::uint32_t>(zeros) * kFactor);
    // The column of zeros is the last of its block, so the next block begins behind it.
    const std::uint32_t next_block = (static_cast<std::uint32_t>(zeros) + 1) * kFactor;
    for (std::size_t k = 0; k < kPrefetchAhead; ++k) {
      padded_end[k] = next_block + (k < size_ ? places_[k] : 0);
    }
  }

  /// The number of places, a multiple of kAtOnce.
  std::size_t size() const noexcept { return size_; }
  /// The size() places, and behind them kPrefetchAhead places of the next block, which kernels may
  /// only prefetch.
  const std::uint32_t* data() const noexcept { return places_.data(); }

 private:
  std::size_t size_;
  std::array<std::uint32_t, kMost + kPrefetchAhead> places_;
};

namespace detail {

/// The number of groups whose sum fits into 16 bits, as the columns of a group have a sum of at
/// most 127: 256 * 127 < 2^15.
inline constexpr std::size_t kGroupsPerSum = 256;

/// Returns the end of the places from `begin` on whose columns may be added in 16 bits, in groups
/// of `Group` columns.
template <std::size_t Group>
const std::uint32_t* end_of_part(const std::uint32_t* begin, const std::uint32_t* end) noexcept {
  return begin + std::min(Group * kGroupsPerSum, static_cast<std::size_t>(end - begin));
}

[[gnu::always_inline]] inline const std::int8_t* column_at(const std::int8_t* block,
                                                           std::uint32_t place) noexcept {
  return block + std::size_t{place} * ColumnPlaces::kPlaceBytes;
}

using Bytes = std::array<std::int8_t, kBlockUnits>;

/// Adds `Group` columns in 8 bits, by halves, in loops that every compiler vectorizes. The columns
/// are copied first: a compiler must assume that writes through pointers to bytes change any
/// memory.
template <std::size_t Group>
Bytes group_sum_portable(const std::int8_t* block, const std::uint32_t* places) noexcept {
  Bytes sum;
  if constexpr (Group == 1) {
    std::copy_n(column_at(block, places[0]), kBlockUnits, sum.begin());
  } else {
    const Bytes first = group_sum_portable<Group / 2>(block, places);
    const Bytes second = group_sum_portable<Group / 2>(block, places + Group / 2);
    for (std::size_t i = 0; i < kBlockUnits; ++i) {
      sum[i] = static_cast<std::int8_t>(first[i] + second[i]);
    }
  }
  return sum;
}

/// Adds `factor` times the sum of the columns to `sums`: columns of a group are added in 8 bits,
/// the groups of a part (see end_of_part) in 16 bits, and the parts in 32 bits.
template <std::size_t Group>
void add_groups_portable(const std::int8_t* block, const ColumnPlaces& places, int factor,
                         std::int32_t* sums) {
  const std::uint32_t* const end = places.data() + places.size();
  for (const std::uint32_t* begin = places.data(); begin != end;) {
    const std::uint32_t* const part_end = end_of_part<Group>(begin, end);
    std::array<std::int16_t, kBlockUnits> wide{};
    for (; begin != part_end; begin += Group) {
      const Bytes sum = group_sum_portable<Group>(block, begin);
      for (std::size_t i = 0; i < kBlockUnits; ++i) {
        wide[i] = static_cast<std::int16_t>(wide[i] + sum[i]);
      }
    }
    for (std::size_t i = 0; i < kBlockUnits; ++i) sums[i] += factor * wide[i];
  }
}

/// Implements add_columns, below, without vector instructions.
inline void add_columns_portable(const std::int8_t* block, const ColumnPlaces& places, int group,
                                 int factor, std::int32_t* sums) {
  switch (group) {
    case 4:
      return add_groups_portable<4>(block, places, factor, sums);
    case 2:
      return add_groups_portable<2>(block, places, factor, sums);
    default:
      return add_groups_portable<1>(block, places, factor, sums);
  }
}

#if SDNN_X86_KERNELS || SDNN_NEON_KERNELS

/// Prefetches the columns that will be added kPrefetchAhead places later. After the last block it
/// prefetches addresses without data, which is allowed.
[[gnu::always_inline]] inline void prefetch_ahead(const std::int8_t* block,
                                                  const std::uint32_t* places) noexcept {
  for (std::size_t k = 0; k < ColumnPlaces::kAtOnce; ++k) {
    __builtin_prefetch(column_at(block, places[ColumnPlaces::kPrefetchAhead + k]));
  }
}

#endif

#if SDNN_NEON_KERNELS

/// Works like add_groups_portable; an instruction of NEON widens a group's sums and adds them to
/// those of 16 bits.
template <std::size_t Group>
void add_groups_neon(const std::int8_t* block, const ColumnPlaces& places, int factor,
                     std::int32_t* sums) {
  const std::uint32_t* const end = places.data() + places.size();
  for (const std::uint32_t* begin = places.data(); begin != end;) {
    const std::uint32_t* const part_end = end_of_part<Group>(begin, end);
    int16x8_t wide[kBlockUnits / 8] = {};
    for (; begin != part_end; begin += ColumnPlaces::kAtOnce) {
      prefetch_ahead(block, begin);
      for (std::size_t k = 0; k < ColumnPlaces::kAtOnce; k += Group) {
        for (std::size_t quarter = 0; quarter < kBlockUnits / 16; ++quarter) {
          const auto bytes = [&](std::size_t column) __attribute__((always_inline)) {
            return vld1q_s8(column_at(block, begin[k + column]) + 16 * quarter);
          };
          int8x16_t sum = bytes(0);
          for (std::size_t column = 1; column < Group; ++column) sum = vaddq_s8(sum, bytes(column));
          wide[2 * quarter] = vaddw_s8(wide[2 * quarter], vget_low_s8(sum));
          wide[2 * quarter + 1] = vaddw_s8(wide[2 * quarter + 1], vget_high_s8(sum));
        }
      }
    }
    for (std::size_t eighth = 0; eighth < kBlockUnits / 8; ++eighth) {
      std::int32_t* const at = sums + 8 * eighth;
      const int32x4_t low = vmovl_s16(vget_low_s16(wide[eighth]));
      const int32x4_t high = vmovl_s16(vget_high_s16(wide[eighth]));
      vst1q_s32(at, vmlaq_n_s32(vld1q_s32(at), low, factor));
      vst1q_s32(at + 4, vmlaq_n_s32(vld1q_s32(at + 4), high, factor));
    }
  }
}

/// Implements add_columns, below, for NEON.
inline void add_columns_neon(const std::int8_t* block, const ColumnPlaces& places, int group,
                             int factor, std::int32_t* sums) {
  switch (group) {
    case 4:
      return add_groups_neon<4>(block, places, factor, sums);
    case 2:
      return add_groups_neon<2>(block, places, factor, sums);
    default:
      return add_groups_neon<1>(block, places, factor, sums);
  }
}

#endif  // SDNN_NEON_KERNELS

#if SDNN_X86_KERNELS

// The kernels for AVX2 and AVX-512 take two groups of columns at a time. The columns of each group
// are added in 8 bits. The bytes of the two sums are interleaved, and an instruction that
// multiplies neighbouring bytes by ones and adds the products makes a 16-bit sum of both groups for
// each unit. Interleaving works within 16 bytes, so the 16-bit sums are in another order than the
// units; it is restored when they are added to the result.

/// Adds the columns of a group in 8 bits, for the first (0) or second (1) half of the block's
/// units.
[[SDNN_TARGET_AVX2, gnu::always_inline]] inline __m256i group_sum_avx2(const std::int8_t* block,
                                                                       const std::uint32_t* places,
                                                                       std::size_t group,
                                                                       std::size_t half) {
  const auto bytes = [block, places, half](std::size_t k) __attribute__((always_inline)) {
    return reinterpret_cast<const __m256i*>(column_at(block, places[k])) + half;
  };
  __m256i sum = _mm256_load_si256(bytes(0));
  for (std::size_t k = 1; k < group; ++k) sum = _mm256_add_epi8(sum, _mm256_load_si256(bytes(k)));
  return sum;
}

/// Works like add_groups_portable, with two groups at a time as described above.
template <std::size_t Group>
[[SDNN_TARGET_AVX2]] void add_groups_avx2(const std::int8_t* block, const ColumnPlaces& places,
                                          int factor, std::int32_t* sums) {
  const __m256i ones = _mm256_set1_epi8(1);
  const __m256i factors = _mm256_set1_epi32(factor);
  const std::uint32_t* const end = places.data() + places.size();
  for (const std::uint32_t* begin = places.data(); begin != end;) {
    const std::uint32_t* const part_end = end_of_part<Group>(begin, end);
    __m256i wide[4] = {};  // units 0-7 and 16-23, 8-15 and 24-31, and the same of the second half
    for (; begin != part_end; begin += ColumnPlaces::kAtOnce) {
      prefetch_ahead(block, begin);
      for (std::size_t k = 0; k < ColumnPlaces::kAtOnce; k += 2 * Group) {
        for (std::size_t half = 0; half < 2; ++half) {
          __m256i first = group_sum_avx2(block, begin + k, Group, half);
          __m256i second = group_sum_avx2(block, begin + k + Group, Group, half);
          // An empty statement that claims to change the sums keeps GCC from loading columns twice.
          asm("" : "+x"(first), "+x"(second));
          wide[2 * half] = _mm256_add_epi16(
              wide[2 * half], _mm256_maddubs_epi16(ones, _mm256_unpacklo_epi8(first, second)));
          wide[2 * half + 1] = _mm256_add_epi16(
              wide[2 * half + 1], _mm256_maddubs_epi16(ones, _mm256_unpackhi_epi8(first, second)));
        }
        // An empty statement that claims to change the sums makes GCC keep them in registers.
        asm("" : "+x"(wide[0]), "+x"(wide[1]), "+x"(wide[2]), "+x"(wide[3]));
      }
    }
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {  // eight units each, in unit order
      const std::size_t half = eighth / 4;
      const __m256i sixteen = wide[2 * half + eighth % 2];
      const __m128i eight =
          eighth % 4 < 2 ? _mm256_castsi256_si128(sixteen) : _mm256_extracti128_si256(sixteen, 1);
      auto* const at = reinterpret_cast<__m256i*>(sums + 8 * eighth);
      const __m256i change = _mm256_mullo_epi32(_mm256_cvtepi16_epi32(eight), factors);
      _mm256_storeu_si256(at, _mm256_add_epi32(_mm256_loadu_si256(at), change));
    }
  }
}

/// Implements add_columns, below, for AVX2.
[[SDNN_TARGET_AVX2]] inline void add_columns_avx2(const std::int8_t* block,
                                                  const ColumnPlaces& places, int group, int factor,
                                                  std::int32_t* sums) {
  switch (group) {
    case 4:
      return add_groups_avx2<4>(block, places, factor, sums);
    case 2:
      return add_groups_avx2<2>(block, places, factor, sums);
    default:
      return add_groups_avx2<1>(block, places, factor, sums);
  }
}

// GCC 12 reports the undefined lanes inside its own AVX-512 intrinsics as uninitialized.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif

/// Adds the columns of a group in 8 bits, for all units of the block.
[[SDNN_TARGET_AVX512, gnu::always_inline]] inline __m512i group_sum_avx512(
    const std::int8_t* block, const std::uint32_t* places, std::size_t group) {
  __m512i sum = _mm512_load_si512(column_at(block, places[0]));
  for (std::size_t k = 1; k < group; ++k) {
    sum = _mm512_add_epi8(sum, _mm512_load_si512(column_at(block, places[k])));
  }
  return sum;
}

/// Works like add_groups_portable, with two groups at a time as described above.
template <std::size_t Group>
[[SDNN_TARGET_AVX512]] void add_groups_avx512(const std::int8_t* block, const ColumnPlaces& places,
                                              int factor, std::int32_t* sums) {
  const __m512i ones = _mm512_set1_epi8(1);
  const __m512i factors = _mm512_set1_epi32(factor);
  const std::uint32_t* const end = places.data() + places.size();
  for (const std::uint32_t* begin = places.data(); begin != end;) {
    const std::uint32_t* const part_end = end_of_part<Group>(begin, end);
    __m512i low = _mm512_setzero_si512();  // the first eight of each 16 units
    __m512i high = low;                    // the last eight
    for (; begin != part_end; begin += ColumnPlaces::kAtOnce) {
      prefetch_ahead(block, begin);
      for (std::size_t k = 0; k < ColumnPlaces::kAtOnce; k += 2 * Group) {
        const __m512i first = group_sum_avx512(block, begin + k, Group);
        const __m512i second = group_sum_avx512(block, begin + k + Group, Group);
        low =
            _mm512_add_epi16(low, _mm512_maddubs_epi16(ones, _mm512_unpacklo_epi8(first, second)));
        high =
            _mm512_add_epi16(high, _mm512_maddubs_epi16(ones, _mm512_unpackhi_epi8(first, second)));
      }
    }
    const auto add = [&](std::int32_t* at, __m128i first,
                         __m128i last) __attribute__((always_inline, target("avx512f,avx2"))) {
      const __m512i sixteen = _mm512_cvtepi16_epi32(_mm256_set_m128i(last, first));
      _mm512_storeu_si512(
          at, _mm512_add_epi32(_mm512_loadu_si512(at), _mm512_mullo_epi32(sixteen, factors)));
    };
    add(sums, _mm512_extracti32x4_epi32(low, 0), _mm512_extracti32x4_epi32(high, 0));
    add(sums + 16, _mm512_extracti32x4_epi32(low, 1), _mm512_extracti32x4_epi32(high, 1));
    add(sums + 32, _mm512_extracti32x4_epi32(low, 2), _mm512_extracti32x4_epi32(high, 2));
    add(sums + 48, _mm512_extracti32x4_epi32(low, 3), _mm512_extracti32x4_epi32(high, 3));
  }
}

/// Implements add_columns, below, for AVX-512.
[[SDNN_TARGET_AVX512]] inline void add_columns_avx512(const std::int8_t* block,
                                                      const ColumnPlaces& places, int group,
                                                      int factor, std::int32_t* sums) {
  switch (group) {
    case 4:
      return add_groups_avx512<4>(block, places, factor, sums);
    case 2:
      return add_groups_avx512<2>(block, places, factor, sums);
    default:
      return add_groups_avx512<1>(block, places, factor, sums);
  }
}

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

#endif  // SDNN_X86_KERNELS

}  // namespace detail

/// Adds to sums[i], for each of the 64 units i of a block, `factor` times the sum of the unit's
/// weights in the columns at `places`.
///
/// `group` (1, 2 or 4) columns at a time are added in 8 bits, which requires |weight| <= 127 /
/// group in this block. All sums are exact, so every version gives the same result.
SDNN_DISPATCH(void, add_columns,
              (const std::int8_t* block, const ColumnPlaces& places, int group, int factor,
               std::int32_t* sums),
              (block, places, group, factor, sums))

namespace detail {

using ByteRegister = core::IntegerRegister<std::int8_t>;
inline constexpr std::size_t kRegistersOfColumn = kBlockUnits / ByteRegister::kSize;

/// The body of the kernel add_to_columns (see below), compiled for each instruction set.
SDNN_INLINE void add_to_columns_body(std::int8_t* block, const std::uint32_t* columns,
                                     std::size_t n_columns, const Bytes& change) noexcept {
  for (std::size_t k = 0; k < n_columns; ++k) {
    std::int8_t* const column = block + columns[k] * kBlockUnits;
    core::unrolled<kRegistersOfColumn>([&](auto r) SDNN_INLINE_LAMBDA {
      ByteRegister sum;
      sum.load(column + r() * ByteRegister::kSize);
      sum.add(change.data() + r() * ByteRegister::kSize);
      sum.store(column + r() * ByteRegister::kSize);
    });
  }
}

/// The body of the kernel find_largest_bytes (see below), compiled for each instruction set.
SDNN_INLINE void find_largest_bytes_body(const std::int8_t* block, std::size_t n_columns,
                                         Bytes& largest) noexcept {
  ByteRegister sizes[kRegistersOfColumn];
  core::unrolled<kRegistersOfColumn>([&](auto r) SDNN_INLINE_LAMBDA { sizes[r()].clear(); });
  for (std::size_t j = 0; j < n_columns; ++j, block += kBlockUnits) {
    core::unrolled<kRegistersOfColumn>([&](auto r) SDNN_INLINE_LAMBDA {
      sizes[r()].rise_to_size(block + r() * ByteRegister::kSize);
    });
  }
  core::unrolled<kRegistersOfColumn>([&](auto r) SDNN_INLINE_LAMBDA {
    sizes[r()].store(largest.data() + r() * ByteRegister::kSize);
  });
}

}  // namespace detail

/// Adds change[i] to the byte of each unit i in the listed columns of a block, modulo 256.
SDNN_KERNEL(void, add_to_columns,
            (std::int8_t* block, const std::uint32_t* columns, std::size_t n_columns,
             const detail::Bytes& change),
            (block, columns, n_columns, change))

/// Writes to largest[i] the largest |byte| of unit i in the first n_columns columns of a block. No
/// byte may be -128.
SDNN_KERNEL(void, find_largest_bytes,
            (const std::int8_t* block, std::size_t n_columns, detail::Bytes& largest),
            (block, n_columns, largest))

}  // namespace sdnn::approximators
