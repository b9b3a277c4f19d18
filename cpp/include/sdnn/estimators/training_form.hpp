/// The forms of training: what each needs, and which one suits a problem.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/aligned_buffer.hpp"
#include "sdnn/estimators/weight_tiles.hpp"

namespace sdnn::estimators {

/// Ways to the same bits.
enum class TrainingForm {
  automatic,  ///< the fastest of the others that fits into the memory limit
  dual,       ///< potentials of all training samples, moved by rows of their inner products
  block,      ///< potentials of a block of samples in one pass over the weights
  plain,      ///< one sample after the other
};

inline std::string_view name_of(TrainingForm form) noexcept {
  switch (form) {
    case TrainingForm::dual: return "dual";
    case TrainingForm::block: return "block";
    case TrainingForm::plain: return "plain";
    default: return "auto";
  }
}

/// Throws std::invalid_argument if there is no such form.
inline TrainingForm training_form_named(std::string_view name) {
  for (const auto form : {TrainingForm::automatic, TrainingForm::dual, TrainingForm::block,
                          TrainingForm::plain}) {
    if (name == name_of(form)) return form;
  }
  throw std::invalid_argument("form must be auto, dual, block or plain, got " + std::string(name));
}

/// Bytes per inner product of two codes: two where all of them fit.
inline std::size_t product_bytes(const coding::SelectiveDesensitization& code) noexcept {
  return code.max_active() < std::numeric_limits<std::int16_t>::max() ? 2 : 4;
}

/// Bytes that a form needs beside the layer and the samples' bins; at most 1 % less than it takes.
inline std::size_t form_memory(TrainingForm form, std::size_t n_units,
                               const coding::SelectiveDesensitization& code,
                               std::size_t n_samples) {
  const std::size_t padded_units = core::round_up(n_units, kTileStep);
  const std::size_t padded_samples = core::round_up(n_samples, 32);
  switch (form) {
    case TrainingForm::dual:
      return n_samples * padded_samples * product_bytes(code)        // inner products
             + n_units * padded_samples * sizeof(std::int32_t)       // potentials
             + n_samples * padded_units * sizeof(std::int16_t)       // coefficients
             + coding::CodedSamples::bytes(code, n_samples);
    case TrainingForm::block:
      return WeightTiles<std::int32_t>::bytes(n_units, code.n_slots());
    default: return 0;
  }
}

/// The form to use. An estimate of the time per presentation decides between dual and block: the
/// one moves a row of n_samples for every corrected unit, the other reads all weights; beyond the
/// caches a row costs some four times as much.
///
/// Throws std::length_error if `form` is not automatic and needs more than `memory_limit` bytes.
inline TrainingForm choose_form(TrainingForm form, std::size_t n_units,
                                const coding::SelectiveDesensitization& code,
                                std::size_t n_samples, std::size_t memory_limit) {
  const auto memory = [&](TrainingForm f) { return form_memory(f, n_units, code, n_samples); };
  if (form != TrainingForm::automatic) {
    if (memory(form) > memory_limit) {
      throw std::length_error("memory_limit must be at least " + std::to_string(memory(form)) +
                              " bytes for the form " + std::string(name_of(form)) + ", got " +
                              std::to_string(memory_limit));
    }
    return form;
  }
  const std::size_t padded_units = core::round_up(n_units, kTileStep);
  const std::size_t row_factor = memory(TrainingForm::dual) > (std::size_t{32} << 20) ? 4 : 1;
  const std::size_t dual_cost = row_factor * n_samples / 2 + n_units;
  const std::size_t block_cost = code.n_slots() / 2 * (padded_units / 16) / 2 + code.n_slots() * 2;
  if (dual_cost <= block_cost && memory(TrainingForm::dual) <= memory_limit) {
    return TrainingForm::dual;
  }
  return memory(TrainingForm::block) <= memory_limit ? TrainingForm::block : TrainingForm::plain;
}

}  // namespace sdnn::estimators
