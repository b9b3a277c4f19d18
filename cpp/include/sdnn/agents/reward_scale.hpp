/// The size of recent rewards, and the refusal of rewards that are far too large.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// Follows the size of rewards in powers of two, and refuses rewards that are far larger, such as a
/// sensor's glitch: they would make the units of an integer agent so large that all other rewards
/// would be rounded to 0.
///
/// The size of a reward is the floor of its logarithm to base 2; the recent size is that of the
/// largest recent reward. It falls after each window of 1,024 rewards that are not all 0: to at
/// most 16 above the largest size in the window, then by a quarter of the difference to it. A
/// reward is refused if its size exceeds the recent one by more than the headroom. The headroom
/// begins with 16. Each refusal adds 4, so that truly larger rewards are learned after some
/// refusals, and every 64 windows subtract 1. These numbers are chosen constants.
class RewardScale {
 public:
  RewardScale() = default;
  /// Starts with the upper quartile of the sizes of known rewards, without those that are 0.
  explicit RewardScale(std::span<const double> rewards) {
    std::vector<std::int32_t> sizes;
    for (const double reward : rewards) {
      if (reward != 0.0) sizes.push_back(std::ilogb(reward));
    }
    if (sizes.empty()) return;
    std::ranges::sort(sizes);
    size_ = sizes[(sizes.size() - 1) * 3 / 4];
  }

  /// Notes a reward. Returns whether it is to be learned. Requires a finite number.
  bool accepts(double reward) noexcept {
    ++n_rewards_;
    if (reward == 0.0) return true;
    const std::int32_t size = std::ilogb(reward);
    if (size_ && size > *size_ + headroom_) {
      headroom_ = std::min(headroom_ + kRise, kMostHeadroom);
      if (!refused_) refused_.emplace(reward, n_rewards_);
      return false;
    }
    size_ = std::max(size_.value_or(size), size);
    size_in_window_ = std::max(size_in_window_.value_or(size), size);
    return true;
  }

  /// Ends the window if it has 1,024 rewards, and returns the size of its rewards. Returns nothing
  /// if it has fewer, or all of them are 0.
  std::optional<std::int32_t> end_window() noexcept {
    if (n_rewards_ % kWindow != 0) return std::nullopt;
    if (n_rewards_ % (kWindow * kWindowsOfRise) == 0 && headroom_ > kLeastHeadroom) --headroom_;
    const auto size = std::exchange(size_in_window_, std::nullopt);
    if (size) {
      size_ = std::min(*size_, *size + kLeastHeadroom);
      *size_ -= (*size_ - *size + 3) / 4;
    }
    return size;
  }

  /// The largest recent reward is 2^size to 2^(size + 1); none before a reward that is not 0.
  std::optional<std::int32_t> size() const noexcept { return size_; }
  std::uint64_t n_rewards() const noexcept { return n_rewards_; }
  /// The first reward that was refused, and its number, from 1. It is for a warning, and not saved.
  std::optional<std::pair<double, std::uint64_t>> refused() const noexcept { return refused_; }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("size", self.size_);
    archive.number("size_in_window", self.size_in_window_);
    archive.number("n_rewards", self.n_rewards_);
    archive.number("headroom", self.headroom_);
    if constexpr (Archive::kReads) {
      const auto is_size = [](auto size) { return !size || std::abs(*size) <= kMostSize; };
      archive.expect(is_size(self.size_), "size", "in [-1100, 1100]");
      archive.expect(is_size(self.size_in_window_) && self.size_in_window_.value_or(-kMostSize) <=
                                                          self.size_.value_or(-kMostSize),
                     "size_in_window", "at most size");
      archive.expect(self.headroom_ >= kLeastHeadroom && self.headroom_ <= kMostHeadroom,
                     "headroom", "in [16, 2500]");
    }
  }

 private:
  static constexpr std::int32_t kLeastHeadroom = 16, kMostHeadroom = 2500, kRise = 4;
  static constexpr std::uint64_t kWindow = 1024, kWindowsOfRise = 64;
  static constexpr std::int32_t kMostSize = 1100;  // beyond those of all finite numbers

  std::optional<std::int32_t> size_, size_in_window_;
  std::uint64_t n_rewards_ = 0;
  std::int32_t headroom_ = kLeastHeadroom;
  std::optional<std::pair<double, std::uint64_t>> refused_;
};

}  // namespace sdnn::agents
