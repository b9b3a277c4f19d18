/// Groups of binary inputs that are kept or left out as a whole.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents::detail {

/// Whether an input is binary, and the rows in which it is on, which means the larger of its two
/// values: the rows before all steps, then those after them.
struct BinaryInput {
  bool is_binary = false;
  std::vector<bool> is_on = {};
};

/// Examines an input's values before and after each step; rows have `n_inputs` values. An input
/// that never changed counts as binary if it is 0 or 1.
inline BinaryInput binary_input(std::span<const double> states, std::span<const double> next_states,
                                std::size_t n_inputs, std::size_t input) {
  double low = states[input], high = low;
  for (const auto rows : {states, next_states}) {
    for (std::size_t k = input; k < rows.size(); k += n_inputs) {
      low = std::min(low, rows[k]);
      high = std::max(high, rows[k]);
    }
  }
  BinaryInput result{.is_binary = low < high || low == 0.0 || low == 1.0};
  for (const auto rows : {states, next_states}) {
    for (std::size_t k = input; k < rows.size(); k += n_inputs) {
      if (rows[k] != low && rows[k] != high) return {};
      result.is_on.push_back(rows[k] == high && (low < high || high == 1.0));
    }
  }
  return result;
}

/// Three binary inputs or more.
struct BinaryGroup {
  std::vector<std::size_t> inputs = {};  ///< in ascending order
  /// Which of `inputs` is on before and after each step: 1 for the first one, 0 if none is on. Both
  /// are empty in a group in which several inputs can be on.
  std::vector<std::uint16_t> symbols = {};
  std::vector<std::uint16_t> next_symbols = {};
};

/// Returns the groups of binary inputs.
///
/// Inputs of which at most one is on at a time form a group, like a one-hot vector: each input
/// joins the first group with whose inputs it is never on together. Groups of fewer than three are
/// dissolved; three or more of their inputs form a last group. Shapes: (n, n_inputs), n > 0.
inline std::vector<BinaryGroup> binary_groups(std::span<const double> states,
                                              std::span<const double> next_states,
                                              std::size_t n_inputs) {
  constexpr std::size_t kLeast = 3;
  const std::size_t n = states.size() / n_inputs;
  std::vector<BinaryGroup> groups;
  for (std::size_t i = 0; i < n_inputs; ++i) {
    const BinaryInput input = binary_input(states, next_states, n_inputs, i);
    if (!input.is_binary) continue;
    const auto symbol_of = [n](auto& group, std::size_t t) -> auto& {
      return t < n ? group.symbols[t] : group.next_symbols[t - n];
    };
    const auto never_meets = [&](const BinaryGroup& group) {
      for (std::size_t t = 0; t < input.is_on.size(); ++t) {
        if (input.is_on[t] && symbol_of(group, t) != 0) return false;
      }
      return true;
    };
    auto group = std::ranges::find_if(groups, never_meets);
    if (group == groups.end()) {
      const std::vector<std::uint16_t> none(n);
      group = groups.insert(group, {.symbols = none, .next_symbols = none});
    }
    group->inputs.push_back(i);
    for (std::size_t t = 0; t < input.is_on.size(); ++t) {
      const auto symbol = static_cast<std::uint16_t>(group->inputs.size());
      if (input.is_on[t]) symbol_of(*group, t) = symbol;
    }
  }
  BinaryGroup others;
  for (const BinaryGroup& group : groups) {
    if (group.inputs.size() >= kLeast) continue;
    others.inputs.insert(others.inputs.end(), group.inputs.begin(), group.inputs.end());
  }
  std::erase_if(groups, [](const BinaryGroup& group) { return group.inputs.size() < kLeast; });
  std::ranges::sort(others.inputs);
  if (others.inputs.size() >= kLeast) groups.push_back(std::move(others));
  return groups;
}

/// Measures how much actions improve the prediction of the next symbol from the present one: the
/// concentration of next symbols, given symbol and action, minus the concentration given the symbol
/// alone. A concentration is the sum, over all conditions, of the squared counts of next symbols
/// divided by the count of the condition. A condition that occurred 4 times adds 4^2 / 4 if one
/// symbol always followed, and (2^2 + 2^2) / 4 if two did. Action t + shift belongs to symbol t, so
/// that shifted series show the improvement by chance. Shapes: (n,).
inline double steering(const BinaryGroup& group, std::span<const std::uint8_t> actions,
                       std::size_t shift) {
  using Transition = std::tuple<std::uint16_t, std::uint8_t, std::uint16_t>;
  const auto concentration = [&](bool knows_actions) {
    std::vector<Transition> transitions;
    for (std::size_t t = 0; t < actions.size(); ++t) {
      const std::uint8_t action = actions[(t + shift) % actions.size()];
      transitions.emplace_back(group.symbols[t], knows_actions ? action : std::uint8_t{0},
                               group.next_symbols[t]);
    }
    std::ranges::sort(transitions);
    // Now transitions of a symbol and an action are neighbours, as are equal ones among these.
    double sum = 0.0, squares = 0.0, n_condition = 0.0, n_same = 0.0;
    for (std::size_t t = 0; t < transitions.size(); ++t) {
      const auto& [symbol, action, next] = transitions[t];
      const bool is_last = t + 1 == transitions.size();
      n_condition += 1.0;
      n_same += 1.0;
      if (!is_last && transitions[t + 1] == transitions[t]) continue;
      squares += n_same * n_same;
      n_same = 0.0;
      if (!is_last && std::get<0>(transitions[t + 1]) == symbol &&
          std::get<1>(transitions[t + 1]) == action) {
        continue;
      }
      sum += squares / n_condition;
      squares = n_condition = 0.0;
    }
    return sum;
  };
  return concentration(true) - concentration(false);
}

}  // namespace sdnn::agents::detail
