/// Everything that defines a linear readout of the SDNN code.
#pragma once

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <vector>

#include "sdnn/coding/state_code_config.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/grid_cells.hpp"

namespace sdnn::approximators {

/// Everything that defines a linear readout; the defaults are those we recommend for any task.
struct LinearSDNNConfig {
  int n_inputs = 4;
  int max_pairs = 0;
  int n_pattern_units = 0;
  int n_anchor_patterns = 9;
  int n_interpolated = 44;
  bool balanced_anchors = true;
  std::vector<bool> circular = {};
  std::vector<int> n_symbols = {};
  int n_actions = 3;
  int action_window = 1;
  int averaging_interval = 30;
  std::uint64_t max_table_bytes = core::kDefaultMaxTableBytes;

  static constexpr auto fields() noexcept {
    return std::tuple_cat(
        coding::state_code_fields<LinearSDNNConfig>(
            "m, units per pattern. 0: as many as make about 3,072 columns, from 64 to 768.", 0),
        std::tuple(
            core::field("n_actions", &LinearSDNNConfig::n_actions,
                        "Number of actions, of each dimension of a box.", core::within(1, 1 << 16)),
            core::field("action_window", &LinearSDNNConfig::action_window,
                        "Neighbouring readout units that an action of a box has. Actions "
                        "less than so many apart share some, and so learn from each other; "
                        "with 1 none do.",
                        core::within(1, 1 << 16)),
            core::field("averaging_interval", &LinearSDNNConfig::averaging_interval,
                        "With more than 0 the readout keeps an average of its weights, by "
                        "which greedy actions are chosen, and takes a snapshot for it after "
                        "so many corrections. What was learned last counts most.",
                        core::within(0, 1000000000)),
            core::field("max_table_bytes", &LinearSDNNConfig::max_table_bytes,
                        "A larger readout (weights, patterns, one trace) is refused before "
                        "memory is allocated; 1 GiB by default.")));
  }
  bool operator==(const LinearSDNNConfig&) const = default;
};

/// The configuration with a number of units where it has none.
inline LinearSDNNConfig with_pattern_units(LinearSDNNConfig config) noexcept {
  if (config.n_pattern_units == 0) {
    const int n_groups = std::max(1, config.n_inputs * coding::n_partners_of(config));
    config.n_pattern_units = std::clamp((3072 / n_groups + 32) / 64 * 64, 64, 768);
  }
  return config;
}

}  // namespace sdnn::approximators
