#include "sdnn/coding/action_code.hpp"

#include <gtest/gtest.h>

#include "errors.hpp"

namespace sdnn::coding {
namespace {

constexpr int kUnits = 900, kActiveUnits = 300;  // as in the paper

TEST(ActionCode, ThePaperHas601Windows) {
  const ActionCode code(kUnits, kActiveUnits);
  EXPECT_EQ(code.n_actions(), 601U);
  for (const std::size_t action : {0U, 1U, 300U, 600U}) EXPECT_EQ(code.first_unit(action), action);
}

TEST(ActionCode, FewActionsHaveEvenlySpacedWindows) {
  const ActionCode code(kUnits, kActiveUnits, /*n_actions=*/3);  // starts are (900 - 300) / 2 apart
  for (const std::size_t action : {0U, 1U, 2U}) EXPECT_EQ(code.first_unit(action), 300 * action);
  EXPECT_EQ(ActionCode(10, 4, /*n_actions=*/1).first_unit(0), 0U);
}

TEST(ActionCode, ActionsAreEvenlySpacedInTheirRange) {
  const auto torque = [](std::size_t action) { return action_value(action, 601, -10.0, 10.0); };
  EXPECT_EQ(torque(0), -10.0);
  EXPECT_EQ(torque(300), 0.0);
  EXPECT_EQ(torque(600), 10.0);
  EXPECT_DOUBLE_EQ(torque(1), -10.0 + 20.0 / 600);
}

TEST(ActionCode, RefusesBadSizesByName) {
  const auto message = [](int n, int active, int actions) {
    return testing::message_of([&] { ActionCode(n, active, actions); });
  };
  EXPECT_EQ(message(900, 901, 0), "n_active_units must be in [1, 900], got 901");
  EXPECT_EQ(message(900, 0, 0), "n_active_units must be in [1, 900], got 0");
  EXPECT_EQ(message(0, 1, 0), "n_hidden_units must be in [1, 1048576], got 0");
  EXPECT_EQ(message(900, 300, 602), "n_actions must be in [1, 601], got 602");
}

}  // namespace
}  // namespace sdnn::coding
