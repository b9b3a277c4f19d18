#include "sdnn/estimators/detail/code_products.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "estimators/codes.hpp"
#include "instruction_sets.hpp"

namespace sdnn {
namespace {

TEST(CodeProducts, AreExactForAnyNumberOfWords) {
  core::Random random(3, core::Stream::weights);
  for (std::size_t n_words = 0; n_words < 270; n_words += n_words < 70 ? 1 : 13) {
    const auto one = testing::random_code(n_words, random);
    const auto other = testing::random_code(n_words, random);
    std::int32_t expected = 0;
    for (std::size_t slot = 0; slot < 64 * n_words; ++slot)
      expected += one.at(slot) * other.at(slot);
    testing::on_every_instruction_set([&](auto level) {
      EXPECT_EQ(estimators::inner_product(one.words(), other.words(), n_words), expected) << level;
    });
  }
}

TEST(CodeProducts, HoldTheExtremes) {  // where counts in bytes are fullest
  for (const std::size_t n_words : {124U, 128U, 400U}) {
    testing::Code on{std::vector<std::uint64_t>(n_words, ~std::uint64_t{0}),
                     std::vector<std::uint64_t>(n_words, ~std::uint64_t{0})};
    testing::Code off = on;
    off.positive.assign(n_words, 0);
    const auto all = static_cast<std::int32_t>(64 * n_words);
    testing::on_every_instruction_set([&](auto level) {
      EXPECT_EQ(estimators::inner_product(on.words(), on.words(), n_words), all) << level;
      EXPECT_EQ(estimators::inner_product(on.words(), off.words(), n_words), -all) << level;
    });
  }
}

}  // namespace
}  // namespace sdnn
