/// Which actions are allowed in a state.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// A mask of actions, dimension by dimension: 1 if allowed, else 0. An empty mask allows all.
using ActionMask = std::span<const std::uint8_t>;

/// Removes the first n entries from the mask of the remaining dimensions, `left`, and returns them:
/// the mask of the next dimension, which has n actions. An empty mask stays empty.
inline ActionMask take_part(ActionMask& left, std::size_t n) noexcept {
  if (left.empty()) return {};
  const ActionMask mask = left.first(n);
  left = left.subspan(n);
  return mask;
}

/// Whether a dimension's mask allows one of its actions.
inline bool allows(ActionMask mask, std::size_t action) noexcept {
  return mask.empty() || mask[action] != 0;
}
/// Whether the mask allows the action: an index in each dimension d, below `n_actions(d)`.
template <class Action, class NActions>
bool allows_action(ActionMask mask, const Action& action, const NActions& n_actions) {
  for (std::size_t d = 0; d < action.size() && !mask.empty(); ++d) {
    const auto index = static_cast<std::size_t>(action[d]);
    if (!allows(take_part(mask, n_actions(d)), index)) return false;
  }
  return true;
}

/// Whether a dimension's mask has only zeros and ones, and allows an action.
inline bool is_mask(ActionMask mask) noexcept {
  return std::ranges::all_of(mask, [](auto entry) { return entry <= 1; }) &&
         std::ranges::find(mask, 1) != mask.end();
}

/// Returns allowed action number draw(k) of a dimension with n actions. `draw` receives the number
/// k of allowed actions and returns a number below it.
template <class Draw>
std::size_t draw_allowed(ActionMask mask, std::size_t n, const Draw& draw) {
  if (mask.empty()) return draw(n);
  std::size_t n_before = draw(
      static_cast<std::size_t>(std::ranges::count_if(mask, [](auto entry) { return entry != 0; })));
  std::size_t action = 0;
  while (mask[action] == 0 || n_before-- > 0) ++action;
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

/// Throws std::invalid_argument unless there is an index below `n_actions(d)` per dimension d.
template <class NActions>
void require_action(std::span<const std::size_t> action, std::size_t n_dimensions,
                    const NActions& n_actions) {
  core::require_size("action", action.size(), n_dimensions, "numbers");
  for (std::size_t d = 0; d < action.size(); ++d) {
    core::require_below("action", action[d], n_actions(d));
  }
}

/// Lists an action: an index below `n_actions(d)` for each dimension d; see core/state.hpp.
template <class Action, class Archive, class NActions>
void serialize_action(std::string_view name, Action& action, Archive& archive,
                      const NActions& n_actions) {
  std::vector<std::int64_t> indices(action.begin(), action.end());
  archive.numbers(name, indices);
  if constexpr (Archive::kReads) {
    archive.expect(indices.size() == action.size(), name, "one per dimension");
    for (std::size_t d = 0; d < action.size(); ++d) {
      archive.expect(indices[d] >= 0 && static_cast<std::uint64_t>(indices[d]) < n_actions(d), name,
                     "an action");
      action[d] = static_cast<std::size_t>(indices[d]);
    }
  }
}

/// Lists a mask that an agent remembers, if it is not empty; see core/state.hpp.
template <class Mask, class Archive, class NActions>
void serialize_mask(std::string_view name, Mask& mask, Archive& archive, std::size_t n_dimensions,
                    const NActions& n_actions) {
  archive.some_numbers(name, mask);
  if constexpr (Archive::kReads) {
    archive.naming(name, [&] { require_mask("mask", mask, n_dimensions, n_actions); });
  }
}

}  // namespace sdnn::agents
