/// A saved agent at work: observations in, actions in the units of the task out. Needs the library
/// nlohmann/json.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/agents/agent_file.hpp"
#include "sdnn/agents/observation_scale.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

namespace detail {

/// What an input of the agent is, as the file's "observation" says it.
inline ObservedInput observed_input(const nlohmann::json& input, const std::string& name) {
  const auto number = [&name](const nlohmann::json& value) {
    return static_cast<std::size_t>(value_from<std::uint64_t>(value, name));
  };
  if (input.is_object() && input.size() == 1) {
    const auto kind = observed_kind(input.begin().key());
    const nlohmann::json& value = input.begin().value();
    const bool has_two = kind == ObservedKind::angle || kind == ObservedKind::symbol;
    if (kind && !has_two) return {*kind, number(value), 0};
    if (kind && value.is_array() && value.size() == 2) {
      return {*kind, number(value[0]), number(value[1])};
    }
  }
  refuse(name, "a variable, an angle of two, circular, or a symbol of some", input);
}

}  // namespace detail

/// The scale of a file's "observation": {"low": [..], "high": [..], "inputs": [..]}, where an input
/// is {"variable": i}, {"angle": [i, j]}, {"circular": i} or {"symbol": [i, n]}. Throws
/// std::invalid_argument naming the member that does not fit.
inline ObservationScale observation_scale(const nlohmann::json& observation) {
  const auto numbers = [&observation](const char* key) {
    return detail::value_from<std::vector<double>>(detail::member(observation, key, "observation"),
                                                   std::string("observation.") + key);
  };
  auto low = numbers("low"), high = numbers("high");
  const auto& listed = detail::member(observation, "inputs", "observation");
  if (!listed.is_array()) detail::refuse("observation.inputs", "a list", listed);
  std::vector<ObservedInput> inputs;
  for (const auto& input : listed) {
    inputs.push_back(
        detail::observed_input(input, "observation.inputs[" + std::to_string(inputs.size()) + "]"));
  }
  return {std::move(low), std::move(high), std::move(inputs)};
}

/// From an agent's actions to those of the task, and back.
///
/// As the file's "action" says it: {"kind": "box", "low": [..], "high": [..], "shape": [..]}, where
/// dimension d has n_actions[d] values evenly from low to high (coding::action_value), or an action
/// a in [-1, 1] is (low + high) / 2 + (high - low) / 2 a; or {"kind": "discrete", "start": [..]},
/// where it is start and the index. With "whole": true a box has the nearest whole numbers.
class ActionScale {
 public:
  /// For an agent with so many actions in each dimension; 0: any number in [-1, 1]. Throws
  /// std::invalid_argument naming the member that does not fit.
  ActionScale(const nlohmann::json& action, std::vector<std::size_t> n_actions)
      : n_actions_(std::move(n_actions)) {
    const auto kind =
        detail::value_from<std::string>(detail::member(action, "kind", "action"), "action.kind");
    const auto numbers = [&](const char* key) {
      auto values = detail::value_from<std::vector<double>>(detail::member(action, key, "action"),
                                                            std::string("action.") + key);
      core::require(values.size() == n_dimensions(), std::string("action.") + key,
                    std::to_string(n_dimensions()) + " numbers", values.size());
      for (const double value : values) {
        core::require_finite(std::string("action.") + key, value);
      }
      return values;
    };
    if (kind == "discrete" && std::ranges::find(n_actions_, 0U) == n_actions_.end()) {
      is_discrete_ = true;
      low_ = numbers("start");
      return;
    }
    if (kind != "box") detail::refuse("action.kind", R"("box" or "discrete")", kind);
    low_ = numbers("low");
    high_ = numbers("high");
    if (action.contains("whole")) {
      is_whole_ = detail::value_from<bool>(action["whole"], "action.whole");
    }
    for (std::size_t d = 0; d < low_.size(); ++d) {
      core::require_in_range("action.low", low_[d], -kFurthest, kFurthest);
      core::require_in_range("action.high", high_[d], -kFurthest, kFurthest);
      core::require(low_[d] <= high_[d], "action.high", "at least action.low", high_[d]);
    }
  }

  std::size_t n_dimensions() const noexcept { return n_actions_.size(); }
  /// Whether several numbers of actions may stand for one action.
  bool is_whole() const noexcept { return is_whole_; }

  /// Whether these are the numbers of an action, one in each dimension.
  bool has(std::span<const std::uint64_t> indices) const noexcept {
    return std::ranges::equal(indices, n_actions_, std::ranges::less());
  }

  /// Of action number `index` in dimension d.
  double of_index(std::size_t index, std::size_t d) const noexcept {
    if (is_discrete_) return low_[d] + static_cast<double>(index);
    return rounded(coding::action_value(index, n_actions_[d], low_[d], high_[d]));
  }
  /// Of a number in [-1, 1] in dimension d.
  double of_normalized(double action, std::size_t d) const noexcept {
    const double middle = 0.5 * (low_[d] + high_[d]);
    const double half = 0.5 * (high_[d] - low_[d]);
    return std::clamp(rounded(std::clamp(middle + half * action, low_[d], high_[d])), low_[d],
                      high_[d]);
  }
  /// The number of an action. Throws std::invalid_argument if there is none like it.
  std::size_t index_of(double action, std::size_t d) const {
    const std::size_t first = nearest(action, d);
    for (std::size_t index = first, end = std::min(first + 2, n_actions_[d]); index < end;
         ++index) {
      if (of_index(index, d) == action) return index;
    }
    if (first > 0 && of_index(first - 1, d) == action) return first - 1;
    core::require(false, "action[" + std::to_string(d) + "]", "one that the agent can take",
                  action);
    return 0;
  }

 private:
  double rounded(double action) const noexcept {
    return is_whole_ ? std::floor(action + 0.5) : action;
  }

  /// The number of the action that is the next one below, or about that.
  std::size_t nearest(double action, std::size_t d) const noexcept {
    const double step = is_discrete_
                            ? 1.0
                            : (high_[d] - low_[d]) /
                                  static_cast<double>(std::max<std::size_t>(n_actions_[d] - 1, 1));
    const double place = (action - low_[d]) / step;
    // Of whole numbers, which may be beside an even place, the nearest as Python has it.
    const double position = is_whole_ ? std::nearbyint(place) : std::floor(place + 0.25);
    const double last = static_cast<double>(n_actions_[d] - 1);
    return position > 0.0 ? static_cast<std::size_t>(std::min(position, last)) : 0;
  }

  static constexpr double kFurthest = 1e300;  // of bounds: what lies between them stays finite

  bool is_discrete_ = false;
  bool is_whole_ = false;
  std::vector<std::size_t> n_actions_;
  std::vector<double> low_, high_;  ///< low_ is where discrete actions start
};

/// An agent of any kind, in the units of its task: read from a file, at work, saved again.
///
/// What its file has besides the agent's state is kept. An object must not be used by two threads
/// at once.
class Controller {
 public:
  /// Throws std::runtime_error naming the file and what is wrong with it.
  explicit Controller(const std::filesystem::path& path)
      : Controller(read_agent_file(path), path.string() + ": ") {}
  /// Throws std::runtime_error saying what is wrong with the file.
  explicit Controller(AgentFile file) : Controller(std::move(file), "") {}

  /// The agent in itself: whatever it is, with states in [0, 1].
  AnyAgent& agent() noexcept { return parts_.agent; }
  const AnyAgent& agent() const noexcept { return parts_.agent; }
  /// What else the file says.
  const nlohmann::json& settings() const noexcept { return file_.settings; }

  /// Numbers of an observation, and of an action.
  std::size_t n_observed() const noexcept { return parts_.observation.n_observed(); }
  std::size_t n_dimensions() const noexcept { return parts_.action.n_dimensions(); }

  /// How many robots, or environments, the agent learns from at once: each has an episode of its
  /// own, and a number from 0. Throws as the agent does.
  void set_n_environments(std::size_t n) {
    std::visit([n](auto& agent) { agent.set_n_environments(n); }, parts_.agent);
    if (taken_.size() > n) taken_.resize(n);  // others may come later
  }
  std::size_t n_environments() const {
    return std::visit([](const auto& agent) { return agent.n_environments(); }, parts_.agent);
  }

  /// The next act in the environment is an episode's first.
  void begin_episode(std::size_t environment = 0) {
    std::visit([environment](auto& agent) { agent.begin_episode(environment); }, parts_.agent);
  }

  /// The action to take, in the units of the task; without `explore` a best one. The span is valid
  /// until the next act. Shapes: observation (n_observed,), the action (n_dimensions,). Throws
  /// std::invalid_argument naming a number that has no state (see ObservationScale), or if there is
  /// no such environment; then nothing has changed.
  std::span<const double> act(std::span<const double> observation, bool explore = true,
                              std::size_t environment = 0) {
    parts_.observation(observation, state_);
    std::visit(
        [&](auto& agent) {
          const auto action = agent.act(state_, explore, environment);
          if constexpr (std::is_same_v<decltype(action), const double>) {
            action_[0] = parts_.action.of_normalized(action, 0);
          } else if constexpr (std::is_same_v<decltype(action), const std::vector<double>>) {
            for (std::size_t d = 0; d < action_.size(); ++d) {
              action_[d] = parts_.action.of_normalized(action[d], d);
            }
          } else if constexpr (std::is_same_v<decltype(action), const std::size_t>) {
            action_[0] = parts_.action.of_index(action, 0);
            indices_[0] = action;
          } else {
            for (std::size_t d = 0; d < action_.size(); ++d) {
              action_[d] = parts_.action.of_index(action[d], d);
              indices_[d] = action[d];
            }
          }
        },
        parts_.agent);
    if (explore && parts_.action.is_whole() && !is_fuzzy()) {
      if (taken_.size() <= environment) taken_.resize(environment + 1);
      taken_[environment] = {action_, {indices_.begin(), indices_.end()}};
    }
    return action_;
  }

  /// Learns a transition. The action is one that act gave; of fuzzy Q-learning, the last one with
  /// `explore` in the environment. Shapes as in act. Throws std::invalid_argument for others and
  /// for numbers that have no state, and then nothing has changed; as the agent does.
  void learn(std::span<const double> observation, std::span<const double> action, double reward,
             std::span<const double> next_observation, bool terminated,
             std::size_t environment = 0) {
    parts_.observation(observation, state_);
    parts_.observation(next_observation, next_state_);
    if (action.size() != n_dimensions()) {
      core::require(false, "action", std::to_string(n_dimensions()) + " numbers", action.size());
    }
    std::visit(
        [&](auto& agent) {
          using Agent = std::remove_cvref_t<decltype(agent)>;
          if constexpr (kIsFuzzy<Agent>) {
            const auto last = agent.last_action(environment);
            for (std::size_t d = 0; d < action.size(); ++d) {
              core::require(action[d] == parts_.action.of_normalized(number(last, d), d),
                            "action[" + std::to_string(d) + "]", "that of the last exploring act",
                            action[d]);
            }
            agent.learn(state_, last, reward, next_state_, terminated, environment);
          } else if constexpr (Agent::kDecoupled) {
            for (std::size_t d = 0; d < action.size(); ++d) {
              indices_[d] = index_of(action, d, environment);
            }
            agent.learn(state_, indices_, reward, next_state_, terminated, environment);
          } else {
            agent.learn(state_, index_of(action, 0, environment), reward, next_state_, terminated,
                        environment);
          }
        },
        parts_.agent);
  }

  /// Saves it as it is now, whole or not at all. Throws std::runtime_error naming the file.
  void write(const std::filesystem::path& path) const {
    AgentFile file = file_;
    std::visit([&file](const auto& agent) { update_state(file, agent); }, parts_.agent);
    for (std::size_t i = 0; i < taken_.size(); ++i) {
      if (!is_unclear(taken_[i])) continue;
      core::StateWriter writer;
      writer.numbers(kTaken + std::to_string(i), taken_[i].indices);
      file.tensors.merge(writer.state);
    }
    write_agent_file(path, file);
  }

 private:
  /// What was explored last in an environment, where several numbers stand for one action.
  struct Taken {
    std::vector<double> action;
    std::vector<std::uint64_t> indices;
  };
  static constexpr const char* kTaken = "taken.";

  /// Whether the action does not tell its numbers.
  bool is_unclear(const Taken& taken) const {
    for (std::size_t d = 0; d < taken.action.size(); ++d) {
      if (parts_.action.index_of(taken.action[d], d) != taken.indices[d]) return true;
    }
    return false;
  }

  /// Takes up what `write` wrote.
  void restore_taken(const std::string& name) {
    core::StateReader reader(file_.tensors);
    for (std::size_t i = 0, n = n_environments(); i < n; ++i) {
      const std::string key = kTaken + std::to_string(i);
      if (!file_.tensors.contains(key)) continue;
      Taken taken;
      try {
        reader.numbers(key, taken.indices);
        reader.expect(parts_.action.has(taken.indices), key, "the numbers of an action");
      } catch (const std::invalid_argument& error) {
        throw std::runtime_error(name + error.what());
      }
      for (std::size_t d = 0; d < taken.indices.size(); ++d) {
        taken.action.push_back(parts_.action.of_index(taken.indices[d], d));
      }
      taken_.resize(std::max(taken_.size(), i + 1));
      taken_[i] = std::move(taken);
    }
    std::erase_if(file_.tensors, [](const auto& item) { return item.first.starts_with(kTaken); });
  }

  /// The number of an action: that of the last exploring act where it is the same one.
  std::size_t index_of(std::span<const double> action, std::size_t d,
                       std::size_t environment) const {
    if (environment < taken_.size() && std::ranges::equal(taken_[environment].action, action)) {
      return taken_[environment].indices[d];
    }
    return parts_.action.index_of(action[d], d);
  }

  struct Parts {
    AnyAgent agent;
    ObservationScale observation;
    ActionScale action;
  };

  Controller(AgentFile file, const std::string& name)
      : file_(std::move(file)), parts_(parts_of(file_, name)) {
    state_.resize(parts_.observation.n_inputs());
    next_state_.resize(state_.size());
    action_.resize(n_dimensions());
    indices_.resize(n_dimensions());
    std::erase_if(file_.tensors, [](const auto& item) {  // the agent has them
      return item.first.starts_with(detail::kStatePrefix);
    });
    restore_taken(name);
  }

  bool is_fuzzy() const {
    return std::visit(
        [](const auto& agent) { return kIsFuzzy<std::remove_cvref_t<decltype(agent)>>; },
        parts_.agent);
  }

  static double number(double action, std::size_t) noexcept { return action; }
  static double number(const std::vector<double>& action, std::size_t d) noexcept {
    return action[d];
  }

  static Parts parts_of(const AgentFile& file, const std::string& name) {
    try {
      AnyAgent agent = make_agent(file);
      ObservationScale observation =
          observation_scale(detail::member(file.settings, "observation", "sdnn"));
      std::vector<std::size_t> n_actions;
      std::visit(
          [&](const auto& known) {
            core::require(observation.n_inputs() == known.n_inputs(), "observation.inputs",
                          std::to_string(known.n_inputs()) + ", as the agent's",
                          observation.n_inputs());
            using Agent = std::remove_cvref_t<decltype(known)>;
            if constexpr (std::is_same_v<Agent, FuzzyQLearning>) {
              n_actions.assign(1, 0);
            } else if constexpr (std::is_same_v<Agent, VectorFuzzyQLearning>) {
              n_actions.assign(known.n_dimensions(), 0);
            } else {
              for (std::size_t d = 0; d < known.n_dimensions(); ++d) {
                n_actions.push_back(known.n_actions(d));
              }
            }
          },
          agent);
      ActionScale action(detail::member(file.settings, "action", "sdnn"), std::move(n_actions));
      return {std::move(agent), std::move(observation), std::move(action)};
    } catch (const std::exception& error) {
      throw std::runtime_error(name + error.what());
    }
  }

  AgentFile file_;  ///< all of it but the agent's state
  Parts parts_;
  std::vector<double> state_, next_state_, action_;
  std::vector<std::size_t> indices_;
  std::vector<Taken> taken_;  ///< for each environment
};

}  // namespace sdnn::agents
