/// Transposition between values ordered by units and values ordered by samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::estimators {

namespace detail {

#if SDNN_LANES

SDNN_WIDE_VECTORS_BEGIN

using Shorts = core::IntegerRegister<std::int16_t>;
using Words = core::IntegerRegister<std::int32_t>;
using LongWords = core::IntegerRegister<std::int64_t>;

/// Reinterprets the 32 bytes of a register as integers of another size.
template <class To, class From>
SDNN_INLINE To as(const From& from) noexcept {
  return {(typename To::Vector)from.v};
}

// Vector instructions interleave within parts of 16 bytes. For registers a0 a1 a2 a3 | a4 a5 a6 a7
// and b0 ... | b4 ..., low_turns takes the first half of each part, a0 b0 a1 b1 | a4 b4 a5 b5, and
// high_turns the last half, a2 b2 a3 b3 | a6 b6 a7 b7.

SDNN_INLINE Shorts low_turns(const Shorts& a, const Shorts& b) noexcept {
  return {
      __builtin_shufflevector(a.v, b.v, 0, 16, 1, 17, 2, 18, 3, 19, 8, 24, 9, 25, 10, 26, 11, 27)};
}
SDNN_INLINE Shorts high_turns(const Shorts& a, const Shorts& b) noexcept {
  return {__builtin_shufflevector(a.v, b.v, 4, 20, 5, 21, 6, 22, 7, 23, 12, 28, 13, 29, 14, 30, 15,
                                  31)};
}
SDNN_INLINE Words low_turns(const Words& a, const Words& b) noexcept {
  return {__builtin_shufflevector(a.v, b.v, 0, 8, 1, 9, 4, 12, 5, 13)};
}
SDNN_INLINE Words high_turns(const Words& a, const Words& b) noexcept {
  return {__builtin_shufflevector(a.v, b.v, 2, 10, 3, 11, 6, 14, 7, 15)};
}
SDNN_INLINE LongWords low_turns(const LongWords& a, const LongWords& b) noexcept {
  return {__builtin_shufflevector(a.v, b.v, 0, 4, 2, 6)};
}
SDNN_INLINE LongWords high_turns(const LongWords& a, const LongWords& b) noexcept {
  return {__builtin_shufflevector(a.v, b.v, 1, 5, 3, 7)};
}

/// Joins the first halves of two registers.
SDNN_INLINE LongWords first_halves(const LongWords& a, const LongWords& b) noexcept {
  return {__builtin_shufflevector(a.v, b.v, 0, 1, 4, 5)};
}
/// Joins the last halves of two registers.
SDNN_INLINE LongWords last_halves(const LongWords& a, const LongWords& b) noexcept {
  return {__builtin_shufflevector(a.v, b.v, 2, 3, 6, 7)};
}

/// Transposes 16 rows and 8 columns of 16-bit integers: two squares of 8 at once, rows 0 to 7 in
/// the first halves of the registers and rows 8 to 15 in the last.
struct ShortBlock {
  static constexpr std::size_t kRows = 16;
  static constexpr std::size_t kColumns = 8;

  /// Interleaves rows with rows, pairs of rows with pairs, and fours with fours.
  SDNN_INLINE static void transpose(const std::int16_t* from, std::size_t from_stride,
                                    std::int16_t* to, std::size_t to_stride) noexcept {
    Shorts rows[8];
    core::unrolled<8>([&](std::size_t r) SDNN_INLINE_LAMBDA {
      auto* const halves = reinterpret_cast<char*>(&rows[r].v);
      std::memcpy(halves, from + r * from_stride, 16);
      std::memcpy(halves + 16, from + (r + 8) * from_stride, 16);
    });
    Words pairs[8];      // entries of two rows in turn
    LongWords fours[8];  // entries of four rows in turn
    core::unrolled<4>([&](std::size_t k) SDNN_INLINE_LAMBDA {
      pairs[k] = as<Words>(low_turns(rows[2 * k], rows[2 * k + 1]));
      pairs[k + 4] = as<Words>(high_turns(rows[2 * k], rows[2 * k + 1]));
    });
    core::unrolled<4>([&](std::size_t k) SDNN_INLINE_LAMBDA {
      fours[2 * k] = as<LongWords>(low_turns(pairs[2 * k], pairs[2 * k + 1]));
      fours[2 * k + 1] = as<LongWords>(high_turns(pairs[2 * k], pairs[2 * k + 1]));
    });
    core::unrolled<4>([&](std::size_t k) SDNN_INLINE_LAMBDA {
      const std::size_t first = k / 2 * 4 + k % 2;
      const LongWords low = low_turns(fours[first], fours[first + 2]);
      const LongWords high = high_turns(fours[first], fours[first + 2]);
      as<Shorts>(low).store(to + 2 * k * to_stride);
      as<Shorts>(high).store(to + (2 * k + 1) * to_stride);
    });
  }
};

/// Transposes 8 rows and 8 columns of 32-bit integers.
struct WordBlock {
  static constexpr std::size_t kRows = 8;
  static constexpr std::size_t kColumns = 8;

  /// Interleaves rows with rows and pairs of rows with pairs, then joins halves of registers.
  SDNN_INLINE static void transpose(const std::int32_t* from, std::size_t from_stride,
                                    std::int32_t* to, std::size_t to_stride) noexcept {
    Words rows[8];
    core::unrolled<8>([&](std::size_t r)
                          SDNN_INLINE_LAMBDA { rows[r].load(from + r * from_stride); });
    LongWords pairs[8], fours[8];
    core::unrolled<4>([&](std::size_t k) SDNN_INLINE_LAMBDA {
      pairs[k] = as<LongWords>(low_turns(rows[2 * k], rows[2 * k + 1]));
      pairs[k + 4] = as<LongWords>(high_turns(rows[2 * k], rows[2 * k + 1]));
    });
    core::unrolled<4>([&](std::size_t k) SDNN_INLINE_LAMBDA {
      fours[2 * k] = low_turns(pairs[2 * k], pairs[2 * k + 1]);
      fours[2 * k + 1] = high_turns(pairs[2 * k], pairs[2 * k + 1]);
    });
    core::unrolled<4>([&](std::size_t k) SDNN_INLINE_LAMBDA {
      const std::size_t first = k / 2 * 4 + k % 2;
      const LongWords low = first_halves(fours[first], fours[first + 2]);
      const LongWords high = last_halves(fours[first], fours[first + 2]);
      as<Words>(low).store(to + k * to_stride);
      as<Words>(high).store(to + (k + 4) * to_stride);
    });
  }
};

// The block for a type of item; for decltype only.
inline ShortBlock block_of(const std::int16_t*) noexcept { return {}; }
inline WordBlock block_of(const std::int32_t*) noexcept { return {}; }

SDNN_WIDE_VECTORS_END

#endif  // SDNN_LANES

/// Implements transpose, below: whole blocks with vectors, and the other rows and columns item by
/// item.
template <class Item>
SDNN_INLINE void transpose_body(const Item* from, std::size_t from_stride, std::size_t n_rows,
                                std::size_t n_columns, Item* to, std::size_t to_stride) noexcept {
  std::size_t rows_done = 0;
  std::size_t columns_done = 0;
#if SDNN_LANES
  using Block = decltype(block_of(from));
  rows_done = n_rows / Block::kRows * Block::kRows;
  columns_done = n_columns / Block::kColumns * Block::kColumns;
  for (std::size_t r = 0; r < rows_done; r += Block::kRows) {
    for (std::size_t c = 0; c < columns_done; c += Block::kColumns) {
      Block::transpose(from + r * from_stride + c, from_stride, to + c * to_stride + r, to_stride);
    }
  }
#endif
  for (std::size_t r = 0; r < n_rows; ++r) {
    for (std::size_t c = r < rows_done ? columns_done : 0; c < n_columns; ++c) {
      to[c * to_stride + r] = from[r * from_stride + c];
    }
  }
}

}  // namespace detail

/// Sets to[c * to_stride + r] = from[r * from_stride + c] for all rows r and columns c. It is
/// fastest for multiples of 16 rows and 8 columns.
SDNN_KERNEL(void, transpose,
            (const std::int16_t* from, std::size_t from_stride, std::size_t n_rows,
             std::size_t n_columns, std::int16_t* to, std::size_t to_stride),
            (from, from_stride, n_rows, n_columns, to, to_stride))
SDNN_KERNEL(void, transpose,
            (const std::int32_t* from, std::size_t from_stride, std::size_t n_rows,
             std::size_t n_columns, std::int32_t* to, std::size_t to_stride),
            (from, from_stride, n_rows, n_columns, to, to_stride))

}  // namespace sdnn::estimators
