/// Agents in files: written and read without Python. Needs the library nlohmann/json.
#pragma once

#include <algorithm>
#include <array>
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

#include "sdnn/agents/actor_critic_config.hpp"
#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/controller_config.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_lambda_config.hpp"
#include "sdnn/agents/q_learning_config.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/safetensors.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents {

namespace detail {

template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};
template <class T>
struct IsOptionals : std::false_type {};
template <class T>
struct IsOptionals<std::vector<std::optional<T>>> : std::true_type {};

/// Returns a setting as JSON: null for a missing one, and the word of an enumerator.
template <class Value>
nlohmann::json json_of(const Value& value) {
  if constexpr (IsOptional<Value>::value) {
    return value ? json_of(*value) : nlohmann::json(nullptr);
  } else if constexpr (IsOptionals<Value>::value) {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& item : value) list.push_back(json_of(item));
    return list;
  } else if constexpr (std::is_enum_v<Value>) {
    return words_of(value).at(static_cast<std::size_t>(value));
  } else {
    return value;
  }
}

/// Throws std::invalid_argument "<name> must be <expected>, got <value>", with long values cut.
[[noreturn]] inline void refuse(const std::string& name, const std::string& expected,
                                const nlohmann::json& value) {
  std::string shown = value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  constexpr std::size_t kMostShown = 60;
  if (shown.size() > kMostShown) shown = shown.substr(0, kMostShown - 3) + "...";
  throw std::invalid_argument(name + " must be " + expected + ", got " + shown);
}

/// Reads a value. Throws std::invalid_argument with its `name` if the JSON has another type.
template <class Value>
Value value_from(const nlohmann::json& json, const std::string& name) {
  if constexpr (IsOptional<Value>::value) {
    if (json.is_null()) return std::nullopt;
    return value_from<typename Value::value_type>(json, name);
  } else if constexpr (std::is_enum_v<Value>) {
    const auto names = words_of(Value{});
    const auto match = std::ranges::find_if(names, [&json](auto known) { return json == known; });
    std::string expected = "one of";
    for (const auto known : names) (expected += ' ') += known;
    if (match == names.end()) refuse(name, expected, json);
    return static_cast<Value>(match - names.begin());
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

/// Returns member `key` of an object called `name`. Throws std::invalid_argument if it is missing.
inline const nlohmann::json& member(const nlohmann::json& object, const char* key,
                                    const std::string& name) {
  if (!object.is_object()) refuse(name, "an object", object);
  const auto value = object.find(key);
  if (value == object.end()) throw std::invalid_argument(name + "." + key + " must be there");
  return *value;
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

/// Reads a configuration from a JSON object; missing members keep their defaults. Throws
/// std::invalid_argument naming an unknown member or one of another type, prefixed by `name`.
template <class Config>
Config config_from_json(const nlohmann::json& object, const std::string& name) {
  if (!object.is_object()) detail::refuse(name, "an object", object);
  Config config;
  std::size_t n_known = 0;
  const auto read = [&](const auto& field) {
    const auto value = object.find(field.name);
    if (value == object.end()) return;
    using Value = core::FieldValue<std::remove_cvref_t<decltype(field)>, Config>;
    field.of(config) = detail::value_from<Value>(*value, name + "." + field.name);
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
    std::string expected = "one of";
    std::apply([&](const auto&... field) { ((expected.append(" ").append(field.name)), ...); },
               Config::fields());
    detail::refuse("fields of " + name, expected, key);
  }
  return config;
}

namespace detail {

/// The name of a type of agent in files, and of its class in Python.
struct AgentKind {
  std::string_view name, class_in_python;
};
/// All types in the order of AnyApproximatorConfig, and last the actor-critic (a linear readout).
inline constexpr std::array<AgentKind, 5> kAgentKinds{{{"sdnn-c", "SDNNQLearning"},
                                                       {"rbf", "RBFQLearning"},
                                                       {"fuzzy", "FuzzyQLearning"},
                                                       {"q-lambda", "SDNNQLambda"},
                                                       {"actor-critic", "SDNNActorCritic"}}};
/// The index of a type of agent. Throws std::invalid_argument with `argument` for an unknown name.
inline std::size_t index_of_kind(const std::string& argument, const std::string& name) {
  std::string expected = "one of";
  for (std::size_t i = 0; i < kAgentKinds.size(); ++i) {
    if (kAgentKinds.at(i).name == name) return i;
    (expected += ' ') += kAgentKinds.at(i).name;
  }
  refuse(argument, expected, name);
}
inline const AgentKind& kind_of(const ControllerConfig& config) {
  const bool is_actor_critic = std::holds_alternative<ActorCriticConfig>(config.learning);
  return is_actor_critic ? kAgentKinds.back() : kAgentKinds.at(config.approximator.index());
}

/// The settings of a controller in a file's description.
inline ControllerConfig controller_config_in(const nlohmann::json& description) {
  const auto at = [&description](const char* key) -> const nlohmann::json& {
    return member(description, key, "description");
  };
  const auto& approximator = at("approximator");
  const auto& learning = at("learning");
  const auto kind = index_of_kind("kind", value_from<std::string>(at("kind"), "kind"));
  ControllerConfig config;
  const auto read = [&]<class Approximator, class Learning>(Approximator, Learning) {
    config.approximator = config_from_json<Approximator>(approximator, "approximator");
    config.learning = config_from_json<Learning>(learning, "learning");
  };
  switch (kind) {  // the order of kAgentKinds
    case 0:
      read(approximators::SDNNCConfig(), QLearningConfig());
      break;
    case 1:
      read(approximators::RBFNetworkConfig(), QLearningConfig());
      break;
    case 2:
      read(approximators::FuzzyRulesConfig(), FuzzyQLearningConfig());
      break;
    case 3:
      read(approximators::LinearSDNNConfig(), QLambdaConfig());
      break;
    default:
      read(approximators::LinearSDNNConfig(), ActorCriticConfig());
  }
  config.seed = value_from<std::uint64_t>(at("seed"), "seed");
  config.observation = config_from_json<ObservationConfig>(at("observation"), "observation");
  config.action = config_from_json<ActionConfig>(at("action"), "action");
  config.warm_up_steps = value_from<int>(at("warm_up_steps"), "warm_up_steps");
  return config;
}

/// Writes the settings of a controller into a description, as Python does.
inline void describe(const ControllerConfig& config, nlohmann::json& description) {
  const AgentKind& kind = kind_of(config);
  if (!description.contains("class")) description["class"] = kind.class_in_python;
  description["kind"] = kind.name;
  const auto to_json = [](const auto& part) { return config_to_json(part); };
  description["approximator"] = std::visit(to_json, config.approximator);
  description["learning"] = std::visit(to_json, config.learning);
  description["seed"] = config.seed;
  description["observation"] = config_to_json(config.observation);
  description["action"] = config_to_json(config.action);
  description["warm_up_steps"] = config.warm_up_steps;
}

}  // namespace detail

/// A controller, and other data in its file, such as spaces of Gymnasium or a training.
class AgentFile {
 public:
  /// Takes a controller that is not in a file yet.
  explicit AgentFile(Controller controller_of_file) : controller(std::move(controller_of_file)) {
    detail::describe(controller.config(), content_.description);
  }

  /// Reads a file of an agent or a training. Throws std::runtime_error naming file and problem.
  explicit AgentFile(const std::filesystem::path& path)
      : AgentFile(core::read_file(path, {"agent", "training"}), path.string()) {}

  /// Writes the file, whole or not at all: with the present state of the controller, and everything
  /// else unchanged since it was read. Throws std::runtime_error naming the file.
  void write(const std::filesystem::path& path) const {
    core::FileContent content = content_;
    content.tensors.merge(core::state_of(controller));
    core::write_file(path, content);
  }

  /// The content of the file but for its tensors.
  const nlohmann::json& description() const noexcept { return content_.description; }

  Controller controller;

 private:
  static constexpr std::string_view kOfTraining = "training.";  // prefix of a training's tensors

  AgentFile(core::FileContent content, const std::string& name)
      : controller(controller_in(content, name)), content_(std::move(content)) {}

  /// Makes the controller, and moves its tensors out of the content, which keeps those of a
  /// training.
  static Controller controller_in(core::FileContent& content, const std::string& name) {
    core::State state = std::exchange(content.tensors, {});
    for (auto tensor = state.begin(); tensor != state.end();) {
      const auto present = tensor++;
      if (present->first.starts_with(kOfTraining)) content.tensors.insert(state.extract(present));
    }
    try {
      return Controller::restored(detail::controller_config_in(content.description), state);
    } catch (const std::exception& error) {
      throw std::runtime_error(name + ": " + error.what());
    }
  }

  /// The content of the file without the tensors of the controller.
  core::FileContent content_{
      .kind = "agent", .description = nlohmann::json::object(), .tensors = {}};
};

}  // namespace sdnn::agents
