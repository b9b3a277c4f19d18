/// Training on potentials instead of weights, for few samples and many columns.
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

#include "sdnn/coding/detail/coded_samples.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/detail/worker_team.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/detail/presentation_window.hpp"
#include "sdnn/estimators/detail/signed_sums.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"
#include "sdnn/estimators/parallel_perceptron.hpp"

namespace sdnn::estimators {

/// Training that keeps the potentials of all units for all samples, and how often each sample was
/// added to each unit, its *coefficient*. The weights are computed from these on demand.
///
/// Correcting a unit by x_SD(t) and its threshold by 1 changes its potential for sample s by
/// <x_SD(t), x_SD(s)> + 1, so a correction adds a row of the table of these products. Samples are
/// presented in windows: a correction changes the potentials of its window immediately, and those
/// of all samples later, together with other corrections of its unit. `Product` is an integer type
/// that holds 1 plus any inner product of codes.
template <class Product>
class DualTraining {
 public:
  DualTraining(std::shared_ptr<ParallelPerceptron> layer, std::span<const std::int32_t> bins,
               int n_threads)
      : layer_(std::move(layer)),
        coded_(layer_->code(), bins),
        row_size_(row_size_for(coded_.size())),
        n_per_sum_(std::numeric_limits<Product>::max() / (layer_->code().max_active() + 1)),
        team_(static_cast<std::size_t>(n_threads)),
        products_(coded_.size() * row_size_),
        potentials_(layer_->n_units() * row_size_),
        pending_(layer_->n_units()),
        coefficients_(coded_.size() * layer_->n_padded_units()),
        window_(layer_->n_padded_units(), kWindow),
        gathered_(kWindow * kWindow) {
    for (std::size_t first = 0; first < coded_.size(); first += kRows * team_.size()) {
      core::interruption_point();
      team_.run([&](std::size_t thread) {
        const std::size_t begin = std::min(first + kRows * thread, coded_.size());
        fill_products(begin, std::min(begin + kRows, coded_.size()));
      });
    }
    layer_->for_each_query(bins, n_threads, [&](std::size_t t, const std::int32_t* values) {
      for (std::size_t i = 0; i < layer_->n_units(); ++i) {
        potentials_[i * row_size_ + t] = values[i];
      }
    });
  }

  /// Presents samples in order, a window at a time; the rule corrects the units after each of them.
  /// Delayed corrections are added to all potentials by `flush`, and coefficients are added to the
  /// weights by `synchronize` before they exceed 16 bits.
  template <class Rule>
  TrainingCount present(std::span<const std::int32_t> order, Rule& rule) {
    TrainingCount count;
    const bool in_data_order =
        std::adjacent_find(order.begin(), order.end(), [](auto sample, auto next) {
          return next != sample + 1;
        }) == order.end();
    // For samples in the order of the data a window's potentials are contiguous, so that the window
    // can cheaply add delayed corrections to them itself; then `flush` is needed less often.
    const std::size_t interval = in_data_order ? kFlushInterval : 1;
    for (std::size_t n_since_flush = 0; !order.empty(); n_since_flush += kWindow) {
      core::interruption_point();
      if (n_since_flush >= interval || full_) {
        flush();
        n_since_flush = 0;
      }
      if (full_) synchronize();
      const auto window = order.first(std::min(order.size(), kWindow));
      count += in_data_order ? present_row(window, rule) : present_some(window, rule);
      order = order.subspan(window.size());
    }
    flush();
    return count;
  }

  /// Returns the bytes beside the layer and the samples' bins; an estimate at most 1 % too low.
  static std::uint64_t bytes(std::size_t n_units, const coding::SelectiveDesensitization& code,
                             std::size_t n_samples) noexcept {
    const std::uint64_t n_padded = core::round_up(n_units, kTileStep);
    const std::uint64_t row_size = row_size_for(n_samples);
    return coding::CodedSamples::bytes(code, n_samples)    // coded_
           + sizeof(Product) * row_size * n_samples        // products_
           + sizeof(std::int32_t) * row_size * n_units     // potentials_
           + sizeof(std::int16_t) * n_padded * n_samples   // coefficients_
           + PresentationWindow::bytes(n_padded, kWindow)  // window_
           + sizeof(Product) * kWindow * kWindow;          // gathered_
  }

  /// Adds the sum over samples of coefficient * x_SD to the weights, for a tile and 64 slots at a
  /// time, subtracts the coefficients from the thresholds, and sets them to 0.
  void synchronize() {
    auto& tiles = layer_->tiles();
    const std::size_t n_padded = layer_->n_padded_units();
    for (std::size_t tile = 0; tile < tiles.n_tiles(); ++tile) {
      const std::size_t width = tiles.width(tile);
      std::vector<std::pair<std::size_t, std::int32_t>> used;  // samples, largest |coefficient|
      for (std::size_t t = 0; t < coded_.size(); ++t) {
        const std::int16_t* const c = &coefficients_[t * n_padded + tile * kTileUnits];
        const auto [low, high] = std::minmax_element(c, c + width);
        const std::int32_t largest = std::max<std::int32_t>(*high, -std::int32_t{*low});
        if (largest != 0) used.emplace_back(t, largest);
      }
      team_.run_over(layer_->code().n_words(), [&](std::size_t w) {
        add_samples(tiles.tile(tile) + 64 * w * width, width, tile, w, used);
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
  /// Computes the products of the samples [begin, end) with themselves and all later samples, in
  /// both halves of the symmetric table. The codes of these few samples stay in the cache.
  void fill_products(std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < coded_.size(); ++s) {
      for (std::size_t t = begin; t < std::min(end, s + 1); ++t) {
        const auto product =
            static_cast<Product>(1 + coding::inner_product(coded_[t], coded_[s], coded_.n_words()));
        products_[t * row_size_ + s] = product;
        products_[s * row_size_ + t] = product;
      }
    }
  }

  /// Adds coefficient * x_SD of the samples to the 64 rows of a tile that belong to word w of the
  /// codes. `samples` has numbers of samples and their largest |coefficient| in the tile, which
  /// bounds the sums that are kept in 16 bits before they are added to `rows`.
  void add_samples(std::int32_t* rows, std::size_t width, std::size_t tile, std::size_t w,
                   const std::vector<std::pair<std::size_t, std::int32_t>>& samples) const {
    alignas(core::kCacheLine) std::array<std::int16_t, 64 * kTileUnits> sums{};
    const auto widen = [&] {
      for (std::size_t i = 0; i < 64 * width; ++i) rows[i] += sums[i];
      sums.fill(0);
    };
    std::int32_t bound = 0;
    for (const auto& [t, largest] : samples) {
      if (bound + largest > std::numeric_limits<std::int16_t>::max()) {
        widen();
        bound = 0;
      }
      bound += largest;
      add_outer(sums.data(), width,
                &coefficients_[t * layer_->n_padded_units() + tile * kTileUnits],
                coded_[t].active[w], coded_[t].positive[w]);
    }
    widen();
  }

  /// Applies the pending corrections to the potentials of all samples, some samples at a time, so
  /// that the products stay in the cache for all units.
  void flush() {
    for (std::size_t begin = 0; begin < row_size_; begin += kColumns) {
      const std::size_t size = std::min(kColumns, row_size_ - begin);
      team_.run_over(layer_->n_units(), [&](std::size_t i) {
        if (pending_[i].empty()) return;
        add_signed(&potentials_[i * row_size_ + begin], size, pending_[i], begin, n_per_sum_);
      });
    }
    for (auto& rows : pending_) rows.clear();
  }

  /// Presents consecutive samples of the data.
  template <class Rule>
  TrainingCount present_row(std::span<const std::int32_t> samples, Rule& rule) {
    const auto begin = static_cast<std::size_t>(samples[0]);
    const std::size_t size = core::round_up(samples.size(), PresentationWindow::kAtOnce);
    for (std::size_t i = 0; i < layer_->n_units(); ++i) {
      std::copy_n(&potentials_[i * row_size_ + begin], size, window_.row(i));
      if (!pending_[i].empty()) add_signed(window_.row(i), size, pending_[i], begin, n_per_sum_);
    }
    return present_window(samples, &products_[begin * row_size_ + begin], row_size_, rule);
  }

  /// Presents samples in any order, which needs a copy of their products. Nothing may be pending.
  template <class Rule>
  TrainingCount present_some(std::span<const std::int32_t> samples, Rule& rule) {
    for (std::size_t i = 0; i < layer_->n_units(); ++i) {
      for (std::size_t b = 0; b < samples.size(); ++b) {
        window_.row(i)[b] = potentials_[i * row_size_ + static_cast<std::size_t>(samples[b])];
      }
    }
    for (std::size_t b = 0; b < samples.size(); ++b) {
      const Product* const row = &products_[static_cast<std::size_t>(samples[b]) * row_size_];
      for (std::size_t e = b; e < samples.size(); ++e) {
        gathered_[b * kWindow + e] = row[static_cast<std::size_t>(samples[e])];
      }
    }
    return present_window(samples, gathered_.data(), kWindow, rule);
  }

  /// Presents the samples of the window, and records each correction to be applied later.
  template <class Rule>
  TrainingCount present_window(std::span<const std::int32_t> samples, const Product* products,
                               std::size_t stride, Rule& rule) {
    return window_.present(
        samples, products, stride, rule, [&](std::size_t b, Correction correction) {
          const auto sample = static_cast<std::size_t>(samples[b]);
          pending_[correction.unit].add(&products_[sample * row_size_], correction.direction);
          std::int16_t& coefficient =
              coefficients_[sample * layer_->n_padded_units() + correction.unit];
          coefficient = static_cast<std::int16_t>(coefficient + correction.direction);
          full_ = full_ || std::abs(coefficient) >= kFullCoefficient;
        });
  }

  /// The number of entries of a row, a multiple of 32 (a cache line of products in 16 bits), with
  /// room for a padded window that begins at any sample.
  static constexpr std::size_t row_size_for(std::size_t n_samples) noexcept {
    return core::round_up(n_samples + PresentationWindow::kAtOnce - 1, 32);
  }

  static constexpr std::size_t kWindow = 128;                 // samples that are presented together
  static constexpr std::size_t kFlushInterval = 4 * kWindow;  // samples whose corrections may wait
  /// The |coefficient| from which another window, which may change it by kWindow, could exceed 16
  /// bits.
  static constexpr int kFullCoefficient = std::numeric_limits<std::int16_t>::max() - int{kWindow};
  static constexpr std::size_t kRows = 8;       // samples whose codes stay in the cache
  static constexpr std::size_t kColumns = 256;  // samples whose products stay in the cache

  std::shared_ptr<ParallelPerceptron> layer_;
  coding::CodedSamples coded_;
  std::size_t row_size_;
  std::size_t n_per_sum_;  // products whose sum a Product holds
  core::WorkerTeam team_;
  core::AlignedBuffer<Product> products_;         // (n_samples, row_size): 1 plus inner products
  core::AlignedBuffer<std::int32_t> potentials_;  // (n_units, row_size)
  std::vector<SignedRows<Product>>
      pending_;  // for each unit, corrections not yet in all its potentials
  core::AlignedBuffer<std::int16_t> coefficients_;  // (n_samples, n_padded_units)
  PresentationWindow window_;
  core::AlignedBuffer<Product> gathered_;  // (kWindow, kWindow): products of scattered samples
  bool full_ = false;                      // another window could exceed the range of a coefficient
};

}  // namespace sdnn::estimators
