#include "sdnn/agents/compiled_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "agents/random_task.hpp"
#include "errors.hpp"
#include "folders.hpp"
#include "sdnn/agents/actions.hpp"
#include "sdnn/agents/agent_file.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/controller_config.hpp"
#include "sdnn/agents/observation_config.hpp"
#include "sdnn/agents/presets.hpp"
#include "sdnn/agents/q_lambda_config.hpp"

namespace sdnn::agents {
namespace {

using Vector = std::vector<double>;

constexpr double kUnknown = std::numeric_limits<double>::infinity();

const Box kBounds{.low = {-1.0, -kUnknown}, .high = {1.0, kUnknown}};

/// Small agents of every type, with every type of actions.
std::vector<AgentSpec> specs_of_every_agent() {
  std::vector<AgentSpec> all;
  for (const char* const agent : {"q-lambda", "actor-critic", "sdnn-c", "rbf", "fuzzy"}) {
    AgentSpec spec{.agent = agent,
                   .observation = kBounds,
                   .action = Box{.low = {-2.0}, .high = {2.0}},
                   .seed = std::numeric_limits<std::uint64_t>::max(),
                   .settings = {{"warm_up_steps", 20}, {"learning.discount", 0.5}}};
    if (spec.agent == "sdnn-c") spec.preset = "small";
    if (spec.agent == "rbf") spec.settings["approximator.n_bases"] = 4;
    all.push_back(spec);
    if (spec.agent == "fuzzy") continue;  // fuzzy agents have no discrete actions
    spec.action = Discrete{.n = 3, .start = -1};
    all.push_back(spec);
    spec.action = MultiDiscrete{.n = {3, 2}};
    all.push_back(spec);
  }
  return all;
}

/// Acts and learns in two environments with observations of two variables. They repeat with periods
/// of 10 and 7 steps, and depend on no action.
template <class Agent>
void act_and_learn_in_two_environments(Agent& agent, int n_steps) {
  agent.set_n_environments(2);
  for (int t = 0; t < n_steps; ++t) {
    const auto environment = static_cast<std::size_t>(t % 3 == 2);
    if (t % 17 < 3) agent.begin_episode(environment);
    const Vector observed{0.1 * (t % 10), 1.0 * (t % 7)}, next{0.1 * ((t + 1) % 10), 1.0};
    const Vector action = testing::copied(agent.act(observed, true, environment));
    agent.learn(observed, action, 1.0 * (t % 3) - action[0], next, t % 13 == 12, environment, {},
                t % 4 == 3 ? 2.5 : 1.0);
  }
}

/// The error of a changed specification of the default agent.
template <class Error = std::invalid_argument, class Change>
std::string error_with(const Change& change) {
  AgentSpec spec{.observation = kBounds, .action = Discrete{.n = 2}};
  change(spec);
  return testing::message_of<Error>([&] { const CompiledController agent(spec); });
}
std::string error_of_setting(const std::string& name, const SettingValue& value) {
  return error_with([&](AgentSpec& spec) { spec.settings[name] = value; });
}

// A compiled agent of the default preset with four settings equals a controller made of them. The
// preset is made for 4 inputs, a number that the controller replaces by that of the observation.
TEST(CompiledController, MakesLearnsAndWritesTheBitsOfTheController) {
  const testing::Folder folder;
  const auto preset = general_q_lambda_preset(4);
  ControllerConfig config{
      .approximator = preset.approximator,
      .learning = preset.learning,
      .seed = 7,
      .observation = preset.observation,
      .action = {.low = {-1.0}, .high = {1.0}, .discrete = true, .number = ActionNumber::whole},
      .warm_up_steps = 30};
  config.observation.low = {-1.0, std::nullopt};
  config.observation.high = {1.0, std::nullopt};
  config.observation.inputs = {1};
  config.observation.history = History::none;
  std::get<QLambdaConfig>(config.learning).policy.epsilon = 0.2;
  AgentFile file{Controller(config)};
  CompiledController agent({.observation = kBounds,
                            .action = Discrete{.n = 3, .start = -1},
                            .seed = 7,
                            .settings = {{"learning.epsilon", 0.2},
                                         {"observation.inputs", "[1]"},
                                         {"observation.history", "none"},
                                         {"warm_up_steps", 30}}});
  EXPECT_EQ(agent.n_variables(), 2U);
  EXPECT_EQ(agent.n_dimensions(), 1U);
  EXPECT_TRUE(agent.is_warming_up());
  act_and_learn_in_two_environments(agent, 200);
  act_and_learn_in_two_environments(file.controller, 200);
  EXPECT_FALSE(agent.is_warming_up());
  agent.write(folder / "agent");
  file.write(folder / "file");
  EXPECT_EQ(testing::content_of(folder / "agent"), testing::content_of(folder / "file"));
}

TEST(CompiledController, AReadAgentOfEveryTypeContinuesLikeTheWrittenOneAndAnAgentFile) {
  const testing::Folder folder;
  for (const AgentSpec& spec : specs_of_every_agent()) {
    SCOPED_TRACE(spec.agent);
    CompiledController agent(spec);
    act_and_learn_in_two_environments(agent, 60);
    agent.set_progress(0.25);
    agent.write(folder / "agent");
    CompiledController read_agent(folder / "agent");
    AgentFile file(folder / "agent");
    EXPECT_EQ(file.description()["kind"], spec.agent);
    EXPECT_EQ(file.description()["learning"]["discount"], 0.5);
    EXPECT_EQ(file.controller.n_dimensions(), agent.n_dimensions());
    act_and_learn_in_two_environments(agent, 40);
    act_and_learn_in_two_environments(read_agent, 40);
    act_and_learn_in_two_environments(file.controller, 40);
    agent.write(folder / "agent");
    read_agent.write(folder / "read_agent");
    file.write(folder / "file");
    EXPECT_EQ(testing::content_of(folder / "agent"), testing::content_of(folder / "read_agent"));
    EXPECT_EQ(testing::content_of(folder / "agent"), testing::content_of(folder / "file"));
    const std::array<double, 2> observation = {0.5, 3.0};
    read_agent.begin_greedy_episode();  // changes nothing, as no greedy episode is under way
    EXPECT_TRUE(
        std::ranges::equal(read_agent.act(observation, false), agent.act(observation, false)));
  }
}

TEST(CompiledController, NamesWhatIsWrongWithASpecification) {
  const auto with_action = [](const auto& action) {
    return error_with([&action](AgentSpec& spec) { spec.action = action; });
  };
  EXPECT_EQ(error_with([](AgentSpec& spec) { spec.agent = "sarsa"; }),
            "agent must be one of sdnn-c rbf fuzzy q-lambda actor-critic, got \"sarsa\"");
  EXPECT_EQ(error_with([](AgentSpec& spec) { spec.preset = "robust"; }),
            "preset must be of the agent q-lambda, one of paper general, got \"robust\"");
  EXPECT_EQ(error_with([](AgentSpec& spec) { spec.observation.high.pop_back(); }),
            "observation.high must be 2 numbers, one per variable as in observation.low, got 1");
  EXPECT_EQ(error_with([](AgentSpec& spec) { spec.observation = {}; }),
            "observation.low must be of one variable at least, got 0");
  EXPECT_EQ(error_with([](AgentSpec& spec) { spec.observation.low[0] = 1.0; }),
            "observation.high[0] must be finite and greater than observation.low, got 1");
  EXPECT_EQ(error_with([](AgentSpec& spec) {
              spec.observation.low[0] = std::numeric_limits<double>::quiet_NaN();
            }),
            "observation.low must be at most observation.high, and not NaN, got nan");
  EXPECT_EQ(with_action(Discrete{.n = 0}), "action.n must be at least 1, got 0");
  EXPECT_EQ(with_action(MultiDiscrete{.n = {2, 3}, .start = {0}}),
            "action.start must be 2 numbers, one per dimension as in action.n, got 1");
  EXPECT_EQ(with_action(Box{}), "action.low must be of 1 to 1024 dimensions, got 0");
  EXPECT_EQ(with_action(Box{.low = {0.0}, .high = {kUnknown}}),
            "action.high[0] must be in [-1e+300, 1e+300], got inf");
  EXPECT_EQ(error_with([](AgentSpec& spec) { spec.agent = "fuzzy"; }),
            "action must be a Box for the agent fuzzy, got whole numbers");
}

TEST(CompiledController, NamesWhatIsWrongWithASetting) {
  const std::string known =
      "settings must be warm_up_steps, or fields of approximator., learning., observation. and "
      "action., such as learning.discount, got ";
  EXPECT_EQ(error_of_setting("discount", 0.5), known + "\"discount\"");
  EXPECT_EQ(error_of_setting("policy.epsilon", 0.5), known + "\"policy.epsilon\"");
  const std::string error = error_of_setting("learning.discont", 0.5);
  EXPECT_EQ(error.rfind("fields of learning must be one of learning_rate discount ", 0), 0U);
  EXPECT_NE(error.find(", got \"discont\""), std::string::npos) << error;
  EXPECT_EQ(error_of_setting("learning.discount", 1.5), "discount must be in [0, 1], got 1.5");
  EXPECT_EQ(error_of_setting("observation.missing", "guess"),
            "observation.missing must be one of error hold code, got \"guess\"");
  EXPECT_EQ(error_of_setting("warm_up_steps", 1), "warm_up_steps must be in [2, 10000000], got 1");
  const std::string size = error_with<std::length_error>(
      [](AgentSpec& spec) { spec.settings["approximator.max_table_bytes"] = 1000; });
  EXPECT_NE(size.find("max_table_bytes is 1000"), std::string::npos) << size;
}

// A history computes with numbers. With missing = "code" a missing one has a bin of its own
// instead, so the preset's history is left out; a history that the user sets is an error.
TEST(CompiledController, CodedMissingReadingsLeaveOutThePresetsHistory) {
  EXPECT_EQ(error_of_setting("observation.missing", "code"), "no error");
  EXPECT_NE(error_with([](AgentSpec& spec) {
              spec.settings = {{"observation.missing", "code"}, {"observation.history", "auto"}};
            }),
            "no error");
}

}  // namespace
}  // namespace sdnn::agents
