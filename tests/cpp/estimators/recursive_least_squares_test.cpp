#include "sdnn/estimators/recursive_least_squares.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "errors.hpp"
#include "estimators/streams.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn {
namespace {

using estimators::RecursiveLeastSquares;
using testing::kMax;
using testing::kNaN;
using testing::predicted;
using Numbers = std::vector<double>;

RecursiveLeastSquares unit_model(std::size_t n_inputs, double forgetting = 1.0) {
  return {Numbers(n_inputs, -1.0), Numbers(n_inputs, 1.0), 1, forgetting};
}

TEST(RecursiveLeastSquares, IsRidgeRegressionWithoutForgetting) {
  auto model = unit_model(1);
  EXPECT_EQ(predicted(model, {0.5}), 0.0);
  model.learn(Numbers{0.0}, Numbers{2.0});
  model.learn(Numbers{1.0}, Numbers{3.0});
  model.learn(Numbers{-1.0}, Numbers{0.5});
  // The targets minus the first one are 0, 1 and -1.5. With a ridge of 0.1 the normal equations of
  // intercept and slope are (3 + 0.1) w0 = 1 - 1.5 and (2 + 0.1) w1 = 1 * 1 + (-1) * (-1.5).
  EXPECT_NEAR(predicted(model, {0.5}), 2.0 - 0.5 / 3.1 + 0.5 * 2.5 / 2.1, 1e-12);
}

TEST(RecursiveLeastSquares, FollowsAChangeSoonerTheMoreItForgets) {
  auto slow = unit_model(1, 1.0), fast = unit_model(1, 0.9);
  for (int i = 0; i < 200; ++i) {
    const double input = i % 2 == 0 ? 0.5 : -0.5, slope = i < 150 ? 1.0 : -1.0;
    for (auto* model : {&slow, &fast}) model->learn(Numbers{input}, Numbers{slope * input});
  }
  EXPECT_NEAR(predicted(fast, {0.4}), -0.4, 0.01);  // the last 50 slopes outweigh all others
  EXPECT_GT(predicted(slow, {0.4}), 0.1);           // about 0.2: the mean slope is (150 - 50) / 200
}

// Input 0 is in [10, 20]; input 1 is always 5 and does not count.
TEST(RecursiveLeastSquares, MissingInputsAreTheMiddleOfTheirFirstRange) {
  RecursiveLeastSquares model(Numbers{10.0, 5.0}, Numbers{20.0, 5.0}, 1, 0.99);
  for (int i = 0; i < 20; ++i) model.learn(Numbers{10.0 + i % 11, 5.0}, Numbers{3.0 * (i % 11)});
  EXPECT_EQ(predicted(model, {kNaN, 5.0}), predicted(model, {15.0, 7.0}));
  EXPECT_EQ(predicted(model, {12.0, kNaN}), predicted(model, {12.0, 5.0}));
}

// The input's first range is the single value 3. Later the target is 2 less than the input.
TEST(RecursiveLeastSquares, AnInputThatWasConstantCountsOnceItChanges) {
  RecursiveLeastSquares model(Numbers{3.0}, Numbers{3.0}, 1, 1.0);
  for (int i = 0; i < 100; ++i) model.learn(Numbers{3.0}, Numbers{1.0});
  for (int i = 0; i < 100; ++i) model.learn(Numbers{3.0 + i % 2}, Numbers{1.0 + i % 2});
  EXPECT_NEAR(predicted(model, {4.0}), 2.0, 0.05);
  EXPECT_NEAR(predicted(model, {3.0}), 1.0, 0.05);
}

// Later the new output is learned as 4 more than the new input 1.
TEST(RecursiveLeastSquares, AddedInputsAndOutputsChangeNoPrediction) {
  RecursiveLeastSquares model(Numbers{0.0}, Numbers{1.0}, 2, 0.99);
  for (int i = 0; i < 50; ++i) model.learn(Numbers{i / 50.0}, Numbers{i / 25.0, 1.0});
  const double before = predicted(model, {0.3});
  model.add_inputs(Numbers{-4.0, 0.0}, Numbers{4.0, 1.0});
  EXPECT_EQ(predicted(model, {0.3, 2.5, 1.0}), before);
  model.add_outputs(1);
  ASSERT_EQ(model.n_inputs(), 3U);
  Numbers out(3);
  model.predict(Numbers{0.3, 2.5, 1.0}, out);
  EXPECT_EQ(out[0], before);
  EXPECT_EQ(out[2], 0.0);
  for (int i = 0; i < 200; ++i)
    model.learn(Numbers{0.3, i % 9 - 4.0, 1.0}, Numbers{0, 1, i % 9 * 1.0});
  model.predict(Numbers{0.3, 2.0, 1.0}, out);
  EXPECT_NEAR(out[2], 6.0, 0.1);
}

TEST(RecursiveLeastSquares, PredictsAFifthBeyondTheRangeOfTargetsAtMost) {
  auto model = unit_model(1);
  for (int i = 0; i < 100; ++i) model.learn(Numbers{i / 99.0}, Numbers{i / 99.0});
  EXPECT_GT(predicted(model, {1.1}), 1.05);
  EXPECT_NEAR(predicted(model, {2.9}), 1.2, 1e-12);  // targets reached from 0 to 1
}

// Without inputs the prediction is a mean of the targets 1 and -1, and then of 1e9. Errors are
// about 1, so that the limited error of the last target is about 20, of which the mean takes a
// hundredth.
TEST(RecursiveLeastSquares, LimitedErrorsReduceTheEffectOfAnOutlier) {
  RecursiveLeastSquares limited(Numbers{}, Numbers{}, 1, 1.0, /*error_limit=*/20.0),
      unlimited(Numbers{}, Numbers{}, 1, 1.0);
  for (int i = 0; i < 100; ++i) {
    for (auto* model : {&limited, &unlimited}) model->learn(Numbers{}, Numbers{i % 2 ? 1.0 : -1.0});
  }
  for (auto* model : {&limited, &unlimited}) model->learn(Numbers{}, Numbers{1e9});
  EXPECT_LT(std::abs(predicted(limited, {})), 0.5);
  EXPECT_GT(predicted(unlimited, {}), 1e6);  // about a hundredth of 1e9
}

// Indices of different speeds combine the extremes.
TEST(RecursiveLeastSquares, StaysFiniteForAnyNumbers) {
  const Numbers extremes{0.0,    -0.0,  1.0,    -1.0,  1e-310, -5e-324,  1e300,
                         -1e300, -kMax, kMax,   kNaN,  1e-300, 1e154,    -1e154,
                         3.0,    kMax,  -1e308, 1e308, 0.5,    INFINITY, -INFINITY};
  for (const double low : {0.0, -kMax, -1e-310}) {
    for (const double limit : {20.0, RecursiveLeastSquares::kUnlimited}) {
      RecursiveLeastSquares model(Numbers{low, low}, Numbers{1e-310, kMax}, 1, 0.9, limit);
      for (std::size_t i = 0; i < 3000; ++i) {
        const double target = extremes[(i * i / 7) % extremes.size()];
        const Numbers inputs{extremes[i % extremes.size()], extremes[(i / 5) % extremes.size()]};
        ASSERT_TRUE(std::isfinite(predicted(model, inputs))) << i;
        model.learn(inputs, Numbers{std::isfinite(target) ? target : 0.0});
      }
      for (int i = 0; i < 2000; ++i) model.learn(Numbers{0.0, 0.0}, Numbers{1.0});
      ASSERT_TRUE(std::isfinite(predicted(model, {0.0, 0.0})));
    }
  }
}

TEST(RecursiveLeastSquares, RestoresItsStateAndRefusesAnIncompleteOne) {
  RecursiveLeastSquares model(Numbers{0.0, 0.0}, Numbers{1.0, 2.0}, 2, 0.98, 20.0), other = model;
  const auto learn = [](RecursiveLeastSquares& learner, int i) {
    learner.learn(Numbers{i % 7 / 6.0, i % 5 / 2.0}, Numbers{i % 3 * 1.0, i % 4 * 1.0});
  };
  for (int i = 0; i < 60; ++i) learn(model, i);
  core::restore(other, core::state_of(model));
  for (int i = 60; i < 80; ++i) {
    learn(model, i);
    learn(other, i);
  }
  EXPECT_EQ(core::state_of(model), core::state_of(other));
  auto state = core::state_of(model);
  state.erase("weights");
  EXPECT_THROW(core::restore(other, state), std::invalid_argument);
}

TEST(RecursiveLeastSquares, NamesAWrongArgument) {
  const auto error_of = [](const Numbers& low, const Numbers& high, std::size_t n,
                           double forgetting, double limit) {
    return testing::message_of(
        [&] { const RecursiveLeastSquares model(low, high, n, forgetting, limit); });
  };
  EXPECT_EQ(error_of({0.0}, {1.0}, 1, 0.4, 1.0), "forgetting must be in [0.5, 1], got 0.4");
  EXPECT_EQ(error_of({0.0}, {1.0}, 1, 0.9, 0.5), "error_limit must be at least 1, got 0.5");
  EXPECT_EQ(error_of({0.0}, {1.0}, 0, 0.9, 1.0), "n_outputs must be in [1, 1048576], got 0");
  EXPECT_EQ(error_of({2.0}, {1.0}, 1, 0.9, 1.0), "high must be at least low, got 1");
  EXPECT_EQ(error_of({kNaN}, {1.0}, 1, 0.9, 1.0), "low must be finite, got nan");
  EXPECT_EQ(error_of({0.0}, {}, 1, 0.9, 1.0), "high must be 1 values, got 0");
  auto model = unit_model(2);
  model.add_outputs(1);
  Numbers out(2);
  EXPECT_THROW(model.predict(Numbers{1.0}, out), std::invalid_argument);
  EXPECT_THROW(model.learn(Numbers{1.0, 1.0}, Numbers{1.0, kNaN}), std::invalid_argument);
  EXPECT_THROW(model.learn(Numbers{1.0, 1.0}, Numbers{}), std::invalid_argument);
  EXPECT_THROW(model.add_outputs(SIZE_MAX), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn
