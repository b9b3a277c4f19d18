#include "sdnn/coding/desensitization.hpp"

#include <gtest/gtest.h>

namespace sdnn::coding {
namespace {

using Layer = core::BitLayer<64>;

Layer layer(std::initializer_list<int> signs) {
  Layer out(signs.size());
  std::size_t k = 0;
  for (const int sign : signs) out.set(k++, sign > 0);
  return out;
}

// x = (+ + - -), modifier = (+ - + -): neutral where the modifier is -1.
TEST(Desensitize, NeutralWhereTheModifierIsOff) {
  const auto pattern = desensitize(layer({1, 1, -1, -1}), layer({1, -1, 1, -1}));
  EXPECT_EQ(pattern.active, layer({1, -1, 1, -1}));
  EXPECT_EQ(pattern.positive, layer({1, -1, -1, -1}));
}

TEST(Permute, UnitKIsUnitPermutationOfK) {
  EXPECT_EQ(permute(layer({1, -1, -1}), {2, 0, 1}), layer({-1, 1, -1}));
  EXPECT_THROW(permute(layer({1, -1, -1}), {0, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::coding
