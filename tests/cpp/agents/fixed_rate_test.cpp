#include "sdnn/agents/fixed_rate.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

/// A clock that the test moves, and that sleeps `oversleep` too long.
struct ManualClock {
  double now = 100.0, oversleep = 0.0;

  FixedRate rate(double hz) {
    return {hz, [this] { return now; }, [this](double seconds) { now += seconds + oversleep; }};
  }
};

// At 4 Hz all times are exact: tick n is due at 100 + n / 4 seconds.
TEST(FixedRate, TicksDoNotDrift) {
  ManualClock clock;
  FixedRate rate = clock.rate(4.0);
  for (std::int64_t tick = 0; tick < 1000; ++tick) {
    EXPECT_EQ(rate.wait(), tick);
    EXPECT_EQ(clock.now, 100.0 + 0.25 * static_cast<double>(tick));
    clock.now += tick % 2 == 0 ? 0.125 : 0.25;  // work that ends just in time is no miss
  }
  EXPECT_EQ(rate.n_misses(), 0);
  EXPECT_EQ(rate.n_skipped(), 0);
  EXPECT_EQ(rate.worst_lateness(), 0.0);
}

// A tick of 4 Hz is missed if the work before it takes longer than 0.25 s.
TEST(FixedRate, SkipsMissedTicksAndCountsThem) {
  ManualClock clock;
  FixedRate rate = clock.rate(4.0);
  EXPECT_EQ(rate.wait(), 0);
  clock.now += 0.875;  // ticks 1, 2 and 3 were at 0.25, 0.5 and 0.75
  EXPECT_EQ(rate.wait(), 4);
  EXPECT_EQ(clock.now, 101.0);
  EXPECT_EQ(rate.n_misses(), 1);
  EXPECT_EQ(rate.n_skipped(), 3);
  EXPECT_EQ(rate.worst_lateness(), 0.875 - 0.25);  // of tick 1
  clock.now += 0.5;                                // tick 5 is missed, tick 6 is now
  EXPECT_EQ(rate.wait(), 6);
  EXPECT_EQ(clock.now, 101.5);
  EXPECT_EQ(rate.n_misses(), 2);
  EXPECT_EQ(rate.n_skipped(), 4);
  EXPECT_EQ(rate.worst_lateness(), 0.625);
  EXPECT_EQ(rate.wait(), 7);
  EXPECT_EQ(rate.n_misses(), 2);
}

TEST(FixedRate, SleepingLongerThanAPeriodIsAMiss) {
  ManualClock clock;
  FixedRate rate = clock.rate(4.0);
  rate.wait();
  clock.oversleep = 0.125;  // within the period
  EXPECT_EQ(rate.wait(), 1);
  EXPECT_EQ(rate.n_misses(), 0);
  const double start = clock.now;
  bool once = true;
  FixedRate once_late(  // by more than a period
      4.0, [&clock] { return clock.now; },
      [&](double seconds) {
        clock.now += seconds + (once ? 0.375 : 0.0);
        once = false;
      });
  EXPECT_EQ(once_late.wait(), 0);
  EXPECT_EQ(once_late.wait(), 3);  // woke up at 0.25 + 0.375 = 0.625: tick 2 at 0.5 is over
  EXPECT_EQ(clock.now, start + 0.75);
  EXPECT_EQ(once_late.n_misses(), 1);
  EXPECT_EQ(once_late.n_skipped(), 2);
  EXPECT_EQ(once_late.worst_lateness(), 0.625 - 0.5);  // after the end of the period of tick 1
}

// At random rates and with work of random length, a tick begins in its own period, and only once.
// Work begins up to 0.3 periods late and takes up to 2, so it ends up to 1.3 periods too late.
TEST(FixedRate, EveryTickBeginsWithinItsPeriod) {
  core::Random random(2, core::Stream::weights);
  for (int run = 0; run < 200; ++run) {
    ManualClock clock;
    clock.now = 1e6 * random.uniform();
    const double start = clock.now;
    const double hz = std::exp(14.0 * random.uniform() - 2.0);  // from 0.14 Hz to 160 kHz
    clock.oversleep = 0.3 * random.uniform() / hz;
    FixedRate rate = clock.rate(hz);
    std::int64_t last_tick = -1, n_late = 0, n_ticks = 0;
    double deadline = start + 1.0;
    for (int i = 0; i < 100; ++i) {
      if (i > 0) n_late += clock.now > deadline;
      const std::int64_t tick = rate.wait();
      ++n_ticks;
      ASSERT_GT(tick, last_tick);
      ASSERT_GE(clock.now, start + static_cast<double>(tick) / hz);
      ASSERT_LE(clock.now, start + static_cast<double>(tick + 1) / hz);
      deadline = start + static_cast<double>(tick + 1) / hz;
      clock.now += 2.0 * random.uniform() * random.uniform() / hz;
      last_tick = tick;
    }
    EXPECT_EQ(rate.n_misses(), n_late);
    EXPECT_EQ(last_tick + 1, n_ticks + rate.n_skipped());
    EXPECT_LE(rate.worst_lateness(), 2.0 / hz);
  }
}

// With the real clock: tick 10 begins 50 ms after tick 0, but for the rounding of clocks.
TEST(FixedRate, TenPeriodsOf200HzTakeAtLeast49Ms) {
  using Clock = std::chrono::steady_clock;
  const auto before = Clock::now();
  FixedRate rate(200.0);
  std::int64_t tick = 0;
  while (tick < 10) tick = rate.wait();
  EXPECT_GE(Clock::now() - before, std::chrono::milliseconds(49));
}

// Rates may be from 0.001 to 1,000,000 Hz.
TEST(FixedRate, RefusesRatesOutOfRange) {
  for (const double bad : {0.0, -1.0, 1e-4, 2e6, testing::kNaN, testing::kInfinity}) {
    EXPECT_THROW(FixedRate{bad}, std::invalid_argument);
  }
  EXPECT_EQ(FixedRate(50.0).hz(), 50.0);
}

}  // namespace
}  // namespace sdnn::agents
