#include "sdnn/agents/n_step_buffer.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "states.hpp"

namespace sdnn::agents {
namespace {

using Numbers = std::vector<double>;
using Indices = std::vector<std::size_t>;

NStepBuffer buffer_of(std::size_t n_steps) { return {n_steps, /*n_inputs=*/1, /*n_dimensions=*/2}; }

/// Step number i of a path: from i / 16 to (i + 1) / 16, action (i, 2 i), reward 2^i.
void add(NStepBuffer& steps, int i) {
  const auto n = static_cast<std::size_t>(i);
  steps.add(Numbers{i / 16.0}, Indices{n, 2 * n}, static_cast<double>(1 << i),
            Numbers{(i + 1) / 16.0});
}

void expect_oldest(NStepBuffer& steps, int i) {
  const auto n = static_cast<std::size_t>(i);
  const NStepBuffer::Step& oldest = steps.take_oldest();
  EXPECT_EQ(oldest.state, Numbers{i / 16.0});
  EXPECT_EQ(oldest.action, (Indices{n, 2 * n}));
  EXPECT_EQ(oldest.reward, static_cast<double>(1 << i));
}

// add and expect_oldest take the number of a step.
TEST(NStepBuffer, ReturnsTheOldestStepFirst) {
  NStepBuffer steps = buffer_of(3);
  EXPECT_EQ(steps.size(), 0U);
  add(steps, 0);
  add(steps, 1);
  EXPECT_FALSE(steps.is_full());
  add(steps, 2);
  for (int i = 3; i < 9; ++i) {
    EXPECT_TRUE(steps.is_full());
    expect_oldest(steps, i - 3);
    add(steps, i);
  }
  for (int i = 6; i < 9; ++i) expect_oldest(steps, i);
  EXPECT_EQ(steps.size(), 0U);
}

// Step i has the reward 2^i; the value of the state after the last step is the first argument of
// return_of_oldest, gamma = 1/2 the second one.
TEST(NStepBuffer, TheReturnOfTheOldestStepDiscountsLaterRewards) {
  NStepBuffer steps = buffer_of(3);
  EXPECT_EQ(steps.return_of_oldest(5.0, 0.5), 5.0);  // the value of the next state alone
  for (int i = 0; i < 3; ++i) add(steps, i);
  EXPECT_EQ(steps.return_of_oldest(16.0, 0.5), 1.0 + 2.0 / 2 + 4.0 / 4 + 16.0 / 8);
  EXPECT_EQ(steps.return_of_oldest(16.0, 0.0), 1.0);
  for (int i = 3; i < 5; ++i) {
    steps.take_oldest();
    add(steps, i);
  }
  EXPECT_EQ(steps.return_of_oldest(-8.0, 0.5), 4.0 + 8.0 / 2 + 16.0 / 4 - 8.0 / 8);
  steps.take_oldest();
  EXPECT_EQ(steps.return_of_oldest(-8.0, 0.5), 8.0 + 16.0 / 2 - 8.0 / 4);
}

// Durations 2, 1/2 and 1 with gamma = 1/4: discounts 1/16, 1/2 and 1/4. Rewards are 16; the last
// state's value of 64 is discounted to 16.
TEST(NStepBuffer, DiscountsBySquaresAndRootsForLongerAndShorterSteps) {
  NStepBuffer steps = buffer_of(3);
  const Numbers dts{2.0, 0.5, 1.0};
  for (std::size_t i = 0; i < 3; ++i) {
    steps.add(Numbers{0.5}, Indices{0, 0}, 16.0, Numbers{0.5}, dts[i]);
  }
  EXPECT_DOUBLE_EQ(steps.return_of_oldest(64.0, 0.25), 16.0 + (16.0 + (16.0 + 16.0) / 2.0) / 16.0);
  NStepBuffer restored = buffer_of(3);
  core::restore(restored, core::state_of(steps));
  EXPECT_EQ(restored.return_of_oldest(64.0, 0.25), steps.return_of_oldest(64.0, 0.25));
  testing::expect_refused(steps, testing::with_number(core::state_of(steps), "dts", 0.0, 1),
                          "state: dts must be in [0.001, 1000000]");
}

// Step 3 leads to the state 4 / 16; a transition from another state does not continue it.
TEST(NStepBuffer, IsContinuedByTheNextStateOfTheNewestStep) {
  NStepBuffer steps = buffer_of(2);
  EXPECT_TRUE(steps.is_continued_by(Numbers{0.9}));  // nothing is pending
  add(steps, 3);
  EXPECT_TRUE(steps.is_continued_by(Numbers{(3 + 1) / 16.0}));
  EXPECT_FALSE(steps.is_continued_by(Numbers{0.26}));
  steps.take_oldest();
  EXPECT_TRUE(steps.is_continued_by(Numbers{0.26}));
}

// Steps have the rewards 1, 2 and 4; each_is returns whether a condition is true of all of them.
TEST(NStepBuffer, VisitsEachPendingStepOnce) {
  NStepBuffer steps = buffer_of(3);
  for (int i = 0; i < 3; ++i) add(steps, i);
  steps.take_oldest();
  Numbers rewards;
  EXPECT_TRUE(steps.each_is([&](const NStepBuffer::Step& step) {
    rewards.push_back(step.reward);
    return true;
  }));
  EXPECT_EQ(rewards, (Numbers{2.0, 4.0}));
  EXPECT_FALSE(steps.each_is([](const NStepBuffer::Step& step) { return step.reward < 4.0; }));
}

// The buffer holds 2 of at most 3 steps with actions of two dimensions.
TEST(NStepBuffer, RefusesInconsistentStates) {
  NStepBuffer steps = buffer_of(3);
  for (int i = 0; i < 2; ++i) add(steps, i);
  testing::expect_damaged_states_refused(steps);
  using testing::with_number;
  const core::State good = core::state_of(steps);
  for (const double bad : {testing::kNaN, -0.1, 1.1}) {
    testing::expect_refused(steps, with_number(good, "states", bad, 1),
                            "state: states must be in [0, 1]");
    testing::expect_refused(steps, with_number(good, "next_state", bad),
                            "state: next_state must be in [0, 1]");
  }
  for (const double bad : {testing::kNaN, testing::kInfinity}) {
    testing::expect_refused(steps, with_number(good, "rewards", bad),
                            "state: rewards must be finite");
  }
  core::State bad = good;
  bad["rewards"] = testing::tensor_of(Numbers(4, 0.0));
  testing::expect_refused(steps, bad, "state: rewards must be no more than n_steps");
  bad["rewards"] = testing::tensor_of(Numbers(1, 0.0));
  testing::expect_refused(steps, bad, "state: states must be n_inputs per reward");
  bad = good;
  bad["actions"] = testing::tensor_of(std::vector<std::int64_t>(3, 0));
  testing::expect_refused(steps, bad, "state: actions must be those of every reward");
}

}  // namespace
}  // namespace sdnn::agents
