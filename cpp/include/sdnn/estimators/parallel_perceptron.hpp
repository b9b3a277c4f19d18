/// A layer of perceptrons over the desensitized code of a sample, in exact integers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/estimators/detail/pair_walk.hpp"
#include "sdnn/estimators/detail/query_order.hpp"
#include "sdnn/estimators/detail/unit_ranking.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// The most bytes that the weights of a layer may have: 4 GiB.
inline constexpr std::uint64_t kMaxWeightBytes = std::uint64_t{1} << 32;

/// `n_units` units over the columns of a code: potential = weights . x_SD - threshold, firing if >
/// 0.
///
/// No potential can overflow: of every unit, |threshold| plus the sum of |weights| is below 2^31,
/// which is checked wherever weights come from.
///
/// Source: Nonaka, Tanaka, Morita 2011. Thread safety: const calls may run at the same time.
class ParallelPerceptron {
 public:
  using Code = coding::SelectiveDesensitization;

  /// Weights and thresholds are drawn uniformly from the integers in [-initial_range,
  /// initial_range], unit by unit, the threshold first.
  ///
  /// Throws std::invalid_argument unless n_units is in [1, 2^20] and initial_range in [0, 10^6],
  /// std::length_error if the weights have more than kMaxWeightBytes. Long work: may be stopped.
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

  /// Given weights and thresholds.
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

  /// Weights for trainers; check_norms() holds them to the layer's promise.
  WeightTiles<std::int32_t>& tiles() noexcept { return weights_; }
  const WeightTiles<std::int32_t>& tiles() const noexcept { return weights_; }
  std::span<std::int32_t> thresholds() noexcept { return thresholds_; }
  std::span<const std::int32_t> thresholds() const noexcept { return thresholds_; }

  /// The largest sum of |weights| and |threshold| of a unit, a bound of all potentials.
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

  /// Calls consume(query, potentials) once per query, in an order of its own and from up to
  /// `n_threads` threads at a time.
  ///
  /// Neighbouring queries share most of their code, so the potentials of one become those of the
  /// next by the columns in which they differ. Shapes: bins (n_queries, n_inputs), potentials
  /// (n_padded_units,), of which the first n_units mean something. Throws std::invalid_argument for
  /// bins out of range or n_threads < 1.
  template <class Consume>
  void for_each_query(std::span<const std::int32_t> bins, int n_threads,
                      const Consume& consume) const {
    core::require_in_range("n_threads", n_threads, 1, 4096);
    code_->check_bins(bins);
    const std::size_t n_queries = bins.size() / code_->n_inputs();
    if (n_queries == 0) return;
    const auto order = query_order(bins, code_->n_inputs());
    if (n_queries <= kFewQueries)
      return answer_all<Sweep>(weights_, bins, order, n_threads, consume);
    // A copy in 16 bits is half as much to read; it pays if many queries share it.
    const auto answer = [&]<class Way>(Way, bool is_narrow) {
      if (!is_narrow) return answer_all<Way>(weights_, bins, order, n_threads, consume);
      answer_all<Way>(WeightTiles<std::int16_t>(weights_), bins, order, n_threads, consume);
    };
    constexpr std::int64_t kLargest = std::numeric_limits<std::int16_t>::max();
    if (is_short_walk(bins, order)) return answer(Sweep{}, weights_.largest() <= kLargest / 16);
    answer(Blocks{}, largest_word_norm() <= kLargest / std::int64_t{kChunkWords});
  }

  /// Potentials in the order of the queries. Shapes: bins (n_queries, n_inputs), out
  /// (n_queries, n_units). Throws like for_each_query, and for an out of another size.
  void potentials(std::span<const std::int32_t> bins, int n_threads,
                  std::span<std::int32_t> out) const {
    require_size(out, bins.size() / code_->n_inputs() * n_units());
    const auto copy = [&](std::size_t query, const std::int32_t* values) {
      std::copy_n(values, n_units(), out.data() + query * n_units());
    };
    for_each_query(bins, n_threads, copy);
  }

  /// Number of units in each of n_groups. Throws std::invalid_argument unless it divides n_units.
  std::size_t group_size(std::size_t n_groups) const {
    core::require(n_groups > 0 && n_units() % n_groups == 0, "n_groups",
                  "a divisor of n_units = " + std::to_string(n_units()), n_groups);
    return n_units() / n_groups;
  }

  /// Number of firing units in each of `n_groups` equal groups. Shapes: bins
  /// (n_queries, n_inputs), out (n_queries, n_groups). Throws std::invalid_argument unless n_groups
  /// divides n_units, for an out of another size, and like for_each_query.
  void counts(std::span<const std::int32_t> bins, std::size_t n_groups, int n_threads,
              std::span<std::int32_t> out) const {
    const std::size_t size = group_size(n_groups);
    require_size(out, bins.size() / code_->n_inputs() * n_groups);
    const auto count = [&](std::size_t query, const std::int32_t* values) {
      for (std::size_t g = 0; g < n_groups; ++g) {
        out[query * n_groups + g] = count_firing(values + g * size, size);
      }
    };
    for_each_query(bins, n_threads, count);
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

  /// From query to query, by the columns in which their codes differ.
  struct Sweep {
    template <class Weight, class Consume>
    static void answer(const ParallelPerceptron& layer, const WeightTiles<Weight>& tiles,
                       std::span<const std::int32_t> bins, std::span<const std::uint32_t> order,
                       const Consume& consume) {
      const Code& code = layer.code();
      const std::size_t n_words = code.n_words();
      const std::size_t n_per_sum = most_per_sum(tiles);
      std::vector<std::uint64_t> words(4 * n_words);
      std::uint64_t* now = words.data();  // active, then positive
      std::uint64_t* before = now + 2 * n_words;
      std::vector<std::int32_t> values(layer.n_padded_units());
      const auto start_from_zero = [&] {  // the potentials of the code of zeros
        for (std::size_t i = 0; i < layer.n_units(); ++i) values[i] = -layer.thresholds_[i];
      };
      start_from_zero();
      coding::ColumnLists slots(n_words);
      for (const std::uint32_t query : order) {
        code.encode(bins.subspan(query * code.n_inputs(), code.n_inputs()), now, now + n_words);
        const coding::TernaryCode next{now, now + n_words};
        slots.read_changes({before, before + n_words}, next);
        // Counting costs too, and is worth it for codes that are far apart.
        const std::size_t n_changes = slots.columns().size();
        if (n_changes > code.max_active() / 2 && n_changes > coding::n_active(next, n_words)) {
          start_from_zero();
          slots.read(next);
        }
        tiles.add_columns(slots.columns(), n_per_sum, values.data());
        consume(query, values.data());
        std::swap(now, before);
      }
    }
    /// Weights that a thread adds between two checks: a tenth of a second of them.
    static constexpr std::size_t kAddedAtOnce = std::size_t{1} << 32;
  };

  /// Many queries together, in each pair of inputs along a walk of its own.
  struct Blocks {
    template <class Weight, class Consume>
    static void answer(const ParallelPerceptron& layer, const WeightTiles<Weight>& tiles,
                       std::span<const std::int32_t> bins, std::span<const std::uint32_t> order,
                       const Consume& consume) {
      const std::size_t n_padded = layer.n_padded_units();
      const auto chunks = pair_chunks(layer.code());
      std::vector<std::int32_t> values(std::min(order.size(), kBlock) * n_padded);
      const std::size_t n_blocks = (order.size() + kBlock - 1) / kBlock;
      for (std::size_t block = 0; block < n_blocks; ++block) {
        const std::size_t begin = block * order.size() / n_blocks;
        const auto some = order.subspan(begin, (block + 1) * order.size() / n_blocks - begin);
        for (std::size_t q = 0; q < some.size(); ++q) {
          for (std::size_t i = 0; i < layer.n_units(); ++i) {
            values[q * n_padded + i] = -layer.thresholds_[i];
          }
        }
        add_codes(layer.code(), chunks, tiles, bins, some, values.data());
        for (std::size_t q = 0; q < some.size(); ++q) consume(some[q], &values[q * n_padded]);
      }
    }
    static constexpr std::size_t kBlock = 1024;
    static constexpr std::size_t kAddedAtOnce = std::size_t{1} << 34;  // of which most are skipped
  };

  /// Weights whose sum fits into their type.
  static std::size_t most_per_sum(const WeightTiles<std::int16_t>& tiles) noexcept {
    return static_cast<std::size_t>(std::numeric_limits<std::int16_t>::max() /
                                    std::max<std::int64_t>(tiles.largest(), 1));
  }
  static std::size_t most_per_sum(const WeightTiles<std::int32_t>& /*tiles*/) noexcept {
    return std::size_t{1} << 30;  // no potential can overflow
  }

  /// Do so few columns change from one query to the next that a sweep is best? By some of them.
  bool is_short_walk(std::span<const std::int32_t> bins,
                     std::span<const std::uint32_t> order) const {
    const std::size_t n_words = code_->n_words();
    std::vector<std::uint64_t> words(4 * n_words);
    const auto code_at = [&](std::size_t place, std::uint64_t* to) {
      code_->encode(bins.subspan(order[place] * code_->n_inputs(), code_->n_inputs()), to,
                    to + n_words);
      return coding::TernaryCode{to, to + n_words};
    };
    coding::ColumnLists slots(n_words);
    std::size_t n_changes = 0;
    std::size_t n_steps = 0;
    const std::size_t step = order.size() / kFewQueries;
    for (std::size_t i = 1; i < order.size(); i += step, ++n_steps) {
      slots.read_changes(code_at(i - 1, words.data()), code_at(i, words.data() + 2 * n_words));
      n_changes += slots.columns().size();
    }
    return n_changes < kChangesPerWord * n_steps * n_words;
  }

  /// The largest sum of a unit's |weights| in a word.
  std::int64_t largest_word_norm() const {
    std::int64_t largest = 0;
    for (std::size_t slot = 0; slot < weights_.n_slots(); slot += 64) {
      largest = std::max(largest, weights_.largest_norm(slot, slot + 64));
    }
    return largest;
  }

  template <class Way, class Weight, class Consume>
  void answer_all(const WeightTiles<Weight>& tiles, std::span<const std::int32_t> bins,
                  std::span<const std::uint32_t> order, int n_threads,
                  const Consume& consume) const {
    const std::size_t n_added = code_->n_slots() * n_padded_units();
    const std::size_t most = std::clamp<std::size_t>(Way::kAddedAtOnce / n_added, 64, 4096) *
                             static_cast<std::size_t>(n_threads);
    for (; !order.empty(); order = order.subspan(std::min(most, order.size()))) {
      core::interruption_point();
      answer_part<Way>(tiles, bins, order.first(std::min(most, order.size())), n_threads, consume);
    }
  }

  template <class Way, class Weight, class Consume>
  void answer_part(const WeightTiles<Weight>& tiles, std::span<const std::int32_t> bins,
                   std::span<const std::uint32_t> order, int n_threads,
                   const Consume& consume) const {
    const std::size_t n_parts =
        std::min(static_cast<std::size_t>(n_threads), (order.size() + 255) / 256);
    std::vector<std::jthread> threads;  // joined at the end of the scope
    for (std::size_t part = 1; part < n_parts; ++part) {
      const std::size_t begin = part * order.size() / n_parts;
      const std::size_t end = (part + 1) * order.size() / n_parts;
      threads.emplace_back([&, begin, end] {
        Way::answer(*this, tiles, bins, order.subspan(begin, end - begin), consume);
      });
    }
    Way::answer(*this, tiles, bins, order.first(order.size() / n_parts), consume);
  }

  static constexpr std::size_t kFewQueries = 64;
  static constexpr std::size_t kChangesPerWord = 4;  // from which blocks are quicker

  std::shared_ptr<const Code> code_;
  WeightTiles<std::int32_t> weights_;
  std::vector<std::int32_t> thresholds_;
};

}  // namespace sdnn::estimators
