#include "sdnn/environments/acrobot_team.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace sdnn::environments {
namespace {

TEST(AcrobotTeam, DoesNotMoveWithoutMembersAndRefusesBadArguments) {
  AcrobotTeam team;
  EXPECT_FALSE(team.step([](std::size_t, const StepResult&) { FAIL(); }));
  Acrobot acrobot;
  EXPECT_THROW(team.join(0, acrobot, 10.5, 1.0), std::invalid_argument);
  EXPECT_THROW(team.join(0, acrobot, 1.0, -1.0), std::invalid_argument);
  EXPECT_FALSE(team.step([](std::size_t, const StepResult&) { FAIL(); }));
}

}  // namespace
}  // namespace sdnn::environments
