#include "sdnn/approximators/detail/linear_rows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

struct Rows {
  std::vector<std::int32_t> weights, traces;
  std::vector<std::int8_t> signs;
};

/// Rows of random weights of 24 bits, traces in their range, and signs of which half are 0.
Rows random_rows(std::size_t n, std::uint64_t seed) {
  core::Random random(seed, core::Stream::weights);
  Rows rows;
  for (std::size_t j = 0; j < n; ++j) {
    rows.weights.push_back(static_cast<std::int32_t>(random.below((1 << 24) - 1)) - (1 << 23) + 1);
    rows.traces.push_back(static_cast<std::int32_t>(random.below(2 * kLargestTrace + 1)) -
                          kLargestTrace);
    const bool is_active = random.below(2) == 1;
    rows.signs.push_back(!is_active ? 0 : random.below(2) == 1 ? -1 : 1);
  }
  return rows;
}

// Weights have 24 bits: up to 2^23 - 1.
TEST(LinearRows, SumsOfRandomAndOfTheLargestWeightsAreExactOnEveryInstructionSet) {
  for (const std::size_t n : {64U, 192U, 256U, 320U, 1024U}) {
    Rows rows = random_rows(n, n);
    std::int64_t expected = 0;
    for (std::size_t j = 0; j < n; ++j) {
      if (rows.signs[j] != 0) expected += rows.signs[j] < 0 ? -rows.weights[j] : rows.weights[j];
    }
    const std::vector<std::int32_t> largest(n, (1 << 23) - 1);
    const std::vector<std::int8_t> ones(n, 1);
    testing::on_every_instruction_set([&](auto) {
      EXPECT_EQ(row_sum(rows.weights.data(), rows.signs.data(), n), expected);
      EXPECT_EQ(row_sum(largest.data(), ones.data(), n),
                static_cast<std::int64_t>(n) * ((1 << 23) - 1));
    });
  }
}

TEST(LinearRows, SignsAreThoseOfTheActiveColumns) {
  // Slots 0, 1 and 3 and all of the second word are active; a positive bit alone has no effect.
  const std::uint64_t active[] = {0b1011, ~std::uint64_t{0}};
  const std::uint64_t positive[] = {0b0110, std::uint64_t{1} << 63};
  std::vector<std::int8_t> expected(128, -1);
  std::fill_n(expected.begin() + 4, 60, 0);
  expected[1] = 1;
  expected[2] = 0;
  expected[127] = 1;
  testing::on_every_instruction_set([&](auto) {
    std::vector<std::int8_t> signs(128, 5);  // all to be overwritten
    spread_signs(active, positive, 2, signs.data());
    EXPECT_EQ(signs, expected);
  });
}

TEST(LinearRows, SumsOfManyRowsEqualThoseOfSingleRows) {
  const Rows code = random_rows(320, 1);
  std::vector<Rows> rows;
  std::vector<const std::int32_t*> pointers;
  std::vector<std::int64_t> expected;
  for (std::uint64_t i = 0; i < 11; ++i) {
    rows.push_back(random_rows(320, i + 2));
    pointers.push_back(rows.back().weights.data());
    expected.push_back(row_sum(pointers.back(), code.signs.data(), 320));
  }
  testing::on_every_instruction_set([&](auto) {
    for (std::size_t n = 0; n <= pointers.size(); ++n) {
      std::vector<std::int64_t> sums(n);
      row_sums(pointers.data(), n, code.signs.data(), 320, sums.data());
      EXPECT_TRUE(std::equal(sums.begin(), sums.end(), expected.begin()));
    }
  });
}

TEST(LinearRows, AStepOfTracesAndWeightsIsAsWorkedByHand) {
  // Traces are halved towards 0 and increased by the code +1, -1, 0, where 4096 is kTraceOne:
  // 1 + 4096, -1 - 4096, 2048 + 0.
  std::vector<std::int32_t> weights{100, 100, 100}, traces{3, -3, 4096};
  const std::vector<std::int8_t> signs{1, -1, 0};
  const RowStep step{.decay = kDecayOne / 2,
                     .gain = kTraceOne,
                     .replace = 0,
                     .step = 5,
                     .shift = 12,
                     .correction = 2};
  const RowUse use = learn_row(weights.data(), traces.data(), signs.data(), 3, step);
  EXPECT_EQ(traces, (std::vector<std::int32_t>{4097, -4097, 2048}));
  // The step of 5 is shifted by 12 bits, a division by 4096; the correction of 2 is subtracted:
  // 100 + round(5 * 4097 / 4096) - 2; 100 + round(-5.001) + 2; 100 + round(2.5), halves up.
  EXPECT_EQ(weights, (std::vector<std::int32_t>{103, 97, 103}));
  EXPECT_EQ(use.weights, 103 | 97);  // the bits that any weight uses
  EXPECT_NE(use.traces, 0);
}

// The factor of the trace and the code's part are 1; `replace` is a mask of ones.
TEST(LinearRows, AReplacingTraceIsOverwrittenWhereTheCodeIsActive) {
  std::vector<std::int32_t> weights{0, 0}, traces{9000, 9000};
  const std::vector<std::int8_t> signs{-1, 0};
  learn_row(weights.data(), traces.data(), signs.data(), 2,
            {.decay = kDecayOne,
             .gain = kTraceOne,
             .replace = -1,
             .step = 0,
             .shift = 1,
             .correction = 0});
  EXPECT_EQ(traces, (std::vector<std::int32_t>{-kTraceOne, 9000}));
}

// Weights, traces and signs of the code are random; the correction is 0 or 3.
TEST(LinearRows, ACorrectionIsSubtractedTimesTheCodeOnEveryInstructionSet) {
  const Rows rows = random_rows(320, 3);
  RowStep step{.decay = 7000, .gain = 900, .replace = -1, .step = -77, .shift = 9, .correction = 0};
  testing::on_every_instruction_set([&](auto) {
    Rows uncorrected = rows, corrected = rows;
    const RowUse use = detail::learn_row_portable(
        uncorrected.weights.data(), uncorrected.traces.data(), rows.signs.data(), 320, step);
    step.correction = 3;
    learn_row(corrected.weights.data(), corrected.traces.data(), rows.signs.data(), 320, step);
    step.correction = 0;
    EXPECT_NE(use.traces, 0);
    EXPECT_EQ(uncorrected.traces, corrected.traces);
    for (std::size_t j = 0; j < 320; ++j) {
      EXPECT_EQ(corrected.weights[j], uncorrected.weights[j] - 3 * rows.signs[j]);
    }
    Rows dispatched = rows;
    learn_row(dispatched.weights.data(), dispatched.traces.data(), rows.signs.data(), 320, step);
    EXPECT_EQ(dispatched.weights, uncorrected.weights);
  });
}

// Traces decay by nine tenths, towards 0; rounded to the nearest, 4 * 0.9 would remain 4 for ever.
TEST(LinearRows, TracesDecayToZeroAndStayWithinTheirLimit) {
  std::vector<std::int32_t> weights{0, 0}, traces{kLargestTrace, -kLargestTrace};
  const std::vector<std::int8_t> signs{1, -1};
  RowStep step{
      .decay = kDecayOne, .gain = kTraceOne, .replace = 0, .step = 0, .shift = 1, .correction = 0};
  learn_row(weights.data(), traces.data(), signs.data(), 2, step);  // would increase the traces
  EXPECT_EQ(traces, (std::vector<std::int32_t>{kLargestTrace, -kLargestTrace}));
  step.gain = 0;
  step.decay = kDecayOne * 9 / 10;
  int n = 0;
  while (learn_row(weights.data(), traces.data(), signs.data(), 2, step).traces != 0)
    ASSERT_LT(++n, 1000);
  EXPECT_EQ(traces, (std::vector<std::int32_t>{0, 0}));
}

}  // namespace
}  // namespace sdnn::approximators
