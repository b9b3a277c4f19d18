/// A loop at a fixed rate: waits for the next tick, and counts the deadlines that were missed.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/threads.hpp"

namespace sdnn::agents {

/// A loop at a fixed rate, `hz` ticks a second:
///
///     FixedRate rate(50.0);
///     while (running) {
///       rate.wait();
///       ...  // work that must be done before the next tick
///     }
///
/// Tick k is at start + k / hz, so delays do not add up and the loop does not drift. If the work
/// after a tick takes longer than a period, that is a miss: the ticks that have passed are skipped,
/// and the loop never catches up in a burst. A wait that ends a whole period late is a miss, too.
///
/// The accuracy of ticks is that with which the operating system wakes a sleeping thread.
class FixedRate {
 public:
  /// A clock, in seconds since any fixed moment; and a function that waits some seconds, or less.
  using Clock = std::function<double()>;
  using Sleep = std::function<void(double)>;

#if SDNN_HAS_THREADS
  /// Throws std::invalid_argument unless `hz` is in [1e-3, 1e6].
  explicit FixedRate(double hz)
      : FixedRate(
            hz,
            [] {
              const auto now = std::chrono::steady_clock::now().time_since_epoch();
              return std::chrono::duration<double>(now).count();
            },
            [](double seconds) {
              std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
            }) {}
#endif
  /// Uses another clock, which must never go back.
  FixedRate(double hz, Clock clock, Sleep sleep)
      : hz_(hz), clock_(std::move(clock)), sleep_(std::move(sleep)) {
    core::require_in_range("hz", hz, 1e-3, 1e6);
  }

  double hz() const noexcept { return hz_; }

  /// Waits for the next tick and returns its number. The first call returns 0 without waiting.
  std::int64_t wait() {
    if (tick_ < 0) {
      start_ = clock_();
      return tick_ = 0;
    }
    const std::int64_t before = tick_++;
    double now = clock_();
    if (now > time_of(tick_)) skip(now);
    for (;;) {
      while (now < time_of(tick_)) {
        sleep_(time_of(tick_) - now);
        now = clock_();
      }
      if (now <= time_of(tick_ + 1)) break;
      ++tick_;  // the sleep lasted until after the tick
      skip(now);
    }
    n_skipped_ += tick_ - before - 1;
    return tick_;
  }

  /// The number of times that the work after a tick was not done by the next tick.
  std::int64_t n_misses() const noexcept { return n_misses_; }
  /// The number of ticks that were skipped after misses.
  std::int64_t n_skipped() const noexcept { return n_skipped_; }
  /// The lateness of the worst miss in seconds.
  double worst_lateness() const noexcept { return worst_lateness_; }

 private:
  double time_of(std::int64_t tick) const noexcept {
    return start_ + static_cast<double>(tick) / hz_;
  }

  /// Counts a miss of tick_, and moves on to the first tick that is not before `now`.
  void skip(double now) {
    ++n_misses_;
    worst_lateness_ = std::max(worst_lateness_, now - time_of(tick_));
    const auto next = static_cast<std::int64_t>(std::ceil((now - start_) * hz_));
    tick_ = std::max(tick_, next);
    if (time_of(tick_) < now) ++tick_;  // the quotient may have been rounded
  }

  double hz_;
  Clock clock_;
  Sleep sleep_;
  double start_ = 0.0;
  std::int64_t tick_ = -1;
  std::int64_t n_misses_ = 0;
  std::int64_t n_skipped_ = 0;
  double worst_lateness_ = 0.0;
};

}  // namespace sdnn::agents
