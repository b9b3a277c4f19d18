#include "sdnn/estimators/detail/tile_rows.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn {
namespace {

template <class Weight>
void check_rows(std::int32_t largest, std::size_t n_per_sum) {
  core::Random random(1, core::Stream::weights);
  const auto span = static_cast<std::uint64_t>(2 * largest + 1);
  for (const std::size_t width : {16U, 32U, 48U, 64U, 80U, 96U}) {
    core::AlignedBuffer<Weight> tile(100 * width);
    for (auto& weight : tile.span()) {
      weight = static_cast<Weight>(static_cast<std::int32_t>(random.below(span)) - largest);
    }
    std::vector<std::uint32_t> plus(random.below(300));
    std::vector<std::uint32_t> minus(random.below(300));
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

TEST(TileRows, AreAddedExactly) {
  check_rows<std::int16_t>(327, 100);
  check_rows<std::int16_t>(32767, 1);
  check_rows<std::int32_t>(100000, std::size_t{1} << 30);
}

TEST(TileRows, TakeCoefficientsWhereTheCodeIsActive) {
  for (std::size_t width = 16; width <= estimators::kTileUnits; width += 16) {
    std::vector<std::int16_t> coefficients(width);
    for (std::size_t i = 0; i < width; ++i) coefficients[i] = static_cast<std::int16_t>(i * 100);
    testing::on_every_instruction_set([&](auto level) {
      std::vector<std::int16_t> rows(64 * width, 1);
      estimators::add_outer(rows.data(), width, coefficients.data(), std::uint64_t{1} << 63 | 5, 1);
      EXPECT_EQ(rows[width - 1], 1 + 100 * static_cast<int>(width - 1)) << level;
      EXPECT_EQ(rows[2 * width + 1], 1 - 100) << level;
      EXPECT_EQ(rows[63 * width + 2], 1 - 200) << level;
      EXPECT_EQ(rows[width + 1], 1) << level;
    });
  }
}

}  // namespace
}  // namespace sdnn
