/// Columns that encode the size of each input by itself, beside the code of pairs of inputs.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"

namespace sdnn::approximators {

/// Thermometer codes of inputs: unit k of an input is +1 if the input is above threshold k, and
/// else -1. The thresholds are evenly spaced over the input's bins.
///
/// The inner product of two such codes falls linearly with the distance of the inputs, from n_units
/// to -n_units at opposite ends. A readout of these codes learns trends over the whole range at
/// once, like a linear function of the inputs, with the integer arithmetic of other codes.
class Thermometers {
 public:
  /// Makes codes without columns.
  Thermometers() = default;
  /// Makes codes of `n_units` units for inputs with n_bins[i] bins; inputs with 0 bins have no
  /// code.
  Thermometers(std::size_t n_units, std::vector<coding::Bin> n_bins)
      : n_units_(static_cast<coding::Bin>(n_units)), n_bins_(std::move(n_bins)) {}

  /// The number of columns: one for each unit, 0 for an input without a code.
  std::size_t n_columns() const noexcept {
    const auto n_codes = std::ranges::count_if(n_bins_, [](auto n) { return n > 0; });
    return static_cast<std::size_t>(n_codes) * static_cast<std::size_t>(n_units_);
  }

  /// Writes the codes of all inputs one after the other, and returns how many columns are not 0. A
  /// bin of n_bins[i] or more stands for a missing reading: its code is 0. Shapes: bins (l,), signs
  /// (n_columns,).
  std::size_t write(std::span<const coding::Bin> bins, std::int8_t* signs) const noexcept {
    std::size_t n_active = 0;
    for (std::size_t i = 0; i < n_bins_.size(); ++i) {
      const coding::Bin n_bins = n_bins_[i];
      if (n_bins == 0) continue;
      signs = std::fill_n(signs, n_units_, 0);
      if (bins[i] >= n_bins) continue;
      const coding::Bin last = std::max(n_bins - 1, 1);
      // The number of thresholds below the input: n_units * bin / last, rounded to the nearest
      // integer.
      const std::int64_t twice_above = std::int64_t{2} * bins[i] * n_units_ + last;
      const auto n_above = static_cast<coding::Bin>(twice_above / (std::int64_t{2} * last));
      std::fill_n(signs - n_units_, n_above, 1);
      std::fill(signs - n_units_ + n_above, signs, -1);
      n_active += static_cast<std::size_t>(n_units_);
    }
    return n_active;
  }

 private:
  coding::Bin n_units_ = 0;
  std::vector<coding::Bin> n_bins_;
};

}  // namespace sdnn::approximators
