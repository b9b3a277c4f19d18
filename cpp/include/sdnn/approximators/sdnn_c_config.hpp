/// Everything that defines an SDNN-C.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/grid_cells.hpp"

namespace sdnn::approximators {

/// How the weights start (method.md, section 1.7).
enum class InitialWeights {
  ternary,  ///< -1, 0 or +1 lattice steps with probabilities 1/4, 1/2, 1/4
  uniform,  ///< uniform within +- initial_weight_limit, rounded to the lattice
};

/// To which whole number of firing units a wanted value is rounded (reading: the paper is silent).
enum class Rounding {
  half_up,  ///< the nearest; halves up. A change of less than half a unit is lost
  random,   ///< up or down at random, in proportion: right on average, nothing is lost
  away,     ///< the next one in the direction of the change: always at least one unit
};

/// Everything that defines an SDNN-C; the defaults are the paper's values.
struct SDNNCConfig {
  int n_inputs = 4;                 ///< l >= 2
  int max_pairs = 0;                ///< of inputs, an even share at random; 0: all l (l - 1)
  int n_pattern_units = 200;        ///< m
  int n_anchor_patterns = 9;        ///< p_1 .. p_9
  int n_interpolated = 44;          ///< patterns between neighbouring anchors
  bool balanced_anchors = true;     ///< reading: anchors have as many +1 as -1
  std::vector<bool> circular = {};  ///< per input; empty: none (reading: p_9 independent of p_1)
  std::vector<int> n_symbols = {};  ///< per input; 0: a number; empty: numbers only
  int n_hidden_units = 900;         ///< n
  int n_active_units = 300;         ///< n', units in an action's window
  int n_actions = 0;                ///< 0: all n - n' + 1 windows
  double q_low = -20.0;             ///< g saturates at these values ...
  double q_high = 20.0;
  std::optional<int> u_low = {};      ///< ... at these counts; none: n' / 15 rounded down (20),
  std::optional<int> u_high = {};     ///< and n' - u_low (280)
  double learning_coefficient = 0.1;  ///< c; scales weights only, never decisions
  int lattice = 1;                    ///< weights are multiples of c / lattice
  double initial_threshold = 200.0;   ///< |w_i0| at the start, in units of c
  InitialWeights initial_weights = InitialWeights::ternary;
  double initial_weight_limit = 0.1;      ///< of InitialWeights::uniform, in units of c
  Rounding rounding = Rounding::half_up;  ///< of the number of units that are to fire
  int averaging_interval = 0;  ///< least corrections between snapshots of WeightAverage; 0: none
  std::uint64_t max_table_bytes = core::kDefaultMaxTableBytes;  ///< larger networks are refused

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("n_inputs", &SDNNCConfig::n_inputs),
        core::field("max_pairs", &SDNNCConfig::max_pairs),
        core::field("n_pattern_units", &SDNNCConfig::n_pattern_units),
        core::field("n_anchor_patterns", &SDNNCConfig::n_anchor_patterns),
        core::field("n_interpolated", &SDNNCConfig::n_interpolated),
        core::field("balanced_anchors", &SDNNCConfig::balanced_anchors),
        core::field("circular", &SDNNCConfig::circular),
        core::field("n_symbols", &SDNNCConfig::n_symbols),
        core::field("n_hidden_units", &SDNNCConfig::n_hidden_units),
        core::field("n_active_units", &SDNNCConfig::n_active_units),
        core::field("n_actions", &SDNNCConfig::n_actions),
        core::field("q_low", &SDNNCConfig::q_low), core::field("q_high", &SDNNCConfig::q_high),
        core::field("u_low", &SDNNCConfig::u_low), core::field("u_high", &SDNNCConfig::u_high),
        core::field("learning_coefficient", &SDNNCConfig::learning_coefficient),
        core::field("lattice", &SDNNCConfig::lattice),
        core::field("initial_threshold", &SDNNCConfig::initial_threshold),
        core::field("initial_weights", &SDNNCConfig::initial_weights),
        core::field("initial_weight_limit", &SDNNCConfig::initial_weight_limit),
        core::field("rounding", &SDNNCConfig::rounding),
        core::field("averaging_interval", &SDNNCConfig::averaging_interval),
        core::field("max_table_bytes", &SDNNCConfig::max_table_bytes));
  }
  bool operator==(const SDNNCConfig&) const = default;

  /// How many inputs modify each one: an even share of max_pairs, at least one.
  int n_partners() const noexcept {
    if (n_inputs < 2) return 0;
    return max_pairs > 0 ? std::clamp(max_pairs / n_inputs, 1, n_inputs - 1) : n_inputs - 1;
  }
  /// Bins of all inputs by anchors and symbols, and the bytes of the patterns of so many bins,
  /// plain and permuted for each partner. Of any fields, impossible ones too: hence doubles.
  double n_bins() const noexcept {
    double n_of_symbols = 0.0;
    double n_numbers = n_inputs;
    for (const int n : n_symbols) {
      if (n <= 0) continue;
      n_of_symbols += n;
      n_numbers -= 1.0;
    }
    return n_of_symbols + n_numbers * (n_anchor_patterns - 1.0) * (n_interpolated + 1.0);
  }
  double pattern_bytes(double n_bins) const noexcept {
    return (n_partners() + 1.0) * n_bins * 8.0 * std::ceil(n_pattern_units / 64.0);
  }
};

}  // namespace sdnn::approximators
