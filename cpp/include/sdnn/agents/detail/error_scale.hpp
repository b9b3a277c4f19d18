/// The running root mean square of TD errors, in integers.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace sdnn::agents::detail {

/// Returns the integer part of the square root, digit by digit in base 4.
constexpr std::uint64_t square_root(std::uint64_t x) noexcept {
  std::uint64_t root = 0;
  for (std::uint64_t bit = std::uint64_t{1} << 62; bit != 0; bit >>= 2) {
    if (x >= root + bit) {
      x -= root + bit;
      root = (root >> 1) + bit;
    } else {
      root >>= 1;
    }
  }
  return root;
}

/// Divides errors by their running root mean square: the mean of all errors so far or, after 1,024
/// errors, an exponential average with a rate of 1 / 1,024.
class ErrorScale {
 public:
  /// Divides an error, an integer in units of 2^exponent, by the root mean square of the errors so
  /// far, this one included. The quotient has 12 fractional bits and is clipped to [-3, 3].
  std::int32_t normalized(std::int64_t error, std::int32_t exponent) noexcept {
    // The mean square is converted to the unit of this error: a factor of 4 for each power of 2.
    for (; exponent_ < exponent && mean_square_ > 0; ++exponent_) mean_square_ >>= 2;
    for (; exponent_ > exponent && mean_square_ > 0; --exponent_) {
      mean_square_ = std::min(mean_square_ << 2, kLargestMean);
    }
    exponent_ = exponent;
    const std::int64_t size = std::min(std::abs(error) >> kLowBits, kLargestSize);
    const std::int64_t square = (size * size) << kFractionBits;
    if (n_errors_ < kWindow) {
      ++n_errors_;
      mean_square_ += (square - mean_square_) / n_errors_;
    } else {
      mean_square_ += (square - mean_square_) / kWindow;
    }
    const auto root = static_cast<std::int64_t>(
        square_root(static_cast<std::uint64_t>(mean_square_ >> kFractionBits)));
    const auto quotient = std::min((size << kQuotientBits) / std::max<std::int64_t>(root, 1),
                                   kLargestQuotient << kQuotientBits);
    return static_cast<std::int32_t>(error < 0 ? -quotient : quotient);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("mean_square", self.mean_square_);
    archive.number("n_errors", self.n_errors_);
    archive.number("exponent", self.exponent_);
    if constexpr (Archive::kReads) {
      archive.expect(self.mean_square_ >= 0 && self.mean_square_ <= kLargestMean, "mean_square",
                     "in [0, 2^60]");
      archive.expect(self.n_errors_ >= 0 && self.n_errors_ <= kWindow, "n_errors", "in [0, 1024]");
      archive.expect(std::abs(self.exponent_) <= 1100, "exponent", "in [-1100, 1100]");
    }
  }

 private:
  static constexpr int kLowBits = 8;        ///< dropped from errors, so that squares fit
  static constexpr int kFractionBits = 10;  ///< of the mean square, so that 1 / 1,024 of it counts
  static constexpr int kQuotientBits = 12;  ///< fractional bits of a normalized error
  static constexpr std::int64_t kLargestQuotient = 3;
  /// An error has 33 bits at most, 25 without the low ones; its square has 50, and 10 of fraction.
  static constexpr std::int64_t kLargestSize = (std::int64_t{1} << 25) - 1;
  static constexpr std::int64_t kLargestMean = std::int64_t{1} << 60;
  static constexpr std::int64_t kWindow = 1024;  ///< errors in the running mean

  std::int64_t mean_square_ = 0;  ///< of error >> kLowBits, with 10 fractional bits
  std::int64_t n_errors_ = 0;
  std::int32_t exponent_ = 0;  ///< of the unit of errors
};

}  // namespace sdnn::agents::detail
