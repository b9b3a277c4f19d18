#include "sdnn/approximators/detail/high_bytes.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

using HighBytes = std::map<std::pair<std::uint32_t, int>, int>;

HighBytes listed(const HighByteLists& lists, std::size_t block) {
  HighBytes high_bytes;
  for (const HighByte& high : lists.of(block)) high_bytes[{high.column, high.unit}] = high.value;
  return high_bytes;
}

// A list has the high bytes that are not 0, by column and unit. All changes are in block 1, whose 3
// columns of 4 units never exceed the capacity of 12.
TEST(HighByteLists, HoldRandomChangesOfABlock) {
  HighByteLists lists(/*n_blocks=*/2, /*capacity=*/12);
  HighBytes expected;
  core::Random random(5, core::Stream::weights);
  for (int change = 0; change < 500; ++change) {
    const HighByte now{static_cast<std::uint32_t>(random.below(3)),
                       static_cast<std::uint8_t>(random.below(4)),
                       static_cast<std::int8_t>(static_cast<int>(random.below(3)) - 1)};
    const std::pair weight(now.column, int{now.unit});
    const auto before = expected.contains(weight) ? expected[weight] : 0;
    lists.change(1, static_cast<std::int8_t>(before), now);
    if (now.value != 0) expected[weight] = now.value;
    if (now.value == 0) expected.erase(weight);
    ASSERT_EQ(listed(lists, 1), expected);
    ASSERT_EQ(lists.size(), expected.size());
  }
  EXPECT_TRUE(lists.of(0).empty());
}

// Beyond its capacity a block's high bytes are counted, not listed, also when they become fewer.
TEST(HighByteLists, CountHighBytesBeyondTheCapacityWithoutAList) {
  HighByteLists lists(/*n_blocks=*/1, /*capacity=*/3);
  for (std::uint32_t j = 0; j < 4; ++j) lists.change(0, 0, {j, 63, 1});  // from 0 to 1
  EXPECT_TRUE(lists.is_overfull(0));
  EXPECT_TRUE(lists.of(0).empty());
  lists.change(0, 1, {2, 63, 0});  // column 2 from 1 to 0
  EXPECT_EQ(lists.size_of(0), 3U);
  EXPECT_TRUE(lists.is_overfull(0));
}

}  // namespace
}  // namespace sdnn::approximators
