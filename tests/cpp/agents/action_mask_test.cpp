#include "sdnn/agents/action_mask.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace sdnn::agents {
namespace {

const std::vector<std::uint8_t> kMask{0, 1, 0, 1, 1, 0, 1};

// A mask has the actions of all dimensions one after the other; take_part cuts off the first ones.
TEST(ActionMask, IsSplitIntoPartsOfDimensions) {
  ActionMask left = kMask;
  EXPECT_EQ(take_part(left, 3).size(), 3U);
  EXPECT_EQ(left.size(), 4U);
  EXPECT_TRUE(allows(left, 0));
  EXPECT_FALSE(allows(left, 2));
  ActionMask empty;  // allows all actions
  EXPECT_TRUE(take_part(empty, 3).empty());
  EXPECT_TRUE(allows(empty, 2));
}

TEST(ActionMask, DrawsEachAllowedAction) {  // actions 1, 3, 4 and 6, of which draw(n) picks one
  std::vector<std::size_t> drawn;
  for (std::size_t k = 0; k < 4; ++k) {
    drawn.push_back(draw_allowed(kMask, kMask.size(), [k](std::size_t n) {
      EXPECT_EQ(n, 4U);
      return k;
    }));
  }
  EXPECT_EQ(drawn, (std::vector<std::size_t>{1, 3, 4, 6}));
  EXPECT_EQ(draw_allowed({}, 9, [](std::size_t n) { return n - 1; }), 8U);  // without a mask
}

TEST(ActionMask, SetsValuesOfForbiddenActionsToMinusInfinity) {
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  std::vector<double> values{5.0, 1.0, 7.0};
  exclude(ActionMask(kMask).first(3), values);
  EXPECT_EQ(values, (std::vector<double>{kNever, 1.0, kNever}));
  exclude({}, values);
  EXPECT_EQ(values[1], 1.0);
}

TEST(ActionMask, HasZerosAndOnesAndAtLeastOneAllowedAction) {
  EXPECT_TRUE(is_mask(kMask));
  EXPECT_FALSE(is_mask(std::vector<std::uint8_t>{0, 0}));
  EXPECT_FALSE(is_mask(std::vector<std::uint8_t>{1, 2}));
}

}  // namespace
}  // namespace sdnn::agents
