/// Rows of integer weights over a code of -1, 0 and +1: their sums, one step of learning, and the
/// codes, sums and traces that users of a linear readout keep.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "sdnn/coding/detail/expanded_bits.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::approximators {

/// The change of a row of weights and of their traces in a step of learning, in fixed-point numbers
/// whose products fit into 32 bits.
struct RowStep {
  std::int32_t decay;    ///< factor of the trace in [0, 2^13], in units of 2^-13
  std::int32_t gain;     ///< factor of the code that is added to the trace, in units of 2^-12; 0 in
                         ///< rows outside the action's window
  std::int32_t replace;  ///< -1: where the code is not 0 it replaces the trace; 0: it is added
  std::int32_t step;     ///< weights change by step * trace / 2^shift; below 2^13
  std::int32_t shift;    ///< in [1, 30]
  std::int32_t correction;  ///< subtracted from the weight, times the code
};

/// The bits that are set in any trace, and in size_bits of any weight, after a step: traces are all
/// 0 if `traces` is 0, and the highest bit of `weights` shows the size of the largest weight.
struct RowUse {
  std::int32_t traces = 0;
  std::int32_t weights = 0;
};

/// Traces count units of 2^-12 and are below 32 in size; factors of traces count units of 2^-13. So
/// a product of a trace and a factor, or a step, has at most 17 + 13 bits.
inline constexpr std::int32_t kTraceOne = 1 << 12;
inline constexpr std::int32_t kLargestTrace = (1 << 17) - 1;
inline constexpr std::int32_t kDecayOne = 1 << 13;

/// Returns a * b / 2^n_bits, rounded to the nearest integer, halves up.
constexpr std::int64_t scaled(std::int64_t a, std::int64_t b, int n_bits) noexcept {
  if (n_bits == 0) return a * b;
  return (a * b + (std::int64_t{1} << (n_bits - 1))) >> n_bits;
}
/// Returns units / 2, halves rounded up.
template <class Number>
constexpr Number halved(Number units) noexcept {
  return (units + 1) >> 1;
}

/// Weights are below 2^23 in size, so that the sum of 256 of them fits into 32 bits.
inline constexpr int kWeightBits = 23;
inline constexpr std::int32_t kLargestWeight = 1 << kWeightBits;

/// Returns the magnitude of a weight, minus 1 for a negative weight (the shift makes all ones of
/// its sign, which flip its bits). The highest set bit tells how many bits the weight needs.
constexpr std::uint32_t size_bits(std::int32_t weight) noexcept {
  return static_cast<std::uint32_t>(weight ^ (weight >> 31));
}
/// Returns weight * 2^n, clipped to the range of weights.
constexpr std::int32_t multiplied(std::int32_t weight, int n) noexcept {
  constexpr std::int64_t kMost = kLargestWeight - 1;
  return static_cast<std::int32_t>(
      std::clamp(std::int64_t{weight} << std::min(n, kWeightBits), -kMost, kMost));
}

namespace detail {

/// Writes the sums of weights times signs of kRows rows, so that each sign is read once for all of
/// them.
template <std::size_t kRows>
SDNN_INLINE void sum_rows_at_once(const std::int32_t* const* rows, const std::int8_t* signs,
                                  std::size_t n_columns, std::int64_t* sums) noexcept {
  constexpr std::size_t kBlock = 256;  // columns whose sum of weights fits into 32 bits
  std::fill_n(sums, kRows, 0);
  for (std::size_t first = 0; first < n_columns; first += kBlock) {
    const std::size_t last = std::min(n_columns, first + kBlock);
    std::int32_t of_block[kRows] = {};
    for (std::size_t j = first; j < last; ++j) {
      const std::int32_t sign = signs[j];
      for (std::size_t i = 0; i < kRows; ++i) of_block[i] += rows[i][j] * sign;
    }
    for (std::size_t i = 0; i < kRows; ++i) sums[i] += of_block[i];
  }
}

/// Implements row_sums, four, two or one rows at a time.
SDNN_INLINE void row_sums_body(const std::int32_t* const* rows, std::size_t n_rows,
                               const std::int8_t* signs, std::size_t n_columns,
                               std::int64_t* sums) noexcept {
  std::size_t i = 0;
  for (; i + 4 <= n_rows; i += 4) sum_rows_at_once<4>(rows + i, signs, n_columns, sums + i);
  for (; i + 2 <= n_rows; i += 2) sum_rows_at_once<2>(rows + i, signs, n_columns, sums + i);
  if (i < n_rows) sum_rows_at_once<1>(rows + i, signs, n_columns, sums + i);
}

/// Decays the traces, adds the code to them, and adds their multiples to the weights; with
/// kCorrects it also subtracts the correction. A shift x >> 31 gives -1 for negative x and else 0,
/// as C++20 integers are two's complement.
template <bool kCorrects>
SDNN_INLINE RowUse learn_columns(std::int32_t* weights, std::int32_t* traces,
                                 const std::int8_t* signs, std::size_t n_columns,
                                 RowStep step) noexcept {
  const std::int32_t half = std::int32_t{1} << (step.shift - 1);
  std::int32_t traces_used = 0;
  std::int32_t weights_used = 0;
  for (std::size_t j = 0; j < n_columns; ++j) {
    const std::int32_t sign = signs[j];
    const std::int32_t product = traces[j] * step.decay;
    std::int32_t trace = (product + ((product >> 31) & (kDecayOne - 1))) >> 13;  // towards 0
    trace = ((sign & step.replace) != 0 ? 0 : trace) + step.gain * sign;
    trace = std::clamp(trace, -kLargestTrace, kLargestTrace);
    traces[j] = trace;
    std::int32_t weight = weights[j] + ((step.step * trace + half) >> step.shift);
    if constexpr (kCorrects) weight -= step.correction * sign;
    weights[j] = weight;
    traces_used |= trace;
    weights_used |= weight ^ (weight >> 31);
  }
  return {traces_used, weights_used};
}

/// Implements learn_row. Without a correction, which is the usual case, the loop is faster.
SDNN_INLINE RowUse learn_row_body(std::int32_t* weights, std::int32_t* traces,
                                  const std::int8_t* signs, std::size_t n_columns,
                                  RowStep step) noexcept {
  return step.correction == 0 ? learn_columns<false>(weights, traces, signs, n_columns, step)
                              : learn_columns<true>(weights, traces, signs, n_columns, step);
}

/// The body of the kernel spread_signs (see below), compiled for each instruction set.
SDNN_INLINE void spread_signs_body(const std::uint64_t* active, const std::uint64_t* positive,
                                   std::size_t n_words, std::int8_t* signs) noexcept {
  for (std::size_t w = 0; w < n_words; ++w) {
    coding::detail::expand_word(active[w] & positive[w], active[w] & ~positive[w], signs + 64 * w);
  }
}

}  // namespace detail

/// Writes the signs of a code, -1, 0 or +1: a column is not 0 where its bit in `active` is set, and
/// +1 where that in `positive` is set, too. Shapes: words (n_words,), signs (64 n_words,).
SDNN_KERNEL(void, spread_signs,
            (const std::uint64_t* active, const std::uint64_t* positive, std::size_t n_words,
             std::int8_t* signs),
            (active, positive, n_words, signs))

/// Computes the inner product of each row of weights with the code. Requires weights below 2^23 in
/// magnitude. Shapes: rows and sums (n_rows,), each row and signs (n_columns,).
SDNN_KERNEL(void, row_sums,
            (const std::int32_t* const* rows, std::size_t n_rows, const std::int8_t* signs,
             std::size_t n_columns, std::int64_t* sums),
            (rows, n_rows, signs, n_columns, sums))

/// Returns the inner product of a row of weights with the code.
inline std::int64_t row_sum(const std::int32_t* row, const std::int8_t* signs,
                            std::size_t n_columns) {
  std::int64_t sum = 0;
  row_sums(&row, 1, signs, n_columns, &sum);
  return sum;
}

/// Applies a step of learning to a row's traces and weights. Shapes: weights, traces and signs
/// (n_columns,).
SDNN_KERNEL(RowUse, learn_row,
            (std::int32_t* weights, std::int32_t* traces, const std::int8_t* signs,
             std::size_t n_columns, RowStep step),
            (weights, traces, signs, n_columns, step))

class LinearSDNN;

/// The code of a state in the form for products with rows of weights.
class LinearCode {
 public:
  /// The number of columns that are not 0.
  std::int32_t n_active() const noexcept { return n_active_; }
  /// The code: -1, 0 or +1 for each column.
  const std::vector<std::int8_t>& signs() const noexcept { return signs_; }

 private:
  friend class LinearSDNN;

  std::vector<std::int8_t> signs_;
  std::int32_t n_active_ = 0;
};

/// The workspace of a user who reads the model: a state, its code, and the products of rows with
/// it. A product is computed again when the version of its row has changed.
class LinearWorkspace {
 public:
  const LinearCode& code() const noexcept { return code_; }

 private:
  friend class LinearSDNN;
  LinearCode code_;
  std::vector<coding::Bin> bins_, new_bins_;
  std::vector<std::uint64_t> words_;
  std::vector<std::int64_t> row_sums_;
  std::vector<std::uint64_t> versions_;  ///< versions of the summed rows; 0: none
  std::vector<std::int64_t> sums_;       ///< sums of the actions of a dimension
};

/// Eligibility traces of the weights in a stream of experience: how much each weight contributed to
/// earlier values.
class LinearTrace {
 public:
  /// Makes traces that are all 0.
  LinearTrace(std::size_t n_rows, std::size_t n_columns)
      : n_columns_(n_columns), values_(n_rows * n_columns), live_(n_rows) {}

  /// The traces of a row's weights. Whoever changes them must call set_live with whether any is not
  /// 0.
  std::int32_t* row(std::size_t i) noexcept { return &values_[i * n_columns_]; }
  void set_live(std::size_t i, bool is_live) noexcept { live_[i] = is_live; }

  /// Sets all traces to 0. Only live rows need it, as the traces of others are 0 already.
  void clear() noexcept {
    for (std::size_t row = 0; row < live_.size(); ++row) {
      if (live_[row]) std::fill_n(&values_[row * n_columns_], n_columns_, 0);
      live_[row] = false;
    }
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::vector<std::int32_t> values;  // empty without a trace
    if (std::ranges::find(self.live_, true) != self.live_.end()) values = self.values_;
    archive.numbers("values", values);
    if constexpr (Archive::kReads) {
      archive.expect(values.empty() || values.size() == self.values_.size(), "values",
                     "empty or one for each weight");
      archive.expect(
          std::ranges::all_of(values, [](std::int32_t z) { return std::abs(z) <= kLargestTrace; }),
          "values", "in their range");
      values.resize(self.values_.size());
      self.values_ = std::move(values);
      for (std::size_t row = 0; row < self.live_.size(); ++row) {
        const auto* const first = &self.values_[row * self.n_columns_];
        self.live_[row] = std::any_of(first, first + self.n_columns_, [](auto z) { return z; });
      }
    }
  }

 private:
  friend class LinearSDNN;

  std::size_t n_columns_;
  std::vector<std::int32_t> values_;
  std::vector<bool> live_;  ///< rows that are not all 0
};

}  // namespace sdnn::approximators
