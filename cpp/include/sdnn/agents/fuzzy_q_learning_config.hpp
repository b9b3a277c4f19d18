/// The settings of fuzzy Q-learning.
#pragma once

#include <tuple>

#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/core/config_fields.hpp"

namespace sdnn::agents {

/// The agent's parameters; the defaults are the paper's (method.md, sections 3 and 5).
struct FuzzyQLearningConfig {
  double learning_coefficient = 0.5;
  double discount = 0.9;
  double trace_decay = 0.0;
  EpsilonGreedyConfig policy = {};  ///< of every fired rule for itself

  static constexpr auto fields() noexcept {
    return std::tuple_cat(
        std::tuple(
            core::field(
                "learning_coefficient", &FuzzyQLearningConfig::learning_coefficient,
                "c_fql. An assumption: the paper does not give it; 0.1 and 1.0 are alternatives.",
                core::above_up_to(0, 1)),
            core::field("discount", &FuzzyQLearningConfig::discount, "gamma.", core::within(0, 1)),
            core::field(
                "trace_decay", &FuzzyQLearningConfig::trace_decay,
                "lambda of accumulating eligibility traces; 0: none, as in the paper. At most "
                "0.99 / discount.",
                core::within(0, 1))),
        core::nested_fields(&FuzzyQLearningConfig::policy));
  }
  bool operator==(const FuzzyQLearningConfig&) const = default;
};

}  // namespace sdnn::agents
