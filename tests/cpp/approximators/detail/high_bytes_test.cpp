#include "sdnn/approximators/detail/high_bytes.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

using Places = std::map<std::pair<std::uint32_t, int>, int>;

Places listed(const HighByteLists& lists, std::size_t block) {
  Places places;
  for (const HighByte& high : lists.of(block)) places[{high.column, high.unit}] = high.value;
  return places;
}

TEST(HighByteLists, HoldRandomChangesOfABlock) {
  HighByteLists lists(/*n_blocks=*/2, /*capacity=*/12);
  Places expected;
  core::Random random(5, core::Stream::weights);
  for (int change = 0; change < 500; ++change) {
    const HighByte now{static_cast<std::uint32_t>(random.below(3)),
                       static_cast<std::uint8_t>(random.below(4)),
                       static_cast<std::int8_t>(static_cast<int>(random.below(3)) - 1)};
    const std::pair place(now.column, int{now.unit});
    const auto before = expected.contains(place) ? expected[place] : 0;
    lists.change(1, static_cast<std::int8_t>(before), now);
    if (now.value != 0) expected[place] = now.value;
    if (now.value == 0) expected.erase(place);
    ASSERT_EQ(listed(lists, 1), expected);
    ASSERT_EQ(lists.size(), expected.size());
  }
  EXPECT_TRUE(lists.of(0).empty());
}

TEST(HighByteLists, CountOnlyWhatExceedsTheCapacity) {
  HighByteLists lists(/*n_blocks=*/1, /*capacity=*/3);
  for (std::uint32_t j = 0; j < 4; ++j) lists.change(0, 0, {j, 63, 1});
  EXPECT_TRUE(lists.is_overfull(0));
  EXPECT_TRUE(lists.of(0).empty());
  lists.change(0, 1, {2, 63, 0});
  EXPECT_EQ(lists.size_of(0), 3U);
  EXPECT_TRUE(lists.is_overfull(0));
}

}  // namespace
}  // namespace sdnn::approximators
