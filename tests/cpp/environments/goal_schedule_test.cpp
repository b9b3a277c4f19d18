#include "sdnn/environments/goal_schedule.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace {

using sdnn::environments::GoalSchedule;
using sdnn::environments::GoalScheduleConfig;
using sdnn::environments::GoalScheduleKind;

// 1 / (1 + k / 100) in episode k up to 10,000, then 0.01.
TEST(GoalSchedule, InverseLinearIsTheDefault) {
  const GoalSchedule tolerance;
  EXPECT_DOUBLE_EQ(tolerance(1), 1.0 / 1.01);
  EXPECT_DOUBLE_EQ(tolerance(100), 1.0 / 2.0);
  EXPECT_DOUBLE_EQ(tolerance(300), 1.0 / 4.0);
  EXPECT_DOUBLE_EQ(tolerance(10000), 1.0 / 101.0);
  EXPECT_EQ(tolerance(10001), 0.01);
  EXPECT_EQ(tolerance(15000), 0.01);
}

// 1 / sqrt(1 + k) in episode k up to 10,000, then 0.01.
TEST(GoalSchedule, InverseSqrtIsContinuousAtItsLastEpisode) {
  const GoalScheduleConfig config{.kind = GoalScheduleKind::inverse_sqrt};
  const GoalSchedule tolerance(config);
  EXPECT_DOUBLE_EQ(tolerance(3), 0.5);
  EXPECT_DOUBLE_EQ(tolerance(99), 0.1);
  EXPECT_NEAR(tolerance(10000), 0.01, 1e-6);
  EXPECT_EQ(tolerance(10001), 0.01);
}

TEST(GoalSchedule, ConstantIgnoresTheEpisode) {
  const GoalScheduleConfig config{.kind = GoalScheduleKind::constant, .constant_value = 0.25};
  const GoalSchedule tolerance(config);
  EXPECT_EQ(tolerance(1), 0.25);
  EXPECT_EQ(tolerance(20000), 0.25);
}

TEST(GoalSchedule, NeverRises) {
  for (const auto kind : {GoalScheduleKind::inverse_linear, GoalScheduleKind::inverse_sqrt}) {
    const GoalScheduleConfig config{.kind = kind, .floor = 0.005};
    const GoalSchedule tolerance(config);
    for (int k = 1; k < 12000; ++k) EXPECT_LE(tolerance(k + 1), tolerance(k));
  }
}

TEST(GoalSchedule, RefusesEpisodesBelowOne) {
  EXPECT_THROW(GoalSchedule()(0), std::invalid_argument);
  EXPECT_THROW(GoalSchedule()(-5), std::invalid_argument);
}

}  // namespace
