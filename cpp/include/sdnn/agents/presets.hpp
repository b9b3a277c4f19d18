/// Named settings of Q-learning with SDNN-C: the paper's, and those we recommend.
#pragma once

#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"

namespace sdnn::agents {

/// Settings that belong together.
struct Preset {
  approximators::SDNNCConfig approximator = {};
  QLearningConfig learning = {};
};

/// As in the paper (section 4.2): the defaults.
inline Preset paper_preset(int n_inputs) { return {.approximator = {.n_inputs = n_inputs}}; }

/// Steady with noisy sensors: few actions part the best one from its neighbours by more than noise
/// blurs, and a success that reaches the whole path at once is not forgotten (docs/collapse.md).
inline Preset robust_preset(int n_inputs) {
  return {.approximator = {.n_inputs = n_inputs, .n_actions = 61}, .learning = {.n_steps = 5}};
}

}  // namespace sdnn::agents
