#include "sdnn/core/detail/crc32.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <span>
#include <string>

namespace sdnn::core::detail {
namespace {

std::uint32_t crc32_of(const std::string& text, std::uint32_t before = 0) {
  return crc32(std::as_bytes(std::span(text)), before);
}

TEST(Crc32, IsThatOfZlib) {
  EXPECT_EQ(crc32_of(""), 0U);
  EXPECT_EQ(crc32_of("a"), 0xe8b7be43U);
  EXPECT_EQ(crc32_of("123456789"), 0xcbf43926U);  // the check value of catalogues
  EXPECT_EQ(crc32_of("The quick brown fox jumps over the lazy dog"), 0x414fa339U);
}

TEST(Crc32, ContinuesWithTheBytesThatFollow) {
  const std::string text = "bytes in two parts, of any lengths";
  for (std::size_t n = 0; n <= text.size(); ++n) {
    EXPECT_EQ(crc32_of(text.substr(n), crc32_of(text.substr(0, n))), crc32_of(text)) << n;
  }
}

}  // namespace
}  // namespace sdnn::core::detail
