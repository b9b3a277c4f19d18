#include "sdnn/agents/controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "agents/one_dimension.hpp"
#include "agents/random_task.hpp"
#include "errors.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using approximators::FuzzyRulesConfig;
using approximators::LinearSDNNConfig;
using approximators::RBFNetwork;
using approximators::RBFNetworkConfig;
using approximators::SDNNCConfig;
using Numbers = std::vector<double>;

/// The observation of a pendulum: cosine and sine of its angle, speed, and a circular variable.
ObservationConfig pendulum() {
  return {.low = {-1.0, -1.0, -8.0, 10.0},
          .high = {1.0, 1.0, 8.0, 14.0},
          .angles = {3},
          .angle_pairs = {{0, 1}}};
}

// An angle of 0 is in the middle of -pi to pi; 4 is at 3/4 of -8 to 8, and 11 at 1/4 of 10 to 14.
const Numbers kPendulumObserved = {1.0, 0.0, 4.0, 11.0}, kPendulumState = {0.5, 0.75, 0.25};

/// A controller of the pendulum; actions have `n_dimensions` numbers in [-2, 2].
ControllerConfig config_with(AnyApproximatorConfig approximator, AnyLearningConfig learning,
                             std::size_t n_dimensions = 1) {
  return {.approximator = approximator,
          .learning = learning,
          .seed = 3,
          .observation = pendulum(),
          .action = {.low = Numbers(n_dimensions, -2.0), .high = Numbers(n_dimensions, 2.0)},
          .warm_up_steps = 30};
}

const RBFNetworkConfig kBases{.n_bases = 3, .n_actions = 5, .gradient_rate = 0.5};
const FuzzyQLearningConfig kTraces{.trace_decay = 0.5};

ControllerConfig rbf_config() { return config_with(kBases, QLearningConfig{.n_steps = 3}); }
ControllerConfig rbf_config_2d() { return config_with(kBases, QLearningConfig{}, 2); }
ControllerConfig sdnn_config() {
  return config_with(SDNNCConfig{.n_pattern_units = 16,
                                 .n_hidden_units = 60,
                                 .n_active_units = 40,
                                 .n_actions = 5,
                                 .averaging_interval = 5},
                     QLearningConfig{.policy = {.epsilon = 0.5, .n_greedy_steps = 0},
                                     .max_action_repeat = 4,
                                     .value_range = ValueRange::adaptive});
}
ControllerConfig fuzzy_config() { return config_with(FuzzyRulesConfig{}, kTraces); }
ControllerConfig fuzzy_config_2d() {
  return config_with(FuzzyRulesConfig{.n_sets = 4}, kTraces, 2);
}

ControllerConfig with_whole_actions(ControllerConfig config) {
  config.action.number = ActionNumber::whole;  // several indices are rounded to the same action
  return config;
}
ControllerConfig with_warm_up(ControllerConfig config) {
  config.observation.low[2] = std::nullopt;
  config.observation.angle_pairs.clear();
  config.observation.find_angle_pairs = true;
  return config;
}

Numbers action_of(Controller& controller, const Numbers& observed, std::size_t environment = 0) {
  return testing::copied(controller.act(observed, true, environment));
}

/// Acts and learns in a step of a task with random observations. With `is_saved`, a restored copy
/// replaces the controller between acting and learning.
void learn_step(Controller& controller, core::Random& random, Numbers& observed, bool is_saved) {
  const Numbers action = action_of(controller, observed);
  for (const double a : action) ASSERT_LE(std::abs(a), 2.0);
  if (is_saved) {
    controller = Controller::restored(controller.config(), core::state_of(controller));
  }
  Numbers next(4);
  const double angle = 6.0 * random.uniform();
  next[0] = std::cos(angle);
  next[1] = std::sin(angle);
  for (const std::size_t i : {2U, 3U}) next[i] = 16.0 * random.uniform() - 4.0;
  controller.learn(observed, action, random.uniform(), next, random.below(9) == 0);
  observed = next;
}

void expect_exact_resume(const ControllerConfig& config, std::size_t n_environments = 1) {
  Controller uninterrupted(config), resumed(config);
  uninterrupted.set_n_environments(n_environments);
  resumed.set_n_environments(n_environments);
  core::Random random(5, core::Stream::weights), same(5, core::Stream::weights);
  Numbers observed{1.0, 0.0, 0.0, 0.0}, resumed_observed = observed;
  for (int t = 0; t < 90; ++t) {
    learn_step(uninterrupted, random, observed, false);
    learn_step(resumed, same, resumed_observed, t % 10 == 3);
  }
  EXPECT_EQ(core::state_of(uninterrupted), core::state_of(resumed));
  EXPECT_FALSE(uninterrupted.is_warming_up());
}

// Agents of every type, each also with whole actions, with a warm-up, and with both.
TEST(Controller, ContinuesExactlyAfterItWasSavedAtAnyStep) {
  const LinearSDNNConfig linear{.n_pattern_units = 16, .n_actions = 5, .action_window = 3};
  for (const ControllerConfig& config :
       {rbf_config(), rbf_config_2d(), sdnn_config(), fuzzy_config(), fuzzy_config_2d(),
        config_with(linear, QLambdaConfig{.max_action_repeat = 5}, /*n_dimensions=*/2),
        config_with(linear, ActorCriticConfig{}, /*n_dimensions=*/2)}) {
    expect_exact_resume(config);
    expect_exact_resume(with_whole_actions(config));
    expect_exact_resume(with_warm_up(config));
    expect_exact_resume(with_warm_up(with_whole_actions(config)), /*n_environments=*/3);
  }
}

// The pendulum's four variables are three inputs; each of two dimensions of actions has a network.
// Index 0 to 4 of a dimension is an action of -2, -1, 0, 1 or 2.
TEST(Controller, ActsAndLearnsLikeItsAgent) {
  RBFNetworkConfig bases = kBases;
  bases.n_inputs = 3;
  const RBFNetwork network(bases);
  QLearning<RBFNetwork> agent({network, network}, {}, 3);
  Controller controller(rbf_config_2d());
  EXPECT_EQ(controller.n_variables(), 4U);
  EXPECT_EQ(controller.n_dimensions(), 2U);
  EXPECT_EQ(std::get<RBFNetworkConfig>(controller.approximator()), bases);
  EXPECT_TRUE(std::ranges::equal(controller.state_of(kPendulumObserved), kPendulumState));
  for (int t = 0; t < 50; ++t) {
    const auto indices = agent.act(kPendulumState);
    const Numbers action = action_of(controller, kPendulumObserved);
    ASSERT_EQ(action, (Numbers{static_cast<double>(indices[0]) - 2.0,
                               static_cast<double>(indices[1]) - 2.0}));
    const double reward = action[0] == 2.0 ? 1.0 : 0.0;
    const bool terminated = t % 5 == 4;
    agent.learn(kPendulumState, indices, reward, kPendulumState, terminated);
    controller.learn(kPendulumObserved, action, reward, kPendulumObserved, terminated);
    if (!terminated) continue;
    agent.begin_episode();
    controller.begin_episode();
  }
  EXPECT_EQ(core::state_of(std::get<QLearning<RBFNetwork>>(controller.agent())),
            core::state_of(agent));
}

// Each reader has a separate workspace and random numbers; best_of reads for the agent itself.
TEST(Controller, GivesTheSameActionsToConcurrentReadersAndBestOfThoseOfGreedyActs) {
  for (const ControllerConfig& config :
       {rbf_config(), rbf_config_2d(), sdnn_config(), fuzzy_config(), fuzzy_config_2d()}) {
    Controller controller(config);
    core::Random random(5, core::Stream::weights);
    Numbers observed{1.0, 0.0, 0.0, 0.0};
    for (int t = 0; t < 60; ++t) learn_step(controller, random, observed, false);
    const Controller& shared = controller;
    const auto best = [&](std::size_t i) -> Numbers {
      auto workspace = shared.workspace();
      core::Random ties(i % 2, core::Stream::ties), observations(7, core::Stream::weights);
      Numbers actions;
      for (int t = 0; t < 50; ++t) {
        const Numbers observation{1.0, 0.0, 16.0 * observations.uniform() - 8.0,
                                  10.0 + 4.0 * observations.uniform()};
        const auto action = shared.best_action(observation, workspace, ties);
        actions.insert(actions.end(), action.begin(), action.end());
      }
      return actions;
    };
    // Threads read first, because the first reader computes the averaged weights for all.
    std::array<Numbers, 4> read_together;
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < 4; ++i) {
      threads.emplace_back([&, i] { read_together[i] = best(i); });
    }
    for (std::thread& thread : threads) thread.join();
    const std::array alone{best(0), best(1)};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(read_together[i], alone[i % 2]);

    Controller same = controller;
    auto workspace = controller.workspace();
    core::Random observations(7, core::Stream::weights);
    for (int t = 0; t < 50; ++t) {
      const Numbers observation{1.0, 0.0, 16.0 * observations.uniform() - 8.0,
                                10.0 + 4.0 * observations.uniform()};
      controller.read(controller.prepare(observation, 0), workspace);
      EXPECT_TRUE(
          std::ranges::equal(controller.best_of(workspace, 0), same.act(observation, false)));
    }
    EXPECT_EQ(core::state_of(controller), core::state_of(same));
  }
}

TEST(Controller, WithSeveralEnvironmentsActsAndLearnsLikeItsAgent) {
  testing::OneDimension<FuzzyQLearning> agent(approximators::FuzzyRules({.n_inputs = 3}), kTraces,
                                              3);
  Controller controller(fuzzy_config());
  agent.set_n_environments(3);
  controller.set_n_environments(3);
  for (std::size_t t = 0; t < 60; ++t) {
    const std::size_t robot = t * t % 3;  // 0 for multiples of 3, else 1
    if (t % 7 == 0) {
      agent.begin_episode(robot);
      controller.begin_episode(robot);
    }
    const double picked = agent.act(kPendulumState, true, robot);
    const Numbers action = action_of(controller, kPendulumObserved, robot);
    (void)controller.act(kPendulumObserved, true, 2);  // an action in a third environment
    (void)agent.act(kPendulumState, true, 2);
    agent.learn(kPendulumState, picked, 1.0, kPendulumState, false, robot);
    controller.learn(kPendulumObserved, action, 1.0, kPendulumObserved, false, robot);
  }
  EXPECT_EQ(core::state_of(std::get<FuzzyQLearning>(controller.agent())), core::state_of(agent));
  EXPECT_THROW((void)controller.act(kPendulumObserved, true, 3), std::invalid_argument);
  EXPECT_THROW(controller.begin_episode(3), std::invalid_argument);
}

// Five actions from 0 to 2 are rounded to 0, 1, 1, 2, 2. An action of 1 that the controller has
// taken as index 1 is learned as such; otherwise as index 2, whose value is exactly 1.
TEST(Controller, LearnsTheIndexThatWasTakenOfEqualRoundedActions) {
  for (const bool is_removed : {false, true}) {  // removing the environment forgets its action
    auto config =
        config_with(kBases, QLearningConfig{.policy = {.epsilon = 1.0, .n_greedy_steps = 0}});
    config.action = {.low = {0.0}, .high = {2.0}, .number = ActionNumber::whole};
    Controller controller(config);
    controller.set_n_environments(2);
    auto agent = std::get<QLearning<RBFNetwork>>(controller.agent());
    const std::vector<std::size_t> learned = {is_removed ? 2U : 1U};
    for (std::size_t index = 0; index != 1;) {
      index = agent.act(kPendulumState, true, 1).front();
      ASSERT_EQ(controller.act(kPendulumObserved, true, 1)[0],
                std::floor(0.5 * double(index) + 0.5));
    }
    if (is_removed) {
      for (const std::size_t n : {1U, 2U}) controller.set_n_environments(n);
    }
    (void)controller.act(Numbers(4, 0.5), false, 1);  // a greedy action is not the one taken
    controller.learn(kPendulumObserved, Numbers{1.0}, 1.0, kPendulumObserved, true, 1);
    agent.learn(kPendulumState, learned, 1.0, kPendulumState, true, 1);
    const auto networks = std::get<QLearning<RBFNetwork>>(controller.agent()).networks();
    EXPECT_EQ(core::state_of(networks[0]), core::state_of(agent.networks()[0]));
  }
}

// Observations have 4 variables, actions 1 or 2 numbers in [-2, 2]; rewards are up to 1e300.
TEST(Controller, RefusesBadArgumentsAndChangesNothing) {
  const Numbers good(4, 0.5), shorter(3, 0.5), nan = {0.5, 0.5, testing::kNaN, 0.5};
  for (ControllerConfig config :
       {rbf_config(), rbf_config_2d(), fuzzy_config(), fuzzy_config_2d()}) {
    for (const bool warms_up : {false, true}) {
      Controller controller(warms_up ? with_warm_up(config) : config);
      const Numbers action = action_of(controller, good);
      const core::State before = core::state_of(controller);
      for (const Numbers& bad : {shorter, nan, Numbers{}}) {
        EXPECT_THROW((void)controller.act(bad), std::invalid_argument);
        EXPECT_THROW(controller.learn(bad, action, 1.0, good, false), std::invalid_argument);
        EXPECT_THROW(controller.learn(good, action, 1.0, bad, false), std::invalid_argument);
      }
      for (const Numbers& bad : {Numbers(action.size(), 3.0), Numbers(action.size(), testing::kNaN),
                                 Numbers(3, 0.0), Numbers{}}) {
        EXPECT_THROW(controller.learn(good, bad, 1.0, good, false), std::invalid_argument);
      }
      for (const double bad : {testing::kNaN, testing::kInfinity, 1e301}) {
        if (is_fuzzy(config.approximator) && bad == 1e301) continue;  // std::overflow_error instead
        EXPECT_THROW(controller.learn(good, action, bad, good, false), std::invalid_argument);
      }
      EXPECT_THROW(controller.set_progress(1.5), std::invalid_argument);
      EXPECT_THROW(controller.set_epsilon(-0.5), std::invalid_argument);
      EXPECT_EQ(core::state_of(controller), before);
    }
  }
}

TEST(Controller, RefusesInconsistentStates) {
  Controller controller(rbf_config());
  (void)controller.act(Numbers(4, 0.5));
  const core::State good = core::state_of(controller);
  const auto refused = [&](const core::State& bad) {
    EXPECT_THROW((void)Controller::restored(rbf_config(), bad), std::invalid_argument);
  };
  core::State more = good;
  more["stranger"] = testing::tensor_of<double>({1.0});
  refused(more);
  refused(testing::with_number(good, "progress", 1.5));
  refused(testing::with_number<std::uint8_t>(good, "is_warming_up", 2));
  // The controller has taken one of five actions in its only environment, number 0.
  refused(testing::with_number<std::int64_t>(good, "taken.indices", 5));
  refused(testing::with_number<std::int64_t>(good, "taken.indices", -1));
  refused(testing::with_number<std::int64_t>(good, "taken.environments", 1));
  refused(testing::with_number<std::uint8_t>(good, "is_warming_up", 1));  // all ranges are given
}

// Sizes of a state are compared with the settings before memory for the settings is allocated.
TEST(Controller, RefusesStatesOfWrongSizeBeforeItAllocatesMemory) {
  const auto error_of = [](const ControllerConfig& config, const core::State& state) {
    return testing::message_of([&] { (void)Controller::restored(config, state); });
  };
  ControllerConfig config = sdnn_config();
  core::State state = core::state_of(Controller(config));
  std::get<SDNNCConfig>(config.approximator).n_hidden_units = 1000000;
  EXPECT_NE(error_of(config, state).find("agent.action_value.weights"), std::string::npos);
  config = sdnn_config();
  std::get<SDNNCConfig>(config.approximator).n_interpolated = 2000000000;
  EXPECT_NE(error_of(config, state).find("n_interpolated"), std::string::npos);
  config = fuzzy_config();
  state = core::state_of(Controller(config));
  std::get<FuzzyRulesConfig>(config.approximator).n_sets = 100000;
  EXPECT_NE(error_of(config, state).find("agent.rules.values"), std::string::npos);
}

TEST(Controller, KeepsCustomPatternsForOneDimensionOfActionsOnly) {
  ControllerConfig config = sdnn_config();
  constexpr int kBins = 4, kPatternUnits = 16;
  std::vector<std::int8_t> signs;
  for (int k = 0; k < kBins * kPatternUnits; ++k) signs.push_back(k % 3 == 0 ? 1 : -1);
  const std::vector tables(  // a table of patterns for each of the pendulum's three inputs
      3, coding::PatternTable::from_signs(signs, kBins, kPatternUnits));
  const Controller controller(config, tables);
  const core::State state = core::state_of(controller);
  EXPECT_TRUE(state.contains("table.2"));  // the third table of patterns
  EXPECT_EQ(core::state_of(Controller::restored(config, state)), state);
  config.action = {.low = {0.0, 0.0}, .high = {1.0, 1.0}};  // a network for each dimension
  EXPECT_THROW(Controller(config, tables), std::invalid_argument);
}

TEST(Controller, RefusesImpossibleSettingsBeforeItsWarmUp) {
  ControllerConfig config = with_warm_up(rbf_config());
  std::get<RBFNetworkConfig>(config.approximator).n_bases = 1;  // at least 2
  EXPECT_THROW(Controller{config}, std::invalid_argument);
  config = with_warm_up(rbf_config());
  config.warm_up_steps = 1;  // at least 2
  EXPECT_THROW(Controller{config}, std::invalid_argument);
  config = rbf_config();
  config.learning = kTraces;  // settings of fuzzy Q-learning
  EXPECT_THROW(Controller{config}, std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::agents
