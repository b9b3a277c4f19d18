#include "sdnn/estimators/detail/chunked_weights.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace sdnn {
namespace {

using estimators::ChunkedWeights;
using estimators::kChunkColumns;
using estimators::WeightTiles;

TEST(ChunkedWeights, HoldTheTilesAndZerosBeyond) {
  WeightTiles<std::int32_t> tiles(20, 3 * 64);
  tiles.at(17, 130) = -300;
  tiles.at(17, 131) = 40000;
  const ChunkedWeights<std::int32_t> wide(tiles, 4);
  EXPECT_EQ(wide.n_chunks(), 2U);
  EXPECT_EQ(wide.n_padded_units(), 32U);
  EXPECT_EQ(wide.chunk(1, 17)[130 - kChunkColumns], -300);
  EXPECT_EQ(wide.chunk(1, 17)[127], 0);
  EXPECT_EQ(wide.largest_chunk_norm(), 40300);
  EXPECT_EQ(ChunkedWeights<std::int32_t>::bytes(32, 4), 4U * 32 * 256);
}

TEST(ChunkedWeights, GoThereAndBack) {
  WeightTiles<std::int32_t> tiles(200, 128);
  std::int32_t value = -10000;
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t slot = 0; slot < 128; ++slot) tiles.at(i, slot) = ++value;
  }
  const ChunkedWeights<std::int16_t> narrow(ChunkedWeights<std::int32_t>(tiles, 2));
  EXPECT_FALSE(narrow.empty());
  EXPECT_TRUE(ChunkedWeights<std::int16_t>().empty());
  WeightTiles<std::int32_t> back(200, 128);
  narrow.copy_to(back);
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t slot = 0; slot < 128; ++slot) ASSERT_EQ(back.at(i, slot), tiles.at(i, slot));
  }
}

}  // namespace
}  // namespace sdnn
