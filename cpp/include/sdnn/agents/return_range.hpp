/// How large values can be: from the rewards that have come.
#pragma once

#include <algorithm>

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

  /// The next sum begins with 0.
  void begin_episode() noexcept { sum_ = 0.0; }

  /// Notes a finite reward; says whether the range has grown.
  bool note(double reward) noexcept {
    sum_ = std::clamp(reward + discount_ * sum_, -kLargest, kLargest);
    if (sum_ >= low_ && sum_ <= high_) return false;
    if (sum_ > high_) {
      high_ = sum_ + kHeadroom * (sum_ - low_);
    } else {
      low_ = sum_ - kHeadroom * (high_ - sum_);
    }
    return true;
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void exchange(Self& self, Archive& archive) {
    archive.number("sum", self.sum_);
    archive.number("low", self.low_);
    archive.number("high", self.high_);
    if constexpr (Archive::kReads) {  // comparisons with NaN are false
      archive.expect(self.sum_ >= -kLargest && self.sum_ <= kLargest, "sum", "a finite sum");
      archive.expect(self.low_ >= -kFurthest && self.low_ <= 0.0, "low", "finite and at most 0");
      archive.expect(self.high_ >= 0.0 && self.high_ <= kFurthest, "high", "finite and at least 0");
    }
  }

 private:
  static constexpr double kHeadroom = 0.25;
  static constexpr double kLargest = 1e300;            // of sums
  static constexpr double kFurthest = 2.0 * kLargest;  // of the ends, which stay within 5/3 of it

  double discount_;
  double sum_ = 0.0;
  double low_ = 0.0;
  double high_ = 0.0;
};

}  // namespace sdnn::agents
