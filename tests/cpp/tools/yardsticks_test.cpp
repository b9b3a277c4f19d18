#include "tools/yardsticks.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "instruction_sets.hpp"

namespace sdnn::tools {
namespace {

TEST(BufferRead, ReadsEveryWord) {
  for (const std::size_t asked : {1U, 64U, 1000U, 4096U}) {
    const BufferRead buffer(asked);
    EXPECT_GE(buffer.n_bytes(), asked);
    EXPECT_LT(buffer.n_bytes(), asked + 64);
    std::uint64_t expected = 0;
    for (std::uint64_t i = 0; i < buffer.n_bytes() / 8; ++i) expected += i * 0x9E3779B97F4A7C15;
    EXPECT_EQ(buffer.sum(), expected);
    EXPECT_EQ(buffer.run(3).size(), 3U);
  }
}

TEST(BufferRead, InstructionSetsAgree) {
  std::vector<std::uint64_t> words(80);
  std::uint64_t expected = 0;
  for (std::size_t i = 0; i < words.size(); ++i) {
    words[i] = (i * i) << (i % 64);
    expected += words[i];
  }
  sdnn::testing::on_every_instruction_set(
      [&](auto level) { EXPECT_EQ(sum_of_words(words.data(), words.size()), expected) << level; });
}

TEST(DenseProduct, IsTheProductAtAnySize) {
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

TEST(Yardsticks, RefuseImpossibleSizes) {
  EXPECT_THROW(BufferRead(0), std::invalid_argument);
  EXPECT_THROW(DenseProduct(0, 1, 1), std::invalid_argument);
  EXPECT_THROW(DenseProduct(1, 0, 1), std::invalid_argument);
  EXPECT_THROW(BufferRead(8).run(-1), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::tools
