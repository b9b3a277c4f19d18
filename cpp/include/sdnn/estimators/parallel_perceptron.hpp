/// A layer of perceptrons over the desensitized code of a sample, in exact integers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/detail/threads.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/estimators/detail/pair_walk.hpp"
#include "sdnn/estimators/detail/query_order.hpp"
#include "sdnn/estimators/detail/unit_ranking.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// The limit of the bytes of a layer's weights, 4 GiB.
inline constexpr std::uint64_t kMaxWeightBytes = std::uint64_t{1} << 32;

/// A layer of `n_units` units over the columns of a code. A unit's potential is weights . x_SD -
/// threshold; it fires if that is above 0.
///
/// No potential can overflow: for every unit, |threshold| plus the sum of |weights| is below 2^31,
/// which is checked wherever weights come from.
///
/// Source: Nonaka, Tanaka, Morita 2011. Thread safety: const calls may run at the same time.
class ParallelPerceptron {
 public:
  using Code = coding::SelectiveDesensitization;

  /// Draws weights and thresholds uniformly from the integers in [-initial_range, initial_range],
  /// unit by unit, the threshold first.
  ///
  /// Throws std::invalid_argument unless n_units is in [1, 2^20] and initial_range in [0, 10^6],
  /// std::length_error if the weights have more than kMaxWeightBytes. The computation may be
  /// interrupted.
  ParallelPerceptron(std::shared_ptr<const Code> code, std::size_t n_units, std::uint64_t seed,
                     int initial_range = 5)
      : ParallelPerceptron(std::move(code), n_units) {
    core::require_in_range("initial_range", initial_range, 0, 1000000);
    core::Random random(seed, core::Stream::weights);
    const auto span = static_cast<std::uint64_t>(2 * initial_range + 1);
    const auto draw = [&] { return static_cast<std::int32_t>(random.below(span)) - initial_range; };
    const std::vector<std::size_t> slots = slots_of_columns();
    for (std::size_t i = 0; i < n_units; ++i) {
      core::interruption_point();
      thresholds_[i] = draw();
      for (const std::size_t slot : slots) weights_.at(i, slot) = draw();
    }
    check_norms();
  }

  /// Takes weights and thresholds.
  ///
  /// Shapes: weights (n_units, n_columns), thresholds (n_units,). Throws std::invalid_argument for
  /// other sizes, std::overflow_error if a potential could overflow.
  ParallelPerceptron(std::shared_ptr<const Code> code, std::size_t n_units,
                     std::span<const std::int32_t> weights,
                     std::span<const std::int32_t> thresholds)
      : ParallelPerceptron(std::move(code), n_units) {
    const std::size_t n_columns = code_->n_columns();
    core::require(weights.size() == n_units * n_columns, "weights",
                  "n_units * n_columns = " + std::to_string(n_units * n_columns) + " values",
                  weights.size());
    core::require(thresholds.size() == n_units, "thresholds",
                  "n_units = " + std::to_string(n_units) + " values", thresholds.size());
    const std::int32_t* weight = weights.data();
    const std::vector<std::size_t> slots = slots_of_columns();
    for (std::size_t i = 0; i < n_units; ++i) {
      core::interruption_point();
      for (const std::size_t slot : slots) weights_.at(i, slot) = *weight++;
    }
    std::copy(thresholds.begin(), thresholds.end(), thresholds_.begin());
    check_norms();
  }

  const Code& code() const noexcept { return *code_; }
  std::size_t n_units() const noexcept { return weights_.n_units(); }
  std::size_t n_padded_units() const noexcept { return weights_.n_padded_units(); }
  std::int32_t weight(std::size_t unit, std::size_t column) const noexcept {
    return weights_.at(unit, code_->slot_of(column));
  }
  std::int32_t threshold(std::size_t unit) const noexcept { return thresholds_[unit]; }

  /// All weights, in the order of the columns. Shapes: out (n_units, n_columns). Throws
  /// std::invalid_argument for another size.
  void copy_weights(std::span<std::int32_t> out) const {
    require_size(out, n_units() * code_->n_columns());
    const std::vector<std::size_t> slots = slots_of_columns();
    std::int32_t* weight = out.data();
    for (std::size_t i = 0; i < n_units(); ++i) {
      for (const std::size_t slot : slots) *weight++ = weights_.at(i, slot);
    }
  }

  /// The weights for trainers, who must use check_norms() to ensure that no potential can overflow.
  WeightTiles<std::int32_t>& tiles() noexcept {
    narrow_.reset();
    return weights_;
  }
  const WeightTiles<std::int32_t>& tiles() const noexcept { return weights_; }
  std::span<std::int32_t> thresholds() noexcept { return thresholds_; }
  std::span<const std::int32_t> thresholds() const noexcept { return thresholds_; }

  /// Returns the largest sum of |weights| and |threshold| of a unit, a bound of all potentials.
  /// Throws std::overflow_error if it is 2^31 or more.
  std::int64_t check_norms() const {
    std::vector<std::int64_t> norms(n_padded_units());
    for (std::size_t tile = 0; tile < weights_.n_tiles(); ++tile) {
      const std::int32_t* row = weights_.tile(tile);
      const std::size_t width = weights_.width(tile);
      for (std::size_t slot = 0; slot < weights_.n_slots(); ++slot, row += width) {
        for (std::size_t i = 0; i < width; ++i) {
          norms[tile * kTileUnits + i] += std::abs(std::int64_t{row[i]});
        }
      }
    }
    std::int64_t largest = 0;
    for (std::size_t i = 0; i < n_units(); ++i) {
      const std::int64_t norm = norms[i] + std::abs(std::int64_t{thresholds_[i]});
      if (norm > std::numeric_limits<std::int32_t>::max()) {
        core::fail(std::overflow_error("the weights of unit " + std::to_string(i) +
                                       " must have absolute values of a sum below 2^31, got " +
                                       std::to_string(norm)));
      }
      largest = std::max(largest, norm);
    }
    return largest;
  }

  using Layers = std::span<const ParallelPerceptron* const>;

  /// Calls consume(layer, query, potentials) once for each layer and query, in any order and from
  /// up to `n_threads` threads at a time.
  ///
  /// Potentials are derived from those of a similar query or, if few are similar, summed by pairs
  /// of inputs, whose contributions many queries share. Shapes: bins (n_queries, n_inputs),
  /// potentials (n_padded_units,), whose first n_units are valid. Throws std::invalid_argument for
  /// no layers or layers that differ in code or size, bins out of range or n_threads < 1.
  template <class Consume>
  static void for_each_query(Layers layers, std::span<const std::int32_t> bins, int n_threads,
                             const Consume& consume) {
    core::require(!layers.empty(), "layers", "at least one layer", layers.size());
    const Code& code = *layers[0]->code_;
    for (const ParallelPerceptron* const layer : layers) {
      core::require(layer->code_ == layers[0]->code_ && layer->n_units() == layers[0]->n_units(),
                    "layers", "of one code and size", "another one");
    }
    core::require_in_range("n_threads", n_threads, 1, 4096);
    code.check_bins(bins);
    const auto order = query_order(bins, code.n_inputs());
    NarrowWeights narrow;
    if (order.size() > kFewQueries) {
      for (const ParallelPerceptron* const layer : layers) {
        narrow.push_back(layer->narrow_.get([&] { return Narrow(code, layer->weights_); }));
      }
    }
    if (narrow.empty() || is_short_walk(code, bins, order)) {
      sweep_queries(layers, narrow, bins, order, n_threads, consume);
    } else {
      add_pairs(layers, narrow, bins, n_threads, consume);
    }
  }
  /// Calls consume(query, potentials) for this layer.
  template <class Consume>
  void for_each_query(std::span<const std::int32_t> bins, int n_threads,
                      const Consume& consume) const {
    const ParallelPerceptron* const alone = this;
    for_each_query(Layers(&alone, 1), bins, n_threads,
                   [&](std::size_t, std::size_t query, const std::int32_t* values) {
                     consume(query, values);
                   });
  }

  /// Writes the potentials in the order of the queries. Shapes: bins (n_queries, n_inputs), out
  /// (n_queries, n_units). Throws std::invalid_argument for other sizes or bins out of range.
  void potentials(std::span<const std::int32_t> bins, int n_threads,
                  std::span<std::int32_t> out) const {
    require_size(out, bins.size() / code_->n_inputs() * n_units());
    const auto copy = [&](std::size_t query, const std::int32_t* values) {
      std::copy_n(values, n_units(), out.data() + query * n_units());
    };
    for_each_query(bins, n_threads, copy);
  }

  /// Returns the number of units in each of n_groups equal groups. Throws std::invalid_argument
  /// unless it divides n_units.
  std::size_t group_size(std::size_t n_groups) const {
    core::require(n_groups > 0 && n_units() % n_groups == 0, "n_groups",
                  "a divisor of n_units = " + std::to_string(n_units()), n_groups);
    return n_units() / n_groups;
  }

  /// Counts the firing units of each layer in each of `n_groups` equal groups. Shapes: bins
  /// (n_queries, n_inputs), out (n_layers, n_queries, n_groups). Throws std::invalid_argument
  /// unless n_groups divides n_units, the sizes fit and bins are in range.
  static void counts(Layers layers, std::span<const std::int32_t> bins, std::size_t n_groups,
                     int n_threads, std::span<std::int32_t> out) {
    core::require(!layers.empty(), "layers", "at least one layer", layers.size());
    const std::size_t size = layers[0]->group_size(n_groups);
    const std::size_t n_queries = bins.size() / layers[0]->code_->n_inputs();
    require_size(out, layers.size() * n_queries * n_groups);
    const auto count = [&](std::size_t layer, std::size_t query, const std::int32_t* values) {
      for (std::size_t g = 0; g < n_groups; ++g) {
        out[(layer * n_queries + query) * n_groups + g] = count_firing(values + g * size, size);
      }
    };
    for_each_query(layers, bins, n_threads, count);
  }
  /// Counts the firing units of this layer. Shapes: out (n_queries, n_groups).
  void counts(std::span<const std::int32_t> bins, std::size_t n_groups, int n_threads,
              std::span<std::int32_t> out) const {
    const ParallelPerceptron* const alone = this;
    counts(Layers(&alone, 1), bins, n_groups, n_threads, out);
  }

 private:
  static void require_size(std::span<std::int32_t> out, std::size_t n) {
    if (out.size() != n) {
      core::require(false, "out", "of " + std::to_string(n) + " numbers", out.size());
    }
  }

  ParallelPerceptron(std::shared_ptr<const Code> code, std::size_t n_units)
      : code_(std::move(code)) {
    core::require_in_range("n_units", n_units, 1, std::size_t{1} << 20);
    core::require_bytes("n_units, or the columns of the code,", "the weights of all units",
                        4.0 * static_cast<double>(n_units) * static_cast<double>(code_->n_slots()),
                        kMaxWeightBytes);
    weights_ = WeightTiles<std::int32_t>(n_units, code_->n_slots());
    thresholds_.resize(n_units);
  }

  std::vector<std::size_t> slots_of_columns() const {
    std::vector<std::size_t> slots(code_->n_columns());
    for (std::size_t j = 0; j < slots.size(); ++j) slots[j] = code_->slot_of(j);
    return slots;
  }

  /// The weights in 16 bits, which halves the memory to read, if the sums of a unit's |weights| in
  /// each chunk of columns fit, too; otherwise n_chunks is 0 and there are no tiles.
  struct Narrow {
    Narrow(const Code& code, const WeightTiles<std::int32_t>& weights) {
      std::int64_t largest = 1;  // bound of the sum of a unit's |weights| in a chunk
      for (const PairChunk& chunk : pair_chunks(code)) {
        std::int64_t norm = 0;
        for (const std::size_t word : chunk.words) {
          norm += weights.largest_norm(64 * word, 64 * (word + 1));
        }
        largest = std::max(largest, norm);
      }
      constexpr std::int64_t kLargest = std::numeric_limits<std::int16_t>::max();
      n_chunks = static_cast<std::size_t>(kLargest / largest);
      if (n_chunks == 0) return;
      tiles = WeightTiles<std::int16_t>(weights);
      n_per_sum = static_cast<std::size_t>(kLargest / std::max(tiles.largest(), std::int64_t{1}));
    }
    std::size_t n_chunks;       // number of chunks whose total sum fits into 16 bits
    std::size_t n_per_sum = 0;  // number of weights whose sum fits into 16 bits
    WeightTiles<std::int16_t> tiles;
  };

  /// Copies of the layers' weights in 16 bits; none for few queries.
  using NarrowWeights = std::vector<std::shared_ptr<const Narrow>>;

  /// Calls consume(layer, query, potentials), where the potentials of each query follow from those
  /// of the query before in `order`, by the columns that differ.
  template <class Consume>
  static void sweep_queries(Layers layers, const NarrowWeights& narrow,
                            std::span<const std::int32_t> bins,
                            std::span<const std::uint32_t> order, int n_threads,
                            const Consume& consume) {
    const auto sweep = [&](std::size_t begin, std::size_t end) {
      const auto queries = order.subspan(begin, end - begin);
      for (std::size_t k = 0; k < layers.size(); ++k) {
        const auto answer = [&](const auto& tiles, std::size_t n_per_sum) {
          layers[k]->sweep(
              tiles, n_per_sum, bins, queries,
              [&](std::size_t query, const std::int32_t* values) { consume(k, query, values); });
        };
        if (narrow.empty() || narrow[k]->n_chunks == 0) {
          answer(layers[k]->weights_, std::size_t{1} << 30);  // no potential can overflow
        } else {
          answer(narrow[k]->tiles, narrow[k]->n_per_sum);
        }
      }
    };
    in_parts(order.size(), layers[0]->most_at_once(kSweptAtOnce), n_threads, sweep);
  }

  /// Calls consume(layer, query, potentials), where potentials are sums of the contributions of
  /// pairs of inputs. All layers use their narrow weights if those of each fit.
  template <class Consume>
  static void add_pairs(Layers layers, const NarrowWeights& narrow,
                        std::span<const std::int32_t> bins, int n_threads, const Consume& consume) {
    const Code& code = *layers[0]->code_;
    const auto answer = [&](const auto& tiles, std::size_t n_chunks) {
      const std::size_t n_padded = layers[0]->n_padded_units();
      const auto add = [&](std::size_t begin, std::size_t end) {
        const std::size_t n = end - begin;
        std::vector<std::int32_t> values(layers.size() * n * n_padded);
        for (std::size_t k = 0; k < layers.size() * n; ++k) {
          layers[k / n]->start_from_zero(&values[k * n_padded]);
        }
        add_codes(code, std::span(tiles), n_chunks,
                  bins.subspan(begin * code.n_inputs(), n * code.n_inputs()), values.data());
        for (std::size_t k = 0; k < layers.size() * n; ++k) {
          consume(k / n, begin + k % n, &values[k * n_padded]);
        }
      };
      in_parts(bins.size() / code.n_inputs(), layers[0]->most_at_once(kAddedAtOnce / layers.size()),
               n_threads, add);
    };
    const auto& worst = *std::ranges::min_element(
        narrow, {}, [](const auto& weights) { return weights->n_chunks; });
    std::vector<const WeightTiles<std::int16_t>*> tiles;
    std::vector<const WeightTiles<std::int32_t>*> wide_tiles;
    for (std::size_t k = 0; k < layers.size(); ++k) {
      tiles.push_back(&narrow[k]->tiles);
      wide_tiles.push_back(&layers[k]->weights_);
    }
    worst->n_chunks > 0 ? answer(tiles, worst->n_chunks) : answer(wide_tiles, kMostChunks);
  }

  /// Writes the potentials of a code without active columns: minus the thresholds.
  void start_from_zero(std::int32_t* potentials) const noexcept {
    for (std::size_t i = 0; i < n_units(); ++i) potentials[i] = -thresholds_[i];
  }

  /// Computes potentials from query to query, by the columns in which their codes differ.
  template <class Weight, class Consume>
  void sweep(const WeightTiles<Weight>& tiles, std::size_t n_per_sum,
             std::span<const std::int32_t> bins, std::span<const std::uint32_t> order,
             const Consume& consume) const {
    const std::size_t n_words = code_->n_words();
    std::vector<std::uint64_t> words(4 * n_words);
    std::uint64_t* now = words.data();  // active, then positive
    std::uint64_t* before = now + 2 * n_words;
    std::vector<std::int32_t> values(n_padded_units());
    start_from_zero(values.data());
    coding::ColumnLists slots(n_words);
    for (const std::uint32_t query : order) {
      code_->encode(bins.subspan(query * code_->n_inputs(), code_->n_inputs()), now, now + n_words);
      const coding::TernaryCode next{now, now + n_words};
      slots.read_changes({before, before + n_words}, next);
      // A code may be nearer to zero. Counting takes time, and so is done after large changes only.
      const std::size_t n_changes = slots.columns().size();
      if (n_changes > code_->max_active() / 2 && n_changes > coding::n_active(next, n_words)) {
        start_from_zero(values.data());
        slots.read(next);
      }
      tiles.add_columns(slots.columns(), n_per_sum, values.data());
      consume(query, values.data());
      std::swap(now, before);
    }
  }

  /// Whether so few columns change between consecutive queries that a sweep is fastest, estimated
  /// from a sample of queries.
  static bool is_short_walk(const Code& code, std::span<const std::int32_t> bins,
                            std::span<const std::uint32_t> order) {
    const std::size_t n_words = code.n_words();
    std::vector<std::uint64_t> words(4 * n_words);
    const auto code_at = [&](std::size_t position, std::uint64_t* to) {
      code.encode(bins.subspan(order[position] * code.n_inputs(), code.n_inputs()), to,
                  to + n_words);
      return coding::TernaryCode{to, to + n_words};
    };
    coding::ColumnLists slots(n_words);
    std::size_t n_changes = 0, n_steps = 0;
    const std::size_t step = order.size() / kFewQueries;
    for (std::size_t i = 1; i < order.size(); i += step, ++n_steps) {
      slots.read_changes(code_at(i - 1, words.data()), code_at(i, words.data() + 2 * n_words));
      n_changes += slots.columns().size();
    }
    return n_changes < kChangesPerWord * n_steps * n_words;
  }

  /// Returns the number of queries of a thread between two checks for an interruption, such that
  /// they need about `n_added` additions of weights.
  std::size_t most_at_once(std::uint64_t n_added) const noexcept {
    const std::uint64_t n_added_per_query = std::uint64_t{code_->n_slots()} * n_padded_units();
    return static_cast<std::size_t>(
        std::clamp<std::uint64_t>(n_added / n_added_per_query, 64, 4096));
  }

  /// Calls work(begin, end) for parts of up to `most` queries, n_threads of them at a time, and
  /// rethrows their exceptions.
  template <class Work>
  static void in_parts(std::size_t n_queries, std::size_t most, int n_threads, const Work& work) {
    constexpr std::size_t kQueriesPerThread = 256;  // fewer are not worth a thread
    const auto n_parts = std::min(static_cast<std::size_t>(n_threads),
                                  (n_queries + kQueriesPerThread - 1) / kQueriesPerThread);
    const std::size_t n_rounds = n_queries == 0 ? 0 : (n_queries - 1) / (most * n_parts) + 1;
    const auto begin_of = [&](std::uint64_t k) {
      return static_cast<std::size_t>(k * n_queries / (n_rounds * n_parts));
    };
    std::vector<std::exception_ptr> errors(n_parts);
    for (std::size_t k = 0; k < n_rounds * n_parts; k += n_parts) {
      core::interruption_point();
      const auto try_part = [&, k](std::size_t part) noexcept {
#if SDNN_EXCEPTIONS
        try {
          work(begin_of(k + part), begin_of(k + part + 1));
        } catch (...) {
          errors[part] = std::current_exception();
        }
#else
        work(begin_of(k + part), begin_of(k + part + 1));
#endif
      };
      {
        core::Threads threads;  // joined at the end of the scope
        for (std::size_t part = 1; part < n_parts; ++part) threads.start(try_part, part);
        try_part(0);
      }
      for (const std::exception_ptr& error : errors) {
        if (error) std::rethrow_exception(error);
      }
    }
  }

  static constexpr std::size_t kFewQueries = 8;  // for so few, weights are not copied to 16 bits
  static constexpr std::size_t kChangesPerWord = 4;  // above it a sum by pairs beats a sweep
  // Additions of weights in a tenth of a second; a sum by pairs skips most of them.
  static constexpr std::uint64_t kSweptAtOnce = std::uint64_t{1} << 32;
  static constexpr std::uint64_t kAddedAtOnce = std::uint64_t{1} << 36;

  std::shared_ptr<const Code> code_;
  WeightTiles<std::int32_t> weights_;
  std::vector<std::int32_t> thresholds_;
  core::OnDemand<Narrow> narrow_;
};

}  // namespace sdnn::estimators
