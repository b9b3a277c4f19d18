/// Conversion of weights between the paper's order and the paired code, and the initial weights and
/// thresholds of an SDNN-C.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {

using PairedColumns = coding::StateCode::PairedColumns;

/// Returns the weight of a hidden unit for a unit of x_SD, which has these columns. The paired code
/// has half sums and half differences of two units; the first unit has half the sum of the two
/// columns' weights, and the second unit half their difference.
inline std::int32_t paired_weight(const HiddenLayer& layer, std::size_t unit,
                                  const PairedColumns& columns) noexcept {
  const std::int32_t first = layer.weight(unit, columns.first);
  return columns.paired ? (first + columns.sign * layer.weight(unit, columns.second)) / 2 : first;
}

/// Returns the largest |weight| of a unit of x_SD, so that the sum of two, a weight of the paired
/// code, fits into the layer.
inline std::int32_t largest_paired_weight(const HiddenLayer& layer) noexcept {
  return layer.weight_limit() / 2;
}

/// Makes a layer for the paired code whose weights and thresholds are 0.
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

/// Adds small random weights to a layer whose weights are 0, in the order of the paper's columns.
/// Throws std::invalid_argument if initial_weight_limit is too large.
inline void add_initial_weights(HiddenLayer& layer, const coding::StateCode& code,
                                const SDNNCConfig& config, std::uint64_t seed) {
  const double limit = config.initial_weight_limit * config.lattice;
  core::require(limit <= largest_paired_weight(layer), "initial_weight_limit",
                "at most " + std::to_string(largest_paired_weight(layer)) + " / lattice",
                config.initial_weight_limit);
  core::Random random(seed, core::Stream::weights);
  std::vector<std::int32_t> drawn(layer.n_units());
  for (std::size_t j = 0; j < code.n_columns(); ++j) {
    core::interruption_point();
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      if (config.initial_weights == InitialWeights::ternary) {
        if (i % 32 == 0) bits = random.bits();  // for 32 weights: 1 for bits 01, -1 for 10, 0 else
        drawn[i] = static_cast<std::int32_t>(bits & 1) - static_cast<std::int32_t>(bits >> 1 & 1);
        bits >>= 2;
      } else {
        const double weight = limit * (2.0 * random.uniform() - 1.0);
        drawn[i] = static_cast<std::int32_t>(std::floor(weight + 0.5));
      }
    }
    const PairedColumns columns = code.columns_of(j);
    layer.add_to_column(columns.first, drawn, 1);
    if (columns.paired) layer.add_to_column(columns.second, drawn, columns.sign);
  }
}

/// Sets large thresholds, alternately negative and positive. The paper numbers units from 1, so the
/// first unit is odd; with a negative threshold it starts active. Throws std::invalid_argument if
/// initial_threshold is not a whole number of lattice steps.
inline void set_initial_thresholds(HiddenLayer& layer, const SDNNCConfig& config) {
  const double steps = config.initial_threshold * config.lattice;
  core::require(steps >= 0 && steps < (1 << 30) && std::floor(steps) == steps, "initial_threshold",
                "a multiple of 1 / lattice, not negative", config.initial_threshold);
  const auto threshold = static_cast<std::int32_t>(steps);
  for (std::size_t i = 0; i < layer.n_units(); ++i) {
    layer.set_threshold(i, i % 2 == 0 ? -threshold : threshold);
  }
}

}  // namespace sdnn::approximators
