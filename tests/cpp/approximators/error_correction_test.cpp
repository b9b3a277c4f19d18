#include "sdnn/approximators/error_correction.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

std::vector<std::uint32_t> select(std::vector<std::int32_t> potentials, int deficit) {
  std::vector<std::uint32_t> selected = {99};  // of an earlier call: overwritten
  select_units(potentials, deficit, selected);
  return selected;
}

using Units = std::vector<std::uint32_t>;

TEST(SelectUnits, SelectsNoneWithoutDeficit) { EXPECT_EQ(select({1, -1}, /*deficit=*/0), Units{}); }

// Three more units should fire: of seven one in each of three subsets, cut at floor(7 i / 3), which
// are {0, 1}, {2, 3} and {4, 5, 6}.
TEST(SelectUnits, SelectsTheNearestInactiveUnitOfEachSubset) {
  EXPECT_EQ(select({-5, -3, 9, -8, -7, -2, -2}, /*deficit=*/3), (Units{1, 3, 5}));
}

TEST(SelectUnits, SelectsTheNearestActiveUnitOfEachSubset) {
  EXPECT_EQ(select({5, 3, -9, 8, 7, 2, 2}, /*deficit=*/-3), (Units{1, 3, 5}));
}

TEST(SelectUnits, SelectsNoneOfASubsetWithoutSuchAUnit) {
  EXPECT_EQ(select({5, 3, 9, -8, 7, 2, 2}, /*deficit=*/3), (Units{3}));  // the only inactive unit
  EXPECT_EQ(select({5, 3, 9, 8}, /*deficit=*/2), Units{});               // all units are active
}

TEST(SelectUnits, CountsAPotentialOfZeroAsInactive) {
  EXPECT_EQ(select({0, -1}, /*deficit=*/1), (Units{0}));
  EXPECT_EQ(select({0, 1}, /*deficit=*/-1), (Units{1}));
}

TEST(SelectUnits, SelectsTheLowestIndexOfEqualDistances) {
  EXPECT_EQ(select({-4, -4, -4}, /*deficit=*/1), Units{0});
}

TEST(SelectUnits, SelectsAllWithOneSubsetPerUnit) {
  EXPECT_EQ(select({-4, -40, -400}, /*deficit=*/3), (Units{0, 1, 2}));
}

TEST(SelectUnits, SelectsTheSameUnitsOnEveryInstructionSet) {
  core::Random random(1, core::Stream::weights);
  for (int size = 1; size < 150; ++size) {
    std::vector<std::int32_t> potentials(static_cast<std::size_t>(size));
    const auto largest = 1 + random.below(size % 3 == 0 ? 3 : 1000);
    for (auto& h : potentials) {
      h = static_cast<std::int32_t>(random.below(2 * largest)) - static_cast<std::int32_t>(largest);
    }
    for (const int deficit : {1, -1, (size + 1) / 2, -size}) {
      const auto n = static_cast<std::size_t>(std::abs(deficit));
      Units expected;  // by the definition: the nearest unit of each subset that can change
      for (std::size_t i = 0; i < n; ++i) {
        std::size_t best = potentials.size();
        const std::size_t end = (i + 1) * potentials.size() / n;
        for (std::size_t unit = i * potentials.size() / n; unit < end; ++unit) {
          const std::int32_t h = potentials[unit];
          if ((h > 0) != (deficit < 0)) continue;
          if (best == potentials.size() || std::abs(h) < std::abs(potentials[best])) best = unit;
        }
        if (best != potentials.size()) expected.push_back(static_cast<std::uint32_t>(best));
      }
      testing::on_every_instruction_set(
          [&](auto level) { ASSERT_EQ(select(potentials, deficit), expected) << level; });
    }
  }
}

}  // namespace
}  // namespace sdnn::approximators
