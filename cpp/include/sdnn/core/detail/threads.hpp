/// Threads and locks, with substitutes where they are missing (WebAssembly, microcontrollers).
#pragma once

#include <memory>
#include <version>

#ifdef __cpp_lib_shared_mutex  // defined exactly where there is <mutex>
#define SDNN_HAS_THREADS 1
#include <mutex>
#include <thread>
#include <vector>
#else
#define SDNN_HAS_THREADS 0
#endif

namespace sdnn::core {

#if SDNN_HAS_THREADS

using Mutex = std::mutex;

/// Threads that are joined at the end of their scope.
class Threads {
 public:
  Threads() = default;
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;
  ~Threads() {
    for (std::thread& thread : threads_) thread.join();
  }

  /// Calls work(number) in a new thread.
  template <class Work, class Number>
  void start(const Work& work, Number number) {
    threads_.emplace_back(work, number);
  }

 private:
  std::vector<std::thread> threads_;
};

#else

struct Mutex {};

/// A substitute for a future: the caller does the work immediately.
class Threads {
 public:
  template <class Work, class Number>
  void start(const Work& work, Number number) {
    work(number);
  }
};

#endif

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
