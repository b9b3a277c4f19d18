/// Threads and locks, with substitutes for standard libraries without them (WebAssembly,
/// microcontrollers).
#pragma once

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

  /// Calls work(part) in a thread.
  template <class Work, class Part>
  void start(const Work& work, Part part) {
    threads_.emplace_back(work, part);
  }

 private:
  std::vector<std::thread> threads_;
};

#else

struct Mutex {};

/// A substitute for a future: the caller does the work immediately.
class Threads {
 public:
  template <class Work, class Part>
  void start(const Work& work, Part part) {
    work(part);
  }
};

#endif

}  // namespace sdnn::core
