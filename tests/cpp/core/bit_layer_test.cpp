#include "sdnn/core/bit_layer.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace sdnn::core {
namespace {

TEST(BitLayer, StartsEmptyAndCountsWhatIsSet) {
  BitLayer<128> layer(70);
  EXPECT_EQ(layer.size(), 70U);
  EXPECT_EQ(layer.count(), 0U);
  layer.set(0);
  layer.set(69);
  layer.flip(3);
  layer.set(3, false);
  EXPECT_EQ(layer.count(), 2U);
  EXPECT_TRUE(layer[69]);
  EXPECT_FALSE(layer[3]);
}

TEST(BitLayer, WordsAreInUnitOrder) {
  BitLayer<192> layer(130);
  layer.set(1);
  layer.set(64);
  layer.set(129);
  const auto words = layer.words();
  EXPECT_EQ(words[0], 2U);
  EXPECT_EQ(words[1], 1U);
  EXPECT_EQ(words[2], 2U);
}

TEST(BitLayer, ComplementKeepsThePaddingZero) {
  for (const std::size_t size : {0U, 1U, 63U, 64U, 65U, 127U, 128U}) {
    const BitLayer<128> all = ~BitLayer<128>(size);
    EXPECT_EQ(all.count(), size);
    EXPECT_EQ((~all).count(), 0U);
  }
}

TEST(BitLayer, IterationVisitsSetUnitsInOrder) {
  BitLayer<256> layer(200);
  const std::vector<std::size_t> expected = {0, 7, 63, 64, 128, 199};
  for (const std::size_t unit : expected) layer.set(unit);
  std::vector<std::size_t> visited;
  layer.for_each_set([&](std::size_t unit) { visited.push_back(unit); });
  EXPECT_EQ(visited, expected);
}

TEST(BitLayer, DeMorgan) {
  BitLayer<128> a(100);
  BitLayer<128> b(100);
  for (std::size_t k = 0; k < 100; k += 3) a.set(k);
  for (std::size_t k = 0; k < 100; k += 5) b.set(k);
  EXPECT_EQ(~(a & b), ~a | ~b);
  EXPECT_EQ((a ^ b).count(), a.count() + b.count() - 2 * (a & b).count());
}

TEST(BitLayer, RefusesMoreThanItsCapacity) { EXPECT_THROW(BitLayer<64>(65), std::length_error); }

}  // namespace
}  // namespace sdnn::core
