#include "sdnn/environments/acrobot_batch.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "allocation_count.hpp"
#include "errors.hpp"
#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::environments {
namespace {

using testing::kNaN;

bool have_same_bits(const AcrobotState& a, const AcrobotState& b) {
  return std::memcmp(a.data(), b.data(), 4 * sizeof(double)) == 0;
}

/// Arguments and results of a batch step, with the right sizes.
struct Step {
  explicit Step(std::size_t n)
      : torques(n), tolerances(n, 1.0), moving(n, 1), rewards(n), terminated(n), truncated(n) {}
  void apply_to(AcrobotBatch& batch) {
    batch.step(torques, tolerances, moving, {rewards, terminated, truncated});
  }

  std::vector<double> torques, tolerances;
  std::vector<std::uint8_t> moving;
  std::vector<double> rewards;
  std::vector<std::uint8_t> terminated, truncated;
};

// Expects a batch to move like single acrobots, with random starts, torques and tolerances. A tenth
// of the acrobots rests in each step; ended episodes begin again. Returns the number of episodes,
// or 0 after a difference, and adds the number of goals to `n_goals`.
int compare_with_single(const AcrobotConfig& config, std::size_t n, int n_steps, std::uint64_t seed,
                        int& n_goals) {
  core::Random random(seed, core::Stream::exploration);
  AcrobotBatch batch(config, n);
  std::vector<Acrobot> singles(n, Acrobot(config));
  Step step(n);
  int n_episodes = 0;
  const auto begin = [&](std::size_t i) {
    AcrobotState state = AcrobotState::Zero();
    if (random.uniform() < 0.7) {
      for (double& value : state) value = 8.0 * random.uniform() - 4.0;
    }
    singles[i].set_state(state);
    batch.set_state(i, state);
    step.tolerances[i] = random.uniform();
    ++n_episodes;
  };
  for (std::size_t i = 0; i < n; ++i) begin(i);
  for (int s = 0; s < n_steps; ++s) {
    for (std::size_t i = 0; i < n; ++i) {
      step.moving[i] = random.uniform() < 0.9;
      step.torques[i] = step.moving[i] ? 20.0 * random.uniform() - 10.0 : kNaN;
    }
    step.apply_to(batch);
    for (std::size_t i = 0; i < n; ++i) {
      StepResult expected{0.0, false, false};
      if (step.moving[i]) expected = singles[i].step(step.torques[i], step.tolerances[i]);
      const bool is_same = step.rewards[i] == expected.reward &&
                           step.terminated[i] == expected.terminated &&
                           step.truncated[i] == expected.truncated &&
                           have_same_bits(batch.state(i), singles[i].state()) &&
                           batch.tip_height(i) == singles[i].tip_height() &&
                           batch.decisions(i) == singles[i].decisions();
      EXPECT_TRUE(is_same) << "acrobot " << i << " of " << n << ", step " << s;
      if (!is_same) return 0;
      n_goals += expected.terminated;
      if (expected.terminated || expected.truncated) begin(i);
    }
  }
  return n_episodes;
}

// Sizes are below, at and above multiples of the 2, 4 and 8 acrobots that a register holds.
TEST(AcrobotBatch, HasTheBitsOfSingleAcrobotsOnEveryInstructionSet) {
  sdnn::testing::on_every_instruction_set([&](auto level) {
    SCOPED_TRACE(level);
    int n_episodes = 0, n_goals = 0;
    for (const std::size_t n : {1u, 2u, 3u, 4u, 5u, 7u, 8u, 9u, 15u, 16u, 17u, 61u}) {
      n_episodes += compare_with_single({}, n, /*n_steps=*/300, /*seed=*/n, n_goals);
    }
    EXPECT_GT(n_episodes, 1500);  // so that every end of an episode has been compared
    EXPECT_GT(n_goals, 750);
  });
}

// In 200 steps nine tenths of 37 acrobots make 6,660 decisions, at most 7 in an episode.
TEST(AcrobotBatch, HasTheBitsOfSingleAcrobotsWithOtherConfigurations) {
  AcrobotConfig config;
  config.goal_test = GoalTest::decision_instant;
  config.link_mass_2 = 1.25;
  config.link_length_2 = 0.75;
  config.gravity = 9.81;
  config.decision_interval = 0.3;
  config.integration_step = 0.1;
  config.max_decisions = 7;
  config.goal_height = 1.0;
  config.idle_angle = 0.5;
  sdnn::testing::on_every_instruction_set([&](auto level) {
    SCOPED_TRACE(level);
    int n_goals = 0;
    EXPECT_GT(compare_with_single(config, 37, /*n_steps=*/200, /*seed=*/2, n_goals), 1000);
    EXPECT_GT(n_goals, 100);  // so that goals have been compared
    config.goal_test = GoalTest::every_step;
    EXPECT_GT(compare_with_single(config, 37, /*n_steps=*/200, /*seed=*/2, n_goals), 1000);
  });
}

// The angle of a fast acrobot leaves the range of sin_cos in one lane only.
TEST(AcrobotBatch, AnOverflowDoesNotChangeTheOtherAcrobots) {
  sdnn::testing::on_every_instruction_set([&](auto level) {
    SCOPED_TRACE(level);
    AcrobotBatch batch({}, 5);
    batch.set_state(3, {0.0, 0.0, 1e300, 0.0});
    batch.set_state(4, {1.0, 2.0, 3.0, 4.0});
    Acrobot single;
    single.set_state({1.0, 2.0, 3.0, 4.0});
    Step step(5);
    step.torques.assign(5, 2.5);
    single.step(2.5, 1.0);
    EXPECT_EQ(testing::message_of<std::overflow_error>([&] { step.apply_to(batch); }),
              "the speed of acrobot 3 is too high for this integration_step");
    EXPECT_TRUE(have_same_bits(batch.state(4), single.state()));
    EXPECT_EQ(batch.decisions(4), 1);
    EXPECT_THROW(step.apply_to(batch), std::logic_error);  // acrobot 3's episode is over
    batch.reset(3);
    EXPECT_NO_THROW(step.apply_to(batch));
  });
}

TEST(AcrobotBatch, RefusesBadArgumentsBeforeAnyAcrobotMoves) {
  AcrobotBatch batch({}, 3);
  const auto message = [&batch](Step step) {
    return testing::message_of([&] { step.apply_to(batch); });
  };
  Step step(3);
  step.torques[2] = 10.5;
  EXPECT_EQ(message(step), "torques[2] must be in [-10, 10], got 10.5");
  step.torques[2] = kNaN;
  EXPECT_EQ(message(step), "torques[2] must be in [-10, 10], got nan");
  step.moving[2] = 0;
  EXPECT_EQ(message(step), "no error");
  step.tolerances[1] = -1.0;
  EXPECT_EQ(message(step), "goal_tolerances[1] must be at least 0, got -1");
  step.tolerances[1] = 1.0;
  step.torques.pop_back();
  EXPECT_EQ(message(step), "torques must be of 3 items, got 2");
  step = Step(3);
  step.truncated.push_back(0);
  EXPECT_EQ(message(step), "truncated must be of 3 items, got 4");
  // Only the step without an error has moved acrobots, and acrobot 2 rested in it.
  EXPECT_EQ(batch.decisions(0), 1);
  EXPECT_EQ(batch.decisions(2), 0);
  EXPECT_THROW(batch.set_state(0, {kNaN, 0.0, 0.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(batch.reset(3), std::out_of_range);
  EXPECT_THROW(batch.state(3), std::out_of_range);
  EXPECT_THROW(batch.tip_height(3), std::out_of_range);
  EXPECT_THROW(batch.decisions(3), std::out_of_range);
  EXPECT_THROW(AcrobotBatch({}, 0), std::invalid_argument);
  EXPECT_THROW(AcrobotBatch({}, kMaxAcrobots + 1), std::invalid_argument);
  const AcrobotConfig config{.max_decisions = 0};
  EXPECT_THROW(AcrobotBatch(config, 1), std::invalid_argument);
}

TEST(AcrobotBatch, AStepAllocatesNothing) {
  AcrobotBatch batch({}, 21);
  Step step(21);
  step.apply_to(batch);
  const std::size_t before = testing::allocation_count();
  step.apply_to(batch);
  EXPECT_EQ(testing::allocation_count(), before);
}

}  // namespace
}  // namespace sdnn::environments
