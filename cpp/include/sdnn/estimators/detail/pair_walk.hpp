/// Potentials of a block of samples, summed by pairs of inputs.
///
/// A sum of weights over a sample's code is that of the sample before, changed by the columns in
/// which the two codes differ, so consecutive samples should have similar codes. With many inputs
/// no single order achieves that. But the columns of a pair of inputs depend on two inputs alone.
/// So each pair has a separate order of the samples, a short walk through the plane of the two
/// inputs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/estimators/detail/code_walk.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// A chunk of a code: 1, 2 or kChunkWords words that depend on the same two inputs.
struct PairChunk {
  std::size_t input;
  std::size_t other_input;
  std::vector<std::size_t> words;
  std::size_t position = 0;  ///< position of its first word among those of all chunks
};

/// Divides all words of a code into chunks, large chunks first. The pairs (a, b) and (b, a)
/// of two inputs share chunks.
inline std::vector<PairChunk> pair_chunks(const coding::SelectiveDesensitization& code) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> words;
  for (std::size_t p = 0; p < code.n_pairs(); ++p) {
    const coding::InputPair pair = code.pair(p);
    for (std::size_t w = p * code.n_pair_words(); w < (p + 1) * code.n_pair_words(); ++w) {
      words[std::minmax(pair.modified, pair.modifier)].push_back(w);
    }
  }
  std::vector<PairChunk> chunks;
  std::size_t position = 0;
  for (const std::size_t size : {kChunkWords, std::size_t{2}, std::size_t{1}}) {
    for (auto& [inputs, left] : words) {
      for (; left.size() >= size; left.resize(left.size() - size), position += size) {
        const auto last = std::span(left).last(size);
        chunks.push_back({inputs.first, inputs.second, {last.begin(), last.end()}, position});
      }
    }
  }
  return chunks;
}

/// Orders of the samples, for any two inputs, in which successive codes differ in few units: the
/// bins of one input are divided into strips, and the walk passes strip after strip, alternately up
/// and down the bins of the other input.
class PairWalks {
 public:
  /// Sorts the samples by the bins of each input, from which any pair is ordered quickly. Shapes:
  /// bins (n_samples, n_inputs), at most CodeWalk::kMostSamples.
  PairWalks(const coding::SelectiveDesensitization& code, std::span<const std::int32_t> bins)
      : code_(code),
        inputs_(code.n_inputs()),
        order_(bins.size() / code.n_inputs()),
        columns_(kChunkColumns * order_.size() + 2) {  // list_steps may write 2 more
    // With n points in a unit square and k strips, a walk is about k + n / (3 k) long: k along the
    // strips, and 1 / (3 k), the mean distance of two points across a strip, for each point. It is
    // shortest for k = sqrt(n / 3). Where that needs half as many strips as bins, each bin is a
    // strip.
    const auto n_wide_strips = static_cast<std::size_t>(
        std::max(1.0, std::round(std::sqrt(static_cast<double>(order_.size()) / 3.0))));
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const std::size_t n_bins = code.n_bins(i);
      if (n_bins == 0) continue;
      const std::size_t n_strips = 2 * n_wide_strips < n_bins ? n_wide_strips : n_bins;
      Input& input = inputs_[i];
      input.begins.resize(n_strips + 1);
      // Counting sorts of the samples, by strips and by bins.
      std::vector<std::uint32_t> next_of_bin(n_bins + 1);
      for (std::size_t s = 0; s < order_.size(); ++s) {
        const std::int32_t bin = bins[s * inputs_.size() + i];
        input.bins.push_back(bin);
        input.strips.push_back(
            static_cast<std::uint32_t>(static_cast<std::uint64_t>(bin) * n_strips / n_bins));
        ++input.begins[input.strips[s] + 1];
        ++next_of_bin[static_cast<std::size_t>(bin) + 1];
      }
      std::partial_sum(input.begins.begin(), input.begins.end(), input.begins.begin());
      std::partial_sum(next_of_bin.begin(), next_of_bin.end(), next_of_bin.begin());
      input.sorted.resize(order_.size());
      for (std::size_t s = 0; s < order_.size(); ++s) {
        input.sorted[next_of_bin[static_cast<std::size_t>(input.bins[s])]++] =
            static_cast<std::uint32_t>(s);
      }
    }
  }

  /// Finds the walk through the codes of all samples in a chunk.
  void find(const PairChunk& chunk, CodeWalk& walk) {
    const Input& input = inputs_[chunk.input];
    const Input& other = inputs_[chunk.other_input];
    walk.step_of_sample.resize(order_.size());
    codes_.clear();
    std::pair last{-1, -1};
    sort(input, other);
    for (const std::uint32_t sample : order_) {
      const std::pair now{input.bins[sample], other.bins[sample]};
      if (now != last) add_code(chunk, sample);
      walk.step_of_sample[sample] = static_cast<std::uint16_t>(codes_.size() - 1);
      last = now;
    }
    walk.steps.resize(codes_.size());
    const std::uint8_t* const end =
        list_steps(codes_, chunk.words.size(), columns_.data(), walk.steps.data());
    walk.columns.assign(static_cast<const std::uint8_t*>(columns_.data()), end);
  }

 private:
  /// An input's bins and strips of all samples, with the samples sorted by them.
  struct Input {
    std::vector<std::int32_t> bins;     // by sample
    std::vector<std::uint32_t> strips;  // by sample
    std::vector<std::uint32_t> begins;  // where strips begin if samples are sorted by them; the end
    std::vector<std::uint32_t> sorted;  // samples in the order of their bins
  };

  /// Orders the samples by strips of one input, and within these by the other input, upwards and
  /// downwards in turn.
  void sort(const Input& striped, const Input& other) {
    begins_.assign(striped.begins.begin(), striped.begins.end() - 1);
    ends_.assign(striped.begins.begin() + 1, striped.begins.end());
    for (const std::uint32_t sample : other.sorted) {
      const std::uint32_t strip = striped.strips[sample];
      order_[strip % 2 == 0 ? begins_[strip]++ : --ends_[strip]] = sample;
    }
  }

  /// Appends the code of a sample in a chunk.
  void add_code(const PairChunk& chunk, std::uint32_t sample) {
    ChunkCode& code = codes_.emplace_back();
    for (std::size_t k = 0; k < chunk.words.size(); ++k) {
      const std::size_t p = chunk.words[k] / code_.n_pair_words();
      const coding::InputPair pair = code_.pair(p);
      code_.encode_word(p, chunk.words[k] % code_.n_pair_words(),
                        inputs_[pair.modified].bins[sample], inputs_[pair.modifier].bins[sample],
                        &code.active[k], &code.positive[k]);
    }
  }

  const coding::SelectiveDesensitization& code_;
  std::vector<Input> inputs_;
  std::vector<std::uint32_t> order_, begins_, ends_;
  std::vector<ChunkCode> codes_;
  std::vector<std::uint8_t> columns_;
};

/// The number of chunks whose sums are added together, limited by the second-level cache.
inline constexpr std::size_t kMostChunks = 4;
/// The number of chunks whose walks are computed at a time, so that potentials stay in the caches.
inline constexpr std::size_t kWalks = 32;

/// Buffers to add the contributions of chunks of columns to potentials, some chunks at a time.
template <class Weight>
class ChunkSums {
 public:
  /// Makes buffers for up to n_chunks chunks at a time, whose total sum must fit into Weight.
  ChunkSums(std::size_t n_samples, std::size_t n_chunks)
      : n_samples_(n_samples),
        n_chunks_(std::min(n_chunks, kMostChunks)),
        rows_(kChunkColumns * kMostUnits<Weight>),
        sums_(n_chunks_ * n_samples * kMostUnits<Weight>) {}

  static constexpr std::uint64_t bytes(std::uint64_t n_samples) noexcept {
    return sizeof(Weight) * kMostUnits<Weight> * (kChunkColumns + kMostChunks * n_samples);
  }

  /// Adds to potentials[s * stride + i], i = 0 .. width - 1, the products of the samples' codes in
  /// the walks' chunks. read_rows(k, rows) writes the weights of the k-th chunk, (columns, width).
  template <class ReadRows>
  void add(std::span<const CodeWalk> walks, std::size_t width, const ReadRows& read_rows,
           std::int32_t* potentials, std::size_t stride) {
    std::array<StepSums<Weight>, kMostChunks> added;
    for (std::size_t k = 0, n = 0; k < walks.size(); ++k) {
      read_rows(k, rows_.data());
      Weight* const sums = sums_.data() + n * n_samples_ * width;
      sum_steps(rows_.data(), width, walks[k], sums);
      added[n++] = {sums, walks[k].step_of_sample.data()};
      if (n < n_chunks_ && k + 1 < walks.size()) continue;
      add_step_sums(std::span<const StepSums<Weight>>(added).first(n), width, n_samples_,
                    potentials, stride);
      n = 0;
    }
  }

 private:
  std::size_t n_samples_;
  std::size_t n_chunks_;
  core::AlignedBuffer<Weight> rows_;
  core::AlignedBuffer<Weight> sums_;  // (n_chunks, n_samples, width)
};

/// Adds to potentials[(layer * n_samples + s) * n_padded_units + i] the product of the weights of
/// unit i in a layer and the code of sample s. All layers have one size.
///
/// The sum of a unit's |weights| over any n_chunks chunks must fit into Weight. Shapes: bins
/// (n_samples, n_inputs).
template <class Weight>
void add_codes(const coding::SelectiveDesensitization& code,
               std::span<const WeightTiles<Weight>* const> layers, std::size_t n_chunks,
               std::span<const std::int32_t> bins, std::int32_t* potentials) {
  const std::size_t n_samples = bins.size() / code.n_inputs();
  const auto chunks = pair_chunks(code);
  PairWalks pair_walks(code, bins);
  ChunkSums<Weight> sums(n_samples, n_chunks);
  std::vector<CodeWalk> walks;
  for (std::size_t done = 0; done < chunks.size(); done += walks.size()) {
    walks.resize(std::min(kWalks, chunks.size() - done));
    for (std::size_t k = 0; k < walks.size(); ++k) pair_walks.find(chunks[done + k], walks[k]);
    std::int32_t* to = potentials;
    for (const WeightTiles<Weight>* const tiles : layers) {
      for (std::size_t first = 0; first < tiles->n_padded_units(); first += kMostUnits<Weight>) {
        const std::size_t t = first / kTileUnits;
        const std::size_t n = std::min(tiles->n_padded_units() - first, kMostUnits<Weight>);
        const auto read_rows = [&](std::size_t k, Weight* rows) {
          for (const std::size_t word : chunks[done + k].words) {
            const Weight* row = tiles->tile(t) + 64 * word * tiles->width(t) + first % kTileUnits;
            const std::size_t n_together = n == tiles->width(t) ? 64 : 1;  // the faster choice
            for (std::size_t slot = 0; slot < 64; slot += n_together) {
              rows = std::copy_n(row, n_together * n, rows);
              row += n_together * tiles->width(t);
            }
          }
        };
        sums.add(walks, n, read_rows, to + first, tiles->n_padded_units());
      }
      to += n_samples * tiles->n_padded_units();
    }
  }
}

}  // namespace sdnn::estimators
