/// Fuzzy Q-learning with actions of several dimensions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/approximators/decoupled.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// A fuzzy agent for each dimension of the action.
///
/// Each has rules of its own and learns from the same rewards, as if the others were part of the
/// environment. Not in the paper.
class VectorFuzzyQLearning {
 public:
  /// Throws std::invalid_argument unless there is a part, and all have the same inputs.
  explicit VectorFuzzyQLearning(std::vector<FuzzyQLearning> parts) : parts_(std::move(parts)) {
    core::require(!parts_.empty(), "parts", "at least one", parts_.size());
    for (const FuzzyQLearning& part : parts_) {
      core::require(part.n_inputs() == n_inputs(), "parts", "of the same inputs", part.n_inputs());
    }
  }

  /// With rules alike in each dimension, and random numbers of its own. Throws as they do.
  VectorFuzzyQLearning(const approximators::FuzzyRulesConfig& rules, std::size_t n_dimensions,
                       const FuzzyQLearningConfig& learning, std::uint64_t seed)
      : VectorFuzzyQLearning([&] {
          std::vector<FuzzyQLearning> parts;
          for (std::size_t d = 0; d < n_dimensions; ++d) {
            parts.emplace_back(approximators::FuzzyRules(rules), learning,
                               approximators::seed_of_dimension(seed, d));
          }
          return parts;
        }()) {}

  /// That of the first dimension.
  const FuzzyQLearningConfig& config() const noexcept { return parts_.front().config(); }
  std::size_t n_inputs() const noexcept { return parts_.front().n_inputs(); }
  std::size_t n_dimensions() const noexcept { return parts_.size(); }
  FuzzyQLearning& part(std::size_t d) noexcept { return parts_[d]; }
  const FuzzyQLearning& part(std::size_t d) const noexcept { return parts_[d]; }

  /// In how many environments at once the agent learns. Throws as the parts do.
  void set_n_environments(std::size_t n) {
    for (FuzzyQLearning& part : parts_) part.set_n_environments(n);
  }
  std::size_t n_environments() const noexcept { return parts_.front().n_environments(); }

  /// Throws std::invalid_argument if there is no such environment.
  void begin_episode(std::size_t environment = 0) {
    for (FuzzyQLearning& part : parts_) part.begin_episode(environment);
  }

  /// The action to take in `state`, each number in [-1, 1]; without `explore` nothing is
  /// remembered. Shapes: state (d,) in [0, 1], the action (n_dimensions,). Throws as the parts do,
  /// and then nothing has changed.
  std::vector<double> act(std::span<const double> state, bool explore = true,
                          std::size_t environment = 0) {
    std::vector<double> action;
    action.reserve(parts_.size());
    for (FuzzyQLearning& part : parts_) action.push_back(part.act(state, explore, environment));
    return action;
  }

  /// The action of the last exploring act in an environment.
  std::vector<double> last_action(std::size_t environment = 0) const {
    std::vector<double> action;
    for (const FuzzyQLearning& part : parts_) action.push_back(part.last_action(environment));
    return action;
  }

  /// Whether that act was in this state.
  bool explored_in(std::span<const double> state, std::size_t environment = 0) const {
    return parts_.front().explored_in(state, environment);
  }

  /// What one reader needs, as of a part: one for each.
  using Workspace = std::vector<FuzzyQLearning::Workspace>;
  Workspace workspace() const {
    Workspace workspace;
    for (const FuzzyQLearning& part : parts_) workspace.push_back(part.workspace());
    return workspace;
  }

  /// The mean of the parts' values of `state`. Throws as they do.
  double value(std::span<const double> state, Workspace& workspace) const {
    double sum = 0.0;
    for (std::size_t d = 0; d < parts_.size(); ++d) sum += parts_[d].value(state, workspace[d]);
    return sum / static_cast<double>(parts_.size());
  }

  /// The action of act without `explore`. Throws as the parts do.
  std::vector<double> best_action(std::span<const double> state, Workspace& workspace,
                                  core::Random& ties) const {
    std::vector<double> action;
    for (std::size_t d = 0; d < parts_.size(); ++d) {
      action.push_back(parts_[d].best_action(state, workspace[d], ties));
    }
    return action;
  }

  /// The two steps of act without `explore`, as of a part.
  void read(std::span<const double> state, Workspace& workspace) const {
    for (std::size_t d = 0; d < parts_.size(); ++d) parts_[d].read(state, workspace[d]);
  }
  std::vector<double> best_of(const Workspace& workspace) {
    std::vector<double> action;
    for (std::size_t d = 0; d < parts_.size(); ++d) {
      action.push_back(parts_[d].best_of(workspace[d]));
    }
    return action;
  }

  /// Learns the transition that began with the last exploring act in the environment. Throws as the
  /// parts do; where it is for a value that would leave its range, the parts before have learned.
  void learn(std::span<const double> state, std::span<const double> action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0) {
    if (action.size() != parts_.size()) {
      core::require(false, "action", std::to_string(parts_.size()) + " numbers", action.size());
    }
    for (std::size_t d = 0; d < parts_.size(); ++d) {
      // A part would find it too, when those before it had learned.
      core::require(action[d] == parts_[d].last_action(environment), "action",
                    "that of the last exploring act", action[d]);
    }
    for (std::size_t d = 0; d < parts_.size(); ++d) {
      parts_[d].learn(state, action[d], reward, next_state, terminated, environment);
    }
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    for (std::size_t d = 0; d < self.parts_.size(); ++d) {
      archive.part(std::to_string(d), self.parts_[d]);
    }
  }

 private:
  std::vector<FuzzyQLearning> parts_;
};

}  // namespace sdnn::agents
