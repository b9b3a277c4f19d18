#include "sdnn/core/detail/aligned_buffer.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <new>

namespace sdnn::core {
namespace {

TEST(AlignedBuffer, IsZeroedAlignedAndCopiedByValue) {
  for (const std::size_t size : {1U, 63U, 1000U}) {
    AlignedBuffer<std::int16_t> buffer(size);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(buffer.data()) % kCacheLine, 0U);
    for (const std::int16_t item : buffer.span()) EXPECT_EQ(item, 0);
    buffer[size - 1] = 7;
    AlignedBuffer<std::int16_t> copy = buffer;
    copy[size - 1] = 8;
    EXPECT_EQ(buffer[size - 1], 7);
    const AlignedBuffer<std::int16_t> moved = std::move(copy);
    EXPECT_EQ(moved[size - 1], 8);
  }
  EXPECT_EQ(AlignedBuffer<std::int8_t>().size(), 0U);
}

TEST(AlignedBuffer, RefusesSizesThatOverflow) {
  // Numbers of 4 bytes: SIZE_MAX - 3 bytes are too many with the cache line for their alignment.
  EXPECT_THROW(AlignedBuffer<std::int32_t>(SIZE_MAX / 4), std::bad_alloc);
  EXPECT_EQ(checked_product(SIZE_MAX / 3, 3), SIZE_MAX);
  EXPECT_THROW(checked_product(SIZE_MAX / 3 + 1, 3), std::bad_alloc);
  EXPECT_EQ(checked_product(0, SIZE_MAX), 0U);
}

TEST(AlignedBuffer, RoundsUp) {
  EXPECT_EQ(round_up(900, 64), 960U);
  EXPECT_EQ(round_up(960, 64), 960U);
  EXPECT_EQ(round_up(0, 64), 0U);
}

}  // namespace
}  // namespace sdnn::core
