#include "sdnn/estimators/detail/plain_training.hpp"

#include <gtest/gtest.h>

#include "estimators/problems.hpp"

namespace sdnn {
namespace {

TEST(PlainTraining, ACorrectionIsAsWorkedByHand) {
  // x_SD is +1 -1. The potentials w x_SD - h are -3 and -1, so no unit fires, but one should: unit
  // 1, the nearer, is corrected by x_SD and -1. Its potential is then 1 + 1 + 1 - 1 = 2.
  const std::vector<std::int8_t> signs{1, -1}, on{1, 1};
  auto code = std::make_shared<const coding::SelectiveDesensitization>(
      std::vector{coding::PatternTable::from_signs(signs, 1, 2)},
      std::vector{coding::PatternTable::from_signs(on, 1, 2)},
      std::vector<coding::InputPair>{{0, 0}});
  const std::vector<std::int32_t> weights{-3, 0, 0, 0}, thresholds{0, 1};
  auto layer = std::make_shared<estimators::ParallelPerceptron>(code, 2, weights, thresholds);
  const std::vector<std::int32_t> bins{0};
  estimators::PlainTraining training(layer, bins, 1);
  estimators::PDeltaRule rule(2, std::vector<double>{1.0}, 1);
  const auto count = training.present(bins, rule);
  EXPECT_EQ(count.n_samples, 1U);
  EXPECT_EQ(count.n_units, 1U);
  EXPECT_EQ(testing::parameters_of(*layer),
            (std::vector<std::int32_t>{0, 0, -3, 0, 1, -1}));  // thresholds, weights
  EXPECT_EQ(training.present(bins, rule).n_samples, 0U);       // learned
}

}  // namespace
}  // namespace sdnn
