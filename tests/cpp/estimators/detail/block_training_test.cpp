#include "sdnn/estimators/detail/block_training.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "estimators/problems.hpp"

namespace sdnn {
namespace {

TEST(BlockTraining, HasTheBitsOfPlainTraining) {
  testing::expect_bits_of_plain_training_on_random_problems(estimators::TrainingForm::block);
}

// From the second epoch in the order of the data on, plans of blocks are kept and reused.
TEST(BlockTraining, HasTheBitsOfPlainTrainingWithKeptPlans) {
  for (std::uint64_t seed = 300; seed < 330; ++seed) {
    auto problem = testing::in_data_order(testing::random_problem(seed), /*n_rounds=*/6);
    if (seed % 2 == 0) problem.orders[3] = {0};  // a single sample between epochs
    SCOPED_TRACE(seed);
    testing::expect_bits_of_plain_training(problem, estimators::TrainingForm::block,
                                           /*n_threads=*/1 + static_cast<int>(seed % 3));
  }
}

TEST(BlockTraining, HasTheBitsOfPlainTrainingOverSeveralBlocks) {
  constexpr std::size_t kSeveralBlocks = 1300;  // samples, of 512 or 256 in a block
  const auto problem = testing::in_data_order(
      testing::with_samples(testing::random_problem(12), kSeveralBlocks, 12), /*n_rounds=*/4);
  // Limits of memory that have room for stored plans of all blocks, and for none.
  constexpr std::size_t kWithPlans = std::size_t{1} << 30, kWithoutPlans = std::size_t{3} << 20;
  for (const std::size_t limit : {kWithPlans, kWithoutPlans}) {
    const auto plain_layer = testing::layer_for(problem);
    const auto block_layer = testing::layer_for(problem);
    const estimators::PDeltaRule rule(problem.n_units, problem.targets, problem.n_groups);
    auto plain = testing::trainer_for(problem, plain_layer, estimators::TrainingForm::plain);
    estimators::PDeltaTrainer block(block_layer, problem.bins, rule,
                                    estimators::TrainingForm::block, limit, /*n_threads=*/2);
    EXPECT_LE(block.memory(), limit);
    for (const auto& order : problem.orders) {
      ASSERT_EQ(plain.present(order).n_units, block.present(order).n_units);
    }
    block.synchronize();
    EXPECT_EQ(testing::parameters_of(*plain_layer), testing::parameters_of(*block_layer));
  }
}

TEST(BlockTraining, HasTheBitsOfPlainTrainingWithWeightsBeyond16Bits) {
  auto problem = testing::random_problem(5);
  const std::size_t n_columns = problem.code->n_columns();
  // Sums of a chunk of 256 weights of 127 just fit into 16 bits (32,512); those of 20,000 do not.
  for (const std::int32_t start : {127, 20000}) {
    std::vector<std::int32_t> weights(problem.n_units * n_columns);
    for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = i % 2 == 0 ? start : -start;
    const std::vector<std::int32_t> thresholds(problem.n_units);
    const auto plain_layer = std::make_shared<estimators::ParallelPerceptron>(
        problem.code, problem.n_units, weights, thresholds);
    const auto block_layer = std::make_shared<estimators::ParallelPerceptron>(*plain_layer);
    auto plain = testing::trainer_for(problem, plain_layer, estimators::TrainingForm::plain);
    auto block = testing::trainer_for(problem, block_layer, estimators::TrainingForm::block, 2);
    for (int epoch = 0; epoch < 20; ++epoch) {
      for (const auto& order : problem.orders) {
        ASSERT_EQ(plain.present(order).n_units, block.present(order).n_units);
      }
    }
    block.synchronize();
    EXPECT_EQ(testing::parameters_of(*plain_layer), testing::parameters_of(*block_layer));
  }
}

}  // namespace
}  // namespace sdnn
