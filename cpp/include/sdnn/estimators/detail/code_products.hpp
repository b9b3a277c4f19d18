/// Inner products of codes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif

namespace sdnn::estimators {

namespace detail {

/// The part of the words [begin, end).
SDNN_INLINE std::int32_t inner_product_body(const coding::CodeWords& one,
                                            const coding::CodeWords& other, std::size_t begin,
                                            std::size_t end) noexcept {
  std::int32_t both = 0;
  std::int32_t unlike = 0;
  for (std::size_t w = begin; w < end; ++w) {
    const std::uint64_t shared = one.active[w] & other.active[w];
    both += std::popcount(shared);
    unlike += std::popcount(shared & (one.positive[w] ^ other.positive[w]));
  }
  return both - 2 * unlike;
}

#if SDNN_X86_KERNELS

[[gnu::target("avx2"), gnu::always_inline]] inline __m256i load_avx2(const std::uint64_t* from) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
}

/// The same, 256 bits at a time: the bits of all 4-bit parts are counted by looking them up in a
/// register.
[[gnu::target("avx2,popcnt")]] inline std::int32_t inner_product_avx2(
    const coding::CodeWords& one, const coding::CodeWords& other, std::size_t n_words) {
  constexpr std::size_t kMost = 4 * 31;  // words whose counts, 8 a byte at most, fit into bytes
  const __m256i counts = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4,  //
                                          0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i low = _mm256_set1_epi8(15);
  const __m256i none = _mm256_setzero_si256();
  const auto add_counts = [&](__m256i bytes,
                              __m256i bits) __attribute__((always_inline, target("avx2,popcnt"))) {
    const __m256i first = _mm256_shuffle_epi8(counts, _mm256_and_si256(bits, low));
    const __m256i second =
        _mm256_shuffle_epi8(counts, _mm256_and_si256(_mm256_srli_epi16(bits, 4), low));
    return _mm256_add_epi8(bytes, _mm256_add_epi8(first, second));
  };
  __m256i total = none;
  std::size_t w = 0;
  while (w + 4 <= n_words) {
    __m256i both = none;
    __m256i unlike = none;
    for (const std::size_t end = std::min(n_words, w + kMost); w + 4 <= end; w += 4) {
      const __m256i shared =
          _mm256_and_si256(load_avx2(one.active + w), load_avx2(other.active + w));
      const __m256i differing =
          _mm256_xor_si256(load_avx2(one.positive + w), load_avx2(other.positive + w));
      both = add_counts(both, shared);
      unlike = add_counts(unlike, _mm256_and_si256(shared, differing));
    }
    const __m256i n_unlike = _mm256_sad_epu8(unlike, none);
    total = _mm256_add_epi64(
        total, _mm256_sub_epi64(_mm256_sad_epu8(both, none), _mm256_add_epi64(n_unlike, n_unlike)));
  }
  alignas(32) std::int64_t parts[4];
  _mm256_store_si256(reinterpret_cast<__m256i*>(parts), total);
  return static_cast<std::int32_t>(parts[0] + parts[1] + parts[2] + parts[3]) +
         inner_product_body(one, other, w, n_words);
}

#endif  // SDNN_X86_KERNELS

}  // namespace detail

/// The inner product of two codes. Quickest if n_words is a multiple of 4.
inline std::int32_t inner_product(const coding::CodeWords& one, const coding::CodeWords& other,
                                  std::size_t n_words) {
#if SDNN_X86_KERNELS
  if (core::instruction_set() != core::InstructionSet::portable) {
    return detail::inner_product_avx2(one, other, n_words);
  }
#endif
  return detail::inner_product_body(one, other, 0, n_words);
}

}  // namespace sdnn::estimators
