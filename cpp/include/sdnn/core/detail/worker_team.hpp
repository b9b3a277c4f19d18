/// A pool of threads for many short pieces of work.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "sdnn/core/detail/threads.hpp"

namespace sdnn::core {

/// A pool of `n_threads` threads, including the caller's, that run one function at a time. Without
/// threads in the standard library, the caller runs everything.
///
/// Starting a thread costs more than a block of training; waking a waiting thread does not. A pool
/// must not be used from several threads at once.
class WorkerTeam {
 public:
  /// Starts the threads, except for the caller's, which works as number 0.
  explicit WorkerTeam(std::size_t n_threads) {
#if SDNN_HAS_THREADS
    struct EndsWaiting {  // ends the waiting threads if no further thread can be started
      WorkerTeam& team;
      bool has_all = false;
      ~EndsWaiting() {
        if (!has_all) team.start();
      }
    } waiting{*this};
    for (std::size_t thread = 1; thread < n_threads; ++thread) {
      threads_.start([this](std::size_t number) { serve(number); }, thread);
      ++n_others_;
    }
    waiting.has_all = true;
#else
    (void)n_threads;
#endif
  }
  WorkerTeam(const WorkerTeam&) = delete;
  WorkerTeam& operator=(const WorkerTeam&) = delete;
  ~WorkerTeam() {
    work_ = nullptr;
    start();
  }

  std::size_t size() const noexcept { return n_others_ + 1; }

  /// Calls work(thread) for thread = 0 .. size() - 1, each in a different thread, and waits for
  /// all. `work` must not throw.
  template <class Work>
  void run(const Work& work) {
    if (n_others_ == 0) return work(std::size_t{0});
    work_ = &work;
    call_ = [](const void* what, std::size_t thread) { (*static_cast<const Work*>(what))(thread); };
    n_busy_.store(n_others_, std::memory_order_relaxed);
    start();
    work(std::size_t{0});
    for (std::size_t busy = n_busy_.load(); busy != 0; busy = n_busy_.load()) n_busy_.wait(busy);
  }

  /// Calls work(i) for i = 0 .. n - 1, divided into a contiguous part for each thread.
  template <class Work>
  void run_over(std::size_t n, const Work& work) {
    run([&](std::size_t thread) {
      const auto begin_of = [&](std::uint64_t k) {
        return static_cast<std::size_t>(k * n / size());
      };
      for (std::size_t i = begin_of(thread); i < begin_of(thread + 1); ++i) work(i);
    });
  }

 private:
  void start() {
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
  }

  /// Waits for each round of work and does its own part, until there is no work.
  void serve(std::size_t thread) {
    for (std::uint64_t seen = 0;;) {
      round_.wait(seen, std::memory_order_acquire);
      ++seen;
      if (work_ == nullptr) return;
      call_(work_, thread);
      if (n_busy_.fetch_sub(1) == 1) n_busy_.notify_one();
    }
  }

  const void* work_ = nullptr;
  void (*call_)(const void*, std::size_t) = nullptr;
  std::atomic<std::uint64_t> round_{0};
  std::atomic<std::size_t> n_busy_{0};
  std::size_t n_others_ = 0;
#if SDNN_HAS_THREADS
  Threads threads_;  // declared last, so that threads are joined before other members are destroyed
#endif
};

}  // namespace sdnn::core
