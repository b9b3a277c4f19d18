/// The inner loops of training and prediction, for each instruction set.
///
/// Each loop is written once, over vector registers of 32 bytes, and compiled once per instruction
/// set. All sums are exact integers, so that every version gives the same result.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "sdnn/core/aligned_buffer.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/core/lanes.hpp"

#if SDNN_X86_KERNELS
#include <immintrin.h>
#endif

namespace sdnn::estimators {

/// Units whose weights lie side by side: the width of a full tile.
inline constexpr std::size_t kTileUnits = 64;
/// The widths of tiles are multiples of this.
inline constexpr std::size_t kTileStep = 16;

namespace internal {

#if SDNN_LANES
/// 32 bytes of integers. GCC's ABI note is about calls, and there are none.
#if !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"
#endif
template <class Weight>
struct Register {
  typedef Weight Vector __attribute__((vector_size(32)));
  static constexpr std::size_t kSize = 32 / sizeof(Weight);
  Vector v;
  SDNN_INLINE void clear() noexcept { v = Vector{}; }
  SDNN_INLINE void add(const Weight* from) noexcept {
    Vector other;
    std::memcpy(&other, from, sizeof other);
    v += other;
  }
  SDNN_INLINE void subtract(const Weight* from) noexcept {
    Vector other;
    std::memcpy(&other, from, sizeof other);
    v -= other;
  }
  SDNN_INLINE void store(Weight* to) const noexcept { std::memcpy(to, &v, sizeof v); }
};
#if !defined(__clang__)
#pragma GCC diagnostic pop
#endif
#else
template <class Weight>
struct Register {
  static constexpr std::size_t kSize = 16;
  Weight v[kSize];
  void clear() noexcept { std::fill_n(v, kSize, Weight{0}); }
  void add(const Weight* from) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) v[i] = static_cast<Weight>(v[i] + from[i]);
  }
  void subtract(const Weight* from) noexcept {
    for (std::size_t i = 0; i < kSize; ++i) v[i] = static_cast<Weight>(v[i] - from[i]);
  }
  void store(Weight* to) const noexcept { std::copy_n(v, kSize, to); }
};
#endif

/// sums[0 .. Width) += the rows `plus` of a tile, -= its rows `minus`; at most `n_per_sum` rows are
/// added before the sum is widened.
template <class Weight, std::size_t Width>
SDNN_INLINE void add_rows_of_width(const Weight* tile, const std::uint32_t* plus,
                                   std::size_t n_plus, const std::uint32_t* minus,
                                   std::size_t n_minus, std::size_t n_per_sum,
                                   std::int32_t* sums) noexcept {
  using Lane = Register<Weight>;
  constexpr std::size_t kRegisters = Width / Lane::kSize;
  while (n_plus + n_minus > 0) {
    const std::size_t some_plus = std::min(n_plus, n_per_sum);
    const std::size_t some_minus = std::min(n_minus, n_per_sum - some_plus);
    Lane sum[kRegisters];
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
    for (std::size_t c = 0; c < some_plus; ++c) {
      const Weight* const row = tile + std::size_t{plus[c]} * Width;
      core::unrolled<kRegisters>(
          [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].add(row + r * Lane::kSize); });
    }
    for (std::size_t c = 0; c < some_minus; ++c) {
      const Weight* const row = tile + std::size_t{minus[c]} * Width;
      core::unrolled<kRegisters>(
          [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].subtract(row + r * Lane::kSize); });
    }
    alignas(core::kCacheLine) Weight narrow[Width];
    core::unrolled<kRegisters>(
        [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].store(narrow + r * Lane::kSize); });
    for (std::size_t i = 0; i < Width; ++i) sums[i] += narrow[i];
    plus += some_plus, n_plus -= some_plus;
    minus += some_minus, n_minus -= some_minus;
  }
}

template <class Weight>
SDNN_INLINE void add_rows_body(const Weight* tile, std::size_t width, const std::uint32_t* plus,
                               std::size_t n_plus, const std::uint32_t* minus, std::size_t n_minus,
                               std::size_t n_per_sum, std::int32_t* sums) noexcept {
  switch (width) {
    case 16: return add_rows_of_width<Weight, 16>(tile, plus, n_plus, minus, n_minus, n_per_sum, sums);
    case 32: return add_rows_of_width<Weight, 32>(tile, plus, n_plus, minus, n_minus, n_per_sum, sums);
    case 48: return add_rows_of_width<Weight, 48>(tile, plus, n_plus, minus, n_minus, n_per_sum, sums);
    default: return add_rows_of_width<Weight, 64>(tile, plus, n_plus, minus, n_minus, n_per_sum, sums);
  }
}

/// rows[slot] += the samples' coefficients of the bits of `plus[slot] & samples`, -= of `minus`.
template <class Weight, std::size_t Width>
SDNN_INLINE void correct_rows_of_width(Weight* rows, std::size_t n_rows, const std::uint32_t* plus,
                                       const std::uint32_t* minus, std::uint32_t samples,
                                       const Weight* coefficients) noexcept {
  using Lane = Register<Weight>;
  constexpr std::size_t kRegisters = Width / Lane::kSize;
  for (std::size_t slot = 0; slot < n_rows; ++slot) {
    std::uint32_t more = plus[slot] & samples;
    std::uint32_t less = minus[slot] & samples;
    if ((more | less) == 0) continue;
    Weight* const row = rows + slot * Width;
    Lane sum[kRegisters];
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
      sum[r].clear();
      sum[r].add(row + r * Lane::kSize);
    });
    for (; more != 0; more &= more - 1) {
      const Weight* const c = coefficients + static_cast<std::size_t>(std::countr_zero(more)) * Width;
      core::unrolled<kRegisters>(
          [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].add(c + r * Lane::kSize); });
    }
    for (; less != 0; less &= less - 1) {
      const Weight* const c = coefficients + static_cast<std::size_t>(std::countr_zero(less)) * Width;
      core::unrolled<kRegisters>(
          [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].subtract(c + r * Lane::kSize); });
    }
    core::unrolled<kRegisters>(
        [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].store(row + r * Lane::kSize); });
  }
}

template <class Weight>
SDNN_INLINE void correct_rows_body(Weight* rows, std::size_t width, std::size_t n_rows,
                                   const std::uint32_t* plus, const std::uint32_t* minus,
                                   std::uint32_t samples, const Weight* coefficients) noexcept {
  switch (width) {
    case 16: return correct_rows_of_width<Weight, 16>(rows, n_rows, plus, minus, samples, coefficients);
    case 32: return correct_rows_of_width<Weight, 32>(rows, n_rows, plus, minus, samples, coefficients);
    case 48: return correct_rows_of_width<Weight, 48>(rows, n_rows, plus, minus, samples, coefficients);
    default: return correct_rows_of_width<Weight, 64>(rows, n_rows, plus, minus, samples, coefficients);
  }
}

/// to[i] += sum of plus[k][i] - sum of minus[k][i]; at most `n_per_sum` entries are added before their
/// sum is widened.
template <class Entry>
SDNN_INLINE void add_products_body(std::int32_t* to, std::size_t size, const Entry* const* plus,
                                   std::size_t n_plus, const Entry* const* minus,
                                   std::size_t n_minus, std::size_t n_per_sum) noexcept {
  using Lane = Register<Entry>;
  constexpr std::size_t kRegisters = 4;
  constexpr std::size_t kSize = kRegisters * Lane::kSize;
  if (n_plus + n_minus == 1) {
    const Entry* const row = n_plus == 1 ? plus[0] : minus[0];
    if (n_plus == 1) {
      for (std::size_t i = 0; i < size; ++i) to[i] += row[i];
    } else {
      for (std::size_t i = 0; i < size; ++i) to[i] -= row[i];
    }
    return;
  }
  for (std::size_t p = 0, m = 0; p < n_plus || m < n_minus;) {
    const std::size_t p_end = std::min(n_plus, p + n_per_sum);
    const std::size_t m_end = std::min(n_minus, m + (n_per_sum - (p_end - p)));
    std::size_t i = 0;
    for (; i + kSize <= size; i += kSize) {
      Lane sum[kRegisters];
      core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
      for (std::size_t k = p; k < p_end; ++k) {
        core::unrolled<kRegisters>(
            [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].add(plus[k] + i + r * Lane::kSize); });
      }
      for (std::size_t k = m; k < m_end; ++k) {
        core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
          sum[r].subtract(minus[k] + i + r * Lane::kSize);
        });
      }
      alignas(core::kCacheLine) Entry narrow[kSize];
      core::unrolled<kRegisters>(
          [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].store(narrow + r * Lane::kSize); });
      for (std::size_t k = 0; k < kSize; ++k) to[i + k] += narrow[k];
    }
    for (; i < size; ++i) {
      for (std::size_t k = p; k < p_end; ++k) to[i] += plus[k][i];
      for (std::size_t k = m; k < m_end; ++k) to[i] -= minus[k][i];
    }
    p = p_end;
    m = m_end;
  }
}

/// Adds the coefficients to the rows of the set bits of `positive`, subtracts them from those of the
/// other bits of `active`. 64 rows of `width` units.
SDNN_INLINE void add_outer_body(std::int32_t* rows, std::size_t width,
                                const std::int16_t* coefficients, std::uint64_t active,
                                std::uint64_t positive) noexcept {
  alignas(core::kCacheLine) std::int32_t wide[kTileUnits];
  for (std::size_t i = 0; i < width; ++i) wide[i] = coefficients[i];
  for (std::uint64_t bits = positive; bits != 0; bits &= bits - 1) {
    std::int32_t* const row = rows + static_cast<std::size_t>(std::countr_zero(bits)) * width;
    for (std::size_t i = 0; i < width; ++i) row[i] += wide[i];
  }
  for (std::uint64_t bits = active & ~positive; bits != 0; bits &= bits - 1) {
    std::int32_t* const row = rows + static_cast<std::size_t>(std::countr_zero(bits)) * width;
    for (std::size_t i = 0; i < width; ++i) row[i] -= wide[i];
  }
}

SDNN_INLINE std::int32_t count_firing_body(const std::int32_t* potentials,
                                           std::size_t size) noexcept {
  std::int32_t count = 0;
  for (std::size_t i = 0; i < size; ++i) count += potentials[i] > 0 ? 1 : 0;
  return count;
}

/// keys[i] = (distance to the threshold) << n_bits | i of the units that fire (`firing`) or do not,
/// INT32_MAX of the others; distances of `limit` and more are all `limit`. Returns the least key.
SDNN_INLINE std::int32_t rank_body(const std::int32_t* potentials, std::size_t size, bool firing,
                                   int n_bits, std::int32_t limit, std::int32_t* keys) noexcept {
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  std::int32_t least = kNone;
  std::size_t i = 0;
#if SDNN_LANES
  using Vector = Register<std::int32_t>::Vector;
  constexpr std::size_t kSize = Register<std::int32_t>::kSize;
  const Vector none = Vector{} + kNone;
  const Vector limits = Vector{} + limit;
  const Vector flip = Vector{} - (firing ? 0 : 1);  // all ones to negate and to invert the mask
  Vector lowest = none;
  Vector index{};
  for (std::size_t k = 0; k < kSize; ++k) index[k] = static_cast<std::int32_t>(k);
  for (; i + kSize <= size; i += kSize) {
    Vector p;
    std::memcpy(&p, potentials + i, sizeof p);
    const Vector asked = (Vector)(p > 0) ^ flip;
    Vector distance = (p ^ flip) - flip;
    const Vector near = (Vector)(distance < limits);
    distance = (distance & near) | (limits & ~near);
    const Vector key = (((distance << n_bits) | index) & asked) | (none & ~asked);
    std::memcpy(keys + i, &key, sizeof key);
    const Vector lower = (Vector)(key < lowest);
    lowest = (key & lower) | (lowest & ~lower);
    index += static_cast<std::int32_t>(kSize);
  }
  for (std::size_t k = 0; k < kSize; ++k) least = lowest[k] < least ? lowest[k] : least;
#endif
  for (; i < size; ++i) {
    const std::int32_t distance = std::min(firing ? potentials[i] : -potentials[i], limit);
    keys[i] = (potentials[i] > 0) == firing ? distance << n_bits | static_cast<std::int32_t>(i)
                                            : kNone;
    least = keys[i] < least ? keys[i] : least;
  }
  return least;
}

/// The least of the values above `floor`, INT32_MAX if there is none.
SDNN_INLINE std::int32_t least_above_body(const std::int32_t* values, std::size_t size,
                                          std::int32_t floor) noexcept {
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  std::int32_t least = kNone;
  std::size_t i = 0;
#if SDNN_LANES
  using Vector = Register<std::int32_t>::Vector;
  constexpr std::size_t kSize = Register<std::int32_t>::kSize;
  const Vector floors = Vector{} + floor;
  Vector lowest = Vector{} + kNone;
  for (; i + kSize <= size; i += kSize) {
    Vector v;
    std::memcpy(&v, values + i, sizeof v);
    const Vector lower = (Vector)(v < lowest) & (Vector)(v > floors);
    lowest = (v & lower) | (lowest & ~lower);
  }
  for (std::size_t k = 0; k < kSize; ++k) least = lowest[k] < least ? lowest[k] : least;
#endif
  for (; i < size; ++i) least = values[i] > floor && values[i] < least ? values[i] : least;
  return least;
}

/// The inner product of two codes with entries +1, 0, -1.
SDNN_INLINE std::int32_t inner_product_body(const std::uint64_t* active,
                                            const std::uint64_t* positive,
                                            const std::uint64_t* other_active,
                                            const std::uint64_t* other_positive,
                                            std::size_t n_words) noexcept {
  std::int32_t both = 0;
  std::int32_t unlike = 0;
  for (std::size_t w = 0; w < n_words; ++w) {
    const std::uint64_t shared = active[w] & other_active[w];
    both += std::popcount(shared);
    unlike += std::popcount(shared & (positive[w] ^ other_positive[w]));
  }
  return both - 2 * unlike;
}

#if SDNN_X86_KERNELS

[[gnu::target("avx2"), gnu::always_inline]] inline __m256i load_avx2(const std::uint64_t* from) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
}

/// The same, 256 bits at a time: the counts of all 4-bit parts are looked up in a register, +1 per
/// bit in `active` parts and -2 per bit in unlike ones.
[[gnu::target("avx2,popcnt")]] inline std::int32_t inner_product_avx2(
    const std::uint64_t* active, const std::uint64_t* positive, const std::uint64_t* other_active,
    const std::uint64_t* other_positive, std::size_t n_words) {
  const __m256i counts = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4,  //
                                          0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i minus_two = _mm256_sub_epi8(_mm256_setzero_si256(), _mm256_add_epi8(counts, counts));
  const __m256i low = _mm256_set1_epi8(15);
  const __m256i bytes_of_one = _mm256_set1_epi8(1);
  const __m256i shorts_of_one = _mm256_set1_epi16(1);
  __m256i total = _mm256_setzero_si256();
  std::size_t w = 0;
  while (w + 4 <= n_words) {
    __m256i bytes = _mm256_setzero_si256();
    for (int k = 0; k < 7 && w + 4 <= n_words; ++k, w += 4) {  // 7 * -16 still fits a byte
      const __m256i shared = _mm256_and_si256(load_avx2(active + w), load_avx2(other_active + w));
      const __m256i unlike = _mm256_and_si256(
          shared, _mm256_xor_si256(load_avx2(positive + w), load_avx2(other_positive + w)));
      const __m256i of_shared = _mm256_add_epi8(
          _mm256_shuffle_epi8(counts, _mm256_and_si256(shared, low)),
          _mm256_shuffle_epi8(counts, _mm256_and_si256(_mm256_srli_epi16(shared, 4), low)));
      const __m256i of_unlike = _mm256_add_epi8(
          _mm256_shuffle_epi8(minus_two, _mm256_and_si256(unlike, low)),
          _mm256_shuffle_epi8(minus_two, _mm256_and_si256(_mm256_srli_epi16(unlike, 4), low)));
      bytes = _mm256_add_epi8(bytes, _mm256_add_epi8(of_shared, of_unlike));
    }
    total = _mm256_add_epi32(
        total, _mm256_madd_epi16(_mm256_maddubs_epi16(bytes_of_one, bytes), shorts_of_one));
  }
  alignas(32) std::int32_t parts[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(parts), total);
  std::int32_t result = inner_product_body(active + w, positive + w, other_active + w,
                                           other_positive + w, n_words - w);
  for (const std::int32_t part : parts) result += part;
  return result;
}

#endif  // SDNN_X86_KERNELS

}  // namespace internal

/// One version of each loop.
struct UnitKernels {
  void (*add_rows_16)(const std::int16_t* tile, std::size_t width, const std::uint32_t* plus,
                      std::size_t n_plus, const std::uint32_t* minus, std::size_t n_minus,
                      std::size_t n_per_sum, std::int32_t* sums);
  void (*add_rows_32)(const std::int32_t* tile, std::size_t width, const std::uint32_t* plus,
                      std::size_t n_plus, const std::uint32_t* minus, std::size_t n_minus,
                      std::size_t n_per_sum, std::int32_t* sums);
  void (*correct_rows_16)(std::int16_t* rows, std::size_t width, std::size_t n_rows,
                          const std::uint32_t* plus, const std::uint32_t* minus,
                          std::uint32_t samples, const std::int16_t* coefficients);
  void (*correct_rows_32)(std::int32_t* rows, std::size_t width, std::size_t n_rows,
                          const std::uint32_t* plus, const std::uint32_t* minus,
                          std::uint32_t samples, const std::int32_t* coefficients);
  void (*add_products_16)(std::int32_t* to, std::size_t size, const std::int16_t* const* plus,
                          std::size_t n_plus, const std::int16_t* const* minus,
                          std::size_t n_minus, std::size_t n_per_sum);
  void (*add_products_32)(std::int32_t* to, std::size_t size, const std::int32_t* const* plus,
                          std::size_t n_plus, const std::int32_t* const* minus,
                          std::size_t n_minus, std::size_t n_per_sum);
  void (*add_outer)(std::int32_t* rows, std::size_t width, const std::int16_t* coefficients,
                    std::uint64_t active, std::uint64_t positive);
  std::int32_t (*count_firing)(const std::int32_t* potentials, std::size_t size);
  std::int32_t (*rank)(const std::int32_t* potentials, std::size_t size, bool firing, int n_bits,
                       std::int32_t limit, std::int32_t* keys);
  std::int32_t (*least_above)(const std::int32_t* values, std::size_t size, std::int32_t floor);
  std::int32_t (*inner_product)(const std::uint64_t* active, const std::uint64_t* positive,
                                const std::uint64_t* other_active,
                                const std::uint64_t* other_positive, std::size_t n_words);

  void add_rows(const std::int16_t* tile, std::size_t width, const std::uint32_t* plus,
                std::size_t n_plus, const std::uint32_t* minus, std::size_t n_minus,
                std::size_t n_per_sum, std::int32_t* sums) const {
    add_rows_16(tile, width, plus, n_plus, minus, n_minus, n_per_sum, sums);
  }
  void add_rows(const std::int32_t* tile, std::size_t width, const std::uint32_t* plus,
                std::size_t n_plus, const std::uint32_t* minus, std::size_t n_minus,
                std::size_t n_per_sum, std::int32_t* sums) const {
    add_rows_32(tile, width, plus, n_plus, minus, n_minus, n_per_sum, sums);
  }
  void correct_rows(std::int16_t* rows, std::size_t width, std::size_t n_rows,
                    const std::uint32_t* plus, const std::uint32_t* minus, std::uint32_t samples,
                    const std::int16_t* coefficients) const {
    correct_rows_16(rows, width, n_rows, plus, minus, samples, coefficients);
  }
  void correct_rows(std::int32_t* rows, std::size_t width, std::size_t n_rows,
                    const std::uint32_t* plus, const std::uint32_t* minus, std::uint32_t samples,
                    const std::int32_t* coefficients) const {
    correct_rows_32(rows, width, n_rows, plus, minus, samples, coefficients);
  }
  void add_products(std::int32_t* to, std::size_t size, const std::int16_t* const* plus,
                    std::size_t n_plus, const std::int16_t* const* minus,
                    std::size_t n_minus, std::size_t n_per_sum) const {
    add_products_16(to, size, plus, n_plus, minus, n_minus, n_per_sum);
  }
  void add_products(std::int32_t* to, std::size_t size, const std::int32_t* const* plus,
                    std::size_t n_plus, const std::int32_t* const* minus,
                    std::size_t n_minus, std::size_t n_per_sum) const {
    add_products_32(to, size, plus, n_plus, minus, n_minus, n_per_sum);
  }
};

// The loops are templates' bodies, inlined into lambdas that carry the instruction set.
#define SDNN_UNIT_KERNELS(...)                                                                    \
  UnitKernels {                                                                                   \
    [](const std::int16_t* t, std::size_t w, const std::uint32_t* p, std::size_t np,              \
       const std::uint32_t* m, std::size_t nm, std::size_t s, std::int32_t* o) __VA_ARGS__ {      \
      internal::add_rows_body(t, w, p, np, m, nm, s, o);                                          \
    },                                                                                            \
        [](const std::int32_t* t, std::size_t w, const std::uint32_t* p, std::size_t np,          \
           const std::uint32_t* m, std::size_t nm, std::size_t s, std::int32_t* o) __VA_ARGS__ {  \
          internal::add_rows_body(t, w, p, np, m, nm, s, o);                                      \
        },                                                                                        \
        [](std::int16_t* r, std::size_t w, std::size_t n, const std::uint32_t* p,                  \
           const std::uint32_t* m, std::uint32_t s, const std::int16_t* c) __VA_ARGS__ {           \
          internal::correct_rows_body(r, w, n, p, m, s, c);                                       \
        },                                                                                        \
        [](std::int32_t* r, std::size_t w, std::size_t n, const std::uint32_t* p,                  \
           const std::uint32_t* m, std::uint32_t s, const std::int32_t* c) __VA_ARGS__ {           \
          internal::correct_rows_body(r, w, n, p, m, s, c);                                       \
        },                                                                                        \
        [](std::int32_t* o, std::size_t n, const std::int16_t* const* p, std::size_t np,          \
           const std::int16_t* const* m, std::size_t nm, std::size_t s) __VA_ARGS__ {             \
          internal::add_products_body(o, n, p, np, m, nm, s);                                     \
        },                                                                                        \
        [](std::int32_t* o, std::size_t n, const std::int32_t* const* p, std::size_t np,          \
           const std::int32_t* const* m, std::size_t nm, std::size_t s) __VA_ARGS__ {             \
          internal::add_products_body(o, n, p, np, m, nm, s);                                     \
        },                                                                                        \
        [](std::int32_t* r, std::size_t w, const std::int16_t* c, std::uint64_t a,                \
           std::uint64_t p) __VA_ARGS__ { internal::add_outer_body(r, w, c, a, p); },             \
        [](const std::int32_t* p, std::size_t n)                                                  \
            __VA_ARGS__ { return internal::count_firing_body(p, n); },                            \
        [](const std::int32_t* p, std::size_t n, bool f, int b, std::int32_t l, std::int32_t* k)  \
            __VA_ARGS__ { return internal::rank_body(p, n, f, b, l, k); },                        \
        [](const std::int32_t* v, std::size_t n, std::int32_t f)                                  \
            __VA_ARGS__ { return internal::least_above_body(v, n, f); },                          \
        [](const std::uint64_t* a, const std::uint64_t* p, const std::uint64_t* oa,               \
           const std::uint64_t* op, std::size_t n)                                                \
            __VA_ARGS__ { return internal::inner_product_body(a, p, oa, op, n); }                 \
  }

namespace internal {

inline UnitKernels unit_kernels_by_compiler() {
#if SDNN_X86_KERNELS
  switch (core::instruction_set()) {
    case core::InstructionSet::avx512:
      return SDNN_UNIT_KERNELS(__attribute__((target("avx512f,avx512bw,avx2,popcnt"))));
    case core::InstructionSet::avx2:
      return SDNN_UNIT_KERNELS(__attribute__((target("avx2,popcnt"))));
    default: break;
  }
#endif
  return SDNN_UNIT_KERNELS();
}

}  // namespace internal

#undef SDNN_UNIT_KERNELS

/// The loops of the instruction set in use.
inline UnitKernels unit_kernels() {
  UnitKernels kernels = internal::unit_kernels_by_compiler();
#if SDNN_X86_KERNELS
  if (core::instruction_set() != core::InstructionSet::portable) {
    kernels.inner_product = internal::inner_product_avx2;
  }
#endif
  return kernels;
}

}  // namespace sdnn::estimators
