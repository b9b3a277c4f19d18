#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "sdnn/environments/detail/acrobot_dynamics.hpp"

namespace {

using sdnn::environments::runge_kutta_step;

// y' = y from 1 with step h = 0.1: 1 + h + h^2/2 + h^3/6 + h^4/24.
TEST(RungeKutta, GivesTheTaylorPolynomialOfTheExponential) {
  const auto slope = [](const std::array<double, 1>& y) { return y; };
  const std::array<double, 1> start{1.0};
  const auto end = runge_kutta_step(slope, start, slope(start), 0.1);
  EXPECT_NEAR(end[0], 1.0 + 0.1 + 0.01 / 2 + 0.001 / 6 + 0.0001 / 24, 3e-16);
}

// Simpson's rule for y' = t^3, with t as the other component: exact.
TEST(RungeKutta, IntegratesCubicsExactly) {
  const auto slope = [](const std::array<double, 2>& y) {
    return std::array<double, 2>{1.0, y[0] * y[0] * y[0]};
  };
  const std::array<double, 2> start{1.0, 0.0};
  const auto end = runge_kutta_step(slope, start, slope(start), 2.0);
  EXPECT_DOUBLE_EQ(end[0], 3.0);
  EXPECT_DOUBLE_EQ(end[1], (3.0 * 3.0 * 3.0 * 3.0 - 1.0) / 4.0);
}

TEST(RungeKutta, HasFourthOrder) {
  const auto slope = [](const std::array<double, 2>& y) {
    return std::array<double, 2>{y[1], -y[0]};
  };
  const auto error = [&slope](int n_steps) {
    std::array<double, 2> y{1.0, 0.0};
    for (int i = 0; i < n_steps; ++i) y = runge_kutta_step(slope, y, slope(y), 2.0 / n_steps);
    return std::hypot(y[0] - std::cos(2.0), y[1] + std::sin(2.0));
  };
  EXPECT_NEAR(std::log2(error(50) / error(100)), 4.0, 0.05);
}

}  // namespace
