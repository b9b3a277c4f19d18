#include "sdnn/agents/warm_up.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <vector>

#include "sdnn/core/pcg64.hpp"
#include "sdnn/core/state.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using Numbers = std::vector<double>;

void draw(core::Pcg64& random, Numbers& action) {
  for (double& x : action) x = random.below(5);
}

/// A warm-up of `n_steps` transitions with actions of one dimension.
WarmUp warm_up_of(std::size_t n_variables, std::size_t n_steps, bool learns_any_transition = true) {
  return {n_variables, /*n_dimensions=*/1, n_steps, /*seed=*/3, learns_any_transition};
}

bool always(const Numbers&) { return true; }

void learn(WarmUp& warm_up, std::size_t environment, const Numbers& action) {
  const Numbers observation{0.5, 1.5}, next{1.5, 2.5};
  warm_up.learn({false, environment, observation, action, 1.0, next, false});
}

void step(WarmUp& warm_up, std::size_t environment = 0) {
  learn(warm_up, environment, warm_up.act(draw, always, true, environment));
}

// `draw` draws one of five actions, `always` allows it. If actions were not repeated, 4/5 of the
// 400 steps would change them.
TEST(WarmUp, TakesEveryActionAndRepeatsItForSomeSteps) {
  WarmUp warm_up = warm_up_of(/*n_variables=*/2, /*n_steps=*/1000);
  std::set<double> actions;
  int n_changes = 0;
  double last = -1.0;
  for (int t = 0; t < 400; ++t) {
    const double action = warm_up.act(draw, always, true, 0)[0];
    actions.insert(action);
    n_changes += action != last ? 1 : 0;
    last = action;
  }
  EXPECT_EQ(actions.size(), 5U);
  EXPECT_LT(n_changes, 200);
  EXPECT_GT(n_changes, 20);
}

TEST(WarmUp, DoesNotRepeatAMaskedAction) {
  WarmUp warm_up = warm_up_of(/*n_variables=*/2, /*n_steps=*/1000);
  double forbidden = -1.0;
  const auto draw_other = [&](core::Pcg64& random, Numbers& action) {
    do draw(random, action);
    while (action[0] == forbidden);
  };
  const auto is_allowed = [&](const Numbers& action) { return action[0] != forbidden; };
  for (int t = 0; t < 400; ++t) {
    const double action = warm_up.act(draw_other, is_allowed, true, 0)[0];
    EXPECT_NE(action, forbidden);
    if (t % 3 == 0) forbidden = action;
  }
}

// A mask for three actions in the second transition; the others allow all actions.
TEST(WarmUp, RemembersMasks) {
  WarmUp warm_up = warm_up_of(/*n_variables=*/1, /*n_steps=*/1000);
  const Numbers state{0.5}, action{1.0};
  const std::vector<std::uint8_t> mask{0, 1, 1};
  warm_up.learn({false, 0, state, action, 1.0, state, false});
  EXPECT_TRUE(warm_up.step(0).next_mask.empty());
  warm_up.learn({false, 0, state, action, 1.0, state, false, mask});
  warm_up.learn({false, 0, state, action, 1.0, state, false});
  const std::vector<std::vector<std::uint8_t>> expected{{1, 1, 1}, mask, {1, 1, 1}};
  for (std::size_t t = 0; t < 3; ++t) {
    EXPECT_TRUE(std::ranges::equal(warm_up.step(t).next_mask, expected[t])) << t;
  }
}

TEST(WarmUp, RemembersDurationsFromTheFirstThatIsNotOneAndRestoresThem) {
  WarmUp warm_up = warm_up_of(/*n_variables=*/1, /*n_steps=*/1000);
  const Numbers state{0.5}, action{1.0}, dts{1.0, 1.0, 2.5, 1.0};
  for (std::size_t t = 0; t < dts.size(); ++t) {
    EXPECT_EQ(core::state_of(warm_up).contains("dts"), t > 2);
    warm_up.learn({false, 0, state, action, 1.0, state, false, {}, /*is_own=*/true, dts[t]});
  }
  WarmUp restored = warm_up_of(/*n_variables=*/1, /*n_steps=*/1000);
  core::restore(restored, core::state_of(warm_up));
  for (std::size_t t = 0; t < dts.size(); ++t) {
    EXPECT_EQ(warm_up.step(t).dt, dts[t]);
    EXPECT_EQ(restored.step(t).dt, dts[t]);
  }
  testing::expect_refused(restored, testing::with_number(core::state_of(warm_up), "dts", -1.0),
                          "state: dts must be in [0.001, 1000000]");
}

TEST(WarmUp, EvaluationDoesNotChangeItsActions) {
  WarmUp evaluated = warm_up_of(/*n_variables=*/2, /*n_steps=*/100), warm_up = evaluated;
  for (int t = 0; t < 50; ++t) {
    (void)evaluated.act(draw, always, false, 0);
    EXPECT_EQ(evaluated.act(draw, always, true, 0), warm_up.act(draw, always, true, 0));
  }
}

// A warm-up of three transitions; learn(warm_up, environment, action).
TEST(WarmUp, RemembersTransitionsInOrder) {
  WarmUp warm_up = warm_up_of(/*n_variables=*/2, /*n_steps=*/3);
  warm_up.set_n_environments(2);
  learn(warm_up, 1, {2.0});
  learn(warm_up, 0, {3.0});
  EXPECT_FALSE(warm_up.is_over());
  learn(warm_up, 1, {4.0});
  EXPECT_TRUE(warm_up.is_over());
  EXPECT_EQ(warm_up.step(0).environment, 1U);
  EXPECT_TRUE(warm_up.step(0).begins);
  EXPECT_TRUE(warm_up.step(1).begins);
  EXPECT_FALSE(warm_up.step(2).begins);
  EXPECT_EQ(warm_up.step(2).action[0], 4.0);
  EXPECT_EQ(warm_up.step(2).next_observation[1], 2.5);
  // Two variables of the observation and the next one of three transitions.
  EXPECT_EQ(warm_up.all_observations().size(), 2U * 2U * 3U);
  warm_up.set_n_environments(1);
  EXPECT_EQ(warm_up.n_in_all(), 2U);  // transitions of two environments are remembered
  EXPECT_THROW((void)warm_up.act(draw, always, true, 1), std::invalid_argument);
}

// The warm-up has its two transitions, but an action of environment 1 is not learned yet.
TEST(WarmUp, WaitsForPendingActionsIfOnlyTheAgentsActionsAreLearned) {
  WarmUp warm_up = warm_up_of(/*n_variables=*/2, /*n_steps=*/2, /*learns_any_transition=*/false);
  warm_up.set_n_environments(2);
  step(warm_up, 0);
  const Numbers pending = warm_up.act(draw, always, true, 1);
  step(warm_up, 0);
  EXPECT_FALSE(warm_up.is_over());
  learn(warm_up, 1, pending);
  EXPECT_TRUE(warm_up.is_over());
}

}  // namespace
}  // namespace sdnn::agents
