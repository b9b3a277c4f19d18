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
#include <utility>
#include <vector>

#include "sdnn/approximators/detail/column_sums.hpp"
#include "sdnn/approximators/detail/high_bytes.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/errors.hpp"

namespace sdnn::approximators {

/// A layer of n units with potentials h_i = w_i . x_SD - w_i0, whose weights and thresholds are
/// integers.
///
/// Every sum is exact, so its order does not matter. The units form blocks of 64; a block stores
/// its weights by columns (a cache line has the weights of 64 hidden units for an input unit),
/// because a pass reads only the columns that are not neutral.
///
/// A weight is a low byte, -127 to 127, plus 128 times a *high byte*, which lies in a second array
/// of the same layout. In training most high bytes are 0. Each block therefore lists the others,
/// and a pass reads the list in place of the array. A correction throws and changes nothing if a
/// weight would exceed two bytes, or a potential 32 bits.
///
/// Source: section 3.1 (layer 4, z) and Eqs. (2), (3).
class HiddenLayer {
 public:
  static constexpr std::size_t kBlockUnits = approximators::kBlockUnits;
  /// The largest |weight| that fits into a low and a high byte.
  static constexpr std::int32_t kWeightLimit = 127 * 128 + 127;

  /// Sets all weights and thresholds to zero. Each of the first `n_double` columns is half of the
  /// sum or difference of two inputs, so that a correction moves its weights by twice the step.
  /// Throws std::invalid_argument, std::bad_alloc.
  HiddenLayer(std::size_t n_units, std::size_t n_columns, std::size_t n_double = 0)
      : n_units_(n_units), n_columns_(n_columns), n_double_(n_double) {
    core::require_in_range("n_units", n_units, 1, std::size_t{1} << 20);
    core::require_in_range("n_columns", n_columns, 1, std::size_t{1} << 27);
    core::require_in_range("n_double", n_double, 0, n_columns);
    weight_limit_ =
        static_cast<std::int32_t>(std::min<std::size_t>(kWeightLimit, kThresholdLimit / n_columns));
    n_blocks_ = core::round_up(n_units, kBlockUnits) / kBlockUnits;
    const std::size_t n_bytes = core::checked_product(n_blocks_, block_bytes());
    bytes_ = core::AlignedBuffer<std::int8_t>(n_bytes);
    high_bytes_ = core::AlignedBuffer<std::int8_t>(n_bytes);
    // With more listed bytes in a block than a quarter of its columns, a chosen number, a pass adds
    // whole columns of high bytes.
    high_lists_ = HighByteLists(n_blocks_, n_columns / 4);
    may_have_high_.assign(n_units, 0);
    thresholds_.assign(n_units, 0);
    largest_weight_.assign(n_units, 0);
    group_of_block_.assign(n_blocks_, kLargestGroup);
    high_group_of_block_.assign(n_blocks_, kLargestGroup);
  }

  std::size_t n_units() const noexcept { return n_units_; }
  std::size_t n_columns() const noexcept { return n_columns_; }
  std::size_t n_double_columns() const noexcept { return n_double_; }
  std::size_t n_blocks() const noexcept { return n_blocks_; }
  /// The number of high bytes other than 0.
  std::size_t n_high_bytes() const noexcept { return high_lists_.size(); }
  /// The largest |weight| that does not cause std::overflow_error.
  std::int32_t weight_limit() const noexcept { return weight_limit_; }

  std::int32_t weight(std::size_t unit, std::size_t column) const noexcept {
    const std::size_t at = byte_index(unit, column);
    return bytes_[at] + (may_have_high_[unit] ? kHighByte * high_bytes_[at] : 0);
  }
  std::int32_t threshold(std::size_t unit) const noexcept { return thresholds_[unit]; }
  /// Returns the weights of the 64 units of a block for a column; those beyond n_units() are 0.
  std::array<std::int32_t, kBlockUnits> weights_of(std::size_t block,
                                                   std::size_t column) const noexcept {
    std::array<std::int32_t, kBlockUnits> weights;
    const std::size_t at = byte_index(block * kBlockUnits, column);
    for (std::size_t i = 0; i < kBlockUnits; ++i) weights[i] = std::int32_t{bytes_[at + i]};
    if (high_lists_.size_of(block) == 0) return weights;
    for (std::size_t i = 0; i < kBlockUnits; ++i) weights[i] += kHighByte * high_bytes_[at + i];
    return weights;
  }

  /// Throws std::invalid_argument if |value| exceeds weight_limit().
  void set_weight(std::size_t unit, std::size_t column, std::int32_t value) {
    core::require_in_range("weight", value, -weight_limit_, weight_limit_);
    if (std::abs(value) > largest_weight_[unit]) note_largest(unit, std::abs(value));
    // The array of high bytes is written only if that is needed. Writing a page of each array in
    // turn would be slow, because these pages share cache sets.
    if (may_have_high_[unit]) set_high_byte(unit, column, 0);
    store(unit, column, value);
  }
  /// Adds sign * changes[i] to the weight of every unit i for a column. Shape: changes (n,). Throws
  /// std::invalid_argument if a weight would exceed weight_limit(); units before it have changed.
  void add_to_column(std::size_t column, std::span<const std::int32_t> changes, int sign) {
    assert(changes.size() == n_units_);
    const std::int32_t limit = std::min(kByteLimit, weight_limit_);
    for (std::size_t unit = 0; unit < n_units_; ++unit) {
      const std::size_t at = byte_index(unit, column);
      std::int8_t& byte = bytes_[at];
      const std::int32_t value = byte + sign * changes[unit];
      if (std::abs(value) > limit || (may_have_high_[unit] && high_bytes_[at] != 0)) {
        set_weight(unit, column, weight(unit, column) + sign * changes[unit]);
        continue;
      }
      byte = static_cast<std::int8_t>(value);
      if (std::abs(value) > largest_weight_[unit]) note_largest(unit, std::abs(value));
    }
  }
  /// Whether a value may be a threshold: its magnitude is below 2^30.
  static constexpr bool is_threshold(std::int32_t value) noexcept {
    return value >= -kThresholdLimit && value <= kThresholdLimit;
  }
  /// Throws std::invalid_argument if |value| reaches 2^30.
  void set_threshold(std::size_t unit, std::int32_t value) {
    core::require_in_range("threshold", value, -kThresholdLimit, kThresholdLimit);
    thresholds_[unit] = value;
  }

  /// Writes to all memory that learning may need, so that the operating system provides its pages
  /// now and not during a decision. It changes no value.
  void touch_memory() noexcept {
    constexpr std::size_t kPage = 4096;
    for (std::size_t at = 0; at < high_bytes_.size(); at += kPage) {
      std::int8_t volatile& byte = high_bytes_[at];
      byte = byte;
    }
    high_lists_.touch_memory();
  }

  /// Writes the inner potentials of all units for the ternary input with these columns. Shape: out
  /// (n,).
  void potentials(const coding::SignedColumns& input, std::span<std::int32_t> out) const {
    assert(out.size() == n_units_);
    for (std::size_t i = 0; i < n_units_; ++i) out[i] = -thresholds_[i];
    add(input, out);
  }

  /// Adds w_i . x to out_i for the input with these columns, which may be repeated.
  void add(const coding::SignedColumns& input, std::span<std::int32_t> out) const {
    add_signed(input.plus, +1, out);
    add_signed(input.minus, -1, out);
    if (n_high_bytes() > 0) add_listed_high_bytes(input, out);
  }

  /// Whether update, with this input and step, would keep the |weights| of the unit within `limit`.
  bool has_room(std::size_t unit, const coding::SignedColumns& input, std::int32_t step,
                std::int32_t limit) const {
    return largest_weight_[unit] + growth(step) <= limit ||
           fits(unit, changes_of(input, step), limit);
  }

  /// Adds step * x to w_i, twice as much in double columns, and subtracts step from w_i0, for every
  /// i in `units`. No unit and no column may be repeated, and double columns precede others in the
  /// input's lists.
  ///
  /// Source: Eqs. (2), (3). Throws std::overflow_error before any change if a weight or threshold
  /// would leave its range. Requires |step| <= 64. It is fastest for `units` in rising order.
  void update(std::span<const std::uint32_t> units, const coding::SignedColumns& input,
              std::int32_t step) {
    const std::array<ColumnChange, 4> changes = changes_of(input, step);
    for (const std::uint32_t unit : units) require_room(unit, changes, step);
    for (std::size_t k = 0; k < units.size();) {  // neighbours in a block share its cache lines
      const std::size_t block = units[k] / kBlockUnits;
      // Units with high bytes, or whose low bytes could overflow, are changed one by one; the
      // others of the block have -1 in the mask. Their number is counted, and the last of them
      // kept.
      detail::Bytes mask{};
      std::size_t n_changed = 0, changed = 0;
      for (; k < units.size() && units[k] / kBlockUnits == block; ++k) {
        const std::size_t unit = units[k];
        raise_bound(unit, growth(step));
        thresholds_[unit] -= step;
        if (largest_weight_[unit] <= kByteLimit && !may_have_high_[unit]) {
          mask[unit % kBlockUnits] = -1;
          changed = unit;
          ++n_changed;
        } else {
          for (const ColumnChange& change : changes) add_with_high_bytes(unit, change);
        }
      }
      for (const ColumnChange& change : changes) {
        if (n_changed == 1) add_to_unit(changed, change);
        if (n_changed > 1) add_to_units(block, change, mask);
      }
    }
  }

 private:
  static constexpr std::int32_t kThresholdLimit = (std::int32_t{1} << 30) - 1;
  static constexpr std::int32_t kByteLimit = 127;
  static constexpr std::int32_t kHighByte = 128;
  static constexpr int kLargestGroup = 4;  // columns that a pass may add in 8 bits; see add_columns

  std::size_t byte_index(std::size_t unit, std::size_t column) const noexcept {
    return unit / kBlockUnits * block_bytes() + column * kBlockUnits + unit % kBlockUnits;
  }

  /// The bytes of a block: its columns, and a column of zeros, for the padding of lists of columns.
  std::size_t block_bytes() const noexcept { return (n_columns_ + 1) * kBlockUnits; }

  /// Adds sign * the weights of the columns to out_i, except for high bytes that are in lists.
  void add_signed(std::span<const std::uint32_t> columns, int sign,
                  std::span<std::int32_t> out) const {
    while (!columns.empty()) {
      const auto some = columns.first(std::min(ColumnPlaces::kMost, columns.size()));
      columns = columns.subspan(some.size());
      const ColumnPlaces places(some, n_columns_);
      for (std::size_t b = 0; b < n_blocks_; ++b) {
        alignas(core::kCacheLine) std::array<std::int32_t, kBlockUnits> padded;
        const std::size_t first = b * kBlockUnits;
        const bool whole = first + kBlockUnits <= n_units_;
        if (!whole) padded.fill(0);
        std::int32_t* const sums = whole ? out.data() + first : padded.data();
        add_columns(bytes_.data() + b * block_bytes(), places, group_of_block_[b], sign, sums);
        if (high_lists_.is_overfull(b)) {
          add_columns(high_bytes_.data() + b * block_bytes(), places, high_group_of_block_[b],
                      sign * kHighByte, sums);
        }
        for (std::size_t i = first; !whole && i < n_units_; ++i) out[i] += padded[i - first];
      }
    }
  }

  /// Adds 128 times the high bytes that are in lists, each as often as the input has its column.
  /// The columns are counted in ranges of 8192, so that the counts need a fixed array on the stack.
  void add_listed_high_bytes(const coding::SignedColumns& input,
                             std::span<std::int32_t> out) const {
    std::array<std::int16_t, 8192> counts;
    for (std::size_t first = 0; first < n_columns_; first += counts.size()) {
      const std::size_t n = std::min(counts.size(), n_columns_ - first);
      std::fill_n(counts.begin(), n, std::int16_t{0});
      // Columns below `first` wrap around to large numbers, so one comparison excludes both sides.
      const auto count = [&](std::span<const std::uint32_t> columns, int change) {
        for (const std::uint32_t column : columns) {
          if (column - first >= n) continue;
          std::int16_t& of_column = counts[column - first];
          of_column = static_cast<std::int16_t>(of_column + change);
        }
      };
      count(input.plus, +1);
      count(input.minus, -1);
      for (std::size_t b = 0; b < n_blocks_; ++b) {
        for (const HighByte& high : high_lists_.of(b)) {
          if (high.column - first >= n) continue;
          out[b * kBlockUnits + high.unit] += kHighByte * high.value * counts[high.column - first];
        }
      }
    }
  }

  /// The columns of an input whose weights a correction changes equally.
  struct ColumnChange {
    std::span<const std::uint32_t> columns;
    std::int32_t amount;
  };

  /// Splits the columns of an input by the change of their weights: double columns change twice as
  /// much, and those with a minus sign by the negative.
  std::array<ColumnChange, 4> changes_of(const coding::SignedColumns& input,
                                         std::int32_t step) const {
    const auto split = [this](std::span<const std::uint32_t> columns) {
      const auto end = std::partition_point(columns.begin(), columns.end(),
                                            [this](std::uint32_t j) { return j < n_double_; });
      return static_cast<std::size_t>(end - columns.begin());
    };
    const std::size_t n_plus = split(input.plus);
    const std::size_t n_minus = split(input.minus);
    return {{{input.plus.first(n_plus), 2 * step},
             {input.minus.first(n_minus), -2 * step},
             {input.plus.subspan(n_plus), step},
             {input.minus.subspan(n_minus), -step}}};
  }

  /// The largest growth of a unit's largest weight by a correction.
  std::int32_t growth(std::int32_t step) const noexcept {
    return std::abs(step) * (n_double_ > 0 ? 2 : 1);
  }

  /// Adds the change to the low bytes of a unit's weights, which must not overflow.
  void add_to_unit(std::size_t unit, const ColumnChange& change) noexcept {
    std::int8_t* const lane = bytes_.data() + byte_index(unit, 0);
    for (const std::uint32_t column : change.columns) {
      std::int8_t& weight = lane[std::size_t{column} * kBlockUnits];
      weight = static_cast<std::int8_t>(weight + change.amount);
    }
  }

  /// Adds the change to the low bytes of the units of a block whose mask is -1. Bytes are added
  /// modulo 256, but none overflows, as the units' bounds have shown.
  void add_to_units(std::size_t block, const ColumnChange& change, detail::Bytes mask) noexcept {
    // A mask of -1, all ones, becomes the amount, and a mask of 0 stays 0.
    for (std::int8_t& byte : mask) byte = static_cast<std::int8_t>(byte & change.amount);
    add_to_columns(bytes_.data() + block * block_bytes(), change.columns.data(),
                   change.columns.size(), mask);
  }

  /// Adds the change to a unit's weights, with a carry into their high bytes.
  void add_with_high_bytes(std::size_t unit, const ColumnChange& change) noexcept {
    for (const std::uint32_t column : change.columns) {
      store(unit, column, bytes_[byte_index(unit, column)] + change.amount);
    }
  }

  /// Sets the low byte of a weight to `value`; if that does not fit, the multiple of 128 that is
  /// nearest towards 0 is carried into the high byte.
  void store(std::size_t unit, std::size_t column, std::int32_t value) noexcept {
    const std::size_t at = byte_index(unit, column);
    if (std::abs(value) > kByteLimit) {
      const std::int32_t change = value / kHighByte;
      value -= change * kHighByte;
      may_have_high_[unit] = 1;
      set_high_byte(unit, column, high_bytes_[at] + change);
    }
    bytes_[at] = static_cast<std::int8_t>(value);
  }

  /// Sets the high byte of a weight, also in the list of high bytes that are not 0.
  void set_high_byte(std::size_t unit, std::size_t column, std::int32_t value) noexcept {
    std::int8_t& byte = high_bytes_[byte_index(unit, column)];
    const HighByte high{static_cast<std::uint32_t>(column),
                        static_cast<std::uint8_t>(unit % kBlockUnits),
                        static_cast<std::int8_t>(value)};
    high_lists_.change(unit / kBlockUnits, byte, high);
    byte = high.value;
  }

  /// Finds the largest |weight| of a unit, column by column.
  std::int32_t largest_weight(std::size_t unit) const noexcept {
    std::int32_t largest = 0;
    for (std::size_t j = 0; j < n_columns_; ++j) {
      largest = std::max(largest, std::abs(weight(unit, j)));
    }
    return largest;
  }

  /// Sets the bound of a unit's weights. If it is too large for the number of columns of its block
  /// that are added in 8 bits, that number is halved until their sum fits; it never grows again.
  void note_largest(std::size_t unit, std::int32_t bound) noexcept {
    largest_weight_[unit] = bound;
    const auto narrow = [](int& group, std::int32_t limit) {
      while (group > 1 && limit > kByteLimit / group) group /= 2;
    };
    narrow(group_of_block_[unit / kBlockUnits], bound);
    narrow(high_group_of_block_[unit / kBlockUnits], (bound + kByteLimit) / kHighByte);
  }

  /// Throws std::overflow_error unless the correction keeps the unit in range. The cheap test comes
  /// first: the stored bound. It grows with each correction, so where it reaches the limit the true
  /// maximum replaces it. Where that reaches the limit too, the corrected weights are computed, so
  /// that a correction towards 0 is always possible.
  void require_room(std::size_t unit, std::span<const ColumnChange> changes, std::int32_t step) {
    const std::int32_t room = weight_limit_ - growth(step);
    if (largest_weight_[unit] > room) largest_weight_[unit] = largest_weight(unit);
    if ((largest_weight_[unit] > room && !fits(unit, changes, weight_limit_)) ||
        std::abs(thresholds_[unit] - step) > kThresholdLimit) {
      core::fail(std::overflow_error(
          "a weight or threshold of hidden unit " + std::to_string(unit) +
          " would exceed its range (|weight| <= " + std::to_string(weight_limit_) + " steps)"));
    }
  }

  /// Whether all changed weights of a unit would be at most `limit` in size.
  bool fits(std::size_t unit, std::span<const ColumnChange> changes, std::int32_t limit) const {
    return std::ranges::all_of(changes, [&](const ColumnChange& change) {
      return std::ranges::all_of(change.columns, [&](std::uint32_t j) {
        return std::abs(weight(unit, j) + change.amount) <= limit;
      });
    });
  }

  /// Raises the unit's bound by `growth`. Bounds above 127 / 4, 127 / 2 and 127 make passes slower,
  /// so before the bound crosses such a limit, the true maximum is computed. If that is within an
  /// eighth of the limit, the bound crosses it all the same, because the maximum would soon have to
  /// be computed again.
  void raise_bound(std::size_t unit, std::int32_t growth) {
    const std::int32_t before = largest_weight_[unit];
    std::int32_t bound = before + growth;
    for (int group = group_of_block_[unit / kBlockUnits]; group >= 1; group /= 2) {
      const std::int32_t limit = kByteLimit / group;
      if (before > limit || bound <= limit) continue;
      const std::int32_t looked_up = look_up(unit, growth) + growth;
      bound = looked_up <= limit - limit / 8 ? looked_up : std::max(looked_up, limit + 1);
    }
    note_largest(unit, bound);
  }

  /// Computes the largest |weight| of a unit before a correction. The same pass lowers the bounds
  /// of all units of its block, with `growth` added, as some may be corrected in the same update.
  std::int32_t look_up(std::size_t unit, std::int32_t growth) {
    if (may_have_high_[unit]) return largest_weight(unit);
    const std::size_t block = unit / kBlockUnits;
    detail::Bytes largest;
    find_largest_bytes(bytes_.data() + block * block_bytes(), n_columns_, largest);
    const std::size_t first = block * kBlockUnits;
    for (std::size_t i = first; i < std::min(first + kBlockUnits, n_units_); ++i) {
      if (may_have_high_[i]) continue;
      largest_weight_[i] = std::min(largest_weight_[i], largest[i - first] + growth);
    }
    return largest[unit - first];
  }

  std::size_t n_units_;
  std::size_t n_columns_;
  std::size_t n_double_;
  std::size_t n_blocks_ = 0;
  std::int32_t weight_limit_;
  core::AlignedBuffer<std::int8_t> bytes_;       ///< [block][column, then zeros][unit in block]
  core::AlignedBuffer<std::int8_t> high_bytes_;  ///< laid out as `bytes_`; they count 128
  HighByteLists high_lists_;
  std::vector<std::uint8_t> may_have_high_;  ///< whether a unit ever had a high byte
  std::vector<std::int32_t> thresholds_;
  std::vector<std::int32_t> largest_weight_;  ///< an upper bound of max_j |w_ij|
  std::vector<int> group_of_block_;           ///< columns of a block that may be added in 8 bits
  std::vector<int> high_group_of_block_;      ///< for high bytes, columns to be added in 8 bits
};

}  // namespace sdnn::approximators
