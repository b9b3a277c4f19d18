/// A set of input columns, and what a list of columns has in common with it.
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif

namespace sdnn::approximators {

/// Columns below a number given when it is made.
class ColumnSet {
 public:
  ColumnSet() = default;
  explicit ColumnSet(std::size_t n_columns) : words_(core::n_bit_words(n_columns)) {}

  std::size_t size() const noexcept { return size_; }
  bool holds(std::size_t column) const noexcept { return words_[column / 64][column % 64]; }
  void add(std::size_t column) noexcept {
    size_ += holds(column) ? 0U : 1U;
    words_[column / 64][column % 64] = true;
  }
  void remove(std::size_t column) noexcept {
    size_ -= holds(column) ? 1U : 0U;
    words_[column / 64][column % 64] = false;
  }
  const core::BitWord* words() const noexcept { return words_.data(); }

 private:
  std::vector<core::BitWord> words_;
  std::size_t size_ = 0;
};

/// A word of a list of columns.
struct ListedWord {
  std::uint64_t bits;
  std::uint32_t word;
};

namespace detail {

/// Writes the columns whose bits are set in a word.
SDNN_INLINE std::uint32_t* append_columns(std::uint32_t* to, std::uint64_t bits,
                                          std::uint32_t word) noexcept {
  for (; bits != 0; bits &= bits - 1) {
    *to++ = 64 * word + static_cast<std::uint32_t>(std::countr_zero(bits));
  }
  return to;
}

SDNN_INLINE std::uint32_t* intersect_body(const ListedWord* begin, const ListedWord* end,
                                          const core::BitWord* set, std::uint32_t* out) noexcept {
  for (; begin != end; ++begin) {
    out = append_columns(out, begin->bits & set[begin->word].to_ullong(), begin->word);
  }
  return out;
}

SDNN_INLINE std::uint32_t* intersect_bits_body(const std::uint64_t* bits, const core::BitWord* set,
                                               std::size_t n_words, std::uint32_t* out) noexcept {
  for (std::size_t w = 0; w < n_words; ++w) {
    out = append_columns(out, bits[w] & set[w].to_ullong(), static_cast<std::uint32_t>(w));
  }
  return out;
}

#if SDNN_X86_KERNELS

/// Eight words at a time: those in which both have a bit are moved together first.
[[SDNN_TARGET_AVX512]] inline std::uint32_t* intersect_bits_avx512(const std::uint64_t* bits,
                                                                   const core::BitWord* set,
                                                                   std::size_t n_words,
                                                                   std::uint32_t* out) noexcept {
  static_assert(sizeof(core::BitWord) == sizeof(std::uint64_t));
  const __m512i eight = _mm512_set1_epi64(8);
  __m512i words = _mm512_setr_epi64(0, 1, 2, 3, 4, 5, 6, 7);
  for (std::size_t w = 0; w < n_words; w += 8) {
    const std::size_t n_left = n_words - w;
    const auto some = static_cast<__mmask8>(n_left < 8 ? (1U << n_left) - 1 : 0xFF);
    const __m512i both = _mm512_and_si512(_mm512_maskz_loadu_epi64(some, bits + w),
                                          _mm512_maskz_loadu_epi64(some, set + w));
    const __mmask8 found = _mm512_test_epi64_mask(both, both);
    alignas(64) std::array<std::uint64_t, 8> found_bits;
    alignas(64) std::array<std::uint64_t, 8> found_words;
    _mm512_store_si512(found_bits.data(), _mm512_maskz_compress_epi64(found, both));
    _mm512_store_si512(found_words.data(), _mm512_maskz_compress_epi64(found, words));
    const auto n_found = static_cast<std::size_t>(std::popcount(found));
    for (std::size_t k = 0; k < n_found; ++k) {
      out = coding::detail::append_few_bits<2>(out, found_bits[k], 64 * found_words[k]);
    }
    words = _mm512_add_epi64(words, eight);
  }
  return out;
}

#endif  // SDNN_X86_KERNELS

}  // namespace detail

/// Writes the columns of a list that are in a set of words; returns their end.
SDNN_KERNEL(std::uint32_t*, intersect,
            (const ListedWord* begin, const ListedWord* end, const core::BitWord* set,
             std::uint32_t* out),
            (begin, end, set, out))

SDNN_KERNEL_PORTABLE(std::uint32_t*, intersect_bits,
                     (const std::uint64_t* bits, const core::BitWord* set, std::size_t n_words,
                      std::uint32_t* out),
                     (bits, set, n_words, out))

SDNN_KERNEL_NEON(std::uint32_t*, intersect_bits,
                 (const std::uint64_t* bits, const core::BitWord* set, std::size_t n_words,
                  std::uint32_t* out),
                 (bits, set, n_words, out))

SDNN_KERNEL_AVX2(std::uint32_t*, intersect_bits,
                 (const std::uint64_t* bits, const core::BitWord* set, std::size_t n_words,
                  std::uint32_t* out),
                 (bits, set, n_words, out))

/// Writes the columns of words of bits that are in a set of as many; returns their end, beyond which
/// it may write two numbers.
SDNN_DISPATCH(std::uint32_t*, intersect_bits,
              (const std::uint64_t* bits, const core::BitWord* set, std::size_t n_words,
               std::uint32_t* out),
              (bits, set, n_words, out))

/// A list of columns as bits of words, to be compared with many sets.
template <std::size_t Most>
class ListedColumns {
 public:
  /// Up to Most columns; quickest in rising order. A column may come more than once.
  explicit ListedColumns(std::span<const std::uint32_t> columns) noexcept {
    assert(columns.size() <= Most);
    ListedWord now{0, 0};
    for (const std::uint32_t column : columns) {
      const std::uint64_t bit = std::uint64_t{1} << column % 64;
      if (column / 64 != now.word || (now.bits & bit) != 0) {
        if (now.bits != 0) words_[n_++] = now;
        now = {0, column / 64};
      }
      now.bits |= bit;
    }
    if (now.bits != 0) words_[n_++] = now;
  }

  /// Writes those that are in the set; returns how many. Shape: out, Most numbers.
  std::size_t in(const ColumnSet& set, std::uint32_t* out) const {
    return static_cast<std::size_t>(intersect(words_.data(), words_.data() + n_, set.words(), out) -
                                    out);
  }

 private:
  std::size_t n_ = 0;
  std::array<ListedWord, Most> words_;
};

}  // namespace sdnn::approximators
