#include "sdnn/core/bit_layer.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace sdnn::core {
namespace {

std::vector<BitWord> words_with_active(std::initializer_list<std::size_t> units, std::size_t size) {
  std::vector<BitWord> words(n_bit_words(size));
  for (const std::size_t unit : units) words[unit / 64].set(unit % 64);
  return words;
}

TEST(BitLayer, UnitIIsBitIModulo64OfItsWord) {
  const std::vector<BitWord> words = {BitWord(0b101), BitWord(1)};
  const BitLayer layer(words.data(), 70);
  EXPECT_EQ(layer.size(), 70U);
  EXPECT_EQ(layer.n_words(), 2U);
  EXPECT_TRUE(layer[0] && !layer[1] && layer[2] && layer[64] && !layer[65]);
  EXPECT_EQ(layer.count(), 3U);
}

TEST(BitLayer, VisitsActiveUnitsInOrder) {
  const auto row = words_with_active({0, 63, 64, 127, 199}, 200);
  std::vector<std::size_t> visited;
  BitLayer(row.data(), 200).for_each_set([&](std::size_t unit) { visited.push_back(unit); });
  EXPECT_EQ(visited, (std::vector<std::size_t>{0, 63, 64, 127, 199}));
}

TEST(BitLayer, TheDistanceCountsUnitsThatDiffer) {
  const auto a = words_with_active({1, 2, 100}, 101);
  const auto b = words_with_active({2, 3, 99}, 101);
  const BitLayer layer(a.data(), 101);
  const BitLayer changed(b.data(), 101);
  EXPECT_EQ(layer.distance(changed), 4U);  // units 1, 3, 99 and 100
  EXPECT_EQ(layer.distance(layer), 0U);
  EXPECT_NE(layer, changed);
  EXPECT_EQ(layer, BitLayer(words_with_active({1, 2, 100}, 101).data(), 101));
}

TEST(BitLayer, TheNumberOfWordsIsRoundedUp) {
  static_assert(n_bit_words(0) == 0 && n_bit_words(1) == 1 && n_bit_words(64) == 1);
  static_assert(n_bit_words(65) == 2 && n_bit_words(200) == 4);
  EXPECT_EQ(BitLayer(nullptr, 0).count(), 0U);
}

// BitLayer relies on to_ullong, the only access to the bits of a bitset in the standard.
TEST(BitLayer, AWordHasTheValueOfItsBits) {
  BitWord word;
  word.set(0);
  word.set(63);
  EXPECT_EQ(word.to_ullong(), (std::uint64_t{1} << 63) + 1);
}

}  // namespace
}  // namespace sdnn::core
