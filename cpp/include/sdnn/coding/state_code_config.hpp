/// The settings of a state's code, shared by several configurations.
#pragma once

#include <algorithm>
#include <cmath>
#include <tuple>

#include "sdnn/core/config_fields.hpp"

namespace sdnn::coding {

/// Lists the fields that define the code, for any configuration with members of these names;
/// `units` documents n_pattern_units, and `least_units` is its lower bound.
template <class Config>
constexpr auto state_code_fields(const char* units = "m, units per pattern (section 4.2: 200).",
                                 int least_units = 2) noexcept {
  return std::tuple(
      core::field("n_inputs", &Config::n_inputs, "l, number of inputs (section 3.1).",
                  core::within(2, 1024)),
      core::field("max_pairs", &Config::max_pairs,
                  "Most pairs of inputs that are formed; 0: all l (l - 1), as in the paper, but "
                  "1,024 of more than 32 relevant inputs of an agent with a linear readout. Pairs "
                  "are drawn at random so that each input is modified by as many others as it "
                  "modifies, and by one at least.",
                  core::within(0, 1 << 20)),
      core::field("n_pattern_units", &Config::n_pattern_units, units,
                  core::within(least_units, 1 << 16)),
      core::field("n_anchor_patterns", &Config::n_anchor_patterns,
                  "Random anchor patterns p_1, p_2, ... of a code book (section 3.1: 9). The "
                  "last one is not assigned to a bin.",
                  core::within(2, 10000)),
      core::field("n_interpolated", &Config::n_interpolated,
                  "Patterns between neighbouring anchors (section 3.1: 44). There are "
                  "(n_anchor_patterns - 1) (n_interpolated + 1) bins, 360 in the paper.",
                  core::within(0, 10000)),
      core::field(
          "balanced_anchors", &Config::balanced_anchors,
          "Whether anchors have as many +1 as -1. An assumption: the paper says \"random\"."),
      core::field("circular", &Config::circular,
                  "Per input, whether the last anchor equals the first, as angles want it; "
                  "empty: none. An assumption: the paper does not say."),
      core::field("n_symbols", &Config::n_symbols,
                  "Per input, how many symbols it may be, each with a random pattern of its "
                  "own: symbol k of n is a value of (k + 0.5) / n. 0 for a number; empty: "
                  "numbers only. Not in the paper.",
                  core::within(0, 1 << 24)));
}

/// Returns the number of inputs that modify each input: an even share of max_pairs but at least 1,
/// or with max_pairs = 0 all other inputs.
template <class Config>
int n_partners_of(const Config& config) noexcept {
  if (config.n_inputs < 2) return 0;
  return config.max_pairs > 0
             ? std::clamp(config.max_pairs / config.n_inputs, 1, config.n_inputs - 1)
             : config.n_inputs - 1;
}

/// Returns the number of bins of all inputs together: a bin for each symbol, and for each input
/// that is a number those that the anchors make. The result is a double, because the fields may not
/// be checked yet and their product may not fit into an integer.
template <class Config>
double n_bins_of(const Config& config) noexcept {
  double n_of_symbols = 0.0;
  double n_numbers = config.n_inputs;
  for (const int n : config.n_symbols) {
    if (n <= 0) continue;
    n_of_symbols += n;
    n_numbers -= 1.0;
  }
  return n_of_symbols +
         n_numbers * (config.n_anchor_patterns - 1.0) * (config.n_interpolated + 1.0);
}

/// Returns the bytes of the patterns of `n_bins` bins: the original patterns, and a permuted copy
/// for each input that modifies them.
template <class Config>
double pattern_bytes_of(const Config& config, double n_bins) noexcept {
  return (n_partners_of(config) + 1.0) * n_bins * 8.0 * std::ceil(config.n_pattern_units / 64.0);
}

}  // namespace sdnn::coding
