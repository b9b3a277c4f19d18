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

/// Returns nanoseconds since some fixed point in the past.
inline std::int64_t now() noexcept {
  using std::chrono::duration_cast, std::chrono::nanoseconds, std::chrono::steady_clock;
  return duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count();
}

/// Returns the nanoseconds for which the calling thread has run on a processor, or those of now()
/// on systems that do not count them. It needs a system call.
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

/// The duration in nanoseconds from which on a call has probably been interrupted by other
/// programs.
inline constexpr std::int64_t kLongCall = 100'000;

/// Measures the time of every call of timed(i), i = 0 .. n_repetitions - 1, each after an untimed
/// call of prepare(i).
///
/// Times include some 30 ns for reading the clock. With `is_alone`, the time of a call longer than
/// kLongCall is that for which its thread was running, so that other programs have no effect.
/// Throws std::invalid_argument unless n_repetitions is in [0, kMaxRepetitions].
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
