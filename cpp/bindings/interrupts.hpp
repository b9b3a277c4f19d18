/// Ctrl-C in long calls.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>

#include "sdnn/core/detail/interrupt_check.hpp"

namespace sdnn::bindings {

/// Raises what Python's signal handlers raise; throws py::error_already_set. Takes the GIL, about
/// every 50 ms, so the caller may have released it.
inline core::InterruptCheck interrupt_check() {
  using Clock = std::chrono::steady_clock;
  constexpr auto kPeriod = std::chrono::milliseconds(50);
  return core::InterruptCheck([kPeriod, next = Clock::now() + kPeriod]() mutable {
    if (Clock::now() < next) return;
    const pybind11::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
    next = Clock::now() + kPeriod;
  });
}

/// The same at every call, for pieces of work that must not be interrupted after the last one.
inline core::InterruptCheck interrupt_check_at_once() {
  return core::InterruptCheck([] {
    const pybind11::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
  });
}

}  // namespace sdnn::bindings
