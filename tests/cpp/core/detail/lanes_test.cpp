#include "sdnn/core/detail/lanes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "sdnn/core/elementary.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::core {
namespace {

constexpr std::uint64_t kOnes = ~std::uint64_t{0};

// Code for several lanes at once also compiles for one number.
TEST(Lanes, ADoubleIsASingleLane) {
  EXPECT_EQ(select(true, 1.0, 2.0), 1.0);
  EXPECT_EQ(select(false, 1.0, 2.0), 2.0);
  EXPECT_TRUE(any(true));
  EXPECT_FALSE(any(false));
  EXPECT_TRUE(both(true, true));
  EXPECT_FALSE(both(true, false));
  EXPECT_TRUE(first_only(true, false));
  EXPECT_FALSE(first_only(true, true));
  EXPECT_EQ(bits_of(1.0), std::uint64_t{1023} << 52);  // the exponent's bias is 1023
  EXPECT_EQ(double_of(std::uint64_t{1024} << 52), 2.0);
  EXPECT_EQ(magnitude(-3.5), 3.5);
  EXPECT_FALSE(std::signbit(magnitude(-0.0)));
}

TEST(Lanes, UnrolledCountsUp) {
  std::vector<std::size_t> indices;
  unrolled<4>([&](std::size_t i) { indices.push_back(i); });
  EXPECT_EQ(indices, (std::vector<std::size_t>{0, 1, 2, 3}));
}

#if SDNN_LANES
TEST(Lanes, CalculateLaneByLane) {
  const std::array<double, 2> a{3.0, -0.5}, b{-2.0, -0.5};
  const auto x = Lanes<2>::load(a.data()), y = Lanes<2>::load(b.data());
  const auto pair = [](const Lanes<2>& lanes) {
    std::array<double, 2> result;
    lanes.store(result.data());
    return result;
  };
  using Pair = std::array<double, 2>;
  EXPECT_EQ(pair(x + y), (Pair{1.0, -1.0}));
  EXPECT_EQ(pair(x - y), (Pair{5.0, 0.0}));
  EXPECT_EQ(pair(x * y), (Pair{-6.0, 0.25}));
  EXPECT_EQ(pair(x / y), (Pair{-1.5, 1.0}));
  EXPECT_EQ(pair(2.0 * x), (Pair{6.0, -1.0}));
  EXPECT_EQ(pair(magnitude(y)), (Pair{2.0, 0.5}));
  EXPECT_EQ(pair(double_of(bits_of(x))), a);
  EXPECT_EQ(pair(select(x < 0.0, x, y)), (Pair{-2.0, -0.5}));
  EXPECT_EQ(pair(select(true, x, y)), a);
  EXPECT_EQ(pair(select(false, x, y)), b);
}

TEST(Lanes, CompareIntoMasks) {
  const std::array<double, 2> a{1.0, std::numeric_limits<double>::quiet_NaN()};
  const auto x = Lanes<2>::load(a.data());
  const auto pair = [](const LaneBits<2>& mask) {
    std::array<std::uint64_t, 2> result;
    mask.store(result.data());
    return result;
  };
  using Pair = std::array<std::uint64_t, 2>;
  EXPECT_EQ(pair(x < 2.0), (Pair{kOnes, 0}));
  EXPECT_EQ(pair(x < 1.0), (Pair{0, 0}));
  EXPECT_EQ(pair(x <= 1.0), (Pair{kOnes, 0}));
  EXPECT_EQ(pair(x >= 1.0), (Pair{kOnes, 0}));
  EXPECT_TRUE(any(x <= 1.0));
  EXPECT_FALSE(any(x < 1.0));
  const Pair right{0, kOnes}, all{kOnes, kOnes};
  const auto second = LaneBits<2>::load(right.data()), every = LaneBits<2>::load(all.data());
  EXPECT_TRUE(any(second));
  EXPECT_EQ(pair(both(every, second)), right);
  EXPECT_EQ(pair(first_only(every, second)), (Pair{kOnes, 0}));
  EXPECT_EQ(pair(every ^ second), (Pair{kOnes, 0}));
  EXPECT_EQ(pair(every & 6), (Pair{6, 6}));
  EXPECT_EQ(pair((every & 6) + 1), (Pair{7, 7}));
  EXPECT_EQ(pair(8 - (every & 6)), (Pair{2, 2}));
  EXPECT_EQ(pair((every & 6) << 2), (Pair{24, 24}));
}

// Arguments of both signs and of sizes from 2^-22 to 2^17, at the limits of the range and beyond
// it.
TEST(Lanes, SinesKeepTheirBits) {
  Random random(1, Stream::exploration);
  std::vector<double> arguments{0.0,
                                -0.0,
                                5e-324,
                                kSinCosLimit,
                                -kSinCosLimit,
                                1.1e5,
                                -1e300,
                                std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::quiet_NaN(),
                                kPi};
  for (int i = 0; i < 100000; ++i) {
    arguments.push_back(std::ldexp(2.0 * random.uniform() - 1.0, i % 40 - 22));
  }
  const auto same = [](double a, double b) {
    return std::isnan(a) ? std::isnan(b)
                         : std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  };
  for (std::size_t i = 0; i < arguments.size(); i += 2) {
    const auto lanes = sin_cos(Lanes<2>::load(&arguments[i]));
    for (std::size_t k = 0; k < 2; ++k) {
      const auto single = sin_cos(arguments[i + k]);
      ASSERT_TRUE(same(lanes.sin.v[k], single.sin)) << arguments[i + k];
      ASSERT_TRUE(same(lanes.cos.v[k], single.cos)) << arguments[i + k];
    }
  }
}
#endif

}  // namespace
}  // namespace sdnn::core
