#include "sdnn/core/detail/grid_cells.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "errors.hpp"

namespace {

using sdnn::core::grid_cells;
using sdnn::core::require_table_bytes;
using sdnn::testing::message_of;

constexpr std::uint64_t kNoLimit = UINT64_MAX;

std::string error_of_grid(std::size_t n_per_dimension, std::size_t n_dimensions,
                          std::size_t bytes_per_cell, std::uint64_t limit) {
  return message_of<std::length_error>(
      [&] { grid_cells("n_sets", "rules", n_per_dimension, n_dimensions, bytes_per_cell, limit); });
}

TEST(GridCells, CountsArePowersOfTheCellsPerDimension) {
  EXPECT_EQ(grid_cells("n", "cells", 9, 6, 84, kNoLimit), 531441U);  // 9^6, of 84 bytes each
  EXPECT_EQ(grid_cells("n", "cells", 4, 7, 8, kNoLimit), 16384U);    // 4^7
  EXPECT_EQ(grid_cells("n", "cells", 5, 0, 1, kNoLimit), 1U);
  EXPECT_EQ(grid_cells("n", "cells", 2, 8 * sizeof(std::size_t) - 1, 1, kNoLimit),
            SIZE_MAX / 2 + 1);  // 2^63 with 64-bit sizes
}

// Two dimensions of 10 cells, each of 8 bytes, need 800 bytes.
TEST(GridCells, ATableOfTheSizeOfTheLimitIsAcceptedAndALargerOneRefused) {
  EXPECT_EQ(error_of_grid(10, 2, 8, 800), "no error");
  EXPECT_EQ(
      error_of_grid(10, 2, 8, 799),
      "n_sets must be smaller: a table of 10^2 = 100 rules needs 800 bytes, but max_table_bytes "
      "is 799");
}

TEST(GridCells, SizesOf64BitsAndMoreAreRefused) {
  EXPECT_EQ(
      error_of_grid(2, 63, 4, kNoLimit),
      "n_sets must be smaller: a table of 2^63 = 9223372036854775808 rules needs 2^64 bytes or "
      "more, but max_table_bytes is 18446744073709551615");
  EXPECT_EQ(error_of_grid(9, 40, 84, kNoLimit),
            "n_sets must be smaller: a table of 9^40 rules needs 2^64 bytes or more, but "
            "max_table_bytes is 18446744073709551615");
}

TEST(GridCells, SizesBeyondTheAddressSpaceAreRefused) {
  EXPECT_EQ(error_of_grid(2, 33, 1, kNoLimit),
            sizeof(std::size_t) > 4 ? "no error"
                                    : "n_sets must be smaller: a table of 2^33 = 8589934592 rules "
                                      "needs 8589934592 bytes, but at most 4294967295 can be "
                                      "addressed");
}

TEST(RequireTableBytes, NamesTheSettingToReduce) {
  require_table_bytes("n_actions", "bases", 800.0, 800);
  EXPECT_EQ(
      message_of<std::length_error>([] { require_table_bytes("n_actions", "bases", 1e18, 800); }),
      "n_actions must be smaller: bases need 1000000000000000000 bytes, but max_table_bytes is "
      "800");
}

}  // namespace
