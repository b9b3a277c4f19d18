/// 32 bytes of integers side by side, for kernels.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::core {

#if SDNN_LANES

// GCC's note about passing wide vectors concerns calls, which are all inlined here.
#if !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

/// A register of the integers that fit into 32 bytes; sums wrap around.
template <class Integer>
struct IntegerRegister {
  typedef Integer Vector __attribute__((vector_size(32)));
  typedef std::make_unsigned_t<Integer> Wrapping __attribute__((vector_size(32)));
  static constexpr std::size_t kSize = 32 / sizeof(Integer);

  Vector v;

  SDNN_INLINE void clear() noexcept { v = Vector{}; }
  SDNN_INLINE void load(const Integer* from) noexcept { std::memcpy(&v, from, sizeof v); }
  SDNN_INLINE void add(const Integer* from) noexcept {
    Wrapping other;
    std::memcpy(&other, from, sizeof other);
    v = (Vector)((Wrapping)v + other);
  }
  SDNN_INLINE void subtract(const Integer* from) noexcept {
    Wrapping other;
    std::memcpy(&other, from, sizeof other);
    v = (Vector)((Wrapping)v - other);
  }
  SDNN_INLINE void store(Integer* to) const noexcept { std::memcpy(to, &v, sizeof v); }
  /// Adds the i-th integer to to[i], whose type is at least as wide.
  template <class Wide>
  SDNN_INLINE void add_to(Wide* to) const noexcept {
    if constexpr (sizeof(Wide) == sizeof(Integer)) {
      IntegerRegister sum = *this;
      sum.add(to);
      sum.store(to);
    } else {  // interleaves integers with their signs, because GCC converts vectors slowly
      using Twice = std::conditional_t<sizeof(Integer) == 1, std::int16_t, std::int32_t>;
      using Half = IntegerRegister<Twice>;
      static_assert(std::endian::native == std::endian::little, "the sign comes second");
      const Vector sign = (Vector)(v < 0);
      [&]<std::size_t... Index>(std::index_sequence<Index...>) SDNN_INLINE_LAMBDA {
        Half{(typename Half::Vector)__builtin_shufflevector(v, sign,
                                                            (Index / 2 + Index % 2 * kSize)...)}
            .add_to(to);
        Half{(typename Half::Vector)__builtin_shufflevector(
                 v, sign, (kSize / 2 + Index / 2 + Index % 2 * kSize)...)}
            .add_to(to + kSize / 2);
      }(std::make_index_sequence<kSize>());
    }
  }
};

#if !defined(__clang__)
#pragma GCC diagnostic pop
#endif

#else

template <class Integer>
struct IntegerRegister {
  static constexpr std::size_t kSize = 32 / sizeof(Integer);

  Integer v[kSize];

  void clear() noexcept { std::fill_n(v, kSize, Integer{0}); }
  void load(const Integer* from) noexcept { std::copy_n(from, kSize, v); }
  void add(const Integer* from) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) v[i] = static_cast<Integer>(v[i] + from[i]);
  }
  void subtract(const Integer* from) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) v[i] = static_cast<Integer>(v[i] - from[i]);
  }
  void store(Integer* to) const noexcept { std::copy_n(v, kSize, to); }
  template <class Wide>
  void add_to(Wide* to) const noexcept {
    for (std::size_t i = 0; i < kSize; ++i) to[i] = static_cast<Wide>(to[i] + v[i]);
  }
};

#endif  // SDNN_LANES

}  // namespace sdnn::core
