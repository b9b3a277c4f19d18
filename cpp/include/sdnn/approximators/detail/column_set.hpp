/// A set of input columns, and what a list of columns has in common with it.
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

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

SDNN_INLINE std::uint32_t* intersect_body(const ListedWord* begin, const ListedWord* end,
                                          const core::BitWord* set, std::uint32_t* out) noexcept {
  for (; begin != end; ++begin) {
    std::uint64_t bits = begin->bits & set[begin->word].to_ullong();
    for (; bits != 0; bits &= bits - 1) {
      *out++ = 64 * begin->word + static_cast<std::uint32_t>(std::countr_zero(bits));
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
