#include "sdnn/core/detail/crc32.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "instruction_sets.hpp"

namespace sdnn::core::detail {
namespace {

std::uint32_t crc32_of(const std::string& text, std::uint32_t before = 0) {
  return crc32(std::as_bytes(std::span(text)), before);
}

TEST(Crc32, EqualsZlib) {
  EXPECT_EQ(crc32_of(""), 0U);
  EXPECT_EQ(crc32_of("a"), 0xe8b7be43U);
  EXPECT_EQ(crc32_of("123456789"), 0xcbf43926U);  // the published check value of CRC-32
  EXPECT_EQ(crc32_of("The quick brown fox jumps over the lazy dog"), 0x414fa339U);
}

/// The CRC by its definition, bit by bit.
std::uint32_t crc32_by_bits(const std::string& text) {
  std::uint32_t crc = ~0U;
  for (const char letter : text) {
    crc ^= static_cast<unsigned char>(letter);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

TEST(Crc32, OfAllAndOfTwoPartsEqualsItsDefinitionOnEveryInstructionSet) {
  std::string text;
  // Bytes of a linear congruential generator, up to four blocks of 64 bytes and a rest.
  for (std::uint32_t n = 0, x = 1; n < 300; ++n, x = x * 1103515245U + 12345U) {
    const std::uint32_t expected = crc32_by_bits(text);
    testing::on_every_instruction_set([&](auto name) {
      EXPECT_EQ(crc32_of(text), expected) << n << " bytes, " << name;
      EXPECT_EQ(crc32_of(text.substr(n / 3), crc32_of(text.substr(0, n / 3))), expected) << n;
    });
    text.push_back(static_cast<char>(x >> 16));
  }
}

}  // namespace
}  // namespace sdnn::core::detail
