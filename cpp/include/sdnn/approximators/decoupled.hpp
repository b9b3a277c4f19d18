/// Q(s, a) of actions with several dimensions: a network each, and their mean.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/approximators/action_value.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {

/// Q(s, a) = mean over the dimensions d of Q_d(s, a_d).
///
/// The maximum over all actions is then the mean of the maxima: exact, one pass per dimension,
/// however many dimensions there are. What cannot be expressed is how the dimensions act together:
/// each takes the others' part for noise. A correction moves every Q_d by the error of the mean.
///
/// Source: Seyde, T. et al. (2022). Solving continuous control via Q-learning (Eqs. 2 and 3).
template <ActionValue Q>
class Decoupled {
 public:
  /// State of one user: a workspace for each part.
  struct Workspace {
    std::vector<typename Q::Workspace> parts;
    std::vector<double> taken;  ///< Q_d of the action that was asked for last
  };

  /// Throws std::invalid_argument unless there is a part, and all have the same inputs.
  explicit Decoupled(std::vector<Q> parts) : parts_(std::move(parts)) {
    core::require(!parts_.empty(), "parts", "at least one", parts_.size());
    for (const Q& part : parts_) {
      core::require(part.n_inputs() == n_inputs(), "parts", "of the same inputs", part.n_inputs());
    }
  }

  std::size_t n_inputs() const noexcept { return parts_.front().n_inputs(); }
  std::size_t n_dimensions() const noexcept { return parts_.size(); }
  Q& part(std::size_t d) noexcept { return parts_[d]; }
  const Q& part(std::size_t d) const noexcept { return parts_[d]; }

  Workspace workspace() const {
    Workspace workspace;
    for (const Q& part : parts_) workspace.parts.push_back(part.workspace());
    workspace.taken.resize(parts_.size());
    return workspace;
  }

  /// Q(state, action). Shapes: state (l,) in [0, 1], action (n_dimensions,). Throws as the parts.
  double value(std::span<const double> state, Workspace& workspace,
               std::span<const std::size_t> action) const {
    require_action(action);
    double sum = 0.0;
    for (std::size_t d = 0; d < parts_.size(); ++d) {
      workspace.taken[d] = parts_[d].value(state, workspace.parts[d], action[d]);
      sum += workspace.taken[d];
    }
    return sum / static_cast<double>(parts_.size());
  }

  /// Moves Q(state, action) towards (1 - rate) Q + rate * target. Throws as the parts do; where it
  /// is for an overflow, the parts before have changed.
  void update(std::span<const double> state, Workspace& workspace,
              std::span<const std::size_t> action, double target, double rate) {
    const double error = target - value(state, workspace, action);
    for (std::size_t d = 0; d < parts_.size(); ++d) {
      parts_[d].update(state, workspace.parts[d], action[d], workspace.taken[d] + error, rate);
    }
  }

  /// Applies it to every part. Throws as they do.
  void set_output_range(double q_low, double q_high)
    requires requires(Q& q) { q.set_output_range(q_low, q_high); }
  {
    for (Q& part : parts_) part.set_output_range(q_low, q_high);
  }

  /// Lets the parts write to the memory that they will need, where they know how.
  void warm_caches(Workspace& workspace)
    requires requires(Q& q, typename Q::Workspace& of_part) { q.warm_caches(of_part); }
  {
    for (std::size_t d = 0; d < parts_.size(); ++d) parts_[d].warm_caches(workspace.parts[d]);
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    for (std::size_t d = 0; d < self.parts_.size(); ++d) {
      archive.part(std::to_string(d), self.parts_[d]);
    }
  }

 private:
  void require_action(std::span<const std::size_t> action) const {
    if (action.size() == parts_.size()) return;
    core::require(false, "action", std::to_string(parts_.size()) + " numbers", action.size());
  }

  std::vector<Q> parts_;
};

/// The seed of a dimension's network: that of the whole for the first, another for every other.
inline std::uint64_t seed_of_dimension(std::uint64_t seed, std::size_t d) noexcept {
  return d == 0 ? seed : core::Random(seed, core::Stream::dimensions, d).bits();
}

/// Whether actions of Q have several dimensions.
template <class Q>
concept DecoupledActionValue = requires(Q q) {
  { q.n_dimensions() } -> std::convertible_to<std::size_t>;
  q.part(0);
};

/// The networks of an action's dimensions, each made by `make(config, seed)`: alike but for their
/// numbers of actions, and all random. Throws as `make` does.
template <class Config, class Make>
auto make_decoupled(const Config& config, std::span<const int> n_actions, std::uint64_t seed,
                    const Make& make) {
  std::vector<decltype(make(config, seed))> parts;
  parts.reserve(n_actions.size());
  for (std::size_t d = 0; d < n_actions.size(); ++d) {
    Config of_dimension = config;
    of_dimension.n_actions = n_actions[d];
    parts.push_back(make(of_dimension, seed_of_dimension(seed, d)));
  }
  return Decoupled(std::move(parts));
}

}  // namespace sdnn::approximators
