/// Several numbers side by side in a vector register: doubles, or 32 bytes of integers.
///
/// A formula written as a template over its number type runs on one double or on several of them,
/// by the same IEEE operations in the same order, hence with the same bits in every lane.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "sdnn/core/detail/floating_point.hpp"

#if defined(__clang__) || \
    (defined(__GNUC__) && __GNUC__ >= 12)  // the first with __builtin_shufflevector
#define SDNN_LANES 1
/// SDNN_INLINE forces inlining. A kernel for an instruction set must inline everything that it
/// uses: others are compiled for the baseline, whose registers are too narrow.
#define SDNN_INLINE __attribute__((always_inline)) inline
#define SDNN_INLINE_LAMBDA __attribute__((always_inline))
#else
#define SDNN_LANES 0
#define SDNN_INLINE inline
#define SDNN_INLINE_LAMBDA
#endif

// These macros enclose functions with wide vectors and silence GCC's warning about the convention
// for passing them, which has no effect because all are inlined.
#if SDNN_LANES && !defined(__clang__)
#define SDNN_WIDE_VECTORS_BEGIN \
  _Pragma("GCC diagnostic push") _Pragma("GCC diagnostic ignored \"-Wpsabi\"")
#define SDNN_WIDE_VECTORS_END _Pragma("GCC diagnostic pop")
#else
#define SDNN_WIDE_VECTORS_BEGIN
#define SDNN_WIDE_VECTORS_END
#endif

namespace sdnn::core {

// The functions below exist for a double and for Lanes, so that a formula compiles for both. The
// result of a comparison, a mask, is a bool for a double and LaneBits for Lanes.

/// Returns `first` where the mask is set, `second` elsewhere.
SDNN_INLINE double select(bool mask, double first, double second) noexcept {
  return mask ? first : second;
}
/// Whether the mask is set in any lane.
SDNN_INLINE bool any(bool mask) noexcept { return mask; }
SDNN_INLINE bool both(bool first, bool second) noexcept { return first && second; }
/// Whether the first mask is set and the second is not.
SDNN_INLINE bool first_only(bool first, bool second) noexcept { return first && !second; }
SDNN_INLINE std::uint64_t bits_of(double value) noexcept {
  return std::bit_cast<std::uint64_t>(value);
}
SDNN_INLINE double double_of(std::uint64_t bits) noexcept { return std::bit_cast<double>(bits); }
/// Returns `first` if it is less than `second`; else `second`, also if a number is NaN.
SDNN_INLINE double smaller(double first, double second) noexcept {
  return first < second ? first : second;
}

#if SDNN_LANES

SDNN_WIDE_VECTORS_BEGIN

/// `Size` unsigned 64-bit integers. In a mask all bits of an integer are set, or none.
template <std::size_t Size>
struct LaneBits {
  typedef std::uint64_t Vector __attribute__((vector_size(Size * sizeof(std::uint64_t))));

  Vector v;

  SDNN_INLINE static LaneBits load(const std::uint64_t* from) noexcept {
    LaneBits result;
    std::memcpy(&result.v, from, sizeof result.v);
    return result;
  }
  SDNN_INLINE void store(std::uint64_t* to) const noexcept { std::memcpy(to, &v, sizeof v); }

  SDNN_INLINE friend LaneBits operator&(const LaneBits& a, const LaneBits& b) noexcept {
    return {a.v & b.v};
  }
  SDNN_INLINE friend LaneBits operator^(const LaneBits& a, const LaneBits& b) noexcept {
    return {a.v ^ b.v};
  }
  SDNN_INLINE friend LaneBits operator&(const LaneBits& a, std::uint64_t b) noexcept {
    return {a.v & b};
  }
  SDNN_INLINE friend LaneBits operator+(const LaneBits& a, std::uint64_t b) noexcept {
    return {a.v + b};
  }
  SDNN_INLINE friend LaneBits operator-(std::uint64_t a, const LaneBits& b) noexcept {
    return {a - b.v};
  }
  SDNN_INLINE friend LaneBits operator<<(const LaneBits& a, int by) noexcept {
    return {a.v << static_cast<std::uint64_t>(by)};
  }
};

/// `Size` doubles, a power of two; arithmetic and comparison lane by lane.
template <std::size_t Size>
struct Lanes {
  typedef double Vector __attribute__((vector_size(Size * sizeof(double))));
  using Bits = LaneBits<Size>;

  Vector v;

  Lanes() = default;
  SDNN_INLINE explicit Lanes(const Vector& values) noexcept : v(values) {}
  /// Sets every lane to a number.
  SDNN_INLINE Lanes(double value) noexcept : Lanes(value, std::make_index_sequence<Size>()) {}

  /// `Size` numbers from memory, at any alignment.
  SDNN_INLINE static Lanes load(const double* from) noexcept {
    Lanes result;
    std::memcpy(&result.v, from, sizeof result.v);
    return result;
  }
  SDNN_INLINE void store(double* to) const noexcept { std::memcpy(to, &v, sizeof v); }

  SDNN_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) noexcept {
    return Lanes(a.v + b.v);
  }
  SDNN_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) noexcept {
    return Lanes(a.v - b.v);
  }
  SDNN_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) noexcept {
    return Lanes(a.v * b.v);
  }
  SDNN_INLINE friend Lanes operator/(const Lanes& a, const Lanes& b) noexcept {
    return Lanes(a.v / b.v);
  }
  SDNN_INLINE friend Bits operator<(const Lanes& a, const Lanes& b) noexcept {
    return {(typename Bits::Vector)(a.v < b.v)};
  }
  SDNN_INLINE friend Bits operator<=(const Lanes& a, const Lanes& b) noexcept {
    return {(typename Bits::Vector)(a.v <= b.v)};
  }
  SDNN_INLINE friend Bits operator>=(const Lanes& a, const Lanes& b) noexcept {
    return {(typename Bits::Vector)(a.v >= b.v)};
  }

 private:
  template <std::size_t... Lane>
  SDNN_INLINE Lanes(double value, std::index_sequence<Lane...>) noexcept
      : v{(static_cast<void>(Lane), value)...} {}
};

template <std::size_t Size>
SDNN_INLINE LaneBits<Size> bits_of(const Lanes<Size>& values) noexcept {
  return {(typename LaneBits<Size>::Vector)values.v};
}

template <std::size_t Size>
SDNN_INLINE Lanes<Size> double_of(const LaneBits<Size>& bits) noexcept {
  return Lanes<Size>((typename Lanes<Size>::Vector)bits.v);
}

template <std::size_t Size>
SDNN_INLINE Lanes<Size> select(bool mask, const Lanes<Size>& first,
                               const Lanes<Size>& second) noexcept {
  return mask ? first : second;
}

template <std::size_t Size>
SDNN_INLINE Lanes<Size> select(const LaneBits<Size>& mask, const Lanes<Size>& first,
                               const Lanes<Size>& second) noexcept {
  using Vector = typename LaneBits<Size>::Vector;
  return double_of(LaneBits<Size>{((Vector)first.v & mask.v) | ((Vector)second.v & ~mask.v)});
}

template <std::size_t Size>
SDNN_INLINE Lanes<Size> smaller(const Lanes<Size>& first, const Lanes<Size>& second) noexcept {
  return Lanes<Size>(first.v < second.v ? first.v : second.v);
}

template <std::size_t Size>
SDNN_INLINE bool any(const LaneBits<Size>& mask) noexcept {
  std::uint64_t united = 0;
  for (std::size_t i = 0; i < Size; ++i) united |= mask.v[i];
  return united != 0;
}

template <std::size_t Size>
SDNN_INLINE LaneBits<Size> both(const LaneBits<Size>& first,
                                const LaneBits<Size>& second) noexcept {
  return {first.v & second.v};
}

template <std::size_t Size>
SDNN_INLINE LaneBits<Size> first_only(const LaneBits<Size>& first,
                                      const LaneBits<Size>& second) noexcept {
  return {first.v & ~second.v};
}

SDNN_WIDE_VECTORS_END

#endif  // SDNN_LANES

/// The value with its sign bit cleared.
template <class Real>
SDNN_INLINE Real magnitude(const Real& value) noexcept {
  return double_of(bits_of(value) & ~(std::uint64_t{1} << 63));
}

/// Calls `function` with 0, 1, ..., Size - 1, each a std::integral_constant. No loop remains at any
/// level of optimization, so that an array of lanes indexed by them can be kept in registers.
template <std::size_t Size, class Function>
SDNN_INLINE void unrolled(const Function& function) noexcept {
  [&]<std::size_t... Index>(std::index_sequence<Index...>) SDNN_INLINE_LAMBDA {
    (function(std::integral_constant<std::size_t, Index>()), ...);
  }(std::make_index_sequence<Size>());
}

#if SDNN_LANES

SDNN_WIDE_VECTORS_BEGIN

/// A register of 32 bytes of integers: 32 std::int8_t, 16 std::int16_t or 8 std::int32_t. Sums wrap
/// around. Functions take kSize integers in memory, at any alignment.
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
  /// Replaces each integer by the absolute value of the one in memory, if that is larger. No
  /// integer in memory may be the least of its type, which has no absolute value.
  SDNN_INLINE void rise_to_size(const Integer* from) noexcept {
    Vector other;
    std::memcpy(&other, from, sizeof other);
    const Vector negative = (Vector)(other < 0);  // -1 where it is true, else 0
    other = (other ^ negative) - negative;        // -x is ~x + 1, and ~x is x ^ -1
    const Vector larger = (Vector)(other > v);
    v = (other & larger) | (v & ~larger);
  }
  SDNN_INLINE void store(Integer* to) const noexcept { std::memcpy(to, &v, sizeof v); }
  /// Adds the i-th integer to to[i], whose type is at least as wide.
  template <class Wide>
  SDNN_INLINE void add_to(Wide* to) const noexcept {
    if constexpr (sizeof(Wide) == sizeof(Integer)) {
      IntegerRegister sum = *this;
      sum.add(to);
      sum.store(to);
    } else {
      // Widens by shuffles, because GCC converts vectors slowly: an integer x and its sign, 0 or
      // -1, side by side are the bytes of x in twice the width. The first half of the integers
      // become a register of wider ones, then the second half.
      using Twice = std::conditional_t<sizeof(Integer) == 1, std::int16_t, std::int32_t>;
      using Half = IntegerRegister<Twice>;
      static_assert(std::endian::native == std::endian::little, "the sign is the upper half");
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

SDNN_WIDE_VECTORS_END

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
  void rise_to_size(const Integer* from) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) {
      v[i] = std::max(v[i], static_cast<Integer>(from[i] < 0 ? -from[i] : from[i]));
    }
  }
  void store(Integer* to) const noexcept { std::copy_n(v, kSize, to); }
  template <class Wide>
  void add_to(Wide* to) const noexcept {
    for (std::size_t i = 0; i < kSize; ++i) to[i] = static_cast<Wide>(to[i] + v[i]);
  }
};

#endif  // SDNN_LANES

}  // namespace sdnn::core
