/// The check that an SDNN-C fits into its memory limit.
#pragma once

#include <algorithm>
#include <cstddef>

#include "sdnn/approximators/detail/activation_cache.hpp"
#include "sdnn/approximators/detail/state_wiring.hpp"
#include "sdnn/approximators/detail/weight_average.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/state_code_config.hpp"
#include "sdnn/core/detail/grid_cells.hpp"

namespace sdnn::approximators {

/// Throws std::length_error if the network, whose inputs have `n_bins` bins in total, needs more
/// bytes than config.max_table_bytes. The message names the settings behind the largest part.
/// Doubles are used because no product overflows them; their rounding does not matter.
inline void require_room(const SDNNCConfig& config, double n_bins) {
  const coding::ActionCode sizes(config.n_hidden_units, config.n_active_units, config.n_actions);
  const double l = config.n_inputs;
  const double n_units = static_cast<double>(sizes.n_hidden_units());
  const double n_partners = coding::n_partners_of(config);
  const double n_columns = l * n_partners * config.n_pattern_units;
  // Two bytes for each weight, and four of a permutation for each column.
  double weights = 2.0 * n_units * n_columns + 4.0 * n_columns;
  if (config.averaging_interval > 0) {  // the average, its layer and its cache
    weights += WeightAverage::n_bytes(n_units, n_columns) + 2.0 * n_units * n_columns;
  }
  const double patterns = coding::pattern_bytes_of(config, n_bins);
  const double remembered = static_cast<double>(ActivationCache::n_bytes(sizes.n_hidden_units()) +
                                                CorrectionLog::n_bytes(sizes.n_active_units()));
  const char* largest = "max_pairs, n_hidden_units, n_pattern_units or n_inputs";
  if (patterns > std::max(weights, remembered)) {
    largest = config.n_symbols.empty()
                  ? "n_interpolated, n_anchor_patterns, n_pattern_units or n_inputs"
                  : "n_symbols, n_interpolated, n_anchor_patterns or n_pattern_units";
  } else if (remembered > weights) {
    largest = "n_hidden_units or n_active_units";
  }
  core::require_table_bytes(largest, "weights, patterns and remembered potentials",
                            weights + patterns + remembered, config.max_table_bytes);
}

}  // namespace sdnn::approximators
