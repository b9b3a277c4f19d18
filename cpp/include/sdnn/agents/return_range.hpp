/// The range of values, estimated from recent returns.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/agents/duration.hpp"
#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// A range of values that contains 0 and most of the recent returns.
///
/// The return of a step is known when its episode terminates, or approximately 2 / (1 - gamma)
/// steps later, with the missing rest assumed to be like the known part. A time limit does not end
/// a return: the rewards of the next episode follow. The range is that of 256 returns, spread
/// over the last 40 % of all, without the lowest twentieth and the highest fiftieth. It has a
/// margin above for better returns, but none below: untried actions have the lowest value, and
/// should not look worse than actions that are worse than usual. The range changes when it no
/// longer contains the returns or is twice as wide as necessary.
///
/// Returns are clipped one width beyond the range: otherwise a single huge reward would dominate
/// the returns of all steps before it.
///
/// Until 32 returns and a reward other than 0 are known, the range grows to contain the discounted
/// sums of past rewards, z = r + gamma z: they have the extremes of returns, and are known at once.
class ReturnRange {
 public:
  /// The rewards of an environment whose returns are not known yet.
  struct Rewards {
    std::vector<double> waiting;  ///< room for rewards, of which the first n are in use
    std::vector<double> dts;      ///< the durations of their transitions
    std::size_t n = 0;
    double sum = 0.0;  ///< z, the discounted sum of past rewards
  };

  explicit ReturnRange(double discount) : discount_(discount) { returns_.reserve(kMostReturns); }

  /// The rewards of a new environment: none, and room for all that can wait.
  Rewards no_rewards() const {
    const std::size_t n = 2 * horizon();
    return {std::vector<double>(n), std::vector<double>(n, 1.0), 0, 0.0};
  }

  /// Whether there was a reward other than 0: until then the range is empty.
  bool is_known() const noexcept { return low_ < high_; }
  double low() const noexcept { return low_; }
  double high() const noexcept { return high_; }

  /// Notes the next reward, finite, of a transition of dt usual steps; returns whether the range
  /// moved.
  bool note(double reward, bool terminated, Rewards& rewards, double dt = 1.0) noexcept {
    rewards.sum = clipped(reward + discount_over(discount_, dt) * rewards.sum);
    const bool grows = (n_returns_ < kFewReturns || !is_known()) && hold(rewards.sum);
    if (terminated) rewards.sum = 0.0;
    rewards.dts[rewards.n] = dt;
    rewards.waiting[rewards.n++] = reward;
    if (!terminated && rewards.n < rewards.waiting.size()) return grows;
    const std::size_t n_known = terminated ? rewards.n : rewards.n - horizon();
    note_returns(rewards, n_known, terminated);
    for (std::vector<double>* const numbers : {&rewards.waiting, &rewards.dts}) {
      const auto first = numbers->begin();
      std::copy(first + static_cast<std::ptrdiff_t>(n_known),
                first + static_cast<std::ptrdiff_t>(rewards.n), first);
    }
    rewards.n -= n_known;
    return follow() || grows;
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("low", self.low_);
    archive.number("high", self.high_);
    archive.number("n_returns", self.n_returns_);
    archive.number("due", self.due_);
    archive.number("oldest", self.oldest_);
    archive.numbers("returns", self.returns_);
    if constexpr (Archive::kReads) {  // comparisons with NaN are false
      archive.expect(self.low_ >= -kFurthest && self.low_ <= 0.0, "low", "finite and at most 0");
      archive.expect(self.high_ >= 0.0 && self.high_ <= kFurthest, "high", "finite and at least 0");
      archive.expect(self.returns_.size() <= kMostReturns, "returns", "256 or fewer");
      archive.expect(std::ranges::all_of(self.returns_, is_sum), "returns", "finite sums");
      archive.expect(self.oldest_ < kMostReturns, "oldest", "less than 256");
      const bool is_full = self.returns_.size() == kMostReturns;
      archive.expect(is_full || self.oldest_ == 0, "oldest", "0 before there are 256");
      const bool has_enough = self.n_returns_ < kFewReturns || self.returns_.size() >= kFewReturns;
      archive.expect(has_enough, "returns", "32 at least of so many");
      archive.expect(self.due_ <= self.n_returns_ + returns_between(self.n_returns_), "due",
                     "soon after n_returns");
      self.returns_.reserve(kMostReturns);
    }
  }
  /// Lists what is saved of an environment's rewards; see core/state.hpp.
  template <class Listed, class Archive>
  void serialize_rewards(Listed& rewards, Archive& archive) const {
    const auto first = rewards.waiting.begin();
    std::vector<double> waiting(first, first + static_cast<std::ptrdiff_t>(rewards.n));
    const auto first_dt = rewards.dts.begin();
    std::vector<double> dts(first_dt, first_dt + static_cast<std::ptrdiff_t>(rewards.n));
    archive.number("sum", rewards.sum);
    archive.numbers("rewards", waiting);
    serialize_durations(dts, waiting.size(), archive);
    if constexpr (Archive::kReads) {
      archive.expect(is_sum(rewards.sum), "sum", "a finite sum");
      const std::size_t most = rewards.waiting.size();
      archive.expect(waiting.empty() || waiting.size() < most, "rewards", "as few as can wait");
      archive.expect(std::ranges::all_of(waiting, is_sum), "rewards", "finite");
      std::ranges::copy(waiting, rewards.waiting.begin());
      std::ranges::copy(dts, rewards.dts.begin());
      rewards.n = waiting.size();
    }
  }

 private:
  // Chosen constants.
  static constexpr std::size_t kMostReturns = 256;     // that are remembered
  static constexpr std::uint64_t kFewReturns = 32;     // with fewer, sums of past rewards count
  static constexpr std::size_t kLow = 20, kHigh = 50;  // 1 in 20 lowest and 50 highest is left out
  static constexpr double kHeadroom = 0.25;            // of a range, in widths
  static constexpr double kLargest = 1e300;            // largest sum of rewards
  static constexpr double kFurthest = 2.0 * kLargest;  // beyond all ends of ranges of such sums

  static double clipped(double sum) noexcept { return std::clamp(sum, -kLargest, kLargest); }
  static bool is_sum(double number) noexcept { return number >= -kLargest && number <= kLargest; }

  /// The number of returns from one that is remembered to the next: after n returns, n / 512, so
  /// that the last 256 remembered ones are spread over about the last 40 % of all (1 - exp(-1/2)).
  static std::uint64_t returns_between(std::uint64_t n_returns) noexcept {
    return std::max<std::uint64_t>(n_returns / (2 * kMostReturns), 1);
  }

  /// Steps after which a return counts as known: 2 / (1 - gamma), at most 500.
  std::size_t horizon() const noexcept {
    return static_cast<std::size_t>(2.0 / std::max(1.0 - discount_, 0.004));
  }

  /// Widens the range to contain a sum, and by a quarter more. Returns whether it had to.
  bool hold(double sum) noexcept {
    if (sum >= low_ && sum <= high_) return false;
    if (sum > high_) {
      high_ = sum + kHeadroom * (sum - low_);
    } else {
      low_ = sum - kHeadroom * (high_ - sum);
    }
    return true;
  }

  /// Computes the returns of the first n_known rewards. With `are_all` the episode has no others;
  /// otherwise the known rewards have the share 1 - missing of all weights, and their sum is
  /// divided by it.
  void note_returns(const Rewards& rewards, std::size_t n_known, bool are_all) {
    const double width = n_returns_ < kFewReturns ? kLargest : high_ - low_;
    const double low = clipped(low_ - width), high = clipped(high_ + width);
    double sum = 0.0, missing = 1.0;
    for (std::size_t i = rewards.n; i-- > 0;) {
      const double discount = discount_over(discount_, rewards.dts[i]);
      sum = std::clamp(rewards.waiting[i] + discount * sum, low, high);
      missing *= discount;
      if (i < n_known) note_return(are_all || missing == 1.0 ? sum : sum / (1.0 - missing));
    }
  }

  /// Counts a return, and remembers it if it is due, once there are 256 in the place of the oldest.
  void note_return(double value) {
    if (++n_returns_ < due_) return;
    due_ = n_returns_ + returns_between(n_returns_);
    if (returns_.size() < kMostReturns) {
      returns_.push_back(clipped(value));
    } else {
      returns_[static_cast<std::size_t>(oldest_)] = clipped(value);
      oldest_ = (oldest_ + 1) % kMostReturns;
    }
  }

  /// Sets the range by the remembered returns if they are not within it, or it is twice as wide as
  /// necessary. Returns whether it changed.
  bool follow() noexcept {
    if (n_returns_ < kFewReturns) return false;
    std::array<double, kMostReturns> sorted;
    const auto end = std::ranges::copy(returns_, sorted.begin()).out;
    std::sort(sorted.begin(), end);
    const double low = std::min(sorted[returns_.size() / kLow], 0.0);
    const double high = std::max(sorted[returns_.size() - 1 - returns_.size() / kHigh], 0.0);
    if (low == high) return false;
    const double most = high > 0.0 ? high + kHeadroom * (high - low) : 0.0;
    const bool holds = low >= low_ && high <= high_;
    if (holds && 2.0 * (most - low) >= high_ - low_) return false;
    low_ = low;
    high_ = most;
    return true;
  }

  double discount_;
  double low_ = 0.0;
  double high_ = 0.0;
  std::uint64_t n_returns_ = 0;
  std::uint64_t due_ = 1;        ///< the number of the next return to remember
  std::uint64_t oldest_ = 0;     ///< the place of the oldest one in a full list
  std::vector<double> returns_;  ///< those remembered
};

}  // namespace sdnn::agents
