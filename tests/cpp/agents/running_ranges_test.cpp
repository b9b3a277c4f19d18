#include "sdnn/agents/running_ranges.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "sdnn/agents/observations.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents {
namespace {

TEST(RunningRanges, AreTwoAndAHalfDeviationsAroundTheMean) {
  RunningRanges ranges(2);
  EXPECT_EQ(ranges[0], std::pair(-2.5, 2.5));
  for (const double x : {1.0, 3.0, 5.0}) ranges.note(std::vector{x, 7.0});
  EXPECT_EQ(ranges[0], std::pair(3.0 - 2.5 * 2.0, 3.0 + 2.5 * 2.0));
  const auto [low, high] = ranges[1];  // a constant
  EXPECT_LT(low, 7.0);
  EXPECT_GT(high, 7.0);
}

TEST(RunningRanges, IgnoreMissingReadingsAndStayFinite) {
  RunningRanges ranges(1);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double x : {2.0, std::nan(""), infinity, 4.0}) ranges.note(std::vector{x});
  RunningRanges same(1);
  for (const double x : {2.0, 4.0}) same.note(std::vector{x});
  EXPECT_EQ(ranges[0], same[0]);
  for (const double x : {1e308, -1e308, 1e308}) ranges.note(std::vector{x});
  EXPECT_TRUE(std::isfinite(ranges[0].second - ranges[0].first));
  RunningRanges restored(1);
  core::restore(restored, core::state_of(ranges));
  EXPECT_EQ(restored[0], ranges[0]);
}

// Symbols, angles and pairs keep their ranges.
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
