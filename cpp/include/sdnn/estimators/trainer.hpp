/// Training of a layer by a correction rule, in a form that suits its size.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/detail/block_training.hpp"
#include "sdnn/estimators/detail/dual_training.hpp"
#include "sdnn/estimators/detail/plain_training.hpp"
#include "sdnn/estimators/detail/presentation_window.hpp"
#include "sdnn/estimators/parallel_perceptron.hpp"
#include "sdnn/estimators/training_form.hpp"

namespace sdnn::estimators {

/// Presents training samples to a layer. The form does not affect the result.
///
/// Between calls of synchronize() the layer's weights may be out of date; nothing else may change
/// them while a trainer is in use. After an exception from present() the layer is unusable; train a
/// copy to be able to continue.
template <class Rule>
class Trainer {
 public:
  /// Takes the samples, whose targets or labels `rule` has, and chooses the form of training for
  /// about `n_epochs` presentations of each sample.
  /// Shapes: bins (n_samples, n_inputs). Throws std::invalid_argument for bins out of range or if
  /// the rule is for another number of samples or units, std::length_error if `form` (other than
  /// automatic) needs more than `memory_limit` bytes.
  Trainer(std::shared_ptr<ParallelPerceptron> layer, std::span<const std::int32_t> bins, Rule rule,
          TrainingForm form = TrainingForm::automatic, std::size_t memory_limit = kMemoryLimit,
          int n_threads = 1, std::size_t n_epochs = kExpectedEpochs)
      : layer_(std::move(layer)), rule_(std::move(rule)) {
    core::require_in_range("n_threads", n_threads, 1, 4096);
    layer_->code().check_bins(bins);
    n_samples_ = bins.size() / layer_->code().n_inputs();
    core::require(rule_.n_samples() == n_samples_, "targets or labels",
                  std::to_string(n_samples_) + " samples as bins has", rule_.n_samples());
    core::require(rule_.n_units() == layer_->n_units(), "rule",
                  "for " + std::to_string(layer_->n_units()) + " units, as the layer has",
                  rule_.n_units());
    form_ =
        choose_form(form, layer_->n_units(), layer_->code(), n_samples_, memory_limit, n_epochs);
    const auto memory = [&](bool keeps_plans) {
      return form_memory(form_, layer_->n_units(), layer_->code(), n_samples_, keeps_plans);
    };
    const bool keeps_plans =
        n_epochs > 1 && form_ == TrainingForm::block && memory(true) <= memory_limit;
    memory_ = memory(keeps_plans);
    renew_headroom();
    make_training(bins, n_threads, keeps_plans);
  }

  /// The layer to train.
  ParallelPerceptron& layer() noexcept { return *layer_; }
  TrainingForm form() const noexcept { return form_; }
  /// The largest number of bytes of the form beside the layer.
  std::uint64_t memory() const noexcept { return memory_; }
  std::size_t n_samples() const noexcept { return n_samples_; }

  /// Presents samples in the given order. Throws std::invalid_argument for an index out of range,
  /// before anything is changed, std::overflow_error before a potential could overflow. It may be
  /// interrupted between samples or blocks of them (core::interruption_point).
  TrainingCount present(std::span<const std::int32_t> order) {
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (order[i] >= 0 && static_cast<std::size_t>(order[i]) < n_samples_) continue;
      core::require(false, "order[" + std::to_string(i) + "]",
                    "in [0, " + std::to_string(n_samples_) + ")", order[i]);
    }
    TrainingCount total;
    while (!order.empty()) {
      if (headroom_ == 0) {
        synchronize();
        renew_headroom();
      }
      const auto safe = order.first(std::min(order.size(), headroom_));
      total +=
          std::visit([&](auto& training) { return training.present(safe, rule_); }, *training_);
      headroom_ -= safe.size();
      order = order.subspan(safe.size());
    }
    return total;
  }

  /// Updates the layer's weights and thresholds to those of plain training.
  void synchronize() {
    std::visit([](auto& training) { training.synchronize(); }, *training_);
  }

 private:
  using Training =
      std::variant<PlainTraining, BlockTraining<std::int16_t>, BlockTraining<std::int32_t>,
                   DualTraining<std::int16_t>, DualTraining<std::int32_t>>;

  /// Computes how many presentations are safe before a potential could overflow: each raises the
  /// sum of a unit's |weights| and |threshold| by at most the number of active columns plus 1.
  /// Throws std::overflow_error if none is safe.
  void renew_headroom() {
    const std::int64_t left = std::numeric_limits<std::int32_t>::max() - layer_->check_norms();
    headroom_ = static_cast<std::size_t>(left) / (layer_->code().max_active() + 1);
    if (headroom_ == 0) {
      core::fail(
          std::overflow_error("the weights have grown so large that a further correction could "
                              "overflow a potential of 32 bits"));
    }
  }

  /// Makes the training of the chosen form, with the smallest type that holds all inner products.
  void make_training(std::span<const std::int32_t> bins, int n_threads, bool keeps_plans) {
    const auto make = [&]<class Form>(std::in_place_type_t<Form> form, auto... arguments) {
      training_ = std::make_unique<Training>(form, layer_, bins, n_threads, arguments...);
    };
    with_product_type(layer_->code(), [&]<class Product> {
      switch (form_) {
        case TrainingForm::dual:
          return make(std::in_place_type<DualTraining<Product>>);
        case TrainingForm::block:
          return make(std::in_place_type<BlockTraining<Product>>, keeps_plans);
        default:
          return make(std::in_place_type<PlainTraining>);
      }
    });
  }

  std::shared_ptr<ParallelPerceptron> layer_;
  Rule rule_;
  std::size_t n_samples_ = 0;
  TrainingForm form_ = TrainingForm::plain;
  std::uint64_t memory_ = 0;
  std::size_t headroom_ = 0;  // presentations that cannot overflow
  std::unique_ptr<Training> training_;
};

using PDeltaTrainer = Trainer<PDeltaRule>;
using PerceptronTrainer = Trainer<PerceptronRule>;

}  // namespace sdnn::estimators
