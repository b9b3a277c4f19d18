/// Potentials of many samples, each from those of the sample before on a short walk, and the
/// weights in the order in which such a walk reads them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/integer_register.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// Words of a code whose rows of weights are added together: 128 columns of 96 units in 16 bits fit
/// into the first cache.
inline constexpr std::size_t kChunkWords = 2;
inline constexpr std::size_t kChunkColumns = 64 * kChunkWords;

/// The weights of many units in chunks of columns, in each chunk unit after unit: n_padded_units
/// units and n_words * 64 slots, the ones that tiles lack all 0.
template <class Weight>
class ChunkedWeights {
 public:
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

/// Units that are added side by side, in six registers.
template <class Weight>
inline constexpr std::size_t kMostUnits = 6 * core::IntegerRegister<Weight>::kSize;

namespace detail {

SDNN_INLINE std::uint8_t* list_chunk_changes_body(const coding::TernaryCode& from,
                                                  const coding::TernaryCode& to,
                                                  std::size_t n_words, std::uint8_t* at,
                                                  std::uint8_t** ends) noexcept {
  for (std::size_t w = 0; w < n_words; w += kChunkWords) {
    for (const bool rising : {true, false}) {
      core::unrolled<kChunkWords>([&](std::size_t k) SDNN_INLINE_LAMBDA {
        const coding::detail::WordChanges changes(from, to, w + k);
        at = coding::detail::append_few_bits<4>(at, rising ? changes.up : changes.down, 64 * k);
        at = coding::detail::append_few_bits<4>(at, rising ? changes.up_again : changes.down_again,
                                                64 * k);
      });
      *ends++ = at;
    }
  }
  return at;
}

}  // namespace detail

/// Lists what leads from one code to another, chunk by chunk: the columns that rise, one that rises
/// by 2 twice, then those that fall.
///
/// Writes numbers inside the chunk from `at` on, at most 2 * 64 * n_words + 4, and where each list
/// ends. Returns the end. `n_words` is a multiple of kChunkWords.
SDNN_KERNEL(std::uint8_t*, list_chunk_changes,
            (const coding::TernaryCode& from, const coding::TernaryCode& to, std::size_t n_words,
             std::uint8_t* at, std::uint8_t** ends),
            (from, to, n_words, at, ends))

/// Samples in the order of a walk, and the columns in which each code differs from the one before.
class CodeWalk {
 public:
  /// To a sample, from the one before or from the code of zeros.
  struct Step {
    std::uint32_t sample;
    bool from_zero;
  };
  /// In one chunk, step by step: columns that rise, then columns that fall, and how many there are.
  struct Changes {
    struct Count {
      std::uint16_t rising;
      std::uint16_t falling;
    };
    std::vector<std::uint8_t> columns;
    std::vector<Count> counts;
  };

  CodeWalk() = default;
  /// Through codes of n_words, a multiple of kChunkWords, along `order`; code_of(sample) has to
  /// stay where it is until the walk is made.
  template <class CodeOf>
  CodeWalk(std::span<const std::uint32_t> order, std::size_t n_words, const CodeOf& code_of)
      : chunks_(n_words / kChunkWords) {
    const std::vector<std::uint64_t> zeros(n_words);
    std::vector<std::uint8_t> columns(2 * 64 * n_words + 4);
    std::vector<std::uint8_t*> ends(2 * chunks_.size());
    coding::TernaryCode last{zeros.data(), zeros.data()};
    for (const std::uint32_t sample : order) {
      const coding::TernaryCode code = code_of(sample);
      const auto list = [&](const coding::TernaryCode& from) {
        const auto* const end =
            list_chunk_changes(from, code, n_words, columns.data(), ends.data());
        return static_cast<std::size_t>(end - columns.data());
      };
      bool from_zero = steps_.empty();
      if (list(last) > coding::n_active(code, n_words)) {
        list({zeros.data(), zeros.data()});
        from_zero = true;
      }
      steps_.push_back({sample, from_zero});
      const std::uint8_t* begin = columns.data();
      for (std::size_t c = 0; c < chunks_.size(); ++c) {
        const std::uint8_t* const middle = ends[2 * c];
        const std::uint8_t* const end = ends[2 * c + 1];
        chunks_[c].columns.insert(chunks_[c].columns.end(), begin, end);
        chunks_[c].counts.push_back(
            {static_cast<std::uint16_t>(middle - begin), static_cast<std::uint16_t>(end - middle)});
        begin = end;
      }
      last = code;
    }
  }

  /// The most bytes that walks through n_samples codes take.
  static std::size_t bytes(std::size_t n_samples, std::size_t n_words,
                           std::size_t most_active) noexcept {
    return n_samples * (most_active + n_words / kChunkWords * sizeof(Changes::Count));
  }

  bool empty() const noexcept { return steps_.empty(); }
  std::size_t n_chunks() const noexcept { return chunks_.size(); }
  std::span<const Step> steps() const noexcept { return steps_; }
  const Changes& changes(std::size_t chunk) const noexcept { return chunks_[chunk]; }

 private:
  std::vector<Step> steps_;
  std::vector<Changes> chunks_;
};

namespace detail {

template <class Weight>
SDNN_INLINE void walk_chunk_body(const Weight* rows, std::size_t width,
                                 std::span<const CodeWalk::Step> steps,
                                 const CodeWalk::Changes& changes, std::int32_t* potentials,
                                 std::size_t stride) noexcept {
  using Lane = core::IntegerRegister<Weight>;
  for_width<kMostUnits<Weight>>(width, [&]<std::size_t Width>(Size<Width>) SDNN_INLINE_LAMBDA {
    constexpr std::size_t kRegisters = Width / Lane::kSize;
    Lane sum[kRegisters];
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
    const std::uint8_t* column = changes.columns.data();
    const CodeWalk::Changes::Count* count = changes.counts.data();
    for (const CodeWalk::Step& step : steps) {
      if (step.from_zero) {
        core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
      }
      for (const std::uint8_t* const end = column + count->rising; column != end; ++column) {
        const Weight* const row = rows + *column * Width;
        core::unrolled<kRegisters>([&](std::size_t r)
                                       SDNN_INLINE_LAMBDA { sum[r].add(row + r * Lane::kSize); });
      }
      for (const std::uint8_t* const end = column + count->falling; column != end; ++column) {
        const Weight* const row = rows + *column * Width;
        core::unrolled<kRegisters>(
            [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].subtract(row + r * Lane::kSize); });
      }
      ++count;
      std::int32_t* const to = potentials + step.sample * stride;
      core::unrolled<kRegisters>([&](std::size_t r)
                                     SDNN_INLINE_LAMBDA { sum[r].add_to(to + r * Lane::kSize); });
    }
  });
}

}  // namespace detail

/// Adds to potentials[sample * stride + i], i = 0 .. width - 1, what the columns of a chunk
/// contribute to each sample of a walk. The sum over a sample's columns in the chunk has to fit
/// into Weight.
///
/// Shapes: rows (kChunkColumns, width).
SDNN_KERNEL(void, walk_chunk,
            (const std::int16_t* rows, std::size_t width, std::span<const CodeWalk::Step> steps,
             const CodeWalk::Changes& changes, std::int32_t* potentials, std::size_t stride),
            (rows, width, steps, changes, potentials, stride))
SDNN_KERNEL(void, walk_chunk,
            (const std::int32_t* rows, std::size_t width, std::span<const CodeWalk::Step> steps,
             const CodeWalk::Changes& changes, std::int32_t* potentials, std::size_t stride),
            (rows, width, steps, changes, potentials, stride))

}  // namespace sdnn::estimators
