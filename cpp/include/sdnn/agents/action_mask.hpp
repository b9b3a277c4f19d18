/// Which actions are allowed in a state.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// A mask of actions: 1 for each allowed action and 0 for others, dimension by dimension. An empty
/// mask allows all actions.
using ActionMask = std::span<const std::uint8_t>;

/// Removes the next dimension's n entries from the mask of the remaining dimensions; returns them.
inline ActionMask take_part(ActionMask& left, std::size_t n) noexcept {
  if (left.empty()) return {};
  const ActionMask mask = left.first(n);
  left = left.subspan(n);
  return mask;
}

inline bool allows(ActionMask mask, std::size_t action) noexcept {
  return mask.empty() || mask[action] != 0;
}

/// Whether a dimension's mask has only zeros and ones, and allows an action.
inline bool is_mask(ActionMask mask) noexcept {
  return std::ranges::all_of(mask, [](auto entry) { return entry <= 1; }) &&
         std::ranges::find(mask, 1) != mask.end();
}

/// Returns an allowed one of n actions; draw(k) returns a number below k, the number of allowed
/// ones.
template <class Draw>
std::size_t draw_allowed(ActionMask mask, std::size_t n, const Draw& draw) {
  if (mask.empty()) return draw(n);
  std::size_t left = draw(
      static_cast<std::size_t>(std::ranges::count_if(mask, [](auto entry) { return entry != 0; })));
  std::size_t action = 0;
  while (mask[action] == 0 || left-- > 0) ++action;
  return action;
}

/// Makes the values of actions that are not allowed lower than all others.
inline void exclude(ActionMask mask, std::span<double> values) noexcept {
  for (std::size_t a = 0; a < mask.size(); ++a) {
    if (mask[a] == 0) values[a] = -std::numeric_limits<double>::infinity();
  }
}

/// Throws std::invalid_argument unless a mask is empty, or has a 0 or 1 for each action and at
/// least a 1 in each dimension. Dimension d has `n_actions(d)` actions.
template <class NActions>
void require_mask(std::string_view name, ActionMask mask, std::size_t n_dimensions,
                  const NActions& n_actions) {
  if (mask.empty()) return;
  std::size_t n = 0;
  for (std::size_t d = 0; d < n_dimensions; ++d) n += n_actions(d);
  core::require_size(name, mask.size(), n, "numbers, one per action");
  for (std::size_t d = 0; d < n_dimensions; ++d) {
    core::require(is_mask(take_part(mask, n_actions(d))), name,
                  "of 0 and 1, and 1 for an action of each dimension at least", "others");
  }
}

/// Throws std::invalid_argument unless an action has an index for each dimension, below
/// `n_actions(d)` in dimension d.
template <class NActions>
void require_action(std::span<const std::size_t> action, std::size_t n_dimensions,
                    const NActions& n_actions) {
  core::require_size("action", action.size(), n_dimensions, "numbers");
  for (std::size_t d = 0; d < action.size(); ++d) {
    core::require_below("action", action[d], n_actions(d));
  }
}

/// Lists a mask that an agent remembers, where there is one; see core/state.hpp.
template <class Mask, class Archive, class NActions>
void serialize_mask(std::string_view name, Mask& mask, Archive& archive, std::size_t n_dimensions,
                    const NActions& n_actions) {
  archive.some_numbers(name, mask);
  if constexpr (Archive::kReads) {
    archive.taking(name, [&] { require_mask("mask", mask, n_dimensions, n_actions); });
  }
}

}  // namespace sdnn::agents
