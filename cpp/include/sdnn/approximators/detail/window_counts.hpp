/// The number of firing units in the window of every action.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::approximators {

namespace detail {

/// Implements count_windows, below. It counts the firing units before each unit; a window's count
/// is the difference of two such numbers. Units are counted in groups of eight, as bytes of 0
/// and 1. The product of such a group, read as a little-endian number, and 0x0101010101010101 has
/// in byte k the sum of bytes 0 to k: (1, 0, 1, ...) becomes (1, 1, 2, ...). The pointers are
/// __restrict, because compilers vectorize the loops only without aliasing.
SDNN_INLINE std::int32_t count_windows_body(std::span<const std::int32_t> potentials,
                                            std::size_t size, std::uint8_t* __restrict firing,
                                            std::int32_t* __restrict before_groups,
                                            std::int32_t* __restrict before,
                                            std::int32_t* __restrict counts) noexcept {
  const std::size_t n = potentials.size();
  for (std::size_t i = 0; i < n; ++i) firing[i] = potentials[i] > 0 ? 1 : 0;
  std::int32_t n_firing = 0;
  for (std::size_t group = 0; group < n / 8; ++group) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, firing + 8 * group, sizeof bytes);
    bytes *= 0x0101010101010101U;
    std::memcpy(firing + 8 * group, &bytes, sizeof bytes);
    before_groups[group] = n_firing;
    n_firing += static_cast<std::int32_t>(bytes >> 56);
  }
  before[0] = 0;
  for (std::size_t group = 0; group < n / 8; ++group) {
    for (std::size_t k = 0; k < 8; ++k) {
      before[8 * group + k + 1] = before_groups[group] + firing[8 * group + k];
    }
  }
  for (std::size_t i = n - n % 8; i < n; ++i) before[i + 1] = n_firing += firing[i];
  std::int32_t largest = 0;
  for (std::size_t first = 0; first + size <= n; ++first) {
    counts[first] = before[first + size] - before[first];
    largest = std::max(largest, counts[first]);
  }
  return largest;
}

}  // namespace detail

/// Counts the units that fire, those with a potential above 0, in every window of `size` adjacent
/// units; returns the largest count. Shapes: potentials (n,), counts (n - size + 1,); scratch:
/// firing (n,), before_groups (n / 8,), before (n + 1,).
SDNN_KERNEL(std::int32_t, count_windows,
            (std::span<const std::int32_t> potentials, std::size_t size, std::uint8_t* firing,
             std::int32_t* before_groups, std::int32_t* before, std::int32_t* counts),
            (potentials, size, firing, before_groups, before, counts))

/// The number of firing units in the window of each action, and buffers to count them.
class WindowCounts {
 public:
  explicit WindowCounts(const coding::ActionCode& actions)
      : firing_(actions.n_hidden_units()),
        before_groups_(actions.n_hidden_units() / 8),
        before_(actions.n_hidden_units() + 1),
        of_windows_(actions.n_hidden_units() - actions.n_active_units() + 1),
        of_actions_(actions.n_actions() < of_windows_.size() ? actions.n_actions() : 0) {}

  /// Counts units whose potential is above 0. Shape: (n_hidden_units,).
  void count(std::span<const std::int32_t> potentials, const coding::ActionCode& actions) {
    assert(potentials.size() == firing_.size());
    largest_ = count_windows(potentials, actions.n_active_units(), firing_.data(),
                             before_groups_.data(), before_.data(), of_windows_.data());
    if (of_actions_.empty()) return;
    for (std::size_t action = 0; action < of_actions_.size(); ++action) {
      of_actions_[action] = of_windows_[actions.first_unit(action)];
    }
    largest_ = *std::ranges::max_element(of_actions_);
  }

  /// Makes the counts of actions whose entry in the mask is 0 lower than all others, unless the
  /// mask is empty. Shape: (n_actions,).
  void exclude(std::span<const std::uint8_t> mask) noexcept {
    if (mask.empty()) return;
    // Without separate counts of actions, every window is that of an action.
    std::vector<std::int32_t>& counts = of_actions_.empty() ? of_windows_ : of_actions_;
    for (std::size_t action = 0; action < mask.size(); ++action) {
      if (mask[action] == 0) counts[action] = -1;
    }
    largest_ = *std::ranges::max_element(counts);
  }

  /// The counts of the last call. Shape: (n_actions,).
  std::span<const std::int32_t> of_actions() const noexcept {
    return of_actions_.empty() ? of_windows_ : of_actions_;
  }
  std::int32_t largest() const noexcept { return largest_; }

 private:
  std::vector<std::uint8_t> firing_;
  std::vector<std::int32_t> before_groups_;
  std::vector<std::int32_t> before_;
  std::vector<std::int32_t> of_windows_;
  std::vector<std::int32_t> of_actions_;  ///< empty if every window has an action
  std::int32_t largest_ = 0;
};

}  // namespace sdnn::approximators
