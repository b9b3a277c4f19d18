#include "sdnn/estimators/kernel_window.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "errors.hpp"
#include "estimators/streams.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn {
namespace {

using estimators::KernelWindow;
using testing::kMax;
using testing::kNaN;
using testing::predicted;
using Numbers = std::vector<double>;

/// A window of `capacity` samples of one input in [0, 1] and one output.
KernelWindow window_of(std::size_t capacity) {
  return {Numbers{0.0}, Numbers{1.0}, 1, capacity, /*length_scale=*/1.0, /*ridge=*/0.1};
}

/// Inputs between 0 and 1, spread evenly by the golden ratio, that repeat only after 500.
double input_of(int i) { return std::fmod(0.618 * i, 1.0); }

TEST(KernelWindow, IsKernelRidgeRegression) {
  // The kernel is exp(-|difference of inputs| / length scale). The range of the input is 2, so a
  // length scale of 0.5 ranges is 1. The ridge of 0.25 makes the diagonal of the matrix 1.25.
  KernelWindow window(Numbers{0.0}, Numbers{2.0}, 1, 10, 0.5, 0.25);
  EXPECT_EQ(predicted(window, {1.0}), 0.0);
  window.learn(Numbers{0.0}, Numbers{3.0});
  EXPECT_NEAR(predicted(window, {1.0}), std::exp(-1.0) * 3.0 / 1.25, 1e-15);
  window.learn(Numbers{2.0}, Numbers{-1.0});
  // The matrix (1.25, k; k, 1.25) with the kernel k of the two samples, two length scales apart.
  const double k = std::exp(-2.0), determinant = 1.25 * 1.25 - k * k;
  const double first = (1.25 * 3.0 + k) / determinant, second = (-1.25 - 3.0 * k) / determinant;
  EXPECT_NEAR(predicted(window, {1.0}), std::exp(-1.0) * (first + second), 1e-15);
  EXPECT_NEAR(predicted(window, {0.0}), first + k * second, 1e-15);
}

TEST(KernelWindow, ForgetsAllButTheLastSamples) {
  KernelWindow window = window_of(20), fresh = window;
  for (int i = 0; i < 5000; ++i) {
    const Numbers input{input_of(i)}, target{std::sin(i)};
    window.learn(input, target);
    if (i >= 4980) fresh.learn(input, target);
  }
  ASSERT_EQ(window.n_samples(), 20U);
  for (const double x : {0.0, 0.3, 1.7}) {
    EXPECT_NEAR(predicted(window, {x}), predicted(fresh, {x}), 1e-12);
  }
}

// Input 0 is in [0, 2], input 1 is always 3.
TEST(KernelWindow, MissingInputsAreTheMiddleAndConstantOnesDoNotCount) {
  KernelWindow window(Numbers{0.0, 3.0}, Numbers{2.0, 3.0}, 1, 20, 1.0, 0.1);
  for (int i = 0; i < 30; ++i) window.learn(Numbers{2.0 * input_of(i), 3.0}, Numbers{input_of(i)});
  EXPECT_EQ(predicted(window, {kNaN, 3.0}), predicted(window, {1.0, 8.0}));
}

// At last output 0 is 0, and the added output 1 equals the added input 1.
TEST(KernelWindow, AddedInputsAndOutputsAreLearned) {
  KernelWindow window = window_of(20);
  for (int i = 0; i < 30; ++i) window.learn(Numbers{input_of(i)}, Numbers{input_of(i)});
  window.add_outputs(1);
  Numbers out(2);
  window.predict(Numbers{0.5}, out);
  EXPECT_EQ(out[1], 0.0);
  window.add_inputs(Numbers{0.0}, Numbers{1.0});
  for (int i = 0; i < 60; ++i) {
    window.learn(Numbers{0.5, input_of(i)}, Numbers{0.0, input_of(i)});
  }
  window.predict(Numbers{0.5, 0.75}, out);
  EXPECT_NEAR(out[1], 0.75, 0.1);
  EXPECT_NEAR(out[0], 0.0, 1e-12);
}

// Targets larger than 20 times their mean size, here 1, are clipped. Unlimited, the outlier of 1e9
// would raise the prediction at its input to 2.6e8.
TEST(KernelWindow, LimitedTargetsReduceTheEffectOfAnOutlier) {
  KernelWindow window(Numbers{0.0}, Numbers{1.0}, 1, 50, 1.0, 0.1, /*target_limit=*/20.0);
  for (int i = 0; i < 40; ++i) window.learn(Numbers{input_of(i)}, Numbers{i % 2 ? 1.0 : -1.0});
  window.learn(Numbers{0.5}, Numbers{1e9});
  EXPECT_LT(std::abs(predicted(window, {0.5})), 20.0);
}

// Indices of different speeds combine the extremes.
TEST(KernelWindow, StaysFiniteForAnyNumbers) {
  const Numbers extremes{0.0,    1.0,  -1.0,  1e-310, -5e-324,  1e300,
                         -1e300, kMax, -kMax, kNaN,   INFINITY, -INFINITY};
  KernelWindow window(Numbers{-kMax, 0.0}, Numbers{kMax, 1e-310}, 1, 15, 1.0, 0.001);
  for (std::size_t i = 0; i < 3000; ++i) {
    const Numbers inputs{extremes[i % 12], extremes[(i / 5) % 12]};
    ASSERT_TRUE(std::isfinite(predicted(window, inputs))) << i;
    const double target = extremes[(i * i / 7) % 12];
    window.learn(inputs, Numbers{std::isfinite(target) ? target : 0.0});
  }
  // The window holds 15 samples, so that it forgets the extremes.
  for (int i = 0; i < 20; ++i) window.learn(Numbers{0.0, 0.0}, Numbers{1.0});
  EXPECT_NEAR(predicted(window, {0.0, 0.0}), 1.0, 0.01);
}

TEST(KernelWindow, RestoresItsStateAndRefusesAnIncompleteOne) {
  KernelWindow window = window_of(10), other = window;
  for (int i = 0; i < 25; ++i) window.learn(Numbers{input_of(i)}, Numbers{std::cos(i)});
  core::restore(other, core::state_of(window));
  for (int i = 25; i < 40; ++i) {
    window.learn(Numbers{input_of(i)}, Numbers{std::cos(i)});
    other.learn(Numbers{input_of(i)}, Numbers{std::cos(i)});
  }
  EXPECT_EQ(core::state_of(window), core::state_of(other));
  auto state = core::state_of(window);
  state.erase("inverse");
  EXPECT_THROW(core::restore(other, state), std::invalid_argument);
}

TEST(KernelWindow, NamesAWrongArgument) {
  const auto error_of = [](double low, std::size_t capacity, double scale, double ridge,
                           double limit) {
    return testing::message_of([&] {
      const KernelWindow window(Numbers{low}, Numbers{1.0}, 1, capacity, scale, ridge, limit);
    });
  };
  EXPECT_EQ(error_of(0.0, 1, 1.0, 0.1, 1.0), "capacity must be in [2, 4096], got 1");
  EXPECT_EQ(error_of(0.0, 5, 0.0, 0.1, 1.0), "length_scale must be in [0.001, 1000], got 0");
  EXPECT_EQ(error_of(0.0, 5, 1.0, 0.0, 1.0), "ridge must be in [0.001, 1000], got 0");
  EXPECT_EQ(error_of(0.0, 5, 1.0, 0.1, 0.0), "target_limit must be at least 1, got 0");
  EXPECT_EQ(error_of(2.0, 5, 1.0, 0.1, 1.0), "high must be at least low, got 1");
  KernelWindow window = window_of(5);
  EXPECT_THROW(window.learn(Numbers{1.0}, Numbers{kNaN}), std::invalid_argument);
  EXPECT_THROW(window.learn(Numbers{}, Numbers{1.0}), std::invalid_argument);
  EXPECT_THROW(predicted(window, {1.0, 2.0}), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn
