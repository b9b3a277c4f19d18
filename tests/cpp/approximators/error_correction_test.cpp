#include "sdnn/approximators/error_correction.hpp"

#include <gtest/gtest.h>

namespace sdnn::approximators {
namespace {

std::vector<std::uint32_t> select(std::vector<std::int32_t> potentials, int deficit) {
  std::vector<std::uint32_t> selected = {99};
  select_units(potentials, deficit, selected);
  return selected;
}

using Units = std::vector<std::uint32_t>;

TEST(SelectUnits, NothingWithoutDeficit) { EXPECT_EQ(select({1, -1}, 0), Units{}); }

// Seven units in three subsets, cut at floor(7i/3): {0,1}, {2,3}, {4,5,6}.
TEST(SelectUnits, TheNearestInactiveUnitOfEachSubset) {
  EXPECT_EQ(select({-5, -3, 9, -8, -7, -2, -2}, 3), (Units{1, 3, 5}));
}

TEST(SelectUnits, TheNearestActiveUnitOfEachSubset) {
  EXPECT_EQ(select({5, 3, -9, 8, 7, 2, 2}, -3), (Units{1, 3, 5}));
}

TEST(SelectUnits, ASubsetWithoutSuchAUnitGivesNone) {
  EXPECT_EQ(select({5, 3, 9, -8, 7, 2, 2}, 3), (Units{3}));
  EXPECT_EQ(select({5, 3, 9, 8}, 2), Units{});
}

TEST(SelectUnits, APotentialOfZeroIsInactive) {
  EXPECT_EQ(select({0, -1}, 1), (Units{0}));
  EXPECT_EQ(select({0, 1}, -1), (Units{1}));
}

TEST(SelectUnits, EqualDistancesGoToTheLowestIndex) {
  EXPECT_EQ(select({-4, -4, -4}, 1), Units{0});
}

TEST(SelectUnits, OneSubsetPerUnitTakesAll) {
  EXPECT_EQ(select({-4, -40, -400}, 3), (Units{0, 1, 2}));
}

}  // namespace
}  // namespace sdnn::approximators
