#include "sdnn/agents/reward_scale.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <vector>

#include "sdnn/agents/q_lambda.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"

namespace sdnn::agents {
namespace {

// A size is a base-2 logarithm. 2^40 is 40 above the size of 1; the headroom is 16, and 4 more
// after each refusal, so the seventh reward of 2^40 is accepted.
TEST(RewardScale, RefusesAnOutlierUntilItRecursSevenTimes) {
  RewardScale scale;
  EXPECT_TRUE(scale.accepts(0.0));
  EXPECT_FALSE(scale.size());
  for (const double reward : {1.0, -1.5}) EXPECT_TRUE(scale.accepts(reward));
  EXPECT_EQ(scale.size(), 0);
  for (int n_refused = 0; n_refused < 6; ++n_refused) EXPECT_FALSE(scale.accepts(-0x1p40));
  EXPECT_EQ(scale.size(), 0);
  EXPECT_TRUE(scale.accepts(-0x1p40));
  EXPECT_EQ(scale.size(), 40);
  EXPECT_EQ(scale.refused()->first, -0x1p40);
  EXPECT_EQ(scale.refused()->second, 4U);  // the fourth reward, after 0, 1 and -1.5
  EXPECT_TRUE(RewardScale().accepts(0x1p1000));
}

// The upper quartile of the sizes, base-2 logarithms: 90, 0, 0 and -1 of rewards that are not 0.
TEST(RewardScale, StartsWithTheCommonSizeOfTheFirstRewards) {
  RewardScale scale(std::vector<double>{0.0, 0x1p90, 1.0, -1.0, 0.0, 0.5});
  EXPECT_EQ(scale.size(), 0);
  EXPECT_FALSE(scale.accepts(0x1p90));
}

// A size is a base-2 logarithm; a window has 1,024 rewards. After a window of rewards of size 0 the
// size falls from 40 to the headroom of 16, then, as after each window, by a quarter, rounded up.
// end_window returns the size of a window's rewards, or nothing if it is incomplete or all are 0.
TEST(RewardScale, ForgetsASizeThatRewardsNoLongerReach) {
  RewardScale scale;
  ASSERT_TRUE(scale.accepts(0x1p40));
  for (int n = 1; n < 1024; ++n) scale.accepts(0.0);
  EXPECT_EQ(scale.end_window(), 40);
  for (const int expected : {12, 9, 6, 4, 3, 2, 1, 0, 0}) {
    for (int n = 0; n < 1023; ++n) scale.accepts(1.0);
    EXPECT_FALSE(scale.end_window());
    scale.accepts(0.0);
    EXPECT_EQ(scale.end_window(), 0);
    EXPECT_EQ(scale.size(), expected);
  }
  for (int n = 0; n < 1024; ++n) scale.accepts(0.0);
  EXPECT_FALSE(scale.end_window());
}

// Values have 31 bits: beside a first reward of 2^60, a reward of 1 is no unit. With a finer unit
// the value of 2^60 is clipped.
TEST(QLambda, RefineUnitMakesSmallerRewardsLearnable) {
  QLambda agent({{.n_inputs = 2, .n_pattern_units = 40}, std::vector<std::size_t>{3}, 1}, {}, 1);
  const std::vector<double> state{0.3, 0.6};
  const auto value = [&](std::size_t action) {
    auto workspace = agent.workspace();
    return agent.values(state, workspace)[action];
  };
  agent.learn(state, std::array{std::size_t{0}}, 0x1p60, state, true);
  EXPECT_GT(value(0), 0x1p50);
  agent.learn(state, std::array{std::size_t{1}}, 1.0, state, true);
  EXPECT_EQ(value(1), 0.0);
  agent.refine_unit(/*size_in_window=*/0, /*size=*/0);  // rewards of about 2^0
  EXPECT_LT(value(0), 0x1p20);
  agent.learn(state, std::array{std::size_t{1}}, 1.0, state, true);
  EXPECT_GT(value(1), 0.1);
  const auto exponent = agent.readout().exponent();  // the unit's, which is small enough now
  agent.refine_unit(0, 0);
  EXPECT_EQ(agent.readout().exponent(), exponent);
}

}  // namespace
}  // namespace sdnn::agents
