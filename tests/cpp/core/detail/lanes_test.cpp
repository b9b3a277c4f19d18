#include "sdnn/core/detail/lanes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sdnn/core/elementary.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

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
  const auto lanes_of = [](const Lanes<2>& lanes) {
    std::array<double, 2> result;
    lanes.store(result.data());
    return result;
  };
  using TwoLanes = std::array<double, 2>;
  EXPECT_EQ(lanes_of(x + y), (TwoLanes{1.0, -1.0}));
  EXPECT_EQ(lanes_of(x - y), (TwoLanes{5.0, 0.0}));
  EXPECT_EQ(lanes_of(x * y), (TwoLanes{-6.0, 0.25}));
  EXPECT_EQ(lanes_of(x / y), (TwoLanes{-1.5, 1.0}));
  EXPECT_EQ(lanes_of(2.0 * x), (TwoLanes{6.0, -1.0}));
  EXPECT_EQ(lanes_of(magnitude(y)), (TwoLanes{2.0, 0.5}));
  EXPECT_EQ(lanes_of(double_of(bits_of(x))), a);
  EXPECT_EQ(lanes_of(select(x < 0.0, x, y)), (TwoLanes{-2.0, -0.5}));
  EXPECT_EQ(lanes_of(select(true, x, y)), a);
  EXPECT_EQ(lanes_of(select(false, x, y)), b);
}

TEST(Lanes, CompareIntoMasks) {
  const std::array<double, 2> a{1.0, testing::kNaN};
  const auto x = Lanes<2>::load(a.data());
  const auto lanes_of = [](const LaneBits<2>& mask) {
    std::array<std::uint64_t, 2> result;
    mask.store(result.data());
    return result;
  };
  using TwoLanes = std::array<std::uint64_t, 2>;
  EXPECT_EQ(lanes_of(x < 2.0), (TwoLanes{kOnes, 0}));
  EXPECT_EQ(lanes_of(x < 1.0), (TwoLanes{0, 0}));
  EXPECT_EQ(lanes_of(x <= 1.0), (TwoLanes{kOnes, 0}));
  EXPECT_EQ(lanes_of(x >= 1.0), (TwoLanes{kOnes, 0}));
  EXPECT_TRUE(any(x <= 1.0));
  EXPECT_FALSE(any(x < 1.0));
  const TwoLanes second_lane{0, kOnes}, both_lanes{kOnes, kOnes};
  const auto second = LaneBits<2>::load(second_lane.data());
  const auto every = LaneBits<2>::load(both_lanes.data());
  EXPECT_TRUE(any(second));
  EXPECT_EQ(lanes_of(both(every, second)), second_lane);
  EXPECT_EQ(lanes_of(first_only(every, second)), (TwoLanes{kOnes, 0}));
  EXPECT_EQ(lanes_of(every ^ second), (TwoLanes{kOnes, 0}));
  EXPECT_EQ(lanes_of(every & 6), (TwoLanes{6, 6}));
  EXPECT_EQ(lanes_of((every & 6) + 1), (TwoLanes{7, 7}));
  EXPECT_EQ(lanes_of(8 - (every & 6)), (TwoLanes{2, 2}));
  EXPECT_EQ(lanes_of((every & 6) << 2), (TwoLanes{24, 24}));
}

// Arguments have both signs and sizes from 2^-22 to 2^17, or are at and beyond the range's limits.
TEST(Lanes, SinesAndCosinesOfLanesHaveTheBitsOfThoseOfSingleNumbers) {
  Random random(1, Stream::exploration);
  std::vector<double> arguments{0.0,           -0.0,  5e-324, kSinCosLimit,
                                -kSinCosLimit, 1.1e5, -1e300, testing::kInfinity,
                                testing::kNaN, kPi};
  for (int i = 0; i < 100000; ++i) {
    arguments.push_back(std::ldexp(2.0 * random.uniform() - 1.0, i % 40 - 22));
  }
  const auto equal_bits_or_nan = [](double a, double b) {
    return std::isnan(a) ? std::isnan(b)
                         : std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  };
  for (std::size_t i = 0; i < arguments.size(); i += 2) {
    const auto lanes = sin_cos(Lanes<2>::load(&arguments[i]));
    for (std::size_t k = 0; k < 2; ++k) {
      const auto single = sin_cos(arguments[i + k]);
      ASSERT_TRUE(equal_bits_or_nan(lanes.sin.v[k], single.sin)) << arguments[i + k];
      ASSERT_TRUE(equal_bits_or_nan(lanes.cos.v[k], single.cos)) << arguments[i + k];
    }
  }
}
#endif

}  // namespace
}  // namespace sdnn::core
