#include "sdnn/approximators/detail/column_set.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace sdnn::approximators {
namespace {

TEST(ColumnSet, HoldsWhatWasAddedOnce) {
  ColumnSet set(130);
  EXPECT_EQ(set.size(), 0U);
  for (const std::size_t column : {0U, 63U, 64U, 129U, 64U}) set.add(column);
  EXPECT_EQ(set.size(), 4U);
  EXPECT_TRUE(set.holds(64) && set.holds(129));
  EXPECT_FALSE(set.holds(1) || set.holds(128));
}

TEST(ColumnSet, SelectsInTheOrderGiven) {
  ColumnSet set(100);
  set.add(7);
  set.add(70);
  const std::vector<std::uint32_t> columns = {70, 1, 7, 70, 99};
  std::vector<std::uint32_t> out(columns.size());
  ASSERT_EQ(set.select(columns, out.data()), 3U);
  out.resize(3);
  EXPECT_EQ(out, (std::vector<std::uint32_t>{70, 7, 70}));
  EXPECT_EQ(ColumnSet(100).select(columns, std::vector<std::uint32_t>(5).data()), 0U);
}

}  // namespace
}  // namespace sdnn::approximators
