/// Timing of each call of a function, so that medians can be taken.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <vector>

#include "sdnn/core/detail/check.hpp"

namespace sdnn::tools {

/// A duration for each repetition, in nanoseconds of std::chrono::steady_clock.
using Times = std::vector<std::int64_t>;

/// The largest number of repetitions in a measurement.
inline constexpr int kMaxRepetitions = 1 << 24;

/// Nanoseconds since some fixed point in the past.
inline std::int64_t now() noexcept {
  using std::chrono::duration_cast, std::chrono::nanoseconds, std::chrono::steady_clock;
  return duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count();
}

/// Nanoseconds that the processor has spent on the calling thread, or those of now() on systems
/// that do not count them. Reading them costs a call of the system.
inline std::int64_t thread_time() noexcept {
#ifdef CLOCK_THREAD_CPUTIME_ID
  std::timespec time{};
  if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time) == 0) {
    return std::int64_t{1'000'000'000} * time.tv_sec + time.tv_nsec;
  }
#endif
  return now();
}

/// Makes the compiler believe that `value` is read, so that its computation is not dropped.
template <class Value>
void keep(const Value& value) noexcept {
#if defined(__GNUC__) || defined(__clang__)
  asm volatile("" : : "r"(&value) : "memory");
#else
  static_cast<void>(*static_cast<const volatile Value*>(&value));
#endif
}

/// A call that takes longer than this, in nanoseconds, is likely to be interrupted by others.
inline constexpr std::int64_t kLongCall = 100'000;

/// Measures the time of every call of timed(i), i = 0 .. n_repetitions - 1, each after an untimed
/// call of prepare(i).
///
/// Reading the clock costs some 30 ns, which are included. With `is_alone`, a call that takes
/// longer than kLongCall counts only while its thread is running: other programs have no effect
/// then. Throws std::invalid_argument unless n_repetitions is in [0, kMaxRepetitions].
template <class Prepare, class Timed>
Times time_each(int n_repetitions, Prepare&& prepare, Timed&& timed, bool is_alone = false) {
  core::require_in_range("n_repetitions", n_repetitions, 0, kMaxRepetitions);
  Times times(static_cast<std::size_t>(n_repetitions));
  for (int i = 0; i < n_repetitions; ++i) {
    prepare(i);
    const std::int64_t running = is_alone ? thread_time() : 0, begin = now();
    timed(i);
    std::int64_t& time = times[static_cast<std::size_t>(i)];
    time = now() - begin;
    if (is_alone && time > kLongCall) time = std::min(time, thread_time() - running);
  }
  return times;
}

/// Times calls that need no preparation.
template <class Timed>
Times time_each(int n_repetitions, Timed&& timed) {
  return time_each(n_repetitions, [](int) {}, timed);
}

}  // namespace sdnn::tools
