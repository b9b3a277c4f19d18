/// The parameters of the actor-critic.
#pragma once

#include <optional>
#include <tuple>

#include "sdnn/core/config_fields.hpp"

namespace sdnn::agents {

/// The agent's parameters; the defaults, for any task, were tuned with seeds from 1000 on, which no
/// published result uses.
struct ActorCriticConfig {
  double learning_rate = 0.5;
  double discount = 0.99;
  double trace_decay = 0.9;
  double actor_learning_rate = 0.1;
  double entropy = 0.01;
  int schedule_steps = 20000;
  std::optional<double> final_learning_rate = 0.03;
  std::optional<double> final_actor_learning_rate = 0.02;
  bool thermometers = true;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("learning_rate", &ActorCriticConfig::learning_rate,
                    "alpha of the critic: the share of an error that a step corrects.",
                    core::above_up_to(0, 1)),
        core::field("discount", &ActorCriticConfig::discount, "gamma.", core::within(0, 1)),
        core::field("trace_decay", &ActorCriticConfig::trace_decay,
                    "lambda: what remains of a trace after a step, beside the discount.",
                    core::within(0, 1)),
        core::field("actor_learning_rate", &ActorCriticConfig::actor_learning_rate,
                    "alpha of the actor, for TD errors in units of their root mean square.",
                    core::above_up_to(0, 1)),
        core::field("entropy", &ActorCriticConfig::entropy,
                    "The weight of the policy's entropy, in units of the same: with more, actions "
                    "stay random for longer.",
                    core::within(0, 1)),
        core::field("schedule_steps", &ActorCriticConfig::schedule_steps,
                    "Steps after which both rates have gone half of the way to their final "
                    "values: after t steps they have gone t / (t + schedule_steps) of it.",
                    core::within(1, 1 << 30)),
        core::field("final_learning_rate", &ActorCriticConfig::final_learning_rate,
                    "What the critic's alpha approaches; None: it stays.", core::above_up_to(0, 1)),
        core::field("final_actor_learning_rate", &ActorCriticConfig::final_actor_learning_rate,
                    "What the actor's alpha approaches; None: it stays.", core::above_up_to(0, 1)),
        core::field("thermometers", &ActorCriticConfig::thermometers,
                    "Whether the code has thermometers of single inputs, too, by which trends over "
                    "whole ranges are learned at once."));
  }
  bool operator==(const ActorCriticConfig&) const = default;
};

}  // namespace sdnn::agents
