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
/// The threads wait between calls, because starting a thread takes longer than many of the pieces
/// of work. A pool must not be used from several threads at once.
class WorkerTeam {
 public:
  /// Starts the threads, except for the caller's, which works as number 0.
  explicit WorkerTeam(std::size_t n_threads) {
#if SDNN_HAS_THREADS
    // Ends the waiting threads if starting a further one throws; they could not be joined else.
    struct EndsWaiting {
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

  /// Calls work(i) for i = 0 .. size() - 1, each in another thread, and waits. It must not throw.
  template <class Work>
  void run(const Work& work) {
    if (n_others_ == 0) return work(std::size_t{0});
    work_ = &work;
    call_ = [](const void* function, std::size_t thread) {
      (*static_cast<const Work*>(function))(thread);
    };
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
  /// Starts a round: lets all threads do their parts of the work.
  void start() {
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
  }

  /// The loop of a thread: does its part of each round, until one without work ends the team.
  void serve(std::size_t thread) {
    for (std::uint64_t n_rounds = 0;;) {
      round_.wait(n_rounds, std::memory_order_acquire);
      ++n_rounds;
      if (work_ == nullptr) return;
      call_(work_, thread);
      if (n_busy_.fetch_sub(1) == 1) n_busy_.notify_one();
    }
  }

  const void* work_ = nullptr;  ///< the function of the round; null: the team ends
  void (*call_)(const void*, std::size_t) = nullptr;  ///< calls the function with a thread's number
  std::atomic<std::uint64_t> round_{0};               ///< the number of rounds so far
  std::atomic<std::size_t> n_busy_{0};                ///< threads that have not finished the round
  std::size_t n_others_ = 0;                          ///< threads beside the caller's
#if SDNN_HAS_THREADS
  Threads threads_;  // declared last, so that threads are joined before other members are destroyed
#endif
};

}  // namespace sdnn::core
