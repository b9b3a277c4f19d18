/// The weights of many units, laid out so that a column of all units is a few cache lines.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/estimators/detail/tile_rows.hpp"

namespace sdnn::estimators {

/// Weights in tiles of up to kTileUnits: inside a tile, slot after slot, the units side by side.
///
/// All tiles are kTileUnits wide but the last, whose width is the least multiple of 16 that holds
/// the rest. Memory: sizeof(Weight) * n_slots * round_up(n_units, 16).
template <class Weight>
class WeightTiles {
 public:
  WeightTiles() = default;
  WeightTiles(std::size_t n_units, std::size_t n_slots)
      : n_units_(n_units),
        n_slots_(n_slots),
        weights_(core::round_up(n_units, kTileStep) * n_slots) {}

  /// A copy in another type. The weights must fit.
  template <class Other>
  explicit WeightTiles(const WeightTiles<Other>& other)
      : WeightTiles(other.n_units(), other.n_slots()) {
    std::transform(other.data(), other.data() + weights_.size(), weights_.data(),
                   [](Other weight) { return static_cast<Weight>(weight); });
  }

  static std::size_t bytes(std::size_t n_units, std::size_t n_slots) noexcept {
    return sizeof(Weight) * core::round_up(n_units, kTileStep) * n_slots;
  }

  std::size_t n_units() const noexcept { return n_units_; }
  std::size_t n_slots() const noexcept { return n_slots_; }
  std::size_t n_padded_units() const noexcept { return core::round_up(n_units_, kTileStep); }
  std::size_t n_tiles() const noexcept { return (n_units_ + kTileUnits - 1) / kTileUnits; }
  std::size_t width(std::size_t tile) const noexcept {
    return std::min(kTileUnits, n_padded_units() - tile * kTileUnits);
  }
  const Weight* data() const noexcept { return weights_.data(); }
  const Weight* tile(std::size_t tile) const noexcept {
    return weights_.data() + tile * kTileUnits * n_slots_;
  }
  Weight* tile(std::size_t tile) noexcept { return weights_.data() + tile * kTileUnits * n_slots_; }
  const Weight& at(std::size_t unit, std::size_t slot) const noexcept {
    return tile(unit / kTileUnits)[slot * width(unit / kTileUnits) + unit % kTileUnits];
  }
  Weight& at(std::size_t unit, std::size_t slot) noexcept {
    return tile(unit / kTileUnits)[slot * width(unit / kTileUnits) + unit % kTileUnits];
  }

  /// The largest |weight|.
  std::int64_t largest() const noexcept {
    Weight low = 0;
    Weight high = 0;
    for (const Weight weight : weights_.span()) {
      low = std::min(low, weight);
      high = std::max(high, weight);
    }
    return std::max(-std::int64_t{low}, std::int64_t{high});
  }

 private:
  std::size_t n_units_ = 0;
  std::size_t n_slots_ = 0;
  core::AlignedBuffer<Weight> weights_;
};

}  // namespace sdnn::estimators
