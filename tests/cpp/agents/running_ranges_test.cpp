#include "sdnn/agents/running_ranges.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sdnn/agents/observations.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

TEST(RunningRanges, AreTwoAndAHalfDeviationsAroundTheMean) {
  RunningRanges ranges(2);
  EXPECT_EQ(ranges[0], std::pair(-2.5, 2.5));  // mean 0 and deviation 1 before the first value
  for (const double x : {1.0, 3.0, 5.0}) ranges.note(std::vector{x, 7.0});
  EXPECT_EQ(ranges[0], std::pair(3.0 - 2.5 * 2.0, 3.0 + 2.5 * 2.0));  // deviation sqrt(8 / 2)
  const auto [low, high] = ranges[1];                                 // a constant
  EXPECT_LT(low, 7.0);
  EXPECT_GT(high, 7.0);
}

TEST(RunningRanges, IgnoreMissingReadingsStayFiniteAndAreRestored) {
  RunningRanges ranges(1);
  for (const double x : {2.0, testing::kNaN, testing::kInfinity, 4.0}) ranges.note(std::vector{x});
  RunningRanges without_missing(1);
  for (const double x : {2.0, 4.0}) without_missing.note(std::vector{x});
  EXPECT_EQ(ranges[0], without_missing[0]);
  for (const double x : {1e308, -1e308, 1e308}) ranges.note(std::vector{x});
  EXPECT_TRUE(std::isfinite(ranges[0].second - ranges[0].first));
  RunningRanges restored(1);
  core::restore(restored, core::state_of(ranges));
  EXPECT_EQ(restored[0], ranges[0]);
}

// Variables 1 and 2 are the cosine and sine of an angle, whose range is fixed. The others have the
// means 5 and 0 and the deviations 1 and 10, so that their ranges end at 5 - 2.5 and 25.
TEST(Observations, RunningRangesChangeForNumbersOnly) {
  ObservationConfig config;
  config.low = {0.0, -1.0, -1.0, {}};
  config.high = {1.0, 1.0, 1.0, {}};
  config.angle_pairs = {{1, 2}};
  config.running = true;
  Observations observations(config, true, 2);
  ASSERT_FALSE(observations.needs_fit());
  core::Random random(1, core::Stream::weights);
  for (int i = 0; i < 2000; ++i) {
    observations.note(std::vector{5.0 + random.normal(), 0.6, 0.8, 10.0 * random.normal()});
  }
  EXPECT_NEAR(observations.low()[0], 2.5, 0.2);
  EXPECT_NEAR(observations.high()[3], 25.0, 2.0);
  EXPECT_EQ(observations.low()[1], -1.0);
  std::vector<double> state(observations.n_inputs());
  observations.scale(std::vector{5.0, 0.6, 0.8, 0.0}, state);
  EXPECT_NEAR(state[0], 0.5, 0.05);
}

}  // namespace
}  // namespace sdnn::agents
