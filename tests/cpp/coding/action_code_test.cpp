#include "sdnn/coding/action_code.hpp"

#include <gtest/gtest.h>

#include "errors.hpp"

namespace sdnn::coding {
namespace {

TEST(ActionCode, ThePaperHas601Windows) {
  const ActionCode code(900, 300);
  EXPECT_EQ(code.n_actions(), 601U);
  for (const std::size_t action : {0U, 1U, 300U, 600U}) EXPECT_EQ(code.first_unit(action), action);
}

TEST(ActionCode, FewActionsHaveEvenlySpacedWindows) {
  const ActionCode code(900, 300, 3);
  EXPECT_EQ(code.first_unit(0), 0U);
  EXPECT_EQ(code.first_unit(1), 300U);
  EXPECT_EQ(code.first_unit(2), 600U);
  EXPECT_EQ(ActionCode(10, 4, 1).first_unit(0), 0U);
}

TEST(ActionCode, ActionsAreEvenlySpacedInTheirRange) {
  EXPECT_EQ(action_value(0, 601, -10, 10), -10.0);
  EXPECT_EQ(action_value(300, 601, -10, 10), 0.0);
  EXPECT_EQ(action_value(600, 601, -10, 10), 10.0);
  EXPECT_DOUBLE_EQ(action_value(1, 601, -10, 10), -10.0 + 1.0 / 30);
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
