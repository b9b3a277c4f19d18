/// Named settings of agents: the paper's, and those we recommend.
#pragma once

#include <array>

#include "sdnn/agents/actor_critic_config.hpp"
#include "sdnn/agents/observation_config.hpp"
#include "sdnn/agents/q_lambda_config.hpp"
#include "sdnn/agents/q_learning_config.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"

namespace sdnn::agents {

/// Settings of an approximator and a learning rule that belong together, and how observations
/// become states unless the task decides.
template <class Approximator, class Learning>
struct Settings {
  Approximator approximator = {};
  Learning learning = {};
  ObservationConfig observation = {};
};
using Preset = Settings<approximators::SDNNCConfig, QLearningConfig>;
using QLambdaPreset = Settings<approximators::LinearSDNNConfig, QLambdaConfig>;
using ActorCriticPreset = Settings<approximators::LinearSDNNConfig, ActorCriticConfig>;

/// The paper's settings (section 4.2): the defaults.
inline Preset paper_preset(int n_inputs) { return {.approximator = {.n_inputs = n_inputs}}; }

/// Settings for any task: a learning rate of 1 that falls with the progress; five-step targets;
/// repeated random actions; greedy actions by an average of the weights; values in steps half as
/// large as the paper's (docs/evidence/benchmarks.md).
inline Preset general_preset(int n_inputs) {
  return {.approximator = {.n_inputs = n_inputs,
                           .max_pairs = 56,
                           .n_hidden_units = 1800,
                           .n_active_units = 600,
                           .n_actions = 5,
                           .averaging_interval = 100},
          .learning = {.learning_rate = 1.0,
                       .discount = 0.99,
                       .policy = {.epsilon = 0.03, .n_greedy_steps = 0},
                       .n_steps = 5,
                       .max_action_repeat = 100,
                       .final_learning_rate = 0.1,
                       .final_epsilon = 0.01,
                       .value_range = ValueRange::adaptive}};
}

/// The general preset with fewer units, so that the weights fit into the flash of a small processor
/// (docs/how-to/small-processors.md).
inline Preset small_preset(int n_inputs) {
  Preset preset = general_preset(n_inputs);
  preset.approximator.n_hidden_units = 900;
  preset.approximator.n_active_units = 300;
  preset.approximator.n_pattern_units = 40;
  return preset;
}

/// Settings that do not collapse with noisy sensors in the paper's task
/// (docs/explanation/collapse.md). With few actions the best one differs from its neighbours by
/// more than the noise, and five-step targets pass a success on to earlier states at once.
inline Preset robust_preset(int n_inputs) {
  return {.approximator = {.n_inputs = n_inputs, .n_actions = 61}, .learning = {.n_steps = 5}};
}

/// A preset with the name and the title by which users select it.
template <class Preset>
struct Named {
  const char* name;
  const char* title;
  Preset preset;
};
using NamedPreset = Named<Preset>;
using NamedQLambdaPreset = Named<QLambdaPreset>;
using NamedActorCriticPreset = Named<ActorCriticPreset>;

/// The presets of SDNN-C, by name.
inline std::array<NamedPreset, 4> presets(int n_inputs) {
  return {{{"paper", "as in the paper", paper_preset(n_inputs)},
           {"general", "as recommended for any task", general_preset(n_inputs)},
           {"robust", "as recommended for the paper's task: steady with noisy sensors",
            robust_preset(n_inputs)},
           {"small", "as recommended for small processors: the general one, fewer units",
            small_preset(n_inputs)}}};
}

/// The paper's learning rule and rates for the paper's task: one-step Q-learning with alpha 0.5,
/// without averages of weights or a schedule. The 61 torques share no units, patterns have 200
/// units, and ranges of observations that are far too wide are narrowed.
inline QLambdaPreset paper_q_lambda_preset(int n_inputs) {
  return {.approximator = {.n_inputs = n_inputs,
                           .n_pattern_units = 200,
                           .n_actions = 61,
                           .averaging_interval = 0},
          .learning = {.learning_rate = 0.5,
                       .discount = 0.9,
                       .policy = {},
                       .trace_decay = 0.0,
                       .bootstrap = Bootstrap::q_learning,
                       .schedule_steps = 0,
                       .max_action_repeat = 1,
                       .final_learning_rate = {},
                       .final_epsilon = {}},
          .observation = {.narrowed = true}};
}

/// The defaults: for any task.
inline QLambdaPreset general_q_lambda_preset(int n_inputs) {
  return {.approximator = {.n_inputs = n_inputs},
          .learning = {},
          .observation = {.narrowed = true,
                          .find_angle_pairs = true,
                          .relevant_only = true,
                          .history = History::automatic}};
}

inline std::array<NamedQLambdaPreset, 2> q_lambda_presets(int n_inputs) {
  return {{{"paper", "the paper's rule, in the paper's task", paper_q_lambda_preset(n_inputs)},
           {"general", "as recommended for any task", general_q_lambda_preset(n_inputs)}}};
}

/// The defaults of the actor-critic with running ranges: five actions in each dimension of a box.
inline ActorCriticPreset general_actor_critic_preset(int n_inputs) {
  return {.approximator = {.n_inputs = n_inputs, .n_actions = 5},
          .learning = {},
          .observation = {.running = true, .history = History::automatic}};
}

inline std::array<NamedActorCriticPreset, 1> actor_critic_presets(int n_inputs) {
  return {{{"general", "as recommended for any task", general_actor_critic_preset(n_inputs)}}};
}

}  // namespace sdnn::agents
