#include "sdnn/approximators/detail/weight_average.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn::approximators {
namespace {

double mean_weight(const WeightAverage& average, std::size_t unit, std::size_t column) {
  return average.weight(unit, column) / static_cast<double>(1 << average.fraction_bits());
}

// A snapshot every 2 corrections: after n of them it moves the average by 8 * 2 / n of the
// distance, at most all of it.
TEST(WeightAverage, SnapshotsAreAveragedAsWorkedByHand) {
  HiddenLayer layer(2, 3);
  WeightAverage average(layer, /*interval=*/2);
  const auto average_after = [&](std::uint64_t n, std::int32_t weight) {
    layer.set_weight(1, 2, weight);
    layer.set_threshold(0, -weight);
    average.note(n, layer);
    return mean_weight(average, 1, 2);
  };
  EXPECT_EQ(average_after(1, 8), 0);
  EXPECT_EQ(average.n_snapshots(), 0U);
  EXPECT_EQ(average_after(2, 8), 8);
  EXPECT_EQ(average_after(3, 100), 8);  // no snapshot
  EXPECT_EQ(average_after(4, 16), 16);
  EXPECT_EQ(average_after(16, 8), 8);  // 8 * 2 / 16: all of the distance
  EXPECT_EQ(average_after(32, 0), 4);  // half of it
  EXPECT_EQ(average.threshold(0), -4 * std::int64_t{1} << WeightAverage::kFractionBits);
  EXPECT_EQ(average_after(64, 0), 3);  // a quarter
  EXPECT_EQ(average.n_snapshots(), 5U);
  EXPECT_EQ(average.weight(0, 2), 0);
  EXPECT_EQ(average.fraction_bits(), 10);  // so that the largest weight, 16, fits in 15 bits
}

// Weights of one and two bytes, up to the largest; unit 69 is the last one of an incomplete block.
TEST(WeightAverage, AveragesWeightsOfAnySize) {
  constexpr std::int32_t kLimit = HiddenLayer::kWeightLimit;
  HiddenLayer layer(70, 4);
  for (const std::int32_t weight : {127, -127, 128, -4000, kLimit, -kLimit}) {
    layer.set_weight(69, 1, weight);
    layer.set_weight(3, 1, -weight);
    WeightAverage average(layer, 1);
    average.note(1, layer);
    const std::int32_t unit_weight = 1 << average.fraction_bits();
    EXPECT_LE(std::abs(weight) * unit_weight, 32767);  // 15 bits and a sign
    EXPECT_GT(std::abs(weight) * unit_weight, 16000);  // with another fraction bit it would not fit
    EXPECT_EQ(average.weight(69, 1), weight * unit_weight);
    EXPECT_EQ(average.weight(3, 1), -weight * unit_weight);
    layer.set_weight(69, 1, -weight);
    for (std::uint64_t n = 2; n < 4000; ++n) average.note(n, layer);
    // Late snapshots move the average by an eighth of the distance, which rounds to 0 below 4.
    EXPECT_NEAR(average.weight(69, 1), -weight * unit_weight, 4) << weight;
  }
}

// A weight alternates between 100 and -100, 700 corrections each. Its average is over about an
// eighth of all corrections, 2500, which leaves 100 * tanh(700 / (2 * 2500)) = 14 of the
// oscillation.
TEST(WeightAverage, AnOscillatingWeightAveragesToItsMiddle) {
  HiddenLayer layer(1, 1);
  WeightAverage average(layer, 10);
  for (std::uint64_t n = 1; n <= 20000; ++n) {
    layer.set_weight(0, 0, n / 700 % 2 == 0 ? 100 : -100);
    average.note(n, layer);
  }
  EXPECT_LT(std::abs(mean_weight(average, 0, 0)), 20);
  EXPECT_LT(average.n_snapshots(),
            64U + 64U * 4U);  // every 10 until 640, then every n / 64: 64 ln(20000 / 640)
}

// Snapshots are taken every 10 corrections; the first one after forget is the average.
TEST(WeightAverage, ForgetRestartsTheAverage) {
  HiddenLayer layer(1, 1);
  WeightAverage average(layer, 10);
  layer.set_weight(0, 0, 5);
  for (std::uint64_t n = 1; n <= 100; ++n) average.note(n, layer);
  average.forget(100);
  EXPECT_EQ(average.n_snapshots(), 0U);
  layer.set_weight(0, 0, 9);
  average.note(109, layer);
  EXPECT_EQ(average.n_snapshots(), 0U);
  average.note(110, layer);
  EXPECT_EQ(mean_weight(average, 0, 0), 9);
}

TEST(WeightAverage, RefusesInconsistentStates) {
  const HiddenLayer layer(2, 3);
  WeightAverage average(layer, 3);
  testing::expect_damaged_states_refused(average);
  const core::State good = core::state_of(average);
  testing::expect_refused(average, testing::with_number(good, "fraction_bits", 15, 0),
                          "state: fraction_bits must be in [1, 14]");
  testing::expect_refused(average,
                          testing::with_number(good, "thresholds", std::int64_t{1} << 50, 1),
                          "state: thresholds must be averages of thresholds");
}

}  // namespace
}  // namespace sdnn::approximators
