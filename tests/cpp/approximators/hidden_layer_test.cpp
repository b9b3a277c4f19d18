#include "sdnn/approximators/hidden_layer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

/// Columns of an input, by sign.
struct Input {
  std::vector<std::uint32_t> plus, minus;

  operator coding::SignedColumns() const { return {plus, minus}; }
};

/// A quarter of the columns is +1, a quarter is -1.
Input random_input(std::size_t n_columns, core::Random& random) {
  Input input;
  for (std::uint32_t j = 0; j < n_columns; ++j) {
    const auto drawn = random.below(4);
    if (drawn == 0) input.plus.push_back(j);
    if (drawn == 1) input.minus.push_back(j);
  }
  return input;
}

std::vector<std::int32_t> potentials(const HiddenLayer& layer, const Input& input) {
  std::vector<std::int32_t> h(layer.n_units());
  layer.potentials(input, h);
  return h;
}

TEST(HiddenLayer, PotentialsAndCorrectionsAreAsWorkedByHand) {
  HiddenLayer layer(/*n_units=*/2, /*n_columns=*/3);
  layer.set_weight(0, 0, 2);
  layer.set_weight(0, 2, -1);
  layer.set_weight(1, 1, 5);
  layer.set_threshold(1, 4);
  const Input x{.plus = {0}, .minus = {2}};
  EXPECT_EQ(potentials(layer, x), (std::vector<std::int32_t>{2 + 1, -4}));
  layer.update(std::vector<std::uint32_t>{1}, x, 1);  // potential 1 rises by |x|^2 + 1 = 3
  EXPECT_EQ(potentials(layer, x), (std::vector<std::int32_t>{3, -1}));
  EXPECT_EQ(layer.weight(1, 0), 1);
  EXPECT_EQ(layer.weight(1, 1), 5);
  EXPECT_EQ(layer.weight(1, 2), -1);
  EXPECT_EQ(layer.threshold(1), 3);
}

// Random problems of many shapes, with weights on both sides of one byte, against plain sums.
TEST(HiddenLayer, PotentialsEqualPlainSumsOnRandomProblems) {
  core::Random random(11, core::Stream::weights);
  std::size_t n_high_bytes = 0;
  for (int problem = 0; problem < 60; ++problem) {
    const std::size_t n = 1 + random.below(problem % 10 == 0 ? 2500 : 200);
    const std::size_t columns = 1 + random.below(700);
    const std::int32_t largest = problem % 3 == 0 ? 3000 : 127;
    HiddenLayer layer(n, columns);
    for (std::size_t i = 0; i < n; ++i) {
      layer.set_threshold(i, static_cast<std::int32_t>(random.below(1000)) - 500);
      for (std::size_t j = 0; j < columns; ++j) {
        if (largest > 127 && random.below(50) != 0) continue;  // only some weights are large
        const auto drawn = random.below(static_cast<std::uint64_t>(2 * largest + 1));
        layer.set_weight(i, j, static_cast<std::int32_t>(drawn) - largest);
      }
    }
    if (largest == 127) {
      EXPECT_EQ(layer.n_high_bytes(), 0U);
    }
    n_high_bytes += layer.n_high_bytes();
    const Input x = random_input(columns, random);
    std::vector<std::int32_t> expected(n);
    for (std::size_t i = 0; i < n; ++i) {
      expected[i] = -layer.threshold(i);
      for (const auto j : x.plus) expected[i] += layer.weight(i, j);
      for (const auto j : x.minus) expected[i] -= layer.weight(i, j);
    }
    EXPECT_EQ(potentials(layer, x), expected);

    // A column may come twice.
    const auto last = static_cast<std::uint32_t>(columns - 1);
    const Input few{.plus = {0, 0}, .minus = {last}};
    for (std::size_t i = 0; i < n; ++i) {
      expected[i] = -layer.threshold(i) + 2 * layer.weight(i, 0) - layer.weight(i, last);
    }
    EXPECT_EQ(potentials(layer, few), expected);
  }
  EXPECT_GT(n_high_bytes, 1000U);  // weights of two bytes were among the problems
}

// Weights beyond [-127, 127] have a second byte: two have one at +-500, and none again at 0.
TEST(HiddenLayer, AWeightBeyondAByteHasAHighByte) {
  HiddenLayer layer(3, 2);
  const Input x{.plus = {0}, .minus = {1}};
  const std::vector<std::uint32_t> unit = {2};
  for (int i = 1; i <= 500; ++i) {
    layer.update(unit, x, 1);
    ASSERT_EQ(layer.weight(2, 0), i);
    ASSERT_EQ(layer.weight(2, 1), -i);
    ASSERT_EQ(layer.threshold(2), -i);
    ASSERT_EQ(potentials(layer, x), (std::vector<std::int32_t>{0, 0, i - (-i) - (-i)}));
  }
  EXPECT_EQ(layer.n_high_bytes(), 2U);
  for (int i = 500; i > 0; --i) layer.update(unit, x, -1);
  EXPECT_EQ(layer.weight(2, 0), 0);
  EXPECT_EQ(layer.n_high_bytes(), 0U);
  for (int i = 0; i > -500; --i) layer.update(unit, x, -1);
  EXPECT_EQ(layer.weight(2, 0), -500);
  EXPECT_EQ(layer.weight(0, 0), 0);
}

// A high byte is the second byte of a weight beyond [-127, 127]. A pass reads only the columns that
// have one if a block of units has few of them, else all columns.
TEST(HiddenLayer, FewAndManyHighBytesGiveTheSameSums) {
  HiddenLayer layer(/*n_units=*/130, /*n_columns=*/1000);
  for (std::size_t j = 0; j < 1000; j += 3) layer.set_weight(7, j, j % 2 == 0 ? 5000 : -5000);
  layer.set_weight(100, 6, 200);
  layer.set_weight(100, 7, -128);
  EXPECT_EQ(layer.n_high_bytes(), 334U + 2U);  // columns 0, 3 to 999 of unit 7; 6 and 7 of unit 100
  Input x{.plus = {0, 3, 6, 6, 999}, .minus = {1, 7, 9}};
  const auto h = potentials(layer, x);
  EXPECT_EQ(h[7], 5000 - 5000 + 2 * 5000 - 5000 + 5000);
  EXPECT_EQ(h[100], 2 * 200 + 128);
  EXPECT_EQ(h[0], 0);
}

// Corrections of a unit by +x and -x in turns never need a second byte, however many they are.
TEST(HiddenLayer, CorrectionsThatCancelStayInAByte) {
  HiddenLayer layer(70, 5);
  const Input x{.plus = {0, 3}, .minus = {4}};
  const std::vector<std::uint32_t> unit = {69};
  for (int i = 0; i < 2000; ++i) layer.update(unit, x, i % 2 == 0 ? 1 : -1);
  EXPECT_EQ(layer.n_high_bytes(), 0U);
  EXPECT_EQ(layer.weight(69, 3), 0);
}

// The first ten columns are double: corrections count twice there.
TEST(HiddenLayer, CorrectionsEqualPlainOnesAtAnySizeOfWeights) {
  constexpr std::size_t kUnits = 130;
  constexpr std::uint32_t kColumns = 40, kDouble = 10;
  HiddenLayer layer(kUnits, kColumns, kDouble);
  std::vector<std::array<std::int32_t, kColumns>> weights(kUnits);
  std::vector<std::int32_t> expected(kUnits);
  core::Random random(3, core::Stream::weights);
  for (int round = 0; round < 6000; ++round) {
    const Input x = random_input(kColumns, random);
    std::vector<std::uint32_t> units;
    for (std::uint32_t unit = 0; unit < kUnits; ++unit) {
      if (random.below(20) == 0) units.push_back(unit);
    }
    const auto step = static_cast<std::int32_t>(random.below(13)) - 6;
    layer.update(units, x, step);
    for (const std::uint32_t unit : units) {
      for (const auto j : x.plus) weights[unit][j] += j < kDouble ? 2 * step : step;
      for (const auto j : x.minus) weights[unit][j] -= j < kDouble ? 2 * step : step;
    }
    if (round % 50 != 0) continue;
    for (std::size_t unit = 0; unit < kUnits; ++unit) {
      expected[unit] = -layer.threshold(unit);
      for (const auto j : x.plus) expected[unit] += weights[unit][j];
      for (const auto j : x.minus) expected[unit] -= weights[unit][j];
    }
    ASSERT_EQ(potentials(layer, x), expected) << "round " << round;
  }
  EXPECT_GT(layer.n_high_bytes(), 0U);
  EXPECT_LT(layer.n_high_bytes(), kUnits * kColumns);
}

// The stored bound of a unit's weights grows with every correction; when it reaches the limit of a
// byte it is computed anew from the weights.
TEST(HiddenLayer, AWeightNearTheLimitOfAByteKeepsItsValueOverManyCorrections) {
  HiddenLayer layer(1, 2);
  const Input x{.plus = {0}, .minus = {}};
  const std::vector<std::uint32_t> unit = {0};
  for (int i = 0; i < 200; ++i) layer.update(unit, x, 1);
  for (int i = 0; i < 100; ++i) layer.update(unit, x, -1);
  for (int i = 0; i < 10000; ++i) layer.update(unit, x, i % 2 == 0 ? 2 : -2);
  for (int i = 99; i >= -100; --i) {  // down from 200 - 100
    layer.update(unit, x, -1);
    ASSERT_EQ(layer.weight(0, 0), i);
  }
}

TEST(HiddenLayer, RefusesWeightsBeyondTheLimitAndChangesNothing) {
  HiddenLayer layer(2, 2);
  const Input x{.plus = {0}, .minus = {}};
  static_assert(HiddenLayer::kWeightLimit == 16383);
  layer.set_weight(1, 0, 16382);
  const std::vector<std::uint32_t> both = {0, 1};
  layer.update(both, x, 1);
  EXPECT_EQ(layer.weight(1, 0), 16383);
  EXPECT_THROW(layer.update(both, x, 1), std::overflow_error);
  EXPECT_EQ(layer.weight(1, 0), 16383);
  EXPECT_EQ(layer.weight(0, 0), 1);
  EXPECT_EQ(layer.threshold(0), -1);
  layer.update(both, x, -1);  // going back is possible
  EXPECT_EQ(layer.weight(1, 0), 16382);
}

TEST(HiddenLayer, ManyColumnsLowerTheWeightLimitSoThatPotentialsFit) {
  const HiddenLayer layer(1, std::size_t{1} << 20);
  EXPECT_EQ(layer.weight_limit(), 1023);  // 2^20 * 1023 < 2^30
}

TEST(HiddenLayer, AddingToAColumnEqualsSettingItsWeights) {
  HiddenLayer added(130, 3), set(130, 3);
  core::Random random(5, core::Stream::weights);
  std::vector<std::int32_t> changes(130);
  for (int round = 0; round < 40; ++round) {
    const auto column = static_cast<std::size_t>(round % 3);
    const int sign = round % 2 == 0 ? 1 : -1;
    for (std::int32_t& change : changes) {
      change = static_cast<std::int32_t>(random.below(round < 20 ? 9 : 90)) - 4;
    }
    added.add_to_column(column, changes, sign);
    for (std::size_t unit = 0; unit < changes.size(); ++unit) {
      set.set_weight(unit, column, set.weight(unit, column) + sign * changes[unit]);
    }
  }
  const Input x{.plus = {0, 2}, .minus = {1}};
  EXPECT_EQ(potentials(added, x), potentials(set, x));
  EXPECT_EQ(added.n_high_bytes(), set.n_high_bytes());
  EXPECT_GT(added.n_high_bytes(), 0U);
  std::fill(changes.begin(), changes.end(), 40000);  // beyond the limit of a weight
  EXPECT_THROW(added.add_to_column(0, changes, 1), std::invalid_argument);
}

// Sizes are units, columns, and columns in which corrections count twice. Weights are 16383 in size
// at most, thresholds less than 2^30.
TEST(HiddenLayer, RefusesBadSizesAndWeights) {
  EXPECT_THROW(HiddenLayer(0, 1), std::invalid_argument);
  EXPECT_THROW(HiddenLayer(1, 0), std::invalid_argument);
  EXPECT_THROW(HiddenLayer(1, 3, 4), std::invalid_argument);
  HiddenLayer layer(1, 1);
  EXPECT_THROW(layer.set_weight(0, 0, 40000), std::invalid_argument);
  EXPECT_THROW(layer.set_threshold(0, INT32_MAX), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::approximators
