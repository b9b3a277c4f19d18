/// The latest corrections of a layer, for caches that follow them.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/identity.hpp"

namespace sdnn::approximators {

/// The last kSize corrections of a layer's weights, numbered from 0.
///
/// A layer with other weights has a log with another identity. Results that were computed from the
/// layer can thus be checked, and updated by the later corrections.
class CorrectionLog {
 public:
  static constexpr std::size_t kSize = 512;

  /// A correction: w_i += step * x_SD(bins) and w_i0 -= step for every i in `units`.
  struct Entry {
    std::span<const coding::Bin> bins;
    std::span<const std::uint32_t> units;
    std::int32_t step;
  };

  /// The log of a layer that is never corrected.
  CorrectionLog() = default;
  /// `max_units` is the largest number of units in a correction.
  CorrectionLog(std::size_t n_inputs, std::size_t max_units)
      : n_inputs_(n_inputs),
        max_units_(max_units),
        bins_(kSize * n_inputs),
        units_(kSize * max_units),
        sizes_(kSize) {}

  /// The number of bytes that grow with this size.
  static constexpr std::size_t n_bytes(std::size_t max_units) noexcept {
    return kSize * max_units * sizeof(std::uint32_t);
  }

  /// The identity of the layer at the beginning of the log.
  std::uint64_t identity() const noexcept { return identity_.number(); }
  /// The number of corrections since the beginning.
  std::uint64_t size() const noexcept { return size_; }

  /// A correction, one of the last kSize.
  Entry operator[](std::uint64_t number) const noexcept {
    assert(number < size_ && size_ - number <= kSize);
    const std::size_t slot = number % kSize;
    return {std::span(bins_).subspan(slot * n_inputs_, n_inputs_),
            std::span(units_).subspan(slot * max_units_, sizes_[slot].n_units), sizes_[slot].step};
  }

  void add(const Entry& entry) noexcept {
    assert(entry.units.size() <= max_units_);
    const std::size_t slot = size_ % kSize;
    std::ranges::copy(entry.bins, bins_.begin() + static_cast<std::ptrdiff_t>(slot * n_inputs_));
    std::ranges::copy(entry.units, units_.begin() + static_cast<std::ptrdiff_t>(slot * max_units_));
    sizes_[slot] = {entry.step, entry.units.size()};
    ++size_;
  }

  /// Restarts the log after the layer's weights were replaced.
  void restart() noexcept {
    identity_ = core::Identity();
    size_ = 0;
  }

 private:
  struct Size {
    std::int32_t step = 0;
    std::size_t n_units = 0;
  };

  core::Identity identity_;
  std::uint64_t size_ = 0;
  std::size_t n_inputs_ = 0;
  std::size_t max_units_ = 0;
  std::vector<coding::Bin> bins_;     ///< [slot][input]
  std::vector<std::uint32_t> units_;  ///< [slot][up to max_units_]
  std::vector<Size> sizes_;
};

}  // namespace sdnn::approximators
