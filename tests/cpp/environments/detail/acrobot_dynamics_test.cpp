#include "sdnn/environments/detail/acrobot_dynamics.hpp"

#include <gtest/gtest.h>

namespace sdnn::environments {
namespace {

using Form = SeparateForm<double>;

// The links have 1 m. Hanging: -1 - 1; with the first link level and the second upright: 0 + 1.
TEST(AcrobotDynamicsForms, HeightAsWorkedByHand) {
  const AcrobotDynamics dynamics;
  EXPECT_EQ(dynamics.tip_height(Form::angles({0.0, 0.0, 0.0, 0.0})), -2.0);
  EXPECT_NEAR(dynamics.tip_height(Form::angles({core::kPi / 2, core::kPi / 2, 0.0, 0.0})), 1.0,
              1e-15);
}

// At theta2 = pi, theta1_dot = 2 and theta2_dot = -1: d11 = 2.5, d12 = 0.75 and d22 = 1.25.
TEST(AcrobotDynamicsForms, EnergyAsWorkedByHand) {
  const AcrobotDynamics dynamics;
  // d11 v1^2 / 2 + d22 v2^2 / 2 + d12 v1 v2.
  const double kinetic = 0.5 * 2.5 * 4.0 + 0.5 * 1.25 + 0.75 * 2.0 * -1.0;
  // Masses and lengths are 1, centres of mass at 1/2. Link 1 hangs down to -1, link 2 is up again.
  const double potential = 9.8 * (-0.5 - 1.0) + 9.8 * 0.5;
  EXPECT_NEAR(dynamics.energy({0.0, core::kPi, 2.0, -1.0}), kinetic + potential, 1e-13);
}

// The goal is a tip height of 1.5 m, at speeds below limit_1 and limit_2, which are not reached
// here. The straight arm is thrown upwards from 0.83 m and passes 1.5 m after 0.28 s. Without a
// stop it would be at 0.87 m again at the end of the decision, after 1 s.
TEST(AcrobotDynamicsForms, IntegrationStopsAtTheGoalAndIsMasked) {
  const AcrobotDynamics dynamics;
  const auto reaches_goal = [&](Form::State& state, bool moving) {
    return dynamics.integrate<Form>(state, /*torque=*/0.0, /*limit_1=*/9.0, /*limit_2=*/15.0,
                                    moving);
  };
  const Form::State thrown_upwards{2.0, 0.0, 2.0, 0.0};
  Form::State state = thrown_upwards, masked = thrown_upwards;
  EXPECT_TRUE(reaches_goal(state, true));
  EXPECT_GE(dynamics.tip_height(Form::angles(state)), 1.5);
  EXPECT_FALSE(reaches_goal(masked, false));
  EXPECT_EQ(masked, thrown_upwards);
}

}  // namespace
}  // namespace sdnn::environments
