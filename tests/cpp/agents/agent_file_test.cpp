#include "sdnn/agents/agent_file.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "agents/random_task.hpp"
#include "folders.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using nlohmann::json;
using Numbers = std::vector<double>;

constexpr std::uint64_t kSeed = 18446744073709551615U;  // the largest seed, 2^64 - 1

ControllerConfig small_sdnn_config() {
  return {.approximator = approximators::SDNNCConfig{.n_pattern_units = 16,
                                                     .n_anchor_patterns = 3,
                                                     .n_interpolated = 3,
                                                     .circular = {false, true},
                                                     .n_symbols = {4, 0},
                                                     .n_hidden_units = 60,
                                                     .n_active_units = 40,
                                                     .n_actions = 5,
                                                     .u_high = 36,
                                                     .rounding = approximators::Rounding::random},
          .learning = QLearningConfig{.max_action_repeat = 3},
          .seed = kSeed,
          .observation = {.low = {0.0, {}}, .high = {1.0, {}}, .adaptive = true},
          .action = {.low = {-1.0}, .high = {1.0}, .number = ActionNumber::float32},
          .warm_up_steps = 20};
}

ControllerConfig small_fuzzy_config() {
  ControllerConfig config = small_sdnn_config();
  config.approximator = approximators::FuzzyRulesConfig{.n_sets = 4, .n_actions = 5};
  config.learning = FuzzyQLearningConfig{.trace_decay = 0.8};
  return config;
}

ControllerConfig small_rbf_config() {
  ControllerConfig config = small_sdnn_config();
  config.approximator = approximators::RBFNetworkConfig{.n_bases = 3, .n_actions = 7};
  return config;
}

/// Takes steps with observations that repeat with periods of 10 and 7 steps.
void act_and_learn_periodically(Controller& controller, int n_steps) {
  for (int t = 0; t < n_steps; ++t) {
    const Numbers observed{0.1 * (t % 10), 1.0 * (t % 7)}, next{0.1 * ((t + 1) % 10), 1.0};
    const Numbers action = testing::copied(controller.act(observed));
    const double dt = t % 4 == 3 ? 2.5 : 1.0;
    controller.learn(observed, action, 1.0 * (t % 3), next, t % 13 == 12, 0, {}, dt);
  }
}

TEST(AgentFile, AReadControllerContinuesLikeTheWrittenOne) {
  const testing::Folder folder;
  for (const ControllerConfig& config :
       {small_sdnn_config(), small_rbf_config(), small_fuzzy_config()}) {
    for (const int n_steps : {10, 50}) {  // within the warm-up and after it
      AgentFile file{Controller(config)};
      act_and_learn_periodically(file.controller, n_steps);
      file.write(folder / "agent");
      AgentFile read_agent(folder / "agent");
      read_agent.write(folder / "read_agent");
      EXPECT_EQ(testing::content_of(folder / "agent"), testing::content_of(folder / "read_agent"));
      act_and_learn_periodically(file.controller, 40);
      act_and_learn_periodically(read_agent.controller, 40);
      EXPECT_EQ(core::state_of(file.controller), core::state_of(read_agent.controller));
    }
  }
}

TEST(AgentFile, SettingsAreWrittenWithTheirNamesAndValues) {
  const json description = AgentFile{Controller(small_sdnn_config())}.description();
  EXPECT_EQ(description["class"], "SDNNQLearning");
  EXPECT_EQ(description["kind"], "sdnn-c");
  EXPECT_EQ(description["seed"], kSeed);
  const json& approximator = description["approximator"];
  EXPECT_EQ(approximator["n_hidden_units"], 60);
  EXPECT_EQ(approximator["circular"], json({false, true}));
  EXPECT_EQ(approximator["n_symbols"], json({4, 0}));
  EXPECT_EQ(approximator["u_low"], nullptr);
  EXPECT_EQ(approximator["u_high"], 36);
  EXPECT_EQ(approximator["rounding"], "random");
  EXPECT_EQ(description["learning"]["tie_rule"], "uniform");
  EXPECT_EQ(description["learning"]["learning_rate"], 0.5);
  EXPECT_EQ(description["observation"]["low"], json({0.0, nullptr}));
  EXPECT_EQ(description["observation"]["adaptive"], true);
  EXPECT_EQ(description["action"]["number"], "float32");
  const auto config = detail::controller_config_in(description);
  EXPECT_EQ(config.approximator, small_sdnn_config().approximator);
  EXPECT_EQ(config.learning, small_sdnn_config().learning);
  EXPECT_EQ(config.observation, small_sdnn_config().observation);
  EXPECT_EQ(config.action, small_sdnn_config().action);
}

// A training's file holds data that C++ does not use; it is not lost when the agent is written.
TEST(AgentFile, DataOfATrainingIsKeptWhenAnAgentIsWrittenAgain) {
  const testing::Folder folder;
  AgentFile{Controller(small_rbf_config())}.write(folder / "agent");
  core::FileContent content = core::read_file(folder / "agent", {"agent"});
  content.kind = "training";
  content.description["training"] = {{"note", "für später"}};
  content.description["class"] = "MyAgent";
  content.tensors["training.actions"] = testing::tensor_of<double>({-1.5});
  core::write_file(folder / "training", content);
  AgentFile file(folder / "training");
  act_and_learn_periodically(file.controller, 30);
  file.write(folder / "later");
  const core::FileContent later = core::read_file(folder / "later", {"training"});
  EXPECT_EQ(later.description, content.description);
  EXPECT_EQ(later.tensors.at("training.actions"), content.tensors.at("training.actions"));
  EXPECT_TRUE(later.tensors.contains("agent.action_value.weights"));
}

TEST(AgentFile, RefusesInvalidFieldsByName) {
  const testing::Folder folder;
  const auto path = folder / "agent";
  AgentFile trained{Controller(small_sdnn_config())};
  act_and_learn_periodically(trained.controller, 30);
  trained.write(path);
  const core::FileContent good = core::read_file(path, {"agent"});
  const auto error_of = [&](const core::FileContent& content) {
    core::write_file(path, content);
    const std::string error = testing::runtime_error_of([&] { const AgentFile file(path); });
    EXPECT_EQ(error.rfind(path.string() + ": ", 0), 0U) << error;
    return error.substr(path.string().size() + 2);
  };
  const auto error_with = [&](const char* pointer, const json& value) {
    core::FileContent content = good;
    content.description[json::json_pointer(pointer)] = value;
    return error_of(content);
  };
  EXPECT_EQ(error_with("/kind", "sarsa"),
            "kind must be one of sdnn-c rbf fuzzy q-lambda actor-critic, got \"sarsa\"");
  EXPECT_EQ(error_with("/seed", -1), "seed must be a whole number of 0 or more, got -1");
  EXPECT_EQ(error_with("/approximator", 3), "approximator must be an object, got 3");
  EXPECT_EQ(error_with("/approximator/n_scales", 3)
                .rfind("fields of approximator must be one of n_inputs ", 0),
            0U);
  EXPECT_EQ(error_with("/approximator/n_inputs", 2.5),
            "approximator.n_inputs must be a whole number, got 2.5");
  EXPECT_EQ(error_with("/approximator/n_inputs", 4294967298),  // 2^32 + 2 is no int
            "approximator.n_inputs must be a whole number, got 4294967298");
  EXPECT_EQ(error_with("/approximator/q_low", "low"),
            "approximator.q_low must be a number, got \"low\"");
  EXPECT_EQ(error_with("/approximator/circular", {1, 0}),
            "approximator.circular[0] must be true or false, got 1");
  EXPECT_EQ(error_with("/approximator/rounding", "up"),
            "approximator.rounding must be one of half_up random away, got \"up\"");
  EXPECT_EQ(error_with("/learning/epsilon", nullptr),
            "learning.epsilon must be a number, got null");
  EXPECT_EQ(error_with("/learning/discount", 1.5), "discount must be in [0, 1], got 1.5");
  EXPECT_EQ(error_with("/observation/angle_pairs", {{0, "x"}}),
            "observation.angle_pairs[0][1] must be a whole number, got \"x\"");
  EXPECT_EQ(error_with("/observation/low", {0.0, "x"}),
            "observation.low[1] must be a number, got \"x\"");
  EXPECT_EQ(error_with("/action/number", 3),
            "action.number must be one of float64 float32 float16 whole, got 3");
  core::FileContent content = good;
  content.description.erase("seed");
  EXPECT_EQ(error_of(content), "description.seed must be there");
  content = good;
  content.tensors.erase("progress");
  EXPECT_EQ(error_of(content), "state: progress must be there");
  core::write_file(path, {"estimator", json::object(), {}});
  EXPECT_EQ(testing::runtime_error_of([&path] { const AgentFile file(path); }),
            path.string() + ": is a file of kind 'estimator', expected agent or training");
}

// Files of tests/python/reference/agent_files.py: agents that were made and trained in Python, what
// they did next, and what they had learned then.
TEST(AgentFile, AgentsFromPythonActAndLearnWithTheSameBits) {
  const testing::Folder folder;
  for (const std::string name :
       {"sdnn", "sdnn-vector", "sdnn-discrete", "sdnn-symbols", "sdnn-pairs", "sdnn-warm-up",
        "q-lambda", "q-lambda-vector", "rbf", "fuzzy", "fuzzy-vector"}) {
    SCOPED_TRACE(name);
    const std::filesystem::path data(SDNN_TEST_DATA "/agents");
    std::ifstream recorded_steps(data / (name + ".json"));
    const json steps = json::parse(recorded_steps);
    AgentFile file(data / (name + ".safetensors"));
    Controller& controller = file.controller;
    for (const json& step : steps) {
      if (step["begins"].get<bool>()) controller.begin_episode();
      const auto observation = step["observation"].get<Numbers>();
      const auto action = step["action"].get<Numbers>();
      ASSERT_EQ(testing::copied(controller.act(observation)), action);
      ASSERT_EQ(testing::copied(controller.act(observation, false)), step["greedy"].get<Numbers>());
      controller.learn(observation, action, step["reward"].get<double>(),
                       step["next_observation"].get<Numbers>(), step["terminated"].get<bool>());
    }
    EXPECT_EQ(steps.size(), 40U);
    file.write(folder / name);
    EXPECT_EQ(testing::content_of(folder / name),
              testing::content_of(data / (name + "-after.safetensors")));
  }
}

}  // namespace
}  // namespace sdnn::agents
