#include "sdnn/estimators/trainer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "estimators/problems.hpp"

namespace sdnn {
namespace {

using estimators::TrainingForm;

TEST(Trainer, CorrectionsStopBeforeAPotentialOverflows) {
  auto problem = testing::random_problem(2);
  std::fill(problem.targets.begin(), problem.targets.end(), 0.0);  // a silent unit stays as it is
  const std::size_t n_columns = problem.code->n_columns();
  std::vector<std::int32_t> weights(problem.n_units * n_columns);
  std::vector<std::int32_t> thresholds(problem.n_units);
  // The most by which a correction moves a potential: 1 for each active column and the threshold.
  const auto reach = static_cast<std::int32_t>(problem.code->max_active()) + 1;
  for (const auto form : {TrainingForm::plain, TrainingForm::dual, TrainingForm::block}) {
    thresholds[0] = INT32_MAX - reach + 1;  // no room for a single correction
    auto layer = std::make_shared<estimators::ParallelPerceptron>(problem.code, problem.n_units,
                                                                  weights, thresholds);
    EXPECT_THROW(testing::trainer_for(problem, layer, form), std::overflow_error);
    // With room for three, the trainer computes the room anew after every three presentations. Unit
    // 0 is silent and never corrected, so that there is always room for three more.
    thresholds[0] = INT32_MAX - 3 * reach;
    layer = std::make_shared<estimators::ParallelPerceptron>(problem.code, problem.n_units, weights,
                                                             thresholds);
    auto trainer = testing::trainer_for(problem, layer, form);
    for (const auto& order : problem.orders) trainer.present(order);
    trainer.synchronize();
    EXPECT_LE(layer->check_norms(), INT32_MAX);  // a bound of all potentials
  }
}

TEST(Trainer, RefusesBadArgumentsAndDoesNotChangeTheLayer) {
  const auto problem = testing::random_problem(1);
  const auto layer = testing::layer_for(problem);
  const auto before = testing::parameters_of(*layer);
  auto trainer = testing::trainer_for(problem, layer, TrainingForm::automatic);
  EXPECT_NE(trainer.form(), TrainingForm::automatic);
  EXPECT_THROW(trainer.present(std::vector<std::int32_t>{0, -1}), std::invalid_argument);
  // Random problems have 150 samples at most.
  EXPECT_THROW(trainer.present(std::vector<std::int32_t>{0, 1000}), std::invalid_argument);
  EXPECT_EQ(trainer.present({}).n_samples, 0U);
  trainer.synchronize();
  EXPECT_EQ(testing::parameters_of(*layer), before);
  EXPECT_THROW(testing::trainer_for(problem, layer, TrainingForm::plain, /*n_threads=*/0),
               std::invalid_argument);
  auto fewer = problem;
  fewer.targets.resize(fewer.targets.size() - fewer.n_groups);
  EXPECT_THROW(testing::trainer_for(fewer, layer, TrainingForm::plain), std::invalid_argument);
  for (const std::size_t factor : {2U, 100U}) {  // a rule for more units would read beyond them
    auto other = problem;
    other.n_units *= factor;
    EXPECT_THROW(testing::trainer_for(other, layer, TrainingForm::plain), std::invalid_argument);
  }
}

}  // namespace
}  // namespace sdnn
