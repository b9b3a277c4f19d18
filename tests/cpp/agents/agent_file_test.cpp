#include "sdnn/agents/agent_file.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "agents/lives.hpp"
#include "folders.hpp"
#include "states.hpp"

namespace sdnn::agents {
namespace {

using approximators::Decoupled;
using approximators::FuzzyRules;
using approximators::RBFNetwork;
using approximators::SDNNC;
using nlohmann::json;

constexpr std::uint64_t kSeed = 18446744073709551615U;  // the largest there is

approximators::SDNNCConfig small_network() {
  return {.n_inputs = 2,
          .n_pattern_units = 16,
          .n_anchor_patterns = 3,
          .n_interpolated = 3,
          .circular = {false, true},
          .n_symbols = {4, 0},
          .n_hidden_units = 60,
          .n_active_units = 40,
          .n_actions = 5,
          .u_high = 36,
          .rounding = approximators::Rounding::random};
}

QLearning<SDNNC> small_sdnn() {
  return {SDNNC(small_network(), kSeed),
          {.n_steps = 3, .final_epsilon = 0.1, .value_range = ValueRange::seen},
          kSeed};
}

QLearning<Decoupled<SDNNC>> small_vector() {
  auto config = small_network();
  std::vector<SDNNC> parts = {SDNNC(config, kSeed)};
  config.n_actions = 7;
  parts.emplace_back(config, approximators::seed_of_dimension(kSeed, 1));
  return {Decoupled<SDNNC>(std::move(parts)), {.max_repetitions = 3}, kSeed};
}

QLearning<RBFNetwork> small_rbf() {
  return {
      RBFNetwork({.n_inputs = 2, .n_bases = 3, .n_actions = 7, .gradient_rate = 0.5}), {}, kSeed};
}

QLearning<Decoupled<RBFNetwork>> small_rbf_vector() {
  const approximators::RBFNetworkConfig config{
      .n_inputs = 1, .n_bases = 3, .n_actions = 7, .gradient_rate = 0.5};
  return {Decoupled<RBFNetwork>({RBFNetwork(config)}), {}, kSeed};
}

FuzzyQLearning fuzzy_agent() {
  return {FuzzyRules({.n_inputs = 2, .n_sets = 4, .n_actions = 5}), {.trace_decay = 0.8}, kSeed};
}

VectorFuzzyQLearning vector_fuzzy_agent() {
  const FuzzyRules rules({.n_inputs = 2, .n_sets = 4, .n_actions = 5});
  const FuzzyQLearningConfig config{.trace_decay = 0.8};
  return VectorFuzzyQLearning(
      {{rules, config, kSeed}, {rules, config, approximators::seed_of_dimension(kSeed, 1)}});
}

/// Lives, is written in the middle, and goes on as the one that is read does.
template <class Agent>
void expect_that_a_file_goes_on(Agent agent, const char* name) {
  const testing::Folder folder;
  testing::World<Agent> world(agent.n_inputs(), 5);
  for (int t = 0; t < 203; ++t) world.tick(agent);
  write_agent_file(folder / "agent", agent_file_of(agent, kSeed));
  const AgentFile file = read_agent_file(folder / "agent");
  EXPECT_EQ(file.settings["class"], name);
  EXPECT_EQ(file.settings["seed"], kSeed);
  EXPECT_EQ(file.kind, "agent");
  AnyAgent any = read_agent(folder / "agent");
  ASSERT_TRUE(std::holds_alternative<Agent>(any));
  Agent& read = std::get<Agent>(any);
  EXPECT_EQ(read.config(), agent.config());
  EXPECT_EQ(core::state_of(read), core::state_of(agent));
  testing::World<Agent> same = world;
  for (int t = 0; t < 200; ++t) {
    world.tick(agent);
    same.tick(read);
  }
  EXPECT_EQ(core::state_of(read), core::state_of(agent));
}

TEST(AgentFile, TheAgentThatIsReadGoesOnAsTheOneThatWasWritten) {
  expect_that_a_file_goes_on(small_sdnn(), "SDNNQLearning");
  expect_that_a_file_goes_on(small_vector(), "SDNNQLearning");
  expect_that_a_file_goes_on(small_rbf(), "RBFQLearning");
  expect_that_a_file_goes_on(small_rbf_vector(), "RBFQLearning");
  expect_that_a_file_goes_on(fuzzy_agent(), "FuzzyQLearning");
  expect_that_a_file_goes_on(vector_fuzzy_agent(), "FuzzyQLearning");
}

TEST(AgentFile, SettingsHaveTheNamesAndWordsOfTheConfigurations) {
  const json settings = agent_file_of(small_vector(), kSeed).settings;
  EXPECT_EQ(settings["n_actions"], json({5, 7}));
  EXPECT_EQ(settings["seed"], kSeed);
  const json& approximator = settings["approximator"];
  EXPECT_EQ(approximator["n_hidden_units"], 60);
  EXPECT_EQ(approximator["circular"], json({false, true}));
  EXPECT_EQ(approximator["n_symbols"], json({4, 0}));
  EXPECT_EQ(approximator["u_low"], nullptr);
  EXPECT_EQ(approximator["u_high"], 36);
  EXPECT_EQ(approximator["rounding"], "random");
  EXPECT_EQ(approximator["initial_weights"], "ternary");
  EXPECT_EQ(settings["learning"]["tie_rule"], "uniform");
  EXPECT_EQ(settings["learning"]["value_range"], "given");
  EXPECT_EQ(settings["learning"]["learning_rate"], 0.5);
  EXPECT_EQ(settings["learning"]["final_epsilon"], nullptr);
  EXPECT_EQ(config_from_json<approximators::SDNNCConfig>(approximator, "x"), small_network());
}

// A reader makes an agent anew of its settings and seed, so these must be all that it was made of.
TEST(AgentFile, SaysNothingOfAnAgentThatItCouldNotGiveBack) {
  const auto error_of = [](const auto& agent, std::uint64_t seed) -> std::string {
    try {
      (void)agent_file_of(agent, seed);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of(small_sdnn(), kSeed), "no error");
  EXPECT_EQ(error_of(small_sdnn(), 7),
            "seed must be that of the network, whose tables must be its own, got 7");
  auto config = small_network();
  const SDNNC network(config, kSeed);
  const SDNNC other(config, {network.state_code().table(0), network.state_code().table(0)}, kSeed);
  EXPECT_NE(error_of(QLearning<SDNNC>(other, {}, kSeed), kSeed), "no error");
  // Its own seed is that of the first dimension only.
  EXPECT_NE(
      error_of(QLearning<Decoupled<SDNNC>>(Decoupled<SDNNC>({network, network}), {}, kSeed), kSeed),
      "no error");
  const RBFNetwork narrow({.n_inputs = 2, .width = 0.5}), wide({.n_inputs = 2, .width = 0.7});
  const Decoupled<RBFNetwork> unlike({narrow, wide}), alike({narrow, narrow});
  EXPECT_EQ(error_of(QLearning<Decoupled<RBFNetwork>>(unlike, {}, 1), 1),
            "agent must have parts of one configuration");
  EXPECT_EQ(error_of(QLearning<Decoupled<RBFNetwork>>(alike, {}, 1), 1), "no error");
  const FuzzyRules rules({.n_inputs = 2, .n_sets = 4, .n_actions = 5});
  EXPECT_EQ(
      error_of(VectorFuzzyQLearning({{rules, {.discount = 0.9}, 1}, {rules, {.discount = 0.8}, 2}}),
               1),
      "agent must have parts of one configuration");
}

TEST(AgentFile, WhatTheLibraryDoesNotKnowIsKept) {
  const testing::Folder folder;
  AgentFile file = agent_file_of(small_rbf(), 7);
  file.settings["observation"] = {{"low", {-1.5}}, {"note", "für später"}};
  file.kind = "training";
  file.tensors["ranges.low"] = testing::tensor_of<double>({-1.5});
  write_agent_file(folder / "agent", file);
  AgentFile read = read_agent_file(folder / "agent");
  EXPECT_EQ(read.settings, file.settings);
  EXPECT_EQ(read.kind, file.kind);
  EXPECT_EQ(read.tensors, file.tensors);
  QLearning<RBFNetwork> agent = small_rbf();
  agent.learn(std::vector<double>{0.1, 0.2}, 3, 1.0, std::vector<double>{0.1, 0.2}, true);
  update_state(read, agent);
  EXPECT_NE(read.tensors.at("agent.action_value.weights"),
            file.tensors.at("agent.action_value.weights"));
  EXPECT_EQ(read.tensors.at("ranges.low"), file.tensors.at("ranges.low"));
  EXPECT_EQ(read.tensors.size(), file.tensors.size());
}

TEST(AgentFile, SaysWhatDoesNotFit) {
  const testing::Folder folder;
  const auto path = folder / "agent";
  const AgentFile good = agent_file_of(small_vector(), kSeed);
  const auto error_of = [&](const AgentFile& file) {
    write_agent_file(path, file);
    const std::string error = testing::runtime_error_of([&] { (void)read_agent(path); });
    EXPECT_EQ(error.rfind(path.string() + ": ", 0), 0U) << error;
    return error.substr(path.string().size() + 2);
  };
  const auto with = [&](const char* pointer, const json& value) {
    AgentFile file = good;
    file.settings[json::json_pointer(pointer)] = value;
    return error_of(file);
  };
  EXPECT_EQ(with("/class", "Sarsa"),
            "class must be SDNNQLearning, RBFQLearning or FuzzyQLearning, got \"Sarsa\"");
  EXPECT_EQ(with("/seed", -1), "seed must be a whole number of 0 or more, got -1");
  EXPECT_EQ(with("/approximator", 3), "approximator must be an object, got 3");
  EXPECT_EQ(with("/approximator/n_scales", 3), "approximator.n_scales is not known");
  EXPECT_EQ(with("/approximator/n_inputs", 2.5),
            "approximator.n_inputs must be a whole number, got 2.5");
  EXPECT_EQ(with("/approximator/n_inputs", 4294967298),
            "approximator.n_inputs must be a whole number, got 4294967298");
  EXPECT_EQ(with("/approximator/q_low", "low"), "approximator.q_low must be a number, got \"low\"");
  EXPECT_EQ(with("/approximator/circular", {1, 0}),
            "approximator.circular[0] must be true or false, got 1");
  EXPECT_EQ(with("/approximator/n_symbols", {4, 0.5}),
            "approximator.n_symbols[1] must be a whole number, got 0.5");
  EXPECT_EQ(with("/approximator/rounding", "up"),
            "approximator.rounding must be one of half_up random away, got \"up\"");
  EXPECT_EQ(with("/learning/epsilon", nullptr), "learning.epsilon must be a number, got null");
  EXPECT_EQ(with("/learning/discount", 1.5), "discount must be in [0, 1], got 1.5");
  EXPECT_EQ(with("/n_actions", json::array()),
            "n_actions must be one number per dimension, got []");
  EXPECT_EQ(with("/n_actions", {5}), "state: kept_action must be one per dimension");
  EXPECT_EQ(with("/n_actions", {5, 7, 3}), "state: action_value.2.weights must be there");
  // Larger than the file's tensors: refused before such a network is made.
  EXPECT_EQ(with("/approximator/n_hidden_units", 1000000),
            "state: action_value.0.weights must be as large as the approximator's");
  EXPECT_EQ(with("/approximator/n_interpolated", 2000000000),
            "approximator.n_interpolated or n_symbols must be smaller: code books would not fit, "
            "got 6.4e+10");
  EXPECT_EQ(with("/approximator/n_symbols", {1 << 30, 1 << 30}),
            "approximator.n_interpolated or n_symbols must be smaller: code books would not fit, "
            "got 3.43597e+10");
  AgentFile file = good;
  file.settings.erase("seed");
  EXPECT_EQ(error_of(file), "sdnn.seed must be there");
  file = good;
  file.tensors.erase("agent.step");
  EXPECT_EQ(error_of(file), "state: step must be there");
  file = good;
  file = agent_file_of(fuzzy_agent(), 1);
  file.settings["approximator"]["n_inputs"] = 40;
  file.settings["approximator"]["max_table_bytes"] = kSeed;
  EXPECT_EQ(error_of(file), "state: rules.values must be as large as the approximator's");
  file = agent_file_of(vector_fuzzy_agent(), 1);
  file.settings["approximator"]["n_sets"] = 5;
  EXPECT_EQ(error_of(file), "state: 0.rules.values must be as large as the approximator's");
  file = agent_file_of(vector_fuzzy_agent(), 1);
  file.tensors.erase("agent.1.rules.values");  // the rest of that dimension is still there
  EXPECT_EQ(error_of(file).substr(0, 9), "state: 1.");
  file = agent_file_of(small_rbf(), 1);
  file.settings["n_actions"] = {8};
  EXPECT_EQ(error_of(file), "n_actions must be [7], as the approximator's, got [8]");
}

TEST(AgentFile, AFileOfAnotherKindIsRefused) {
  const testing::Folder folder;
  const auto path = folder / "other";
  core::write_file(path, {"estimator", json::object(), {}});
  EXPECT_EQ(testing::runtime_error_of([&path] { (void)read_agent(path); }),
            path.string() + ": is a file of kind 'estimator', expected agent or training");
}

}  // namespace
}  // namespace sdnn::agents
