#include "sdnn/agents/q_learning_config.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "agents/small_q_learning.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents::small_q_learning {
namespace {

void expect_rates(const Agent& agent, double learning_rate, double epsilon) {
  EXPECT_EQ(agent.learning_rate(), learning_rate);
  EXPECT_EQ(agent.epsilon(), epsilon);
}

TEST(QLearning, RatesChangeLinearlyWithProgress) {
  Agent agent(five_cells(),
              {.learning_rate = 0.5,
               .policy = {.epsilon = 0.75},
               .final_learning_rate = 0.25,
               .final_epsilon = 0.0},
              1);
  EXPECT_EQ(agent.progress(), 0.0);
  expect_rates(agent, 0.5, 0.75);
  agent.set_progress(0.25);
  expect_rates(agent, 0.75 * 0.5 + 0.25 * 0.25, 0.75 * 0.75);
  agent.learn(cell(0), 0, 16.0, cell(1), true);
  EXPECT_EQ(agent.network().value(cell(0), 0), 0.4375 * 16.0);  // at this learning rate
  agent.set_progress(1.0);
  expect_rates(agent, 0.25, 0.0);
  for (const double bad : {-1e-9, 1.0000001, testing::kNaN}) {
    EXPECT_THROW(agent.set_progress(bad), std::invalid_argument);
  }
  EXPECT_EQ(agent.progress(), 1.0);
  agent.set_progress(0.0);  // rates depend on the present progress only
  EXPECT_EQ(agent.learning_rate(), 0.5);
  Agent unscheduled(five_cells(), {}, 1);  // has no final rates
  unscheduled.set_progress(0.9);
  expect_rates(unscheduled, 0.5, 0.1);
}

// Each quarter of the progress halves the learning rate, each half halves epsilon.
TEST(QLearning, AnExponentialScheduleMultipliesRatesByEqualFactors) {
  const QLearningConfig config{.learning_rate = 1.0,
                               .policy = {.epsilon = 0.5},
                               .final_learning_rate = 0.0625,
                               .final_epsilon = 0.125,
                               .schedule = Schedule::exponential};
  Agent agent(five_cells(), config, 1);
  EXPECT_EQ(agent.learning_rate(), 1.0);
  agent.set_progress(0.5);
  EXPECT_DOUBLE_EQ(agent.learning_rate(), 0.25);
  EXPECT_DOUBLE_EQ(agent.epsilon(), 0.25);
  agent.set_progress(0.75);
  EXPECT_DOUBLE_EQ(agent.learning_rate(), 0.125);
  EXPECT_EQ(learning_rate_at(config, 0.75), agent.learning_rate());
  EXPECT_EQ(epsilon_at(config, 0.75), agent.epsilon());
  agent.set_progress(1.0);
  expect_rates(agent, 0.0625, 0.125);
  const Agent unscheduled(five_cells(), {.schedule = Schedule::exponential}, 1);
  EXPECT_EQ(learning_rate_at(unscheduled.config(), 0.7), 0.5);
}

TEST(QLearning, AnExponentialScheduleIsGeometricAndStaysBetweenItsFirstAndLastValue) {
  core::Random random(3, core::Stream::weights);
  for (int i = 0; i < 2000; ++i) {
    const double first = 1.0 - random.uniform();
    const double last = i % 3 == 0 ? first : 1e-300 + random.uniform() * random.uniform();
    const QLearningConfig config{
        .learning_rate = first, .final_learning_rate = last, .schedule = Schedule::exponential};
    const double progress = random.uniform(), rate = learning_rate_at(config, progress);
    ASSERT_GE(rate, std::min(first, last));
    ASSERT_LE(rate, std::max(first, last));
    ASSERT_NEAR(std::log(rate), (1.0 - progress) * std::log(first) + progress * std::log(last),
                1e-11);
    ASSERT_EQ(learning_rate_at(config, 0.0), first);
    ASSERT_EQ(learning_rate_at(config, 1.0), last);
  }
}

TEST(QLearning, EpsilonReachesItsFinalValueAfterTheExplorationFraction) {
  const QLearningConfig config{.learning_rate = 1.0,
                               .policy = {.epsilon = 0.5},
                               .final_learning_rate = 0.5,
                               .final_epsilon = 0.125,
                               .exploration_fraction = 0.25};
  Agent agent(five_cells(), config, 1);
  EXPECT_EQ(agent.epsilon(), 0.5);
  agent.set_progress(0.125);
  EXPECT_EQ(agent.epsilon(), (0.5 + 0.125) / 2);  // half way to progress 0.25
  EXPECT_EQ(agent.learning_rate(), 1.0 - 0.125 * 0.5);
  for (const double progress : {0.25, 0.3, 1.0}) {
    agent.set_progress(progress);
    EXPECT_EQ(agent.epsilon(), 0.125);
  }
  // Half of the exploration fraction of an exponential schedule: the geometric mean.
  QLearningConfig exponential = config;
  exponential.schedule = Schedule::exponential;
  EXPECT_DOUBLE_EQ(epsilon_at(exponential, 0.125), std::sqrt(0.5 * 0.125));
  EXPECT_EQ(epsilon_at(exponential, 0.3), 0.125);
  const Agent unscheduled(five_cells(), {.exploration_fraction = 0.25}, 1);
  EXPECT_EQ(epsilon_at(unscheduled.config(), 0.1), 0.1);
}

TEST(QLearning, AnExponentialScheduleFromOrToZeroIsRefused) {
  EXPECT_EQ(error_of_config({.final_epsilon = 0.0, .schedule = Schedule::exponential}),
            "final_epsilon must be greater than 0 where the schedule is exponential, got 0");
  EXPECT_EQ(
      error_of_config(
          {.policy = {.epsilon = 0.0}, .final_epsilon = 0.5, .schedule = Schedule::exponential}),
      "epsilon must be greater than 0 where the schedule is exponential, got 0");
  EXPECT_EQ(error_of_config({.policy = {.epsilon = 0.0}, .schedule = Schedule::exponential}),
            "no error");
}

TEST(QLearning, RatesThatAreSetDoNotFollowProgress) {
  Agent agent(five_cells(),
              {.learning_rate = 0.5, .final_learning_rate = 0.25, .final_epsilon = 0.0}, 1);
  agent.set_learning_rate(0.75);
  EXPECT_EQ(agent.learning_rate(), 0.75);
  agent.set_progress(1.0);
  expect_rates(agent, 0.75, 0.0);
  agent.learn(cell(0), 0, 16.0, cell(1), true);
  EXPECT_EQ(agent.network().value(cell(0), 0), 0.75 * 16.0);
  agent.set_epsilon(1.0);
  agent.set_learning_rate(std::nullopt);
  expect_rates(agent, 0.25, 1.0);
  for (const double bad : {-0.1, 1.1, testing::kNaN}) {
    EXPECT_THROW(agent.set_learning_rate(bad), std::invalid_argument);
    EXPECT_THROW(agent.set_epsilon(bad), std::invalid_argument);
  }
  EXPECT_THROW(agent.set_learning_rate(0.0), std::invalid_argument);
  EXPECT_EQ(agent.epsilon(), 1.0);
}

}  // namespace
}  // namespace sdnn::agents::small_q_learning
