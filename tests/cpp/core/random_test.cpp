#include "sdnn/core/random.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace {

using sdnn::core::Random;
using sdnn::core::Stream;

// References: an independent Python transcription of SplitMix64 and xoshiro256**, itself checked
// with the published first outputs for the state (1, 2, 3, 4).
TEST(Random, StartsWithTheReferenceBits) {
  Random first(2015, Stream::permutations);
  EXPECT_EQ(first.bits(), 0xa598ae49b45921f0u);
  EXPECT_EQ(first.bits(), 0x65d0e41f3364ee8eu);
  EXPECT_EQ(first.bits(), 0xc98d8dc5366e1e82u);
  EXPECT_EQ(first.bits(), 0xf09130c7e718b475u);
  Random second(2015, Stream::permutations, 1);
  EXPECT_EQ(second.bits(), 0xdcb021adc2618fc7u);
  EXPECT_EQ(second.bits(), 0xcdb5cb141c04c80fu);
  Random zero(0, Stream::code_books);
  EXPECT_EQ(zero.bits(), 0x6f0c221987108fb2u);
  EXPECT_EQ(zero.bits(), 0x068a99bcd127fe03u);
}

TEST(Random, StreamsAreUncorrelated) {
  Random weights(1, Stream::weights), ties(1, Stream::ties);
  int equal_bits = 0;
  for (int i = 0; i < 1000; ++i) equal_bits += 64 - std::popcount(weights.bits() ^ ties.bits());
  const double n_bits = 64.0 * 1000;
  EXPECT_NEAR(equal_bits, n_bits / 2, 5 * std::sqrt(n_bits / 4));  // five standard deviations
}

TEST(Random, UniformIsInTheHalfOpenUnitInterval) {
  Random random(3, Stream::weights);
  double sum = 0.0, low = 1.0, high = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double drawn = random.uniform();
    sum += drawn;
    low = std::min(low, drawn);
    high = std::max(high, drawn);
  }
  EXPECT_GE(low, 0.0);
  EXPECT_LT(low, 1e-3);
  EXPECT_LT(high, 1.0);
  EXPECT_GT(high, 0.999);
  EXPECT_NEAR(sum / 100000, 0.5, 5 / std::sqrt(12.0 * 100000));  // five standard deviations
}

TEST(Random, BelowIsUniformAndWithinItsBound) {
  Random random(4, Stream::ties);
  std::array<int, 7> counts{};
  for (int i = 0; i < 70000; ++i) {
    const auto drawn = random.below(7);
    ASSERT_LT(drawn, 7u);
    ++counts[drawn];
  }
  double chi_square = 0.0;
  for (const int count : counts) chi_square += (count - 10000.0) * (count - 10000.0) / 10000.0;
  EXPECT_LT(chi_square, 27.9);  // 6 degrees of freedom, p = 1e-4
  for (int i = 0; i < 100; ++i) EXPECT_EQ(random.below(1), 0u);
  static_assert(std::is_same_v<decltype(random.below(std::size_t{7})), std::size_t>);
  const std::uint64_t huge = (std::uint64_t{1} << 63) + 1;  // about half the draws are rejected
  for (int i = 0; i < 100; ++i) EXPECT_LT(random.below(huge), huge);
}

TEST(Random, ANormalNumberTakesOneDrawWhichDecidesItsSign) {
  Random normal(6, Stream::sensor_noise), bits(6, Stream::sensor_noise);
  for (int i = 0; i < 1000; ++i) {
    const double z = normal.normal();
    EXPECT_TRUE(std::isfinite(z));
    EXPECT_EQ(z < 0.0, bits.bits() < (std::uint64_t{1} << 63));  // the smaller half of all numbers
  }
}

// The permutation is that of the Python transcription named above, shuffling by Fisher and Yates.
TEST(Random, ShuffleGivesTheReferencePermutation) {
  Random random(7, Stream::permutations);
  std::array<int, 10> items{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  random.shuffle(std::span<int>(items));
  EXPECT_EQ(items, (std::array<int, 10>{5, 9, 4, 3, 8, 6, 0, 2, 1, 7}));
}

TEST(Random, ShuffleKeepsTheItems) {
  Random random(8, Stream::permutations);
  for (std::size_t size : {0u, 1u, 2u, 200u}) {
    std::vector<int> items(size);
    std::iota(items.begin(), items.end(), 0);
    const std::vector<int> before = items;
    random.shuffle(std::span<int>(items));
    std::sort(items.begin(), items.end());
    EXPECT_EQ(items, before);
  }
}

TEST(Random, ShuffleReachesEveryOrderEquallyOften) {
  Random random(9, Stream::permutations);
  std::array<int, 27> counts{};
  constexpr int kShuffles = 60000;
  for (int i = 0; i < kShuffles; ++i) {
    std::array<unsigned, 3> items{0, 1, 2};
    random.shuffle(std::span<unsigned>(items));
    ++counts[items[0] * 9 + items[1] * 3 + items[2]];
  }
  EXPECT_EQ(std::count(counts.begin(), counts.end(), 0), 27 - 6);  // 3^3 triples, 3! permutations
  const double sigma = std::sqrt(kShuffles / 6.0 * 5.0 / 6.0);
  for (const int count : counts) {
    if (count > 0) {
      EXPECT_NEAR(count, kShuffles / 6, 5 * sigma);
    }
  }
}

TEST(Random, ContinuesFromItsState) {
  Random random(1, Stream::weights);
  for (int i = 0; i < 100; ++i) (void)random.bits();
  Random restored(2, Stream::ties);
  sdnn::core::restore(restored, sdnn::core::state_of(random));
  for (int i = 0; i < 100; ++i) EXPECT_EQ(restored.bits(), random.bits());
}

// A state of zeros gives only zeros, for which below(3) would not terminate.
TEST(Random, RefusesDamagedStatesAndAStateOfZeros) {
  Random random(1, Stream::weights);
  sdnn::testing::expect_damaged_states_refused(random);
  auto bad = sdnn::core::state_of(random);
  for (std::byte& byte : bad.at("words").bytes) byte = std::byte{0};
  sdnn::testing::expect_refused(random, bad, "state: words must be not all 0");
}

}  // namespace
