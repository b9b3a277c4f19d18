/// Training in blocks of samples, for any number of samples.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/detail/worker_team.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/detail/code_walk.hpp"
#include "sdnn/estimators/detail/pair_walk.hpp"
#include "sdnn/estimators/detail/presentation_window.hpp"
#include "sdnn/estimators/detail/signed_sums.hpp"
#include "sdnn/estimators/detail/transposition.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"
#include "sdnn/estimators/parallel_perceptron.hpp"

namespace sdnn::estimators {

/// Training that computes the potentials of a block of samples in one pass over the weights.
///
/// The pass takes a few columns of some units at a time, which stay in the cache. These columns
/// belong to two inputs, and the samples are visited along a short walk through the bins of these
/// inputs (see PairWalks). The effect of a correction on the potentials of later samples in the
/// block follows exactly from the inner products of their codes (see PresentationWindow). The
/// weights are corrected before the next pass, all corrections of a unit together. Weights have 16
/// bits, or 32 as soon as a sum of them could exceed 16 bits.
///
/// A block's walks and products depend on its samples alone. They are its *plan*, which is kept if
/// there is memory for the plans of all samples, divided into large blocks in the order of the
/// data. `Product` is an integer type that holds 1 plus any inner product of codes.
template <class Product>
class BlockTraining {
 public:
  BlockTraining(std::shared_ptr<ParallelPerceptron> layer, std::span<const std::int32_t> bins,
                int n_threads, bool keeps_plans)
      : layer_(std::move(layer)),
        bins_(bins.begin(), bins.end()),
        chunks_(pair_chunks(layer_->code())),
        word_order_(order_of(chunks_, words_for(layer_->code()))),
        n_words_(word_order_.size()),
        team_(static_cast<std::size_t>(n_threads)),
        most_samples_(keeps_plans ? kLargeBlock : kSmallBlock),
        keeps_plans_(keeps_plans),
        plans_(keeps_plans
                   ? (bins_.size() / layer_->code().n_inputs() + kLargeBlock - 1) / kLargeBlock
                   : 0),
        words_(2 * most_samples_ * n_words_),
        entries_(64 * most_samples_ * n_words_),
        potentials_(most_samples_ * layer_->n_padded_units()),
        window_(layer_->n_padded_units(), most_samples_),
        pending_(layer_->n_units()),
        weights_(std::in_place_type<Wide>, std::as_const(*layer_).tiles(), word_order_),
        chunk_norm_(std::get<Wide>(weights_).largest_chunk_norm()) {
    if (chunk_norm_ <= kLargestSum) weights_ = Narrow(std::get<Wide>(weights_));
  }

  /// Presents samples in order; the rule corrects the units after each of them.
  template <class Rule>
  TrainingCount present(std::span<const std::int32_t> order, Rule& rule) {
    TrainingCount count;
    while (!order.empty()) {
      core::interruption_point();
      const bool is_large = begins_with_a_large_block(order);
      const std::size_t size = is_large ? large_size(order.front()) : kSmallBlock;
      const auto block = order.first(std::min(order.size(), size));
      Plan plan;
      count += present_block(block, is_large ? &plans_[block_of(order.front())] : &plan, rule);
      order = order.subspan(block.size());
    }
    return count;
  }

  /// Returns the bytes beside the layer and the samples' bins; an estimate at most 1 % too low.
  static std::uint64_t bytes(std::size_t n_units, const coding::SelectiveDesensitization& code,
                             std::size_t n_samples, bool keeps_plans) noexcept {
    const std::uint64_t n_padded = core::round_up(n_units, kTileStep);
    const std::uint64_t n_words = words_for(code);
    const std::size_t n_chunks = pair_chunks(code).size();
    const std::size_t size = keeps_plans ? kLargeBlock : kSmallBlock;
    const auto plan_bytes = [&](std::uint64_t n) {
      return sizeof(Product) * n * size + CodeWalk::bytes(n, n_chunks, code.max_active());
    };
    return Wide::bytes(n_padded, n_words)                // weights_, or half of it
           + 2 * sizeof(std::uint64_t) * size * n_words  // words_
           + 64 * size * n_words                         // entries_
           + sizeof(std::int32_t) * size * n_padded      // potentials_
           + PresentationWindow::bytes(n_padded, size)   // window_
           + ChunkSums<std::int16_t>::bytes(size)        // sums of a thread
           + plan_bytes(size)                            // plan of the current block
           + (keeps_plans ? plan_bytes(n_samples) : 0);  // plans_
  }

  /// Copies the weights back to the layer.
  void synchronize() {
    std::visit([&](const auto& weights) { weights.copy_to(layer_->tiles(), word_order_); },
               weights_);
  }

 private:
  // The number of samples per pass over the weights, with and without kept plans. A larger block
  // needs fewer passes, but more inner products for each of its samples, which a kept plan has
  // already.
  static constexpr std::size_t kLargeBlock = 512;
  static constexpr std::size_t kSmallBlock = 256;

  /// The number of words of a code, padded to whole chunks of kChunkWords.
  static std::size_t words_for(const coding::SelectiveDesensitization& code) noexcept {
    return core::round_up(code.n_words(), kChunkWords);
  }

  /// The numbers of the words of all chunks in turn, then those of padding, up to `n_words`.
  static std::vector<std::size_t> order_of(std::span<const PairChunk> chunks, std::size_t n_words) {
    std::vector<std::size_t> order;
    for (const PairChunk& chunk : chunks) {
      order.insert(order.end(), chunk.words.begin(), chunk.words.end());
    }
    while (order.size() < n_words) order.push_back(order.size());
    return order;
  }

  using Narrow = ChunkedWeights<std::int16_t>;
  using Wide = ChunkedWeights<std::int32_t>;
  static constexpr std::int64_t kLargestSum = std::numeric_limits<std::int16_t>::max();

  /// The parts of a block that depend on its samples alone, and not on weights.
  struct Plan {
    std::vector<CodeWalk> walks;            // a walk for each chunk
    std::size_t stride = 0;                 // entries between the beginnings of rows of products
    core::AlignedBuffer<Product> products;  // (size, stride): 1 plus the inner product of two codes
  };

  /// The number of the large block that has a sample.
  static std::size_t block_of(std::int32_t sample) noexcept {
    return static_cast<std::size_t>(sample) / kLargeBlock;
  }
  /// The number of samples of the large block that has a sample; the last block may have fewer.
  std::size_t large_size(std::int32_t sample) const noexcept {
    const std::size_t n_samples = bins_.size() / layer_->code().n_inputs();
    return std::min(kLargeBlock, n_samples - block_of(sample) * kLargeBlock);
  }
  /// Whether the order begins with all samples of a large block, in the order of the data.
  bool begins_with_a_large_block(std::span<const std::int32_t> order) const noexcept {
    const auto first = static_cast<std::size_t>(order.front());
    if (!keeps_plans_ || first % kLargeBlock != 0 || order.size() < large_size(order.front())) {
      return false;
    }
    for (std::size_t i = 0; i < large_size(order.front()); ++i) {
      if (static_cast<std::size_t>(order[i]) != first + i) return false;
    }
    return true;
  }

  /// Presents a block of samples. An empty `plan` is filled first.
  template <class Rule>
  TrainingCount present_block(std::span<const std::int32_t> samples, Plan* plan, Rule& rule) {
    encode(samples);
    if (plan->walks.empty()) make_plan(samples, plan);
    sum_potentials(samples.size(), plan->walks);
    const TrainingCount count = window_.present(
        samples, plan->products.data(), plan->stride, rule,
        [&](std::size_t b, Correction correction) {
          pending_[correction.unit].add(entries_.data() + kChunkColumns * b, correction.direction);
          layer_->thresholds()[correction.unit] -= correction.direction;
        });
    correct_weights();
    return count;
  }

  /// The code of the sample at position b of the current block.
  coding::TernaryCode code_of(std::size_t b) const noexcept {
    const std::uint64_t* const active = words_.data() + 2 * b * n_words_;
    return {active, active + n_words_};
  }

  /// Computes the codes of a block's samples.
  void encode(std::span<const std::int32_t> samples) {
    const ParallelPerceptron::Code& code = layer_->code();
    team_.run_over(samples.size(), [&](std::size_t b) {
      std::uint64_t* const active = words_.data() + 2 * b * n_words_;
      code.encode(std::span(bins_).subspan(static_cast<std::size_t>(samples[b]) * code.n_inputs(),
                                           code.n_inputs()),
                  active, active + n_words_);
      expand_code(code_of(b), word_order_, kChunkWords, entries_.data() + kChunkColumns * b,
                  kChunkColumns * most_samples_);
    });
  }

  /// Computes the inner products of a block's codes, and the walks from code to code in each chunk.
  void make_plan(std::span<const std::int32_t> samples, Plan* plan) {
    plan->stride = core::round_up(samples.size(), PresentationWindow::kAtOnce);
    plan->products = core::AlignedBuffer<Product>(samples.size() * plan->stride);
    team_.run([&](std::size_t thread) {
      for (std::size_t b = thread; b < samples.size(); b += team_.size()) {
        for (std::size_t e = b; e < samples.size(); ++e) {  // products with later samples
          plan->products[b * plan->stride + e] =
              static_cast<Product>(1 + coding::inner_product(code_of(b), code_of(e), n_words_));
        }
      }
    });
    const std::size_t n_inputs = layer_->code().n_inputs();
    std::vector<std::int32_t> bins;
    for (const std::int32_t sample : samples) {
      const auto* const first = bins_.data() + static_cast<std::size_t>(sample) * n_inputs;
      bins.insert(bins.end(), first, first + n_inputs);
    }
    PairWalks walks(layer_->code(), bins);
    plan->walks.resize(chunks_.size());
    for (std::size_t k = 0; k < chunks_.size(); ++k) walks.find(chunks_[k], plan->walks[k]);
  }

  /// Computes the potentials of a block's samples with the present weights and thresholds.
  void sum_potentials(std::size_t n_samples, std::span<const CodeWalk> walks) {
    const std::size_t n_padded = layer_->n_padded_units();
    for (std::size_t b = 0; b < n_samples; ++b) {
      std::int32_t* const values = &potentials_[b * n_padded];
      for (std::size_t i = 0; i < layer_->n_units(); ++i) values[i] = -layer_->thresholds()[i];
    }
    std::visit([&](const auto& weights) { add_walks(weights, n_samples, walks); }, weights_);
    transpose(potentials_.data(), n_padded, n_samples, n_padded, window_.row(0), window_.stride());
  }

  /// Adds the products of weights and a block's codes to the potentials. Each thread takes some of
  /// the units.
  template <class Weight>
  void add_walks(const ChunkedWeights<Weight>& weights, std::size_t n_samples,
                 std::span<const CodeWalk> walks) {
    const std::size_t n_padded = layer_->n_padded_units();
    const std::size_t n_parts =
        core::round_up((n_padded + kMostUnits<Weight> - 1) / kMostUnits<Weight>, team_.size());
    const std::size_t width = core::round_up((n_padded + n_parts - 1) / n_parts, kTileStep);
    const std::size_t n_chunks_in_sum =  // as many as a sum in Weight holds
        std::is_same_v<Weight, std::int16_t>
            ? static_cast<std::size_t>(kLargestSum / std::max<std::int64_t>(chunk_norm_, 1))
            : kMostChunks;
    std::vector<ChunkSums<Weight>> sums(team_.size(),
                                        ChunkSums<Weight>(n_samples, n_chunks_in_sum));
    team_.run([&](std::size_t thread) {
      for (std::size_t first = thread * width; first < n_padded; first += team_.size() * width) {
        const std::size_t n = std::min(width, n_padded - first);
        const auto read_rows = [&](std::size_t k, Weight* rows) {
          const PairChunk& chunk = chunks_[k];
          transpose(weights.chunk(chunk.position / kChunkWords, first) +
                        chunk.position % kChunkWords * 64,
                    kChunkColumns, n, 64 * chunk.words.size(), rows, n);
        };
        sums[thread].add(walks, n, read_rows, potentials_.data() + first, n_padded);
      }
    });
  }

  /// Changes the weights by all corrections of a block at once.
  void correct_weights() {
    widen_before_sums_overflow();
    const auto correct = [&](auto& weights) {
      team_.run_over(weights.n_chunks(), [&](std::size_t chunk) {
        const std::size_t offset = chunk * kChunkColumns * most_samples_;
        for (std::size_t i = 0; i < layer_->n_units(); ++i) {
          if (pending_[i].empty()) continue;
          add_signed(weights.chunk(chunk, i), kChunkColumns, pending_[i], offset, kPerByte);
        }
      });
    };
    std::visit(correct, weights_);
    for (auto& rows : pending_) rows.clear();
  }

  /// Widens the weights to 32 bits if the pending corrections could make a sum exceed 16 bits. Each
  /// changes a weight by at most 1, so a unit's sum in a chunk by at most kChunkColumns. The stored
  /// bound is replaced by the true maximum before that is decided.
  void widen_before_sums_overflow() {
    const auto* const narrow = std::get_if<Narrow>(&weights_);
    if (narrow == nullptr) return;
    std::size_t most = 0;
    for (const auto& rows : pending_) most = std::max(most, rows.size());
    const auto growth = static_cast<std::int64_t>(most * kChunkColumns);
    if (chunk_norm_ + growth > kLargestSum) {
      chunk_norm_ = narrow->largest_chunk_norm();
      if (chunk_norm_ + growth > kLargestSum) weights_ = Wide(*narrow);
    }
    chunk_norm_ += growth;
  }

  /// The number of entries, +1, 0 or -1, whose sum a byte holds.
  static constexpr std::size_t kPerByte = std::numeric_limits<std::int8_t>::max();

  std::shared_ptr<ParallelPerceptron> layer_;
  std::vector<std::int32_t> bins_;
  std::vector<PairChunk> chunks_;
  std::vector<std::size_t> word_order_;  // order of the words in the weights
  std::size_t n_words_;
  core::WorkerTeam team_;
  std::size_t most_samples_;
  bool keeps_plans_;
  std::vector<Plan> plans_;           // plans of large blocks
  std::vector<std::uint64_t> words_;  // (most_samples, active then positive, n_words)
  core::AlignedBuffer<std::int8_t>
      entries_;  // (chunks, most_samples, kChunkColumns), each +1, 0 or -1
  core::AlignedBuffer<std::int32_t> potentials_;  // (most_samples, n_padded_units)
  PresentationWindow window_;
  std::vector<SignedRows<std::int8_t>>
      pending_;  // for each unit, codes not yet added to its weights
  std::variant<Narrow, Wide> weights_;
  std::int64_t chunk_norm_;  // bound of the sum of a unit's |weights| in a chunk, for 16 bits
};

}  // namespace sdnn::estimators
