#include "sdnn/core/elementary.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace {

using sdnn::core::normal_quantile;
using sdnn::core::sin_cos;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// True for the same number or one of its two neighbours.
bool adjacent(double a, double b) { return a == b || std::nextafter(a, b) == b; }

// References: mpmath with 40 digits, rounded once.
TEST(SinCos, IsWithinOneUlpAtRepresentativeAndHardPoints) {
  struct Row {
    double x, sin, cos;
  };
  constexpr Row kRows[] = {
      {0.1, 0x1.98eaecb8bcb2cp-4, 0x1.fd712f9a817c1p-1},
      {0.5, 0x1.eaee8744b05f0p-2, 0x1.c1528065b7d50p-1},
      {0.7853981633974483, 0x1.6a09e667f3bccp-1, 0x1.6a09e667f3bcdp-1},
      {1.0, 0x1.aed548f090ceep-1, 0x1.14a280fb5068cp-1},
      {1.5707963267948966, 0x1.0000000000000p+0, 0x1.1a62633145c07p-54},
      {3.141592653589793, 0x1.1a62633145c07p-53, -0x1.0000000000000p+0},
      {-2.356194490192345, -0x1.6a09e667f3bcdp-1, -0x1.6a09e667f3bccp-1},
      {10.0, -0x1.1689ef5f34f52p-1, -0x1.ad9ac890c6b1fp-1},
      {100.0, -0x1.03425b78c4db8p-1, 0x1.b981dbf665fdfp-1},
      {22.0, -0x1.220a29f6eb9f4p-7, -0x1.fffadd8d4acdap-1},
      {-12345.678, 0x1.687d5890974a5p-1, 0x1.6b94c3bbe24b8p-1},
      {99999.5, 0x1.055f282f41bdap-1, -0x1.b8428c9f69a31p-1},
      {1e-09, 0x1.12e0be826d695p-30, 0x1.0000000000000p+0},
      {31.41592653589793, -0x1.60fafbfd97309p-50, 0x1.0000000000000p+0},
      {51819.0, 0x1.fffffffd64a00p-1, 0x1.9d567113604afp-16},
  };
  for (const auto& row : kRows) {
    const auto got = sin_cos(row.x);
    EXPECT_TRUE(adjacent(got.sin, row.sin)) << row.x;
    EXPECT_TRUE(adjacent(got.cos, row.cos)) << row.x;
  }
}

TEST(SinCos, IsExactlyOddAndEven) {
  for (double x = 0.0; x < 1000.0; x = x * 1.01 + 1e-3) {
    const auto plus = sin_cos(x), minus = sin_cos(-x);
    EXPECT_EQ(plus.sin, -minus.sin);
    EXPECT_EQ(plus.cos, minus.cos);
  }
  EXPECT_TRUE(std::signbit(sin_cos(-0.0).sin));
  EXPECT_FALSE(std::signbit(sin_cos(0.0).sin));
  EXPECT_EQ(sin_cos(0.0).cos, 1.0);
  EXPECT_EQ(sin_cos(5e-324).sin, 5e-324);
}

TEST(SinCos, LiesOnTheUnitCircle) {
  for (int i = -20000; i <= 20000; ++i) {
    const auto at = sin_cos(0.0131 * i);
    EXPECT_NEAR(at.sin * at.sin + at.cos * at.cos, 1.0, 4e-16);
    EXPECT_LE(std::abs(at.sin), 1.0);
    EXPECT_LE(std::abs(at.cos), 1.0);
  }
}

TEST(SinCos, IsNaNOutsideItsRange) {
  for (const double x : {kInfinity, -kInfinity, kNaN, 1.0001e5, -1e300, 1.7e308}) {
    EXPECT_TRUE(std::isnan(sin_cos(x).sin)) << x;
    EXPECT_TRUE(std::isnan(sin_cos(x).cos)) << x;
  }
  EXPECT_FALSE(std::isnan(sin_cos(sdnn::core::kSinCosLimit).sin));
}

// The bits are the same with every compiler and optimization level.
TEST(SinCos, KeepsItsBits) {
  std::uint64_t digest = 0;
  for (int i = 0; i < 100000; ++i) {
    const auto at = sin_cos(0.73 * i + 0.01);
    digest = digest * 31 + std::bit_cast<std::uint64_t>(at.sin);
    digest = digest * 31 + std::bit_cast<std::uint64_t>(at.cos);
  }
  EXPECT_EQ(digest, 6117906030201916266u);
}

TEST(Log, IsWithinOneUlpAtRepresentativeAndHardPoints) {
  constexpr std::pair<double, double> kRows[] = {
      {0.5, -0x1.62e42fefa39efp-1},
      {2.0, 0x1.62e42fefa39efp-1},
      {10.0, 0x1.26bb1bbb55516p+1},
      {1e-300, -0x1.5963447f87fb5p+9},
      {5e-324, -0x1.74385446d71c3p+9},
      {1.7976931348623157e+308, 0x1.62e42fefa39efp+9},
      {0.9999999999999999, -0x1.0000000000000p-53},
      {1.0000000000000002, 0x1.fffffffffffffp-53},
      {0.7071067811865475, -0x1.62e42fefa39f1p-2},
      {1.4142135623730951, 0x1.62e42fefa39f0p-2},
      {3.0, 0x1.193ea7aad030bp+0},
      {1e-05, -0x1.7069e2aa2aa5bp+3},
  };
  for (const auto& [x, expected] : kRows) {
    EXPECT_TRUE(adjacent(sdnn::core::log(x), expected)) << x;
  }
}

TEST(Log, HandlesTheEndsOfItsRange) {
  EXPECT_EQ(sdnn::core::log(1.0), 0.0);
  EXPECT_EQ(sdnn::core::log(0.0), -kInfinity);
  EXPECT_EQ(sdnn::core::log(-0.0), -kInfinity);
  EXPECT_EQ(sdnn::core::log(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(sdnn::core::log(-1.0)));
  EXPECT_TRUE(std::isnan(sdnn::core::log(-kInfinity)));
  EXPECT_TRUE(std::isnan(sdnn::core::log(kNaN)));
}

TEST(Exp, IsWithinOneUlpAtRepresentativeAndHardPoints) {
  constexpr std::pair<double, double> kRows[] = {
      {1.0, 0x1.5bf0a8b145769p+1},        {-1.0, 0x1.78b56362cef38p-2},
      {0.5, 0x1.a61298e1e069cp+0},        {-0.5, 0x1.368b2fc6f960ap-1},
      {10.0, 0x1.5829dcf950560p+14},      {-10.0, 0x1.7cd79b5647c9bp-15},
      {100.0, 0x1.3494a9b171bf5p+144},    {-700.0, 0x1.14f2b0fb9307fp-1010},
      {0.34657359, 0x1.6a09e66640654p+0}, {1e-09, 0x1.000000044b830p+0},
  };
  for (const auto& [x, expected] : kRows) {
    EXPECT_TRUE(adjacent(sdnn::core::exp(x), expected)) << x;
  }
}

TEST(Exp, UndoesTheLogarithm) {
  for (double x = 1e-300; x < 1e300; x *= 7.3) {
    const double y = sdnn::core::log(x);  // an error in y is one of x times |y|
    EXPECT_NEAR(sdnn::core::exp(y) / x, 1.0, (std::abs(y) + 2.0) * 2e-16) << x;
  }
}

TEST(Exp, HandlesTheEndsOfItsRange) {
  EXPECT_EQ(sdnn::core::exp(0.0), 1.0);
  EXPECT_EQ(sdnn::core::exp(-0.0), 1.0);
  EXPECT_EQ(sdnn::core::exp(5e-324), 1.0);
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

// The bits are the same with every compiler and optimization level.
TEST(Exp, KeepsItsBits) {
  std::uint64_t digest = 0;
  for (int i = -50000; i < 50000; ++i) {
    digest = digest * 31 + std::bit_cast<std::uint64_t>(sdnn::core::exp(0.0149 * i + 0.001));
  }
  EXPECT_EQ(digest, 2816221857222245310U);
}

// References: mpmath with 200 bits, rounded once.
TEST(Atan2, IsWithinTwoUlpAtRepresentativeAndHardPoints) {
  struct Row {
    double y, x, angle;
  };
  constexpr Row kRows[] = {
      {0.1, 1.0, 0x1.983e282e2cc4dp-4},           {1.0, 1.0, 0x1.921fb54442d18p-1},
      {0.5, 1.0, 0x1.dac670561bb4fp-2},           {0.5000001, 1.0, 0x1.dac675b47f69ep-2},
      {1.0, 0.5, 0x1.1b6e192ebbe44p+0},           {-0.25, 0.97, -0x1.024bd8cd329cep-2},
      {0.6, -0.8, 0x1.3fc176b7a8560p+1},          {-0.6, -0.8, -0x1.3fc176b7a8560p+1},
      {0.99, -0.01, 0x1.94b5aa54e9ab2p+0},        {-1.0, -1e-09, -0x1.921fb5488e548p+0},
      {1e-09, -1.0, 0x1.921fb5421d100p+1},        {3e-320, 2e-310, 0x1.49d98d8cd7e40p-33},
      {1.7e+308, 1.6e+308, 0x1.a1a25f2c82506p-1}, {-1e+308, -1.7e+308, -0x1.4e102c80931dcp+1},
      {5e-324, 1.0, 0x0.0000000000001p-1022},     {1e+300, 1e-300, 0x1.921fb54442d18p+0},
      {0.241963, 0.475877, 0x1.e1adff68a6490p-2}, {-0.577, 0.9991, -0x1.0c25ccc51e68bp-1},
  };
  for (const auto& row : kRows) {
    const double got = sdnn::core::atan2(row.y, row.x);
    const double next = std::nextafter(row.angle, got);
    EXPECT_TRUE(adjacent(got, row.angle) || adjacent(got, next)) << row.y << " " << row.x;
  }
}

TEST(Atan2, IsWithinTwoUlpOfALongerFormat) {
  if (std::numeric_limits<long double>::digits < 64) GTEST_SKIP() << "there is none here";
  for (int i = 0; i < 200000; ++i) {
    const double turn = 3.7e-5 * i, length = std::ldexp(1.0, i % 600 - 300);
    const double y = length * std::sin(turn), x = length * std::cos(turn);
    const long double exact = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    const double nearest = static_cast<double>(exact);
    const double ulp = std::nextafter(std::abs(nearest), kInfinity) - std::abs(nearest);
    ASSERT_LE(std::abs(static_cast<double>(sdnn::core::atan2(y, x) - exact)), 2.0 * ulp) << turn;
  }
}

TEST(Atan2, TreatsZerosAndInfinitiesAsTheCLibraryDoes) {
  for (const double y : {0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, kInfinity, -kInfinity}) {
    for (const double x : {0.0, -0.0, 2.0, -2.0, 1.7e308, -1.7e308, kInfinity, -kInfinity}) {
      const double got = sdnn::core::atan2(y, x), expected = std::atan2(y, x);
      EXPECT_DOUBLE_EQ(got, expected) << y << " " << x;
      EXPECT_EQ(std::signbit(got), std::signbit(expected)) << y << " " << x;
      EXPECT_LE(std::abs(got), sdnn::core::kPi);
    }
  }
  EXPECT_TRUE(std::isnan(sdnn::core::atan2(kNaN, 1.0)));
  EXPECT_TRUE(std::isnan(sdnn::core::atan2(1.0, kNaN)));
}

// The bits are the same with every compiler and optimization level.
TEST(Atan2, KeepsItsBits) {
  std::uint64_t digest = 0;
  for (int i = -50000; i < 50000; ++i) {
    const double y = 0.37 * (i % 313) + 0.01, x = 0.73 * (i % 97) - 0.02 * i;
    digest = digest * 31 + std::bit_cast<std::uint64_t>(sdnn::core::atan2(y, x));
  }
  EXPECT_EQ(digest, 11845609870576631536U);
}

TEST(NormalQuantile, AgreesWithTheInvertedDistributionFunction) {
  constexpr std::pair<double, double> kRows[] = {
      {0.5, 0.0},
      {0.25, -0.674489750196081743},
      {0.975, 1.95996398454005386},
      {0.001, -3.09023230616781354},
      {0.075, -1.43953147093845593},
      {1e-12, -7.03448382530113193},
      {1e-100, -21.2734535609653243},
      {0.9999999999, 6.36134088969742186},
      {1.1102230246251565e-16, -8.20953615160138686},
  };
  for (const auto& [p, expected] : kRows) {
    EXPECT_NEAR(normal_quantile(p), expected, 2e-15 * std::abs(expected)) << p;
  }
}

TEST(NormalQuantile, IsOddAboutOneHalfAndRises) {
  double last = -kInfinity;
  for (int i = 1; i < 4096; ++i) {
    const double p = i / 4096.0, quantile = normal_quantile(p);
    EXPECT_GT(quantile, last);
    EXPECT_EQ(quantile, -normal_quantile(1.0 - p));
    last = quantile;
  }
}

TEST(NormalQuantile, HandlesTheEndsOfItsRange) {
  EXPECT_EQ(normal_quantile(0.0), -kInfinity);
  EXPECT_EQ(normal_quantile(1.0), kInfinity);
  for (const double p : {-1e-300, 1.0000000000000002, kInfinity, -kInfinity, kNaN}) {
    EXPECT_TRUE(std::isnan(normal_quantile(p))) << p;
  }
}

}  // namespace
