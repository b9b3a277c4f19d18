#include "tools/yardsticks.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

namespace sdnn::tools {
namespace {

// The product is of floats, so it differs from that of doubles by rounding. Four rows and eight
// columns are multiplied at a time, so sizes are below, at and above multiples of these.
TEST(DenseProduct, EqualsThePlainProductAtAnySize) {
  for (const auto& [n_rows, n_columns] : std::vector<std::pair<std::size_t, std::size_t>>{
           {1, 1}, {3, 7}, {8, 16}, {9, 33}, {90, 240}, {16, 8}}) {
    DenseProduct product(n_rows, n_columns, 1);
    const auto out = product.multiply();
    std::vector<float> portable(n_rows);
    detail::multiply_portable(product.weights().data(), n_rows, n_columns, product.input().data(),
                              portable.data());
    ASSERT_EQ(out.size(), n_rows);
    for (std::size_t i = 0; i < n_rows; ++i) {
      double expected = 0.0;
      for (std::size_t j = 0; j < n_columns; ++j) {
        expected += double{product.weights()[i * n_columns + j]} * double{product.input()[j]};
      }
      EXPECT_NEAR(double{out[i]}, expected, 1e-4);
      EXPECT_NEAR(double{portable[i]}, expected, 1e-4);
    }
    EXPECT_EQ(product.run(2).size(), 2U);
  }
}

TEST(DenseProduct, RefusesBadSizes) {
  EXPECT_THROW(DenseProduct(0, 1, 1), std::invalid_argument);
  EXPECT_THROW(DenseProduct(1, 0, 1), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::tools
