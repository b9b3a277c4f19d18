/// The wiring of an SDNN-C: how code books, pairs and permutations follow from config and seed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/approximators/detail/activation_cache.hpp"
#include "sdnn/approximators/detail/correction_log.hpp"
#include "sdnn/approximators/detail/weight_average.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/permutation.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/coding/symbol_patterns.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/check_fields.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {

inline std::size_t checked_inputs(const SDNNCConfig& config) {
  core::check_fields(config);
  return static_cast<std::size_t>(config.n_inputs);
}

/// Throws std::length_error if the network, with so many bins of all inputs, has more bytes than
/// config.max_table_bytes. In doubles, which no product overflows; their rounding does not matter.
inline void require_room(const SDNNCConfig& config, double n_bins) {
  const coding::ActionCode sizes(config.n_hidden_units, config.n_active_units, config.n_actions);
  const double l = config.n_inputs;
  const double n_units = static_cast<double>(sizes.n_hidden_units());
  const double n_partners = config.n_partners();
  const double n_columns = l * n_partners * config.n_pattern_units;
  double weights = 2.0 * n_units * n_columns + 4.0 * n_columns;
  if (config.averaging_interval > 0) {  // the average, and a layer and a memory made of it
    weights += WeightAverage::n_bytes(n_units, n_columns) + 2.0 * n_units * n_columns;
  }
  const double patterns = config.pattern_bytes(n_bins);
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

/// The patterns of every input, by anchors or of symbols. Throws std::invalid_argument naming the
/// field that is impossible, and as require_room before they are made.
inline std::vector<coding::PatternTable> code_books_of(const SDNNCConfig& config,
                                                       std::uint64_t seed) {
  const std::size_t l = checked_inputs(config);
  core::require(config.circular.empty() || config.circular.size() == l, "circular",
                "empty or one flag per input", config.circular.size());
  core::require(config.n_symbols.empty() || config.n_symbols.size() == l, "n_symbols",
                "empty or a number per input", config.n_symbols.size());
  const auto n_symbols_of = [&config](std::size_t mu) {
    return config.n_symbols.empty() ? 0 : config.n_symbols[mu];
  };
  const auto is_circular = [&config](std::size_t mu) {
    return !config.circular.empty() && config.circular[mu];
  };
  for (std::size_t mu = 0; mu < l; ++mu) {
    core::require(n_symbols_of(mu) == 0 || !is_circular(mu), "circular",
                  "false for an input of symbols", true);
  }
  require_room(config, config.n_bins());
  std::vector<coding::PatternTable> tables;
  for (std::size_t mu = 0; mu < l; ++mu) {
    core::Random random(seed, core::Stream::code_books, mu);
    tables.push_back(n_symbols_of(mu) > 0
                         ? coding::symbol_patterns(n_symbols_of(mu), config.n_pattern_units,
                                                   config.balanced_anchors, random)
                         : coding::anchor_patterns({.n_units = config.n_pattern_units,
                                                    .n_anchor_patterns = config.n_anchor_patterns,
                                                    .n_interpolated = config.n_interpolated,
                                                    .balanced = config.balanced_anchors,
                                                    .circular = is_circular(mu)},
                                                   random));
  }
  return tables;
}

/// The strides of the code, ascending: so many at random.
inline std::vector<std::size_t> strides_of(const SDNNCConfig& config, std::uint64_t seed) {
  core::Random random(seed, core::Stream::pairs);
  coding::Permutation order = coding::random_permutation(checked_inputs(config) - 1, random);
  order.resize(static_cast<std::size_t>(config.n_partners()));
  std::ranges::sort(order);
  std::vector<std::size_t> strides;
  for (const auto place : order) strides.push_back(std::size_t{place} + 1);
  return strides;
}

/// The code over these tables, a permutation per pair. Throws std::invalid_argument if the tables
/// are not of the config's inputs and units, and as require_room.
inline std::shared_ptr<const coding::StateCode> wiring_of(const SDNNCConfig& config,
                                                          std::vector<coding::PatternTable> tables,
                                                          std::uint64_t seed) {
  const std::size_t l = checked_inputs(config);
  core::require(tables.size() == l, "tables", "one per input", tables.size());
  std::size_t n_bins = 0;
  for (const coding::PatternTable& table : tables) {
    core::require(table.n_units() == static_cast<std::size_t>(config.n_pattern_units), "tables",
                  "of n_pattern_units = " + std::to_string(config.n_pattern_units) + " units",
                  table.n_units());
    n_bins += table.n_bins();
  }
  require_room(config, static_cast<double>(n_bins));
  const std::vector<std::size_t> strides = strides_of(config, seed);
  std::vector<coding::Permutation> permutations;
  for (std::size_t group = 0; group < l * strides.size(); ++group) {
    core::Random random(seed, core::Stream::permutations, group);
    permutations.push_back(
        coding::random_permutation(static_cast<std::size_t>(config.n_pattern_units), random));
  }
  return std::make_shared<const coding::StateCode>(std::move(tables), std::move(permutations),
                                                   strides);
}

}  // namespace sdnn::approximators
