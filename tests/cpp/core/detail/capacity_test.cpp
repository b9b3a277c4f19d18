#include "sdnn/core/detail/capacity.hpp"

#include <gtest/gtest.h>

namespace sdnn::core {
namespace {

TEST(Capacity, PicksTheSmallestRungThatHolds) {
  EXPECT_EQ(smallest_fit(1), 0U);
  EXPECT_EQ(smallest_fit(256), 0U);
  EXPECT_EQ(smallest_fit(257), 1U);
  EXPECT_EQ(smallest_fit(4096), 2U);
}

TEST(Capacity, NamesTheLargestRung) {
  try {
    smallest_fit(4097);
    FAIL();
  } catch (const std::length_error& error) {
    EXPECT_STREQ(error.what(), "n_pattern_units must be at most 4096, got 4097");
  }
}

}  // namespace
}  // namespace sdnn::core
