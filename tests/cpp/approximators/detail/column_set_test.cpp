#include "sdnn/approximators/detail/column_set.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "instruction_sets.hpp"

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

TEST(ColumnSet, RemovesWhatItHolds) {
  ColumnSet set(70);
  set.add(3);
  set.add(69);
  set.remove(3);
  set.remove(4);
  EXPECT_EQ(set.size(), 1U);
  EXPECT_EQ(set.words()[0].to_ullong(), 0U);
  EXPECT_EQ(set.words()[1].to_ullong(), std::uint64_t{1} << 5);
}

TEST(ListedColumns, FindsThoseInASetAsOftenAsTheyCome) {
  ColumnSet set(200);
  for (const std::size_t column : {7U, 70U, 130U, 199U}) set.add(column);
  const std::vector<std::uint32_t> columns = {1, 7, 7, 8, 70, 130, 131, 130, 2};
  std::array<std::uint32_t, 17> out{};
  const ListedColumns<16> listed(columns);
  sdnn::testing::on_every_instruction_set([&](auto level) {
    const auto n = static_cast<std::ptrdiff_t>(listed.in(set, out.data()));
    EXPECT_EQ(std::vector<std::uint32_t>(out.begin(), out.begin() + n),
              (std::vector<std::uint32_t>{7, 7, 70, 130, 130}))
        << level;
  });
  EXPECT_EQ(listed.in(ColumnSet(200), out.data()), 0U);
}

}  // namespace
}  // namespace sdnn::approximators
