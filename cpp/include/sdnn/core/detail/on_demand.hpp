/// Results that are computed when they are first asked for.
#pragma once

#include <memory>

#include "sdnn/core/detail/threads.hpp"

namespace sdnn::core {

/// A constant that the first thread that needs it computes, and all share. A copy starts without.
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

  /// The constant; `make()` computes it where there is none yet.
  template <class Make>
  std::shared_ptr<const T> get(const Make& make) const {
#if SDNN_HAS_THREADS
    const std::lock_guard lock(mutex_);
#endif
    if (!made_) made_ = std::make_shared<const T>(make());
    return made_;
  }

  /// The next `get` computes it anew.
  void reset() noexcept { made_.reset(); }

 private:
  mutable Mutex mutex_;
  mutable std::shared_ptr<const T> made_;
};

}  // namespace sdnn::core
