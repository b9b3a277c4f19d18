/// The configuration of an SDNN-C.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <tuple>
#include <vector>

#include "sdnn/coding/state_code_config.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/grid_cells.hpp"

namespace sdnn::approximators {

/// Initial weights (method.md, section 1, "Start").
enum class InitialWeights {
  ternary,  ///< -1, 0 or +1 lattice steps with probabilities 1/4, 1/2, 1/4
  uniform,  ///< uniform within +- initial_weight_limit, rounded to the lattice
};
constexpr std::array<std::string_view, 2> words_of(InitialWeights) noexcept {
  return {"ternary", "uniform"};
}

/// Rounding of a wanted value to a whole number of firing units (an assumption).
enum class Rounding {
  half_up,  ///< to the nearest, halves up; changes of less than half a unit are lost
  random,   ///< up or down at random, unbiased
  away,     ///< to the next in the direction of the change, at least one unit
};
constexpr std::array<std::string_view, 3> words_of(Rounding) noexcept {
  return {"half_up", "random", "away"};
}

/// The configuration of an SDNN-C; the defaults are the paper's values.
struct SDNNCConfig {
  int n_inputs = 4;
  int max_pairs = 0;
  int n_pattern_units = 200;
  int n_anchor_patterns = 9;
  int n_interpolated = 44;
  bool balanced_anchors = true;
  std::vector<bool> circular = {};
  std::vector<int> n_symbols = {};
  int n_hidden_units = 900;
  int n_active_units = 300;
  int n_actions = 0;
  double q_low = -20.0;
  double q_high = 20.0;
  std::optional<int> u_low = {};
  std::optional<int> u_high = {};
  double learning_coefficient = 0.1;
  int lattice = 1;
  double initial_threshold = 200.0;
  InitialWeights initial_weights = InitialWeights::ternary;
  double initial_weight_limit = 0.1;
  Rounding rounding = Rounding::half_up;
  int weight_limit = 0;
  int averaging_interval = 0;
  std::uint64_t max_table_bytes = core::kDefaultMaxTableBytes;

  static constexpr auto fields() noexcept {
    return std::tuple_cat(
        coding::state_code_fields<SDNNCConfig>(),
        std::tuple(
            core::field("n_hidden_units", &SDNNCConfig::n_hidden_units,
                        "n, hidden units (section 4.2: 900).", core::within(1, 1 << 20)),
            core::field(
                "n_active_units", &SDNNCConfig::n_active_units,
                "n', units in an action's window (section 4.2: 300), at most n_hidden_units.",
                core::within(1, 1 << 20)),
            core::field("n_actions", &SDNNCConfig::n_actions,
                        "Number of actions; 0 stands for all n_hidden_units - n_active_units + 1 "
                        "(601).",
                        core::within(0, 1 << 20)),
            core::field("q_low", &SDNNCConfig::q_low,
                        "Lowest value of the output range (section 4.2: -20).",
                        core::within(-1e301, 1e301)),
            core::field("q_high", &SDNNCConfig::q_high,
                        "Highest value of the output range (section 4.2: 20).",
                        core::within(-1e301, 1e301)),
            core::field("u_low", &SDNNCConfig::u_low,
                        "Count of active units at which the output is q_low; by default "
                        "n_active_units // 15 (section 4.2: 20).",
                        core::within(0, 1 << 20)),
            core::field("u_high", &SDNNCConfig::u_high,
                        "Count of active units at which the output is q_high; by default "
                        "n_active_units - u_low (section 4.2: 280).",
                        core::within(0, 1 << 20)),
            core::field(
                "learning_coefficient", &SDNNCConfig::learning_coefficient,
                "c (section 4.2: 0.1). It scales weights and thresholds alike and changes no "
                "decision.",
                core::above(0)),
            core::field("lattice", &SDNNCConfig::lattice,
                        "Weights are integer multiples of learning_coefficient / lattice.",
                        core::within(1, 64)),
            core::field(
                "initial_threshold", &SDNNCConfig::initial_threshold,
                "The \"large\" initial threshold, in units of c: a multiple of 1 / lattice. An "
                "assumption.",
                core::at_least(0)),
            core::field("initial_weights", &SDNNCConfig::initial_weights,
                        "The \"small random\" initial weights: `ternary`: one lattice step down, "
                        "none, or up with probabilities 1/4, 1/2, 1/4; `uniform`: within "
                        "initial_weight_limit, rounded to the lattice. An assumption."),
            core::field("initial_weight_limit", &SDNNCConfig::initial_weight_limit,
                        "Of `uniform` initial weights, in units of c.", core::at_least(0)),
            core::field("rounding", &SDNNCConfig::rounding,
                        "Of the number of units that are to fire. `half_up`: to the nearest; "
                        "`random`: up or down at random in proportion, so that no small change is "
                        "lost on average; `away`: in the direction of the change by at least one "
                        "unit. An assumption."),
            core::field(
                "weight_limit", &SDNNCConfig::weight_limit,
                "Largest size, in steps of the lattice, of a stored number of a hidden unit, which "
                "is the sum or the difference of the weights of two units of the code that one "
                "unit modifies. A unit is not corrected where a number would exceed the limit. An "
                "agent that learns in C needs 127 or less. 0: 16383, beyond which is an error.",
                core::within(0, 16383)),
            core::field(
                "averaging_interval", &SDNNCConfig::averaging_interval,
                "Above 0, the network keeps an average of its weights for greedy actions. A "
                "snapshot enters it after this number of corrections, or after a 64th of all "
                "corrections so far if that is more. The latest count most; weights take three "
                "times the memory. 0, as in the paper: no average.",
                core::within(0, 1000000000)),
            core::field("max_table_bytes", &SDNNCConfig::max_table_bytes,
                        "A larger network (weights, patterns, remembered potentials) is refused "
                        "before memory is allocated; 1 GiB by default. For all action dimensions "
                        "together, where an agent has several.")));
  }
  bool operator==(const SDNNCConfig&) const = default;
};

}  // namespace sdnn::approximators
