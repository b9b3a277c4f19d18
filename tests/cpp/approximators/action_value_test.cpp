#include "sdnn/approximators/action_value.hpp"

#include <gtest/gtest.h>

#include <array>

#include "approximators/lookup_table.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::approximators {
namespace {

struct WithoutCorrect {
  std::size_t n_actions() const { return 1; }
  std::size_t n_inputs() const { return 1; }
  void values(std::span<const double>, std::span<double>) const {}
  double value(std::span<const double>, std::size_t) const { return 0.0; }
};

struct Complete : WithoutCorrect {
  void correct(std::span<const double>, std::size_t, double) {}
};

struct ValueIsText : Complete {
  const char* value(std::span<const double>, std::size_t) const { return "0"; }
};

static_assert(ActionValue<testing::LookupTable>);
static_assert(ActionValue<SDNNC>);
static_assert(ActionValue<SDNNC>);
static_assert(ActionValue<Complete>);
static_assert(!ActionValue<WithoutCorrect>);
static_assert(!ActionValue<ValueIsText>);
static_assert(!ActionValue<double>);

TEST(ActionValue, ALookupTableReturnsWhatItWasCorrectedTo) {
  testing::LookupTable q(2, 3, 4);
  const std::array<double, 2> state = {0.5, 1.0};
  const std::array<double, 2> same_cell = {0.34, 0.67};
  const std::array<double, 2> other_cell = {0.33, 1.0};
  q.correct(state, 2, 7.25);
  std::array<double, 4> row{};
  q.values(same_cell, row);
  EXPECT_EQ(row, (std::array<double, 4>{0.0, 0.0, 7.25, 0.0}));
  EXPECT_EQ(q.value(same_cell, 2), 7.25);
  EXPECT_EQ(q.value(other_cell, 2), 0.0);
}

// What the table of expressions promises, for every model: values and value agree, asking changes
// nothing, and a correction moves the value to the goal or nearer.
template <ActionValue Q>
void expect_a_model(Q q) {
  const std::array<double, 2> state = {0.2, 0.9};
  std::vector<double> row(q.n_actions());
  std::vector<double> again(q.n_actions());
  double distance = 3.0;
  for (int i = 0; i < 60; ++i) {
    q.correct(state, 1, 3.0);
    q.values(state, row);
    EXPECT_EQ(q.value(state, 1), row[1]);
    q.values(state, again);
    EXPECT_EQ(row, again);
  }
  EXPECT_LT(std::abs(q.value(state, 1) - 3.0), distance);
  EXPECT_NEAR(q.value(state, 1), 3.0, 0.5);
}

TEST(ActionValue, EveryModelKeepsTheConceptsPromises) {
  expect_a_model(testing::LookupTable(2, 4, 5));
  const SDNNCConfig config{.n_inputs = 2,
                           .n_pattern_units = 40,
                           .n_hidden_units = 300,
                           .n_active_units = 100,
                           .n_actions = 5};
  expect_a_model(SDNNC(config, 3));
  expect_a_model(SDNNC(config, 3));
}

}  // namespace
}  // namespace sdnn::approximators
