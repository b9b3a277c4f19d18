/// Fuzzy Q-learning: every fired rule picks an action, and the agent takes the mean of the picks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/detail/dimensions.hpp"
#include "sdnn/agents/detail/fuzzy_dimension.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/fuzzy_q_learning_config.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// An agent with a number in [-1, 1] for each dimension of its action, by Jouffe's fuzzy
/// Q-learning.
///
/// Every fired rule i picks one of its actions a_i by the epsilon-greedy policy, all rules drawing
/// from the same streams in the order of FuzzyRules::fire. The action taken is the mean of the
/// picks, weighted by the truth values alpha_i. Then, with
///   Q = sum v_i[a_i] alpha_i / sum alpha_i,  V = sum max_a v_i[a] alpha_i / sum alpha_i in s',
///   v_i[a_i] += c_fql (r + gamma V - Q) alpha_i.
/// A terminated transition has target r alone. A time limit is no termination: it bootstraps.
/// Sums are in doubles and in the order of the rules; values are rounded to floats when written.
///
/// Eligibility traces (trace_decay = lambda > 0; not used in the paper): e(i, a) *= gamma lambda
/// for all, e(i, a_i) += alpha_i for the picks, then v += c_fql (r + gamma V - Q) e everywhere.
/// Traces accumulate. Random picks do not end them, the end of the episode does; one below
/// kForgottenTrace is forgotten. In a transition of dt usual steps gamma is gamma^dt, also where it
/// fades the traces, which is at the transition after it.
///
/// An agent may learn in several environments at once, numbered from 0: what belongs to an episode
/// (the last exploring act, the traces, the number of steps) is then kept for each.
///
/// Each dimension of an action has separate rules and random streams. It learns from the same
/// rewards, as if the others were part of the environment. The paper has one dimension.
///
/// Source: Jouffe, L. (1998). Fuzzy inference system learning by reinforcement methods. IEEE
/// Transactions on Systems, Man, and Cybernetics C 28(3), 338-355; method.md, section 3.
class FuzzyQLearning {
 public:
  using Action = std::span<const double>;

  /// The memory in which a thread reads the agent: the rules that fire in a state, by dimension.
  struct Workspace {
    std::vector<approximators::FiredRules> fired;
    std::vector<double> values, action;
  };

  /// Takes the rules of each dimension of actions. Throws std::invalid_argument naming the field
  /// that is out of range, or unless there are rules and all have the same inputs;
  /// std::length_error if firing rules and traces need more than max_table_bytes.
  FuzzyQLearning(std::vector<approximators::FuzzyRules> rules, const FuzzyQLearningConfig& config,
                 std::uint64_t seed)
      : config_(config) {
    core::require(!rules.empty(), "rules", "of one dimension or more", rules.size());
    const std::size_t n = rules.front().n_inputs();
    dimensions_.reserve(rules.size());
    for (approximators::FuzzyRules& of_dimension : rules) {
      core::require(of_dimension.n_inputs() == n, "rules", "of the same inputs",
                    of_dimension.n_inputs());
      dimensions_.emplace_back(std::move(of_dimension), config,
                               seed_of_dimension(seed, dimensions_.size()));
    }
    workspace_ = workspace();
    last_action_.resize(n_dimensions());
  }
  /// Takes the rules of an agent with actions of one dimension.
  FuzzyQLearning(approximators::FuzzyRules rules, const FuzzyQLearningConfig& config,
                 std::uint64_t seed)
      : FuzzyQLearning(detail::only(std::move(rules)), config, seed) {}

  const FuzzyQLearningConfig& config() const noexcept { return config_; }
  std::size_t n_inputs() const noexcept { return dimensions_.front().rules().n_inputs(); }
  std::size_t n_dimensions() const noexcept { return dimensions_.size(); }
  /// The rules of each dimension, and what they did in the last exploring act.
  std::span<detail::FuzzyDimension> dimensions() noexcept { return dimensions_; }
  std::span<const detail::FuzzyDimension> dimensions() const noexcept { return dimensions_; }

  /// Sets the number of environments in which the agent learns at once: each has a separate
  /// episode. Throws std::invalid_argument outside [1, 2^14].
  void set_n_environments(std::size_t n) {
    for (auto& dimension : dimensions_) dimension.set_n_environments(n);
  }
  std::size_t n_environments() const noexcept { return dimensions_.front().n_environments(); }

  /// Begins an episode: resets its number of steps and its traces. Learning a terminated transition
  /// only resets the traces. Throws std::invalid_argument if the environment does not exist.
  void begin_episode(std::size_t environment = 0) {
    for (auto& dimension : dimensions_) dimension.begin_episode(environment);
  }

  /// Returns the action to take in `state`, valid until the next act. Without `explore` every rule
  /// picks a best action and nothing is stored, because learning needs the last exploring act.
  /// Masks are ignored: actions are real numbers.
  ///
  /// Shapes: state (d,) in [0, 1], the action (n_dimensions,). For other states it throws
  /// std::invalid_argument and changes nothing.
  Action act(std::span<const double> state, bool explore = true, std::size_t environment = 0,
             ActionMask /*mask*/ = {}) {
    if (!explore) {
      static_cast<void>(dimensions_.front().last_action(environment));  // throws if there is none
      read(state, workspace_);
      return best_of(workspace_);
    }
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      workspace_.action[d] = dimensions_[d].explore(state, environment);
    }
    return workspace_.action;
  }

  /// The number in [-1, 1] of the first dimension.
  double normalized_action(Action action) const noexcept { return action.front(); }

  /// Returns the action of the last exploring act in an environment, valid until the next call.
  Action last_action(std::size_t environment = 0) {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      last_action_[d] = dimensions_[d].last_action(environment);
    }
    return last_action_;
  }
  /// Whether the last exploring act was in this state.
  bool explored_in(std::span<const double> state, std::size_t environment = 0) const {
    return dimensions_.front().explored_in(state, environment);
  }

  /// Makes a workspace for values and best_action. Many threads may call these at once, each with a
  /// separate workspace, while the agent neither explores nor learns.
  Workspace workspace() const {
    Workspace workspace;
    for (const auto& dimension : dimensions_) {
      workspace.fired.push_back(dimension.rules().workspace());
    }
    workspace.values.resize(1);
    workspace.action.resize(n_dimensions());
    return workspace;
  }

  /// Returns the value of `state` by the rules of dimension d, as the only number of a span that is
  /// valid until the workspace is used again. Throws std::invalid_argument for an unusable state.
  std::span<const double> values(std::span<const double> state, Workspace& workspace,
                                 std::size_t d = 0, bool /*averaged*/ = false) const {
    dimensions_[d].rules().fire(state, workspace.fired[d]);
    workspace.values[0] = dimensions_[d].value(workspace.fired[d]);
    return workspace.values;
  }

  /// Returns the greedy action without changing the agent; `ties` draws among several best actions
  /// of a rule. The span is valid until the workspace is used again.
  Action best_action(std::span<const double> state, Workspace& workspace, core::Random& ties,
                     ActionMask /*mask*/ = {}) const {
    read(state, workspace);
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      workspace.action[d] = dimensions_[d].best_of(workspace.fired[d], ties);
    }
    return workspace.action;
  }

  /// Finds the rules that fire in a state: the first step of a greedy act, in any thread.
  void read(std::span<const double> state, Workspace& workspace) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      dimensions_[d].rules().fire(state, workspace.fired[d]);
    }
  }
  /// Returns the greedy action in the state that was read last: the second step of a greedy act.
  Action best_of(Workspace& workspace, ActionMask /*mask*/ = {}) {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      workspace.action[d] =
          dimensions_[d].best_of(workspace.fired[d], dimensions_[d].evaluation_ties());
    }
    return workspace.action;
  }

  /// Learns the transition, of dt usual steps, that began with the last exploring act in the
  /// environment.
  ///
  /// Throws std::invalid_argument, and learns nothing, if `state` and `action` are not those of
  /// that act, the only one of which it is known which rule picked which action; also for a bad
  /// next state, a reward that is not finite or an impossible dt. Throws std::overflow_error if a
  /// value would exceed the range of floats; earlier dimensions have learned then.
  void learn(std::span<const double> state, Action action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0,
             ActionMask /*next_mask*/ = {}, double dt = 1.0) {
    core::require_size("action", action.size(), n_dimensions(), "numbers");
    core::require(explored_in(state, environment), "state", "that of the last exploring act",
                  "another");
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      core::require(action[d] == dimensions_[d].last_action(environment), "action",
                    "that of the last exploring act", action[d]);
    }
    core::require_finite("reward", reward);
    require_duration(dt);
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      dimensions_[d].learn(reward, next_state, terminated, environment, workspace_.fired[d], dt);
    }
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    if (self.n_dimensions() == 1) {
      detail::FuzzyDimension::serialize(self.dimensions_.front(), archive);
    } else {
      for (std::size_t d = 0; d < self.n_dimensions(); ++d) {
        archive.part(std::to_string(d), self.dimensions_[d]);
      }
    }
    if constexpr (Archive::kReads) self.workspace_ = self.workspace();  // with reserved memory
  }

 private:
  FuzzyQLearningConfig config_;
  detail::Parts<detail::FuzzyDimension> dimensions_;
  Workspace workspace_;
  std::vector<double> last_action_;
};

}  // namespace sdnn::agents
