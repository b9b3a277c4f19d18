/// An agent of any kind without a task: states in [0, 1], actions as it numbers them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "sdnn/agents/agent.hpp"
#include "sdnn/agents/any_agent.hpp"

namespace sdnn::tools {

/// An agent as trials run it. Each number of its actions is an index or, of fuzzy rules, in [-1,
/// 1].
class BareAgent {
 public:
  using Action = std::span<const double>;

  /// With n_actions[d] actions in each dimension d. Throws as agents::make_agent does.
  BareAgent(const agents::AnyApproximatorConfig& approximator,
            const agents::AnyLearningConfig& learning, const std::vector<std::size_t>& n_actions,
            std::uint64_t seed)
      : agent_(agents::make_agent(approximator, learning, n_actions, seed)),
        action_(n_actions.size()) {}
  /// With actions of one dimension, as many as the approximator has.
  BareAgent(const agents::AnyApproximatorConfig& approximator,
            const agents::AnyLearningConfig& learning, std::uint64_t seed)
      : BareAgent(approximator, learning, {agents::n_actions_in_box(approximator)}, seed) {}

  agents::AnyAgent& agent() noexcept { return agent_; }
  const agents::AnyAgent& agent() const noexcept { return agent_; }

  std::size_t n_inputs() const {
    return std::visit([](const auto& agent) { return agent.n_inputs(); }, agent_);
  }
  void begin_episode() {
    std::visit([](auto& agent) { agent.begin_episode(); }, agent_);
  }
  void set_progress(double progress) {
    std::visit(
        [progress](auto& agent) {
          if constexpr (requires { agent.set_progress(progress); }) agent.set_progress(progress);
        },
        agent_);
  }
  /// Lets the agent write to the memory that it will need.
  void warm_caches() {
    std::visit(
        [](auto& agent) {
          if constexpr (requires { agent.warm_caches(); }) agent.warm_caches();
        },
        agent_);
  }

  /// Returns the action to take in a state, valid until the next act.
  Action act(std::span<const double> state, bool explore = true) {
    std::visit([&](auto& agent) { assign(agent.act(state, explore), action_); }, agent_);
    return action_;
  }
  double normalized_action(Action action) const {
    const auto normalized = [action](const auto& agent) {
      if constexpr (kHasNumbers<decltype(agent)>) {
        return agent.normalized_action(action);
      } else {
        const std::size_t index[] = {static_cast<std::size_t>(action.front())};
        return agent.normalized_action(index);
      }
    };
    return std::visit(normalized, agent_);
  }
  /// Learns a transition; of fuzzy rules that of the last exploring act.
  void learn(std::span<const double> state, Action action, double reward,
             std::span<const double> next_state, bool terminated) {
    indices_.resize(action.size());
    std::visit(
        [&](auto& agent) {
          if constexpr (kHasNumbers<decltype(agent)>) {
            agent.learn(state, action, reward, next_state, terminated);
          } else {
            assign(action, indices_);
            agent.learn(state, indices_, reward, next_state, terminated);
          }
        },
        agent_);
  }

 private:
  /// Whether actions of an agent are numbers in [-1, 1].
  template <class Agent>
  static constexpr bool kHasNumbers =
      std::is_same_v<typename std::remove_cvref_t<Agent>::Action, Action>;

  static void assign(auto from, auto& to) {
    for (std::size_t d = 0; d < to.size(); ++d) {
      to[d] = static_cast<std::remove_cvref_t<decltype(to[d])>>(from[d]);
    }
  }

  agents::AnyAgent agent_;
  std::vector<double> action_;
  std::vector<std::size_t> indices_;
};

}  // namespace sdnn::tools
