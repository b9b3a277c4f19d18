/// The one kernel of the hidden pass: sums of byte columns, for each instruction set.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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

inline void add_columns_portable(const std::int8_t* block, std::span<const std::uint32_t> columns,
                                 int group, int sign, std::int32_t* sums) {
  const auto column = [block, columns](std::size_t c) {
    return block + std::size_t{columns[c]} * kBlockUnits;
  };
  for (std::size_t begin = 0; begin < columns.size(); begin += kColumnsPerSum) {
    const std::size_t end = std::min(begin + kColumnsPerSum, columns.size());
    std::array<std::int16_t, kBlockUnits> wide{};
    std::size_t c = begin;
    if (group == 4) {
      for (; c + 4 <= end; c += 4) {
        const std::int8_t* const w0 = column(c);
        const std::int8_t* const w1 = column(c + 1);
        const std::int8_t* const w2 = column(c + 2);
        const std::int8_t* const w3 = column(c + 3);
        std::array<std::int8_t, kBlockUnits> narrow;
        for (std::size_t i = 0; i < kBlockUnits; ++i) {
          narrow[i] = static_cast<std::int8_t>(w0[i] + w1[i] + w2[i] + w3[i]);
        }
        for (std::size_t i = 0; i < kBlockUnits; ++i) {
          wide[i] = static_cast<std::int16_t>(wide[i] + narrow[i]);
        }
      }
    } else if (group == 2) {
      for (; c + 2 <= end; c += 2) {
        const std::int8_t* const w0 = column(c);
        const std::int8_t* const w1 = column(c + 1);
        std::array<std::int8_t, kBlockUnits> narrow;
        for (std::size_t i = 0; i < kBlockUnits; ++i) {
          narrow[i] = static_cast<std::int8_t>(w0[i] + w1[i]);
        }
        for (std::size_t i = 0; i < kBlockUnits; ++i) {
          wide[i] = static_cast<std::int16_t>(wide[i] + narrow[i]);
        }
      }
    }
    for (; c < end; ++c) {
      const std::int8_t* const w = column(c);
      for (std::size_t i = 0; i < kBlockUnits; ++i) {
        wide[i] = static_cast<std::int16_t>(wide[i] + w[i]);
      }
    }
    for (std::size_t i = 0; i < kBlockUnits; ++i) sums[i] += sign * wide[i];
  }
}

#if SDNN_X86_KERNELS

/// Sixteen 16-bit sums, added to or subtracted from sixteen 32-bit ones.
[[gnu::target("avx2")]] inline void flush_avx2(__m256i wide, int sign, std::int32_t* sums) {
  const __m256i halves[2] = {_mm256_cvtepi16_epi32(_mm256_castsi256_si128(wide)),
                             _mm256_cvtepi16_epi32(_mm256_extracti128_si256(wide, 1))};
  for (int h = 0; h < 2; ++h) {
    auto* const at = reinterpret_cast<__m256i*>(sums + 8 * h);
    const __m256i before = _mm256_loadu_si256(at);
    _mm256_storeu_si256(at, sign > 0 ? _mm256_add_epi32(before, halves[h])
                                     : _mm256_sub_epi32(before, halves[h]));
  }
}

[[gnu::target("avx2")]] inline void add_columns_avx2(const std::int8_t* block,
                                                     std::span<const std::uint32_t> columns,
                                                     int group, int sign, std::int32_t* sums) {
  const auto bytes = [block, columns](std::size_t c) {
    return reinterpret_cast<const __m256i*>(block + std::size_t{columns[c]} * kBlockUnits);
  };
  const std::size_t n = columns.size();
  for (std::size_t begin = 0; begin < n; begin += kColumnsPerSum) {
    const std::size_t end = std::min(begin + kColumnsPerSum, n);
    __m256i s0 = _mm256_setzero_si256();
    __m256i s1 = s0;
    __m256i s2 = s0;
    __m256i s3 = s0;
    std::size_t c = begin;
    const auto prefetch = [&](std::size_t ahead) __attribute__((always_inline)) {
      if (ahead < n) _mm_prefetch(reinterpret_cast<const char*>(bytes(ahead)), _MM_HINT_T0);
    };
#define SDNN_WIDEN(low, high)                                                          \
  s0 = _mm256_add_epi16(s0, _mm256_cvtepi8_epi16(_mm256_castsi256_si128(low)));        \
  s1 = _mm256_add_epi16(s1, _mm256_cvtepi8_epi16(_mm256_extracti128_si256(low, 1)));   \
  s2 = _mm256_add_epi16(s2, _mm256_cvtepi8_epi16(_mm256_castsi256_si128(high)));       \
  s3 = _mm256_add_epi16(s3, _mm256_cvtepi8_epi16(_mm256_extracti128_si256(high, 1)))
    if (group == 4) {
      for (; c + 4 <= end; c += 4) {
        for (std::size_t k = 0; k < 4; ++k) prefetch(c + kPrefetchAhead + k);
        const __m256i* const w0 = bytes(c);
        const __m256i* const w1 = bytes(c + 1);
        const __m256i* const w2 = bytes(c + 2);
        const __m256i* const w3 = bytes(c + 3);
        const __m256i low = _mm256_add_epi8(
            _mm256_add_epi8(_mm256_load_si256(w0), _mm256_load_si256(w1)),
            _mm256_add_epi8(_mm256_load_si256(w2), _mm256_load_si256(w3)));
        const __m256i high = _mm256_add_epi8(
            _mm256_add_epi8(_mm256_load_si256(w0 + 1), _mm256_load_si256(w1 + 1)),
            _mm256_add_epi8(_mm256_load_si256(w2 + 1), _mm256_load_si256(w3 + 1)));
        SDNN_WIDEN(low, high);
      }
    } else if (group == 2) {
      for (; c + 2 <= end; c += 2) {
        for (std::size_t k = 0; k < 2; ++k) prefetch(c + kPrefetchAhead + k);
        const __m256i* const w0 = bytes(c);
        const __m256i* const w1 = bytes(c + 1);
        const __m256i low = _mm256_add_epi8(_mm256_load_si256(w0), _mm256_load_si256(w1));
        const __m256i high = _mm256_add_epi8(_mm256_load_si256(w0 + 1), _mm256_load_si256(w1 + 1));
        SDNN_WIDEN(low, high);
      }
    }
    for (; c < end; ++c) {
      prefetch(c + kPrefetchAhead);
      const __m256i low = _mm256_load_si256(bytes(c));
      const __m256i high = _mm256_load_si256(bytes(c) + 1);
      SDNN_WIDEN(low, high);
    }
#undef SDNN_WIDEN
    flush_avx2(s0, sign, sums);
    flush_avx2(s1, sign, sums + 16);
    flush_avx2(s2, sign, sums + 32);
    flush_avx2(s3, sign, sums + 48);
  }
}

// GCC 12 reports the undefined lanes inside its own AVX-512 intrinsics as uninitialized.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif

[[gnu::target("avx512f,avx512bw")]] inline void add_columns_avx512(
    const std::int8_t* block, std::span<const std::uint32_t> columns, int group, int sign,
    std::int32_t* sums) {
  const auto bytes = [block, columns](std::size_t c) {
    return block + std::size_t{columns[c]} * kBlockUnits;
  };
  const std::size_t n = columns.size();
  for (std::size_t begin = 0; begin < n; begin += kColumnsPerSum) {
    const std::size_t end = std::min(begin + kColumnsPerSum, n);
    __m512i s0 = _mm512_setzero_si512();
    __m512i s1 = s0;
    std::size_t c = begin;
    const auto prefetch = [&](std::size_t ahead) __attribute__((always_inline)) {
      if (ahead < n) _mm_prefetch(reinterpret_cast<const char*>(bytes(ahead)), _MM_HINT_T0);
    };
#define SDNN_WIDEN(all)                                                                 \
  s0 = _mm512_add_epi16(s0, _mm512_cvtepi8_epi16(_mm512_castsi512_si256(all)));         \
  s1 = _mm512_add_epi16(s1, _mm512_cvtepi8_epi16(_mm512_extracti64x4_epi64(all, 1)))
    if (group == 4) {
      for (; c + 4 <= end; c += 4) {
        for (std::size_t k = 0; k < 4; ++k) prefetch(c + kPrefetchAhead + k);
        const __m512i all = _mm512_add_epi8(
            _mm512_add_epi8(_mm512_load_si512(bytes(c)), _mm512_load_si512(bytes(c + 1))),
            _mm512_add_epi8(_mm512_load_si512(bytes(c + 2)), _mm512_load_si512(bytes(c + 3))));
        SDNN_WIDEN(all);
      }
    } else if (group == 2) {
      for (; c + 2 <= end; c += 2) {
        for (std::size_t k = 0; k < 2; ++k) prefetch(c + kPrefetchAhead + k);
        const __m512i all =
            _mm512_add_epi8(_mm512_load_si512(bytes(c)), _mm512_load_si512(bytes(c + 1)));
        SDNN_WIDEN(all);
      }
    }
    for (; c < end; ++c) {
      prefetch(c + kPrefetchAhead);
      const __m512i all = _mm512_load_si512(bytes(c));
      SDNN_WIDEN(all);
    }
#undef SDNN_WIDEN
    const __m512i quarters[4] = {_mm512_cvtepi16_epi32(_mm512_castsi512_si256(s0)),
                                 _mm512_cvtepi16_epi32(_mm512_extracti64x4_epi64(s0, 1)),
                                 _mm512_cvtepi16_epi32(_mm512_castsi512_si256(s1)),
                                 _mm512_cvtepi16_epi32(_mm512_extracti64x4_epi64(s1, 1))};
    for (int q = 0; q < 4; ++q) {
      const __m512i before = _mm512_loadu_si512(sums + 16 * q);
      _mm512_storeu_si512(sums + 16 * q, sign > 0 ? _mm512_add_epi32(before, quarters[q])
                                                  : _mm512_sub_epi32(before, quarters[q]));
    }
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
