#include "sdnn/approximators/output_scale.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace sdnn::approximators {
namespace {

/// From 20 to 280 of 300 firing units stand for values from -20 to 20.
const OutputScale kPaper(20, 280, -20.0, 20.0);

// g(u) = (2u - 300) / 13 for 20 <= u <= 280.
TEST(OutputScale, MapsCountsToValuesAsInThePaper) {
  EXPECT_EQ(kPaper(150), 0.0);
  EXPECT_EQ(kPaper(280), 20.0);
  EXPECT_EQ(kPaper(20), -20.0);
  EXPECT_EQ(kPaper(300), 20.0);
  EXPECT_EQ(kPaper(0), -20.0);
  for (int u = 20; u <= 280; ++u) EXPECT_EQ(kPaper(u), (2 * u - 300) / 13.0);
}

TEST(OutputScale, TheInverseReturnsEveryCountWithinTheLimits) {
  for (int u = 20; u <= 280; ++u) EXPECT_EQ(kPaper.inverse(kPaper(u)), u);
  EXPECT_EQ(kPaper.inverse(1e9), 280);
  EXPECT_EQ(kPaper.inverse(-1e9), 20);
}

TEST(OutputScale, TheInverseRoundsHalvesUp) {
  const OutputScale scale(0, 10, 0.0, 10.0);  // 0 to 10 units for values from 0 to 10
  EXPECT_EQ(scale.inverse(2.5), 3);
  EXPECT_EQ(scale.inverse(2.4999), 2);
  EXPECT_EQ(scale.inverse(7.5), 8);
}

TEST(OutputScale, TheExactInverseIsNotRounded) {
  const OutputScale scale(0, 10, 0.0, 10.0);  // 0 to 10 units for values from 0 to 10
  EXPECT_EQ(scale.exact_inverse(2.25), 2.25);
  EXPECT_EQ(scale.exact_inverse(-3.0), 0.0);
  EXPECT_EQ(scale.exact_inverse(INFINITY), 10.0);
  for (int u = 20; u <= 280; ++u) EXPECT_NEAR(kPaper.exact_inverse(kPaper(u)), u, 1e-9);
}

// A scale maps a range of counts to a range of values.
TEST(OutputScale, RefusesEmptyAndInfiniteRanges) {
  EXPECT_THROW(OutputScale(20, 20, -1, 1), std::invalid_argument);
  EXPECT_THROW(OutputScale(-1, 20, -1, 1), std::invalid_argument);
  EXPECT_THROW(OutputScale(0, 20, 1, 1), std::invalid_argument);
  EXPECT_THROW(OutputScale(0, 20, -1, INFINITY), std::invalid_argument);
  EXPECT_THROW(OutputScale(0, 20, NAN, 1), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::approximators
