/// Sums of weights over the codes of many samples, each computed from the sum of the sample before
/// it in an order with small changes, a *walk*; and the weights in chunks of columns for such
/// walks.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// The number of words of a code in a chunk, whose columns are added together: the weights of 96
/// units in 256 columns, with 16 bits each, fit into the first-level cache.
inline constexpr std::size_t kChunkWords = 4;
inline constexpr std::size_t kChunkColumns = 64 * kChunkWords;

/// The weights of many units in chunks of kChunkColumns columns; a chunk has the weights of one
/// unit after those of the other. Columns of words that a layer's tiles do not have are 0.
template <class Weight>
class ChunkedWeights {
 public:
  /// The numbers of the words of a code in the order of the chunks; a multiple of kChunkWords.
  using Words = std::vector<std::size_t>;

  /// Copies the weights of a layer, word after word in the order of `words`.
  ChunkedWeights(const WeightTiles<std::int32_t>& tiles, const Words& words)
      : ChunkedWeights(tiles.n_padded_units(), words.size()) {
    for_each_slot(tiles, words, [&](std::size_t unit, std::size_t slot, std::size_t at) {
      weights_[at] = static_cast<Weight>(tiles.at(unit, slot));
    });
  }
  /// Makes a copy in another type, which the weights must fit.
  template <class Other>
  explicit ChunkedWeights(const ChunkedWeights<Other>& other)
      : ChunkedWeights(other.n_padded_units(), other.n_chunks() * kChunkWords) {
    std::transform(other.data(), other.data() + weights_.size(), weights_.data(),
                   [](Other weight) { return static_cast<Weight>(weight); });
  }

  static std::uint64_t bytes(std::uint64_t n_padded_units, std::uint64_t n_words) noexcept {
    return sizeof(Weight) * n_padded_units * 64 * n_words;
  }

  std::size_t n_padded_units() const noexcept { return n_padded_units_; }
  std::size_t n_chunks() const noexcept { return n_chunks_; }
  const Weight* data() const noexcept { return weights_.data(); }
  /// The kChunkColumns weights of a unit, followed by those of the next unit.
  Weight* chunk(std::size_t chunk, std::size_t unit) noexcept {
    return weights_.data() + (chunk * n_padded_units_ + unit) * kChunkColumns;
  }
  const Weight* chunk(std::size_t chunk, std::size_t unit) const noexcept {
    return weights_.data() + (chunk * n_padded_units_ + unit) * kChunkColumns;
  }

  /// Copies the weights back to the tiles; `words` as in the constructor.
  void copy_to(WeightTiles<std::int32_t>& tiles, const Words& words) const {
    for_each_slot(tiles, words, [&](std::size_t unit, std::size_t slot, std::size_t at) {
      tiles.at(unit, slot) = weights_[at];
    });
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
  /// Calls visit(unit, slot, index of its weight in weights_) for all units and slots of the tiles.
  template <class Visit>
  void for_each_slot(const WeightTiles<std::int32_t>& tiles, const Words& words,
                     const Visit& visit) const {
    for (std::size_t unit = 0; unit < tiles.n_units(); ++unit) {
      for (std::size_t position = 0; position < words.size(); ++position) {
        if (64 * words[position] >= tiles.n_slots()) continue;
        const std::size_t chunk = position / kChunkWords;
        const std::size_t at =
            (chunk * n_padded_units_ + unit) * kChunkColumns + position % kChunkWords * 64;
        for (std::size_t k = 0; k < 64; ++k) visit(unit, 64 * words[position] + k, at + k);
      }
    }
  }

  ChunkedWeights(std::size_t n_padded_units, std::size_t n_words)
      : n_padded_units_(n_padded_units),
        n_chunks_(n_words / kChunkWords),
        weights_(n_padded_units * 64 * n_words) {}

  std::size_t n_padded_units_ = 0;
  std::size_t n_chunks_ = 0;
  core::AlignedBuffer<Weight> weights_;  // (n_chunks, n_padded_units, kChunkColumns)
};

/// The largest number of units whose weights are added together: they take six registers.
template <class Weight>
inline constexpr std::size_t kMostUnits = 6 * core::IntegerRegister<Weight>::kSize;

/// The part of a code in a chunk, as bits of the columns that are not 0 and of those that are +1.
struct ChunkCode {
  std::uint64_t active[kChunkWords];
  std::uint64_t positive[kChunkWords];
};

/// A walk through the codes of samples in a chunk: the changes from each code to the next different
/// one, and the step that leads to the code of each sample.
struct CodeWalk {
  /// The numbers of columns that rise and that fall, from the previous code or, if `from_zero`,
  /// from the code of zeros.
  struct Step {
    std::uint16_t n_rising, n_falling;
    bool from_zero;
  };
  std::vector<std::uint8_t> columns;  ///< for each step, the rising and then the falling columns
  std::vector<Step> steps;
  std::vector<std::uint16_t> step_of_sample;  ///< the step that leads to the code of each sample

  /// The largest number of samples: the number of a step has 16 bits.
  static constexpr std::size_t kMostSamples = std::size_t{1} << 16;
  /// The largest number of bytes of the walks of all chunks of n_samples codes.
  static std::uint64_t bytes(std::uint64_t n_samples, std::uint64_t n_chunks,
                             std::uint64_t most_active) noexcept {
    return n_samples * (most_active + n_chunks * (sizeof(Step) + sizeof(std::uint16_t)));
  }
};

namespace detail {

/// The body of the kernel list_steps (see below), compiled for each instruction set.
SDNN_INLINE std::uint8_t* list_steps_body(std::span<const ChunkCode> codes, std::size_t n_words,
                                          std::uint8_t* at, CodeWalk::Step* steps) noexcept {
  ChunkCode last{};
  for (const ChunkCode& code : codes) {
    const coding::TernaryCode from{last.active, last.positive};
    const coding::TernaryCode to{code.active, code.positive};
    int n_changes = 0, n_active = 0;
    for (std::size_t w = 0; w < n_words; ++w) {
      const coding::detail::WordChanges changes(from, to, w);
      n_changes += std::popcount(changes.up) + std::popcount(changes.up_again) +
                   std::popcount(changes.down) + std::popcount(changes.down_again);
      n_active += std::popcount(code.active[w]);
    }
    const bool from_zero = n_changes > n_active;
    if (from_zero) last = {};
    const std::uint8_t* const begin = at;
    const std::uint8_t* middle = at;
    for (const bool rising : {true, false}) {
      for (std::size_t w = 0; w < n_words; ++w) {
        const coding::detail::WordChanges changes(from, to, w);
        at = coding::detail::append_few_bits<2>(at, rising ? changes.up : changes.down, 64 * w);
        const std::uint64_t again = rising ? changes.up_again : changes.down_again;
        if (again != 0) at = coding::detail::append_few_bits<1>(at, again, 64 * w);
      }
      if (rising) middle = at;
    }
    *steps++ = {static_cast<std::uint16_t>(middle - begin), static_cast<std::uint16_t>(at - middle),
                from_zero};
    last = code;
  }
  return at;
}

/// The body of the kernel sum_steps (see below), compiled for each instruction set.
template <class Weight>
SDNN_INLINE void sum_steps_body(const Weight* rows, std::size_t width, const CodeWalk& walk,
                                Weight* sums) noexcept {
  using Lane = core::IntegerRegister<Weight>;
  for_width<kMostUnits<Weight>>(width, [&]<std::size_t Width>(Size<Width>) SDNN_INLINE_LAMBDA {
    constexpr std::size_t kRegisters = Width / Lane::kSize;
    Lane sum[kRegisters];
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
    const std::uint8_t* column = walk.columns.data();
    Weight* to = sums;
    for (const CodeWalk::Step& step : walk.steps) {
      if (step.from_zero) {
        core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
      }
      for (const std::uint8_t* const end = column + step.n_rising; column != end; ++column) {
        const Weight* const row = rows + *column * Width;
        core::unrolled<kRegisters>([&](std::size_t r)
                                       SDNN_INLINE_LAMBDA { sum[r].add(row + r * Lane::kSize); });
      }
      for (const std::uint8_t* const end = column + step.n_falling; column != end; ++column) {
        const Weight* const row = rows + *column * Width;
        core::unrolled<kRegisters>(
            [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].subtract(row + r * Lane::kSize); });
      }
      core::unrolled<kRegisters>([&](std::size_t r)
                                     SDNN_INLINE_LAMBDA { sum[r].store(to + r * Lane::kSize); });
      to += Width;
    }
  });
}

}  // namespace detail

/// The sums of weights at the steps of a walk, and the step of each sample.
template <class Weight>
struct StepSums {
  const Weight* sums;                   ///< (n_steps, width)
  const std::uint16_t* step_of_sample;  ///< (n_samples,)
};

namespace detail {

/// The body of the kernel add_step_sums (see below), compiled for each instruction set.
template <class Weight>
SDNN_INLINE void add_step_sums_body(std::span<const StepSums<Weight>> walks, std::size_t width,
                                    std::size_t n_samples, std::int32_t* potentials,
                                    std::size_t stride) noexcept {
  using Lane = core::IntegerRegister<Weight>;
  for_width<kMostUnits<Weight>>(width, [&]<std::size_t Width>(Size<Width>) SDNN_INLINE_LAMBDA {
    constexpr std::size_t kRegisters = Width / Lane::kSize;
    for (std::size_t s = 0; s < n_samples; ++s, potentials += stride) {
      Lane sum[kRegisters];
      core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
      for (const StepSums<Weight>& walk : walks) {
        const Weight* const row = walk.sums + std::size_t{walk.step_of_sample[s]} * Width;
        core::unrolled<kRegisters>([&](std::size_t r)
                                       SDNN_INLINE_LAMBDA { sum[r].add(row + r * Lane::kSize); });
      }
      core::unrolled<kRegisters>(
          [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].add_to(potentials + r * Lane::kSize); });
    }
  });
}

}  // namespace detail

/// Writes a step for each code, and from `at` on the columns of all steps: those that rise, then
/// those that fall, twice for a change by 2. A step starts from the previous code, or from the code
/// of zeros if that is nearer; the first always starts from zeros. Only the first `n_words` words
/// of a code count. Returns the end of the columns: at most 64 for each word and step, and up to 2
/// meaningless ones behind.
SDNN_KERNEL(std::uint8_t*, list_steps,
            (std::span<const ChunkCode> codes, std::size_t n_words, std::uint8_t* at,
             CodeWalk::Step* steps),
            (codes, n_words, at, steps))

/// Computes sums[s * width + i], the product of the weights of unit i and the code of step s. The
/// sum of a unit's |weights| in the chunk must fit into their type. Shapes: rows (kChunkColumns,
/// width).
SDNN_KERNEL(void, sum_steps,
            (const std::int16_t* rows, std::size_t width, const CodeWalk& walk, std::int16_t* sums),
            (rows, width, walk, sums))
SDNN_KERNEL(void, sum_steps,
            (const std::int32_t* rows, std::size_t width, const CodeWalk& walk, std::int32_t* sums),
            (rows, width, walk, sums))

/// Adds to potentials[s * stride + i], i = 0 .. width - 1, the sums of sample s in all walks. Their
/// total must fit into the type of the sums.
SDNN_KERNEL(void, add_step_sums,
            (std::span<const StepSums<std::int16_t>> walks, std::size_t width,
             std::size_t n_samples, std::int32_t* potentials, std::size_t stride),
            (walks, width, n_samples, potentials, stride))
SDNN_KERNEL(void, add_step_sums,
            (std::span<const StepSums<std::int32_t>> walks, std::size_t width,
             std::size_t n_samples, std::int32_t* potentials, std::size_t stride),
            (walks, width, n_samples, potentials, stride))

}  // namespace sdnn::estimators
