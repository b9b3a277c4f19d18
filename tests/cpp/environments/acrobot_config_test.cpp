#include "sdnn/environments/acrobot_config.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace {

using namespace sdnn::environments;

// Section 4.1: the limits of speed are 3 pi and 5 pi, idling is below 5 degrees.
TEST(AcrobotConfig, HasTheLimitsOfThePaper) {
  const AcrobotConfig config;
  EXPECT_DOUBLE_EQ(config.goal_velocity_1, 3.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(config.goal_velocity_2, 5.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(config.idle_angle, 5.0 * std::numbers::pi / 180.0);
  EXPECT_EQ(config.max_decisions, 50);
  EXPECT_EQ(config.goal_test, GoalTest::every_step);
}

}  // namespace
