#include "sdnn/estimators/detail/weight_tiles.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn {
namespace {

using estimators::WeightTiles;

// 102 units: a tile of 96, and 6 padded to 16.
TEST(WeightTiles, TheLastTileIsAsWideAsNeeded) {
  WeightTiles<std::int32_t> tiles(102, 3);
  EXPECT_EQ(tiles.n_tiles(), 2U);
  EXPECT_EQ(tiles.n_padded_units(), 112U);
  EXPECT_EQ(tiles.width(0), 96U);
  EXPECT_EQ(tiles.width(1), 16U);
  tiles.at(97, 2) = -7;                      // the second unit of tile 1, in its third slot
  EXPECT_EQ(tiles.tile(1)[2 * 16 + 1], -7);  // tiles store their units slot by slot
  EXPECT_EQ(tiles.tile(1), tiles.data() + std::size_t{96} * 3);
  tiles.at(95, 1) = 6;
  EXPECT_EQ(tiles.tile(0)[1 * 96 + 95], 6);
  EXPECT_EQ(tiles.largest(), 7);
}

TEST(WeightTiles, CopiesBetweenTypes) {
  WeightTiles<std::int32_t> wide(5, 2);
  wide.at(4, 1) = -123;
  const WeightTiles<std::int16_t> narrow(wide);
  EXPECT_EQ(narrow.at(4, 1), -123);
  EXPECT_EQ(WeightTiles<std::int32_t>(narrow).at(4, 1), -123);
}

TEST(WeightTiles, AddColumnsOfAllTiles) {
  WeightTiles<std::int16_t> tiles(100, 70);
  for (std::size_t i = 0; i < 100; ++i) {
    for (std::size_t slot = 0; slot < 70; ++slot) {
      tiles.at(i, slot) = static_cast<std::int16_t>(i + 100 * slot);
    }
  }
  const std::vector<std::uint32_t> plus{3, 69, 3};  // one column twice
  const std::vector<std::uint32_t> minus{1};
  std::vector<std::int32_t> sums(112, -1);  // 100 units, to a multiple of 16
  tiles.add_columns({plus, minus}, 2, sums.data());
  for (std::size_t i = 0; i < 100; ++i) {  // three columns plus, one minus: 2 i remains
    EXPECT_EQ(sums[i], -1 + 2 * static_cast<int>(i) + 100 * (3 + 69 + 3 - 1)) << i;
  }
  EXPECT_EQ(sums[111], -1);
}

template <class Weight>
void expect_exact_row_sums(std::int32_t largest, std::size_t n_per_sum) {
  core::Random random(1, core::Stream::weights);
  const auto span = static_cast<std::uint64_t>(2 * largest + 1);
  for (const std::size_t width : {16U, 32U, 48U, 64U, 80U, 96U}) {
    core::AlignedBuffer<Weight> tile(100 * width);
    for (auto& weight : tile.span()) {
      weight = static_cast<Weight>(static_cast<std::int32_t>(random.below(span)) - largest);
    }
    std::vector<std::uint32_t> plus(random.below(300)), minus(random.below(300));
    for (auto& row : plus) row = static_cast<std::uint32_t>(random.below(100));
    for (auto& row : minus) row = static_cast<std::uint32_t>(random.below(100));
    std::vector<std::int32_t> expected(width, 5);
    for (std::size_t i = 0; i < width; ++i) {
      for (const auto row : plus) expected[i] += tile[row * width + i];
      for (const auto row : minus) expected[i] -= tile[row * width + i];
    }
    testing::on_every_instruction_set([&](auto level) {
      std::vector<std::int32_t> sums(width, 5);
      estimators::add_rows(tile.data(), width, plus, minus, n_per_sum, sums.data());
      EXPECT_EQ(sums, expected) << level << ' ' << width;
    });
  }
}

TEST(WeightTiles, RowsAreAddedExactly) {
  // Arguments are the largest weight, and how many of them their type sums: 100 * 327 < 2^15.
  expect_exact_row_sums<std::int16_t>(327, 100);
  expect_exact_row_sums<std::int16_t>(32767, 1);
  expect_exact_row_sums<std::int32_t>(100000, std::size_t{1} << 30);
}

TEST(WeightTiles, RowsTakeCoefficientsWhereTheCodeIsActive) {
  for (std::size_t width = 16; width <= estimators::kTileUnits; width += 16) {
    std::vector<std::int16_t> coefficients(width);
    for (std::size_t i = 0; i < width; ++i) coefficients[i] = static_cast<std::int16_t>(i * 100);
    testing::on_every_instruction_set([&](auto level) {
      std::vector<std::int16_t> rows(64 * width, 1);
      // Slots 0, 2 and 63 are active, of which slot 0 is +1. Unit i has the coefficient 100 i.
      constexpr std::uint64_t kActive = std::uint64_t{1} << 63 | 0b101, kPositive = 1;
      estimators::add_outer(rows.data(), width, coefficients.data(), kActive, kPositive);
      EXPECT_EQ(rows[width - 1], 1 + 100 * static_cast<int>(width - 1)) << level;
      EXPECT_EQ(rows[2 * width + 1], 1 - 100) << level;
      EXPECT_EQ(rows[63 * width + 2], 1 - 200) << level;
      EXPECT_EQ(rows[width + 1], 1) << level;
    });
  }
}

}  // namespace
}  // namespace sdnn
