#include "sdnn/core/elementary.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>

#include "states.hpp"

namespace {

using sdnn::core::normal_quantile;
using sdnn::core::sin_cos;
using sdnn::testing::kInfinity;
using sdnn::testing::kNaN;

TEST(SinCos, TheSineIsExactlyOddAndTheCosineExactlyEven) {
  for (double x = 0.0; x < 1000.0; x = x * 1.01 + 1e-3) {
    const auto plus = sin_cos(x), minus = sin_cos(-x);
    EXPECT_EQ(plus.sin, -minus.sin);
    EXPECT_EQ(plus.cos, minus.cos);
  }
  EXPECT_TRUE(std::signbit(sin_cos(-0.0).sin));
  EXPECT_FALSE(std::signbit(sin_cos(0.0).sin));
  EXPECT_EQ(sin_cos(0.0).cos, 1.0);
  EXPECT_EQ(sin_cos(5e-324).sin, 5e-324);  // the smallest number above 0
}

TEST(SinCos, LiesOnTheUnitCircle) {
  for (int i = -20000; i <= 20000; ++i) {
    const auto at = sin_cos(0.0131 * i);
    EXPECT_NEAR(at.sin * at.sin + at.cos * at.cos, 1.0, 4e-16);  // two rounding errors of doubles
    EXPECT_LE(std::abs(at.sin), 1.0);
    EXPECT_LE(std::abs(at.cos), 1.0);
  }
}

TEST(SinCos, IsNaNOutsideItsRange) {
  for (const double x : {kInfinity, -kInfinity, kNaN, 1.0001e5, -1e300, 1.7e308}) {
    EXPECT_TRUE(std::isnan(sin_cos(x).sin)) << x;
    EXPECT_TRUE(std::isnan(sin_cos(x).cos)) << x;
  }
  EXPECT_FALSE(std::isnan(sin_cos(sdnn::core::kSinCosLimit).sin));  // the limit, 1e5, is included
}

// The digest was recorded once; the bits are the same with every compiler and optimization level.
TEST(SinCos, KeepsItsBits) {
  std::uint64_t digest = 0;
  for (int i = 0; i < 100000; ++i) {
    const auto at = sin_cos(0.73 * i + 0.01);
    digest = digest * 31 + std::bit_cast<std::uint64_t>(at.sin);
    digest = digest * 31 + std::bit_cast<std::uint64_t>(at.cos);
  }
  EXPECT_EQ(digest, 6117906030201916266u);
}

TEST(Log, IsExactAtTheLimitsOfItsRange) {
  EXPECT_EQ(sdnn::core::log(1.0), 0.0);
  EXPECT_EQ(sdnn::core::log(0.0), -kInfinity);
  EXPECT_EQ(sdnn::core::log(-0.0), -kInfinity);
  EXPECT_EQ(sdnn::core::log(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(sdnn::core::log(-1.0)));
  EXPECT_TRUE(std::isnan(sdnn::core::log(-kInfinity)));
  EXPECT_TRUE(std::isnan(sdnn::core::log(kNaN)));
}

TEST(Exp, IsTheInverseOfTheLogarithm) {
  for (double x = 1e-300; x < 1e300; x *= 7.3) {
    const double y = sdnn::core::log(x);
    // A relative error of y, up to 2^-52, becomes |y| times as large in exp(y); 2 more roundings.
    EXPECT_NEAR(sdnn::core::exp(y) / x, 1.0, (std::abs(y) + 2.0) * 2e-16) << x;
  }
}

TEST(Exp, IsExactAtTheLimitsOfItsRange) {
  EXPECT_EQ(sdnn::core::exp(0.0), 1.0);
  EXPECT_EQ(sdnn::core::exp(-0.0), 1.0);
  EXPECT_EQ(sdnn::core::exp(5e-324), 1.0);
  // The last finite result, infinity, the smallest result above 0, and 0.
  EXPECT_EQ(sdnn::core::exp(709.782712893384), 0x1.fffffffffff2ap+1023);
  EXPECT_EQ(sdnn::core::exp(709.7827128933841), kInfinity);
  EXPECT_EQ(sdnn::core::exp(kInfinity), kInfinity);
  EXPECT_EQ(sdnn::core::exp(-745.1332191019411), 5e-324);
  EXPECT_EQ(sdnn::core::exp(-745.1332191019412), 0.0);
  EXPECT_EQ(sdnn::core::exp(-1.7e308), 0.0);
  EXPECT_EQ(sdnn::core::exp(-kInfinity), 0.0);
  EXPECT_TRUE(std::isnan(sdnn::core::exp(kNaN)));
  EXPECT_TRUE(std::isnan(sdnn::core::exp(-kNaN)));
}

// The digest was recorded once; the bits are the same with every compiler and optimization level.
TEST(Exp, KeepsItsBits) {
  std::uint64_t digest = 0;
  for (int i = -50000; i < 50000; ++i) {
    digest = digest * 31 + std::bit_cast<std::uint64_t>(sdnn::core::exp(0.0149 * i + 0.001));
  }
  EXPECT_EQ(digest, 2816221857222245310U);
}

TEST(Power, IsExactForBasesZeroAndOne) {
  for (const double exponent : {1e-3, 1.0, 2.5, 1e6}) {
    EXPECT_EQ(sdnn::core::power(0.0, exponent), 0.0);
    EXPECT_EQ(sdnn::core::power(1.0, exponent), 1.0);
  }
}

TEST(Power, HasTheValuesOfPowersOfTwo) {
  EXPECT_DOUBLE_EQ(sdnn::core::power(0.5, 3.0), 0.125);
  EXPECT_DOUBLE_EQ(sdnn::core::power(16.0, 0.25), 2.0);
}

TEST(Atan2, TreatsZerosAndInfinitiesLikeTheCLibrary) {
  for (const double y : {0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, kInfinity, -kInfinity}) {
    for (const double x : {0.0, -0.0, 2.0, -2.0, 1.7e308, -1.7e308, kInfinity, -kInfinity}) {
      const double angle = sdnn::core::atan2(y, x), expected = std::atan2(y, x);
      EXPECT_DOUBLE_EQ(angle, expected) << y << " " << x;
      EXPECT_EQ(std::signbit(angle), std::signbit(expected)) << y << " " << x;
      EXPECT_LE(std::abs(angle), sdnn::core::kPi);
    }
  }
  EXPECT_TRUE(std::isnan(sdnn::core::atan2(kNaN, 1.0)));
  EXPECT_TRUE(std::isnan(sdnn::core::atan2(1.0, kNaN)));
}

// The digest was recorded once; the bits are the same with every compiler and optimization level.
TEST(Atan2, KeepsItsBits) {
  std::uint64_t digest = 0;
  for (int i = -50000; i < 50000; ++i) {
    const double y = 0.37 * (i % 313) + 0.01, x = 0.73 * (i % 97) - 0.02 * i;
    digest = digest * 31 + std::bit_cast<std::uint64_t>(sdnn::core::atan2(y, x));
  }
  EXPECT_EQ(digest, 11845609870576631536U);
}

// Multiples of 1 / 4096 are exact, as is 1 - p, so the quantiles must be equal to the last bit.
TEST(NormalQuantile, IsOddAboutOneHalfAndRises) {
  double last = -kInfinity;
  for (int i = 1; i < 4096; ++i) {
    const double p = i / 4096.0, quantile = normal_quantile(p);
    EXPECT_GT(quantile, last);
    EXPECT_EQ(quantile, -normal_quantile(1.0 - p));
    last = quantile;
  }
}

TEST(NormalQuantile, IsExactAtTheLimitsOfItsRange) {
  EXPECT_EQ(normal_quantile(0.0), -kInfinity);
  EXPECT_EQ(normal_quantile(1.0), kInfinity);
  for (const double p : {-1e-300, 1.0000000000000002, kInfinity, -kInfinity, kNaN}) {
    EXPECT_TRUE(std::isnan(normal_quantile(p))) << p;
  }
}

}  // namespace
