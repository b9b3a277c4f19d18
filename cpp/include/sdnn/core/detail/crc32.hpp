/// The checksum of files.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "sdnn/core/instruction_set.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif

namespace sdnn::core::detail {

/// Multiplies a polynomial over bits by x, and returns the remainder of the division by CRC-32's
/// generator, 0xedb88320. Coefficients are reversed: bit 31 is that of x^0, bit 0 that of x^31.
constexpr std::uint32_t crc_times_x(std::uint32_t crc) noexcept {
  return (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
}

/// kCrcTables[k][b] is the remainder of the byte b followed by k bytes of 0.
inline constexpr auto kCrcTables = [] {
  std::array<std::array<std::uint32_t, 256>, 16> tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc_times_x(crc);
    tables[0][byte] = crc;
  }
  for (std::size_t k = 1; k < tables.size(); ++k) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[k - 1][byte];
      tables[k][byte] = (before >> 8) ^ tables[0][before & 0xffU];
    }
  }
  return tables;
}();

/// Returns the remainder `crc` after further bytes. The remainder of a block of 16 is the sum (XOR)
/// of those of its bytes, each followed by 0 for the bytes after it.
inline std::uint32_t crc_by_tables(std::span<const std::byte> bytes, std::uint32_t crc) noexcept {
  static_assert(std::endian::native == std::endian::little,
                "words are read in the order of the bytes");
  for (; bytes.size() >= 16; bytes = bytes.subspan(16)) {
    std::array<std::uint64_t, 2> words{};
    std::memcpy(words.data(), bytes.data(), sizeof(words));
    words[0] ^= crc;
    crc = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      crc ^= kCrcTables[15 - k][(words[0] >> (8 * k)) & 0xffU] ^
             kCrcTables[7 - k][(words[1] >> (8 * k)) & 0xffU];
    }
  }
  for (const std::byte byte : bytes) {
    crc = (crc >> 8) ^ kCrcTables[0][(crc ^ static_cast<std::uint32_t>(byte)) & 0xffU];
  }
  return crc;
}

#if SDNN_X86_KERNELS

#define SDNN_TARGET_CLMUL gnu::target("pclmul,sse4.1")

/// Returns the remainder of x^n as a factor of carry-less products. It is doubled, because such a
/// product of two numbers with reversed coefficients has them one bit too low.
constexpr long long crc_power_of_x(int n) noexcept {
  std::uint32_t crc = 0x80000000U;  // x^0
  for (int i = 0; i < n; ++i) crc = crc_times_x(crc);
  return static_cast<long long>(crc) * 2;
}

[[SDNN_TARGET_CLMUL]] inline __m128i crc_block(const std::byte* bytes) noexcept {
  return _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes));
}

/// Folds a block into a later one: returns a block with the same remainder as `block` followed by n
/// zero bits, plus `next`. `powers` holds the remainders of x^(n + 32) and x^(n - 32).
[[SDNN_TARGET_CLMUL]] inline __m128i crc_folded(__m128i block, __m128i powers,
                                                __m128i next) noexcept {
  return _mm_xor_si128(_mm_xor_si128(_mm_clmulepi64_si128(block, powers, 0x00),
                                     _mm_clmulepi64_si128(block, powers, 0x11)),
                       next);
}

/// Returns the remainder `crc` after at least 64 further bytes. Four blocks of 16 bytes are folded,
/// each into the one 64 bytes later, until the last 64 bytes; then these are folded into 16, whose
/// remainder tables give. Source: Gopal, V. et al. (2009). Fast CRC Computation for Generic
/// Polynomials Using PCLMULQDQ Instruction. Intel.
[[SDNN_TARGET_CLMUL]] inline std::uint32_t crc_by_folding(std::span<const std::byte> bytes,
                                                          std::uint32_t crc) noexcept {
  constexpr long long k544 = crc_power_of_x(512 + 32), k480 = crc_power_of_x(512 - 32);
  constexpr long long k160 = crc_power_of_x(128 + 32), k96 = crc_power_of_x(128 - 32);
  const __m128i by_64_bytes = _mm_set_epi64x(k480, k544);
  const __m128i by_16_bytes = _mm_set_epi64x(k96, k160);
  __m128i a = crc_block(bytes.data()), b = crc_block(bytes.data() + 16);
  __m128i c = crc_block(bytes.data() + 32), d = crc_block(bytes.data() + 48);
  a = _mm_xor_si128(a, _mm_cvtsi32_si128(static_cast<int>(crc)));
  for (bytes = bytes.subspan(64); bytes.size() >= 64; bytes = bytes.subspan(64)) {
    a = crc_folded(a, by_64_bytes, crc_block(bytes.data()));
    b = crc_folded(b, by_64_bytes, crc_block(bytes.data() + 16));
    c = crc_folded(c, by_64_bytes, crc_block(bytes.data() + 32));
    d = crc_folded(d, by_64_bytes, crc_block(bytes.data() + 48));
  }
  b = crc_folded(a, by_16_bytes, b);
  c = crc_folded(b, by_16_bytes, c);
  d = crc_folded(c, by_16_bytes, d);
  std::array<std::byte, 16> rest{};
  _mm_storeu_si128(reinterpret_cast<__m128i*>(rest.data()), d);
  return crc_by_tables(bytes, crc_by_tables(rest, 0));
}

#endif

/// Returns the CRC-32 of zlib and gzip, of bytes that follow others whose CRC-32 is `crc`. By its
/// definition all bits of the remainder are inverted before the first byte and at the end.
inline std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t crc = 0) {
#if SDNN_X86_KERNELS
  if (bytes.size() >= 64 && instruction_set() >= InstructionSet::avx2 &&
      __builtin_cpu_supports("pclmul")) {
    return ~crc_by_folding(bytes, ~crc);
  }
#endif
  return ~crc_by_tables(bytes, ~crc);
}

}  // namespace sdnn::core::detail
