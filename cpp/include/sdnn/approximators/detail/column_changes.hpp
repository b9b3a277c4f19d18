/// Kernels on the weights of a block of units: corrections, and the largest weight of each unit.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "sdnn/approximators/detail/column_sums.hpp"
#include "sdnn/core/detail/integer_register.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::approximators {

namespace detail {

using ByteRegister = core::IntegerRegister<std::int8_t>;
inline constexpr std::size_t kRegistersOfColumn = kBlockUnits / ByteRegister::kSize;

SDNN_INLINE void add_to_columns_body(std::int8_t* block, const std::uint32_t* columns,
                                     std::size_t n_columns, const Bytes& change) noexcept {
  for (std::size_t k = 0; k < n_columns; ++k) {
    std::int8_t* const column = block + columns[k] * kBlockUnits;
    core::unrolled<kRegistersOfColumn>([&](auto r) SDNN_INLINE_LAMBDA {
      ByteRegister sum;
      sum.load(column + r() * ByteRegister::kSize);
      sum.add(change.data() + r() * ByteRegister::kSize);
      sum.store(column + r() * ByteRegister::kSize);
    });
  }
}

/// The bytes are copied first, because they may alias any memory.
inline void find_largest_bytes_portable(const std::int8_t* block, std::size_t n_columns,
                                        Bytes& largest) noexcept {
  Bytes highest{};
  Bytes lowest{};
  for (std::size_t j = 0; j < n_columns; ++j) {
    Bytes bytes;
    std::copy_n(block + j * kBlockUnits, kBlockUnits, bytes.begin());
    for (std::size_t i = 0; i < kBlockUnits; ++i) highest[i] = std::max(highest[i], bytes[i]);
    for (std::size_t i = 0; i < kBlockUnits; ++i) lowest[i] = std::min(lowest[i], bytes[i]);
  }
  for (std::size_t i = 0; i < kBlockUnits; ++i) {
    largest[i] = std::max(highest[i], static_cast<std::int8_t>(-lowest[i]));
  }
}

#if SDNN_X86_KERNELS

[[SDNN_TARGET_AVX2]] inline void find_largest_bytes_avx2(const std::int8_t* block,
                                                         std::size_t n_columns, Bytes& largest) {
  __m256i first = _mm256_setzero_si256();
  __m256i second = first;
  for (const std::int8_t* end = block + n_columns * kBlockUnits; block != end;
       block += kBlockUnits) {
    const auto* const bytes = reinterpret_cast<const __m256i*>(block);
    first = _mm256_max_epi8(first, _mm256_abs_epi8(_mm256_load_si256(bytes)));
    second = _mm256_max_epi8(second, _mm256_abs_epi8(_mm256_load_si256(bytes + 1)));
  }
  auto* const to = reinterpret_cast<__m256i*>(largest.data());
  _mm256_storeu_si256(to, first);
  _mm256_storeu_si256(to + 1, second);
}

[[SDNN_TARGET_AVX2]] inline void find_largest_bytes_avx512(const std::int8_t* block,
                                                           std::size_t n_columns, Bytes& largest) {
  find_largest_bytes_avx2(block, n_columns, largest);
}

#endif

}  // namespace detail

/// Adds `change`, a byte for each unit, to columns of a block, modulo 256.
SDNN_KERNEL(void, add_to_columns,
            (std::int8_t* block, const std::uint32_t* columns, std::size_t n_columns,
             const detail::Bytes& change),
            (block, columns, n_columns, change))

SDNN_KERNEL_NEON(void, find_largest_bytes,
                 (const std::int8_t* block, std::size_t n_columns, detail::Bytes& largest),
                 (block, n_columns, largest))

/// The largest |byte| of each unit in the first columns of a block. No byte may be -128.
SDNN_DISPATCH(void, find_largest_bytes,
              (const std::int8_t* block, std::size_t n_columns, detail::Bytes& largest),
              (block, n_columns, largest))

}  // namespace sdnn::approximators
