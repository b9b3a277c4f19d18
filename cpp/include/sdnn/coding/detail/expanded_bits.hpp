/// Bits of codes as bytes, +1, 0 or -1.
#pragma once

#include <cstdint>

#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::coding::detail {

SDNN_WIDE_VECTORS_BEGIN

/// Sets entries[k] = bit k of `plus` minus bit k of `minus`, for 32 bits.
SDNN_INLINE void expand_bits(std::uint32_t plus, std::uint32_t minus,
                             std::int8_t* entries) noexcept {
#if SDNN_LANES
  using Bytes = core::IntegerRegister<std::int8_t>;
  typedef std::uint8_t Bits __attribute__((vector_size(32)));
  // Byte k of the result depends on bit k, which is bit k % 8 of byte k / 8 of `bits`. The fastest
  // shuffles move bytes only within a half of 16 bytes. So the register begins as eight copies of
  // the four bytes: the lower half repeats its bytes 0 and 1, and the upper half repeats bytes 2
  // and 3 of the copy that begins at byte 16. A comparison then makes 0 or -1 (all ones) of a bit.
  constexpr Bits kOwn = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128,  //
                         1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
  const auto all_ones_if_set = [&](std::uint32_t bits) SDNN_INLINE_LAMBDA {
    typedef std::uint32_t Copies __attribute__((vector_size(32)));
    const Bits copies = (Bits)(Copies{} + bits);
    const Bits own = __builtin_shufflevector(copies, copies,                                  //
                                             0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1,  //
                                             18, 18, 18, 18, 18, 18, 18, 18,                  //
                                             19, 19, 19, 19, 19, 19, 19, 19);
    return Bytes{(Bytes::Vector)((own & kOwn) == kOwn)};
  };
  Bytes{all_ones_if_set(minus).v - all_ones_if_set(plus).v}.store(entries);
#else
  for (int k = 0; k < 32; ++k) {
    entries[k] = static_cast<std::int8_t>(static_cast<int>(plus >> k & 1) -
                                          static_cast<int>(minus >> k & 1));
  }
#endif
}

SDNN_WIDE_VECTORS_END

/// Sets entries[k] = bit k of `plus` minus bit k of `minus`, for 64 bits.
SDNN_INLINE void expand_word(std::uint64_t plus, std::uint64_t minus,
                             std::int8_t* entries) noexcept {
  expand_bits(static_cast<std::uint32_t>(plus), static_cast<std::uint32_t>(minus), entries);
  expand_bits(static_cast<std::uint32_t>(plus >> 32), static_cast<std::uint32_t>(minus >> 32),
              entries + 32);
}

}  // namespace sdnn::coding::detail
