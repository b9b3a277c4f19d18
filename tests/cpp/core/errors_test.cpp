#include "sdnn/core/errors.hpp"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>
#include <string>

#include "errors.hpp"

namespace sdnn::core {
namespace {

// tests/python/core/test_compiler_options.py tests builds without exceptions.
TEST(Fail, ThrowsItsArgumentWithTypeAndMessage) {
  const std::string message = "index must be below 3, got 4";
  EXPECT_EQ(testing::message_of<std::out_of_range>([&] { fail(std::out_of_range(message)); }),
            message);
  EXPECT_THROW(fail(std::bad_alloc()), std::bad_alloc);
}

}  // namespace
}  // namespace sdnn::core
