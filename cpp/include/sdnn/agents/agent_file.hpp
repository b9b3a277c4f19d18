/// Agents in files: written and read without Python. Needs the library nlohmann/json.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/agents/vector_fuzzy_q_learning.hpp"
#include "sdnn/approximators/decoupled.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/safetensors.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents {

/// An agent's file: what is in it of an agent, and of what this library does not know.
struct AgentFile {
  /// Its description: class, seed, approximator, learning, n_actions; all else is its writer's
  /// (observation and action are the controller's).
  nlohmann::json settings = nlohmann::json::object();
  core::State tensors;         ///< the agent's state with "agent." before, others
  std::string kind = "agent";  ///< or "training", which holds an agent too
};

/// Any agent that a file may hold.
using AnyAgent = std::variant<QLearning<approximators::SDNNC>,
                              QLearning<approximators::Decoupled<approximators::SDNNC>>,
                              QLearning<approximators::RBFNetwork>,
                              QLearning<approximators::Decoupled<approximators::RBFNetwork>>,
                              FuzzyQLearning, VectorFuzzyQLearning>;

/// Whether it is one of the two that learn by fuzzy rules.
template <class Agent>
inline constexpr bool kIsFuzzy =
    std::is_same_v<Agent, FuzzyQLearning> || std::is_same_v<Agent, VectorFuzzyQLearning>;

namespace detail {

inline constexpr std::string_view kStatePrefix = "agent.";

template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};

template <class Value>
nlohmann::json json_of(const Value& value) {
  if constexpr (IsOptional<Value>::value) {
    return value ? json_of(*value) : nlohmann::json(nullptr);
  } else if constexpr (std::is_enum_v<Value>) {
    return words_of(value).at(static_cast<std::size_t>(value));
  } else {
    return value;
  }
}

[[noreturn]] inline void refuse(const std::string& name, const std::string& expected,
                                const nlohmann::json& value) {
  std::string shown = value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (shown.size() > 60) shown = shown.substr(0, 57) + "...";
  throw std::invalid_argument(name + " must be " + expected + ", got " + shown);
}

/// Reads a value. Throws std::invalid_argument naming it where it is of another type.
template <class Value>
Value value_from(const nlohmann::json& json, const std::string& name) {
  if constexpr (IsOptional<Value>::value) {
    if (json.is_null()) return std::nullopt;
    return value_from<typename Value::value_type>(json, name);
  } else if constexpr (std::is_enum_v<Value>) {
    const auto words = words_of(Value{});
    const auto word = std::ranges::find_if(words, [&json](auto known) { return json == known; });
    std::string expected = "one of";
    for (const auto known : words) (expected += ' ') += known;
    if (word == words.end()) refuse(name, expected, json);
    return static_cast<Value>(word - words.begin());
  } else if constexpr (std::is_same_v<Value, bool>) {
    if (!json.is_boolean()) refuse(name, "true or false", json);
    return json.get<bool>();
  } else if constexpr (std::is_same_v<Value, std::uint64_t>) {
    const bool is_whole =
        json.is_number_unsigned() || (json.is_number_integer() && json.get<std::int64_t>() >= 0);
    if (!is_whole) refuse(name, "a whole number of 0 or more", json);
    return json.get<std::uint64_t>();
  } else if constexpr (std::is_same_v<Value, int>) {
    constexpr std::int64_t kLargest = std::numeric_limits<int>::max();
    const bool is_whole = json.is_number_unsigned()
                              ? json.get<std::uint64_t>() <= static_cast<std::uint64_t>(kLargest)
                              : json.is_number_integer() && json.get<std::int64_t>() >= -kLargest;
    if (!is_whole) refuse(name, "a whole number", json);
    return json.get<int>();
  } else if constexpr (std::is_same_v<Value, double>) {
    if (!json.is_number()) refuse(name, "a number", json);
    return json.get<double>();
  } else if constexpr (std::is_same_v<Value, std::string>) {
    if (!json.is_string()) refuse(name, "a text", json);
    return json.get<std::string>();
  } else {  // a list
    if (!json.is_array()) refuse(name, "a list", json);
    Value values;
    for (const auto& item : json) {
      values.push_back(value_from<typename Value::value_type>(
          item, name + "[" + std::to_string(values.size()) + "]"));
    }
    return values;
  }
}

/// A member of an object. Throws std::invalid_argument naming it where it is missing.
inline const nlohmann::json& member(const nlohmann::json& object, const char* key,
                                    const std::string& name) {
  if (!object.is_object()) refuse(name, "an object", object);
  const auto found = object.find(key);
  if (found == object.end()) throw std::invalid_argument(name + "." + key + " must be there");
  return *found;
}

/// The class of an agent, as files name it.
template <class Agent>
constexpr const char* class_of() noexcept {
  using approximators::Decoupled;
  if constexpr (kIsFuzzy<Agent>) {
    return "FuzzyQLearning";
  } else if constexpr (std::is_same_v<Agent, QLearning<approximators::RBFNetwork>> ||
                       std::is_same_v<Agent, QLearning<Decoupled<approximators::RBFNetwork>>>) {
    return "RBFQLearning";
  } else {
    return "SDNNQLearning";
  }
}

}  // namespace detail

/// A configuration as a JSON object: a member per field.
template <class Config>
nlohmann::json config_to_json(const Config& config) {
  nlohmann::json object = nlohmann::json::object();
  std::apply(
      [&](const auto&... field) {
        ((object[field.name] = detail::json_of(field.of(config))), ...);
      },
      Config::fields());
  return object;
}

/// The configuration in a JSON object; what is missing keeps its default. Throws
/// std::invalid_argument naming a member, after `name`, that is unknown or of another type.
template <class Config>
Config config_from_json(const nlohmann::json& object, const std::string& name) {
  if (!object.is_object()) detail::refuse(name, "an object", object);
  Config config;
  std::size_t n_known = 0;
  const auto read = [&](const auto& field) {
    const auto found = object.find(field.name);
    if (found == object.end()) return;
    using Value = core::FieldValue<std::remove_cvref_t<decltype(field)>, Config>;
    field.of(config) = detail::value_from<Value>(*found, name + "." + field.name);
    ++n_known;
  };
  const auto is_known = [](const std::string& key) {
    return std::apply([&](const auto&... field) { return ((key == field.name) || ...); },
                      Config::fields());
  };
  std::apply([&](const auto&... field) { (read(field), ...); }, Config::fields());
  if (n_known == object.size()) return config;
  for (const auto& [key, value] : object.items()) {
    if (is_known(key)) continue;
    std::string message = name;
    throw std::invalid_argument(message.append(".").append(key).append(" is not known"));
  }
  return config;
}

namespace detail {

inline void require_alike(bool are_alike) {
  if (!are_alike) throw std::invalid_argument("agent must have parts of one configuration");
}

/// Throws std::invalid_argument unless a network is what a reader makes of this configuration, but
/// for the number of actions, and seed.
template <class Network, class Config>
void require_remade(const Network& network, Config config, std::uint64_t seed) {
  config.n_actions = network.config().n_actions;
  require_alike(network.config() == config);
  if constexpr (requires { network.is_wired_by(seed); }) {
    core::require(network.is_wired_by(seed), "seed",
                  "that of the network, whose tables must be its own", seed);
  }
}

}  // namespace detail

/// What a file of this agent holds, with nothing of others. `seed` is that of its network's
/// construction, of further dimensions approximators::seed_of_dimension(seed, d). Throws
/// std::invalid_argument for another, for a network that was given tables, and for parts that
/// differ in more than their numbers of actions: no file can say so.
template <class Agent>
AgentFile agent_file_of(const Agent& agent, std::uint64_t seed) {
  AgentFile file;
  std::vector<std::size_t> n_actions;
  if constexpr (std::is_same_v<Agent, FuzzyQLearning>) {
    file.settings["approximator"] = config_to_json(agent.rules().config());
    n_actions.push_back(agent.rules().n_actions());
  } else if constexpr (std::is_same_v<Agent, VectorFuzzyQLearning>) {
    file.settings["approximator"] = config_to_json(agent.part(0).rules().config());
    for (std::size_t d = 0; d < agent.n_dimensions(); ++d) {
      const auto& part = agent.part(d);
      detail::require_alike(part.config() == agent.config() &&
                            part.rules().config() == agent.part(0).rules().config());
    }
    n_actions.assign(agent.n_dimensions(), agent.part(0).rules().n_actions());
  } else {
    if constexpr (Agent::kDecoupled) {
      const auto& parts = agent.action_value();
      file.settings["approximator"] = config_to_json(parts.part(0).config());
      for (std::size_t d = 0; d < agent.n_dimensions(); ++d) {
        detail::require_remade(parts.part(d), parts.part(0).config(),
                               approximators::seed_of_dimension(seed, d));
      }
    } else {
      detail::require_remade(agent.action_value(), agent.action_value().config(), seed);
      file.settings["approximator"] = config_to_json(agent.action_value().config());
    }
    for (std::size_t d = 0; d < agent.n_dimensions(); ++d) n_actions.push_back(agent.n_actions(d));
  }
  file.settings["class"] = detail::class_of<Agent>();
  file.settings["seed"] = seed;
  file.settings["learning"] = config_to_json(agent.config());
  file.settings["n_actions"] = n_actions;
  for (auto& [name, tensor] : core::state_of(agent)) {
    file.tensors.emplace(std::string(detail::kStatePrefix) + name, std::move(tensor));
  }
  return file;
}

/// Puts an agent's state in the place of the one that the file has.
template <class Agent>
void update_state(AgentFile& file, const Agent& agent) {
  std::erase_if(file.tensors,
                [](const auto& item) { return item.first.starts_with(detail::kStatePrefix); });
  for (auto& [name, tensor] : core::state_of(agent)) {
    file.tensors.insert_or_assign(std::string(detail::kStatePrefix) + name, std::move(tensor));
  }
}

namespace detail {

/// Puts together an agent of what a file says.
class AgentMaker {
 public:
  explicit AgentMaker(const AgentFile& file) : settings_(file.settings) {
    for (const auto& [name, tensor] : file.tensors) {
      if (!name.starts_with(kStatePrefix)) continue;
      state_.emplace(name.substr(kStatePrefix.size()), tensor);
    }
    seed_ = value_from<std::uint64_t>(member(settings_, "seed", "sdnn"), "seed");
    if (settings_.contains("observation") && settings_["observation"].is_null()) {
      throw std::invalid_argument(
          "the agent is still in its warm-up, and has learned nothing: train it on in Python");
    }
    if (settings_.value("n_tables", nlohmann::json(0)) != 0) {
      throw std::invalid_argument("n_tables must be 0: patterns of its own are for Python only");
    }
  }

  AnyAgent make() const {
    using namespace approximators;
    const auto name = value_from<std::string>(member(settings_, "class", "sdnn"), "class");
    if (name == "SDNNQLearning") {
      return q_learning<SDNNC, SDNNCConfig>(
          [](const SDNNCConfig& config, std::uint64_t seed) { return SDNNC(config, seed); });
    }
    if (name == "RBFQLearning") {
      return q_learning<RBFNetwork, RBFNetworkConfig>(
          [](const RBFNetworkConfig& config, std::uint64_t) { return RBFNetwork(config); });
    }
    if (name != "FuzzyQLearning") {
      refuse("class", "SDNNQLearning, RBFQLearning or FuzzyQLearning", name);
    }
    return fuzzy_agent();
  }

 private:
  const nlohmann::json& approximator() const { return member(settings_, "approximator", "sdnn"); }
  template <class Config>
  Config learning() const {
    return config_from_json<Config>(member(settings_, "learning", "sdnn"), "learning");
  }

  template <class Agent>
  Agent restored(Agent agent) const {
    core::restore(agent, state_);
    return agent;
  }

  /// The agent has rules, or some for each of its dimensions where the state says so.
  AnyAgent fuzzy_agent() const {
    using approximators::FuzzyRulesConfig;
    const auto config = config_from_json<FuzzyRulesConfig>(approximator(), "approximator");
    const double size =
        power(config.n_sets, config.n_inputs) * static_cast<double>(config.n_actions);
    const auto name_of = [](std::size_t d) { return std::to_string(d) + ".rules.values"; };
    std::size_t n_dimensions = 0;
    for (; state_.contains(name_of(n_dimensions)); ++n_dimensions) {
      expect_size(name_of(n_dimensions), size);
    }
    const auto rule = learning<FuzzyQLearningConfig>();
    if (n_dimensions > 0) return restored(VectorFuzzyQLearning(config, n_dimensions, rule, seed_));
    expect_size("rules.values", size);
    return restored(FuzzyQLearning(approximators::FuzzyRules(config), rule,
                                   approximators::seed_of_dimension(seed_, 0)));
  }

  /// The agent has one network, or one for each of its dimensions where the state says so.
  template <class Q, class Config, class Make>
  AnyAgent q_learning(const Make& make) const {
    const auto config = config_from_json<Config>(approximator(), "approximator");
    const auto n_actions =
        value_from<std::vector<int>>(member(settings_, "n_actions", "sdnn"), "n_actions");
    if (n_actions.empty()) refuse("n_actions", "one number per dimension", settings_["n_actions"]);
    if (!state_.contains("action_value.0.weights")) {
      expect_weights("action_value.weights", config, 1);
      QLearning<Q> agent(make(config, seed_), learning<QLearningConfig>(), seed_);
      if (n_actions.size() != 1 || agent.n_actions(0) != static_cast<std::size_t>(n_actions[0])) {
        refuse("n_actions", "[" + std::to_string(agent.n_actions(0)) + "], as the approximator's",
               settings_["n_actions"]);
      }
      core::restore(agent, state_);
      return agent;
    }
    for (std::size_t d = 0; d < n_actions.size(); ++d) {
      Config of_dimension = config;
      of_dimension.n_actions = n_actions[d];
      expect_weights("action_value." + std::to_string(d) + ".weights", of_dimension,
                     n_actions.size());
    }
    QLearning<approximators::Decoupled<Q>> agent(
        approximators::make_decoupled(config, n_actions, seed_, make), learning<QLearningConfig>(),
        seed_);
    core::restore(agent, state_);
    return agent;
  }

  void expect_weights(const std::string& name, const approximators::SDNNCConfig& config,
                      std::size_t n_dimensions) const {
    // Code books are in no tensor. Those of agents take less than their weights.
    const auto found = state_.find(name);
    const double n_weight_bytes =
        found == state_.end() ? 0.0 : static_cast<double>(found->second.bytes.size());
    const double n_code_bytes = config.pattern_bytes(config.n_bins());
    core::require(n_code_bytes <=
                      std::max(kMostCodeBytes / static_cast<double>(n_dimensions), n_weight_bytes),
                  "approximator.n_interpolated or n_symbols", "smaller: code books would not fit",
                  n_code_bytes);
    expect_size(name, 1.0 * config.n_hidden_units * config.n_pattern_units * config.n_inputs *
                          config.n_partners());
  }
  void expect_weights(const std::string& name, const approximators::RBFNetworkConfig& config,
                      std::size_t) const {
    expect_size(name, power(config.n_bases, config.n_inputs + 1));
  }

  /// A configuration may ask for no more memory than the file's tensors are large.
  void expect_size(const std::string& name, double size) const {
    const auto found = state_.find(name);
    if (found == state_.end()) throw std::invalid_argument("state: " + name + " must be there");
    if (static_cast<double>(found->second.size()) != size) {
      throw std::invalid_argument("state: " + name + " must be as large as the approximator's");
    }
  }

  static double power(int base, int exponent) {
    double product = 1.0;
    for (int i = 0; i < exponent && product < 1e300; ++i) product *= base;
    return product;
  }

  static constexpr double kMostCodeBytes = core::kDefaultMaxTableBytes;

  const nlohmann::json& settings_;
  core::State state_;
  std::uint64_t seed_ = 0;
};

}  // namespace detail

/// The agent in a file: as it was when it was written. Throws std::invalid_argument naming what
/// does not fit; std::length_error, std::bad_alloc.
inline AnyAgent make_agent(const AgentFile& file) { return detail::AgentMaker(file).make(); }

/// Reads a file. Throws std::runtime_error naming the file and what is wrong with it.
inline AgentFile read_agent_file(const std::filesystem::path& path) {
  core::FileContent content = core::read_file(path, {"agent", "training"});
  return {std::move(content.description), std::move(content.tensors), std::move(content.kind)};
}

/// Reads an agent. Throws std::runtime_error naming the file and what is wrong with it.
inline AnyAgent read_agent(const std::filesystem::path& path) {
  const AgentFile file = read_agent_file(path);
  try {
    return make_agent(file);
  } catch (const std::exception& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
}

/// Writes a file, whole or not at all. Throws std::runtime_error naming the file.
inline void write_agent_file(const std::filesystem::path& path, const AgentFile& file) {
  core::write_file(path, {file.kind, file.settings, file.tensors});
}

}  // namespace sdnn::agents
