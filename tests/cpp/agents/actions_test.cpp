#include "sdnn/agents/actions.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "errors.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using Numbers = std::vector<double>;

std::string error_of(const ActionConfig& config, std::size_t n_in_box) {
  return testing::message_of([&] { const Actions actions(config, n_in_box); });
}

TEST(Actions, OfABoxAreEvenlySpacedAndFoundByTheNearestIndex) {
  const Actions actions({.low = {-2.0, 0.0}, .high = {2.0, 0.3}}, 5);
  EXPECT_EQ(actions.n_dimensions(), 2U);
  EXPECT_EQ(actions.of_index(1, 0), -1.0);
  EXPECT_EQ(actions.of_index(4, 1), 0.3);
  for (const std::size_t d : {0U, 1U}) {
    for (std::size_t a = 0; a < 5; ++a) EXPECT_EQ(actions.index_of(actions.of_index(a, d), d), a);
  }
  EXPECT_EQ(actions.index_of(-0.6, 0), 1U);  // the nearest one
  EXPECT_EQ(actions.index_of(0.4, 0), 2U);
  EXPECT_EQ(Actions({.low = {-2.0}, .high = {2.0}}, 1).index_of(1.0, 0), 0U);
}

TEST(Actions, AnOffsetMovesActionsOfABoxButNotDiscreteOnes) {
  const Actions actions({.low = {-2.0}, .high = {2.0}}, 5);
  // The actions -2, -1, 0, 1, 2; an offset is a share of their distance.
  EXPECT_EQ(actions.beside_index(1, 0.25, 0), -1.0 + 0.25);
  EXPECT_EQ(actions.beside_index(4, -0.5, 0), 2.0 - 0.5);
  EXPECT_EQ(Actions({.low = {-2.0}, .high = {2.0}}, 1).beside_index(0, 0.0, 0), -2.0);
  const Actions discrete({.low = {3.0}, .high = {7.0}, .discrete = true}, 5);
  EXPECT_EQ(discrete.beside_index(1, 0.25, 0), 4.0);
}

TEST(Actions, OfANormalizedNumberAreScaledToTheRangeAndRoundedToIntegers) {
  const Actions actions({.low = {-2.0, 0.0}, .high = {6.0, 1.0}}, 0);
  EXPECT_EQ(actions.of_normalized(-1.0, 0), -2.0);
  EXPECT_EQ(actions.of_normalized(-0.5, 0), 0.0);  // a quarter of the way from -2 to 6
  EXPECT_EQ(actions.of_normalized(1.0, 0), 6.0);
  EXPECT_EQ(actions.of_normalized(-0.5, 1), 0.25);
  const Actions bytes({.low = {0.0}, .high = {255.0}, .number = ActionNumber::whole}, 0);
  EXPECT_EQ(bytes.of_normalized(0.001, 0), 128.0);  // 127.6 rounded to an integer
}

// The numbers are numpy.float32(0.1) and so on. Around 60,000 float16 has multiples of 32 only.
TEST(Actions, AreRoundedToTheFloatingPointTypeOfTheTask) {
  const auto middle = [](double low, double high, ActionNumber number) {
    return Actions({.low = {low}, .high = {high}, .number = number}, 3).of_index(1, 0);
  };
  EXPECT_EQ(middle(0.0, 0.2, ActionNumber::float64), 0.1);
  EXPECT_EQ(middle(0.0, 0.2, ActionNumber::float32), 0.10000000149011612);
  EXPECT_EQ(middle(0.0, 0.2, ActionNumber::float16), 0.0999755859375);
  EXPECT_EQ(middle(60000.0, 60002.0, ActionNumber::float16), 60000.0);
  EXPECT_EQ(middle(0.0, 0x1.8p-23, ActionNumber::float16), 0x1.0p-23);  // a tie goes to the even
}

TEST(Actions, OutsideTheSpaceAreRefused) {
  const Actions box({.low = {-2.0, 0.0}, .high = {2.0, 1.0}}, 5);
  const Actions buttons({.low = {2.0}, .high = {4.0}, .discrete = true}, 1);
  EXPECT_NO_THROW(box.require_action(Numbers{0.123, 1.0}));
  EXPECT_NO_THROW(buttons.require_action(Numbers{3.0}));
  for (const Numbers& bad : {Numbers{}, {0.0}, {0.0, 1.1}, {testing::kNaN, 0.0}, {-3.0, 0.0}}) {
    EXPECT_THROW(box.require_action(bad), std::invalid_argument);
  }
  for (const double bad : {1.0, 5.0, 2.5, testing::kNaN, testing::kInfinity}) {
    EXPECT_THROW(buttons.require_action(Numbers{bad}), std::invalid_argument);
  }
}

TEST(Actions, RefuseBadConfigurationsByTheirField) {
  EXPECT_EQ(error_of({.low = {0.0}, .high = {1.0}}, 3), "no error");
  EXPECT_NE(error_of({}, 3).find("action.low"), std::string::npos);
  for (const ActionConfig& bad :
       {ActionConfig{.low = {0.0}, .high = {1.0, 2.0}}, ActionConfig{.low = {0.0}, .high = {0.0}},
        ActionConfig{.low = {0.0}, .high = {testing::kInfinity}},
        // Doubles beyond 2^53 are not all integers; there are at most 2^20 discrete actions.
        ActionConfig{.low = {0.0}, .high = {1e17}, .number = ActionNumber::whole},
        ActionConfig{.low = {0.0}, .high = {0x1p20}, .discrete = true},
        ActionConfig{.low = {0.0}, .high = {-1.0}, .discrete = true},
        ActionConfig{.low = {0.0}, .high = {0.5}, .discrete = true}}) {
    EXPECT_NE(error_of(bad, 3).find("action.high"), std::string::npos) << error_of(bad, 3);
  }
  EXPECT_NE(error_of({.low = {0.0}, .high = {1.0}, .discrete = true}, 0).find("action.discrete"),
            std::string::npos);
}

}  // namespace
}  // namespace sdnn::agents
