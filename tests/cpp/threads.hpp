/// Work that several threads do at once.
#pragma once

#include <cstddef>
#include <thread>
#include <vector>

namespace sdnn::testing {

/// The results of work(0), work(1), ... work(n - 1), each from a thread of its own.
template <class Work>
auto in_threads(std::size_t n, const Work& work) {
  std::vector<decltype(work(std::size_t{0}))> results(n);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < n; ++i) {
    threads.emplace_back([&, i] { results[i] = work(i); });
  }
  for (std::thread& thread : threads) thread.join();
  return results;
}

}  // namespace sdnn::testing
