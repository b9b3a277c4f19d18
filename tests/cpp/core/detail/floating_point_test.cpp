#include "sdnn/core/detail/floating_point.hpp"

#include <gtest/gtest.h>

namespace sdnn::core {
namespace {

// A double rounds (1 + 2^-30)^2 = 1 + 2^-29 + 2^-60 to 1 + 2^-29. A fused multiplication and
// addition would not, and return 2^-60.
TEST(FloatingPoint, ProductsAreRoundedBeforeTheyAreAdded) {
  volatile double factor = 1.0 + 0x1p-30;
  volatile double rounded = 1.0 + 0x1p-29;
  const double a = factor, b = rounded;
  EXPECT_EQ(a * a - b, 0.0);
}

}  // namespace
}  // namespace sdnn::core
