#include "sdnn/estimators/block_training.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "estimators/problems.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace sdnn {
namespace {

TEST(BlockTraining, HasTheBitsOfPlainTraining) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    testing::compare_with_plain(testing::random_problem(seed), estimators::TrainingForm::block,
                                1 + static_cast<int>(seed % 3),
                                [&](bool same) { ASSERT_TRUE(same) << "problem " << seed; });
  }
}

TEST(BlockTraining, HasThemOnEveryInstructionSet) {
  const std::string before(core::name_of(core::instruction_set()));
  for (const auto level : {core::InstructionSet::portable, core::InstructionSet::avx2,
                           core::InstructionSet::avx512}) {
    if (level > core::best_instruction_set()) continue;
    core::set_instruction_set(core::name_of(level));
    for (std::uint64_t seed = 200; seed < 220; ++seed) {
      testing::compare_with_plain(
          testing::random_problem(seed), estimators::TrainingForm::block, 1, [&](bool same) {
            ASSERT_TRUE(same) << core::name_of(level) << ", problem " << seed;
          });
    }
  }
  core::set_instruction_set(before);
}

TEST(BlockTraining, ChangesToWideWeightsWithoutChangingThem) {
  auto problem = testing::random_problem(5);
  const std::size_t n_columns = problem.code->n_columns();
  for (const std::int32_t start : {7990, 20000}) {  // just below the change, and beyond
    std::vector<std::int32_t> weights(problem.n_units * n_columns);
    for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = i % 2 == 0 ? start : -start;
    const std::vector<std::int32_t> thresholds(problem.n_units);
    const auto layer = [&] {
      return std::make_shared<estimators::PerceptronLayer>(problem.code, problem.n_units, weights,
                                                           thresholds);
    };
    const auto one = layer();
    const auto other = layer();
    auto plain = testing::trainer_for(problem, one, estimators::TrainingForm::plain);
    auto block = testing::trainer_for(problem, other, estimators::TrainingForm::block, 2);
    for (int epoch = 0; epoch < 20; ++epoch) {
      for (const auto& order : problem.orders) {
        ASSERT_EQ(plain.present(order).n_units, block.present(order).n_units);
      }
    }
    block.synchronize();
    EXPECT_EQ(testing::bits_of(*one), testing::bits_of(*other));
  }
}

}  // namespace
}  // namespace sdnn
