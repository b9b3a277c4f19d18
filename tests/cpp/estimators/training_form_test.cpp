#include "sdnn/estimators/training_form.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace {

using namespace sdnn;
using estimators::TrainingForm;

/// The demonstration problem's sizes: two pairs of n = 2000 units, half of them on.
coding::SelectiveDesensitization demonstration_code(std::size_t n_pattern_units = 2000) {
  coding::PatternTable table(2, n_pattern_units);
  for (std::size_t k = 0; k < n_pattern_units / 2; ++k) table.flip(0, k);
  const std::vector tables(2, table);
  return {tables, tables, {{0, 1}, {1, 0}}};
}

TEST(TrainingForm, NamesGoBothWays) {
  ASSERT_EQ(estimators::kTrainingForms.size(), 4U);
  for (const auto form : estimators::kTrainingForms) {
    EXPECT_EQ(estimators::training_form_named(estimators::name_of(form)), form);
  }
  EXPECT_THROW(estimators::training_form_named("primal"), std::invalid_argument);
}

TEST(TrainingForm, MemoryByHand) {
  const auto code = demonstration_code();
  EXPECT_EQ(estimators::with_product_type(code, []<class Product>() { return sizeof(Product); }),
            2U);
  EXPECT_EQ(estimators::form_memory(TrainingForm::plain, 280, code, 2000), 0U);
  EXPECT_EQ(estimators::form_memory(TrainingForm::block, 280, code, 2000),
            4U * 288 * (4096 + 128 + 32) +
                128U * (2 * 64 * 8 + 4096 + 4 * 288 + 2 * 128 + 2000 + 32 * 4));
  EXPECT_EQ(estimators::form_memory(TrainingForm::block, 280, code, 2000, true) -
                estimators::form_memory(TrainingForm::block, 280, code, 2000),
            384U * (2 * 64 * 8 + 4096 + 2 * 4 * 288 + 2000 + 32 * 4) + 2 * (512 * 512 - 128 * 128) +
                2000U * (512 * 2 + 2000 + 32 * 4));
  EXPECT_EQ(estimators::form_memory(TrainingForm::dual, 280, code, 2000),
            2000U * 2016 * 2 + 280U * 2016 * 4 + 2000U * 288 * 2 + 2000U * 2 * 64 * 8 +
                4U * 288 * (128 + 32) + 2U * 128 * 128);
}

TEST(TrainingForm, CountsTheInnerProducts) {  // 16,000 columns of 20,000 samples take too long
  const auto code = demonstration_code(8000);
  const auto chosen = [&](std::size_t n_samples, std::size_t n_units) {
    return estimators::choose_form(TrainingForm::automatic, n_units, code, n_samples,
                                   std::size_t{64} << 30);
  };
  EXPECT_EQ(chosen(2000, 60), TrainingForm::dual);
  EXPECT_EQ(chosen(6000, 280), TrainingForm::dual);
  EXPECT_EQ(chosen(20000, 280), TrainingForm::block);
}

TEST(TrainingForm, SuitsTheSizeAndTheLimit) {
  const auto code = demonstration_code();
  const auto chosen = [&](std::size_t n_samples, std::size_t limit) {
    return estimators::choose_form(TrainingForm::automatic, 280, code, n_samples, limit);
  };
  EXPECT_EQ(chosen(2000, 1 << 30), TrainingForm::dual);
  EXPECT_EQ(chosen(2000, 10 << 20), TrainingForm::block);
  EXPECT_EQ(chosen(2000, 1 << 20), TrainingForm::plain);
  EXPECT_EQ(chosen(6000, 1 << 30), TrainingForm::dual);
  EXPECT_EQ(chosen(7000, 1 << 30), TrainingForm::block);
  EXPECT_EQ(chosen(50000, std::size_t{64} << 30), TrainingForm::block);
  EXPECT_THROW(estimators::choose_form(TrainingForm::dual, 280, code, 2000, 10 << 20),
               std::length_error);
}

}  // namespace
