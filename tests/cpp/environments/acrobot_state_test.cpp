#include "sdnn/environments/acrobot_state.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "states.hpp"

namespace {

using namespace sdnn::environments;
using sdnn::core::kPi;

TEST(WrapAngle, MapsToTheHalfOpenTurnAroundZero) {
  const double below_pi = std::nextafter(kPi, 0.0);
  for (const double inside : {0.0, 1.0, -1.0, below_pi, -below_pi, -kPi, 5e-324}) {
    EXPECT_EQ(wrap_angle(inside), inside);
  }
  EXPECT_EQ(wrap_angle(kPi), -kPi);
  EXPECT_EQ(wrap_angle(3.0 * kPi), -kPi);
  EXPECT_EQ(wrap_angle(2.0 * kPi), 0.0);
  EXPECT_DOUBLE_EQ(wrap_angle(4.0), 4.0 - 2.0 * kPi);
  EXPECT_DOUBLE_EQ(wrap_angle(-4.0), 2.0 * kPi - 4.0);
  for (double x = -500.0; x < 500.0; x += 0.37) {
    EXPECT_GE(wrap_angle(x), -kPi);
    EXPECT_LT(wrap_angle(x), kPi);
    EXPECT_NEAR(std::sin(wrap_angle(x)), std::sin(x), 1e-13);
  }
}

TEST(AcrobotState, WrapsItsAnglesOnly) {
  EXPECT_EQ(wrapped({3.0 * kPi, -2.0 * kPi, 7.0, -40.0}), (AcrobotState{-kPi, 0.0, 7.0, -40.0}));
  const AcrobotState inside{1.0, -3.0, 0.0, 1e300};
  EXPECT_EQ(wrapped(inside), inside);
}

TEST(AcrobotState, RefusesNaNAndInfinity) {
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (const double bad : {sdnn::testing::kNaN, -sdnn::testing::kInfinity}) {
      AcrobotState state = AcrobotState::Zero();
      state[i] = bad;
      EXPECT_THROW(wrapped(state), std::invalid_argument);
    }
  }
}

}  // namespace
