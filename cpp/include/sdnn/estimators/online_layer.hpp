/// A layer that learns single samples; a failed call changes nothing.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/detail/presentation_window.hpp"
#include "sdnn/estimators/detail/unit_ranking.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"
#include "sdnn/estimators/parallel_perceptron.hpp"

namespace sdnn::estimators {

/// A copy of a layer's weights that learns and predicts single samples, with the results of plain
/// training.
///
/// The copy has a byte for each weight, and a second byte where that is not enough, so that a pass
/// reads a quarter of the layer's memory. The layer itself is out of date until synchronize();
/// nothing else may change it. Memory: about 2 bytes per weight; pages of second bytes are used
/// only where needed.
class OnlineLayer {
 public:
  /// Copies the weights of `layer`. Throws std::invalid_argument if a weight or threshold does not
  /// fit (see HiddenLayer::weight_limit), or if there are more than 2^27 columns.
  explicit OnlineLayer(std::shared_ptr<ParallelPerceptron> layer)
      : layer_(std::move(layer)),
        hidden_(layer_->n_units(), layer_->code().n_slots()),
        words_(2 * layer_->code().n_words()),
        slots_(layer_->code().n_words()),
        potentials_(layer_->n_units()) {
    const WeightTiles<std::int32_t>& tiles = std::as_const(*layer_).tiles();
    std::vector<std::int32_t> column(tiles.n_units());
    for (std::size_t slot = 0; slot < tiles.n_slots(); ++slot) {
      for (std::size_t t = 0; t < tiles.n_tiles(); ++t) {
        const std::size_t begin = t * kTileUnits;
        const std::size_t n = std::min(kTileUnits, column.size() - begin);
        std::copy_n(tiles.tile(t) + slot * tiles.width(t), n, column.data() + begin);
      }
      hidden_.add_to_column(slot, column, 1);
    }
    for (std::size_t i = 0; i < column.size(); ++i) hidden_.set_threshold(i, layer_->threshold(i));
  }

  const ParallelPerceptron& layer() const noexcept { return *layer_; }
  ParallelPerceptron& layer() noexcept { return *layer_; }

  /// Presents samples in their order; `rule` chooses the corrections of each. Returns how many
  /// samples and units were corrected. Shapes: bins (n_samples, n_inputs).
  ///
  /// Throws std::invalid_argument for bins out of range or if the rule is for another number of
  /// samples or units, std::overflow_error if a weight would leave its range. An error or an
  /// interruption (core::interruption_point) changes nothing.
  template <class Rule>
  TrainingCount present(std::span<const std::int32_t> bins, Rule& rule) {
    const std::size_t n_inputs = layer_->code().n_inputs();
    layer_->code().check_bins(bins);
    const std::size_t n_samples = bins.size() / n_inputs;
    core::require(rule.n_samples() == n_samples, "targets or labels", "as many samples as bins has",
                  rule.n_samples());
    core::require(rule.n_units() == layer_->n_units(), "rule", "for as many units as the layer has",
                  rule.n_units());
    TrainingCount count;
    applied_.clear();
    struct Undoes {  // undoes the corrections unless all of them succeed
      OnlineLayer& layer;
      std::span<const std::int32_t> bins;
      bool is_done = false;
      // NOLINTNEXTLINE(bugprone-exception-escape): back is always in range
      ~Undoes() {
        if (!is_done) layer.undo(bins);
      }
    } undoing{*this, bins};
    for (std::size_t sample = 0; sample < n_samples; ++sample) {
      read(bins.subspan(sample * n_inputs, n_inputs));
      hidden_.potentials(slots_.columns(), potentials_);
      rule(sample, potentials_.data(), corrections_);
      correct(sample);
      count.n_samples += corrections_.empty() ? 0 : 1;
      count.n_units += corrections_.size();
      core::interruption_point(/*at_once=*/true);
    }
    undoing.is_done = true;
    changed_ = changed_ || count.n_units > 0;
    return count;
  }

  /// Computes the potentials of all units for each query. Shapes: bins (n_queries, n_inputs), out
  /// (n_queries, n_units). Throws std::invalid_argument for bins out of range. Thread safety: calls
  /// may run at the same time.
  void potentials(std::span<const std::int32_t> bins, std::span<std::int32_t> out) const {
    const ParallelPerceptron::Code& code = layer_->code();
    code.check_bins(bins);
    std::vector<std::uint64_t> words(2 * code.n_words());
    coding::ColumnLists slots(code.n_words());
    for (std::size_t query = 0; query < bins.size() / code.n_inputs(); ++query) {
      code.encode(bins.subspan(query * code.n_inputs(), code.n_inputs()), words.data(),
                  words.data() + code.n_words());
      slots.read({words.data(), words.data() + code.n_words()});
      hidden_.potentials(slots.columns(),
                         out.subspan(query * layer_->n_units(), layer_->n_units()));
    }
  }

  /// Copies weights and thresholds back to the layer, if any has changed.
  void synchronize() {
    if (!changed_) return;
    WeightTiles<std::int32_t>& tiles = layer_->tiles();
    for (std::size_t i = 0; i < tiles.n_units(); ++i)
      layer_->thresholds()[i] = hidden_.threshold(i);
    for (std::size_t slot = 0; slot < tiles.n_slots(); ++slot) {
      for (std::size_t i = 0; i < tiles.n_units(); ++i) tiles.at(i, slot) = hidden_.weight(i, slot);
    }
    changed_ = false;
  }

 private:
  /// A recorded correction: the units that a sample corrected in a direction, +1 or -1.
  struct Applied {
    std::size_t sample;
    std::int32_t direction;
    std::vector<std::uint32_t> units;
  };

  /// Lists the columns of a sample's code in `slots_`.
  void read(std::span<const std::int32_t> bins) {
    std::uint64_t* const positive = words_.data() + layer_->code().n_words();
    layer_->code().encode(bins, words_.data(), positive);
    slots_.read({words_.data(), positive});
  }

  /// Corrects the units in `corrections_` by the code that was read, and records that for `undo`.
  void correct(std::size_t sample) {
    for (const std::int32_t direction : {1, -1}) {
      Applied applied{sample, direction, {}};
      for (const Correction& correction : corrections_) {
        if (correction.direction == direction) applied.units.push_back(correction.unit);
      }
      if (applied.units.empty()) continue;
      std::sort(applied.units.begin(), applied.units.end());  // neighbours share cache lines
      applied_.reserve(applied_.size() + 1);  // so that recording a correction cannot fail
      hidden_.update(applied.units, slots_.columns(), direction);
      applied_.push_back(std::move(applied));
    }
  }

  /// Reverses all corrections recorded by the current call, the last one first. Shapes: bins as in
  /// present.
  void undo(std::span<const std::int32_t> bins) {
    const std::size_t n_inputs = layer_->code().n_inputs();
    for (; !applied_.empty(); applied_.pop_back()) {
      const Applied& last = applied_.back();
      read(bins.subspan(last.sample * n_inputs, n_inputs));
      hidden_.update(last.units, slots_.columns(), -last.direction);
    }
  }

  std::shared_ptr<ParallelPerceptron> layer_;
  approximators::HiddenLayer hidden_;
  std::vector<std::uint64_t> words_;  // active, then positive
  coding::ColumnLists slots_;
  std::vector<std::int32_t> potentials_;
  std::vector<Correction> corrections_;
  std::vector<Applied> applied_;  // corrections of the current call
  bool changed_ = false;          // whether weights differ from the layer's, since synchronize
};

}  // namespace sdnn::estimators
