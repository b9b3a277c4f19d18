/// The one kernel of the hidden pass: sums of byte columns, for each instruction set.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sdnn/core/aligned_buffer.hpp"
#include "sdnn/core/instruction_set.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif

namespace sdnn::approximators {

/// Hidden units whose weights lie side by side: one cache line of bytes per column.
inline constexpr std::size_t kBlockUnits = 64;

/// Columns whose sum fits into 16 bits: 256 * 127 < 2^15.
inline constexpr std::size_t kColumnsPerSum = 256;

/// sums[i] += sign * sum over `columns` of block[column * 64 + i], for i = 0..63.
///
/// `group` (1, 2 or 4) columns may be added in 8 bits: the caller knows that |weight| <= 127 / group
/// in this block. All sums are exact, so every implementation gives the same result.
using AddColumns = void (*)(const std::int8_t* block, std::span<const std::uint32_t> columns,
                            int group, int sign, std::int32_t* sums);

namespace internal {

/// How many columns ahead memory is asked for: about the latency of the last-level cache.
inline constexpr std::size_t kPrefetchAhead = 16;

using Bytes = std::array<std::int8_t, kBlockUnits>;

/// The sum of `Group` columns in 8 bits, by halves: loops of a shape that every compiler vectorizes.
/// Copied first, because bytes in memory may alias anything.
template <std::size_t Group>
Bytes group_sum_portable(const std::int8_t* block, const std::uint32_t* columns) noexcept {
  Bytes sum;
  if constexpr (Group == 1) {
    std::copy_n(block + std::size_t{columns[0]} * kBlockUnits, kBlockUnits, sum.begin());
  } else {
    const Bytes first = group_sum_portable<Group / 2>(block, columns);
    const Bytes second = group_sum_portable<Group / 2>(block, columns + Group / 2);
    for (std::size_t i = 0; i < kBlockUnits; ++i) {
      sum[i] = static_cast<std::int8_t>(first[i] + second[i]);
    }
  }
  return sum;
}

/// Adds columns in groups of `Group`, as many as there are; returns how many columns that were.
template <std::size_t Group>
std::size_t add_groups_portable(const std::int8_t* block, std::span<const std::uint32_t> columns,
                                std::array<std::int16_t, kBlockUnits>& wide) noexcept {
  std::size_t c = 0;
  for (; c + Group <= columns.size(); c += Group) {
    const Bytes sum = group_sum_portable<Group>(block, columns.data() + c);
    for (std::size_t i = 0; i < kBlockUnits; ++i) {
      wide[i] = static_cast<std::int16_t>(wide[i] + sum[i]);
    }
  }
  return c;
}

inline void add_columns_portable(const std::int8_t* block, std::span<const std::uint32_t> columns,
                                 int group, int sign, std::int32_t* sums) {
  while (!columns.empty()) {
    auto some = columns.first(std::min(kColumnsPerSum, columns.size()));
    columns = columns.subspan(some.size());
    std::array<std::int16_t, kBlockUnits> wide{};
    if (group == 4) some = some.subspan(add_groups_portable<4>(block, some, wide));
    if (group >= 2) some = some.subspan(add_groups_portable<2>(block, some, wide));
    add_groups_portable<1>(block, some, wide);
    for (std::size_t i = 0; i < kBlockUnits; ++i) sums[i] += sign * wide[i];
  }
}

#if SDNN_X86_KERNELS

// Both vector kernels take two groups of columns at a time: the columns of a group are added in 8
// bits, the bytes of the two groups are interleaved, and one multiply-add by ones widens and adds
// them pair by pair. Interleaving leaves the 16-bit sums in an order of their own, undone at the end.

[[gnu::target("avx2"), gnu::always_inline]] inline __m256i group_sum_avx2(const std::int8_t* block,
                                                                          const std::uint32_t* c,
                                                                          int group, int half) {
  const auto bytes = [block, c, half](int k) __attribute__((always_inline)) {
    return reinterpret_cast<const __m256i*>(block + std::size_t{c[k]} * kBlockUnits) + half;
  };
  __m256i sum = _mm256_load_si256(bytes(0));
  for (int k = 1; k < group; ++k) sum = _mm256_add_epi8(sum, _mm256_load_si256(bytes(k)));
  return sum;
}

template <int Group>
[[gnu::target("avx2")]] void add_groups_avx2(const std::int8_t* block,
                                             std::span<const std::uint32_t> columns, int sign,
                                             std::int32_t* sums) {
  const __m256i ones = _mm256_set1_epi8(1);
  const std::size_t n = columns.size();
  for (std::size_t begin = 0; begin < n; begin += kColumnsPerSum) {
    const std::size_t end = std::min(begin + kColumnsPerSum, n);
    __m256i wide[4] = {};  // units 0-7 and 16-23, 8-15 and 24-31, and the same of the second half
    const std::uint32_t* c = columns.data() + begin;
    std::size_t left = end - begin;
    for (; left >= 2 * Group; left -= 2 * Group, c += 2 * Group) {
      if (left >= 2 * Group + kPrefetchAhead) {
        for (std::size_t k = kPrefetchAhead; k < kPrefetchAhead + 2 * Group; ++k) {
          _mm_prefetch(reinterpret_cast<const char*>(block + std::size_t{c[k]} * kBlockUnits),
                       _MM_HINT_T0);
        }
      }
      for (int half = 0; half < 2; ++half) {
        const __m256i first = group_sum_avx2(block, c, Group, half);
        const __m256i second = group_sum_avx2(block, c + Group, Group, half);
        wide[2 * half] = _mm256_add_epi16(
            wide[2 * half], _mm256_maddubs_epi16(ones, _mm256_unpacklo_epi8(first, second)));
        wide[2 * half + 1] = _mm256_add_epi16(
            wide[2 * half + 1], _mm256_maddubs_epi16(ones, _mm256_unpackhi_epi8(first, second)));
      }
    }
    for (; left > 0; --left, ++c) {
      for (int half = 0; half < 2; ++half) {
        const __m256i one = group_sum_avx2(block, c, 1, half);
        const __m256i none = _mm256_setzero_si256();
        wide[2 * half] = _mm256_add_epi16(
            wide[2 * half], _mm256_maddubs_epi16(ones, _mm256_unpacklo_epi8(one, none)));
        wide[2 * half + 1] = _mm256_add_epi16(
            wide[2 * half + 1], _mm256_maddubs_epi16(ones, _mm256_unpackhi_epi8(one, none)));
      }
    }
    for (int quarter = 0; quarter < 8; ++quarter) {  // eight units each, in unit order
      const int half = quarter / 4;
      const __m256i sixteen = wide[2 * half + quarter % 2];
      const __m128i eight = quarter % 4 < 2 ? _mm256_castsi256_si128(sixteen)
                                            : _mm256_extracti128_si256(sixteen, 1);
      auto* const at = reinterpret_cast<__m256i*>(sums + 8 * quarter);
      const __m256i before = _mm256_loadu_si256(at);
      const __m256i change = _mm256_cvtepi16_epi32(eight);
      _mm256_storeu_si256(at, sign > 0 ? _mm256_add_epi32(before, change)
                                       : _mm256_sub_epi32(before, change));
    }
  }
}

inline void add_columns_avx2(const std::int8_t* block, std::span<const std::uint32_t> columns,
                             int group, int sign, std::int32_t* sums) {
  switch (group) {
    case 4: return add_groups_avx2<4>(block, columns, sign, sums);
    case 2: return add_groups_avx2<2>(block, columns, sign, sums);
    default: return add_groups_avx2<1>(block, columns, sign, sums);
  }
}

// GCC 12 reports the undefined lanes inside its own AVX-512 intrinsics as uninitialized.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif

[[gnu::target("avx512f,avx512bw"), gnu::always_inline]] inline __m512i group_sum_avx512(
    const std::int8_t* block, const std::uint32_t* c, int group) {
  const auto bytes = [block, c](int k) __attribute__((always_inline)) {
    return block + std::size_t{c[k]} * kBlockUnits;
  };
  __m512i sum = _mm512_load_si512(bytes(0));
  for (int k = 1; k < group; ++k) sum = _mm512_add_epi8(sum, _mm512_load_si512(bytes(k)));
  return sum;
}

template <int Group>
[[gnu::target("avx512f,avx512bw")]] void add_groups_avx512(const std::int8_t* block,
                                                           std::span<const std::uint32_t> columns,
                                                           int sign, std::int32_t* sums) {
  const __m512i ones = _mm512_set1_epi8(1);
  const std::size_t n = columns.size();
  for (std::size_t begin = 0; begin < n; begin += kColumnsPerSum) {
    const std::size_t end = std::min(begin + kColumnsPerSum, n);
    __m512i low = _mm512_setzero_si512();  // of each 16 units the first eight
    __m512i high = low;                    // and the last eight
    const std::uint32_t* c = columns.data() + begin;
    std::size_t left = end - begin;
    for (; left >= 2 * Group; left -= 2 * Group, c += 2 * Group) {
      if (left >= 2 * Group + kPrefetchAhead) {
        for (std::size_t k = kPrefetchAhead; k < kPrefetchAhead + 2 * Group; ++k) {
          _mm_prefetch(reinterpret_cast<const char*>(block + std::size_t{c[k]} * kBlockUnits),
                       _MM_HINT_T0);
        }
      }
      const __m512i first = group_sum_avx512(block, c, Group);
      const __m512i second = group_sum_avx512(block, c + Group, Group);
      low = _mm512_add_epi16(low,
                             _mm512_maddubs_epi16(ones, _mm512_unpacklo_epi8(first, second)));
      high = _mm512_add_epi16(high,
                              _mm512_maddubs_epi16(ones, _mm512_unpackhi_epi8(first, second)));
    }
    for (; left > 0; --left, ++c) {
      const __m512i one = group_sum_avx512(block, c, 1);
      const __m512i none = _mm512_setzero_si512();
      low = _mm512_add_epi16(low, _mm512_maddubs_epi16(ones, _mm512_unpacklo_epi8(one, none)));
      high = _mm512_add_epi16(high, _mm512_maddubs_epi16(ones, _mm512_unpackhi_epi8(one, none)));
    }
    alignas(core::kCacheLine) std::array<std::int16_t, 32> lows;
    alignas(core::kCacheLine) std::array<std::int16_t, 32> highs;
    _mm512_store_si512(lows.data(), low);
    _mm512_store_si512(highs.data(), high);
    for (std::size_t i = 0; i < 32; ++i) {
      const std::size_t unit = i / 8 * 16 + i % 8;
      sums[unit] += sign * lows[i];
      sums[unit + 8] += sign * highs[i];
    }
  }
}

inline void add_columns_avx512(const std::int8_t* block, std::span<const std::uint32_t> columns,
                               int group, int sign, std::int32_t* sums) {
  switch (group) {
    case 4: return add_groups_avx512<4>(block, columns, sign, sums);
    case 2: return add_groups_avx512<2>(block, columns, sign, sums);
    default: return add_groups_avx512<1>(block, columns, sign, sums);
  }
}

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

#endif  // SDNN_X86_KERNELS

}  // namespace internal

/// The kernel of the instruction set in use.
inline AddColumns add_columns_kernel() {
#if SDNN_X86_KERNELS
  switch (core::instruction_set()) {
    case core::InstructionSet::avx512: return internal::add_columns_avx512;
    case core::InstructionSet::avx2: return internal::add_columns_avx2;
    default: break;
  }
#endif
  return internal::add_columns_portable;
}

}  // namespace sdnn::approximators
