/// Training sample by sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/detail/presentation_window.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"
#include "sdnn/estimators/parallel_perceptron.hpp"

namespace sdnn::estimators {

/// The plain form of training, whose results define those of the other forms. For each sample it
/// computes the potentials and corrects the layer's weights. Its memory does not depend on the
/// number of samples.
class PlainTraining {
 public:
  PlainTraining(std::shared_ptr<ParallelPerceptron> layer, std::span<const std::int32_t> bins,
                int /*n_threads*/)
      : layer_(std::move(layer)),
        bins_(bins.begin(), bins.end()),
        words_(2 * layer_->code().n_words()),
        potentials_(layer_->n_padded_units()),
        slots_(layer_->code().n_words()) {}

  /// Presents samples in the given order.
  template <class Rule>
  TrainingCount present(std::span<const std::int32_t> order, Rule& rule) {
    TrainingCount count;
    const ParallelPerceptron::Code& code = layer_->code();
    std::uint64_t* const active = words_.data();
    std::uint64_t* const positive = active + code.n_words();
    for (const std::int32_t index : order) {
      core::interruption_point();
      const auto sample = static_cast<std::size_t>(index);
      code.encode(std::span(bins_).subspan(sample * code.n_inputs(), code.n_inputs()), active,
                  positive);
      slots_.read({active, positive});
      sum_potentials();
      rule(sample, potentials_.data(), corrections_);
      for (const Correction& correction : corrections_) correct(correction);
      count.n_samples += corrections_.empty() ? 0 : 1;
      count.n_units += corrections_.size();
    }
    return count;
  }

  /// Does nothing: the layer's weights are always up to date.
  void synchronize() noexcept {}

 private:
  /// Computes the potentials of the sample whose columns are in `slots_`.
  void sum_potentials() {
    for (std::size_t i = 0; i < layer_->n_units(); ++i) potentials_[i] = -layer_->thresholds()[i];
    layer_->tiles().add_columns(slots_.columns(), kNoLimit, potentials_.data());
  }

  /// Adds direction * x_SD to a unit's weights, and subtracts direction from its threshold.
  void correct(const Correction& correction) {
    auto& tiles = layer_->tiles();
    std::int32_t* const first = &tiles.at(correction.unit, 0);
    const std::size_t width = tiles.width(correction.unit / kTileUnits);
    const coding::SignedColumns slots = slots_.columns();
    for (const std::uint32_t slot : slots.plus) first[slot * width] += correction.direction;
    for (const std::uint32_t slot : slots.minus) first[slot * width] -= correction.direction;
    layer_->thresholds()[correction.unit] -= correction.direction;
  }

  static constexpr std::size_t kNoLimit = std::size_t{1} << 30;  // no sum of weights overflows

  std::shared_ptr<ParallelPerceptron> layer_;
  std::vector<std::int32_t> bins_;
  std::vector<std::uint64_t> words_;
  std::vector<std::int32_t> potentials_;
  coding::ColumnLists slots_;
  std::vector<Correction> corrections_;
};

}  // namespace sdnn::estimators
