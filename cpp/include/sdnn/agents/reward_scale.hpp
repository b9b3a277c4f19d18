/// How large recent rewards are, and which of them are far too large to be learned.
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

/// Follows the size of rewards in powers of two, and refuses a reward that is far beyond it, as the
/// glitch of a sensor is: it would make the units of an agent in integers so large that all other
/// rewards vanish.
///
/// The size is the floor of the logarithm, to base 2, of the largest recent reward: at the end of a
/// window of 1,024 rewards, some of them not 0, a size that none of these reached falls to at most
/// 16 above the largest of them, and then a quarter of the rest. A reward is refused if its own
/// size is above the recent one by more than the headroom. That begins with 16, and each refusal
/// adds 4, so that rewards whose scale is truly so large are learned after some; 64 windows take 1
/// away.
class RewardScale {
 public:
  RewardScale() = default;
  /// Begins with what is known of the rewards: three quarters of those that are not 0 have this
  /// size, or a smaller one.
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

  /// Ends the window if it is over. Returns the size of the rewards in it; none if it is not over,
  /// or all of them are 0.
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
  /// The first reward that was refused, and its number, from 1. It is for a warning, and not saved.
  std::optional<std::pair<double, std::uint64_t>> refused() const noexcept { return refused_; }

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
