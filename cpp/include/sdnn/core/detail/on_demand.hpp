/// Results that are computed when they are first needed.
#pragma once

#include <memory>

#include "sdnn/core/detail/threads.hpp"

namespace sdnn::core {

/// A constant that is computed by the first thread that needs it, and shared by all. Copies start
/// without it.
///
/// Thread safety: `get` may be called by many threads at once.
template <class T>
class OnDemand {
 public:
  OnDemand() = default;
  OnDemand(const OnDemand&) noexcept {}
  OnDemand& operator=(const OnDemand&) noexcept {
    reset();
    return *this;
  }
  ~OnDemand() = default;

  /// Returns the constant, which `make()` computes on the first call.
  template <class Make>
  std::shared_ptr<const T> get(const Make& make) const {
#if SDNN_HAS_THREADS
    const std::lock_guard lock(mutex_);
#endif
    if (!made_) made_ = std::make_shared<const T>(make());
    return made_;
  }

  /// Discards the constant; the next `get` computes it again.
  void reset() noexcept { made_.reset(); }

 private:
  mutable Mutex mutex_;
  mutable std::shared_ptr<const T> made_;
};

}  // namespace sdnn::core
