/// A set of input columns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/core/bit_layer.hpp"

namespace sdnn::approximators {

/// Columns below a number given when it is made; columns are added, never taken away.
class ColumnSet {
 public:
  ColumnSet() = default;
  explicit ColumnSet(std::size_t n_columns) : words_(core::n_bit_words(n_columns)) {}

  std::size_t size() const noexcept { return size_; }
  bool holds(std::size_t column) const noexcept { return words_[column / 64][column % 64]; }
  void add(std::size_t column) noexcept {
    size_ += holds(column) ? 0 : 1;
    words_[column / 64][column % 64] = true;
  }

  /// Writes those of `columns` that are in the set, in their order; returns how many. Shape: out,
  /// as long as columns: what lies beyond the result is overwritten.
  std::size_t select(std::span<const std::uint32_t> columns, std::uint32_t* out) const noexcept {
    std::size_t n = 0;
    for (const std::uint32_t column : columns) {
      out[n] = column;
      n += holds(column) ? 1 : 0;
    }
    return n;
  }

 private:
  std::vector<core::BitWord> words_;
  std::size_t size_ = 0;
};

}  // namespace sdnn::approximators
