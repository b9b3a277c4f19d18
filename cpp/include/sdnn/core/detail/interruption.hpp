/// Interruption of long computations.
#pragma once

#include <atomic>

namespace sdnn::core {

/// A function that long computations call at least ten times a second, from any thread; it throws
/// to stop them. It is empty by default; the Python package sets it for Ctrl-C. With `at_once` it
/// must check even if it has just done so, because the next step cannot be undone.
using InterruptionCheck = void (*)(bool at_once);

inline std::atomic<InterruptionCheck>& interruption_check() noexcept {
  static std::atomic<InterruptionCheck> check = nullptr;
  return check;
}

/// Lets the check stop the computation by throwing.
inline void interruption_point(bool at_once = false) {
  if (const auto check = interruption_check().load(std::memory_order_relaxed)) check(at_once);
}

}  // namespace sdnn::core
