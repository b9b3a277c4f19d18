#include "sdnn/coding/detail/coded_samples.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "sdnn/core/random.hpp"

namespace sdnn::coding {
namespace {

SelectiveDesensitization small_code(std::size_t n_units) {
  core::Random random(2, core::Stream::code_books);
  const auto draw = [&] {
    PatternTable table(5, n_units);
    for (std::size_t bin = 0; bin < 5; ++bin) fill_random(table, bin, true, random);
    return table;
  };
  return {{draw(), draw()}, {draw(), draw()}, {{0, 1}, {1, 0}}};
}

// A column is 0 where the modifier's pattern, the second one, is -1.
TEST(CodedSamples, SignsAreAsWorkedByHand) {
  const SelectiveDesensitization code(
      {PatternTable::from_signs(std::vector<std::int8_t>{1, -1, 1}, 1, 3)},
      {PatternTable::from_signs(std::vector<std::int8_t>{1, 1, -1}, 1, 3)}, {{0, 0}});
  std::vector<std::int8_t> signs(3);
  write_signs(code, std::vector<Bin>{0}, signs);
  EXPECT_EQ(signs, (std::vector<std::int8_t>{1, -1, 0}));
}

TEST(CodedSamples, ProductsEqualThoseOfSigns) {
  const auto code = small_code(70);
  const std::vector<Bin> bins = {0, 1, 2, 3, 4, 0};
  const std::vector<Bin> other_bins = {4, 4, 1, 2};
  std::vector<std::int8_t> signs(3 * 140);  // 3 samples, 2 pairs of 70 columns
  std::vector<std::int8_t> other_signs(2 * 140);
  write_signs(code, bins, signs);
  write_signs(code, other_bins, other_signs);
  std::vector<std::int32_t> products(6);
  write_products(code, bins, other_bins, products);
  for (std::size_t t = 0; t < 3; ++t) {
    for (std::size_t s = 0; s < 2; ++s) {
      int sum = 0;
      for (std::size_t j = 0; j < 140; ++j) sum += signs[t * 140 + j] * other_signs[s * 140 + j];
      EXPECT_EQ(products[t * 2 + s], sum);
    }
  }
}

TEST(CodedSamples, CodesArePaddedToFourWords) {
  const auto code = small_code(8);                               // a word for each of 2 pairs
  const CodedSamples coded(code, std::vector<Bin>{0, 1, 2, 3});  // 2 samples of 2 inputs
  EXPECT_EQ(coded.size(), 2U);
  EXPECT_EQ(coded.n_words(), 4U);
  EXPECT_EQ(CodedSamples::bytes(code, 2), 2U * 2 * 4 * 8);  // samples, bits of two kinds, words
}

TEST(CodedSamples, RefuseBinsOutOfRange) {
  const auto code = small_code(8);  // bins are 0 to 4
  std::vector<std::int8_t> signs(16);
  EXPECT_THROW(write_signs(code, std::vector<Bin>{0, 5}, signs), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::coding
