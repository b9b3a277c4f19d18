/// The weights of many units in tiles: in a tile, the weights of some units for a column are
/// adjacent.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <type_traits>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::estimators {

/// The width of a full tile: the number of units whose weights are adjacent. Their sums take six
/// registers of 16-bit weights.
inline constexpr std::size_t kTileUnits = 96;
/// Widths of tiles are multiples of this number: a register holds so many 16-bit weights.
inline constexpr std::size_t kTileStep = 16;

namespace detail {

template <std::size_t Value>
using Size = std::integral_constant<std::size_t, Value>;

/// Calls function(Size<width>()), so that the width, a multiple of kTileStep up to Most, is a
/// compile-time constant.
template <std::size_t Most, std::size_t Width = kTileStep, class Function>
SDNN_INLINE void for_width(std::size_t width, const Function& function) noexcept {
  if constexpr (Width < Most) {
    if (width > Width) return for_width<Most, Width + kTileStep>(width, function);
  }
  function(Size<Width>());
}

using Slots = std::span<const std::uint32_t>;

/// Adds the rows `plus` of a tile of constant width to `sums`, and subtracts its rows `minus`;
/// `n_per_sum` rows at a time are summed in type Weight.
template <class Weight, std::size_t Width>
SDNN_INLINE void add_rows_of_width(const Weight* tile, Slots plus, Slots minus,
                                   std::size_t n_per_sum, std::int32_t* sums) noexcept {
  using Lane = core::IntegerRegister<Weight>;
  constexpr std::size_t kRegisters = Width / Lane::kSize;
  while (plus.size() + minus.size() > 0) {
    const std::size_t some_plus = std::min(plus.size(), n_per_sum);
    const std::size_t some_minus = std::min(minus.size(), n_per_sum - some_plus);
    Lane sum[kRegisters];
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].clear(); });
    for (std::size_t c = 0; c < some_plus; ++c) {
      const Weight* const row = tile + std::size_t{plus[c]} * Width;
      core::unrolled<kRegisters>([&](std::size_t r)
                                     SDNN_INLINE_LAMBDA { sum[r].add(row + r * Lane::kSize); });
    }
    for (std::size_t c = 0; c < some_minus; ++c) {
      const Weight* const row = tile + std::size_t{minus[c]} * Width;
      core::unrolled<kRegisters>(
          [&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r].subtract(row + r * Lane::kSize); });
    }
    core::unrolled<kRegisters>([&](std::size_t r)
                                   SDNN_INLINE_LAMBDA { sum[r].add_to(sums + r * Lane::kSize); });
    plus = plus.subspan(some_plus);
    minus = minus.subspan(some_minus);
  }
}

/// Implements add_rows, below, with the width as a constant, so that loops are unrolled.
template <class Weight>
SDNN_INLINE void add_rows_body(const Weight* tile, std::size_t width, Slots plus, Slots minus,
                               std::size_t n_per_sum, std::int32_t* sums) noexcept {
  for_width<kTileUnits>(width, [&]<std::size_t Width>(Size<Width>) SDNN_INLINE_LAMBDA {
    add_rows_of_width<Weight, Width>(tile, plus, minus, n_per_sum, sums);
  });
}

/// The body of the kernel add_outer (see below), compiled for each instruction set.
SDNN_INLINE void add_outer_body(std::int16_t* rows, std::size_t width,
                                const std::int16_t* coefficients, std::uint64_t active,
                                std::uint64_t positive) noexcept {
  for_width<kTileUnits>(width, [&]<std::size_t Width>(Size<Width>) SDNN_INLINE_LAMBDA {
    using Lane = core::IntegerRegister<std::int16_t>;
    constexpr std::size_t kRegisters = Width / Lane::kSize;
    Lane values[kRegisters];
    core::unrolled<kRegisters>(
        [&](std::size_t r) SDNN_INLINE_LAMBDA { values[r].load(coefficients + r * Lane::kSize); });
    for (std::uint64_t bits = positive; bits != 0; bits &= bits - 1) {
      std::int16_t* const row = rows + static_cast<std::size_t>(std::countr_zero(bits)) * Width;
      core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
        Lane sum = values[r];
        sum.add(row + r * Lane::kSize);
        sum.store(row + r * Lane::kSize);
      });
    }
    for (std::uint64_t bits = active & ~positive; bits != 0; bits &= bits - 1) {
      std::int16_t* const row = rows + static_cast<std::size_t>(std::countr_zero(bits)) * Width;
      core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
        Lane sum;
        sum.load(row + r * Lane::kSize);
        sum.subtract(coefficients + r * Lane::kSize);
        sum.store(row + r * Lane::kSize);
      });
    }
  });
}

}  // namespace detail

/// Adds the outer product of a word of a code and of units' coefficients to 64 rows of `width`
/// units: coefficients are added to the rows of bits in `positive`, and subtracted from the rows of
/// other bits in `active`.
SDNN_KERNEL(void, add_outer,
            (std::int16_t* rows, std::size_t width, const std::int16_t* coefficients,
             std::uint64_t active, std::uint64_t positive),
            (rows, width, coefficients, active, positive))

/// Adds to sums[i], i < width, the weights of unit i in the rows `plus` of a tile, and subtracts
/// those in the rows `minus`. At most `n_per_sum` rows are summed in the weights' type, which must
/// hold the sum, before it is added to `sums`.
SDNN_KERNEL(void, add_rows,
            (const std::int16_t* tile, std::size_t width, std::span<const std::uint32_t> plus,
             std::span<const std::uint32_t> minus, std::size_t n_per_sum, std::int32_t* sums),
            (tile, width, plus, minus, n_per_sum, sums))
SDNN_KERNEL(void, add_rows,
            (const std::int32_t* tile, std::size_t width, std::span<const std::uint32_t> plus,
             std::span<const std::uint32_t> minus, std::size_t n_per_sum, std::int32_t* sums),
            (tile, width, plus, minus, n_per_sum, sums))

/// Weights in tiles of up to kTileUnits units. A tile has a row for each slot, the weights of its
/// units. A slot is the number of a column if the columns of every pair of inputs are padded to
/// whole 64-bit words, so that slot s is bit s % 64 of word s / 64 of a code.
///
/// All tiles are kTileUnits wide, except the last, whose width is the smallest multiple of 16 for
/// the remaining units. Memory: sizeof(Weight) * n_slots * round_up(n_units, 16).
template <class Weight>
class WeightTiles {
 public:
  WeightTiles() = default;
  WeightTiles(std::size_t n_units, std::size_t n_slots)
      : n_units_(n_units),
        n_slots_(n_slots),
        weights_(core::checked_product(core::round_up(n_units, kTileStep), n_slots)) {}

  /// Makes a copy in another type, which the weights must fit.
  template <class Other>
  explicit WeightTiles(const WeightTiles<Other>& other)
      : WeightTiles(other.n_units(), other.n_slots()) {
    std::transform(other.data(), other.data() + weights_.size(), weights_.data(),
                   [](Other weight) { return static_cast<Weight>(weight); });
  }

  std::size_t n_units() const noexcept { return n_units_; }
  std::size_t n_slots() const noexcept { return n_slots_; }
  std::size_t n_padded_units() const noexcept { return core::round_up(n_units_, kTileStep); }
  std::size_t n_tiles() const noexcept { return (n_units_ + kTileUnits - 1) / kTileUnits; }
  std::size_t width(std::size_t tile) const noexcept {
    return std::min(kTileUnits, n_padded_units() - tile * kTileUnits);
  }
  const Weight* data() const noexcept { return weights_.data(); }
  const Weight* tile(std::size_t tile) const noexcept {
    return weights_.data() + tile * kTileUnits * n_slots_;
  }
  Weight* tile(std::size_t tile) noexcept { return weights_.data() + tile * kTileUnits * n_slots_; }
  const Weight& at(std::size_t unit, std::size_t slot) const noexcept {
    return tile(unit / kTileUnits)[slot * width(unit / kTileUnits) + unit % kTileUnits];
  }
  Weight& at(std::size_t unit, std::size_t slot) noexcept {
    return tile(unit / kTileUnits)[slot * width(unit / kTileUnits) + unit % kTileUnits];
  }

  /// Adds to sums[i] the weights of unit i in the columns `slots.plus`, and subtracts those in
  /// `slots.minus`. Up to `n_per_sum` weights, whose sum fits into Weight, are added before the sum
  /// is widened. Shapes: sums (n_padded_units,).
  void add_columns(const coding::SignedColumns& slots, std::size_t n_per_sum,
                   std::int32_t* sums) const {
    for (std::size_t t = 0; t < n_tiles(); ++t) {
      add_rows(tile(t), width(t), slots.plus, slots.minus, n_per_sum, sums + t * kTileUnits);
    }
  }

  /// Returns the largest sum of a unit's |weights| in the slots [begin, end).
  std::int64_t largest_norm(std::size_t begin, std::size_t end) const {
    std::vector<std::int64_t> norms(n_padded_units());
    for (std::size_t t = 0; t < n_tiles(); ++t) {
      const Weight* row = tile(t) + begin * width(t);
      for (std::size_t slot = begin; slot < end; ++slot, row += width(t)) {
        for (std::size_t i = 0; i < width(t); ++i) {
          norms[t * kTileUnits + i] += std::abs(std::int64_t{row[i]});
        }
      }
    }
    return *std::max_element(norms.begin(), norms.end());
  }

  /// The largest |weight|.
  std::int64_t largest() const noexcept {
    Weight low = 0;
    Weight high = 0;
    for (const Weight weight : weights_.span()) {
      low = std::min(low, weight);
      high = std::max(high, weight);
    }
    return std::max(-std::int64_t{low}, std::int64_t{high});
  }

 private:
  std::size_t n_units_ = 0;
  std::size_t n_slots_ = 0;
  core::AlignedBuffer<Weight> weights_;
};

}  // namespace sdnn::estimators
