/// Potentials of a block of queries, pair by pair of inputs.
///
/// Many inputs leave no order of the queries in which neighbours have similar codes. The columns of
/// one pair depend on two inputs alone, so each pair has an order of its own, a short walk through
/// a plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/estimators/detail/code_walk.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// kChunkWords words of a code: where it is not 0, and where it is +1.
struct ChunkCode {
  std::uint64_t active[kChunkWords];
  std::uint64_t positive[kChunkWords];
};

namespace detail {

SDNN_INLINE std::uint8_t* list_steps_body(std::span<const ChunkCode> codes, std::size_t n_words,
                                          std::uint8_t* at,
                                          CodeWalk::Changes::Count* counts) noexcept {
  ChunkCode last{};
  for (const ChunkCode& code : codes) {
    const coding::TernaryCode from{last.active, last.positive};
    const coding::TernaryCode to{code.active, code.positive};
    const std::uint8_t* const begin = at;
    for (std::size_t w = 0; w < n_words; ++w) {
      const coding::detail::WordChanges changes(from, to, w);
      at = coding::detail::append_few_bits<2>(at, changes.up, 64 * w);
      if (changes.up_again != 0) {
        at = coding::detail::append_few_bits<1>(at, changes.up_again, 64 * w);
      }
    }
    const std::uint8_t* const middle = at;
    for (std::size_t w = 0; w < n_words; ++w) {
      const coding::detail::WordChanges changes(from, to, w);
      at = coding::detail::append_few_bits<2>(at, changes.down, 64 * w);
      if (changes.down_again != 0) {
        at = coding::detail::append_few_bits<1>(at, changes.down_again, 64 * w);
      }
    }
    *counts++ = {static_cast<std::uint16_t>(middle - begin),
                 static_cast<std::uint16_t>(at - middle)};
    last = code;
  }
  return at;
}

}  // namespace detail

/// Lists what leads from code to code, from the code of zeros to the first: the columns that rise,
/// one that rises by 2 twice, then those that fall, and how many these are. Only the first
/// `n_words` words of a code count. At most 128 columns a word and step, and 2 more at the end.
/// Returns their end.
SDNN_KERNEL(std::uint8_t*, list_steps,
            (std::span<const ChunkCode> codes, std::size_t n_words, std::uint8_t* at,
             CodeWalk::Changes::Count* counts),
            (codes, n_words, at, counts))

/// Orders of a block of queries, one for each two inputs: in strips of equal bins of one, forth
/// and back along the other.
class PairOrders {
 public:
  PairOrders(const coding::SelectiveDesensitization& code, std::span<const std::int32_t> bins,
             std::span<const std::uint32_t> queries)
      : n_strips_(static_cast<std::size_t>(
            std::max(1.0, std::round(std::sqrt(static_cast<double>(queries.size()) / 3.0))))),
        inputs_(code.n_inputs()),
        order_(queries.size()) {
    const std::size_t n = queries.size();
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      if (code.n_bins(i) == 0) continue;
      Input& input = inputs_[i];
      input.bins.resize(n);
      input.strips.resize(n);
      input.begins.resize(n_strips_ + 1);
      for (std::size_t q = 0; q < n; ++q) {
        input.bins[q] = bins[queries[q] * inputs_.size() + i];
        input.strips[q] = static_cast<std::uint32_t>(static_cast<std::size_t>(input.bins[q]) *
                                                     n_strips_ / code.n_bins(i));
        ++input.begins[input.strips[q] + 1];
      }
      std::partial_sum(input.begins.begin(), input.begins.end(), input.begins.begin());
      input.sorted.resize(n);
      std::iota(input.sorted.begin(), input.sorted.end(), std::uint32_t{0});
      std::stable_sort(
          input.sorted.begin(), input.sorted.end(),
          [&](std::uint32_t a, std::uint32_t b) { return input.bins[a] < input.bins[b]; });
    }
  }

  std::int32_t bin(std::size_t input, std::uint32_t query) const noexcept {
    return inputs_[input].bins[query];
  }

  /// Places of the queries in the block; valid until the next call.
  std::span<const std::uint32_t> of(std::size_t one, std::size_t other) {
    const Input& strips = inputs_[one];
    begins_.assign(strips.begins.begin(), strips.begins.end() - 1);
    ends_.assign(strips.begins.begin() + 1, strips.begins.end());
    for (const std::uint32_t query : inputs_[other].sorted) {
      const std::uint32_t strip = strips.strips[query];
      order_[strip % 2 == 0 ? begins_[strip]++ : --ends_[strip]] = query;
    }
    return order_;
  }

 private:
  struct Input {
    std::vector<std::int32_t> bins;
    std::vector<std::uint32_t> strips;
    std::vector<std::uint32_t> begins;  // of the strips in an order, and its end
    std::vector<std::uint32_t> sorted;  // by bins
  };

  std::size_t n_strips_;
  std::vector<Input> inputs_;
  std::vector<std::uint32_t> order_, begins_, ends_;
};

/// Up to kChunkWords words of a code that depend on the same two inputs.
struct PairChunk {
  std::size_t one;
  std::size_t other;
  std::vector<std::size_t> words;
};

/// All words of a code in chunks: both pairs of two inputs together.
inline std::vector<PairChunk> pair_chunks(const coding::SelectiveDesensitization& code) {
  std::vector<std::size_t> order(code.n_pairs());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto inputs_of = [&](std::size_t p) {
    const coding::InputPair pair = code.pair(p);
    return std::minmax({pair.modified, pair.modifier});
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return inputs_of(a) < inputs_of(b); });
  std::vector<PairChunk> chunks;
  for (const std::size_t p : order) {
    const auto [one, other] = inputs_of(p);
    for (std::size_t w = 0; w < code.n_pair_words(); ++w) {
      if (chunks.empty() || chunks.back().words.size() == kChunkWords || chunks.back().one != one ||
          chunks.back().other != other) {
        chunks.push_back({one, other, {}});
      }
      chunks.back().words.push_back(p * code.n_pair_words() + w);
    }
  }
  return chunks;
}

/// Adds the weights of each query's code to its potentials, potentials[q * n_padded_units + i].
///
/// The sum of a unit's |weights| in the slots of kChunkWords words has to fit into Weight.
template <class Weight>
void add_codes(const coding::SelectiveDesensitization& code, std::span<const PairChunk> chunks,
               const WeightTiles<Weight>& tiles, std::span<const std::int32_t> bins,
               std::span<const std::uint32_t> queries, std::int32_t* potentials) {
  PairOrders orders(code, bins, queries);
  std::vector<CodeWalk::Step> steps(queries.size());
  std::vector<ChunkCode> codes(queries.size());
  CodeWalk::Changes changes;
  changes.columns.resize(2 * kChunkColumns * queries.size() + 2);
  changes.counts.resize(queries.size());
  core::AlignedBuffer<Weight> rows(kChunkColumns * kMostUnits<Weight>);
  for (const PairChunk& chunk : chunks) {
    const auto order = orders.of(chunk.one, chunk.other);
    for (std::size_t q = 0; q < order.size(); ++q) steps[q] = {order[q], q == 0};
    for (std::size_t k = 0; k < chunk.words.size(); ++k) {
      const std::size_t p = chunk.words[k] / code.n_pair_words();
      const std::size_t w = chunk.words[k] % code.n_pair_words();
      const coding::InputPair pair = code.pair(p);
      for (std::size_t q = 0; q < order.size(); ++q) {
        code.encode_word(p, w, orders.bin(pair.modified, order[q]),
                         orders.bin(pair.modifier, order[q]), &codes[q].active[k],
                         &codes[q].positive[k]);
      }
    }
    list_steps(codes, chunk.words.size(), changes.columns.data(), changes.counts.data());
    for (std::size_t t = 0; t < tiles.n_tiles(); ++t) {
      const std::size_t width = tiles.width(t);
      for (std::size_t first = 0; first < width; first += kMostUnits<Weight>) {
        const std::size_t n = std::min(width - first, kMostUnits<Weight>);
        for (std::size_t k = 0; k < chunk.words.size(); ++k) {
          const Weight* row = tiles.tile(t) + 64 * chunk.words[k] * width + first;
          for (std::size_t slot = 64 * k; slot < 64 * (k + 1); ++slot, row += width) {
            std::copy_n(row, n, rows.data() + slot * n);
          }
        }
        walk_chunk(rows.data(), n, steps, changes, potentials + t * kTileUnits + first,
                   tiles.n_padded_units());
      }
    }
  }
}

}  // namespace sdnn::estimators
