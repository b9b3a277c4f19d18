/// Small agents that learn by Q-learning.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "agents/one_dimension.hpp"
#include "approximators/lookup_table.hpp"
#include "errors.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::agents::small_q_learning {

using approximators::RBFNetwork;
using approximators::SDNNC;
using testing::LookupTable;
using testing::OneDimension;
using Agent = OneDimension<QLearning<LookupTable>>;
using Indices = std::vector<std::size_t>;
using Position = std::array<double, 1>;

/// Values of two or more actions in five cells of the unit interval.
inline LookupTable five_cells(std::size_t n_actions = 2) { return {1, 5, n_actions}; }

/// The middle of cell `i` of five.
inline Position cell(int i) { return {(i + 0.5) / 5.0}; }

inline std::string error_of_config(const QLearningConfig& config) {
  return testing::message_of([&] { Agent(five_cells(), config, 1); });
}

/// Counts of 4 to 36 firing units stand for values from -16 to 16: all whole numbers.
inline approximators::SDNNCConfig small_network() {
  return {.n_inputs = 2,
          .n_pattern_units = 16,
          .n_anchor_patterns = 3,
          .n_interpolated = 3,
          .n_hidden_units = 60,
          .n_active_units = 40,
          .n_actions = 7,
          .q_low = -16.0,
          .q_high = 16.0,
          .u_low = 4,
          .u_high = 36};
}

/// Every setting that adds to an agent's state.
inline QLearningConfig config_with_all_settings() {
  return {.policy = {.epsilon = 0.3, .n_greedy_steps = 2},
          .n_steps = 4,
          .max_action_repeat = 5,
          .final_learning_rate = 0.25,
          .final_epsilon = 0.0,
          .value_range = ValueRange::adaptive,
          .start_steps = 20};
}

inline OneDimension<QLearning<SDNNC>> sdnn_agent() {
  approximators::SDNNCConfig config = small_network();
  config.rounding = approximators::Rounding::random;
  config.averaging_interval = 9;
  return {SDNNC(config, 3), config_with_all_settings(), 3};
}

inline OneDimension<QLearning<RBFNetwork>> rbf_agent() {
  return {RBFNetwork({.n_inputs = 2, .n_bases = 3, .n_actions = 7, .gradient_rate = 0.5}),
          config_with_all_settings(), 3};
}

inline QLearning<SDNNC> agent_of_two_dimensions() {
  approximators::SDNNCConfig config = small_network();
  config.rounding = approximators::Rounding::random;
  std::vector<SDNNC> parts = {SDNNC(config, 3)};
  config.n_actions = 5;
  parts.emplace_back(config, seed_of_dimension(3, 1));
  return {std::move(parts), config_with_all_settings(), 3};
}

}  // namespace sdnn::agents::small_q_learning
