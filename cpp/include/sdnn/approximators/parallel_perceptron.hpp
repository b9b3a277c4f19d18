/// The hidden layer: threshold units with exact integer weights on a ternary code.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdnn/coding/desensitization.hpp"
#include "sdnn/core/aligned_buffer.hpp"
#include "sdnn/core/check.hpp"

namespace sdnn::approximators {

/// n units h_i = w_i . x_SD - w_i0 whose weights and thresholds are integers.
///
/// Every sum is exact, so its order does not matter. Weights are stored by column (one input unit,
/// all n hidden units), because a pass reads only the columns that are not neutral. A column holds
/// one byte a weight; the first weight in it that would leave a byte promotes the whole column to
/// two bytes. A correction that would leave those, or carry a potential out of 32 bits, throws and
/// changes nothing.
///
/// Source: section 3.1 (layer 4, z) and Eqs. (2), (3).
class ParallelPerceptron {
 public:
  /// All weights and thresholds zero. Throws std::invalid_argument, std::bad_alloc.
  ParallelPerceptron(std::size_t n_units, std::size_t n_columns)
      : n_units_(n_units), n_columns_(n_columns) {
    core::require_in_range("n_units", n_units, 1, std::size_t{1} << 20);
    core::require_in_range("n_columns", n_columns, 1, std::size_t{1} << 27);
    stride_ = core::round_up(n_units, core::kCacheLine);
    weight_limit_ = static_cast<std::int32_t>(
        std::min<std::size_t>(32767, kThresholdLimit / n_columns));
    narrow_ = core::AlignedBuffer<std::int8_t>(stride_ * n_columns);
    wide_ = core::AlignedBuffer<std::int16_t>(stride_ * n_columns);  // untouched until needed
    is_wide_.assign(n_columns, false);
    thresholds_.assign(n_units, 0);
    largest_weight_.assign(n_units, 0);
  }

  std::size_t n_units() const noexcept { return n_units_; }
  std::size_t n_columns() const noexcept { return n_columns_; }
  /// How many columns have needed two bytes a weight.
  std::size_t n_wide_columns() const noexcept { return n_wide_columns_; }
  /// The largest |weight| that is held before std::overflow_error.
  std::int32_t weight_limit() const noexcept { return weight_limit_; }

  std::int32_t weight(std::size_t unit, std::size_t column) const noexcept {
    const std::size_t at = column * stride_ + unit;
    return is_wide_[column] ? std::int32_t{wide_[at]} : std::int32_t{narrow_[at]};
  }
  std::int32_t threshold(std::size_t unit) const noexcept { return thresholds_[unit]; }

  /// Throws std::invalid_argument if |value| exceeds weight_limit().
  void set_weight(std::size_t unit, std::size_t column, std::int32_t value) {
    core::require_in_range("weight", value, -weight_limit_, weight_limit_);
    store(unit, column, value);
    largest_weight_[unit] = std::max(largest_weight_[unit], std::abs(value));
  }
  /// Throws std::invalid_argument if |value| reaches 2^30.
  void set_threshold(std::size_t unit, std::int32_t value) {
    core::require_in_range("threshold", value, -kThresholdLimit, kThresholdLimit);
    thresholds_[unit] = value;
  }

  /// The inner potentials of all units for the ternary input with these columns. Shape: out (n,).
  void potentials(const coding::SignedColumns& input, std::span<std::int32_t> out) const noexcept {
    assert(out.size() == n_units_);
    for (std::size_t i = 0; i < n_units_; ++i) out[i] = -thresholds_[i];
    add_columns<+1>(input.positive, out);
    add_columns<-1>(input.negative, out);
  }

  /// w_i += step * x and w_i0 -= step for every i in `units`.
  ///
  /// Source: Eqs. (2), (3). Throws std::overflow_error before any change if a weight or threshold
  /// would leave its range.
  void correct(std::span<const std::uint32_t> units, const coding::SignedColumns& input,
               std::int32_t step) {
    for (const std::uint32_t unit : units) require_room(unit, step);
    for (const std::uint32_t column : input.positive) add(units, column, step);
    for (const std::uint32_t column : input.negative) add(units, column, -step);
    for (const std::uint32_t unit : units) {
      thresholds_[unit] -= step;
      largest_weight_[unit] += std::abs(step);
    }
  }

 private:
  static constexpr std::int32_t kThresholdLimit = (std::int32_t{1} << 30) - 1;
  static constexpr std::size_t kTile = 1024;       ///< units summed at a time, in first-level cache
  static constexpr std::size_t kFlushAfter = 256;  ///< byte columns that 16-bit sums can hold

  void add(std::span<const std::uint32_t> units, std::uint32_t column, std::int32_t change) {
    for (const std::uint32_t unit : units) store(unit, column, weight(unit, column) + change);
  }

  void store(std::size_t unit, std::size_t column, std::int32_t value) {
    const std::size_t at = column * stride_ + unit;
    if (!is_wide_[column] && std::abs(value) > 127) promote(column);
    if (is_wide_[column]) {
      wide_[at] = static_cast<std::int16_t>(value);
    } else {
      narrow_[at] = static_cast<std::int8_t>(value);
    }
  }

  /// Moves a column to two bytes a weight; its byte column becomes zero, so sums stay right.
  void promote(std::size_t column) noexcept {
    std::int8_t* const from = narrow_.data() + column * stride_;
    std::copy_n(from, n_units_, wide_.data() + column * stride_);
    std::fill_n(from, n_units_, std::int8_t{0});
    is_wide_[column] = true;
    ++n_wide_columns_;
  }

  /// Throws unless one more correction of `unit` stays in range. The bound kept per unit only
  /// grows, so the exact maximum is looked up when the bound is reached.
  void require_room(std::size_t unit, std::int32_t step) {
    const std::int32_t growth = std::abs(step);
    if (largest_weight_[unit] > weight_limit_ - growth) {
      std::int32_t largest = 0;
      for (std::size_t j = 0; j < n_columns_; ++j) {
        largest = std::max(largest, std::abs(weight(unit, j)));
      }
      largest_weight_[unit] = largest;
    }
    if (largest_weight_[unit] > weight_limit_ - growth ||
        std::abs(thresholds_[unit]) > kThresholdLimit - growth) {
      throw std::overflow_error("a weight or threshold of hidden unit " + std::to_string(unit) +
                                " would exceed its range (|weight| <= " +
                                std::to_string(weight_limit_) + " steps)");
    }
  }

  template <int Sign>
  void add_columns(const std::vector<std::uint32_t>& columns,
                   std::span<std::int32_t> out) const noexcept {
    for (std::size_t first = 0; first < n_units_; first += kTile) {
      const std::size_t n = std::min(kTile, n_units_ - first);
      for (std::size_t begin = 0; begin < columns.size(); begin += kFlushAfter) {
        const std::size_t end = std::min(begin + kFlushAfter, columns.size());
        alignas(core::kCacheLine) std::array<std::int16_t, kTile> sums{};
        std::size_t c = begin;
        for (; c + 4 <= end; c += 4) {
          const std::int8_t* const w0 = narrow_.data() + columns[c] * stride_ + first;
          const std::int8_t* const w1 = narrow_.data() + columns[c + 1] * stride_ + first;
          const std::int8_t* const w2 = narrow_.data() + columns[c + 2] * stride_ + first;
          const std::int8_t* const w3 = narrow_.data() + columns[c + 3] * stride_ + first;
          for (std::size_t i = 0; i < n; ++i) {
            sums[i] = static_cast<std::int16_t>(sums[i] + w0[i] + w1[i] + w2[i] + w3[i]);
          }
        }
        for (; c < end; ++c) {
          const std::int8_t* const w = narrow_.data() + columns[c] * stride_ + first;
          for (std::size_t i = 0; i < n; ++i) sums[i] = static_cast<std::int16_t>(sums[i] + w[i]);
        }
        for (std::size_t i = 0; i < n; ++i) out[first + i] += Sign * sums[i];
      }
    }
    if (n_wide_columns_ == 0) return;
    for (const std::uint32_t column : columns) {
      if (!is_wide_[column]) continue;
      const std::int16_t* const w = wide_.data() + column * stride_;
      for (std::size_t i = 0; i < n_units_; ++i) out[i] += Sign * w[i];
    }
  }

  std::size_t n_units_;
  std::size_t n_columns_;
  std::size_t stride_;
  std::int32_t weight_limit_;
  core::AlignedBuffer<std::int8_t> narrow_;
  core::AlignedBuffer<std::int16_t> wide_;
  std::vector<bool> is_wide_;
  std::size_t n_wide_columns_ = 0;
  std::vector<std::int32_t> thresholds_;
  std::vector<std::int32_t> largest_weight_;  ///< an upper bound of max_j |w_ij|
};

}  // namespace sdnn::approximators
