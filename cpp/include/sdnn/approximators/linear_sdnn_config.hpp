/// The configuration of a linear readout of the SDNN code.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "sdnn/coding/state_code_config.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/grid_cells.hpp"

namespace sdnn::approximators {

/// The configuration of a linear readout; the defaults are recommended for any task.
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
            "m, units per pattern. 0: as many as make about 3,072 columns, at most 768; at least "
            "256 where these make no more than 14,336 columns, at least 64 anywhere.",
            0),
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

/// Returns the configuration with a chosen number of pattern units if n_pattern_units is 0. The
/// number is a compromise: patterns of too few units are correlated by chance, and more columns
/// take more time.
inline LinearSDNNConfig with_pattern_units(LinearSDNNConfig config) noexcept {
  if (config.n_pattern_units == 0) {
    // The number of inputs is not checked yet, hence 64 bits.
    const std::int64_t n_partners = coding::n_partners_of(config);
    const std::int64_t n_groups = std::max<std::int64_t>(1, config.n_inputs * n_partners);
    // The result is a multiple of 64, a word. `usual` units make about 3,072 columns. `enough`
    // units keep chance correlations small: 256, or as many as make at most 14,336 columns.
    const std::int64_t usual = (3072 / n_groups + 32) / 64 * 64;
    const std::int64_t enough = std::min<std::int64_t>(256, 14336 / n_groups / 64 * 64);
    config.n_pattern_units =
        static_cast<int>(std::clamp<std::int64_t>(std::max(usual, enough), 64, 768));
  }
  return config;
}

/// Returns the number of weights of a readout with n_actions[d] actions in dimension d, including
/// the weights of padding columns, which are always 0. The result is a double, because the fields
/// may not be checked yet and their product may not fit into an integer.
inline double n_linear_weights(const LinearSDNNConfig& config,
                               std::span<const std::size_t> n_actions) {
  double n_rows = 0.0;
  for (const std::size_t n : n_actions) {
    n_rows += static_cast<double>(n) + config.action_window - 1.0;
  }
  return n_rows * 64.0 * std::ceil(config.n_pattern_units / 64.0) * config.n_inputs *
         coding::n_partners_of(config);
}

/// Throws std::length_error if `n_weights` weights, their average (if there is one), a trace and
/// the patterns of `n_bins` bins together have more bytes than config.max_table_bytes.
inline void require_room(const LinearSDNNConfig& config, double n_bins, double n_weights) {
  // Weights, traces and averages have four bytes each.
  const double n_copies = config.averaging_interval > 0 ? 3.0 : 2.0;
  core::require_table_bytes(
      "max_pairs, n_pattern_units, n_inputs, n_actions, action_window or n_interpolated",
      "weights, a trace and patterns",
      4.0 * n_copies * n_weights + coding::pattern_bytes_of(config, n_bins),
      config.max_table_bytes);
}
/// Checks the room, as above, for the config's n_actions actions of a single dimension. The shared
/// functions of state_wiring.hpp call it before they make the code.
inline void require_room(const LinearSDNNConfig& config, double n_bins) {
  const std::size_t n_actions[] = {static_cast<std::size_t>(config.n_actions)};
  require_room(config, n_bins, n_linear_weights(config, n_actions));
}

}  // namespace sdnn::approximators
