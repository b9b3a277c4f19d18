#include "sdnn/environments/acrobot.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "errors.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace {

using namespace sdnn::environments;
using sdnn::core::kPi;

using sdnn::testing::kInfinity;
using sdnn::testing::kNaN;

// step(torque, goal_tolerance): no speed is below a tolerance of 0, so the goal ends no episode.
TEST(AcrobotDynamics, KeepsItsEnergyWithoutTorque) {
  const AcrobotConfig config{.integration_step = 0.001};
  Acrobot acrobot(config);
  acrobot.set_state({1.0, -0.5, 1.5, -2.0});
  const double energy = acrobot.energy();
  for (int i = 0; i < 10; ++i) {
    acrobot.step(0.0, 0.0);
    EXPECT_NEAR(acrobot.energy(), energy, 1e-9);
  }
}

// Masses m, lengths l and moments of inertia I are 1, the centres of mass lc at 1/2:
// d22 = m2 lc2^2 + I2 = 1.25, d12 = d22 + m2 l1 lc2 cos(theta2) = 1.25 +- 0.5,
// d11 = m1 lc1^2 + m2 l1^2 + I1 + d12 +- 0.5 = 2.25 + d12 +- 0.5.
TEST(AcrobotDynamics, TheMassMatrixIsAsWorkedByHand) {
  EXPECT_EQ(Acrobot().mass_matrix(0.0), (Eigen::Matrix2d{{4.5, 1.75}, {1.75, 1.25}}));
  EXPECT_EQ(Acrobot().mass_matrix(kPi), (Eigen::Matrix2d{{2.5, 0.75}, {0.75, 1.25}}));
}

// M a + h + phi = (0, torque), with h and phi as printed by Spong.
TEST(AcrobotDynamics, AccelerationsSolveTheEquationOfMotion) {
  sdnn::core::Random random(2, sdnn::core::Stream::exploration);
  const AcrobotConfig config{.link_mass_2 = 1.5, .link_length_1 = 0.75, .center_of_mass_2 = 0.3};
  const Acrobot acrobot(config);
  const double coriolis = 1.5 * 0.75 * 0.3, g = 9.8;  // m2 l1 lc2
  for (int i = 0; i < 200; ++i) {
    AcrobotState state;
    for (double& value : state) value = 6.0 * random.uniform() - 3.0;
    const double torque = 20.0 * random.uniform() - 10.0;
    const double theta1 = state[0], theta2 = state[1], v1 = state[2], v2 = state[3];
    const double phi_2 = 1.5 * 0.3 * g * std::sin(theta1 + theta2);
    const Eigen::Vector2d h{-coriolis * std::sin(theta2) * (v2 * v2 + 2.0 * v2 * v1),
                            coriolis * std::sin(theta2) * v1 * v1};
    const Eigen::Vector2d phi{(0.5 + 1.5 * 0.75) * g * std::sin(theta1) + phi_2, phi_2};
    const AcrobotState slope = acrobot.derivative(state, torque);
    EXPECT_EQ(slope.head<2>(), state.tail<2>());
    const Eigen::Vector2d torques = acrobot.mass_matrix(theta2) * slope.tail<2>() + h + phi;
    EXPECT_NEAR(torques[0], 0.0, 1e-12);
    EXPECT_NEAR(torques[1], torque, 1e-12);
  }
}

// Power is torque times theta2_dot: the energy won over a short time.
TEST(AcrobotDynamics, GainsTheWorkOfTheTorque) {
  AcrobotConfig config;
  config.decision_interval = config.integration_step = 1e-4;
  Acrobot acrobot(config);
  acrobot.set_state({0.4, 0.9, -1.0, 2.5});
  const double before = acrobot.energy(), angle = acrobot.state()[1];
  acrobot.step(7.0, 0.0);
  EXPECT_NEAR(acrobot.energy() - before, 7.0 * (acrobot.state()[1] - angle), 1e-12);
}

TEST(AcrobotDynamics, AMirroredTorqueGivesAMirroredState) {
  Acrobot left, right;
  for (const double torque : {3.0, -10.0, 7.5, 0.25}) {
    left.step(torque, 0.0);
    right.step(-torque, 0.0);
    EXPECT_EQ(left.state(), -right.state());
  }
}

// The digest was recorded once; the bits are the same with every compiler and optimization level.
TEST(AcrobotDynamics, KeepsItsBits) {
  Acrobot acrobot;
  sdnn::core::Random random(1, sdnn::core::Stream::exploration);
  std::uint64_t digest = 0;
  for (int episode = 0; episode < 20; ++episode) {
    acrobot.reset();
    for (int i = 0; i < 50; ++i) {
      acrobot.step(20.0 * random.uniform() - 10.0, 0.0);
      for (const double value : acrobot.state()) {
        digest = digest * 31 + std::bit_cast<std::uint64_t>(value);
      }
    }
  }
  EXPECT_EQ(digest, 12301352983019598016u);
}

/// The reward of a decision without torque that begins at a state.
double reward_from(const AcrobotState& state, const AcrobotConfig& config) {
  Acrobot acrobot(config);
  acrobot.set_state(state);
  return acrobot.step(0.0, 1.0).reward;
}

// A decision ends after a second. Below 5 degrees, 0.087 rad, the acrobot counts as resting.
TEST(AcrobotTask, PenalizesRestingAtTheDecisionInstant) {
  AcrobotConfig config;
  config.gravity = 0.0;      // drifts at constant speed
  config.goal_height = 3.0;  // out of reach
  EXPECT_EQ(reward_from({0.0, 0.0, 0.0, 0.0}, config), -5.0);
  EXPECT_EQ(reward_from({0.2, 0.0, -0.2, 0.0}, config), -5.0);  // arrives at 0
  EXPECT_EQ(reward_from({-0.1, 0.0, 0.2, 0.0}, config), 0.0);   // passes 0, arrives at 0.1
  config.idle_angle = 0.0;
  EXPECT_EQ(reward_from({0.0, 0.0, 0.0, 0.0}, config), 0.0);
  config.idle_angle = kPi / 5.0;  // 0.628
  EXPECT_EQ(reward_from({0.6, 0.0, 0.0, 0.0}, config), -5.0);
  EXPECT_EQ(reward_from({0.7, 0.0, 0.0, 0.0}, config), 0.0);
}

TEST(AcrobotTask, PenalizesHighSpeedWithoutEndingTheEpisode) {
  AcrobotConfig config{.gravity = 0.0, .goal_height = 3.0};
  Acrobot acrobot(config);
  acrobot.set_state({1.0, 0.0, 9.5, 0.0});  // above the limit of 3 pi = 9.42
  const auto result = acrobot.step(0.0, 1.0);
  EXPECT_EQ(result.reward, -5.0);
  EXPECT_FALSE(result.terminated || result.truncated);
  config.goal_velocity_1 = 1e6;  // leaves the limit of joint 2, 5 pi
  Acrobot fast(config);
  fast.set_state({1.0, 0.0, -2.0, 40.0});
  const double reward = fast.step(0.0, 1.0).reward;
  EXPECT_GT(std::abs(fast.state()[3]), 5.0 * kPi);
  EXPECT_EQ(reward, -5.0);
  config.goal_velocity_2 = std::abs(fast.state()[3]);  // the limit itself is allowed
  EXPECT_EQ(reward_from({1.0, 0.0, -2.0, 40.0}, config), 0.0);
}

// The straight arm swings upwards and passes the goal height of 1.5 m; step(torque, tolerance).
TEST(AcrobotTask, EndsAtTheInstantTheGoalIsReached) {
  Acrobot acrobot;
  acrobot.set_state({2.0, 0.0, 2.0, 0.0});
  EXPECT_LT(acrobot.tip_height(), 1.5);
  const auto result = acrobot.step(0.0, 1.0);
  EXPECT_EQ(result.reward, 10.0);
  EXPECT_TRUE(result.terminated);
  EXPECT_FALSE(result.truncated);
  EXPECT_EQ(acrobot.decisions(), 1);
  EXPECT_GE(acrobot.tip_height(), 1.5);
  EXPECT_LT(acrobot.tip_height(), 1.5 + 0.02 * 2.0 * 5.0);  // 0.02 s, 2 m, less than 5 rad/s
  EXPECT_THROW(acrobot.step(0.0, 1.0), std::logic_error);
  acrobot.reset();
  EXPECT_NO_THROW(acrobot.step(0.0, 1.0));
}

// The arm that swings upwards passes 1.5 m during the decision, but is at 0.87 m at its end.
TEST(AcrobotTask, MayTestTheGoalAtDecisionsOnly) {
  const AcrobotConfig config{.goal_test = GoalTest::decision_instant};
  Acrobot acrobot(config);
  acrobot.set_state({2.0, 0.0, 2.0, 0.0});
  const auto result = acrobot.step(0.0, 1.0);
  EXPECT_EQ(result.terminated, acrobot.tip_height() >= 1.5);
  acrobot.set_state({kPi - 0.01, 0.0, 0.0, 0.0});  // still up after a second
  EXPECT_TRUE(acrobot.step(0.0, 1.0).terminated);
}

// The limits are 3 pi and 5 pi rad/s, times the goal tolerance; a joint has 1 rad/s or none. The
// tip is high enough all the time: with theta1 = 3 the straight arm is nearly upright, at 1.98 m.
TEST(AcrobotTask, TheGoalNeedsSpeedsBelowTheScaledLimits) {
  const auto ends = [](const AcrobotState& start, double goal_tolerance) {
    const AcrobotConfig config{.gravity = 0.0, .decision_interval = 0.02};
    Acrobot acrobot(config);
    acrobot.set_state(start);
    return acrobot.step(0.0, goal_tolerance).terminated;
  };
  EXPECT_TRUE(ends({3.0, 0.0, 1.0, 0.0}, 1.0 / (3.0 * kPi) * 1.01));
  EXPECT_FALSE(ends({3.0, 0.0, 1.0, 0.0}, 1.0 / (3.0 * kPi) * 0.99));
  EXPECT_TRUE(ends({3.0, 0.0, 0.0, 1.0}, 0.5));    // 1 < 0.5 * 5 pi
  EXPECT_FALSE(ends({3.0, 0.0, 0.0, 1.0}, 0.05));  // 1 > 0.05 * 5 pi
  EXPECT_FALSE(ends({3.0, 0.0, 0.0, 0.0}, 0.0));   // no speed is below 0
}

// Hanging at rest is penalized, up to the limit of 50 decisions.
TEST(AcrobotTask, TruncatesAfterTheLastDecision) {
  Acrobot acrobot;
  for (int i = 1; i < 50; ++i) EXPECT_FALSE(acrobot.step(0.0, 1.0).truncated);
  const auto last = acrobot.step(0.0, 1.0);
  EXPECT_TRUE(last.truncated);
  EXPECT_FALSE(last.terminated);
  EXPECT_EQ(last.reward, -5.0);
  EXPECT_EQ(acrobot.decisions(), 50);
  EXPECT_THROW(acrobot.step(0.0, 1.0), std::logic_error);
}

TEST(AcrobotTask, RefusesIntegrationStepsThatDoNotDivideTheDecisionInterval) {
  for (const double bad : {0.03, 0.7, 2.0, 1e-7}) {  // of 1 s; steps of 1e-7 s would be too many
    EXPECT_THROW(Acrobot({.integration_step = bad}), std::invalid_argument) << bad;
  }
}

TEST(AcrobotTask, RefusesBadTorquesTolerancesAndStates) {
  Acrobot acrobot;
  for (const double bad : {kNaN, kInfinity, -kInfinity, 10.0001, -10.0001}) {
    EXPECT_THROW(acrobot.step(bad, 1.0), std::invalid_argument) << bad;
    EXPECT_EQ(acrobot.decisions(), 0);
  }
  for (const double bad : {kNaN, -0.1}) EXPECT_THROW(acrobot.step(0.0, bad), std::invalid_argument);
  EXPECT_THROW(acrobot.set_state({0.0, kNaN, 0.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(acrobot.set_state({0.0, 0.0, kInfinity, 0.0}), std::invalid_argument);
  EXPECT_EQ(acrobot.state(), AcrobotState::Zero());
  EXPECT_EQ(sdnn::testing::message_of([&] { acrobot.step(kNaN, 1.0); }),
            "torque must be in [-10, 10], got nan");
}

TEST(AcrobotTask, RefusesSpeedsThatBreakTheIntegration) {
  Acrobot acrobot;
  acrobot.set_state({0.0, 0.0, 1e300, 0.0});
  EXPECT_THROW(acrobot.step(0.0, 1.0), std::overflow_error);
  EXPECT_THROW(acrobot.step(0.0, 1.0), std::logic_error);  // the episode is over
  acrobot.reset();
  EXPECT_NO_THROW(acrobot.step(0.0, 1.0));
}

}  // namespace
