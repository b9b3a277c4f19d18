#include "sdnn/estimators/kernel_sums.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "errors.hpp"
#include "instruction_sets.hpp"

namespace sdnn {
namespace {

using estimators::InputCorrelations;
using estimators::KernelSums;
using Bins = std::vector<std::int32_t>;
using Reals = std::vector<double>;

/// Correlations with the first of n bins that fall by a factor from bin to bin.
InputCorrelations powers_of(double factor, std::size_t n_bins) {
  InputCorrelations input{Reals(n_bins, 1.0), n_bins};
  for (std::size_t b = 1; b < n_bins; ++b) input.values[b] = factor * input.values[b - 1];
  return input;
}

/// Correlations of all pairs of bins that fall by a factor from bin to bin.
InputCorrelations table_of_powers(double factor, std::size_t n_bins) {
  InputCorrelations input{Reals(n_bins * n_bins), n_bins};
  for (std::size_t a = 0; a < n_bins; ++a) {
    for (std::size_t b = 0; b < n_bins; ++b) {
      input.values[a * n_bins + b] = std::pow(factor, static_cast<double>(a > b ? a - b : b - a));
    }
  }
  return input;
}

/// Bins of samples, all in [0, n_bins).
Bins bins_of(std::size_t n_samples, std::size_t n_inputs, int n_bins) {
  Bins bins(n_samples * n_inputs);
  for (std::size_t k = 0; k < bins.size(); ++k) bins[k] = static_cast<int>(k * k + k / 7) % n_bins;
  return bins;
}

Reals matrix_of(const KernelSums& kernel, const Bins& bins) {
  Reals matrix(bins.size() / kernel.n_inputs() * kernel.n_samples());
  kernel.matrix(bins, matrix);
  return matrix;
}

// The last two arguments of a kernel are its number of terms, here that of inputs, and its degree:
// a kernel k of degree 1 becomes (k + k^2) / 2 for degree 2, and k^3 for degree 3.
TEST(KernelSums, IsTheMeanOverPairsByHand) {
  const std::vector inputs{powers_of(0.5, 4), InputCorrelations{{1.0, 0.25, 0.25, 1.0}, 2}};
  // The query (2, 1) correlates with the sample (0, 0) by 1/4 and 1/4, with (3, 1) by 1/2 and 1.
  // The kernel is the mean of (1 + rho_i) / 2 * rho_j over the ordered pairs of inputs i != j.
  const double far = (1.25 / 2 * 0.25 + 1.25 / 2 * 0.25) / 2;
  const double near = (1.5 / 2 * 1.0 + 2.0 / 2 * 0.5) / 2;
  EXPECT_EQ(matrix_of({inputs, Bins{0, 0, 3, 1}, 2, 1}, {2, 1}), (Reals{far, near}));
  EXPECT_EQ(matrix_of({inputs, Bins{0, 0}, 2, 2}, {2, 1}), Reals{far * (0.5 + 0.5 * far)});
  EXPECT_EQ(matrix_of({inputs, Bins{0, 0}, 2, 3}, {2, 1}), Reals{far * far * far});
  EXPECT_EQ(matrix_of({{powers_of(0.5, 4)}, Bins{0, 1, 3}, 1, 1}, {1}), (Reals{0.5, 1.0, 0.25}));
}

// Correlations that fall by a factor are powers of it, which need no table of all pairs of bins.
TEST(KernelSums, PowersAndTablesAgree) {
  const Bins samples = bins_of(50, 3, 40), queries = bins_of(37, 3, 31);
  const KernelSums powers({powers_of(0.9, 40), powers_of(0.7, 40), powers_of(0.99, 40)}, samples, 3,
                          2);
  const KernelSums tables(
      {table_of_powers(0.9, 40), table_of_powers(0.7, 40), table_of_powers(0.99, 40)}, samples, 3,
      2);
  const Reals first = matrix_of(powers, queries), second = matrix_of(tables, queries);
  for (std::size_t k = 0; k < first.size(); ++k) EXPECT_NEAR(first[k], second[k], 1e-14);
}

TEST(KernelSums, ABinOfCorrelationZeroIsUnlikeAll) {
  // Bin 2 of the first input and bin 1 of the second are for missing values: the first input
  // correlates them with nothing, the second with one another.
  const std::vector inputs{InputCorrelations{{1.0, 0.5, 0.0}, 3},
                           InputCorrelations{{0.0, 0.0, 0.0, 1.0}, 2}};
  // With a single term the kernel is the sum of both correlations: 0.5 + 0 for bins (1, 0) and
  // (0, 0), 0 + 1 for (2, 1) and itself.
  const KernelSums kernel(inputs, Bins{0, 0, 2, 1}, 1, 1);
  EXPECT_EQ(matrix_of(kernel, {1, 0, 2, 1}), (Reals{0.5, 0.0, 0.0, 1.0}));
}

// 83 samples and 41 queries have five inputs of 20 bins; there are two outputs.
TEST(KernelSums, SumsAreProductsWithTheMatrixWithTheSameBitsEverywhere) {
  const Bins samples = bins_of(83, 5, 20), queries = bins_of(41, 5, 20);
  const std::vector inputs{powers_of(0.9, 20), table_of_powers(0.8, 20), powers_of(0.8, 20),
                           table_of_powers(0.5, 20), powers_of(0.95, 20)};
  const KernelSums kernel(inputs, samples, 5, 3);
  Reals coefficients(83 * 2);
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    coefficients[k] = std::sin(static_cast<double>(k));
  }
  const Reals matrix = matrix_of(kernel, queries);
  Reals sums(41 * 2);
  kernel.sums(queries, coefficients, 2, sums);
  for (std::size_t q = 0; q < 41; ++q) {
    for (std::size_t o = 0; o < 2; ++o) {
      double expected = 0.0;
      for (std::size_t s = 0; s < 83; ++s) expected += matrix[q * 83 + s] * coefficients[2 * s + o];
      EXPECT_NEAR(sums[2 * q + o], expected, 1e-13);
    }
  }
  testing::on_every_instruction_set([&](const auto& name) {
    Reals again(41 * 2);
    kernel.sums(queries, coefficients, 2, again);
    EXPECT_EQ(again, sums) << name;
    EXPECT_EQ(matrix_of(kernel, queries), matrix) << name;
  });
}

TEST(KernelSums, RefusesImpossibleArguments) {
  using testing::message_of;
  const std::vector inputs{powers_of(0.5, 4)};
  const auto message = [](std::vector<InputCorrelations> of, const Bins& bins, std::size_t n_terms,
                          int degree) {
    return message_of([&] { KernelSums(std::move(of), bins, n_terms, degree); });
  };
  EXPECT_EQ(message({}, {}, 1, 1), "inputs must be between 1 and 8192, got 0");
  EXPECT_EQ(message({{{1.0, 0.5, 0.2}, 2}}, {0}, 1, 1),
            "inputs must be correlations of one bin or all bins, got 3");
  EXPECT_EQ(message({{{1.0, 1e-200}, 2}}, {0}, 1, 1),
            "inputs must be correlations of one bin of 0, or at least 1e-150, got others");
  EXPECT_EQ(message({{{1.0, NAN}, 2}}, {0}, 1, 1),
            "inputs must be finite correlations, got others");
  EXPECT_EQ(message(inputs, {4}, 1, 1), "bins must be in [0, 4), got 4");
  EXPECT_EQ(message(inputs, {0}, 2, 1), "n_terms must be in [1, 1], got 2");
  EXPECT_EQ(message(inputs, {0}, 1, 4), "degree must be in [1, 3], got 4");
  const KernelSums kernel(inputs, Bins{0, 1}, 1, 1);
  Reals out(2);
  EXPECT_EQ(message_of([&] { kernel.matrix(Bins{-1}, out); }), "bins must be in [0, 4), got -1");
  EXPECT_EQ(message_of([&] { kernel.matrix(Bins{1, 1}, out); }), "out must be 4 values, got 2");
  EXPECT_EQ(message_of([&] { kernel.sums(Bins{0}, Reals{1.0}, 1, out); }),
            "coefficients must be 2 values, got 1");
}

}  // namespace
}  // namespace sdnn
