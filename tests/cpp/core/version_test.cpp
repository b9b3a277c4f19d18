#include "sdnn/core/version.hpp"

#include <gtest/gtest.h>

namespace sdnn::core {
namespace {

TEST(Version, IsThatOfTheBuildFiles) { EXPECT_STREQ(kVersion, SDNN_VERSION); }

}  // namespace
}  // namespace sdnn::core
