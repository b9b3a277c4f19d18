/// The hidden layer: threshold units with exact integer weights on a ternary code.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdnn/approximators/column_sums.hpp"
#include "sdnn/coding/desensitization.hpp"
#include "sdnn/core/aligned_buffer.hpp"
#include "sdnn/core/check.hpp"

namespace sdnn::approximators {

/// n units h_i = w_i . x_SD - w_i0 whose weights and thresholds are integers.
///
/// Every sum is exact, so its order does not matter. The units come in blocks of 64; a block holds
/// its weights column by column (one cache line: one input unit, 64 hidden units), because a pass
/// reads only the columns that are not neutral. A weight is one byte; a unit one of whose weights
/// might leave a byte moves to a row of its own, two bytes a weight. A correction that would leave
/// those, or carry a potential out of 32 bits, throws and changes nothing.
///
/// Source: section 3.1 (layer 4, z) and Eqs. (2), (3).
class ParallelPerceptron {
 public:
  /// All weights and thresholds zero. Throws std::invalid_argument, std::bad_alloc.
  ParallelPerceptron(std::size_t n_units, std::size_t n_columns)
      : n_units_(n_units), n_columns_(n_columns) {
    core::require_in_range("n_units", n_units, 1, std::size_t{1} << 20);
    core::require_in_range("n_columns", n_columns, 1, std::size_t{1} << 27);
    weight_limit_ = static_cast<std::int32_t>(
        std::min<std::size_t>(32767, kThresholdLimit / n_columns));
    n_blocks_ = core::round_up(n_units, kBlockUnits) / kBlockUnits;
    narrow_ = core::AlignedBuffer<std::int8_t>(n_blocks_ * n_columns * kBlockUnits);
    wide_ = core::AlignedBuffer<std::int16_t>(n_units * n_columns);  // untouched until needed
    is_wide_.assign(n_units, 0);
    thresholds_.assign(n_units, 0);
    largest_weight_.assign(n_units, 0);
    group_of_block_.assign(n_blocks_, kLargestGroup);
  }

  std::size_t n_units() const noexcept { return n_units_; }
  std::size_t n_columns() const noexcept { return n_columns_; }
  /// How many units have needed two bytes a weight.
  std::size_t n_wide_units() const noexcept { return n_wide_units_; }
  /// The largest |weight| that is held before std::overflow_error.
  std::int32_t weight_limit() const noexcept { return weight_limit_; }

  std::int32_t weight(std::size_t unit, std::size_t column) const noexcept {
    return is_wide_[unit] ? std::int32_t{wide_[unit * n_columns_ + column]}
                          : std::int32_t{narrow_[narrow_index(unit, column)]};
  }
  std::int32_t threshold(std::size_t unit) const noexcept { return thresholds_[unit]; }

  /// Throws std::invalid_argument if |value| exceeds weight_limit().
  void set_weight(std::size_t unit, std::size_t column, std::int32_t value) {
    core::require_in_range("weight", value, -weight_limit_, weight_limit_);
    const std::int32_t size = std::abs(value);
    if (size > largest_weight_[unit]) {
      if (size > kByteLimit && !is_wide_[unit]) promote(unit);
      note_largest(unit, size);
    }
    if (is_wide_[unit]) {
      wide_[unit * n_columns_ + column] = static_cast<std::int16_t>(value);
    } else {
      narrow_[narrow_index(unit, column)] = static_cast<std::int8_t>(value);
    }
  }
  /// Throws std::invalid_argument if |value| reaches 2^30.
  void set_threshold(std::size_t unit, std::int32_t value) {
    core::require_in_range("threshold", value, -kThresholdLimit, kThresholdLimit);
    thresholds_[unit] = value;
  }

  /// The inner potentials of all units for the ternary input with these columns. Shape: out (n,).
  /// The input's scratch row is overwritten.
  void potentials(coding::SignedColumns& input, std::span<std::int32_t> out) const {
    assert(out.size() == n_units_);
    for (std::size_t i = 0; i < n_units_; ++i) out[i] = -thresholds_[i];
    add(input, out);
  }

  /// out_i += w_i . x for the input with these columns, in which a column may come more than once.
  void add(coding::SignedColumns& input, std::span<std::int32_t> out) const {
    const AddColumns add_columns = add_columns_kernel();
    alignas(core::kCacheLine) std::array<std::int32_t, kBlockUnits> sums;
    for (std::size_t b = 0; b < n_blocks_; ++b) {
      const std::int8_t* const block = narrow_.data() + b * n_columns_ * kBlockUnits;
      sums.fill(0);
      add_columns(block, input.positive, group_of_block_[b], +1, sums.data());
      add_columns(block, input.negative, group_of_block_[b], -1, sums.data());
      const std::size_t first = b * kBlockUnits;
      const std::size_t n = std::min(kBlockUnits, n_units_ - first);
      for (std::size_t i = 0; i < n; ++i) out[first + i] += sums[i];
    }
    if (n_wide_units_ == 0) return;
    if (input.positive.size() + input.negative.size() < n_columns_ / 8) {
      add_wide(out, [&](const std::int16_t* row) {
        std::int32_t sum = 0;
        for (const std::uint32_t column : input.positive) sum += row[column];
        for (const std::uint32_t column : input.negative) sum -= row[column];
        return sum;
      });
    } else {  // dense: a product of two rows is quicker than picking half of one
      std::vector<std::int16_t>& signs = input.signs;
      signs.assign(n_columns_, 0);
      for (const std::uint32_t column : input.positive) ++signs[column];
      for (const std::uint32_t column : input.negative) --signs[column];
      add_wide(out, [&](const std::int16_t* row) {
        std::int32_t sum = 0;
        for (std::size_t j = 0; j < n_columns_; ++j) sum += row[j] * signs[j];
        return sum;
      });
    }
  }

  /// w_i += step * x and w_i0 -= step for every i in `units`; no column may come twice.
  ///
  /// Source: Eqs. (2), (3). Throws std::overflow_error before any change if a weight or threshold
  /// would leave its range.
  void correct(std::span<const std::uint32_t> units, const coding::SignedColumns& input,
               std::int32_t step) {
    for (const std::uint32_t unit : units) require_room(unit, input, step);
    for (const std::uint32_t unit : units) {
      make_room(unit, std::abs(step));
      if (is_wide_[unit]) {
        std::int16_t* const row = wide_.data() + unit * n_columns_;
        for (const auto j : input.positive) row[j] = static_cast<std::int16_t>(row[j] + step);
        for (const auto j : input.negative) row[j] = static_cast<std::int16_t>(row[j] - step);
      } else {
        std::int8_t* const lane = narrow_.data() + narrow_index(unit, 0);
        for (const auto j : input.positive) {
          std::int8_t& w = lane[std::size_t{j} * kBlockUnits];
          w = static_cast<std::int8_t>(w + step);
        }
        for (const auto j : input.negative) {
          std::int8_t& w = lane[std::size_t{j} * kBlockUnits];
          w = static_cast<std::int8_t>(w - step);
        }
      }
      thresholds_[unit] -= step;
    }
  }

 private:
  static constexpr std::int32_t kThresholdLimit = (std::int32_t{1} << 30) - 1;
  static constexpr std::int32_t kByteLimit = 127;
  static constexpr int kLargestGroup = 4;

  std::size_t narrow_index(std::size_t unit, std::size_t column) const noexcept {
    return (unit / kBlockUnits * n_columns_ + column) * kBlockUnits + unit % kBlockUnits;
  }

  template <class Product>
  void add_wide(std::span<std::int32_t> out, Product&& product) const {
    for (std::size_t unit = 0; unit < n_units_; ++unit) {
      if (is_wide_[unit]) out[unit] += product(wide_.data() + unit * n_columns_);
    }
  }

  std::int32_t largest_weight(std::size_t unit) const noexcept {
    std::int32_t largest = 0;
    for (std::size_t j = 0; j < n_columns_; ++j) {
      largest = std::max(largest, std::abs(weight(unit, j)));
    }
    return largest;
  }

  /// Keeps the bound of a unit, and how many columns of its block may be added in 8 bits.
  void note_largest(std::size_t unit, std::int32_t bound) noexcept {
    largest_weight_[unit] = bound;
    if (is_wide_[unit]) return;
    int& group = group_of_block_[unit / kBlockUnits];
    while (group > 1 && bound > kByteLimit / group) group /= 2;
  }

  /// Moves a unit to two bytes a weight; its bytes become zero, so the sums of its block stay right.
  void promote(std::size_t unit) noexcept {
    for (std::size_t j = 0; j < n_columns_; ++j) {
      std::int8_t& from = narrow_[narrow_index(unit, j)];
      wide_[unit * n_columns_ + j] = from;
      from = 0;
    }
    is_wide_[unit] = 1;
    ++n_wide_units_;
  }

  /// Throws unless the correction keeps the unit in range. The bound kept per unit only grows, so
  /// the true maximum is looked up when the bound gets there, and the corrected weights themselves
  /// when that is at the limit: going back is always possible.
  void require_room(std::size_t unit, const coding::SignedColumns& input, std::int32_t step) {
    const std::int32_t growth = std::abs(step);
    if (largest_weight_[unit] > weight_limit_ - growth) {
      largest_weight_[unit] = largest_weight(unit);
    }
    if ((largest_weight_[unit] > weight_limit_ - growth && !fits(unit, input, step)) ||
        std::abs(thresholds_[unit] - step) > kThresholdLimit) {
      throw std::overflow_error("a weight or threshold of hidden unit " + std::to_string(unit) +
                                " would exceed its range (|weight| <= " +
                                std::to_string(weight_limit_) + " steps)");
    }
  }

  bool fits(std::size_t unit, const coding::SignedColumns& input, std::int32_t step) const {
    const auto stays = [&](const std::vector<std::uint32_t>& columns, std::int32_t change) {
      return std::all_of(columns.begin(), columns.end(), [&](std::uint32_t j) {
        return std::abs(weight(unit, j) + change) <= weight_limit_;
      });
    };
    return stays(input.positive, step) && stays(input.negative, -step);
  }

  /// Raises the unit's bound by `growth`. Where the bound would cost speed or leave a byte, the true
  /// maximum is looked up first; a unit within an eighth of the limit gives up at once, so that
  /// look-ups stay rare.
  void make_room(std::size_t unit, std::int32_t growth) {
    const std::int32_t before = largest_weight_[unit];
    std::int32_t bound = before + growth;
    if (!is_wide_[unit]) {
      for (int group = kLargestGroup; group >= 1; group /= 2) {
        const std::int32_t limit = kByteLimit / group;
        if (before > limit || bound <= limit) continue;
        const std::int32_t looked_up = largest_weight(unit) + growth;
        bound = looked_up <= limit - limit / 8 ? looked_up : std::max(looked_up, limit + 1);
      }
      if (bound > kByteLimit) promote(unit);
    }
    note_largest(unit, bound);
  }

  std::size_t n_units_;
  std::size_t n_columns_;
  std::size_t n_blocks_ = 0;
  std::int32_t weight_limit_;
  core::AlignedBuffer<std::int8_t> narrow_;  ///< [block][column][unit in block]
  core::AlignedBuffer<std::int16_t> wide_;   ///< [unit][column]
  std::vector<std::uint8_t> is_wide_;
  std::size_t n_wide_units_ = 0;
  std::vector<std::int32_t> thresholds_;
  std::vector<std::int32_t> largest_weight_;  ///< an upper bound of max_j |w_ij|
  std::vector<int> group_of_block_;           ///< columns of a block that may be added in 8 bits
};

}  // namespace sdnn::approximators
