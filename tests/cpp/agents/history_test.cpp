#include "sdnn/agents/history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "allocation_count.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/detail/least_squares.hpp"
#include "sdnn/agents/detail/steady_gains.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents {
namespace {

using Numbers = std::vector<double>;

/// A mass on a line with springs, pushed by random actions that last: inputs are the position and
/// the velocity with noise. `exact` are the inputs without noise.
struct Mass {
  RandomExperience experience;
  Numbers exact = {};
};
Mass pushed_mass(std::size_t n, double noise, std::uint64_t seed) {
  core::Random random(seed, core::Stream::sensor_noise);
  Mass mass{{.n_inputs = 2, .circular = std::vector<bool>(2)}};
  mass.experience.actions.resize(1);
  double position = 0.1, velocity = 0.0, action = 0.0;
  const auto inputs = [&] { return Numbers{0.5 + position, 0.5 + 3.0 * velocity}; };
  const auto sensed = [&](Numbers values) {
    for (double& x : values) x = std::clamp(x + noise * random.normal(), 0.0, 1.0);
    return values;
  };
  const auto append = [](Numbers& rows, const Numbers& row) {
    rows.insert(rows.end(), row.begin(), row.end());
  };
  Numbers last = sensed(inputs());
  for (std::size_t t = 0; t < n; ++t) {
    append(mass.experience.states, last);
    if (random.below(5) == 0) action = static_cast<double>(random.below(3)) - 1.0;
    velocity += 0.01 * action - 0.1 * position - 0.05 * velocity;
    position += velocity;
    last = sensed(inputs());
    append(mass.experience.next_states, last);
    append(mass.exact, inputs());
    mass.experience.actions[0].push_back(action);
    mass.experience.rewards.push_back(0.0);
    mass.experience.ends.push_back(false);
  }
  return mass;
}

// Two targets depend on the features 1, a and b; weights are feature by feature.
TEST(LeastSquares, FindsTheWeightsOfLinearTargets) {
  Numbers features, targets;
  for (int t = 0; t < 20; ++t) {
    const double a = 0.1 * t, b = t % 3;
    features.insert(features.end(), {1.0, a, b});
    targets.insert(targets.end(), {2.0 + 3.0 * a - b, 5.0 * b});
  }
  const Numbers weights = detail::least_squares(features, targets, 20);
  const Numbers expected{2.0, 0.0, 3.0, 0.0, -1.0, 5.0};
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(weights[k], expected[k], 1e-4);
}

TEST(History, NoneDoesNotChangeStates) {
  const HistoryFilter none(2);
  EXPECT_TRUE(none.is_none());
  HistoryFilter::Memory memory;
  HistoryFilter::Room room;
  Numbers state(2);
  none.begin(Numbers{0.25, 0.75}, memory, state, room);
  EXPECT_EQ(state, (Numbers{0.25, 0.75}));
  EXPECT_TRUE(memory.empty());
}

// The experience: a number changes by 0.2, an angle by 0.1 (the shorter way), and a symbol.
TEST(History, DifferencesOfNumbersAndAnglesAreAppendedAsWorkedByHand) {
  const RandomExperience experience{.n_inputs = 3,
                                    .states = {0.5, 0.95, 0.25},
                                    .next_states = {0.7, 0.05, 0.75},
                                    .circular = {false, true, false},
                                    .rewards = {0.0},
                                    .ends = {false},
                                    .actions = {{0.0}}};
  const HistoryFilter filter(History::differences, experience, {0, 0, 2}, 1);
  EXPECT_EQ(filter.n_inputs(), 5);
  EXPECT_EQ(filter.circular(), (std::vector<bool>{false, true, false, false, false}));
  EXPECT_EQ(filter.n_symbols(), (std::vector<int>{0, 0, 2, 0, 0}));
  HistoryFilter::Memory memory;
  HistoryFilter::Room room;
  Numbers state(5);
  filter.begin(Numbers{0.4, 0.98, 0.25}, memory, state, room);
  EXPECT_EQ(state, (Numbers{0.4, 0.98, 0.25, 0.5, 0.5}));
  filter.follow(Numbers{0.0}, Numbers{0.55, 0.01, 0.75}, memory, state, room);
  // Differences are scaled by one and a half times those of the experience: 0.3 and 0.15.
  EXPECT_DOUBLE_EQ(state[3], 0.5 + 0.15 / 0.3 / 2.0);
  EXPECT_NEAR(state[4], 0.5 + 0.03 / 0.15 / 2.0, 1e-12);
  filter.follow(Numbers{0.0}, Numbers{0.0, 0.01, 0.75}, memory, state, room);
  EXPECT_DOUBLE_EQ(state[3], 0.0);  // -0.55 is clipped to -0.3
}

TEST(History, AveragesMoveByAHalfAndAFifthOfTheDistance) {
  const RandomExperience experience{.n_inputs = 2, .circular = {false, true}};
  const HistoryFilter filter(History::averages, experience, {0, 0}, 1);
  EXPECT_EQ(filter.circular(), (std::vector<bool>{false, true, false, true, false, true}));
  HistoryFilter::Memory memory;
  HistoryFilter::Room room;
  Numbers state(6);
  filter.begin(Numbers{0.2, 0.9}, memory, state, room);
  filter.follow(Numbers{0.0}, Numbers{0.6, 0.1}, memory, state, room);
  // From 0.2 to 0.6, and from 0.9 to 1.1, which is 0.1 on the circle.
  const Numbers expected{0.6, 0.1, 0.2 + 0.4 / 2, 0.0, 0.2 + 0.4 / 5, 0.9 + 0.2 / 5};
  for (std::size_t k = 0; k < 6; ++k) {
    const double distance = std::abs(state[k] - expected[k]);
    EXPECT_LT(std::min(distance, 1.0 - distance), 1e-12) << k;
  }
}

TEST(History, SteadyGainsSolveTheRiccatiEquation) {
  // For a constant number with noise of variance r, the predicted variance p r solves
  // p = p - p^2 / (p + 1) + drift, hence p^2 - drift p - drift = 0. The gain is p / (p + 1).
  // Arguments are the linear model of the next state, the noise of each sensor, and the drift.
  const double drift = 0.3, p = (drift + std::sqrt(drift * drift + 4.0 * drift)) / 2.0;
  EXPECT_NEAR(detail::steady_gains({1.0}, {2.0}, drift)[0], p / (p + 1.0), 1e-12);
  // For two variables, SciPy's solve_discrete_are gave the numbers.
  const Numbers gains = detail::steady_gains({1.0, 0.2, 0.0, 0.9}, {1.0, 2.0}, 0.1);
  const Numbers solved{0.31048834, 0.03958821, 0.07917642, 0.20620367};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(gains[k], solved[k], 1e-8) << k;
}

TEST(History, AnObserverReducesTheErrorOfNoisySensors) {
  constexpr std::size_t kSteps = 1000;
  const Mass learned = pushed_mass(kSteps, 0.05, 1), fresh = pushed_mass(kSteps, 0.05, 2);
  const HistoryFilter filter(History::observer, learned.experience, {0, 0}, 1);
  EXPECT_LT(filter.gain(), 1.0);  // it does not trust the sensors alone
  HistoryFilter::Memory memory;
  HistoryFilter::Room room;
  Numbers state(2);
  const auto row = [](const Numbers& rows, std::size_t t) {
    return std::span(rows).subspan(2 * t, 2);
  };
  double error_of_estimates = 0.0, error_of_sensors = 0.0;  // sums of squares
  filter.begin(row(fresh.experience.states, 0), memory, state, room);
  for (std::size_t t = 0; t < kSteps; ++t) {
    const auto sensed = row(fresh.experience.next_states, t), exact = row(fresh.exact, t);
    filter.follow(Numbers{fresh.experience.actions[0][t]}, sensed, memory, state, room);
    for (std::size_t i = 0; i < 2; ++i) {
      error_of_estimates += (state[i] - exact[i]) * (state[i] - exact[i]);
      error_of_sensors += (sensed[i] - exact[i]) * (sensed[i] - exact[i]);
    }
  }
  EXPECT_LT(error_of_estimates, 0.6 * error_of_sensors);  // 0.37 here, 1 without a filter
}

/// An agent that pushes the mass; each action lasts a step.
ControllerConfig config_of(History history, bool is_running = false) {
  return {.approximator = approximators::LinearSDNNConfig{.n_actions = 3},
          .learning = QLambdaConfig{},
          .seed = 3,
          .observation = {.low = {0.0, 0.0},
                          .high = {1.0, 1.0},
                          .running = is_running,
                          .history = history},
          .action = {.low = {0.0}, .high = {2.0}, .discrete = true},
          .warm_up_steps = 200};
}

/// Lets the agent act and learn for some steps in noisy observations; returns its actions.
Numbers actions_of(Controller& controller, core::Random& random, int n_steps) {
  Numbers actions, observation{0.5, 0.5};
  controller.begin_episode();
  for (int t = 0; t < n_steps; ++t) {
    if (t % 7 == 3) actions.push_back(controller.act(observation, false)[0]);
    const Numbers action{controller.act(observation)[0]};
    Numbers next = observation;
    for (double& x : next) x = std::clamp(x + 0.1 * random.normal() + 0.02 * action[0], 0.0, 1.0);
    const bool ends = random.below(40) == 0;
    controller.learn(observation, action, -std::abs(next[0] - 0.5), next, ends);
    observation = next;
    if (ends) controller.begin_episode();
    actions.push_back(action[0]);
  }
  return actions;
}

TEST(History, ContinuesExactlyAfterItWasSavedAtAnyStep) {
  for (const History history :
       {History::differences, History::averages, History::observer, History::automatic}) {
    for (const bool is_running : {false, true}) {
      const ControllerConfig config = config_of(history, is_running);
      Controller uninterrupted(config);
      core::Random random(5, core::Stream::weights);
      for (int n_saved = 0; n_saved < 8; ++n_saved) {  // during the warm-up and after it
        (void)actions_of(uninterrupted, random, 50 + n_saved);
        Controller restored = Controller::restored(config, core::state_of(uninterrupted));
        ASSERT_EQ(core::state_of(restored), core::state_of(uninterrupted));
        core::Random same = random;
        ASSERT_EQ(actions_of(restored, same, 30), actions_of(uninterrupted, random, 30));
        ASSERT_EQ(core::state_of(restored), core::state_of(uninterrupted));
      }
    }
  }
}

// An array of the history without its last element is refused, and so is `n_levels` doubled.
TEST(History, RefusesInconsistentStates) {
  const ControllerConfig config = config_of(History::observer);
  Controller controller(config);
  core::Random random(5, core::Stream::weights);
  (void)actions_of(controller, random, 250);
  const core::State state = core::state_of(controller);
  ASSERT_NO_THROW((void)Controller::restored(config, state));
  for (const auto& [name, tensor] : state) {
    if (!name.starts_with("history.") && !name.starts_with("last_states.")) continue;
    core::State shorter = state;
    core::Tensor& array = shorter.at(name);
    if (array.shape.size() != 1 || array.shape[0] == 0) continue;
    array.bytes.resize(array.bytes.size() / array.shape[0] * (array.shape[0] - 1));
    --array.shape[0];
    EXPECT_THROW((void)Controller::restored(config, shorter), std::invalid_argument) << name;
  }
  core::State more = state;
  core::Tensor& levels = more.at("history.observer.n_levels");
  levels.bytes.insert(levels.bytes.end(), levels.bytes.begin(), levels.bytes.end());
  levels.shape[0] *= 2;
  EXPECT_THROW((void)Controller::restored(config, more), std::invalid_argument);
}

// The learner receives the observations, actions and rewards of the actor.
TEST(History, LearningWithoutActingGivesTheSameWeights) {
  Controller actor(config_of(History::differences)), learner(config_of(History::differences));
  core::Random random(5, core::Stream::weights);
  Numbers observation{0.5, 0.5};
  actor.begin_episode();
  learner.begin_episode();
  for (int t = 0; t < 600; ++t) {
    const Numbers action{actor.act(observation)[0]}, next{random.uniform(), random.uniform()};
    for (Controller* const agent : {&actor, &learner}) {
      agent->learn(observation, action, next[0], next, false);
    }
    observation = next;
  }
  const auto weights = [](const Controller& agent) {
    return core::state_of(std::get<QLambda>(agent.agent())).at("action_value.weights");
  };
  EXPECT_EQ(weights(actor), weights(learner));
}

// With differences, inputs 2 and 3 of a state are the last changes, where 0.5 stands for none.
TEST(History, GreedyEpisodesHaveASeparateMemory) {
  Controller controller(config_of(History::differences));
  core::Random random(5, core::Stream::weights);
  (void)actions_of(controller, random, 300);
  Controller same = controller;
  controller.begin_greedy_episode();
  (void)controller.act(Numbers{0.1, 0.9}, false);
  (void)controller.act(Numbers{0.3, 0.9}, false);
  const Numbers state(controller.state_of(Numbers{0.5, 0.9}).begin(),
                      controller.state_of(Numbers{0.5, 0.9}).end());
  EXPECT_GT(state[2], 0.5);  // input 0 has risen from 0.3 to 0.5
  EXPECT_EQ(state[3], 0.5);  // input 1 has not changed
  core::Random same_random = random;
  EXPECT_EQ(actions_of(controller, random, 50), actions_of(same, same_random, 50));
}

TEST(History, AStepAllocatesNothing) {
  for (const History history : {History::differences, History::averages, History::observer}) {
    Controller controller(config_of(history));
    core::Random random(5, core::Stream::weights);
    (void)actions_of(controller, random, 400);
    const Numbers first{0.3, 0.6}, second{0.4, 0.5};
    const auto step = [&](const Numbers& observation, const Numbers& next) {
      (void)controller.act(observation, false);
      const double action = controller.act(observation)[0];
      controller.learn(observation, {&action, 1}, 1.0, next, false);
    };
    step(first, second);
    step(second, first);
    const std::size_t before = testing::allocation_count();
    for (int t = 0; t < 20; ++t) {
      step(first, second);
      step(second, first);
    }
    EXPECT_EQ(testing::allocation_count(), before) << static_cast<int>(history);
  }
}

// Its approximator needs two inputs; without a history the single one would be repeated, as it is
// with an observer, which adds none. Differences add one input, averages two.
TEST(History, ASingleInputIsNotRepeatedBesideInputsOfAHistory) {
  for (const auto& [history, n_inputs] :
       {std::pair{History::differences, 2U}, {History::averages, 3U}, {History::observer, 2U}}) {
    ControllerConfig config = config_of(history);
    config.observation.low = {0.0};
    config.observation.high = {1.0};
    Controller controller(config);
    core::Random random(5, core::Stream::weights);
    controller.begin_episode();
    for (int t = 0; t < 250; ++t) {
      const double observation = random.uniform(), next = random.uniform();
      const double action = controller.act({&observation, 1})[0];
      controller.learn({&observation, 1}, {&action, 1}, next, {&next, 1}, false);
    }
    EXPECT_EQ(controller.history().n_inputs(), n_inputs);
    const Controller same = Controller::restored(config, core::state_of(controller));
    EXPECT_EQ(same.history().n_inputs(), n_inputs);
    EXPECT_EQ(core::state_of(same), core::state_of(controller));
  }
}

ControllerConfig grid_config(History history) {
  ControllerConfig config = config_of(history);
  config.approximator =
      approximators::FuzzyRulesConfig{.n_sets = 8, .n_actions = 3, .max_table_bytes = 1 << 14};
  config.learning = FuzzyQLearningConfig{};
  config.action = {.low = {0.0}, .high = {2.0}};
  return config;
}

// A grid of 8^2 fuzzy rules with 3 values of 4 bytes needs 768 of at most 16,384 bytes, one of 8^4
// rules, with the differences of both inputs, 49,152.
TEST(History, DifferencesThatMakeAGridTooLargeAreRefusedAndNotSelectedAutomatically) {
  EXPECT_THROW(Controller(grid_config(History::differences)), std::length_error);
  ControllerConfig config = grid_config(History::automatic);
  config.observation.adaptive = true;  // has a warm-up
  Controller controller(config);
  core::Random random(5, core::Stream::weights);
  Numbers observation{0.5, 0.5}, velocity{0.0, 0.0};
  controller.begin_episode();
  for (int t = 0; t < 250; ++t) {  // hidden velocities, for which differences would be selected
    const double action = controller.act(observation)[0];
    Numbers next = observation;
    for (std::size_t i = 0; i < 2; ++i) {
      velocity[i] += 0.01 * (action - 1.0) - 0.1 * (observation[i] - 0.5) - 0.05 * velocity[i];
      next[i] = std::clamp(observation[i] + velocity[i], 0.0, 1.0);
    }
    controller.learn(observation, {&action, 1}, 0.0, next, false);
    observation = next;
  }
  EXPECT_FALSE(controller.is_warming_up());
  EXPECT_EQ(controller.history().kind(), History::none);
  EXPECT_NO_THROW((void)Controller::restored(config, core::state_of(controller)));
}

TEST(History, AnAutomaticHistoryBeginsNoWarmUp) {
  const Controller controller(config_of(History::automatic));
  EXPECT_FALSE(controller.is_warming_up());
  EXPECT_EQ(controller.history().kind(), History::none);
  EXPECT_TRUE(Controller(config_of(History::observer)).is_warming_up());
  EXPECT_NO_THROW(
      (void)Controller::restored(config_of(History::automatic), core::state_of(controller)));
}

TEST(History, SizesThatAHistoryMakesImpossibleAreRefusedAtOnce) {
  ControllerConfig config = config_of(History::differences);
  config.approximator = approximators::LinearSDNNConfig{.n_pattern_units = 2, .n_actions = 3};
  // Custom patterns for the two readings leave the two differences without patterns.
  const std::vector<std::int8_t> signs{1, 1, -1, 1, -1, -1};
  const std::vector tables(2, coding::PatternTable::from_signs(signs, /*n_bins=*/3, /*n_units=*/2));
  EXPECT_THROW(Controller(config, tables), std::invalid_argument);
  config.observation.history = History::automatic;
  EXPECT_NO_THROW(Controller(config, tables));
  config.observation.history = History::observer;
  config.warm_up_steps = 99;  // an observer needs 100 transitions
  EXPECT_THROW(Controller{config}, std::invalid_argument);
  config.warm_up_steps = 100;
  EXPECT_NO_THROW(Controller{config});
  config.observation.low.assign(17, 0.0);  // an observer has at most 16 inputs
  config.observation.high.assign(17, 1.0);
  EXPECT_THROW(Controller{config}, std::invalid_argument);
  config.observation.relevant_only = true;  // some may be left out
  EXPECT_NO_THROW(Controller{config});
}

}  // namespace
}  // namespace sdnn::agents
