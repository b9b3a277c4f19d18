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
  const double potential = -9.8 * 1.5 + 9.8 * 0.5;  // g (m1 lc1 + m2 l1), and the second link, up
  EXPECT_NEAR(dynamics.energy({0.0, core::kPi, 2.0, -1.0}), kinetic + potential, 1e-13);
}

TEST(AcrobotDynamicsForms, IntegrationStopsAtTheGoal) {
  const AcrobotDynamics dynamics;
  constexpr double kTorque = 0.0, kSpeedLimit1 = 9.0, kSpeedLimit2 = 15.0;
  const Form::State thrown_upwards{2.0, 0.0, 2.0, 0.0};
  Form::State moving = thrown_upwards, standing = thrown_upwards;
  EXPECT_TRUE(dynamics.integrate<Form>(moving, kTorque, kSpeedLimit1, kSpeedLimit2, true));
  EXPECT_GE(dynamics.tip_height(Form::angles(moving)), 1.5);
  EXPECT_FALSE(dynamics.integrate<Form>(standing, kTorque, kSpeedLimit1, kSpeedLimit2, false));
  EXPECT_EQ(standing, thrown_upwards);
}

}  // namespace
}  // namespace sdnn::environments
