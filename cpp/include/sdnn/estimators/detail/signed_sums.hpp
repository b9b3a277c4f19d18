/// Sums of rows minus sums of other rows. Corrections change potentials by rows of inner products,
/// and weights by codes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/coding/detail/expanded_bits.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::estimators {

/// Rows to add and rows to subtract, which must exist until they are used.
template <class Entry>
struct SignedRows {
  std::vector<const Entry*> plus;
  std::vector<const Entry*> minus;

  void add(const Entry* row, std::int32_t direction) {
    (direction > 0 ? plus : minus).push_back(row);
  }
  void clear() noexcept {
    plus.clear();
    minus.clear();
  }
  std::size_t size() const noexcept { return plus.size() + minus.size(); }
  bool empty() const noexcept { return plus.empty() && minus.empty(); }
};

namespace detail {

/// Adds to `to`, for as many entries as `Registers` registers hold, the entries from `at` on of the
/// rows plus[p .. p_end), minus those of the rows minus[m .. m_end). They are summed in type Entry.
template <std::size_t Registers, class To, class Entry>
SDNN_INLINE void add_signed_at(To* to, std::size_t at, const SignedRows<Entry>& rows, std::size_t p,
                               std::size_t p_end, std::size_t m, std::size_t m_end) noexcept {
  using Register = core::IntegerRegister<Entry>;
  Register sum[Registers];
  core::unrolled<Registers>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
  for (; p < p_end; ++p) {
    const Entry* const row = rows.plus.data()[p] + at;
    core::unrolled<Registers>([&](std::size_t r)
                                  SDNN_INLINE_LAMBDA { sum[r].add(row + r * Register::kSize); });
  }
  for (; m < m_end; ++m) {
    const Entry* const row = rows.minus.data()[m] + at;
    core::unrolled<Registers>(
        [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].subtract(row + r * Register::kSize); });
  }
  core::unrolled<Registers>([&](std::size_t r)
                                SDNN_INLINE_LAMBDA { sum[r].add_to(to + r * Register::kSize); });
}

/// Implements add_signed, below, for `n_per_sum` rows at a time: first with four registers of
/// entries, then with single registers, and at the end with single entries.
template <class To, class Entry>
SDNN_INLINE void add_signed_body(To* to, std::size_t size, const SignedRows<Entry>& rows,
                                 std::size_t offset, std::size_t n_per_sum) noexcept {
  constexpr std::size_t kSize = core::IntegerRegister<Entry>::kSize;
  const std::size_t n_plus = rows.plus.size();
  const std::size_t n_minus = rows.minus.size();
  for (std::size_t p = 0, m = 0; p < n_plus || m < n_minus;) {
    const std::size_t p_end = std::min(n_plus, p + n_per_sum);
    const std::size_t m_end = std::min(n_minus, m + (n_per_sum - (p_end - p)));
    std::size_t i = 0;
    for (; i + 4 * kSize <= size; i += 4 * kSize) {
      add_signed_at<4>(to + i, offset + i, rows, p, p_end, m, m_end);
    }
    for (; i + kSize <= size; i += kSize) {
      add_signed_at<1>(to + i, offset + i, rows, p, p_end, m, m_end);
    }
    for (; i < size; ++i) {
      for (std::size_t k = p; k < p_end; ++k)
        to[i] = static_cast<To>(to[i] + rows.plus[k][offset + i]);
      for (std::size_t k = m; k < m_end; ++k)
        to[i] = static_cast<To>(to[i] - rows.minus[k][offset + i]);
    }
    p = p_end;
    m = m_end;
  }
}

/// The body of the kernel add_row (see below), compiled for each instruction set.
template <class Product>
SDNN_INLINE void add_row_body(std::int32_t* to, const Product* row, std::int32_t direction,
                              std::size_t size) noexcept {
  if (direction > 0) {
    for (std::size_t i = 0; i < size; ++i) to[i] += row[i];
  } else {
    for (std::size_t i = 0; i < size; ++i) to[i] -= row[i];
  }
}

/// The body of the kernel expand_code (see below), compiled for each instruction set.
SDNN_INLINE void expand_code_body(const coding::TernaryCode& code,
                                  std::span<const std::size_t> words, std::size_t chunk_words,
                                  std::int8_t* entries, std::size_t chunk_stride) noexcept {
  for (std::size_t w = 0; w < words.size(); w += chunk_words, entries += chunk_stride) {
    for (std::size_t k = 0; k < chunk_words; ++k) {
      const std::uint64_t plus = code.positive[words[w + k]];
      const std::uint64_t minus = code.active[words[w + k]] & ~plus;
      coding::detail::expand_word(plus, minus, entries + 64 * k);
    }
  }
}

}  // namespace detail

/// Adds to to[i], i < size, the sum of row[offset + i] over the rows to add, minus that over the
/// rows to subtract.
///
/// At most `n_per_sum` (> 0) entries are added in their own type, which must hold the sum, before
/// it is added to `to`.
SDNN_KERNEL(void, add_signed,
            (std::int16_t* to, std::size_t size, const SignedRows<std::int8_t>& rows,
             std::size_t offset, std::size_t n_per_sum),
            (to, size, rows, offset, n_per_sum))
SDNN_KERNEL(void, add_signed,
            (std::int32_t* to, std::size_t size, const SignedRows<std::int8_t>& rows,
             std::size_t offset, std::size_t n_per_sum),
            (to, size, rows, offset, n_per_sum))
SDNN_KERNEL(void, add_signed,
            (std::int32_t* to, std::size_t size, const SignedRows<std::int16_t>& rows,
             std::size_t offset, std::size_t n_per_sum),
            (to, size, rows, offset, n_per_sum))
SDNN_KERNEL(void, add_signed,
            (std::int32_t* to, std::size_t size, const SignedRows<std::int32_t>& rows,
             std::size_t offset, std::size_t n_per_sum),
            (to, size, rows, offset, n_per_sum))

/// Adds direction (+1 or -1) * row[i] to to[i], i < size.
SDNN_KERNEL(void, add_row,
            (std::int32_t* to, const std::int16_t* row, std::int32_t direction, std::size_t size),
            (to, row, direction, size))
SDNN_KERNEL(void, add_row,
            (std::int32_t* to, const std::int32_t* row, std::int32_t direction, std::size_t size),
            (to, row, direction, size))

/// Writes a code as bytes +1, 0 or -1, in chunks of `chunk_words` words: entries[c * chunk_stride +
/// k] is column k of chunk c. `words` has the numbers of the code's words, chunk after chunk; their
/// number is a multiple of `chunk_words`.
SDNN_KERNEL(void, expand_code,
            (const coding::TernaryCode& code, std::span<const std::size_t> words,
             std::size_t chunk_words, std::int8_t* entries, std::size_t chunk_stride),
            (code, words, chunk_words, entries, chunk_stride))

}  // namespace sdnn::estimators
