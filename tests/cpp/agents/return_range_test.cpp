#include "sdnn/agents/return_range.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

void expect_range(const ReturnRange& range, double low, double high) {
  EXPECT_EQ(range.low(), low);
  EXPECT_EQ(range.high(), high);
}

// gamma = 1/2: every number is exact.
TEST(ReturnRange, GrowsByAQuarterMoreThanItMust) {
  ReturnRange range(0.5);
  double sum = 0.0;
  EXPECT_FALSE(range.is_known());
  EXPECT_FALSE(range.note(0.0, sum));
  EXPECT_FALSE(range.is_known());
  EXPECT_TRUE(range.note(8.0, sum));  // 8 + 8 / 4
  EXPECT_TRUE(range.is_known());
  expect_range(range, 0.0, 10.0);
  EXPECT_FALSE(range.note(2.0, sum));  // 2 + 8 / 2 = 6
  EXPECT_FALSE(range.note(7.0, sum));  // 7 + 6 / 2 = 10, still inside
  EXPECT_TRUE(range.note(8.0, sum));   // 8 + 10 / 2 = 13, and 13 / 4
  expect_range(range, 0.0, 16.25);
  EXPECT_TRUE(range.note(-20.0, sum));  // -20 + 13 / 2 = -13.5, and (16.25 + 13.5) / 4
  expect_range(range, -20.9375, 16.25);
}

TEST(ReturnRange, OfPunishmentsBeginsWithThem) {
  ReturnRange range(1.0);
  double sum = 0.0;
  EXPECT_TRUE(range.note(-4.0, sum));
  EXPECT_TRUE(range.is_known());
  expect_range(range, -5.0, 0.0);
}

TEST(ReturnRange, HoldsTheSumsOfSeveralEpisodes) {
  ReturnRange range(1.0);
  double sum = 0.0, other = 0.0;
  EXPECT_TRUE(range.note(8.0, sum));
  EXPECT_FALSE(range.note(9.0, other));  // 17 if it were the same episode
  expect_range(range, 0.0, 10.0);
}

TEST(ReturnRange, HoldsEverySumAndGrowsRarely) {
  ReturnRange range(0.9);
  core::Random random(1, core::Stream::weights);
  double sum = 0.0, expected = 0.0;
  int n_grown = 0;
  for (int i = 0; i < 10000; ++i) {
    const double reward = std::exp(10.0 * random.uniform()) - 100.0;
    expected = reward + 0.9 * expected;
    n_grown += range.note(reward, sum);
    ASSERT_EQ(sum, expected);
    ASSERT_LE(range.low(), sum);
    ASSERT_GE(range.high(), sum);
  }
  EXPECT_LT(n_grown, 60);
}

TEST(ReturnRange, StaysFinite) {
  ReturnRange range(1.0);
  double sum = 0.0;
  for (int i = 0; i < 5000; ++i) {
    range.note(std::numeric_limits<double>::max() * (i / 7 % 2 == 0 ? 1.0 : -1.0), sum);
    ASSERT_TRUE(ReturnRange::is_sum(sum));
  }
  EXPECT_LT(range.high(), 1.7e300);
  EXPECT_GT(range.low(), -1.7e300);
  ReturnRange other(1.0);
  core::restore(other, core::state_of(range));  // what came of it may be saved
  EXPECT_EQ(core::state_of(other), core::state_of(range));
}

TEST(ReturnRange, RefusesWhatIsNoRange) {
  ReturnRange range(0.5);
  double sum = 0.0;
  range.note(8.0, sum);
  testing::expect_that_damage_is_refused(range);
  const core::State good = core::state_of(range);
  for (const double bad : {testing::kNaN, testing::kInfinity, -testing::kInfinity}) {
    EXPECT_FALSE(ReturnRange::is_sum(bad));
    for (const char* name : {"low", "high"}) {
      testing::expect_refused(range, testing::with_number(good, name, bad),
                              std::string("state: ") + name + " must be ");
    }
  }
  testing::expect_refused(range, testing::with_number(good, "low", 1.0), "state: low must be ");
  testing::expect_refused(range, testing::with_number(good, "high", -1.0), "state: high must be ");
}

}  // namespace
}  // namespace sdnn::agents
