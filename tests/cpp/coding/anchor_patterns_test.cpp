#include "sdnn/coding/anchor_patterns.hpp"

#include <gtest/gtest.h>

#include "errors.hpp"

namespace sdnn::coding {
namespace {

PatternTable table_of_paper(std::uint64_t seed, AnchorConfig config = {.n_units = 200}) {
  core::Random random(seed, core::Stream::code_books);
  return anchor_patterns(config, random);
}

// The paper has 8 anchor patterns of 200 units, 45 bins apart.
TEST(AnchorPatterns, AnchorsHaveHalfOfTheirUnitsOn) {
  const PatternTable table = table_of_paper(2);
  for (std::size_t anchor = 0; anchor < 8; ++anchor) {
    EXPECT_EQ(table[45 * anchor].count(), 200U / 2);
  }
}

TEST(AnchorPatterns, UnbalancedAnchorsHaveIndependentUnits) {
  core::Random random(6, core::Stream::code_books), same_random = random;
  const PatternTable table = anchor_patterns(
      {.n_units = 70, .n_anchor_patterns = 2, .n_interpolated = 0, .balanced = false}, random);
  for (std::size_t k = 0; k < 70; ++k) EXPECT_EQ(table[0][k], same_random.below(2) == 1);
}

TEST(AnchorPatterns, AnchorsOfOddSizeAreBalancedToOneUnit) {
  const PatternTable table = table_of_paper(2, {.n_units = 7});
  EXPECT_EQ(table[0].count(), 3U);  // of 7
}

// Anchors are 45 of 360 bins apart. Between two of them each unit in which they differ flips once:
// after j bins floor(j * differing / 45) units have flipped.
TEST(AnchorPatterns, NeighboursDifferByEqualPortionsOfUnits) {
  for (const bool circular : {false, true}) {
    const PatternTable table = table_of_paper(3, {.n_units = 200, .circular = circular});
    for (std::size_t first = 0; first < (circular ? 360U : 315U); first += 45) {
      const std::size_t last = (first + 45) % 360, differing = table[first].distance(table[last]);
      for (std::size_t j = 0; j < 45; ++j) {
        const std::size_t here = first + j, n_flipped = j * differing / 45;
        const std::size_t n_flipped_next = (j + 1) * differing / 45;
        EXPECT_EQ(table[first].distance(table[here]), n_flipped);
        EXPECT_EQ(table[here].distance(table[last]), differing - n_flipped);
        EXPECT_EQ(table[here].distance(table[(here + 1) % 360]), n_flipped_next - n_flipped);
      }
    }
  }
}

TEST(AnchorPatterns, RefuseBadSizesByName) {
  const auto message = [](AnchorConfig config) {
    return testing::message_of([&] { table_of_paper(1, config); });
  };
  EXPECT_EQ(message({.n_units = 1}), "n_units must be in [2, 16777216], got 1");
  EXPECT_EQ(message({.n_units = 9, .n_anchor_patterns = 1}),
            "n_anchor_patterns must be in [2, 10000], got 1");
  EXPECT_EQ(message({.n_units = 9, .n_interpolated = -1}),
            "n_interpolated must be in [0, 10000], got -1");
}

}  // namespace
}  // namespace sdnn::coding
