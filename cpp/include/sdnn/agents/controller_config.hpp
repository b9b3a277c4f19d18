/// The settings of an agent in the units of its task.
#pragma once

#include <cstdint>
#include <tuple>

#include "sdnn/agents/actions.hpp"
#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/core/config_fields.hpp"

namespace sdnn::agents {

/// Everything that defines a controller.
struct ControllerConfig {
  AnyApproximatorConfig approximator = {};  ///< sizes that follow from the task are filled in
  AnyLearningConfig learning = {};
  std::uint64_t seed = 0;
  ObservationConfig observation = {};
  ActionConfig action = {};
  int warm_up_steps = 1000;

  /// The fields that are numbers.
  static constexpr auto fields() noexcept {
    return std::tuple(core::field("warm_up_steps", &ControllerConfig::warm_up_steps,
                                  "Random steps before learning, where ranges are not known.",
                                  core::within(2, 10'000'000)));
  }
};

}  // namespace sdnn::agents
