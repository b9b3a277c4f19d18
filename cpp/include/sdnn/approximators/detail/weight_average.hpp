/// The average of a hidden layer's weights during learning, and the layer with these weights.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/approximators/detail/activation_cache.hpp"
#include "sdnn/approximators/detail/paired_weights.hpp"
#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"

namespace sdnn::approximators {

/// A moving average of weights and thresholds whose window grows with the number of corrections.
///
/// After n corrections the weights after correction t have a weight of about (t / n)^7: the average
/// forgets early weights and smooths late oscillations. A unit then has the sign of the mean of its
/// recent potentials. A snapshot is taken every `interval` corrections, or every n / 64 if that is
/// more. It moves the average by 2^-k of the way to the present weights; k is chosen such that 2^-k
/// is about 8 d / n, d being the number of corrections since the last snapshot.
///
/// All numbers are integers, so equal corrections give equal bits. An averaged weight has 16 bits,
/// of which 14 are a fraction of a lattice step, or fewer if a weight needs more bits for whole
/// steps.
///
/// Source: Polyak, B., Juditsky, A. (1992). Acceleration of stochastic approximation by averaging;
/// Shamir, O., Zhang, T. (2013). Stochastic gradient descent for non-smooth optimization, section
/// 4 (polynomial-decay averaging, with eta about 7).
class WeightAverage {
 public:
  static constexpr int kFractionBits = 14;  ///< of thresholds, and of weights while they are small

  /// Makes an average without snapshots of a layer of this size; `interval` is the number of
  /// corrections between the first snapshots.
  WeightAverage(const HiddenLayer& layer, int interval)
      : n_units_(layer.n_units()),
        n_columns_(layer.n_columns()),
        interval_(static_cast<std::uint64_t>(interval)),
        due_(interval_),
        weights_(layer.n_blocks() * n_columns_ * HiddenLayer::kBlockUnits),
        thresholds_(n_units_) {}

  /// Returns the memory of an average.
  static constexpr double n_bytes(double n_units, double n_columns) noexcept {
    return n_units * (sizeof(std::int16_t) * n_columns + sizeof(std::int64_t));
  }

  /// The number of snapshots in the average; 0 before the first one.
  std::uint64_t n_snapshots() const noexcept { return n_snapshots_; }

  /// Takes a snapshot if it is due after this number of corrections; returns whether it was taken.
  bool note(std::uint64_t n_corrections, const HiddenLayer& layer) {
    if (n_corrections < due_) return false;
    add(layer, shift_at(n_corrections));
    due_ = n_corrections + std::max(interval_, n_corrections >> kLogSnapshots);
    return true;
  }

  /// Resets the average after the layer's weights were replaced.
  void forget(std::uint64_t n_corrections) noexcept {
    n_snapshots_ = 0;
    fraction_bits_ = kFractionBits;
    due_ = n_corrections + interval_;
  }

  int fraction_bits() const noexcept { return fraction_bits_; }
  /// The average of a weight, in units of 2^-fraction_bits() lattice steps.
  std::int16_t weight(std::size_t unit, std::size_t column) const noexcept {
    return weights_[index(unit, column)];
  }
  /// The average of a threshold, in units of 2^-14 lattice steps.
  std::int64_t threshold(std::size_t unit) const noexcept { return thresholds_[unit]; }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::vector<std::int16_t> weights(self.n_units_ * self.n_columns_);
    if constexpr (!Archive::kReads) {
      for (std::size_t unit = 0; unit < self.n_units_; ++unit) {
        for (std::size_t j = 0; j < self.n_columns_; ++j) {
          weights[unit * self.n_columns_ + j] = self.weight(unit, j);
        }
      }
    }
    archive.fixed("weights", {self.n_units_, self.n_columns_}, weights);
    archive.fixed("thresholds", {self.n_units_}, self.thresholds_);
    archive.number("fraction_bits", self.fraction_bits_);
    archive.number("n_snapshots", self.n_snapshots_);
    archive.number("due", self.due_);
    if constexpr (Archive::kReads) {
      archive.expect(
          self.fraction_bits_ >= kFewestFractionBits && self.fraction_bits_ <= kFractionBits,
          "fraction_bits", "in [1, 14]");
      for (const std::int64_t threshold : self.thresholds_) {
        archive.expect(threshold >= -kLargestThreshold && threshold <= kLargestThreshold,
                       "thresholds", "averages of thresholds");
      }
      for (std::size_t unit = 0; unit < self.n_units_; ++unit) {
        for (std::size_t j = 0; j < self.n_columns_; ++j) {
          self.weights_[self.index(unit, j)] = weights[unit * self.n_columns_ + j];
        }
      }
    }
  }

 private:
  static constexpr int kLogSnapshots = 6;        // late snapshots are n / 2^6 corrections apart
  static constexpr int kFewestFractionBits = 1;  // every weight fits with these
  static_assert(HiddenLayer::kWeightLimit << kFewestFractionBits <= INT16_MAX);
  static constexpr std::int64_t kLargestThreshold = std::int64_t{1} << (30 + kFractionBits);

  /// Returns the k of a snapshot after `n_corrections`, which moves the average by 2^-k of the way.
  int shift_at(std::uint64_t n_corrections) const noexcept {
    if (n_snapshots_ == 0) return 0;
    const std::uint64_t passed = std::max(interval_, n_corrections >> kLogSnapshots);
    // 2^-k is about 8 passed / n, so k is log2(n / passed) - 3, and bit_width is the logarithm plus
    // 1. The cast is for older libraries, in which bit_width returns an unsigned number.
    return std::max(static_cast<int>(std::bit_width(n_corrections / passed)) - 1 - 3, 0);
  }

  /// Moves the average towards the layer's present weights and thresholds, by a share of 2^-shift.
  void add(const HiddenLayer& layer, int shift) {
    const std::int32_t half = shift > 0 ? 1 << (shift - 1) : 0;
    std::int16_t* average = weights_.data();
    for (std::size_t block = 0; block < layer.n_blocks(); ++block) {
      for (std::size_t column = 0; column < n_columns_; ++column) {
        const auto weights = layer.weights_of(block, column);
        while (!move(average, weights, shift, half)) halve();
        average += weights.size();
      }
    }
    for (std::size_t unit = 0; unit < n_units_; ++unit) {
      const std::int64_t threshold = std::int64_t{layer.threshold(unit)} << kFractionBits;
      thresholds_[unit] += (threshold - thresholds_[unit] + half) >> shift;
    }
    ++n_snapshots_;
  }

  /// Moves the averages of a block's weights for a column by 2^-shift of the way to `weights`;
  /// `half` rounds to the nearest number. Returns false, and changes nothing, if an average would
  /// need more than 16 bits.
  template <class Weights>
  bool move(std::int16_t* average, const Weights& weights, int shift, std::int32_t half) noexcept {
    Weights moved;
    std::int32_t excess = 0;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const std::int32_t before = average[i];
      moved[i] = before + (((weights[i] << fraction_bits_) - before + half) >> shift);
      excess |= moved[i] ^ static_cast<std::int16_t>(moved[i]);  // not 0 if it exceeds 16 bits
    }
    if (excess != 0) return false;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      average[i] = static_cast<std::int16_t>(moved[i]);
    }
    return true;
  }

  /// Gives up a bit of the fractions, so that averages of twice the size fit; halves are rounded
  /// up.
  void halve() noexcept {
    --fraction_bits_;
    for (std::int16_t& weight : std::span(weights_.data(), weights_.size())) {
      weight = static_cast<std::int16_t>((weight + 1) >> 1);
    }
  }

  std::size_t index(std::size_t unit, std::size_t column) const noexcept {
    constexpr std::size_t kUnits = HiddenLayer::kBlockUnits;
    return (unit / kUnits * n_columns_ + column) * kUnits + unit % kUnits;
  }

  std::size_t n_units_, n_columns_;
  std::uint64_t interval_;
  std::uint64_t due_;  ///< corrections at the next snapshot
  std::uint64_t n_snapshots_ = 0;
  int fraction_bits_ = kFractionBits;
  core::AlignedBuffer<std::int16_t> weights_;  ///< [block][column][unit in block]
  std::vector<std::int64_t> thresholds_;
};

namespace detail {

/// Returns value / 2^bits, halves rounded up.
inline std::int64_t rounded_average(std::int64_t value, int bits) noexcept {
  return (value + (std::int64_t{1} << (bits - 1))) >> bits;
}

}  // namespace detail

/// Returns the average of a threshold, rounded to whole lattice steps.
inline std::int32_t averaged_threshold(const WeightAverage& average, std::size_t unit) noexcept {
  return static_cast<std::int32_t>(
      detail::rounded_average(average.threshold(unit), WeightAverage::kFractionBits));
}
/// Returns the average of the weight of a unit of x_SD, which has these columns of the paired code,
/// rounded to whole lattice steps and clipped to +-limit; see paired_weight.
inline std::int32_t averaged_weight(const WeightAverage& average, std::size_t unit,
                                    const PairedColumns& columns, std::int64_t limit) noexcept {
  std::int64_t weight = average.weight(unit, columns.first);
  if (columns.paired) weight += columns.sign * std::int64_t{average.weight(unit, columns.second)};
  return static_cast<std::int32_t>(std::clamp(
      detail::rounded_average(weight, average.fraction_bits() + (columns.paired ? 1 : 0)), -limit,
      limit));
}

/// A layer of averaged weights, which is never corrected, and its empty log, as caches require one.
struct AveragedLayer {
  /// Makes a layer of the averaged weights and thresholds, rounded to integers.
  AveragedLayer(const WeightAverage& average, const coding::StateCode& code, std::size_t n_units,
                std::int64_t limit)
      : layer(paired_layer(
            code, n_units,
            [&](std::size_t unit, const PairedColumns& columns, std::size_t) {
              return averaged_weight(average, unit, columns, limit);
            },
            [&](std::size_t unit) { return averaged_threshold(average, unit); })) {}

  HiddenLayer layer;
  CorrectionLog log;
};

}  // namespace sdnn::approximators
