/// A set of input columns, and its intersection with lists of columns.
#pragma once

#include <algorithm>
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

namespace sdnn::approximators {

/// A set of columns below a number that is fixed on construction.
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

/// Words with common bits are listed first, so that no branch depends on other words.
SDNN_INLINE std::uint32_t* intersect_bits_body(const std::uint64_t* bits, const core::BitWord* set,
                                               std::size_t n_words, std::uint32_t* out) noexcept {
  constexpr std::size_t kAtOnce = 64;
  std::array<ListedWord, kAtOnce + 1> found;
  for (std::size_t first = 0; first < n_words; first += kAtOnce) {
    std::size_t n_found = 0;
    for (std::size_t w = first; w < std::min(first + kAtOnce, n_words); ++w) {
      const std::uint64_t both = bits[w] & set[w].to_ullong();
      found[n_found] = {both, static_cast<std::uint32_t>(w)};
      n_found += both != 0 ? 1 : 0;
    }
    for (std::size_t k = 0; k < n_found; ++k) {
      out = coding::detail::append_few_bits<2>(out, found[k].bits, 64 * found[k].word);
    }
  }
  return out;
}

}  // namespace detail

/// Writes the columns of a list that are in a set of words; returns their end.
SDNN_KERNEL(std::uint32_t*, intersect,
            (const ListedWord* begin, const ListedWord* end, const core::BitWord* set,
             std::uint32_t* out),
            (begin, end, set, out))

/// Writes the columns of words of bits that are in a set of the same size; returns their end,
/// beyond which it may write two numbers.
SDNN_KERNEL(std::uint32_t*, intersect_bits,
            (const std::uint64_t* bits, const core::BitWord* set, std::size_t n_words,
             std::uint32_t* out),
            (bits, set, n_words, out))

/// A list of columns as bits of words, to be compared with many sets.
template <std::size_t Most>
class ListedColumns {
 public:
  /// Takes up to Most columns, fastest in rising order; a column may be repeated.
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

  /// Writes the columns that are in the set; returns their number. Shape: out, Most numbers.
  std::size_t in(const ColumnSet& set, std::uint32_t* out) const {
    return static_cast<std::size_t>(intersect(words_.data(), words_.data() + n_, set.words(), out) -
                                    out);
  }

 private:
  std::size_t n_ = 0;
  std::array<ListedWord, Most> words_;
};

}  // namespace sdnn::approximators
