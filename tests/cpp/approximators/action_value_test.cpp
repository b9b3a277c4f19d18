#include "sdnn/approximators/action_value.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <vector>

#include "approximators/lookup_table.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::approximators {
namespace {

struct WithoutUpdate {
  std::size_t n_actions() const { return 1; }
  std::size_t n_inputs() const { return 1; }
  void values(std::span<const double>, std::span<double>) const {}
  double value(std::span<const double>, std::size_t) const { return 0.0; }
};

struct Complete : WithoutUpdate {
  void update(std::span<const double>, std::size_t, double, double) {}
};

struct WithoutRate : WithoutUpdate {
  void update(std::span<const double>, std::size_t, double) {}
};

static_assert(ActionValue<testing::LookupTable>);
static_assert(ActionValue<SDNNC>);
static_assert(ActionValue<RBFNetwork>);
static_assert(ActionValue<Complete>);
static_assert(!ActionValue<WithoutUpdate>);
static_assert(!ActionValue<WithoutRate>);
static_assert(!ActionValue<double>);

TEST(ActionValue, ALookupTableReturnsWhatItWasCorrectedTo) {
  testing::LookupTable q(2, 3, 4);
  const std::array<double, 2> state = {0.5, 1.0};
  const std::array<double, 2> same_cell = {0.34, 0.67};
  const std::array<double, 2> other_cell = {0.33, 1.0};
  q.update(state, 2, 7.25);
  std::array<double, 4> row{};
  q.values(same_cell, row);
  EXPECT_EQ(row, (std::array<double, 4>{0.0, 0.0, 7.25, 0.0}));
  EXPECT_EQ(q.value(same_cell, 2), 7.25);
  EXPECT_EQ(q.value(other_cell, 2), 0.0);
  q.update(state, 2, 1.25, 0.25);  // 3/4 of 7.25 and 1/4 of 1.25
  EXPECT_EQ(q.value(state, 2), 5.75);
}

// What the table of expressions promises, for every model: values and value agree, asking changes
// nothing, and corrections move the value to the target.
template <ActionValue Q>
void expect_a_model(Q q) {
  const std::array<double, 2> state = {0.2, 0.9};
  std::vector<double> row(q.n_actions());
  std::vector<double> again(q.n_actions());
  for (int i = 0; i < 60; ++i) {
    q.update(state, 1, 3.0, 0.5);
    q.values(state, row);
    EXPECT_EQ(q.value(state, 1), row[1]);
    q.values(state, again);
    EXPECT_EQ(row, again);
  }
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
  expect_a_model(RBFNetwork({.n_inputs = 2, .n_actions = 5}));
}

// A correction at a rate is one at rate 1 towards (1 - rate) Q + rate target: the same bits.
template <ActionValue Q>
void expect_rates_as_defined(Q at_a_rate) {
  Q whole = at_a_rate;
  std::vector<double> row(whole.n_actions()), same(whole.n_actions());
  for (int i = 0; i < 100; ++i) {
    const std::array<double, 2> state = {0.01 * (37 * i % 100), 0.01 * i};
    const std::size_t action = static_cast<std::size_t>(i) % whole.n_actions();
    const double rate = 0.1 * (1 + i % 9), target = 8.0 - 0.2 * i;
    whole.update(state, action, (1.0 - rate) * whole.value(state, action) + rate * target, 1.0);
    at_a_rate.update(state, action, target, rate);
    whole.values(state, row);
    at_a_rate.values(state, same);
    ASSERT_EQ(row, same) << i;
  }
  for (const double bad : {0.0, -0.5, 1.5, std::nan("")}) {
    EXPECT_THROW(at_a_rate.update(std::array{0.2, 0.3}, 0, 1.0, bad), std::invalid_argument);
  }
  at_a_rate.values(std::array{1.0, 0.99}, same);
  whole.values(std::array{1.0, 0.99}, row);
  EXPECT_EQ(row, same);
}

TEST(ActionValue, EveryModelCorrectsAtARateAsDefined) {
  expect_rates_as_defined(testing::LookupTable(2, 4, 5));
  expect_rates_as_defined(SDNNC({.n_inputs = 2,
                                 .n_pattern_units = 40,
                                 .n_hidden_units = 300,
                                 .n_active_units = 100,
                                 .n_actions = 5},
                                3));
  expect_rates_as_defined(RBFNetwork({.n_inputs = 2, .n_actions = 5}));
  expect_rates_as_defined(RBFNetwork({.n_inputs = 2, .n_bases = 3, .n_actions = 5}));
}

}  // namespace
}  // namespace sdnn::approximators
