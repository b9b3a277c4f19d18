#include "sdnn/estimators/parallel_perceptron.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <vector>

#include "estimators/problems.hpp"

namespace sdnn {
namespace {

using estimators::ParallelPerceptron;

/// A code of an input with two bins, +1 +1 -1 and -1 +1 +1, not desensitized.
std::shared_ptr<const ParallelPerceptron::Code> small_code() {
  const std::vector<std::int8_t> signs{1, 1, -1, -1, 1, 1};
  const std::vector<std::int8_t> on(6, 1);
  return std::make_shared<coding::SelectiveDesensitization>(
      std::vector{coding::PatternTable::from_signs(signs, 2, 3)},
      std::vector{coding::PatternTable::from_signs(on, 2, 3)},
      std::vector<coding::InputPair>{{0, 0}});
}

TEST(ParallelPerceptron, PotentialsAndCountsAreAsWorkedByHand) {
  const std::vector<std::int32_t> weights{1, 2, 3, -4, 5, 6};
  const std::vector<std::int32_t> thresholds{1, -2};
  const ParallelPerceptron layer(small_code(), 2, weights, thresholds);
  std::vector<std::int32_t> copied(6);
  layer.copy_weights(copied);
  EXPECT_EQ(copied, weights);
  const std::vector<std::int32_t> bins{0, 1};
  std::vector<std::int32_t> potentials(4);
  layer.potentials(bins, 1, potentials);
  EXPECT_EQ(potentials, (std::vector<std::int32_t>{1 + 2 - 3 - 1, -4 + 5 - 6 + 2,  //
                                                   -1 + 2 + 3 - 1, 4 + 5 + 6 + 2}));
  std::vector<std::int32_t> counts(2);  // units with a positive potential: -1, -3; then 3, 17
  layer.counts(bins, /*n_groups=*/1, /*n_threads=*/1, counts);
  EXPECT_EQ(counts, (std::vector<std::int32_t>{0, 2}));
  counts.resize(4);
  layer.counts(bins, /*n_groups=*/2, /*n_threads=*/1, counts);
  EXPECT_EQ(counts, (std::vector<std::int32_t>{0, 0, 1, 1}));
}

/// Random tables of `n_units` units for three inputs: input 1 alone, inputs 0 and 1 paired both
/// ways, and input 2 modified by input 0.
std::shared_ptr<const ParallelPerceptron::Code> code_of_three(std::size_t n_units) {
  core::Random random(n_units, core::Stream::code_books);
  constexpr std::size_t kBins = 40;
  const auto table = [&] {
    std::vector<std::int8_t> signs(kBins * n_units);
    for (auto& sign : signs) sign = random.below(2) == 0 ? 1 : -1;
    return coding::PatternTable::from_signs(signs, kBins, n_units);
  };
  const std::vector<coding::InputPair> pairs{{0, 1}, {1, 1}, {2, 0}, {1, 0}};
  std::vector<coding::PatternTable> modified, modifiers;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    modified.push_back(table());
    modifiers.push_back(table());
  }
  return std::make_shared<coding::SelectiveDesensitization>(modified, modifiers, pairs);
}

// Many queries are answered together, by sums over pairs of inputs or by a walk through the
// queries, and with copies of the weights in 16 bits where that is enough; a single query adds its
// weights.
TEST(ParallelPerceptron, BlocksOfQueriesHaveThePotentialsOfSingleOnes) {
  constexpr std::size_t kQueries = 2500, kUnits = 100;
  for (const std::size_t n_units : {42U, 130U}) {
    for (const int range : {3, 400, 100000}) {  // of weights: sums of 16 bits, and of 32
      const ParallelPerceptron layer(code_of_three(n_units), kUnits, 5, range);
      core::Random random(7, core::Stream::exploration);
      std::vector<std::int32_t> bins(3 * kQueries);
      for (auto& bin : bins) bin = static_cast<std::int32_t>(random.below(40));
      std::vector<std::int32_t> together(kQueries * kUnits);
      const int n_threads = 1 + range % 2;
      layer.potentials(bins, n_threads, together);
      std::vector<std::int32_t> alone(kUnits);
      for (std::size_t q = 0; q < kQueries; q += 7) {
        layer.potentials(std::span(bins).subspan(3 * q, 3), 1, alone);
        ASSERT_TRUE(std::equal(alone.begin(), alone.end(),
                               together.begin() + static_cast<std::ptrdiff_t>(kUnits * q)))
            << n_units << ' ' << range << ' ' << q;
      }
    }
  }
}

TEST(ParallelPerceptron, CountsOfSeveralLayersEqualThoseOfEachLayer) {
  const auto code = code_of_three(130);
  const ParallelPerceptron narrow(code, 100, 5, /*initial_range=*/3);
  const ParallelPerceptron wide(code, 100, 6, /*initial_range=*/100000);
  const ParallelPerceptron* const layers[] = {&narrow, &wide, &narrow};
  core::Random random(8, core::Stream::exploration);
  for (const std::size_t n_queries : {0U, 5U, 700U}) {
    std::vector<std::int32_t> bins(3 * n_queries);
    for (auto& bin : bins) bin = static_cast<std::int32_t>(random.below(40));
    std::vector<std::int32_t> together(3 * n_queries * 4);  // of 3 layers with 4 groups of units
    ParallelPerceptron::counts(layers, bins, /*n_groups=*/4, /*n_threads=*/2, together);
    std::vector<std::int32_t> expected;
    for (const ParallelPerceptron* const layer : layers) {
      std::vector<std::int32_t> alone(n_queries * 4);
      layer->counts(bins, 4, 1, alone);
      expected.insert(expected.end(), alone.begin(), alone.end());
    }
    EXPECT_EQ(together, expected);
  }
  const ParallelPerceptron other(code_of_three(130), 100, 5, 3);
  const ParallelPerceptron* const unlike[] = {&narrow, &other};
  std::vector<std::int32_t> out;
  EXPECT_THROW(ParallelPerceptron::counts(unlike, {}, 1, 1, out), std::invalid_argument);
  EXPECT_THROW(ParallelPerceptron::counts({}, {}, 1, 1, out), std::invalid_argument);
}

TEST(ParallelPerceptron, RethrowsTheErrorOfAThread) {
  const std::vector<std::int32_t> weights(6);
  const ParallelPerceptron layer(small_code(), 2, weights, std::vector<std::int32_t>(2));
  const std::vector<std::int32_t> bins(2000);  // of 2000 queries
  for (const std::size_t query : {0U, 999U, 1999U}) {
    const auto consume = [&](std::size_t q, const std::int32_t*) {
      if (q == query) throw std::bad_alloc();
    };
    EXPECT_THROW(layer.for_each_query(bins, /*n_threads=*/3, consume), std::bad_alloc) << query;
  }
}

TEST(ParallelPerceptron, DrawsEveryWeightInItsRange) {
  const ParallelPerceptron layer(small_code(), /*n_units=*/400, /*seed=*/3, /*initial_range=*/2);
  std::vector<int> counts(5);  // of weights -2 to 2
  for (std::size_t i = 0; i < 400; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      ++counts.at(static_cast<std::size_t>(layer.weight(i, j) + 2));
    }
  }
  for (const int n : counts) EXPECT_GT(n, 150);  // of 1200 weights; 240 on average
}

TEST(ParallelPerceptron, RefusesWeightsThatCouldOverflow) {
  const std::vector<std::int32_t> weights{1 << 30, 1 << 30, 0};  // 2^31 does not fit, 2^31 - 1 does
  EXPECT_THROW(ParallelPerceptron(small_code(), 1, weights, std::vector<std::int32_t>{0}),
               std::overflow_error);
  const std::vector<std::int32_t> fits{1 << 30, (1 << 30) - 1, 0};
  const ParallelPerceptron layer(small_code(), 1, fits, std::vector<std::int32_t>{0});
  EXPECT_EQ(layer.check_norms(), INT32_MAX);
}

// The code has three columns, of an input with two bins; the layer has two units.
TEST(ParallelPerceptron, RefusesBadArguments) {
  const std::vector<std::int32_t> weights(6), thresholds(2);
  EXPECT_THROW(ParallelPerceptron(small_code(), 0, 1), std::invalid_argument);
  EXPECT_THROW(ParallelPerceptron(small_code(), 2, 1, -1), std::invalid_argument);
  EXPECT_THROW(ParallelPerceptron(small_code(), 3, weights, thresholds), std::invalid_argument);
  EXPECT_THROW(ParallelPerceptron(small_code(), 2, weights, weights), std::invalid_argument);
  const ParallelPerceptron layer(small_code(), 2, weights, thresholds);
  std::vector<std::int32_t> out(2);
  EXPECT_THROW(layer.potentials(std::vector<std::int32_t>{2}, 1, out), std::invalid_argument);
  EXPECT_THROW(layer.potentials(std::vector<std::int32_t>{0}, 0, out), std::invalid_argument);
  EXPECT_THROW(layer.counts(std::vector<std::int32_t>{0}, 3, 1, out), std::invalid_argument);
  EXPECT_THROW(layer.group_size(3), std::invalid_argument);
  const std::vector<std::int32_t> two_queries{0, 0};
  EXPECT_THROW(layer.potentials(two_queries, 1, out), std::invalid_argument);
  EXPECT_THROW(layer.counts(two_queries, 2, 1, out), std::invalid_argument);
  EXPECT_THROW(layer.copy_weights(out), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn
