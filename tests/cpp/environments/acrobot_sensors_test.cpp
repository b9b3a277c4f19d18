#include "sdnn/environments/acrobot_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "states.hpp"

namespace {

using namespace sdnn::environments;
using sdnn::core::kPi;
using sdnn::core::Stream;

std::vector<double> observe(AcrobotSensors& sensors, const AcrobotState& state) {
  std::vector<double> out(sensors.n_inputs());
  sensors.observe(state, out);
  return out;
}

/// The first observation of new sensors.
std::vector<double> observe(const SensorConfig& config, const AcrobotState& state) {
  AcrobotSensors sensors(config, 1, Stream::sensor_noise);
  return observe(sensors, state);
}

TEST(AcrobotSensors, AreNormalizedAsWorkedByHand) {
  const auto rest = observe({.n_sensors = 6}, {0.0, 0.0, 0.0, 0.0});
  EXPECT_EQ(rest, (std::vector<double>{0.5, 0.5, 0.5, 0.5, 0.0, 0.0}));
  const auto observation =
      observe({.n_sensors = 6}, {kPi / 2.0, -kPi / 2.0, 1.5 * kPi, -2.5 * kPi});
  // Angles (x + pi) / (2 pi); speeds (v / limit + 1) / 2 with the limits 3 pi and 5 pi.
  EXPECT_DOUBLE_EQ(observation[0], 0.75);
  EXPECT_DOUBLE_EQ(observation[1], 0.25);
  EXPECT_DOUBLE_EQ(observation[2], 0.75);
  EXPECT_DOUBLE_EQ(observation[3], 0.25);
  EXPECT_DOUBLE_EQ(observation[4], 0.25);  // speeds: 2 ((3/4 - 1/2)^2 + (1/4 - 1/2)^2)
  EXPECT_DOUBLE_EQ(observation[5], 0.25);  // tip 1 m below joint 1: (2 - 0 - 1) / 4
  // Upright at -pi, which is the lower end of the angle, and with speeds beyond both limits.
  const auto up = observe({.n_sensors = 6}, {-kPi, 0.0, 100.0, -100.0});
  EXPECT_EQ(up, (std::vector<double>{0.0, 0.5, 1.0, 0.0, 1.0, 1.0}));
}

TEST(AcrobotSensors, HeightIsTheNormalizedTipHeight) {
  for (double theta1 = -3.0; theta1 < 3.1; theta1 += 0.5) {
    for (double theta2 = -3.0; theta2 < 3.1; theta2 += 0.5) {
      const auto observation = observe({.n_sensors = 6}, {theta1, theta2, 0.0, 0.0});
      const double tip = -std::cos(theta1) - std::cos(theta1 + theta2);
      EXPECT_NEAR(observation[5], (tip + 2.0) / 4.0, 1e-15);
    }
  }
}

TEST(AcrobotSensors, AnglesJustBelowPiAreBelowOne) {
  const double below_pi = std::nextafter(kPi, 0.0);
  const auto observation = observe({.n_sensors = 4}, {below_pi, below_pi, 0.0, 0.0});
  EXPECT_LT(observation[0], 1.0);
  EXPECT_LT(observation[1], 1.0);
}

TEST(UnitInterval, WrappedNumbersKeepTheirFractionAndSaturatedOnesStopAtItsEnds) {
  EXPECT_EQ(wrap_to_unit(-1e-20), 0.0);  // 1 - 1e-20 is rounded to 1, which is 0 on the circle
  EXPECT_EQ(wrap_to_unit(1.0), 0.0);
  EXPECT_EQ(wrap_to_unit(-0.25), 0.75);
  EXPECT_EQ(wrap_to_unit(2.5), 0.5);
  EXPECT_EQ(saturate_to_unit(-0.25), 0.0);
  EXPECT_EQ(saturate_to_unit(2.5), 1.0);
}

TEST(AcrobotSensors, NoiseIsOneNormalNumberPerSensorInOrder) {
  const AcrobotState state{0.3, -1.0, 2.0, -3.0};
  const auto clean = observe({.n_sensors = 6}, state);
  AcrobotSensors sensors({.n_sensors = 6, .noise = 0.001}, 42, Stream::sensor_noise);
  sdnn::core::Random random(42, Stream::sensor_noise);
  for (int i = 0; i < 10; ++i) {
    const auto noisy = observe(sensors, state);
    for (std::size_t j = 0; j < 6; ++j) EXPECT_EQ(noisy[j], clean[j] + 0.001 * random.normal());
  }
}

// The angle is -pi, where 0 and 1 meet; the speeds are beyond both limits, at 1 and at 0. Half of
// the noise is negative, so it wraps or is clipped in about 1,000 of 2,000 observations.
TEST(AcrobotSensors, NoiseWrapsAnglesAndClipsOtherSensors) {
  AcrobotSensors sensors({.n_sensors = 6, .noise = 0.02}, 8, Stream::sensor_noise);
  int low = 0, high = 0, floor = 0, ceiling = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto observation = observe(sensors, {-kPi, 0.0, 100.0, -100.0});
    for (const double value : observation) {
      EXPECT_GE(value, 0.0);
      EXPECT_LE(value, 1.0);
    }
    EXPECT_LT(observation[0], 1.0);
    low += observation[0] < 0.5;
    high += observation[0] > 0.5;
    ceiling += observation[2] == 1.0;
    floor += observation[3] == 0.0;
  }
  for (const int n : {low, high, ceiling, floor}) EXPECT_GT(n, 850);
}

TEST(AcrobotSensors, NoiseMayEnterBeforeRedundantVariablesAreComputed) {
  const AcrobotState state{0.3, -1.0, 2.0, -3.0};
  AcrobotSensors basic({.n_sensors = 4, .noise = 0.02}, 42, Stream::sensor_noise);
  AcrobotSensors all({.n_sensors = 6, .noise = 0.02, .noise_entry = NoiseEntry::basic_sensors}, 42,
                     Stream::sensor_noise);
  for (int i = 0; i < 10; ++i) {
    const auto noisy = observe(basic, state);
    const auto observation = observe(all, state);
    for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(observation[j], noisy[j]);
    EXPECT_EQ(observation[4], energy_sensor(noisy[2], noisy[3]));
    EXPECT_EQ(observation[5], height_sensor(noisy[0], noisy[1]));
  }
}

TEST(AcrobotSensors, ConstantAndRandomInputsAreAppendedWithoutChangingOthers) {
  const AcrobotState state{0.3, -1.0, 2.0, -3.0};
  AcrobotSensors without({.n_sensors = 5, .noise = 0.02}, 42, Stream::sensor_noise);
  AcrobotSensors clean({.n_sensors = 4, .n_constant = 2, .n_random = 1}, 42, Stream::sensor_noise);
  AcrobotSensors random_only({.n_sensors = 5, .noise = 0.02, .n_random = 2}, 42,
                             Stream::sensor_noise);
  double last = -1.0;
  for (int i = 0; i < 10; ++i) {
    const auto observation = observe(clean, state);
    ASSERT_EQ(observation.size(), 7U);
    EXPECT_EQ(observation[4], 0.5);
    EXPECT_EQ(observation[5], 0.5);
    EXPECT_NE(observation[6], last);
    last = observation[6];
    const auto expected = observe(without, state);
    const auto noisy = observe(random_only, state);
    for (std::size_t j = 0; j < 5; ++j) EXPECT_EQ(noisy[j], expected[j]);
  }
  AcrobotSensors constant({.n_sensors = 4, .noise = 0.02, .n_constant = 1}, 42,
                          Stream::sensor_noise);
  EXPECT_NE(observe(constant, state)[4], 0.5);  // a constant input has noise, too
}

TEST(SensorNoise, RefusesNegativeAndNonFiniteSizes) {
  for (const double bad : {-0.1, std::nan(""), sdnn::testing::kInfinity}) {
    EXPECT_THROW(SensorNoise(bad, {SensorEdge::wrap}, 1, Stream::sensor_noise),
                 std::invalid_argument);
  }
}

}  // namespace
