/// Training on potentials instead of weights: for few samples and many columns.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/aligned_buffer.hpp"
#include "sdnn/core/worker_team.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/perceptron_layer.hpp"
#include "sdnn/estimators/plain_training.hpp"

namespace sdnn::estimators {

/// Keeps the potentials of all units for all training samples, and how often each sample has been
/// added to each unit; weights are made of that when asked for.
///
/// Correcting a unit by x_SD(t) and its threshold by 1 moves its potential for sample s by
/// <x_SD(t), x_SD(s)> + 1, so a correction adds one row of the table of these products. Samples are
/// presented in blocks: inside a block corrections are applied to the block's own potentials one by
/// one, and to those of all samples some blocks later, many corrections of a unit in one pass. `Product` is an integer that holds every product.
template <class Product>
class DualTraining {
 public:
  DualTraining(std::shared_ptr<PerceptronLayer> layer, std::span<const std::int32_t> bins,
               int n_threads)
      : layer_(std::move(layer)), coded_(layer_->code(), bins),
        row_size_(core::round_up(coded_.size(), 32)),
        n_per_sum_(std::numeric_limits<Product>::max() / (layer_->code().max_active() + 1)), kernels_(unit_kernels()),
        team_(static_cast<std::size_t>(n_threads)), products_(coded_.size() * row_size_),
        potentials_(layer_->n_units() * row_size_),
        coefficients_(coded_.size() * layer_->n_padded_units()),
        block_(kBlock * layer_->n_padded_units()), first_of_unit_(layer_->n_units() + 1) {
    // Blocks of rows get cheaper towards the end: threads take them in turn.
    team_.run([&](std::size_t part) {
      for (std::size_t t = kRows * part; t < coded_.size(); t += kRows * team_.size()) {
        fill_products(t, std::min(t + kRows, coded_.size()));
      }
    });
    layer_->visit(bins, n_threads, [&](std::size_t t, const std::int32_t* values) {
      for (std::size_t i = 0; i < layer_->n_units(); ++i) {
        potentials_[i * row_size_ + t] = values[i];
      }
    });
  }

  template <class Rule>
  TrainingCount present(std::span<const std::int32_t> order, Rule& rule) {
    TrainingCount count;
    while (!order.empty()) {
      const auto now = order.first(std::min(order.size(), kBlock));
      turn(now);
      present_block(now, rule, count);
      order = order.subspan(now.size());
    }
    turn({});
    if (full_) synchronize();
    return count;
  }

  /// weights += sum over samples of coefficient * x_SD, tile by tile and 64 slots at a time.
  void synchronize() {
    auto& tiles = layer_->tiles();
    const std::size_t n_padded = layer_->n_padded_units();
    for (std::size_t tile = 0; tile < tiles.n_tiles(); ++tile) {
      const std::size_t width = tiles.width(tile);
      std::vector<std::size_t> used;
      for (std::size_t t = 0; t < coded_.size(); ++t) {
        const std::int16_t* const c = &coefficients_[t * n_padded + tile * kTileUnits];
        if (std::any_of(c, c + width, [](std::int16_t value) { return value != 0; })) {
          used.push_back(t);
        }
      }
      team_.run_over(coded_.n_words(), [&](std::size_t w) {
        std::int32_t* const rows = tiles.tile(tile) + 64 * w * width;
        for (const std::size_t t : used) {
          kernels_.add_outer(rows, width, &coefficients_[t * n_padded + tile * kTileUnits],
                             coded_.active(t)[w], coded_.positive(t)[w]);
        }
      });
    }
    for (std::size_t t = 0; t < coded_.size(); ++t) {
      for (std::size_t i = 0; i < layer_->n_units(); ++i) {
        layer_->thresholds()[i] -= coefficients_[t * n_padded + i];
      }
    }
    std::fill_n(coefficients_.data(), coefficients_.size(), std::int16_t{0});
    full_ = false;
  }

 private:
  struct BlockCorrection {
    std::size_t sample;
    Correction what;
  };

  /// The products of the samples [begin, end) with themselves and all later ones; the codes of these
  /// few stay in the cache while those of the others pass.
  void fill_products(std::size_t begin, std::size_t end) noexcept {
    for (std::size_t s = begin; s < coded_.size(); ++s) {
      for (std::size_t t = begin; t < std::min(end, s + 1); ++t) {
        const auto product = static_cast<Product>(
            1 + kernels_.inner_product(coded_.active(t), coded_.positive(t), coded_.active(s),
                                       coded_.positive(s), coded_.n_words()));
        products_[t * row_size_ + s] = product;
        products_[s * row_size_ + t] = product;
      }
    }
  }

  /// Begins the block `now`: its potentials, side by side sample by sample, with all corrections made
  /// so far. These reach all other samples once there are enough of them to share the way; until then
  /// they are applied to the samples asked for, which is cheap if those are neighbours in memory.
  void turn(std::span<const std::int32_t> now) {
    ++n_pending_blocks_;
    const bool in_a_row = std::adjacent_find(now.begin(), now.end(), [](auto one, auto next) {
                            return next != one + 1;
                          }) == now.end();
    const bool flush = now.empty() || !in_a_row || n_pending_blocks_ >= kPendingBlocks;
    sort_pending_by_unit();
    team_.run([&](std::size_t part) {
      std::vector<const Product*> plus;
      std::vector<const Product*> minus;
      alignas(core::kCacheLine) std::array<std::int32_t, kBlock> some;
      const std::size_t end = (part + 1) * layer_->n_units() / team_.size();
      for (std::size_t i = part * layer_->n_units() / team_.size(); i < end; ++i) {
        std::int32_t* const row = &potentials_[i * row_size_];
        const std::size_t begin = flush || now.empty() ? 0 : static_cast<std::size_t>(now[0]);
        plus.clear();
        minus.clear();
        for (std::size_t c = first_of_unit_[i]; c < first_of_unit_[i + 1]; ++c) {
          const Product* const products = &products_[by_unit_[c].sample * row_size_ + begin];
          (by_unit_[c].what.direction > 0 ? plus : minus).push_back(products);
        }
        if (flush) {
          add_products(row, row_size_, plus, minus);
          gather(row, now, i);
        } else {
          std::copy_n(row + begin, now.size(), some.begin());
          add_products(some.data(), now.size(), plus, minus);
          for (std::size_t b = 0; b < now.size(); ++b) {
            block_[b * layer_->n_padded_units() + i] = some[b];
          }
        }
      }
    });
    if (flush) {
      pending_.clear();
      n_pending_blocks_ = 0;
    }
  }

  void sort_pending_by_unit() {
    std::fill(first_of_unit_.begin(), first_of_unit_.end(), 0);
    for (const auto& correction : pending_) ++first_of_unit_[correction.what.unit + 1];
    for (std::size_t i = 0; i < layer_->n_units(); ++i) first_of_unit_[i + 1] += first_of_unit_[i];
    by_unit_.resize(pending_.size());
    next_of_unit_.assign(first_of_unit_.begin(), first_of_unit_.end());
    for (const auto& correction : pending_) {
      by_unit_[next_of_unit_[correction.what.unit]++] = correction;
    }
  }

  void add_products(std::int32_t* to, std::size_t size, const std::vector<const Product*>& plus,
                    const std::vector<const Product*>& minus) const noexcept {
    if (plus.empty() && minus.empty()) return;
    kernels_.add_products(to, size, plus.data(), plus.size(), minus.data(), minus.size(),
                          n_per_sum_);
  }

  void gather(const std::int32_t* row, std::span<const std::int32_t> now, std::size_t unit) noexcept {
    for (std::size_t b = 0; b < now.size(); ++b) {
      block_[b * layer_->n_padded_units() + unit] = row[static_cast<std::size_t>(now[b])];
    }
  }

  template <class Rule>
  void present_block(std::span<const std::int32_t> samples, Rule& rule, TrainingCount& count) {
    const std::size_t n_padded = layer_->n_padded_units();
    const std::size_t n_before = pending_.size();  // what the block began with
    for (std::size_t b = 0; b < samples.size(); ++b) {
      const auto sample = static_cast<std::size_t>(samples[b]);
      std::int32_t* const values = &block_[b * n_padded];
      const Product* const products = &products_[sample * row_size_];
      for (std::size_t c = n_before; c < pending_.size(); ++c) {
        const BlockCorrection& made = pending_[c];
        values[made.what.unit] += made.what.direction * products[made.sample];
      }
      rule(sample, values, corrections_);
      std::int16_t* const coefficients = &coefficients_[sample * n_padded];
      for (const Correction& correction : corrections_) {
        pending_.push_back({sample, correction});
        std::int16_t& coefficient = coefficients[correction.unit];
        coefficient = static_cast<std::int16_t>(coefficient + correction.direction);
        full_ = full_ || std::abs(coefficient) == std::numeric_limits<std::int16_t>::max();
      }
      count.n_samples += corrections_.empty() ? 0 : 1;
      count.n_units += corrections_.size();
    }
  }

  static constexpr std::size_t kBlock = 64;
  static constexpr std::size_t kRows = 8;
  static constexpr std::size_t kPendingBlocks = 8;

  std::shared_ptr<PerceptronLayer> layer_;
  coding::CodedSamples coded_;
  std::size_t row_size_;
  std::size_t n_per_sum_;  // products whose sum a Product holds
  UnitKernels kernels_;
  core::WorkerTeam team_;
  core::AlignedBuffer<Product> products_;            // (n_samples, row_size), 1 added to each
  core::AlignedBuffer<std::int32_t> potentials_;     // (n_units, row_size)
  core::AlignedBuffer<std::int16_t> coefficients_;   // (n_samples, n_padded_units)
  core::AlignedBuffer<std::int32_t> block_;          // (kBlock, n_padded_units)
  std::vector<Correction> corrections_;
  std::vector<BlockCorrection> pending_;             // not yet in all potentials, in order
  std::size_t n_pending_blocks_ = 0;
  std::vector<BlockCorrection> by_unit_;
  std::vector<std::size_t> first_of_unit_;
  std::vector<std::size_t> next_of_unit_;
  bool full_ = false;  // a coefficient has reached the end of its range
};

}  // namespace sdnn::estimators
