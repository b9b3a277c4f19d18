#include "sdnn/agents/controller.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "folders.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using approximators::Decoupled;
using approximators::FuzzyRules;
using approximators::RBFNetwork;
using nlohmann::json;
using Numbers = std::vector<double>;

// A pendulum's: cosine, sine, speed, and a circular one.
json observation() {
  return {{"low", {-1.0, -1.0, -8.0, 10.0}},
          {"high", {1.0, 1.0, 8.0, 14.0}},
          {"inputs", {{{"angle", {0, 1}}}, {{"variable", 2}}, {{"circular", 3}}}}};
}

// A number between a Discrete(2) and a Discrete(3), as Gymnasium flattens them.
json with_symbols() {
  return {{"low", {0.0, 0.0, -1.0, 0.0, 0.0, 0.0}},
          {"high", {1.0, 1.0, 1.0, 1.0, 1.0, 1.0}},
          {"inputs", {{{"symbol", {0, 2}}}, {{"variable", 2}}, {{"symbol", {3, 3}}}}}};
}

TEST(ObservationScaleOfAFile, IsAsTheFileSays) {
  const ObservationScale angles = observation_scale(observation());
  Numbers state(angles.n_inputs());
  angles(Numbers{0.0, 1.0, 4.0, 11.0}, state);
  EXPECT_EQ(state, (Numbers{0.75, 0.75, 0.25}));
  const ObservationScale symbols = observation_scale(with_symbols());
  symbols(Numbers{1.0, 0.0, 0.0, 0.0, 0.0, 1.0}, state);
  EXPECT_EQ(state, (Numbers{0.25, 0.5, 2.5 / 3.0}));
}

TEST(ObservationScaleOfAFile, NamesASymbolThatDoesNotFit) {
  for (const json& bad : {json{0, 0}, json{4, 3}, json{6, 1}, json{-1, 2}, json{0}, json{0.5, 1}}) {
    json observation = with_symbols();
    observation["inputs"][0]["symbol"] = bad;
    EXPECT_THROW((void)observation_scale(observation), std::invalid_argument) << bad;
  }
}

TEST(ObservationScaleOfAFile, NamesWhatDoesNotFit) {
  const auto error_of = [](const char* pointer, const json& value) -> std::string {
    json bad = observation();
    bad[json::json_pointer(pointer)] = value;
    try {
      (void)observation_scale(bad);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of("/low", {1.0}), "observation.high must be as long as observation.low, got 4");
  EXPECT_EQ(error_of("/high/2", -8.0),
            "observation.high[2] must be finite and greater than observation.low, got -8");
  EXPECT_EQ(error_of("/high/2", nullptr), "observation.high[2] must be a number, got null");
  EXPECT_EQ(error_of("/inputs/1/variable", 4),
            "observation.inputs[1] must be of a variable below 4, got 4");
  EXPECT_EQ(error_of("/inputs/0/angle", {0}),
            "observation.inputs[0] must be a variable, an angle of two, circular, or a symbol of "
            "some, got "
            "{\"angle\":[0]}");
  EXPECT_EQ(error_of("/inputs/2", json::object()),
            "observation.inputs[2] must be a variable, an angle of two, circular, or a symbol of "
            "some, got {}");
}

TEST(ActionScale, OfABoxCutsItsRangesEvenly) {
  const ActionScale scale(
      {{"kind", "box"}, {"low", {-2.0, 0.0}}, {"high", {2.0, 0.3}}, {"shape", {2}}}, {5, 4});
  EXPECT_EQ(scale.n_dimensions(), 2U);
  EXPECT_EQ(scale.of_index(1, 0), -1.0);
  EXPECT_EQ(scale.of_index(3, 1), 0.3);
  for (const std::size_t d : {0U, 1U}) {
    for (std::size_t a = 0; a < 4; ++a) EXPECT_EQ(scale.index_of(scale.of_index(a, d), d), a);
  }
  for (const double bad : {-3.0, 3.0, 0.5, testing::kNaN, testing::kInfinity}) {
    EXPECT_THROW((void)scale.index_of(bad, 0), std::invalid_argument);
  }
}

TEST(ActionScale, OfANumberIsThePlaceInTheRange) {
  const ActionScale scale(
      {{"kind", "box"}, {"low", {-2.0, 0.0}}, {"high", {6.0, 1.0}}, {"shape", {2}}}, {0, 0});
  EXPECT_EQ(scale.n_dimensions(), 2U);
  EXPECT_EQ(scale.of_normalized(-1.0, 0), -2.0);
  EXPECT_EQ(scale.of_normalized(-0.5, 0), 0.0);
  EXPECT_EQ(scale.of_normalized(1.0, 0), 6.0);
  EXPECT_EQ(scale.of_normalized(-0.5, 1), 0.25);
}

TEST(ActionScale, OfWholeNumbersIsTheNearest) {
  const json bytes = {{"kind", "box"}, {"low", {0}}, {"high", {255}}, {"whole", true}};
  const ActionScale scale(bytes, {5});
  for (const auto& [index, action] : {std::pair(0U, 0.0), {1U, 64.0}, {2U, 128.0}, {3U, 191.0}}) {
    EXPECT_EQ(scale.of_index(index, 0), action);
    EXPECT_EQ(scale.index_of(action, 0), index);
  }
  const ActionScale few({{"kind", "box"}, {"low", {0}}, {"high", {2}}, {"whole", true}}, {5});
  for (std::size_t a = 0; a < 5; ++a) {  // 0, 1, 1, 2, 2
    EXPECT_EQ(few.of_index(few.index_of(few.of_index(a, 0), 0), 0), few.of_index(a, 0));
  }
  const ActionScale continuous(bytes, {0});
  EXPECT_EQ(continuous.of_normalized(0.0, 0), 128.0);
  EXPECT_EQ(continuous.of_normalized(1.0, 0), 255.0);
}

TEST(ActionScale, DiscreteIsStartAndIndex) {
  const ActionScale scale({{"kind", "discrete"}, {"start", {-1, 10}}}, {3, 1});
  EXPECT_EQ(scale.of_index(2, 0), 1.0);
  EXPECT_EQ(scale.of_index(0, 1), 10.0);
  EXPECT_EQ(scale.index_of(1.0, 0), 2U);
  EXPECT_THROW((void)scale.index_of(2.0, 0), std::invalid_argument);
  EXPECT_THROW((void)scale.index_of(0.5, 0), std::invalid_argument);
  EXPECT_THROW((void)scale.index_of(11.0, 1), std::invalid_argument);
}

TEST(ActionScale, NamesWhatDoesNotFit) {
  const json box = {{"kind", "box"}, {"low", {0.0}}, {"high", {1.0}}};
  const auto error_of = [](const json& action, std::vector<std::size_t> n) -> std::string {
    try {
      const ActionScale scale(action, std::move(n));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of(box, {3}), "no error");
  EXPECT_EQ(error_of(box, {3, 3}), "action.low must be 2 numbers, got 1");
  EXPECT_EQ(error_of({{"kind", "text"}}, {3}),
            "action.kind must be \"box\" or \"discrete\", got \"text\"");
  EXPECT_EQ(error_of({{"kind", "discrete"}, {"start", {0}}}, {0}),
            "action.kind must be \"box\" or \"discrete\", got \"discrete\"");
  EXPECT_EQ(error_of({{"kind", "box"}, {"low", {2.0}}, {"high", {1.0}}}, {3}),
            "action.high must be at least action.low, got 1");
  EXPECT_EQ(error_of({{"low", {2.0}}}, {3}), "action.kind must be there");
}

template <class Agent>
AgentFile file_of(const Agent& agent) {
  AgentFile file = agent_file_of(agent, 3);
  file.settings["observation"] = observation();
  const std::size_t n = file.settings["n_actions"].size();
  file.settings["action"] = {
      {"kind", "box"}, {"low", Numbers(n, -2.0)}, {"high", Numbers(n, 2.0)}, {"shape", {n}}};
  return file;
}

QLearning<RBFNetwork> plain() {
  return {RBFNetwork({.n_inputs = 3, .n_bases = 3, .n_actions = 5, .gradient_rate = 0.5}),
          {.n_steps = 3},
          3};
}
QLearning<Decoupled<RBFNetwork>> vectors() {
  const auto part = plain().action_value();
  return {Decoupled<RBFNetwork>({part, part}), {}, 3};
}
QLearning<approximators::SDNNC> sdnn() {
  return {
      approximators::SDNNC(
          {.n_inputs = 3, .n_pattern_units = 16, .n_hidden_units = 60, .n_active_units = 40}, 3),
      {},
      3};
}
FuzzyQLearning fuzzy() { return {FuzzyRules({.n_inputs = 3}), {.trace_decay = 0.5}, 3}; }

VectorFuzzyQLearning fuzzy_vectors() {
  const FuzzyRules rules({.n_inputs = 3, .n_sets = 4});
  return VectorFuzzyQLearning({{rules, {.trace_decay = 0.5}, 3}, {rules, {.trace_decay = 0.5}, 4}});
}

/// A step of a task: what is observed wanders.
void step(Controller& controller, core::Random& random, Numbers& observed, bool is_cut,
          const std::filesystem::path& path) {
  const auto taken = controller.act(observed);
  const Numbers action(taken.begin(), taken.end());
  for (const double a : action) ASSERT_LE(std::abs(a), 2.0);
  if (is_cut) {  // another takes over, between acting and learning
    controller.write(path);
    controller = Controller(path);
  }
  Numbers next(4);
  for (double& x : next) x = 16.0 * random.uniform() - 4.0;
  controller.learn(observed, action, random.uniform(), next, random.below(9) == 0);
  observed = next;
}

template <class Agent>
void expect_that_it_goes_on(const Agent& agent, bool is_whole = false) {
  const testing::Folder folder;
  AgentFile file = file_of(agent);
  if (is_whole) file.settings["action"]["whole"] = true;
  Controller whole(file), cut(file);
  core::Random random(5, core::Stream::weights), same(5, core::Stream::weights);
  Numbers observed(4), same_observed(4);
  for (int t = 0; t < 60; ++t) {
    step(whole, random, observed, false, {});
    step(cut, same, same_observed, t % 10 == 3, folder / "agent");
  }
  whole.write(folder / "whole");
  cut.write(folder / "cut");
  EXPECT_EQ(testing::content_of(folder / "whole"), testing::content_of(folder / "cut"));
  EXPECT_NE(core::state_of(std::get<Agent>(whole.agent())), core::state_of(agent));
}

TEST(Controller, GoesOnAfterItWasSavedAnywhere) {
  expect_that_it_goes_on(plain());
  expect_that_it_goes_on(vectors());
  expect_that_it_goes_on(sdnn());
  expect_that_it_goes_on(fuzzy());
  expect_that_it_goes_on(fuzzy_vectors());
  const bool is_whole = true;  // then several actions of a network are one
  expect_that_it_goes_on(sdnn(), is_whole);
  expect_that_it_goes_on(fuzzy(), is_whole);
  expect_that_it_goes_on(fuzzy_vectors(), is_whole);
}

TEST(Controller, RefusesAnActionTakenThatIsNone) {
  AgentFile file = file_of(vectors());
  file.settings["action"]["whole"] = true;
  using Indices = std::vector<std::uint64_t>;
  for (const Indices& taken : {Indices{0}, Indices{0, 5}, Indices{0, 1, 2}}) {
    core::StateWriter writer;
    writer.numbers("taken.0", taken);
    file.tensors.insert_or_assign("taken.0", writer.state.at("taken.0"));
    EXPECT_THROW(Controller{file}, std::runtime_error);
  }
}

TEST(Controller, DoesWhatItsAgentDoes) {
  auto agent = vectors();
  Controller controller(file_of(agent));
  EXPECT_EQ(controller.n_observed(), 4U);
  EXPECT_EQ(controller.n_dimensions(), 2U);
  const Numbers observed = {1.0, 0.0, 4.0, 11.0}, state = {0.5, 0.75, 0.25};
  for (int t = 0; t < 50; ++t) {
    const auto indices = agent.act(state);
    const auto action = controller.act(observed);
    ASSERT_EQ(
        Numbers(action.begin(), action.end()),
        (Numbers{static_cast<double>(indices[0]) - 2.0, static_cast<double>(indices[1]) - 2.0}));
    const double reward = indices[0] == 4 ? 1.0 : 0.0;
    agent.learn(state, indices, reward, state, t % 5 == 4);
    controller.learn(observed, Numbers(action.begin(), action.end()), reward, observed, t % 5 == 4);
    if (t % 5 != 4) continue;
    agent.begin_episode();
    controller.begin_episode();
  }
  EXPECT_EQ(core::state_of(std::get<QLearning<Decoupled<RBFNetwork>>>(controller.agent())),
            core::state_of(agent));
}

TEST(Controller, OfSeveralRobotsDoesWhatItsAgentDoes) {
  const testing::Folder folder;
  const Numbers observed = {1.0, 0.0, 4.0, 11.0}, state = {0.5, 0.75, 0.25};
  auto agent = fuzzy();
  Controller controller(file_of(agent));
  agent.set_n_environments(3);
  controller.set_n_environments(3);
  for (std::size_t t = 0; t < 60; ++t) {
    const std::size_t robot = t * t % 3;  // 0 and 1
    if (t % 7 == 0) {
      agent.begin_episode(robot);
      controller.begin_episode(robot);
    }
    const double picked = agent.act(state, true, robot);
    const auto taken = controller.act(observed, true, robot);
    const Numbers action(taken.begin(), taken.end());
    (void)controller.act(observed, true, 2);  // another one decides meanwhile
    (void)agent.act(state, true, 2);
    agent.learn(state, picked, 1.0, state, false, robot);
    controller.learn(observed, action, 1.0, observed, false, robot);
  }
  EXPECT_EQ(core::state_of(std::get<FuzzyQLearning>(controller.agent())), core::state_of(agent));
  EXPECT_THROW((void)controller.act(observed, true, 3), std::invalid_argument);
  EXPECT_THROW(controller.begin_episode(3), std::invalid_argument);
  controller.write(folder / "agent");
  const Controller other(folder / "agent");
  EXPECT_EQ(other.n_environments(), 3U);
  EXPECT_EQ(core::state_of(std::get<FuzzyQLearning>(other.agent())), core::state_of(agent));
}

// Of 5 actions on 0, 1 and 2 the second and the third are 1; alone it is the third, the nearest.
TEST(Controller, RemembersWhichNumberAWholeActionWasWhileItsRobotIsThere) {
  const Numbers observed = {1.0, 0.0, 4.0, 11.0}, state = {0.5, 0.75, 0.25};
  const EpsilonGreedyConfig at_random = {.epsilon = 1.0, .n_greedy_steps = 0};
  for (const bool leaves : {false, true}) {
    QLearning<RBFNetwork> agent(plain().action_value(), {.policy = at_random}, 3);
    AgentFile file = file_of(agent);
    file.settings["action"] = {{"kind", "box"}, {"low", {0}}, {"high", {2}}, {"whole", true}};
    Controller controller(file);
    agent.set_n_environments(2);
    controller.set_n_environments(2);
    for (std::size_t index = 0; index != 1;) {
      index = agent.act(state, true, 1);
      ASSERT_EQ(controller.act(observed, true, 1)[0], std::floor(0.5 * double(index) + 0.5));
    }
    if (leaves) {
      for (const std::size_t n : {1U, 2U}) controller.set_n_environments(n);
    }
    controller.learn(observed, Numbers{1.0}, 1.0, observed, true, 1);
    agent.learn(state, leaves ? 2 : 1, 1.0, state, true, 1);
    EXPECT_EQ(core::state_of(std::get<QLearning<RBFNetwork>>(controller.agent()).action_value()),
              core::state_of(agent.action_value()));
  }
}

TEST(Controller, ABadArgumentChangesNothing) {
  const Numbers good(4, 0.5), shorter(3, 0.5), nan = {0.5, 0.5, testing::kNaN, 0.5};
  const auto check = [&](const auto& agent) {
    using Agent = std::remove_cvref_t<decltype(agent)>;
    Controller controller(file_of(agent));
    const auto taken = controller.act(good);
    const Numbers action(taken.begin(), taken.end());
    const core::State before = core::state_of(std::get<Agent>(controller.agent()));
    for (const Numbers& bad : {shorter, nan, Numbers{}}) {
      EXPECT_THROW((void)controller.act(bad), std::invalid_argument);
      EXPECT_THROW(controller.learn(bad, action, 1.0, good, false), std::invalid_argument);
      EXPECT_THROW(controller.learn(good, action, 1.0, bad, false), std::invalid_argument);
    }
    for (const Numbers& bad : {Numbers(action.size(), 0.123), Numbers(action.size(), testing::kNaN),
                               Numbers(3, 0.0), Numbers{}}) {
      EXPECT_THROW(controller.learn(good, bad, 1.0, good, false), std::invalid_argument);
    }
    EXPECT_THROW(controller.learn(good, action, testing::kNaN, good, false), std::invalid_argument);
    EXPECT_EQ(core::state_of(std::get<Agent>(controller.agent())), before);
  };
  check(plain());
  check(vectors());
  check(fuzzy());
  check(fuzzy_vectors());
}

core::State agent_part(const AgentFile& file) {
  core::State part;
  for (const auto& [name, tensor] : file.tensors) {
    if (name.starts_with("agent.")) part.emplace(name, tensor);
  }
  return part;
}

// Files of tests/python/reference/agent_files.py: agents that were born and lived in Python, what
// they did next, and what they had learned then.
TEST(Controller, LivesAsInPython) {
  const testing::Folder folder;
  for (const std::string name : {"sdnn", "sdnn-vector", "sdnn-discrete", "sdnn-symbols",
                                 "sdnn-pairs", "rbf", "fuzzy", "fuzzy-vector"}) {
    SCOPED_TRACE(name);
    const std::filesystem::path data(SDNN_TEST_DATA "/agents");
    std::ifstream file(data / (name + ".json"));
    const json steps = json::parse(file);
    Controller controller(data / (name + ".safetensors"));
    const auto numbers = [](std::span<const double> values) {
      return Numbers(values.begin(), values.end());
    };
    for (const json& step : steps) {
      if (step["begins"].get<bool>()) controller.begin_episode();
      const auto seen = step["observation"].get<Numbers>();
      const auto action = step["action"].get<Numbers>();
      ASSERT_EQ(numbers(controller.act(seen)), action);
      ASSERT_EQ(numbers(controller.act(seen, false)), step["greedy"].get<Numbers>());
      controller.learn(seen, action, step["reward"].get<double>(),
                       step["next_observation"].get<Numbers>(), step["terminated"].get<bool>());
    }
    EXPECT_EQ(steps.size(), 40U);
    controller.write(folder / name);
    const AgentFile written = read_agent_file(folder / name);
    const AgentFile expected = read_agent_file(data / (name + "-after.safetensors"));
    EXPECT_EQ(agent_part(written), agent_part(expected));
    EXPECT_EQ(written.settings.contains("scaling"), name == "fuzzy");  // as a run with noise leaves
    EXPECT_EQ(written.settings.value("scaling", json()),
              expected.settings.value("scaling", json()));
  }
}

TEST(Controller, SaysWhatItsFileLacks) {
  const testing::Folder folder;
  const auto path = folder / "agent";
  const auto error_of = [&path](const AgentFile& file) {
    write_agent_file(path, file);
    const std::string error =
        testing::runtime_error_of([&path] { const Controller controller(path); });
    EXPECT_EQ(error.rfind(path.string() + ": ", 0), 0U) << error;
    return error.substr(path.string().size() + 2);
  };
  EXPECT_EQ(error_of(agent_file_of(plain(), 3)), "sdnn.observation must be there");
  AgentFile file = file_of(plain());
  file.settings.erase("action");
  EXPECT_EQ(error_of(file), "sdnn.action must be there");
  file = file_of(plain());
  file.settings["observation"]["inputs"].erase(1);
  EXPECT_EQ(error_of(file), "observation.inputs must be 3, as the agent's, got 2");
  EXPECT_EQ(testing::runtime_error_of([] { const Controller controller(AgentFile{}); }),
            "sdnn.seed must be there");
}

}  // namespace
}  // namespace sdnn::agents
