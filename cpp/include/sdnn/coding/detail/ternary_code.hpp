/// Ternary codes as words of bits: their inner products, their columns, their differences.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif
#if SDNN_NEON_KERNELS
#include <arm_neon.h>
#endif

namespace sdnn::coding {

/// A code of +1, 0 and -1, as bits of the columns that are not 0 and bits of those that are +1.
/// Column j is bit j % 64 of word j / 64. The words are plain integers, because kernels count, list
/// and compare them, which std::bitset does not support.
struct TernaryCode {
  const std::uint64_t* active;
  const std::uint64_t* positive;
};

namespace detail {

/// Computes the inner product of the words [begin, end): the number of columns that are not 0 in
/// both codes, minus twice the number of those whose signs differ.
SDNN_INLINE std::int32_t inner_product_of_words(const TernaryCode& code, const TernaryCode& other,
                                                std::size_t begin, std::size_t end) noexcept {
  std::int32_t both = 0;
  std::int32_t unlike = 0;
  for (std::size_t w = begin; w < end; ++w) {
    const std::uint64_t shared = code.active[w] & other.active[w];
    both += std::popcount(shared);
    unlike += std::popcount(shared & (code.positive[w] ^ other.positive[w]));
  }
  return both - 2 * unlike;
}

inline std::int32_t inner_product_portable(const TernaryCode& code, const TernaryCode& other,
                                           std::size_t n_words) noexcept {
  return inner_product_of_words(code, other, 0, n_words);
}

#if SDNN_X86_KERNELS

[[SDNN_TARGET_AVX2, gnu::always_inline]] inline __m256i load_avx2(const std::uint64_t* from) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
}

/// Computes inner_product 256 bits at a time. A shuffle looks up the number of set bits of each 4
/// bits, in a table of 16 bytes (in both halves of the register); these counts are added bytewise.
[[SDNN_TARGET_AVX2]] inline std::int32_t inner_product_avx2(const TernaryCode& code,
                                                            const TernaryCode& other,
                                                            std::size_t n_words) {
  constexpr std::size_t kMost = 4 * 31;  // words whose counts, 8 a byte at most, fit into bytes
  const __m256i counts = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4,  //
                                          0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i low = _mm256_set1_epi8(15);
  const __m256i none = _mm256_setzero_si256();
  // Adds the number of set bits of each byte of `bits` to the same byte of `bytes`.
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
          _mm256_and_si256(load_avx2(code.active + w), load_avx2(other.active + w));
      const __m256i differing =
          _mm256_xor_si256(load_avx2(code.positive + w), load_avx2(other.positive + w));
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
         inner_product_of_words(code, other, w, n_words);
}

[[SDNN_TARGET_AVX2]] inline std::int32_t inner_product_avx512(const TernaryCode& code,
                                                              const TernaryCode& other,
                                                              std::size_t n_words) {
  return inner_product_avx2(code, other, n_words);
}

#endif  // SDNN_X86_KERNELS

#if SDNN_NEON_KERNELS

/// Computes inner_product 128 bits at a time, with NEON's instruction that counts bits in bytes.
inline std::int32_t inner_product_neon(const TernaryCode& code, const TernaryCode& other,
                                       std::size_t n_words) noexcept {
  constexpr std::size_t kMost = 2 * 4095;  // words whose counts, 16 at most, fit into 16 bits
  const auto load = [](const std::uint64_t* from) __attribute__((always_inline)) {
    return vreinterpretq_u8_u64(vld1q_u64(from));
  };
  std::uint64_t n_both = 0;
  std::uint64_t n_unlike = 0;
  const auto total = [](uint16x8_t counts) __attribute__((always_inline)) {
    const uint64x2_t halves = vpaddlq_u32(vpaddlq_u16(counts));
    return vgetq_lane_u64(halves, 0) + vgetq_lane_u64(halves, 1);
  };
  std::size_t w = 0;
  while (w + 2 <= n_words) {
    uint16x8_t both = vdupq_n_u16(0);
    uint16x8_t unlike = both;
    for (const std::size_t end = std::min(n_words, w + kMost); w + 2 <= end; w += 2) {
      const uint8x16_t shared = vandq_u8(load(code.active + w), load(other.active + w));
      const uint8x16_t differing = veorq_u8(load(code.positive + w), load(other.positive + w));
      both = vpadalq_u8(both, vcntq_u8(shared));
      unlike = vpadalq_u8(unlike, vcntq_u8(vandq_u8(shared, differing)));
    }
    n_both += total(both);
    n_unlike += total(unlike);
  }
  return static_cast<std::int32_t>(static_cast<std::int64_t>(n_both) -
                                   2 * static_cast<std::int64_t>(n_unlike)) +
         inner_product_of_words(code, other, w, n_words);
}

#endif  // SDNN_NEON_KERNELS

}  // namespace detail

/// Computes the inner product of two codes of n_words words, fastest if that is a multiple of 4.
SDNN_DISPATCH(std::int32_t, inner_product,
              (const TernaryCode& code, const TernaryCode& other, std::size_t n_words),
              (code, other, n_words))

/// Counts the entries of a code that are not 0.
inline std::size_t n_active(const TernaryCode& code, std::size_t n_words) noexcept {
  std::size_t n = 0;
  for (std::size_t w = 0; w < n_words; ++w) {
    n += static_cast<std::size_t>(std::popcount(code.active[w]));
  }
  return n;
}

namespace detail {

/// The changes of 64 columns from one code to another, as bits: `up` and `down` have the columns
/// whose entry rises or falls, `up_again` and `down_again` those among them that change by 2.
struct WordChanges {
  SDNN_INLINE WordChanges(const TernaryCode& from, const TernaryCode& to,
                          std::size_t word) noexcept {
    const std::uint64_t plus = to.positive[word];
    const std::uint64_t minus = to.active[word] & ~plus;
    const std::uint64_t old_plus = from.positive[word];
    const std::uint64_t old_minus = from.active[word] & ~old_plus;
    up = (plus & ~old_plus) | (old_minus & ~minus);
    up_again = plus & old_minus;
    down = (minus & ~old_minus) | (old_plus & ~plus);
    down_again = minus & old_plus;
  }

  std::uint64_t up, up_again, down, down_again;
};

/// Writes `base` + the numbers of the set bits, in rising order; returns the end of the written
/// numbers. `Some` numbers are written before each test for further bits, so that few bits need few
/// jumps; up to `Some` meaningless numbers may follow the end.
template <std::size_t Some, class Number>
SDNN_INLINE Number* append_few_bits(Number* to, std::uint64_t bits, std::size_t base) noexcept {
  Number* const end = to + std::popcount(bits);
  do {
    core::unrolled<Some>([&](std::size_t) SDNN_INLINE_LAMBDA {
      *to++ = static_cast<Number>(base + static_cast<std::size_t>(std::countr_zero(bits)));
      bits &= bits - 1;
    });
  } while (bits != 0);
  return end;
}

/// The numbers of the `n` set bits of a byte, in rising order.
struct BitsOfByte {
  std::array<std::uint32_t, 8> numbers{};
  std::uint32_t n = 0;
};

inline constexpr std::array<BitsOfByte, 256> kBitsOfByte = [] {
  std::array<BitsOfByte, 256> table{};
  for (std::size_t byte = 0; byte < table.size(); ++byte) {
    for (std::uint32_t bit = 0; bit < 8; ++bit) {
      if (byte >> bit & 1) table[byte].numbers[table[byte].n++] = bit;
    }
  }
  return table;
}();

/// Writes the same numbers as append_few_bits, faster for words with about a quarter of their bits
/// set. It writes eight numbers for each byte, so that no branch depends on single bits; up to
/// eight meaningless numbers may follow the end.
inline std::uint32_t* append_many_bits(std::uint32_t* to, std::uint64_t bits,
                                       std::size_t base) noexcept {
  for (; bits != 0; bits >>= 8, base += 8) {
    const BitsOfByte& set = kBitsOfByte[bits & 0xff];
    std::array<std::uint32_t, 8> numbers = set.numbers;
    for (std::uint32_t& number : numbers) number += static_cast<std::uint32_t>(base);
    std::memcpy(to, numbers.data(), sizeof numbers);
    to += set.n;
  }
  return to;
}

/// Implements list_columns, below, without vector instructions.
inline void list_columns_portable(const TernaryCode& code,
                                  std::span<const std::uint32_t> first_columns,
                                  std::uint32_t** plus, std::uint32_t** minus) noexcept {
  for (std::size_t w = 0; w < first_columns.size(); ++w) {
    const std::size_t first = first_columns[w];
    *plus = append_many_bits(*plus, code.positive[w], first);
    *minus = append_many_bits(*minus, code.active[w] & ~code.positive[w], first);
  }
}

#if SDNN_X86_KERNELS

inline void list_columns_avx2(const TernaryCode& code, std::span<const std::uint32_t> first_columns,
                              std::uint32_t** plus, std::uint32_t** minus) noexcept {
  list_columns_portable(code, first_columns, plus, minus);
}

/// Implements list_columns sixteen columns at a time: those whose bit is set are moved to the front
/// of a register, which is written whole.
[[SDNN_TARGET_AVX512]] inline void list_columns_avx512(const TernaryCode& code,
                                                       std::span<const std::uint32_t> first_columns,
                                                       std::uint32_t** plus,
                                                       std::uint32_t** minus) noexcept {
  const __m512i sixteen = _mm512_set1_epi32(16);
  const __m512i from_zero = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const auto append = [](std::uint32_t* to, std::uint64_t bits, __m512i columns)
                          __attribute__((always_inline, target("avx512f,popcnt"))) {
                            const auto mask = static_cast<__mmask16>(bits);
                            _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(mask, columns));
                            return to + std::popcount(mask);
                          };
  std::uint32_t* up = *plus;
  std::uint32_t* down = *minus;
  for (std::size_t w = 0; w < first_columns.size(); ++w) {
    std::uint64_t positive = code.positive[w];
    std::uint64_t negative = code.active[w] & ~positive;
    __m512i columns =
        _mm512_add_epi32(from_zero, _mm512_set1_epi32(static_cast<int>(first_columns[w])));
    for (; (positive | negative) != 0; positive >>= 16, negative >>= 16) {
      up = append(up, positive, columns);
      down = append(down, negative, columns);
      columns = _mm512_add_epi32(columns, sixteen);
    }
  }
  *plus = up;
  *minus = down;
}

#endif  // SDNN_X86_KERNELS

/// Implements list_changes. It first lists the words in which the codes differ, without a branch
/// for each word, and then the columns in these words.
SDNN_INLINE void list_changes_body(const TernaryCode& from, const TernaryCode& to,
                                   std::span<const std::uint32_t> first_columns,
                                   std::uint32_t* words, std::uint32_t** up,
                                   std::uint32_t** down) noexcept {
  std::uint32_t* end = words;
  for (std::size_t w = 0; w < first_columns.size(); ++w) {
    *end = static_cast<std::uint32_t>(w);
    end += ((from.active[w] ^ to.active[w]) | (from.positive[w] ^ to.positive[w])) != 0 ? 1 : 0;
  }
  for (; words != end; ++words) {
    const WordChanges changes(from, to, *words);
    const std::size_t base = first_columns[*words];
    *up = append_few_bits<1>(append_few_bits<1>(*up, changes.up, base), changes.up_again, base);
    *down =
        append_few_bits<1>(append_few_bits<1>(*down, changes.down, base), changes.down_again, base);
  }
}

}  // namespace detail

SDNN_KERNEL_NEON(void, list_columns,
                 (const TernaryCode& code, std::span<const std::uint32_t> first_columns,
                  std::uint32_t** plus, std::uint32_t** minus),
                 (code, first_columns, plus, minus))

/// Writes the numbers of the columns that are +1 and -1 from `*plus` and `*minus` on, and moves
/// both pointers to the ends. `first_columns` has, for each word, the number of the column of its
/// bit 0. Up to sixteen meaningless numbers may follow each end.
SDNN_DISPATCH(void, list_columns,
              (const TernaryCode& code, std::span<const std::uint32_t> first_columns,
               std::uint32_t** plus, std::uint32_t** minus),
              (code, first_columns, plus, minus))

/// Writes the numbers of the columns whose entry rises or falls from one code to another from `*up`
/// and `*down` on, twice for a change by 2, and moves both pointers to the ends: up to 128 numbers
/// for each word, and a meaningless one behind. `first_columns` has, for each word, the number of
/// the column of its bit 0; `words` is scratch for n_words + 1 numbers.
SDNN_KERNEL(void, list_changes,
            (const TernaryCode& from, const TernaryCode& to,
             std::span<const std::uint32_t> first_columns, std::uint32_t* words, std::uint32_t** up,
             std::uint32_t** down),
            (from, to, first_columns, words, up, down))

/// The numbers of columns to add and of columns to subtract. A column that is listed twice counts
/// twice; apart from that, numbers rise.
struct SignedColumns {
  std::span<const std::uint32_t> plus;
  std::span<const std::uint32_t> minus;

  std::size_t size() const noexcept { return plus.size() + minus.size(); }
};

/// Buffers for the columns of a code, or for those in which two codes differ. They are initialized
/// on construction, so that listing columns neither allocates nor touches new memory pages.
class ColumnLists {
 public:
  /// Columns numbered by bits: column j is bit j % 64 of word j / 64.
  explicit ColumnLists(std::size_t n_words) : ColumnLists(n_words, 1, 64) {}
  /// Columns numbered consecutively over groups of `words_per_group` words, which hold
  /// `columns_per_group` columns each: the unused bits at the end of a group have no number.
  ColumnLists(std::size_t n_words, std::size_t words_per_group, std::size_t columns_per_group)
      : first_columns_(n_words),
        words_(n_words + 1),
        plus_(128 * n_words + 8),  // 64 columns a word, twice if by 2, and extra numbers of kernels
        minus_(128 * n_words + 8) {
    for (std::size_t w = 0; w < n_words; ++w) {
      first_columns_[w] = static_cast<std::uint32_t>(w / words_per_group * columns_per_group +
                                                     w % words_per_group * 64);
    }
  }

  /// Overwrites the lists with the columns of a code that are +1 and -1.
  void read(const TernaryCode& code) noexcept {
    std::uint32_t* plus = plus_.data();
    std::uint32_t* minus = minus_.data();
    list_columns(code, first_columns_, &plus, &minus);
    note_ends(plus, minus);
  }

  /// Overwrites the lists with the columns that change from one code to another, twice if by 2.
  void read_changes(const TernaryCode& from, const TernaryCode& to) {
    std::uint32_t* up = plus_.data();
    std::uint32_t* down = minus_.data();
    list_changes(from, to, first_columns_, words_.data(), &up, &down);
    note_ends(up, down);
  }

  /// The columns that were listed last; valid until the next call of read or read_changes.
  SignedColumns columns() const noexcept {
    return {std::span(plus_).first(n_plus_), std::span(minus_).first(n_minus_)};
  }

 private:
  void note_ends(const std::uint32_t* plus, const std::uint32_t* minus) noexcept {
    n_plus_ = static_cast<std::size_t>(plus - plus_.data());
    n_minus_ = static_cast<std::size_t>(minus - minus_.data());
  }

  std::vector<std::uint32_t> first_columns_;  // the number of each word's bit 0
  std::vector<std::uint32_t> words_;          // scratch
  std::vector<std::uint32_t> plus_;
  std::vector<std::uint32_t> minus_;
  std::size_t n_plus_ = 0;
  std::size_t n_minus_ = 0;
};

}  // namespace sdnn::coding
