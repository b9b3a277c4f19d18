#include "sdnn/coding/correlation_matrix.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace {

using namespace sdnn;

double correlation(const coding::PatternTable& table, std::size_t i, std::size_t j) {
  int sum = 0;
  for (std::size_t k = 0; k < table.n_units(); ++k) sum += table.sign(i, k) * table.sign(j, k);
  return sum / static_cast<double>(table.n_units());
}

TEST(CorrelationMatrix, PatternsAreBalancedAndHaveNearlyTheWantedCorrelations) {
  constexpr std::size_t kBins = 12, kUnits = 1000;
  std::vector<double> wanted(kBins * kBins);  // 0.9 to the number of bins between two angles
  for (std::size_t i = 0; i < kBins; ++i) {
    for (std::size_t j = 0; j < kBins; ++j) {
      const std::size_t apart = i > j ? i - j : j - i;
      wanted[i * kBins + j] = std::pow(0.9, static_cast<double>(std::min(apart, kBins - apart)));
    }
  }
  core::Random random(2, core::Stream::code_books);
  const auto table = coding::correlation_matrix_patterns(kUnits, wanted, kBins, random);
  for (std::size_t i = 0; i < kBins; ++i) {
    EXPECT_EQ(table[i].count(), kUnits / 2);
    for (std::size_t j = 0; j < kBins; ++j) {
      // A swap of two units moves a correlation by 4 / 1000. The least wanted one is 0.9^6 = 0.53;
      // random patterns would have 0 +- 0.03.
      EXPECT_NEAR(correlation(table, i, j), wanted[i * kBins + j], 0.02) << i << ' ' << j;
    }
  }
}

TEST(CorrelationMatrix, GivesOppositeAndUncorrelatedPatterns) {
  const std::array<double, 9> wanted{1, -1, 0, -1, 1, 0, 0, 0, 1};
  core::Random random(2, core::Stream::code_books);
  const auto table = coding::correlation_matrix_patterns(/*n_units=*/200, wanted, 3, random);
  EXPECT_DOUBLE_EQ(correlation(table, 0, 1), -1.0);
  // At most two more than half of the 200 units agree, or differ.
  EXPECT_NEAR(correlation(table, 0, 2), 0.0, 2 * 2 / 200.0 + 1e-9);
}

TEST(CorrelationMatrix, RefusesMatricesThatAreNoCorrelations) {
  core::Random random(2, core::Stream::code_books);
  const auto make = [&](std::array<double, 4> wanted, int n_units) {
    return coding::correlation_matrix_patterns(n_units, wanted, 2, random);
  };
  EXPECT_THROW(make({1, 0.5, 0.4, 1}, 100), std::invalid_argument);    // not symmetric
  EXPECT_THROW(make({0.9, 0.5, 0.5, 1}, 100), std::invalid_argument);  // no 1 on the diagonal
  EXPECT_THROW(make({1, 1.5, 1.5, 1}, 100), std::invalid_argument);    // above 1
  EXPECT_THROW(make({1, std::nan(""), std::nan(""), 1}, 100), std::invalid_argument);
  EXPECT_THROW(make({1, 0.5, 0.5, 1}, 101), std::invalid_argument);  // an odd number of units
  EXPECT_THROW(coding::correlation_matrix_patterns(100, {}, 2, random), std::invalid_argument);
}

}  // namespace
