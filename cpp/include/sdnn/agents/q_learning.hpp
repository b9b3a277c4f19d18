/// Q-learning over any approximator of action values.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/approximators/action_value.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

/// The agent's parameters; the defaults are the paper's (section 4.2).
struct QLearningConfig {
  double learning_rate = 0.5;  ///< alpha, in (0, 1]
  double discount = 0.9;       ///< gamma, in [0, 1]
  EpsilonGreedyConfig policy = {};

  static constexpr auto fields() noexcept {
    return std::tuple_cat(std::tuple(core::field("learning_rate", &QLearningConfig::learning_rate),
                                     core::field("discount", &QLearningConfig::discount)),
                          core::nested_fields(&QLearningConfig::policy));
  }
  bool operator==(const QLearningConfig&) const = default;
};

/// An agent that learns Q(s, a) by Eq. (1) and acts epsilon-greedily.
///
/// q_hat = (1 - alpha) Q(s, a) + alpha (r + gamma max_a' Q(s', a')); a terminated transition has
/// target r alone. A time limit is no termination: it bootstraps.
template <approximators::ActionValue Q>
class QLearning {
 public:
  /// Throws std::invalid_argument naming the field that is out of range.
  QLearning(Q action_value, const QLearningConfig& config, std::uint64_t seed)
      : config_(config),
        action_value_(std::move(action_value)),
        policy_(config.policy, seed),
        values_(action_value_.n_actions()) {
    core::require(config.learning_rate > 0.0 && config.learning_rate <= 1.0, "learning_rate",
                  "in (0, 1]", config.learning_rate);
    core::require_in_range("discount", config.discount, 0.0, 1.0);
  }

  const QLearningConfig& config() const noexcept { return config_; }
  Q& action_value() noexcept { return action_value_; }
  const Q& action_value() const noexcept { return action_value_; }

  std::size_t n_inputs() const { return action_value_.n_inputs(); }

  /// Starts counting the steps of an episode anew, for the greedy first steps. The caller says
  /// when: learning a terminated transition does not.
  void begin_episode() noexcept { step_ = 0; }

  /// Lets the approximator write to the memory that it will need, where it knows how.
  void warm_caches()
    requires requires(Q& q) { q.warm_caches(); }
  {
    action_value_.warm_caches();
  }

  /// The action to take in `state`; without `explore` a best one. Shape: state (l,) in [0, 1].
  std::size_t act(std::span<const double> state, bool explore = true) {
    action_value_.values(state, values_);
    // Evaluating is no step of the episode: it must not move the end of the greedy phase.
    return policy_.select(values_, explore ? step_++ : 0, explore);
  }

  /// The action as a number in [-1, 1]: actions cut the range evenly.
  double normalized_action(std::size_t action) const {
    return coding::action_value(action, action_value_.n_actions(), -1.0, 1.0);
  }

  /// Learns one transition. Throws std::invalid_argument for a reward that is not finite, and as
  /// the approximator does; then nothing has been learned.
  void learn(std::span<const double> state, std::size_t action, double reward,
             std::span<const double> next_state, bool terminated) {
    core::require_finite("reward", reward);
    // The next state first: the network then remembers it, corrected, for the next decision.
    double target = reward;
    if (!terminated) {
      action_value_.values(next_state, values_);
      target += config_.discount * best_value(std::span<const double>(values_));
    }
    action_value_.correct(state, action, target, config_.learning_rate);
  }

 private:
  QLearningConfig config_;
  Q action_value_;
  EpsilonGreedy policy_;
  std::vector<double> values_;
  int step_ = 0;
};

}  // namespace sdnn::agents
