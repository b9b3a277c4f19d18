#include "sdnn/approximators/action_value.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "approximators/lookup_table.hpp"
#include "approximators/with_workspace.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

struct WithoutUpdate {
  std::size_t n_actions() const { return 1; }
  std::size_t n_inputs() const { return 1; }
  struct Workspace {};
  Workspace workspace() const { return {}; }
  void values(std::span<const double>, Workspace&, std::span<double>) const {}
  double value(std::span<const double>, Workspace&, std::size_t) const { return 0.0; }
};

struct Complete : WithoutUpdate {
  void update(std::span<const double>, Workspace&, std::size_t, double, double) {}
};

struct WithoutRate : WithoutUpdate {
  void update(std::span<const double>, Workspace&, std::size_t, double) {}
};

struct NotConst : Complete {
  void values(std::span<const double>, Workspace&, std::span<double>) {}
};

static_assert(ActionValue<testing::LookupTable>);
static_assert(ActionValue<SDNNC>);
static_assert(ActionValue<RBFNetwork>);
static_assert(ActionValue<Complete>);
static_assert(!ActionValue<WithoutUpdate>);
static_assert(!ActionValue<WithoutRate>);
static_assert(!ActionValue<NotConst>);
static_assert(!ActionValue<double>);
static_assert(CountedActionValue<SDNNC>);
static_assert(!CountedActionValue<RBFNetwork>);

SDNNCConfig small_network() {
  return {.n_inputs = 2,
          .n_pattern_units = 40,
          .n_hidden_units = 300,
          .n_active_units = 100,
          .n_actions = 5};
}

// Checks that values and value agree, that reading them changes nothing, and that corrections move
// the value to the target of 3. The 100 active units of the SDNN-C stand for values in steps of
// 40 / 88 = 0.45; at a rate of 1/2, errors of less than a step are lost by rounding.
template <ActionValue Q>
void expect_pure_reads_and_reached_targets(Q model) {
  testing::WithWorkspace<Q> q(std::move(model));
  const std::array<double, 2> state = {0.2, 0.9};
  std::vector<double> row(q.n_actions()), again(q.n_actions());
  for (int i = 0; i < 60; ++i) {
    q.update(state, 1, 3.0, 0.5);
    q.values(state, row);
    EXPECT_EQ(q.value(state, 1), row[1]);
    q.values(state, again);
    EXPECT_EQ(row, again);
  }
  EXPECT_NEAR(q.value(state, 1), 3.0, 0.5);
}

TEST(ActionValue, ReadingChangesNoModelAndCorrectionsReachTheirTarget) {
  expect_pure_reads_and_reached_targets(testing::LookupTable(2, 4, 5));
  expect_pure_reads_and_reached_targets(SDNNC(small_network(), 3));
  expect_pure_reads_and_reached_targets(RBFNetwork({.n_inputs = 2, .n_actions = 5}));
}

/// Random states; every third one repeats an earlier state.
std::vector<std::array<double, 2>> states_with_repetitions(std::size_t n) {
  core::Random random(3, core::Stream::sensor_noise);
  std::vector<std::array<double, 2>> states;
  for (std::size_t i = 0; i < n; ++i) {
    states.push_back(i % 3 == 2 ? states[random.below(i)]
                                : std::array{random.uniform(), random.uniform()});
  }
  return states;
}

// Compares workspaces with new ones: `reading` is used often but not for updates, `rare` only after
// thousands of updates, and another by a model and its copy.
template <ActionValue Q>
void expect_workspaces_follow_updates(Q q) {
  const auto states = states_with_repetitions(40);
  auto learning = q.workspace(), reading = q.workspace(), rare = q.workspace();
  std::vector<double> row(q.n_actions()), fresh(q.n_actions());
  const auto expect_fresh = [&](const Q& model, auto& workspace, const auto& state) {
    auto new_workspace = model.workspace();
    model.values(state, workspace, row);
    model.values(state, new_workspace, fresh);
    ASSERT_EQ(row, fresh);
  };
  for (int round = 0; round < 60; ++round) {
    for (std::size_t i = 0; i < states.size(); ++i) {
      q.update(states[i], learning, i % 3, round % 7, 0.5);
      if (i % 4 == 0) expect_fresh(q, reading, states[i / 2]);
    }
    if (round % 20 == 19) expect_fresh(q, rare, states[0]);
  }
  Q copy = q;
  auto workspace_of_both = reading;
  copy.update(states[0], workspace_of_both, 0, 5.0, 1.0);
  q.update(states[0], learning, 0, -5.0, 1.0);
  expect_fresh(copy, workspace_of_both, states[0]);
  expect_fresh(q, workspace_of_both, states[0]);
  expect_fresh(copy, workspace_of_both, states[0]);
}

// Values do not depend on the workspace that reads them, new, used before updates, or of a copy.
TEST(ActionValue, WorkspacesFollowTheUpdatesOfAModel) {
  expect_workspaces_follow_updates(SDNNC(small_network(), 3));
  expect_workspaces_follow_updates(RBFNetwork({.n_inputs = 2, .n_actions = 5}));
}

// An assertion, which only debug builds have, keeps the network from reading the 308 potentials of
// the other network's workspace as its own 300.
#ifndef NDEBUG
TEST(ActionValueDeathTest, AWorkspaceOfAnotherSizeIsRefused) {
  SDNNCConfig config = small_network();
  const SDNNC network(config, 3);
  config.n_hidden_units += 8;
  auto foreign = SDNNC(config, 3).workspace();
  std::vector<double> row(network.n_actions());
  EXPECT_DEATH(network.values(states_with_repetitions(1)[0], foreign, row), "fits");
}
#endif

template <ActionValue Q>
void expect_corrections_at_rates_as_defined(Q model) {
  testing::WithWorkspace<Q> whole(model), at_a_rate(model);
  std::vector<double> row(whole.n_actions()), same(whole.n_actions());
  for (int i = 0; i < 100; ++i) {
    const std::array<double, 2> state = {0.01 * (37 * i % 100), 0.01 * i};  // in [0, 1)
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

// A correction at a rate has the bits of one at rate 1 towards (1 - rate) Q + rate target.
TEST(ActionValue, EveryModelCorrectsAtARateLikeAtOneTowardsAMixedTarget) {
  expect_corrections_at_rates_as_defined(testing::LookupTable(2, 4, 5));
  expect_corrections_at_rates_as_defined(SDNNC(small_network(), 3));
  expect_corrections_at_rates_as_defined(RBFNetwork({.n_inputs = 2, .n_actions = 5}));
  expect_corrections_at_rates_as_defined(RBFNetwork({.n_inputs = 2, .n_bases = 3, .n_actions = 5}));
}

}  // namespace
}  // namespace sdnn::approximators
