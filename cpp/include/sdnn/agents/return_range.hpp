/// How large values can be: from the rewards that have come.
#pragma once

#include <algorithm>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// A range that holds the discounted sums of rewards seen so far.
///
/// The sum over the rewards that came, the latest first, z = r + gamma z, is distributed as the
/// returns that values estimate, and is known at once. The range begins with 0 and the first sum
/// that is not 0, and grows by a quarter more than it must, so that it grows rarely.
class ReturnRange {
 public:
  explicit ReturnRange(double discount) noexcept : discount_(discount) {}

  /// Whether there was a sum other than 0: until then the range is empty.
  bool is_known() const noexcept { return low_ < high_; }
  double low() const noexcept { return low_; }
  double high() const noexcept { return high_; }

  /// Adds a finite reward to the sum of its episode, which begins with 0; returns whether the range
  /// has grown.
  bool note(double reward, double& sum) noexcept {
    sum = std::clamp(reward + discount_ * sum, -kLargest, kLargest);
    if (sum >= low_ && sum <= high_) return false;
    if (sum > high_) {
      high_ = sum + kHeadroom * (sum - low_);
    } else {
      low_ = sum - kHeadroom * (high_ - sum);
    }
    return true;
  }

  /// Whether a number can be a sum: finite, and no larger than sums become.
  static bool is_sum(double number) noexcept {  // comparisons with NaN are false
    return number >= -kLargest && number <= kLargest;
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("low", self.low_);
    archive.number("high", self.high_);
    if constexpr (Archive::kReads) {  // comparisons with NaN are false
      archive.expect(self.low_ >= -kFurthest && self.low_ <= 0.0, "low", "finite and at most 0");
      archive.expect(self.high_ >= 0.0 && self.high_ <= kFurthest, "high", "finite and at least 0");
    }
  }

 private:
  static constexpr double kHeadroom = 0.25;
  static constexpr double kLargest = 1e300;            // of sums
  static constexpr double kFurthest = 2.0 * kLargest;  // of the ends, which stay within 5/3 of it

  double discount_;
  double low_ = 0.0;
  double high_ = 0.0;
};

}  // namespace sdnn::agents
