#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::core {
namespace {

template <class Integer, class Wide>
void expect_exact_sums_in_register() {
  constexpr std::size_t kSize = IntegerRegister<Integer>::kSize;
  static_assert(kSize * sizeof(Integer) == 32);
  std::vector<Integer> added(kSize), subtracted(kSize);
  for (std::size_t i = 0; i < kSize; ++i) {
    added[i] = static_cast<Integer>(3 * i);
    subtracted[i] = static_cast<Integer>(i % 2 == 0 ? 5 : -7);
  }
  IntegerRegister<Integer> sum;
  sum.clear();
  sum.add(added.data());
  sum.subtract(subtracted.data());
  std::vector<Integer> stored(kSize);
  sum.store(stored.data());
  std::vector<Wide> wide(kSize, 100);
  sum.add_to(wide.data());
  for (std::size_t i = 0; i < kSize; ++i) {
    EXPECT_EQ(stored[i], added[i] - subtracted[i]);
    EXPECT_EQ(wide[i], 100 + added[i] - subtracted[i]);
  }
  sum.load(subtracted.data());
  sum.store(stored.data());
  EXPECT_EQ(stored, subtracted);
}

TEST(IntegerRegister, AddsSubtractsAndWidens) {
  expect_exact_sums_in_register<std::int8_t, std::int16_t>();
  expect_exact_sums_in_register<std::int8_t, std::int32_t>();
  expect_exact_sums_in_register<std::int16_t, std::int32_t>();
  expect_exact_sums_in_register<std::int32_t, std::int32_t>();
}

TEST(IntegerRegister, WrapsAround) {
  constexpr std::int16_t kMost = std::numeric_limits<std::int16_t>::max();
  const std::vector<std::int16_t> most(16, kMost);  // a register of 256 bits
  IntegerRegister<std::int16_t> sum;
  sum.load(most.data());
  sum.add(most.data());
  std::vector<std::int16_t> stored(16);
  sum.store(stored.data());
  EXPECT_EQ(stored, std::vector<std::int16_t>(16, -2));  // 2 (2^15 - 1) - 2^16
  sum.subtract(most.data());
  sum.store(stored.data());
  EXPECT_EQ(stored, most);
}

}  // namespace
}  // namespace sdnn::core
