/// The initial hidden layer of an SDNN-C.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdnn/approximators/detail/paired_weights.hpp"
#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {

/// Adds small random weights to a layer whose weights are zero.
inline void add_initial_weights(HiddenLayer& layer, const coding::StateCode& code,
                                const SDNNCConfig& config, std::uint64_t seed) {
  core::require(std::isfinite(config.initial_weight_limit) && config.initial_weight_limit >= 0,
                "initial_weight_limit", "finite and not negative", config.initial_weight_limit);
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
        if (i % 32 == 0) bits = random.bits();  // two bits a weight
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
/// first unit is odd and starts active.
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
