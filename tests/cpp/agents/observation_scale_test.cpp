#include "sdnn/agents/observation_scale.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "errors.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using Numbers = std::vector<double>;

// Ranges of a pendulum: cosine and sine of an angle, a speed, and a circular variable.
ObservationScale scale_of_angles() {
  return {{-1.0, -1.0, -8.0, 10.0},
          {1.0, 1.0, 8.0, 14.0},
          {{ObservedKind::angle, 0, 1},
           {ObservedKind::variable, 2, 0},
           {ObservedKind::circular, 3, 0}}};
}

// A number between a Discrete(2) and a Discrete(3), as Gymnasium flattens them.
ObservationScale scale_of_symbols() {
  return {
      {0.0, 0.0, -1.0, 0.0, 0.0, 0.0},
      {1.0, 1.0, 1.0, 1.0, 1.0, 1.0},
      {{ObservedKind::symbol, 0, 2}, {ObservedKind::variable, 2, 0}, {ObservedKind::symbol, 3, 3}}};
}

Numbers scaled(const ObservationScale& scale, const Numbers& observed) {
  Numbers state(scale.n_inputs());
  scale(observed, state);
  return state;
}

TEST(ObservationScale, ScalesNumbersAndAnglesAsWorkedByHand) {
  const ObservationScale scale = scale_of_angles();
  EXPECT_EQ(scale.n_observed(), 4U);
  EXPECT_EQ(scale.n_inputs(), 3U);
  // Variables are cosine and sine of an angle (0, 90, -90 and 180 degrees), a speed, clipped to
  // [-8, 8], and a circular variable from 10 to 14, where 15 is 11, 9 is 13 and 14 is 10.
  EXPECT_EQ(scaled(scale, {1.0, 0.0, 4.0, 11.0}), (Numbers{0.5, 0.75, 0.25}));
  EXPECT_EQ(scaled(scale, {0.0, 1.0, 80.0, 15.0}), (Numbers{0.75, 1.0, 0.25}));
  EXPECT_EQ(scaled(scale, {0.0, -0.5, -9.0, 9.0}), (Numbers{0.25, 0.0, 0.75}));
  EXPECT_EQ(scaled(scale, {-1.0, 0.0, 8.0, 14.0}), (Numbers{1.0, 1.0, 0.0}));
  EXPECT_EQ(scaled(scale, {-1.0, -0.0, 8.0, 14.0}), (Numbers{0.0, 1.0, 0.0}));
  EXPECT_EQ(scaled(scale, {0.0, 0.0, 1e308, -1e308})[1], 1.0);
}

// A symbol of two one-hot variables, a number in [-1, 1] and a symbol of three variables. The
// middles of two bins are 1/4 and 3/4, those of three bins 1/6, 1/2 and 5/6.
TEST(ObservationScale, ScalesOneHotSymbolsToTheMiddleOfTheirBin) {
  const ObservationScale scale = scale_of_symbols();
  EXPECT_EQ(scale.n_inputs(), 3U);
  EXPECT_EQ(scaled(scale, {1.0, 0.0, 0.0, 0.0, 0.0, 1.0}), (Numbers{0.25, 0.5, 2.5 / 3.0}));
  EXPECT_EQ(scaled(scale, {0.0, 1.0, 1.0, 0.0, 1.0, 0.0}), (Numbers{0.75, 1.0, 0.5}));
  EXPECT_EQ(scaled(scale, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0})[2], 0.5 / 3.0);  // the first symbol
}

TEST(ObservationScale, StatesAreInTheUnitIntervalForAnyFiniteObservation) {
  const ObservationScale scale = scale_of_angles();
  core::Random random(1, core::Stream::weights);
  for (int i = 0; i < 5000; ++i) {
    Numbers observed(4);
    for (double& x : observed) {
      x = std::ldexp(random.normal(), static_cast<int>(random.below(2000)) - 1000);
      x = std::clamp(x, -1.7e308, 1.7e308);
    }
    for (const double x : scaled(scale, observed)) {
      ASSERT_GE(x, 0.0);
      ASSERT_LE(x, 1.0);
    }
  }
}

// Input 0 is variable 1, input 1 is variable 0; with 3 and 7 bins, and one more for a missing code.
TEST(ObservationScale, MissingReadingsAreRefusedHeldOrCoded) {
  const auto scale = [](Missing missing) {
    return ObservationScale({0.0, -1.0}, {1.0, 1.0},
                            {{ObservedKind::variable, 1, 0}, {ObservedKind::variable, 0, 0}},
                            missing, {3, 7});
  };
  const ObservationScale refusing = scale(Missing::error);
  const Numbers missing{testing::kInfinity, testing::kNaN};
  EXPECT_THROW(scaled(refusing, missing), std::invalid_argument);
  EXPECT_EQ(scaled(scale(Missing::hold), missing), (Numbers{0.5, 0.5}));  // before a reading
  // Middles of bins: the last of 4 and of 8; for -0.9 and 1 the first and the last but one.
  EXPECT_EQ(scaled(scale(Missing::code), missing), (Numbers{3.5 / 4.0, 7.5 / 8.0}));
  EXPECT_EQ(scaled(scale(Missing::code), {1.0, -0.9}), (Numbers{0.5 / 4.0, 6.5 / 8.0}));
  // States have no -0.0, which has other bits than 0.0.
  EXPECT_FALSE(std::signbit(scaled(refusing, {-0.0, 0.0})[1]));
  const ObservationScale angles = scale_of_angles();
  for (const double bad : {testing::kNaN, testing::kInfinity}) {
    const Numbers observed{1.0, 2.0, bad, 3.0};
    Numbers state(3, 7.0);
    EXPECT_THROW(angles(observed, state), std::invalid_argument);
    EXPECT_EQ(state, Numbers(3, 7.0));
  }
  EXPECT_THROW(scaled(refusing, {0.0, testing::kNaN}), std::invalid_argument);
  EXPECT_THROW(scaled(angles, {1.0, 2.0, 3.0}), std::invalid_argument);
}

TEST(ObservationScale, RefusesBadRangesAndInputsByName) {
  const auto error_of = [](const Numbers& low, const Numbers& high, ObservedInput input) {
    return testing::message_of([&] { const ObservationScale scale(low, high, {input}); });
  };
  const ObservedInput first{ObservedKind::variable, 0, 0};
  EXPECT_EQ(error_of({0.0}, {1.0, 1.0}, first),
            "observation.high must be as long as observation.low, got 2");
  EXPECT_EQ(error_of({0.0, 1.0}, {1.0, 1.0}, first),
            "observation.high[1] must be finite and greater than observation.low, got 1");
  EXPECT_EQ(error_of({0.0}, {1.0}, {ObservedKind::circular, 1, 0}),
            "observation.inputs[0] must be of a variable below 1, got 1");
  EXPECT_EQ(error_of({0.0}, {1.0}, {ObservedKind::angle, 0, 3}),
            "observation.inputs[0] must be of a variable below 1, got 3");
  EXPECT_EQ(error_of({0.0, 0.0}, {1.0, 1.0}, {ObservedKind::symbol, 1, 2}),
            "observation.inputs[0] must be of 1 to 1 variables, got 2");
  EXPECT_EQ(error_of({0.0}, {1.0}, first), "no error");
}

}  // namespace
}  // namespace sdnn::agents
