#include "sdnn/estimators/training_form.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <vector>

namespace {

using namespace sdnn;
using estimators::TrainingForm;

constexpr auto kAnyMemory = std::numeric_limits<std::size_t>::max();

/// The demonstration problem's sizes: two pairs of n = 2000 units, half of them on.
coding::SelectiveDesensitization demonstration_code(std::size_t n_pattern_units = 2000) {
  coding::PatternTable table(2, n_pattern_units);
  for (std::size_t k = 0; k < n_pattern_units / 2; ++k) table.flip(0, k);
  const std::vector tables(2, table);
  return {tables, tables, {{0, 1}, {1, 0}}};
}

TEST(TrainingForm, FormsAreFoundByTheirNamesAndUnknownNamesAreRefused) {
  ASSERT_EQ(estimators::kTrainingForms.size(), 4U);
  for (const auto form : estimators::kTrainingForms) {
    EXPECT_EQ(estimators::training_form_named(estimators::name_of(form)), form);
  }
  EXPECT_THROW(estimators::training_form_named("primal"), std::invalid_argument);
}

TEST(TrainingForm, MemoryOfEachFormIsThatOfItsTables) {
  const auto code = demonstration_code();
  constexpr std::size_t kSamples = 2000, kUnits = 280;
  constexpr std::size_t kPadded = 288;                    // units, to a multiple of 16
  constexpr std::size_t kActive = 2000, kColumns = 4096;  // of 4000, to a multiple of 256
  constexpr std::size_t kCode = 2 * kColumns / 8, kWalk = 8 * kColumns / 256;
  EXPECT_EQ(estimators::form_memory(TrainingForm::plain, kUnits, code, kSamples), 0U);
  const auto block_memory = [](std::size_t block, std::size_t n_planned) {
    return 4 * kPadded * kColumns                        // weights
           + block * (kCode + kColumns + 4 * kPadded)    // codes, entries, potentials
           + 4 * kPadded * (block + 32)                  // samples to be presented
           + 2 * 96 * (256 + 4 * block)                  // sums of a tile of 96 units
           + n_planned * (2 * block + kActive + kWalk);  // products, walks through codes
  };
  EXPECT_EQ(estimators::form_memory(TrainingForm::block, kUnits, code, kSamples),
            block_memory(256, 256));
  EXPECT_EQ(estimators::form_memory(TrainingForm::block, kUnits, code, kSamples, true),
            block_memory(512, 512 + kSamples));
  constexpr std::size_t kRow = 2016;  // samples, to a multiple of 32
  EXPECT_EQ(estimators::form_memory(TrainingForm::dual, kUnits, code, kSamples),
            2 * kSamples * kRow                               // products of two codes, of 2 bytes
                + 4 * kUnits * kRow                           // potentials
                + kSamples * (2 * kPadded + kCode)            // coefficients, codes
                + 4 * kPadded * (128 + 32) + 2 * 128 * 128);  // 128 samples to be presented
}

// The dual form computes an inner product of codes for every two samples: too slow for 20,000
// samples of 16,000 columns.
TEST(TrainingForm, IsBlockForManySamplesOfLongCodes) {
  const auto code = demonstration_code(8000);
  const auto chosen = [&](std::size_t n_samples, std::size_t n_units) {
    return estimators::choose_form(TrainingForm::automatic, n_units, code, n_samples, kAnyMemory);
  };
  EXPECT_EQ(chosen(2000, 60), TrainingForm::dual);
  EXPECT_EQ(chosen(6000, 280), TrainingForm::dual);
  EXPECT_EQ(chosen(20000, 280), TrainingForm::block);
}

// Processor seconds of both forms were measured for 20 pairs of 800 pattern units and 280 units:
// `once` for set-up and synchronization, and per epoch. Where the ratio of the sums is below 1.3,
// either choice is good.
TEST(TrainingForm, IsTheFasterFormByMeasuredTimes) {
  struct Measured {
    std::size_t n_samples;
    double dual_once, dual_epoch, block_once, block_epoch;
  };
  coding::PatternTable table(2, 800);
  for (std::size_t k = 0; k < 400; ++k) table.flip(0, k);
  const std::vector tables(20, table);
  std::vector<coding::InputPair> pairs;
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t j = 0; j < 5; ++j) {
      if (i != j) pairs.push_back({i, j});
    }
  }
  const coding::SelectiveDesensitization code(tables, tables, pairs);
  for (const Measured& at :
       {Measured{50, .029, .0002, .091, .0065}, Measured{200, .066, .0007, .097, .022},
        Measured{1000, .301, .0047, .091, .104}, Measured{3000, 1.50, .022, .095, .295},
        Measured{10000, 15.1, .24, .103, 1.02}}) {
    for (const std::size_t n_epochs : {1U, 3U, 10U, 30U, 100U}) {
      const auto epochs = static_cast<double>(n_epochs);
      const double dual = at.dual_once + epochs * at.dual_epoch;
      const double block = at.block_once + epochs * at.block_epoch;
      if (std::max(dual, block) < 1.3 * std::min(dual, block)) continue;
      EXPECT_EQ(estimators::choose_form(TrainingForm::automatic, 280, code, at.n_samples,
                                        kAnyMemory, n_epochs),
                dual < block ? TrainingForm::dual : TrainingForm::block)
          << at.n_samples << " samples, " << n_epochs << " epochs";
    }
  }
}

TEST(TrainingForm, DependsOnTheSamplesAndTheMemoryLimit) {
  const auto code = demonstration_code();
  const auto chosen = [&](std::size_t n_samples, std::size_t limit) {
    return estimators::choose_form(TrainingForm::automatic, 280, code, n_samples, limit);
  };
  EXPECT_EQ(chosen(2000, 1 << 30), TrainingForm::dual);
  EXPECT_EQ(chosen(2000, 10 << 20), TrainingForm::block);  // less than 2000^2 products of 2 bytes
  EXPECT_EQ(chosen(2000, 1 << 20), TrainingForm::plain);   // less than a block
  // Both forms fit in 2^30 bytes. The estimated time of the dual form grows with the samples, that
  // of the block form does not: they are equal between 6000 and 7000 samples.
  EXPECT_EQ(chosen(6000, 1 << 30), TrainingForm::dual);
  EXPECT_EQ(chosen(7000, 1 << 30), TrainingForm::block);
  EXPECT_EQ(chosen(50000, kAnyMemory), TrainingForm::block);
  EXPECT_THROW(estimators::choose_form(TrainingForm::dual, 280, code, 2000, 10 << 20),
               std::length_error);
}

}  // namespace
