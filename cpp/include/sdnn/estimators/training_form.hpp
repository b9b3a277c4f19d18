/// The forms of training: their memory, and the choice for a problem.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/estimators/detail/block_training.hpp"
#include "sdnn/estimators/detail/dual_training.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

namespace sdnn::estimators {

/// Forms of training, all with equal results.
enum class TrainingForm {
  automatic,  ///< the form estimated to be fastest among those that fit into the memory limit
  dual,       ///< keeps the potentials of all samples; a correction adds a row of inner products
  block,      ///< computes the potentials of a block of samples in one pass over the weights
  plain,      ///< computes the potentials of each sample by a pass over the weights
};

inline constexpr std::array kTrainingForms{TrainingForm::automatic, TrainingForm::dual,
                                           TrainingForm::block, TrainingForm::plain};

inline std::string_view name_of(TrainingForm form) noexcept {
  constexpr std::array<std::string_view, 4> kNames{"auto", "dual", "block", "plain"};
  return kNames[static_cast<std::size_t>(form)];
}

/// Returns the form with this name. Throws std::invalid_argument if there is no such form.
inline TrainingForm training_form_named(std::string_view name) {
  for (const auto form : kTrainingForms) {
    if (name == name_of(form)) return form;
  }
  core::fail(
      std::invalid_argument("form must be auto, dual, block or plain, got " + std::string(name)));
}

/// The default limit of bytes of training beside the layer.
inline constexpr std::size_t kMemoryLimit = std::size_t{1} << 30;

/// Calls the template `function` with the smallest integer type, of 16 or 32 bits, that holds 1
/// plus any inner product of codes.
template <class Function>
decltype(auto) with_product_type(const coding::SelectiveDesensitization& code,
                                 const Function& function) {
  if (code.max_active() < std::numeric_limits<std::int16_t>::max()) {
    return function.template operator()<std::int16_t>();
  }
  return function.template operator()<std::int32_t>();
}

/// Returns the bytes that a form needs beside the layer and the samples' bins; an estimate at most
/// 1 % too low. With `keeps_plans`, block training stores the constant parts of its blocks.
inline std::uint64_t form_memory(TrainingForm form, std::size_t n_units,
                                 const coding::SelectiveDesensitization& code,
                                 std::size_t n_samples, bool keeps_plans = false) {
  return with_product_type(code, [&]<class Product>() -> std::uint64_t {
    switch (form) {
      case TrainingForm::dual:
        return DualTraining<Product>::bytes(n_units, code, n_samples);
      case TrainingForm::block:
        return BlockTraining<Product>::bytes(n_units, code, n_samples, keeps_plans);
      default:
        return 0;
    }
  });
}

/// The number of epochs that is assumed if the caller gives none.
inline constexpr std::size_t kExpectedEpochs = 30;

/// Chooses the form, by estimates of the time per presentation.
///
/// Dual training adds a row of n_samples products for every corrected unit, three times slower if
/// its memory exceeds the caches. At the beginning it computes n_samples^2 / 2 inner products and
/// the first potentials; their time is divided by `n_epochs`. Block training reads all weights.
///
/// Throws std::length_error if `form` is not automatic and needs more than `memory_limit` bytes.
inline TrainingForm choose_form(TrainingForm form, std::size_t n_units,
                                const coding::SelectiveDesensitization& code, std::size_t n_samples,
                                std::size_t memory_limit, std::size_t n_epochs = kExpectedEpochs) {
  const auto memory = [&](TrainingForm needed) {
    return form_memory(needed, n_units, code, n_samples);
  };
  if (form != TrainingForm::automatic) {
    if (memory(form) > memory_limit) {
      core::fail(std::length_error("memory_limit must be at least " + std::to_string(memory(form)) +
                                   " bytes for the form " + std::string(name_of(form)) + ", got " +
                                   std::to_string(memory_limit)));
    }
    return form;
  }
  // Relative times of a presentation; their factors were fitted to measured times.
  constexpr std::uint64_t kCacheBytes = std::uint64_t{32} << 20;
  const std::uint64_t padded_units = core::round_up(n_units, kTileStep);
  const std::uint64_t row_factor = memory(TrainingForm::dual) > kCacheBytes ? 3 : 1;
  const std::uint64_t block_cost = code.n_slots() / 8 * (padded_units / 16) + code.n_slots();
  const std::uint64_t set_up_cost =
      std::uint64_t{n_samples} * code.n_words() * 2 / 7 + block_cost / 2;
  const std::uint64_t dual_cost =
      row_factor * n_samples / 2 + n_units +
      set_up_cost / std::clamp<std::size_t>(n_epochs, 1, kExpectedEpochs);
  if (dual_cost <= block_cost && memory(TrainingForm::dual) <= memory_limit) {
    return TrainingForm::dual;
  }
  return memory(TrainingForm::block) <= memory_limit ? TrainingForm::block : TrainingForm::plain;
}

}  // namespace sdnn::estimators
