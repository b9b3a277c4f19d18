#include "tools/stopwatch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace sdnn::tools {
namespace {

TEST(TimeEach, PreparesAndTimesEveryRepetitionInOrder) {
  std::string calls;
  const Times times = time_each(
      3, [&](int i) { calls.append("p").append(std::to_string(i)); },
      [&](int i) { calls.append("t").append(std::to_string(i)); });
  EXPECT_EQ(calls, "p0t0p1t1p2t2");
  EXPECT_EQ(times.size(), 3U);
}

TEST(TimeEach, ExcludesPreparationFromTimes) {
  constexpr std::int64_t kLong = 2'000'000;  // 2 ms, far above the time of an empty call
  const auto wait = [] {
    for (const std::int64_t end = now() + kLong; now() < end;) {
    }
  };
  const Times timed = time_each(2, [&](int) { wait(); });
  for (const std::int64_t time : timed) EXPECT_GE(time, kLong);
  const Times prepared = time_each(20, [&](int) { wait(); }, [](int) {});
  EXPECT_LT(*std::min_element(prepared.begin(), prepared.end()), kLong);
}

TEST(TimeEach, NoRepetitionsTakeNoTime) {
  EXPECT_TRUE(time_each(0, [](int) { FAIL(); }).empty());
}

TEST(TimeEach, RefusesImpossibleNumbers) {
  EXPECT_THROW(time_each(-1, [](int) {}), std::invalid_argument);
  EXPECT_THROW(time_each(kMaxRepetitions + 1, [](int) {}), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::tools
