/// Work that is stopped from outside, as Ctrl-C does it in Python.
#pragma once

#include <stdexcept>

#include "sdnn/core/detail/interruption.hpp"

namespace sdnn::testing {

struct StopError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline int n_points_left = 0;

/// Stops work at its `n`-th interruption point from now, counted from 0.
class StopAt {
 public:
  explicit StopAt(int n) {
    n_points_left = n;
    core::interruption_check() = [](bool) {
      if (n_points_left-- == 0) throw StopError("stopped");
    };
  }
  StopAt(const StopAt&) = delete;
  StopAt& operator=(const StopAt&) = delete;
  ~StopAt() { core::interruption_check() = nullptr; }
};

}  // namespace sdnn::testing
