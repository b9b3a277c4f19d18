#include "sdnn/estimators/dual_training.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "estimators/problems.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace sdnn {
namespace {

TEST(DualTraining, HasTheBitsOfPlainTraining) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    testing::compare_with_plain(testing::random_problem(seed), estimators::TrainingForm::dual,
                                1 + static_cast<int>(seed % 3),
                                [&](bool same) { ASSERT_TRUE(same) << "problem " << seed; });
  }
}

TEST(DualTraining, HasThemOnEveryInstructionSet) {
  const std::string before(core::name_of(core::instruction_set()));
  for (const auto level : {core::InstructionSet::portable, core::InstructionSet::avx2,
                           core::InstructionSet::avx512}) {
    if (level > core::best_instruction_set()) continue;
    core::set_instruction_set(core::name_of(level));
    for (std::uint64_t seed = 200; seed < 220; ++seed) {
      testing::compare_with_plain(
          testing::random_problem(seed), estimators::TrainingForm::dual, 1, [&](bool same) {
            ASSERT_TRUE(same) << core::name_of(level) << ", problem " << seed;
          });
    }
  }
  core::set_instruction_set(before);
}

TEST(DualTraining, HasThemInDataOrder) {  // where corrections wait for each other
  for (std::uint64_t seed = 300; seed < 340; ++seed) {
    auto problem = testing::random_problem(seed);
    const std::size_t n_samples = problem.bins.size() / problem.code->n_inputs();
    for (auto& order : problem.orders) {
      order.clear();
      for (std::size_t t = 0; t < 20 * n_samples; ++t) {
        order.push_back(static_cast<std::int32_t>(t % n_samples));
      }
    }
    testing::compare_with_plain(problem, estimators::TrainingForm::dual,
                                1 + static_cast<int>(seed % 3),
                                [&](bool same) { ASSERT_TRUE(same) << "problem " << seed; });
  }
}

TEST(DualTraining, AgreesOverManyPresentationsOfFewSamples) {
  auto problem = testing::random_problem(3);
  const auto one = testing::layer_for(problem);
  const auto other = testing::layer_for(problem);
  auto plain = testing::trainer_for(problem, one, estimators::TrainingForm::plain);
  auto dual = testing::trainer_for(problem, other, estimators::TrainingForm::dual);
  const std::size_t n_samples = problem.bins.size() / problem.code->n_inputs();
  std::vector<std::int32_t> order(20000);
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = static_cast<std::int32_t>(i % std::min<std::size_t>(n_samples, 3));
  }
  for (int epoch = 0; epoch < 2; ++epoch) {
    EXPECT_EQ(plain.present(order).n_units, dual.present(order).n_units);
  }
  dual.synchronize();
  EXPECT_EQ(testing::bits_of(*one), testing::bits_of(*other));
}

TEST(DualTraining, KeepsProductsIn32BitsOfLongCodes) {
  // 2 * 20,000 columns may all be active: a product can exceed 16 bits.
  std::vector<coding::PatternTable> tables;
  coding::PatternTable all_on(2, 20000);
  for (std::size_t bin = 0; bin < 2; ++bin) {
    for (std::size_t k = 0; k < 20000; ++k) all_on.flip(bin, k);
  }
  tables = {all_on, all_on};
  auto problem = testing::random_problem(4);
  problem.code = std::make_shared<coding::SelectiveDesensitization>(
      tables, tables, std::vector<coding::InputPair>{{0, 1}, {1, 0}});
  ASSERT_EQ(estimators::product_bytes(*problem.code), 4U);
  problem.bins = {0, 0, 0, 1, 1, 1};
  problem.n_units = 5;
  problem.n_groups = 1;
  problem.targets = {0.0, 5.0, 2.0};
  problem.orders.assign(4, {0, 1, 2, 1, 0});
  testing::compare_with_plain(problem, estimators::TrainingForm::dual, 1,
                              [](bool same) { ASSERT_TRUE(same); });
}

}  // namespace
}  // namespace sdnn
