/// Sums of some rows minus the sum of others: how corrections reach potentials and weights.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdnn/core/detail/integer_register.hpp"
#include "sdnn/core/detail/kernel.hpp"

namespace sdnn::estimators {

/// Rows to add and rows to subtract.
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

/// `Registers` registers' worth of entries at `at`, of the rows [p, p_end) and [m, m_end).
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

}  // namespace detail

/// to[i] += sum of row[offset + i] over the rows to add, minus that over those to subtract.
///
/// At most `n_per_sum` (> 0) entries are added in their own type before their sum is widened.
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

}  // namespace sdnn::estimators
