#include "sdnn/environments/acrobot_team.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::environments {
namespace {

TEST(AcrobotTeam, EveryMemberMovesAsItWouldAlone) {
  testing::on_every_instruction_set([](std::string_view) {
    core::Random random(1, core::Stream::exploration);
    std::array<Acrobot, AcrobotTeam::kMaxMembers> alone, members;
    AcrobotTeam team;
    int n_goals = 0;
    for (int step = 0; step < 400; ++step) {
      std::vector<StepResult> expected;
      for (std::size_t i = 0; i < members.size(); ++i) {
        if (random.uniform() < 0.2) continue;  // stands still
        const double torque = 20.0 * random.uniform() - 10.0, tolerance = random.uniform();
        expected.push_back(alone[i].step(torque, tolerance));
        team.join(i, members[i], torque, tolerance);
      }
      std::size_t n = 0;
      EXPECT_EQ(team.step([&](std::size_t i, const StepResult& result) {
        EXPECT_EQ(result.reward, expected[n].reward);
        EXPECT_EQ(result.truncated, expected[n].truncated);
        EXPECT_EQ(result.terminated, expected[n++].terminated);
        n_goals += result.terminated;
        if (result.terminated || result.truncated) alone[i].reset();
        if (result.terminated || result.truncated) members[i].reset();
      }),
                !expected.empty());
      EXPECT_EQ(n, expected.size());
      for (std::size_t i = 0; i < members.size(); ++i) {
        EXPECT_EQ(alone[i].state(), members[i].state());
        EXPECT_EQ(alone[i].decisions(), members[i].decisions());
      }
    }
    EXPECT_GT(n_goals, 0);
  });
}

TEST(AcrobotTeam, NobodyMovesWithoutJoining) {
  AcrobotTeam team;
  EXPECT_FALSE(team.step([](std::size_t, const StepResult&) { FAIL(); }));
  Acrobot acrobot;
  EXPECT_THROW(team.join(0, acrobot, 10.5, 1.0), std::invalid_argument);
  EXPECT_THROW(team.join(0, acrobot, 1.0, -1.0), std::invalid_argument);
  EXPECT_FALSE(team.step([](std::size_t, const StepResult&) { FAIL(); }));
}

}  // namespace
}  // namespace sdnn::environments
