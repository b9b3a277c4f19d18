#include "sdnn/core/detail/worker_team.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

namespace {

using sdnn::core::WorkerTeam;

TEST(WorkerTeam, RunsEveryPartOnceAndWaits) {
  for (const std::size_t n_threads : {1U, 2U, 5U}) {
    WorkerTeam team(n_threads);
    ASSERT_EQ(team.size(), n_threads);
    for (int round = 0; round < 500; ++round) {
      std::vector<int> calls(n_threads);
      team.run([&](std::size_t part) { ++calls[part]; });
      for (const int n : calls) ASSERT_EQ(n, 1);
    }
  }
}

TEST(WorkerTeam, RunOverCoversEveryItemOnce) {
  WorkerTeam team(3);
  for (const std::size_t n : {0U, 1U, 2U, 3U, 10U, 100U}) {
    std::vector<int> calls(n);
    team.run_over(n, [&](std::size_t i) { ++calls[i]; });
    for (const int times : calls) EXPECT_EQ(times, 1);
  }
}

TEST(WorkerTeam, CanBeDestroyedWithoutWork) { WorkerTeam team(4); }

}  // namespace
