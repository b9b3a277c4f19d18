/// The weights of many units in chunks of columns: in each chunk, unit after unit.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/estimators/detail/code_walk.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// Weights of n_padded_units units and n_words * 64 slots, the ones that tiles lack all 0.
template <class Weight>
class ChunkedWeights {
 public:
  ChunkedWeights() = default;
  /// `n_words` is a multiple of kChunkWords, and at least the tiles'.
  ChunkedWeights(const WeightTiles<std::int32_t>& tiles, std::size_t n_words)
      : ChunkedWeights(tiles.n_padded_units(), n_words) {
    for (std::size_t i = 0; i < tiles.n_units(); ++i) {
      for (std::size_t slot = 0; slot < tiles.n_slots(); ++slot) {
        chunk(slot / kChunkColumns, i)[slot % kChunkColumns] =
            static_cast<Weight>(tiles.at(i, slot));
      }
    }
  }
  /// A copy in another type. The weights must fit.
  template <class Other>
  explicit ChunkedWeights(const ChunkedWeights<Other>& other)
      : ChunkedWeights(other.n_padded_units(), other.n_chunks() * kChunkWords) {
    std::transform(other.data(), other.data() + weights_.size(), weights_.data(),
                   [](Other weight) { return static_cast<Weight>(weight); });
  }

  static std::size_t bytes(std::size_t n_padded_units, std::size_t n_words) noexcept {
    return sizeof(Weight) * n_padded_units * 64 * n_words;
  }

  bool empty() const noexcept { return weights_.size() == 0; }
  std::size_t n_padded_units() const noexcept { return n_padded_units_; }
  std::size_t n_chunks() const noexcept { return n_chunks_; }
  const Weight* data() const noexcept { return weights_.data(); }
  /// kChunkColumns weights of a unit; the next unit's follow.
  Weight* chunk(std::size_t chunk, std::size_t unit) noexcept {
    return weights_.data() + (chunk * n_padded_units_ + unit) * kChunkColumns;
  }
  const Weight* chunk(std::size_t chunk, std::size_t unit) const noexcept {
    return weights_.data() + (chunk * n_padded_units_ + unit) * kChunkColumns;
  }

  void copy_to(WeightTiles<std::int32_t>& tiles) const noexcept {
    for (std::size_t i = 0; i < tiles.n_units(); ++i) {
      for (std::size_t slot = 0; slot < tiles.n_slots(); ++slot) {
        tiles.at(i, slot) = chunk(slot / kChunkColumns, i)[slot % kChunkColumns];
      }
    }
  }

  /// The largest sum of a unit's |weights| in a chunk.
  std::int64_t largest_chunk_norm() const noexcept {
    std::int64_t largest = 0;
    for (std::size_t at = 0; at < weights_.size(); at += kChunkColumns) {
      std::int64_t norm = 0;
      for (std::size_t k = 0; k < kChunkColumns; ++k)
        norm += std::abs(std::int64_t{weights_[at + k]});
      largest = std::max(largest, norm);
    }
    return largest;
  }

 private:
  ChunkedWeights(std::size_t n_padded_units, std::size_t n_words)
      : n_padded_units_(n_padded_units),
        n_chunks_(n_words / kChunkWords),
        weights_(n_padded_units * 64 * n_words) {}

  std::size_t n_padded_units_ = 0;
  std::size_t n_chunks_ = 0;
  core::AlignedBuffer<Weight> weights_;  // (n_chunks, n_padded_units, kChunkColumns)
};

}  // namespace sdnn::estimators
