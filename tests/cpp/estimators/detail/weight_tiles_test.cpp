#include "sdnn/estimators/detail/weight_tiles.hpp"

#include <gtest/gtest.h>

namespace {

using sdnn::estimators::WeightTiles;

TEST(WeightTiles, LastTileIsAsWideAsNeeded) {
  WeightTiles<std::int32_t> tiles(102, 3);
  EXPECT_EQ(tiles.n_tiles(), 2U);
  EXPECT_EQ(tiles.n_padded_units(), 112U);
  EXPECT_EQ(tiles.width(0), 96U);
  EXPECT_EQ(tiles.width(1), 16U);
  EXPECT_EQ(WeightTiles<std::int32_t>::bytes(102, 3), 4U * 112 * 3);
  tiles.at(97, 2) = -7;
  EXPECT_EQ(tiles.tile(1)[2 * 16 + 1], -7);
  EXPECT_EQ(tiles.tile(1), tiles.data() + 96 * 3);
  tiles.at(95, 1) = 6;
  EXPECT_EQ(tiles.tile(0)[96 + 95], 6);
  EXPECT_EQ(tiles.largest(), 7);
}

TEST(WeightTiles, CopiesBetweenTypes) {
  WeightTiles<std::int32_t> wide(5, 2);
  wide.at(4, 1) = -123;
  const WeightTiles<std::int16_t> narrow(wide);
  EXPECT_EQ(narrow.at(4, 1), -123);
  EXPECT_EQ(WeightTiles<std::int32_t>(narrow).at(4, 1), -123);
}

}  // namespace
