/// The forms of training: what each needs, and which one suits a problem.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "sdnn/coding/detail/coded_samples.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/estimators/detail/chunked_weights.hpp"
#include "sdnn/estimators/detail/code_walk.hpp"
#include "sdnn/estimators/detail/presentation_window.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"

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
    case TrainingForm::dual:
      return "dual";
    case TrainingForm::block:
      return "block";
    case TrainingForm::plain:
      return "plain";
    default:
      return "auto";
  }
}

/// Throws std::invalid_argument if there is no such form.
inline TrainingForm training_form_named(std::string_view name) {
  for (const auto form :
       {TrainingForm::automatic, TrainingForm::dual, TrainingForm::block, TrainingForm::plain}) {
    if (name == name_of(form)) return form;
  }
  throw std::invalid_argument("form must be auto, dual, block or plain, got " + std::string(name));
}

/// Bytes per inner product of two codes: two where all of them fit.
inline std::size_t product_bytes(const coding::SelectiveDesensitization& code) noexcept {
  return code.max_active() < std::numeric_limits<std::int16_t>::max() ? 2 : 4;
}

/// Entries of a row that dual training keeps per sample or unit: room for a window from any sample
/// on.
constexpr std::size_t dual_row_size(std::size_t n_samples) noexcept {
  return core::round_up(n_samples + PresentationWindow::kAtOnce - 1, 32);
}

/// Samples that block training presents per pass over the weights: where what does not change of a
/// block is kept from round to round, and elsewhere. Dual training presents small blocks.
inline constexpr std::size_t kLargeBlock = 512;
inline constexpr std::size_t kSmallBlock = 128;

/// Words of a code in block training, filled up with zeros to whole chunks.
inline std::size_t block_words(const coding::SelectiveDesensitization& code) noexcept {
  return core::round_up(code.n_words(), 2 * kChunkWords);
}

/// Bytes that a block of samples needs: codes, potentials, inner products and the walk.
inline std::size_t block_bytes(std::size_t n_samples, std::size_t padded_units,
                               const coding::SelectiveDesensitization& code) {
  const std::size_t n_words = block_words(code);
  return n_samples * ((2 * 8 + 64) * n_words + sizeof(std::int32_t) * padded_units +
                      n_samples * product_bytes(code)) +
         PresentationWindow::bytes(padded_units, n_samples) +
         CodeWalk::bytes(n_samples, n_words, code.max_active());
}

/// Bytes more that block training needs to keep what does not change of its blocks.
inline std::size_t plan_bytes(std::size_t n_units, const coding::SelectiveDesensitization& code,
                              std::size_t n_samples) {
  const std::size_t padded_units = core::round_up(n_units, kTileStep);
  return block_bytes(kLargeBlock, padded_units, code) -
         block_bytes(kSmallBlock, padded_units, code) +
         n_samples * kLargeBlock * product_bytes(code) +
         CodeWalk::bytes(n_samples, block_words(code), code.max_active());
}

/// Bytes that a form needs beside the layer and the samples' bins; at most 1 % less than it takes.
inline std::size_t form_memory(TrainingForm form, std::size_t n_units,
                               const coding::SelectiveDesensitization& code,
                               std::size_t n_samples) {
  const std::size_t padded_units = core::round_up(n_units, kTileStep);
  const std::size_t row_size = dual_row_size(n_samples);
  switch (form) {
    case TrainingForm::dual:
      return n_samples * row_size * product_bytes(code)         // inner products
             + n_units * row_size * sizeof(std::int32_t)        // potentials
             + n_samples * padded_units * sizeof(std::int16_t)  // coefficients
             + coding::CodedSamples::bytes(code, n_samples) +
             PresentationWindow::bytes(padded_units, kSmallBlock) +
             kSmallBlock * kSmallBlock * product_bytes(code);
    case TrainingForm::block:
      return ChunkedWeights<std::int32_t>::bytes(padded_units, block_words(code)) +
             block_bytes(kSmallBlock, padded_units, code);
    default:
      return 0;
  }
}

/// The form to use. An estimate of the time per presentation decides between dual and block: the
/// one moves a row of n_samples for every corrected unit, the other reads all weights; beyond the
/// caches a row costs some four times as much.
///
/// Throws std::length_error if `form` is not automatic and needs more than `memory_limit` bytes.
inline TrainingForm choose_form(TrainingForm form, std::size_t n_units,
                                const coding::SelectiveDesensitization& code, std::size_t n_samples,
                                std::size_t memory_limit) {
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
  const std::size_t block_cost = code.n_slots() / 8 * (padded_units / 16) + code.n_slots();
  if (dual_cost <= block_cost && memory(TrainingForm::dual) <= memory_limit) {
    return TrainingForm::dual;
  }
  return memory(TrainingForm::block) <= memory_limit ? TrainingForm::block : TrainingForm::plain;
}

}  // namespace sdnn::estimators
