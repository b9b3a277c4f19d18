#include "sdnn/environments/acrobot_config.hpp"

#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

namespace {

using namespace sdnn::environments;

// Section 4.1: the limits of speed are 3 pi and 5 pi, idling is below 5 degrees.
TEST(AcrobotConfig, HasThePapersNumbers) {
  const AcrobotConfig config;
  EXPECT_DOUBLE_EQ(config.goal_velocity_1, 9.42477796076938);
  EXPECT_DOUBLE_EQ(config.goal_velocity_2, 15.707963267948966);
  EXPECT_DOUBLE_EQ(config.idle_angle, 0.08726646259971647);
  EXPECT_EQ(config.max_decisions, 50);
  EXPECT_EQ(config.goal_test, GoalTest::every_step);
}

TEST(AcrobotConfig, ListsEveryMemberOnce) {
  std::vector<std::string> names;
  std::apply(
      [&names](const auto&... field) {
        const auto change = [&names](const auto& one) {
          AcrobotConfig config;
          auto& value = one.of(config);
          value = static_cast<std::remove_cvref_t<decltype(value)>>(static_cast<int>(value) + 1);
          EXPECT_NE(config, AcrobotConfig{}) << one.name;
          names.emplace_back(one.name);
        };
        (change(field), ...);
      },
      AcrobotConfig::fields());
  EXPECT_EQ(names.size(), 20u);
  EXPECT_EQ(names.front(), "link_mass_1");
  EXPECT_EQ(names.back(), "idle_angle");
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(names[i], names[j]);
  }
}

}  // namespace
