#include "sdnn/estimators/detail/dual_training.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "estimators/problems.hpp"

namespace sdnn {
namespace {

TEST(DualTraining, HasTheBitsOfPlainTraining) {
  testing::expect_bits_of_plain_training_on_random_problems(estimators::TrainingForm::dual);
}

// In the order of the data, corrections depend on each other.
TEST(DualTraining, HasTheBitsOfPlainTrainingInDataOrder) {
  for (std::uint64_t seed = 300; seed < 340; ++seed) {
    for (const bool at_once : {false, true}) {
      SCOPED_TRACE(seed);
      const auto problem =
          testing::in_data_order(testing::random_problem(seed), /*n_rounds=*/20, at_once);
      testing::expect_bits_of_plain_training(problem, estimators::TrainingForm::dual,
                                             /*n_threads=*/1 + static_cast<int>(seed % 3));
    }
  }
}

TEST(DualTraining, HasTheBitsOfPlainTrainingOverManyWindows) {
  constexpr std::size_t kManyWindows = 1500;  // samples, of up to 128 in a window
  const auto problem = testing::with_samples(testing::random_problem(11), kManyWindows, 11);
  testing::expect_bits_of_plain_training(testing::in_data_order(problem, /*n_rounds=*/4),
                                         estimators::TrainingForm::dual, /*n_threads=*/2);
}

TEST(DualTraining, HasTheBitsOfPlainTrainingWithCoefficientsNearOverflow) {
  // Two samples have one code but opposite targets, so one coefficient only rises and one only
  // falls. Each is presented 35,000 times in each order; coefficients have 16 bits, up to 32,767.
  auto problem = testing::random_problem(3);
  const std::size_t n_inputs = problem.code->n_inputs();
  problem.bins.assign(2 * n_inputs, 0);
  problem.n_groups = 1;
  problem.targets = {0.0, static_cast<double>(problem.n_units)};
  problem.orders.assign(2, std::vector<std::int32_t>(70000));
  for (auto& order : problem.orders) {
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::int32_t>(i % 2);
  }
  testing::expect_bits_of_plain_training(problem, estimators::TrainingForm::dual, /*n_threads=*/1);
}

TEST(DualTraining, HasTheBitsOfPlainTrainingWithProductsBeyond16Bits) {
  // Two pairs of inputs have 20,000 columns each, all active: inner products of codes are 40,000.
  constexpr std::size_t kColumns = 20000;
  coding::PatternTable all_on(2, kColumns);
  for (std::size_t bin = 0; bin < 2; ++bin) {
    for (std::size_t k = 0; k < kColumns; ++k) all_on.flip(bin, k);
  }
  const std::vector tables{all_on, all_on};
  auto problem = testing::random_problem(4);
  problem.code = std::make_shared<coding::SelectiveDesensitization>(
      tables, tables, std::vector<coding::InputPair>{{0, 1}, {1, 0}});
  ASSERT_GT(problem.code->max_active(), 32767U);
  problem.bins = {0, 0, 0, 1, 1, 1};
  problem.n_units = 5;
  problem.n_groups = 1;
  problem.targets = {0.0, 5.0, 2.0};
  problem.orders.assign(4, {0, 1, 2, 1, 0});
  testing::expect_bits_of_plain_training(problem, estimators::TrainingForm::dual, /*n_threads=*/1);
}

}  // namespace
}  // namespace sdnn
