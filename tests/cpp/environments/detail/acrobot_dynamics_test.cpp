#include "sdnn/environments/detail/acrobot_dynamics.hpp"

#include <gtest/gtest.h>

#include "sdnn/core/random.hpp"

namespace sdnn::environments {
namespace {

using One = SeparateForm<double>;

// Hanging: -l1 - l2; level, the second link folded up: 0 + 1.
TEST(AcrobotDynamicsForms, HeightAsWorkedByHand) {
  const AcrobotDynamics dynamics;
  EXPECT_EQ(dynamics.tip_height(One::angles({0.0, 0.0, 0.0, 0.0})), -2.0);
  EXPECT_NEAR(dynamics.tip_height(One::angles({core::kPi / 2, core::kPi / 2, 0.0, 0.0})), 1.0,
              1e-15);
}

// (1/2) (4.5 - 1) 4 + (1/2) 1.25 + ... at theta2 = pi, theta1_dot = 2, theta2_dot = -1.
TEST(AcrobotDynamicsForms, EnergyAsWorkedByHand) {
  const AcrobotDynamics dynamics;
  const double kinetic = 0.5 * 2.5 * 4.0 + 0.5 * 1.25 - (1.25 - 0.5) * 2.0;
  const double potential = -9.8 * 1.5 + 9.8 * 0.5;
  EXPECT_NEAR(dynamics.energy({0.0, core::kPi, 2.0, -1.0}), kinetic + potential, 1e-13);
}

TEST(AcrobotDynamicsForms, StopsAtTheGoalAndSaysSo) {
  const AcrobotDynamics dynamics;
  One::State state{2.0, 0.0, 2.0, 0.0};
  EXPECT_TRUE(dynamics.integrate<One>(state, 0.0, 9.0, 15.0, true));
  EXPECT_GE(dynamics.tip_height(One::angles(state)), 1.5);
  One::State still{2.0, 0.0, 2.0, 0.0};
  EXPECT_FALSE(dynamics.integrate<One>(still, 0.0, 9.0, 15.0, false));
  EXPECT_EQ(still, (One::State{2.0, 0.0, 2.0, 0.0}));
}

#if SDNN_LANES
TEST(AcrobotDynamicsForms, KeepTheirBits) {
  for (const auto goal_test : {GoalTest::every_step, GoalTest::decision_instant}) {
    const AcrobotConfig config{.goal_test = goal_test};
    const AcrobotDynamics dynamics(config);
    core::Random random(3, core::Stream::exploration);
    int n_goals = 0;
    for (int i = 0; i < 2000; ++i) {
      One::State one;
      for (double& value : one) value = 6.0 * random.uniform() - 3.0;
      PairedForm::State paired{core::Lanes<2>::load(one.data()),
                               core::Lanes<2>::load(one.data() + 2)};
      const double torque = 20.0 * random.uniform() - 10.0, limit = 15.0 * random.uniform();
      const bool goal = dynamics.integrate<One>(one, torque, limit, limit, true);
      EXPECT_EQ(goal, (dynamics.integrate<PairedForm>(paired, torque, limit, limit, true)));
      One::State other;
      paired[0].store(other.data());
      paired[1].store(other.data() + 2);
      ASSERT_EQ(one, other);
      n_goals += goal;
    }
    EXPECT_GT(n_goals, 10);
  }
}
#endif

}  // namespace
}  // namespace sdnn::environments
