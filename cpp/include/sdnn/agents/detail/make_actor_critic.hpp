/// An actor-critic of a task's sizes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/actor_critic.hpp"
#include "sdnn/agents/actor_critic_config.hpp"
#include "sdnn/approximators/detail/thermometers.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/state_code_config.hpp"
#include "sdnn/core/config_fields.hpp"

namespace sdnn::agents::detail {

/// Makes the thermometers of all inputs except circular ones and symbols. Their total number of
/// columns is at most half of the columns that are not 0 in the code of pairs, except that each
/// input has at least 64. Throws std::invalid_argument naming the field that is out of range.
inline approximators::Thermometers thermometers_of(approximators::LinearSDNNConfig config,
                                                   const ActorCriticConfig& learning) {
  if (!learning.thermometers) return {};
  core::check_fields(config);
  config = approximators::with_pattern_units(config);
  const auto n_bins = (config.n_anchor_patterns - 1) * (config.n_interpolated + 1);
  std::vector<coding::Bin> n_bins_of(static_cast<std::size_t>(config.n_inputs), n_bins);
  for (std::size_t i = 0; i < n_bins_of.size(); ++i) {
    const bool is_symbol = i < config.n_symbols.size() && config.n_symbols[i] > 0;
    if (is_symbol || (i < config.circular.size() && config.circular[i])) n_bins_of[i] = 0;
  }
  // In its pairs half of an input's columns are active; the paired code has half as many.
  const std::int64_t n_active =
      std::int64_t{config.n_pattern_units} * coding::n_partners_of(config) / 4;
  const auto n_words = static_cast<std::size_t>(std::max<std::int64_t>(1, n_active / (2 * 64)));
  return {64 * n_words, std::move(n_bins_of)};
}

/// The number of columns of the critic, and of each action.
inline double n_columns_of(const approximators::LinearSDNNConfig& config,
                           const approximators::Thermometers& thermometers) {
  auto of_one = config;
  of_one.action_window = 1;
  const std::size_t n_actions[] = {1};
  return approximators::n_linear_weights(of_one, n_actions) +
         static_cast<double>(thermometers.n_columns());
}
inline double n_rows_of(const std::vector<std::size_t>& n_actions) {
  return std::accumulate(n_actions.begin(), n_actions.end(), 0.0);
}

/// Makes an actor-critic, which ignores action_window and averaging_interval. Throws
/// std::invalid_argument naming a field, and std::length_error if a part is too large.
inline ActorCritic make_actor_critic(approximators::LinearSDNNConfig config,
                                     const ActorCriticConfig& learning,
                                     const std::vector<std::size_t>& n_actions,
                                     std::vector<coding::PatternTable> tables,
                                     approximators::Thermometers thermometers, std::uint64_t seed) {
  config = approximators::with_pattern_units(config);
  config.action_window = 1;
  config.averaging_interval = 0;
  double n_bins = 0.0;
  for (const coding::PatternTable& table : tables) n_bins += static_cast<double>(table.n_bins());
  approximators::require_room(config, n_bins,
                              n_columns_of(config, thermometers) * (n_rows_of(n_actions) + 1.0));
  const std::size_t only_action[] = {1};
  approximators::LinearSDNN critic(config, only_action, std::move(tables), seed, 0,
                                   std::move(thermometers));
  return {std::move(critic), n_actions, learning, seed};
}

}  // namespace sdnn::agents::detail
