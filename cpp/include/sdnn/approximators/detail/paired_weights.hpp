/// Conversion of weights between the paper's order and the paired code.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/interruption.hpp"

namespace sdnn::approximators {

using PairedColumns = coding::StateCode::PairedColumns;

/// The weight of a hidden unit for the unit of x_SD that has these columns.
inline std::int32_t paired_weight(const HiddenLayer& layer, std::size_t unit,
                                  const PairedColumns& columns) noexcept {
  const std::int32_t first = layer.weight(unit, columns.first);
  return columns.paired ? (first + columns.sign * layer.weight(unit, columns.second)) / 2 : first;
}

/// The largest |weight| for a layer, so that the sum of two weights fits.
inline std::int32_t largest_paired_weight(const HiddenLayer& layer) noexcept {
  return layer.weight_limit() / 2;
}

/// Makes a layer for the paired code with weights and thresholds of zero.
inline HiddenLayer paired_layer(const coding::StateCode& code, std::size_t n_units) {
  return {n_units, code.n_columns(), code.n_double_columns()};
}

/// Makes a layer with the weights weight(unit, columns, j), j in the paper's order, and the
/// thresholds threshold(unit). Throws std::invalid_argument for values out of range.
template <class Weight, class Threshold>
HiddenLayer paired_layer(const coding::StateCode& code, std::size_t n_units, const Weight& weight,
                         const Threshold& threshold) {
  HiddenLayer layer = paired_layer(code, n_units);
  std::vector<std::int32_t> weights(n_units);
  for (std::size_t j = 0; j < code.n_columns(); ++j) {
    core::interruption_point();
    const PairedColumns columns = code.columns_of(j);
    for (std::size_t unit = 0; unit < n_units; ++unit) weights[unit] = weight(unit, columns, j);
    layer.add_to_column(columns.first, weights, 1);
    if (columns.paired) layer.add_to_column(columns.second, weights, columns.sign);
  }
  for (std::size_t unit = 0; unit < n_units; ++unit) layer.set_threshold(unit, threshold(unit));
  return layer;
}

}  // namespace sdnn::approximators
