#include "sdnn/core/detail/interrupt_check.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace sdnn::core {
namespace {

TEST(InterruptCheck, DoesNothingByDefault) { EXPECT_NO_THROW(InterruptCheck{}()); }

TEST(InterruptCheck, CallsAndLetsThrow) {
  int n_calls = 0;
  const InterruptCheck check([&n_calls] {
    if (++n_calls == 3) throw std::runtime_error("enough");
  });
  check();
  check();
  EXPECT_THROW(check(), std::runtime_error);
  EXPECT_EQ(n_calls, 3);
}

}  // namespace
}  // namespace sdnn::core
