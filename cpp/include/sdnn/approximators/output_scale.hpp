/// Layer 6: the conversion between numbers of active units and values.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "sdnn/core/detail/check.hpp"

namespace sdnn::approximators {

/// The function g from a number of active units to a value: a straight line from (u_low, q_low) to
/// (u_high, q_high), constant outside.
///
/// Source: section 4.2 (the paper's g: 20 <= u <= 280 onto [-20, 20]); method.md, section 1.6.
class OutputScale {
 public:
  /// Throws std::invalid_argument unless u_low < u_high and q_low < q_high, both within +- 1e301,
  /// so that their difference does not overflow.
  OutputScale(int u_low, int u_high, double q_low, double q_high)
      : u_low_(u_low), u_high_(u_high), q_low_(q_low), q_high_(q_high) {
    core::require_in_range("u_low", u_low, 0, 1 << 20);
    core::require_greater("u_high", u_high, "u_low", u_low);
    core::require_finite("q_low", q_low);
    core::require_finite("q_high", q_high);
    core::require_in_range("q_low", q_low, -kLargest, kLargest);
    core::require_in_range("q_high", q_high, -kLargest, kLargest);
    core::require_greater("q_high", q_high, "q_low", q_low);
  }

  int u_low() const noexcept { return u_low_; }
  int u_high() const noexcept { return u_high_; }
  double q_low() const noexcept { return q_low_; }
  double q_high() const noexcept { return q_high_; }

  /// The change of the value for an additional active unit. The quotients are taken first, so that
  /// q_high - q_low cannot overflow.
  double step() const noexcept {
    return q_high_ / (u_high_ - u_low_) - q_low_ / (u_high_ - u_low_);
  }

  /// The value g(u) of `n_firing` active units.
  double operator()(int n_firing) const noexcept {
    if (n_firing > u_high_) return q_high_;
    if (n_firing < u_low_) return q_low_;
    // A weighted mean rounds once at the end, and is symmetric about the middle of the line.
    return (q_low_ * (u_high_ - n_firing) + q_high_ * (n_firing - u_low_)) / (u_high_ - u_low_);
  }

  /// Returns the number of units, not rounded, whose value is `value` clipped to [q_low, q_high].
  /// For every u in [u_low, u_high], exact_inverse(g(u)) is within 1e-9 of u. Requires a number.
  double exact_inverse(double value) const noexcept {
    assert(!std::isnan(value));
    const double clipped = std::clamp(value, q_low_, q_high_);
    return u_low_ + (clipped - q_low_) * (u_high_ - u_low_) / (q_high_ - q_low_);
  }

  /// Returns the number of units whose value is nearest to `value` clipped to [q_low, q_high];
  /// halves are rounded up. For every u in [u_low, u_high], inverse(g(u)) == u. Requires a number.
  int inverse(double value) const noexcept {
    return static_cast<int>(std::floor(exact_inverse(value) + 0.5));
  }

 private:
  static constexpr double kLargest = 1e301;  // times 2^20 units, it is still a finite double

  int u_low_;
  int u_high_;
  double q_low_;
  double q_high_;
};

}  // namespace sdnn::approximators
