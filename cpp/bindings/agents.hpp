/// Functions and a class for agents of every kind. They are declared without templates, so that the
/// agents' code, which takes long to compile, is compiled in a single unit, agents.cpp.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/agents/any_agent.hpp"

namespace sdnn::bindings {

/// Returns Python objects for the networks or rules of an agent, one for each dimension of actions
/// or one for all. They refer to the agent's memory and keep its Python object `owner` alive.
pybind11::list networks_of(agents::AnyAgent& agent, pybind11::handle owner);
/// Returns the memory of the networks or rules of an agent, which lies outside the agent's object.
/// It serves to find calls that use them; see WithoutGIL.
std::span<std::byte> memory_of_parts(agents::AnyAgent& agent);

}  // namespace sdnn::bindings

namespace sdnn::tools {

/// An agent without a task, which trials use: states are in [0, 1]; an action has an index for each
/// dimension or, with fuzzy rules, a number in [-1, 1].
class BareAgent {
 public:
  using Action = std::span<const double>;

  /// Makes an agent with n_actions[d] actions in each dimension d; see agents::make_agent.
  BareAgent(const agents::AnyApproximatorConfig& approximator,
            const agents::AnyLearningConfig& learning, const std::vector<std::size_t>& n_actions,
            std::uint64_t seed);
  /// Makes an agent with actions of one dimension, as many as the approximator's configuration has.
  BareAgent(const agents::AnyApproximatorConfig& approximator,
            const agents::AnyLearningConfig& learning, std::uint64_t seed);
  BareAgent(BareAgent&&) noexcept;
  BareAgent& operator=(BareAgent&&) noexcept;
  ~BareAgent();

  agents::AnyAgent& agent() noexcept { return agent_; }
  const agents::AnyAgent& agent() const noexcept { return agent_; }

  std::size_t n_inputs() const;
  void begin_episode();
  void set_progress(double progress);
  /// Lets the agent write to the memory that it will need.
  void warm_caches();
  /// Returns the action to take in a state, valid until the next act.
  Action act(std::span<const double> state, bool explore = true);
  /// Returns an action of one dimension as a number in [-1, 1].
  double normalized_action(Action action) const;
  /// Learns a transition whose duration is `dt` usual steps. With fuzzy rules `state` and `action`
  /// must be those of the last exploring act.
  void learn(std::span<const double> state, Action action, double reward,
             std::span<const double> next_state, bool terminated, double dt = 1.0);

 private:
  agents::AnyAgent agent_;
  std::vector<double> action_;
  std::vector<std::size_t> indices_;
};

}  // namespace sdnn::tools
