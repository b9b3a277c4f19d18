#include "sdnn/core/errors.hpp"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

namespace sdnn::core {
namespace {

// Without exceptions: tests/python/core/test_compiler_options.py.
TEST(Fail, ThrowsTheErrorItself) {
  try {
    fail(std::out_of_range("index must be below 3, got 4"));
  } catch (const std::out_of_range& error) {
    EXPECT_STREQ(error.what(), "index must be below 3, got 4");
  }
  EXPECT_THROW(fail(std::bad_alloc()), std::bad_alloc);
}

}  // namespace
}  // namespace sdnn::core
