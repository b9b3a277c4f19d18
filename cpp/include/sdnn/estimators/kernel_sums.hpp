/// The kernel of samples, to which inner products of codes converge as the codes become longer.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace sdnn::estimators {

/// The correlations of the patterns of an input's bins, in one of two forms. A table, shape
/// (n_bins, n_bins), has those of any two bins. If correlations fall by a constant factor from bin
/// to bin, those with the first bin, shape (n_bins,), are enough; there a 0 marks a bin that
/// correlates with no other, nor with itself.
struct InputCorrelations {
  std::vector<double> values;
  std::size_t n_bins = 0;

  /// Whether only the correlations with the first bin are stored.
  bool is_geometric() const noexcept { return values.size() == n_bins; }
};

/// The number of samples in a group, whose numbers of one kind are adjacent in memory.
inline constexpr std::size_t kGroupSamples = 16;

/// Samples in groups of kGroupSamples. For a geometric input a sample has its correlation with the
/// first bin, a power of the input's factor, and the inverse; for an input with a table, its bin.
struct SampleGroups {
  const double* powers;      ///< (n_groups, n_geometric, 2, kGroupSamples)
  const std::int32_t* bins;  ///< (n_groups, n_tables, kGroupSamples)
  std::size_t n_geometric;
  std::size_t n_tables;
};

/// A query: for geometric inputs its powers and their inverses as in SampleGroups, and for other
/// inputs the rows of their tables that belong to its bins.
struct KernelQuery {
  const double* powers;       ///< (n_geometric, 2)
  const double* const* rows;  ///< (n_tables,)
};

/// The constants of the kernel: k = linear * t + quadratic * (t^2 - s), where t is the sum of the
/// inputs' correlations and s that of their squares, and then k, (k + k^2) / 2 or k^3 for the
/// degree 1, 2 or 3.
struct KernelForm {
  double linear;
  double quadratic;
  int degree;
};

namespace detail {

/// Reads a register of numbers, or a single one: Real is core::Lanes or double.
template <class Real>
SDNN_INLINE Real loaded(const double* from) noexcept {
  if constexpr (sizeof(Real) == sizeof(double)) {
    return *from;
  } else {
    return Real::load(from);
  }
}

/// Writes a register of numbers, or a single one.
SDNN_INLINE void stored(double value, double* to) noexcept { *to = value; }
template <class Real>
SDNN_INLINE void stored(const Real& value, double* to) noexcept {
  value.store(to);
}

/// Implements kernel_values, below, with several samples in each register.
template <class Real>
SDNN_INLINE void kernel_values_in_lanes(const SampleGroups& groups, std::size_t begin,
                                        std::size_t end, const KernelQuery& query,
                                        const KernelForm& form, double* out) noexcept {
  constexpr std::size_t kSize = sizeof(Real) / sizeof(double);
  constexpr std::size_t kRegisters = kGroupSamples / kSize;
  for (std::size_t group = begin; group < end; ++group) {
    Real total[kRegisters], squares[kRegisters];
    core::unrolled<kRegisters>([&](std::size_t r)
                                   SDNN_INLINE_LAMBDA { total[r] = squares[r] = Real(0.0); });
    const double* power = groups.powers + group * groups.n_geometric * 2 * kGroupSamples;
    for (std::size_t i = 0; i < groups.n_geometric; ++i, power += 2 * kGroupSamples) {
      const Real query_power(query.powers[2 * i]);
      const Real query_inverse(query.powers[2 * i + 1]);
      core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
        const Real sample_power = loaded<Real>(power + r * kSize);
        const Real sample_inverse = loaded<Real>(power + kGroupSamples + r * kSize);
        // Bins i and j have powers f^i and f^j, f <= 1; their correlation is f^|i - j|, the smaller
        // one of f^i / f^j and f^j / f^i.
        const Real rho = core::smaller(query_power * sample_inverse, query_inverse * sample_power);
        total[r] = total[r] + rho;
        squares[r] = squares[r] + rho * rho;
      });
    }
    const std::int32_t* bins = groups.bins + group * groups.n_tables * kGroupSamples;
    for (std::size_t i = 0; i < groups.n_tables; ++i, bins += kGroupSamples) {
      double row[kGroupSamples];
      for (std::size_t k = 0; k < kGroupSamples; ++k) row[k] = query.rows[i][bins[k]];
      core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
        const Real rho = loaded<Real>(row + r * kSize);
        total[r] = total[r] + rho;
        squares[r] = squares[r] + rho * rho;
      });
    }
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
      Real kernel = form.linear * total[r] + form.quadratic * (total[r] * total[r] - squares[r]);
      if (form.degree == 2) kernel = kernel * (0.5 + 0.5 * kernel);
      if (form.degree == 3) kernel = kernel * (kernel * kernel);
      stored(kernel, out + (group - begin) * kGroupSamples + r * kSize);
    });
  }
}

/// Implements product, below, with 16 partial sums on every machine, so that the bits are the same.
template <class Real>
SDNN_INLINE double product_in_lanes(const double* a, const double* b, std::size_t size) noexcept {
  constexpr std::size_t kSize = sizeof(Real) / sizeof(double);
  constexpr std::size_t kRegisters = kGroupSamples / kSize;
  Real sum[kRegisters];
  core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA { sum[r] = Real(0.0); });
  for (std::size_t at = 0; at < size; at += kGroupSamples) {
    core::unrolled<kRegisters>([&](std::size_t r) SDNN_INLINE_LAMBDA {
      sum[r] = sum[r] + loaded<Real>(a + at + r * kSize) * loaded<Real>(b + at + r * kSize);
    });
  }
  double parts[kGroupSamples];
  core::unrolled<kRegisters>([&](std::size_t r)
                                 SDNN_INLINE_LAMBDA { stored(sum[r], parts + r * kSize); });
  double result = 0.0;
  for (const double part : parts) result += part;
  return result;
}

#if SDNN_LANES
using Baseline = core::Lanes<2>;
#else
using Baseline = double;
#endif

}  // namespace detail

#define SDNN_KERNEL_OF_REALS(Result, name, parameters, arguments)                                 \
  SDNN_KERNEL_VERSION(, Result, name##_portable, parameters, name##_in_lanes<Baseline> arguments) \
  SDNN_KERNEL_NEON(Result, name, parameters, arguments)                                           \
  SDNN_KERNELS_OF_WIDE_REALS(Result, name, parameters, arguments)                                 \
  SDNN_DISPATCH(Result, name, parameters, arguments)
#if SDNN_X86_KERNELS
#define SDNN_KERNELS_OF_WIDE_REALS(Result, name, parameters, arguments)          \
  SDNN_KERNEL_VERSION([[SDNN_TARGET_AVX2]], Result, name##_avx2, parameters,     \
                      name##_in_lanes<core::Lanes<4>> arguments)                 \
  SDNN_KERNEL_VERSION([[SDNN_TARGET_AVX512]], Result, name##_avx512, parameters, \
                      name##_in_lanes<core::Lanes<8>> arguments)
#else
#define SDNN_KERNELS_OF_WIDE_REALS(Result, name, parameters, arguments)
#endif

/// Computes the kernel of a query and the samples of groups [begin, end), one after the other.
SDNN_KERNEL_OF_REALS(void, kernel_values,
                     (const SampleGroups& groups, std::size_t begin, std::size_t end,
                      const KernelQuery& query, const KernelForm& form, double* out),
                     (groups, begin, end, query, form, out))

/// Computes the sum of a[i] * b[i] for i < size, a multiple of kGroupSamples, in the same order on
/// every machine.
SDNN_KERNEL_OF_REALS(double, product, (const double* a, const double* b, std::size_t size),
                     (a, b, size))

#undef SDNN_KERNEL_OF_REALS
#undef SDNN_KERNELS_OF_WIDE_REALS

/// The kernel, of the code of all pairs of inputs, between fixed samples and any queries.
///
/// Let rho_i be the correlation of the patterns of input i in two samples. Then k is the mean of
/// (1 + rho_i) / 2 * rho_j over all i != j, or rho of a single input; the kernel is k, (k + k^2) /
/// 2 or k^3 for the degree 1, 2 or 3. All sums have a fixed order, so that results have the same
/// bits on every instruction set.
///
/// Cost: some six operations for each sample and input, several samples at a time in vector
/// registers. Thread safety: calls may run at the same time.
class KernelSums {
 public:
  /// Takes the correlations of all inputs, and the samples. `n_terms` is the number of inputs in
  /// the mean. It is below the number of `inputs` if the correlations of some are given as sums of
  /// two entries. Shapes: bins (n_samples, n_inputs). Throws std::invalid_argument for impossible
  /// arguments.
  KernelSums(std::vector<InputCorrelations> inputs, std::span<const std::int32_t> bins,
             std::size_t n_terms, int degree)
      : inputs_(std::move(inputs)) {
    core::require(!inputs_.empty() && inputs_.size() <= kMostInputs, "inputs",
                  "between 1 and " + std::to_string(kMostInputs), inputs_.size());
    core::require_in_range("degree", degree, 1, 3);
    core::require_in_range("n_terms", n_terms, std::size_t{1}, inputs_.size());
    const auto n = static_cast<double>(n_terms);
    form_ = {1.0, 0.0, degree};
    if (n_terms > 1) form_ = {1.0 / (2.0 * n), 1.0 / (2.0 * n * (n - 1.0)), degree};
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      check(inputs_[i]);
      (inputs_[i].is_geometric() ? geometric_ : tables_).push_back(i);
    }
    check_bins(bins);
    n_samples_ = bins.size() / n_inputs();
    const std::size_t n_groups = core::round_up(n_samples_, kGroupSamples) / kGroupSamples;
    powers_ = core::AlignedBuffer<double>(
        core::checked_product(n_groups, geometric_.size() * 2 * kGroupSamples));
    bins_.resize(core::checked_product(n_groups, tables_.size() * kGroupSamples));
    for (std::size_t s = 0; s < n_samples_; ++s) {
      const std::int32_t* const sample = &bins[s * n_inputs()];
      const std::size_t group = s / kGroupSamples, lane = s % kGroupSamples;
      for (std::size_t i = 0; i < geometric_.size(); ++i) {
        const double power = power_of(geometric_[i], sample);
        double* const at =
            powers_.data() + (group * geometric_.size() + i) * 2 * kGroupSamples + lane;
        at[0] = power;
        at[kGroupSamples] = inverse(power);
      }
      for (std::size_t i = 0; i < tables_.size(); ++i) {
        bins_[(group * tables_.size() + i) * kGroupSamples + lane] = sample[tables_[i]];
      }
    }
  }

  std::size_t n_inputs() const noexcept { return inputs_.size(); }
  std::size_t n_samples() const noexcept { return n_samples_; }

  /// Writes the kernel of queries and samples. Shapes: bins (n_queries, n_inputs), out (n_queries,
  /// n_samples). Throws std::invalid_argument for other sizes or bins out of range.
  void matrix(std::span<const std::int32_t> bins, std::span<double> out) const {
    core::require_size("out", out.size(), bins.size() / n_inputs() * n_samples_);
    for_each_query(bins, [&](std::size_t query, const double* kernel) {
      std::copy_n(kernel, n_samples_, out.data() + query * n_samples_);
    });
  }

  /// Writes sums over samples of the kernel times coefficients. Shapes: bins (n_queries, n_inputs),
  /// coefficients (n_samples, n_outputs), out (n_queries, n_outputs). Throws as matrix() does.
  void sums(std::span<const std::int32_t> bins, std::span<const double> coefficients,
            std::size_t n_outputs, std::span<double> out) const {
    core::require_size("coefficients", coefficients.size(), n_samples_ * n_outputs);
    core::require_size("out", out.size(), bins.size() / n_inputs() * n_outputs);
    const std::size_t size = core::round_up(n_samples_, kGroupSamples);
    core::AlignedBuffer<double> columns(core::checked_product(n_outputs, size));
    for (std::size_t s = 0; s < n_samples_; ++s) {
      for (std::size_t o = 0; o < n_outputs; ++o) {
        columns.data()[o * size + s] = coefficients[s * n_outputs + o];
      }
    }
    for_each_query(bins, [&](std::size_t query, const double* kernel) {
      for (std::size_t o = 0; o < n_outputs; ++o) {
        out[query * n_outputs + o] = product(kernel, columns.data() + o * size, size);
      }
    });
  }

 private:
  static constexpr std::size_t kMostInputs = 8192;
  static constexpr double kLeastPower = 1e-150;       // so that no product overflows
  static constexpr std::size_t kQueriesAtOnce = 16;   // they share the samples in the cache
  static constexpr std::size_t kPowersAtOnce = 3072;  // they fit into the first-level cache

  /// Throws std::invalid_argument for correlations of a wrong size or value.
  static void check(const InputCorrelations& input) {
    const std::size_t n_bins = input.n_bins, size = input.values.size();
    core::require(n_bins > 0 && (size == n_bins || size / n_bins == n_bins), "inputs",
                  "correlations of one bin or all bins", size);
    core::require(core::are_finite(input.values), "inputs", "finite correlations", "others");
    if (!input.is_geometric()) return;
    const auto fits = [](double power) { return power == 0.0 || power >= kLeastPower; };
    core::require(std::ranges::all_of(input.values, fits), "inputs",
                  "correlations of one bin of 0, or at least 1e-150", "others");
  }

  /// Returns the inverse of a power, or 0 for 0, so that a bin marked by 0 correlates with no
  /// other.
  static double inverse(double power) noexcept { return power == 0.0 ? 0.0 : 1.0 / power; }

  void check_bins(std::span<const std::int32_t> bins) const {
    core::require(bins.size() % n_inputs() == 0, "bins", "of all inputs", bins.size());
    for (std::size_t at = 0; at < bins.size(); ++at) {
      const std::size_t n_bins = inputs_[at % n_inputs()].n_bins;
      if (bins[at] >= 0 && static_cast<std::size_t>(bins[at]) < n_bins) continue;
      core::require(false, "bins", "in [0, " + std::to_string(n_bins) + ")", bins[at]);
    }
  }

  double power_of(std::size_t input, const std::int32_t* bins) const noexcept {
    return inputs_[input].values[static_cast<std::size_t>(bins[input])];
  }

  /// Calls consume(query, kernel) for each query; kernel has the values for all samples, and behind
  /// them those of padding. A few queries at a time visit each part of the samples, so that it is
  /// read from the cache.
  template <class Consume>
  void for_each_query(std::span<const std::int32_t> bins, const Consume& consume) const {
    check_bins(bins);
    const std::size_t n_queries = bins.size() / n_inputs();
    const std::size_t n_groups = core::round_up(n_samples_, kGroupSamples) / kGroupSamples;
    const std::size_t step = std::max<std::size_t>(
        1, kPowersAtOnce / (2 * kGroupSamples * std::max<std::size_t>(1, geometric_.size())));
    const SampleGroups groups{powers_.data(), bins_.data(), geometric_.size(), tables_.size()};
    const std::size_t n_at_once = std::min(kQueriesAtOnce, n_queries);
    core::AlignedBuffer<double> kernel(n_at_once * n_groups * kGroupSamples);
    std::vector<double> powers(n_at_once * geometric_.size() * 2);
    std::vector<const double*> rows(n_at_once * tables_.size());
    for (std::size_t first = 0; first < n_queries; first += n_at_once) {
      core::interruption_point();
      const std::size_t n = std::min(n_at_once, n_queries - first);
      for (std::size_t q = 0; q < n; ++q) {
        const std::int32_t* const query = &bins[(first + q) * n_inputs()];
        for (std::size_t i = 0; i < geometric_.size(); ++i) {
          double* const at = &powers[(q * geometric_.size() + i) * 2];
          at[0] = power_of(geometric_[i], query);
          at[1] = inverse(at[0]);
        }
        for (std::size_t i = 0; i < tables_.size(); ++i) {
          const InputCorrelations& input = inputs_[tables_[i]];
          rows[q * tables_.size() + i] =
              &input.values[static_cast<std::size_t>(query[tables_[i]]) * input.n_bins];
        }
      }
      for (std::size_t begin = 0; begin < n_groups; begin += step) {
        for (std::size_t q = 0; q < n; ++q) {
          const KernelQuery query{powers.data() + q * geometric_.size() * 2,
                                  rows.data() + q * tables_.size()};
          kernel_values(groups, begin, std::min(begin + step, n_groups), query, form_,
                        kernel.data() + (q * n_groups + begin) * kGroupSamples);
        }
      }
      for (std::size_t q = 0; q < n; ++q) {
        consume(first + q, kernel.data() + q * n_groups * kGroupSamples);
      }
    }
  }

  std::vector<InputCorrelations> inputs_;
  std::vector<std::size_t> geometric_;  // the numbers of inputs by powers, and by tables
  std::vector<std::size_t> tables_;
  std::size_t n_samples_ = 0;
  KernelForm form_{};
  core::AlignedBuffer<double> powers_;
  std::vector<std::int32_t> bins_;
};

}  // namespace sdnn::estimators
