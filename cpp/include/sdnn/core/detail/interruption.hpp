/// Long work that can be stopped from outside.
#pragma once

#include <atomic>

namespace sdnn::core {

/// Function that long work calls at least ten times a second; it throws to stop the work.
/// None unless somebody sets it, as the Python package does for Ctrl-C. Called from any thread.
/// With `at_once` it must look even if it just did: what follows cannot be undone.
using InterruptionCheck = void (*)(bool at_once);

inline std::atomic<InterruptionCheck>& interruption_check() noexcept {
  static std::atomic<InterruptionCheck> check = nullptr;
  return check;
}

/// A place where work may end early, with whatever the check throws.
inline void interruption_point(bool at_once = false) {
  if (const auto check = interruption_check().load(std::memory_order_relaxed)) check(at_once);
}

}  // namespace sdnn::core
