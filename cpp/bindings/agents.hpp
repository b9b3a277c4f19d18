/// Agents of every kind, whose code is compiled in a single unit.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/agents/any_agent.hpp"

namespace sdnn::bindings {

/// Returns the networks or rules of an agent, as references that keep `owner`.
pybind11::list networks_of(agents::AnyAgent& agent, pybind11::handle owner);
/// Returns the memory of the networks or rules of an agent.
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
  /// With actions of one dimension, as many as the approximator has.
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
  double normalized_action(Action action) const;
  /// Learns a transition of dt usual steps; of fuzzy rules that of the last exploring act.
  void learn(std::span<const double> state, Action action, double reward,
             std::span<const double> next_state, bool terminated, double dt = 1.0);

 private:
  agents::AnyAgent agent_;
  std::vector<double> action_;
  std::vector<std::size_t> indices_;
};

}  // namespace sdnn::tools
