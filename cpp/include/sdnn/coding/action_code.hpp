/// The action code of layer 4: each action is a window of hidden units.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdnn/core/detail/check.hpp"

namespace sdnn::coding {

/// Windows of `n_active_units` neighbouring hidden units, evenly spread over `n_hidden_units`.
///
/// With the default number of actions, n_hidden_units - n_active_units + 1, window a starts at unit
/// a: every possible window is used once. With fewer actions the starts are spread evenly, floor(a
/// * (n_hidden_units - n_active_units) / (n_actions - 1)), so that the windows of a few discrete
/// actions overlap little.
///
/// Source: section 3.1 (layer 4, y); method.md, section 1.4. Units are counted from 0.
class ActionCode {
 public:
  /// Makes a window for each of `n_actions` actions; with 0, every possible window is an action.
  ///
  /// Throws std::invalid_argument naming the impossible size.
  ActionCode(int n_hidden_units, int n_active_units, int n_actions = 0) {
    core::require_in_range("n_hidden_units", n_hidden_units, 1, 1 << 20);
    core::require_in_range("n_active_units", n_active_units, 1, n_hidden_units);
    const int n_windows = n_hidden_units - n_active_units + 1;
    if (n_actions != 0) core::require_in_range("n_actions", n_actions, 1, n_windows);
    n_hidden_units_ = static_cast<std::size_t>(n_hidden_units);
    n_active_units_ = static_cast<std::size_t>(n_active_units);
    first_units_.resize(static_cast<std::size_t>(n_actions == 0 ? n_windows : n_actions), 0);
    for (std::size_t action = 1; action < first_units_.size(); ++action) {
      first_units_[action] = static_cast<std::uint32_t>(
          action * (n_hidden_units_ - n_active_units_) / (first_units_.size() - 1));
    }
  }

  std::size_t n_hidden_units() const noexcept { return n_hidden_units_; }
  std::size_t n_active_units() const noexcept { return n_active_units_; }
  std::size_t n_actions() const noexcept { return first_units_.size(); }

  /// The first unit of the window of `action`; the window has `n_active_units()` units.
  std::size_t first_unit(std::size_t action) const noexcept {
    assert(action < first_units_.size());
    return first_units_[action];
  }

 private:
  std::size_t n_hidden_units_;
  std::size_t n_active_units_;
  std::vector<std::uint32_t> first_units_;
};

/// The physical value of `action` if `n_actions` values are evenly spaced from low to high.
///
/// Source: section 4.1, the 601 torques -10, -10 + 1/30, ..., 10 N m.
inline double action_value(std::size_t action, std::size_t n_actions, double low,
                           double high) noexcept {
  assert(action < n_actions);
  if (n_actions == 1) return low;
  return low + (high - low) * static_cast<double>(action) / static_cast<double>(n_actions - 1);
}

}  // namespace sdnn::coding
