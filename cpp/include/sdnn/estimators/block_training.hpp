/// Training block by block over the weights: for any number of samples.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/worker_team.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/perceptron_layer.hpp"
#include "sdnn/estimators/plain_training.hpp"
#include "sdnn/estimators/weight_tiles.hpp"

namespace sdnn::estimators {

/// Presents samples in blocks of 32.
///
/// One pass over the weights, a few cache-resident rows of a tile at a time, applies the corrections
/// of the block before and adds up the potentials of this one. What the block's own corrections
/// change in its later potentials follows exactly from the inner products of its codes. Weights are
/// kept in 16 bits, in 32 as soon as one has grown beyond 8000.
class BlockTraining {
 public:
  BlockTraining(std::shared_ptr<PerceptronLayer> layer, std::span<const std::int32_t> bins,
                int n_threads)
      : layer_(std::move(layer)), bins_(bins.begin(), bins.end()), kernels_(unit_kernels()),
        team_(static_cast<std::size_t>(n_threads)),
        potentials_(kBlock * layer_->n_padded_units()),
        largest_when_read_(layer_->tiles().largest()), largest_(largest_when_read_),
        wide_(largest_when_read_ > kLargestNarrow) {
    const std::size_t n_chunks = (layer_->code().n_words() + kChunkWords - 1) / kChunkWords;
    for (Block* const block : {&now_, &before_}) {
      block->plus.resize(layer_->code().n_slots());
      block->minus.resize(layer_->code().n_slots());
      for (Sample& sample : block->samples) {
        sample.words.resize(2 * layer_->code().n_words());
        sample.plus = sample.minus = SlotList(layer_->code().n_slots());
        sample.plus_ends.resize(n_chunks + 1);
        sample.minus_ends.resize(n_chunks + 1);
      }
    }
    if (wide_) {
      wide_weights_ = layer_->tiles();
    } else {
      weights_ = WeightTiles<std::int16_t>(layer_->tiles());
    }
  }

  template <class Rule>
  TrainingCount present(std::span<const std::int32_t> order, Rule& rule) {
    TrainingCount count;
    while (!order.empty()) {
      const auto some = order.first(std::min(order.size(), kBlock));
      read(some);
      pass();
      present_block(some, rule, count);
      order = order.subspan(some.size());
      std::swap(now_, before_);
    }
    return count;
  }

  void synchronize() {
    now_.size = 0;
    now_.corrections.clear();
    pass();
    before_.corrections.clear();
    if (wide_) {
      layer_->tiles() = wide_weights_;
    } else {
      layer_->tiles() = WeightTiles<std::int32_t>(weights_);
    }
  }

 private:
  static constexpr std::size_t kBlock = 32;
  static constexpr std::size_t kChunkWords = 2;  // 128 slots of 64 units in 16 bits: 16 KB
  static constexpr std::int64_t kLargestNarrow = 8000;
  static constexpr std::int64_t kLooseness = 256;

  /// A sample's code: its words, and its slots with where those of each chunk end.
  struct Sample {
    std::vector<std::uint64_t> words;
    SlotList plus{0}, minus{0};
    std::vector<std::size_t> plus_ends, minus_ends;
  };
  struct BlockCorrection {
    std::size_t place;  // in the block
    Correction what;
  };
  struct Block {
    std::array<Sample, kBlock> samples;
    std::size_t size = 0;
    std::vector<BlockCorrection> corrections;
    std::vector<std::uint32_t> plus, minus;  // of every slot, bit b: +1 or -1 in sample b
  };

  void read(std::span<const std::int32_t> order) {
    const PerceptronLayer::Code& code = layer_->code();
    const std::size_t n_words = code.n_words();
    now_.size = order.size();
    now_.corrections.clear();
    std::fill(now_.plus.begin(), now_.plus.end(), 0);
    std::fill(now_.minus.begin(), now_.minus.end(), 0);
    for (std::size_t b = 0; b < order.size(); ++b) {
      Sample& sample = now_.samples[b];
      std::uint64_t* const active = sample.words.data();
      std::uint64_t* const positive = active + n_words;
      code.encode(std::span(bins_).subspan(static_cast<std::size_t>(order[b]) * code.n_inputs(),
                                           code.n_inputs()),
                  active, positive);
      sample.plus.clear();
      sample.minus.clear();
      for (std::size_t w = 0; w < n_words; ++w) {
        sample.plus.append(positive[w], w);
        sample.minus.append(active[w] & ~positive[w], w);
        sample.plus_ends[w / kChunkWords + 1] = sample.plus.size();
        sample.minus_ends[w / kChunkWords + 1] = sample.minus.size();
      }
      for (const std::uint32_t slot : sample.plus) now_.plus[slot] |= std::uint32_t{1} << b;
      for (const std::uint32_t slot : sample.minus) now_.minus[slot] |= std::uint32_t{1} << b;
      for (std::size_t e = 0; e < b; ++e) {
        const Sample& earlier = now_.samples[e];
        products_[b][e] = 1 + kernels_.inner_product(active, positive, earlier.words.data(),
                                                     earlier.words.data() + n_words, n_words);
      }
    }
  }

  void pass() {
    // A block corrects a unit at most once per sample. The bound is loose; at times it is renewed.
    largest_ += wide_ ? 0 : static_cast<std::int64_t>(kBlock);
    if (!wide_ && largest_ > largest_when_read_ + kLooseness) {
      largest_when_read_ = weights_.largest();
      largest_ = largest_when_read_ + static_cast<std::int64_t>(kBlock);
      if (largest_ > kLargestNarrow) {
        wide_weights_ = WeightTiles<std::int32_t>(weights_);
        weights_ = {};
        wide_ = true;
      }
    }
    const auto n_per_sum = wide_ ? std::size_t{1} << 30
                                 : static_cast<std::size_t>(std::numeric_limits<std::int16_t>::max() /
                                                            largest_);
    team_.run([&](std::size_t part) {
      const std::size_t n_tiles = layer_->tiles().n_tiles();
      for (std::size_t tile = part; tile < n_tiles; tile += team_.size()) {
        if (wide_) {
          pass_tile(wide_weights_, tile, n_per_sum);
        } else {
          pass_tile(weights_, tile, n_per_sum);
        }
      }
    });
  }

  template <class Weight>
  void pass_tile(WeightTiles<Weight>& tiles, std::size_t tile, std::size_t n_per_sum) {
    const std::size_t first_unit = tile * kTileUnits;
    const std::size_t width = tiles.width(tile);
    const std::size_t n_real = std::min(width, layer_->n_units() - first_unit);
    const std::size_t n_padded = layer_->n_padded_units();
    for (std::size_t b = 0; b < now_.size; ++b) {
      for (std::size_t i = 0; i < n_real; ++i) {
        potentials_[b * n_padded + first_unit + i] = -layer_->thresholds()[first_unit + i];
      }
    }
    alignas(core::kCacheLine) std::array<Weight, kBlock * kTileUnits> coefficients{};
    std::uint32_t corrected = 0;  // samples of the block before that corrected units of this tile
    for (const BlockCorrection& made : before_.corrections) {
      if (made.what.unit / kTileUnits != tile) continue;
      corrected |= std::uint32_t{1} << made.place;
      coefficients[made.place * width + made.what.unit % kTileUnits] =
          static_cast<Weight>(made.what.direction);
    }
    Weight* const weights = tiles.tile(tile);
    const std::size_t n_chunks = now_.samples[0].plus_ends.size() - 1;
    for (std::size_t chunk = 0; chunk < n_chunks; ++chunk) {
      if (corrected != 0) {
        const std::size_t slot = 64 * kChunkWords * chunk;
        kernels_.correct_rows(weights + slot * width, width,
                              std::min(64 * kChunkWords, tiles.n_slots() - slot),
                              before_.plus.data() + slot, before_.minus.data() + slot, corrected,
                              coefficients.data());
      }
      for (std::size_t b = 0; b < now_.size; ++b) {
        const Sample& sample = now_.samples[b];
        const std::size_t plus = sample.plus_ends[chunk];
        const std::size_t minus = sample.minus_ends[chunk];
        kernels_.add_rows(weights, width, sample.plus.data() + plus,
                          sample.plus_ends[chunk + 1] - plus, sample.minus.data() + minus,
                          sample.minus_ends[chunk + 1] - minus, n_per_sum,
                          &potentials_[b * n_padded + first_unit]);
      }
    }
  }

  template <class Rule>
  void present_block(std::span<const std::int32_t> order, Rule& rule, TrainingCount& count) {
    const std::size_t n_padded = layer_->n_padded_units();
    for (std::size_t b = 0; b < order.size(); ++b) {
      std::int32_t* const values = &potentials_[b * n_padded];
      for (const BlockCorrection& made : now_.corrections) {
        values[made.what.unit] += made.what.direction * products_[b][made.place];
      }
      rule(static_cast<std::size_t>(order[b]), values, corrections_);
      for (const Correction& correction : corrections_) {
        now_.corrections.push_back({b, correction});
        layer_->thresholds()[correction.unit] -= correction.direction;
      }
      count.n_samples += corrections_.empty() ? 0 : 1;
      count.n_units += corrections_.size();
    }
  }

  std::shared_ptr<PerceptronLayer> layer_;
  std::vector<std::int32_t> bins_;
  UnitKernels kernels_;
  core::WorkerTeam team_;
  core::AlignedBuffer<std::int32_t> potentials_;  // (kBlock, n_padded_units)
  Block now_;
  Block before_;  // its corrections are not in the weights yet
  std::array<std::array<std::int32_t, kBlock>, kBlock> products_{};  // 1 added to each
  std::vector<Correction> corrections_;
  std::int64_t largest_when_read_;  // |weight|, when last looked at
  std::int64_t largest_;            // no |weight| exceeds it
  bool wide_;
  WeightTiles<std::int16_t> weights_;
  WeightTiles<std::int32_t> wide_weights_;
};

}  // namespace sdnn::estimators
