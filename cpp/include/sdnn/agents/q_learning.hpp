/// Q-learning over any approximator of action values.
#pragma once

#include <algorithm>
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
  int n_steps = 1;  ///< rewards in a target before it bootstraps, in [1, 1000]

  static constexpr auto fields() noexcept {
    return std::tuple_cat(std::tuple(core::field("learning_rate", &QLearningConfig::learning_rate),
                                     core::field("discount", &QLearningConfig::discount)),
                          core::nested_fields(&QLearningConfig::policy),
                          std::tuple(core::field("n_steps", &QLearningConfig::n_steps)));
  }
  bool operator==(const QLearningConfig&) const = default;
};

/// An agent that learns Q(s, a) by Eq. (1) and acts epsilon-greedily.
///
/// q_hat = (1 - alpha) Q(s, a) + alpha (r + gamma max_a' Q(s', a')); a terminated transition has
/// target r alone. A time limit is no termination: it bootstraps.
///
/// With n_steps = n > 1 (not in the paper) the target is r_1 + gamma r_2 + ... + gamma^n max_a' Q:
/// a transition waits until n steps are known, or the episode ends, and is then corrected, once, as
/// before. A success thus reaches the n states before it in the episode that had it. A transition
/// that does not begin where the one before it ended begins anew: what waits is then learned with
/// the steps it has. Targets are not corrected for actions taken at random in between. Source:
/// Watkins, C. (1989). Learning from delayed rewards (corrected n-step returns); Sutton, R., Barto,
/// A. (2018). Reinforcement learning, section 7.1.
template <approximators::ActionValue Q>
class QLearning {
 public:
  /// Throws std::invalid_argument naming the field that is out of range.
  QLearning(Q action_value, const QLearningConfig& config, std::uint64_t seed)
      : config_(config),
        action_value_(std::move(action_value)),
        policy_(config.policy, seed),
        values_(action_value_.n_actions()),
        next_state_(action_value_.n_inputs()) {
    core::require(config.learning_rate > 0.0 && config.learning_rate <= 1.0, "learning_rate",
                  "in (0, 1]", config.learning_rate);
    core::require_in_range("discount", config.discount, 0.0, 1.0);
    core::require_in_range("n_steps", config.n_steps, 1, 1000);
    waiting_.resize(static_cast<std::size_t>(config.n_steps));
    for (Step& step : waiting_) step.state.resize(action_value_.n_inputs());
  }

  const QLearningConfig& config() const noexcept { return config_; }
  Q& action_value() noexcept { return action_value_; }
  const Q& action_value() const noexcept { return action_value_; }

  std::size_t n_inputs() const { return action_value_.n_inputs(); }

  /// Starts counting the steps of an episode anew, for the greedy first steps, and learns what
  /// still waits of an episode that did not terminate. The caller says when: learning a terminated
  /// transition does not. Throws as learn does.
  void begin_episode() {
    step_ = 0;
    if (n_waiting_ > 0) learn_all_waiting(state_value(next_state_));
  }

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
    const double next_value = terminated ? 0.0 : state_value(next_state);
    if (config_.n_steps == 1) {
      const double target = terminated ? reward : reward + config_.discount * next_value;
      action_value_.correct(state, action, target, config_.learning_rate);
      return;
    }
    (void)action_value_.value(state, action);  // refuses what could not be learned later
    if (n_waiting_ > 0 && !std::ranges::equal(state, next_state_)) {
      learn_all_waiting(state_value(next_state_));
    }
    Step& newest = waiting_[(first_ + n_waiting_) % waiting_.size()];
    std::copy(state.begin(), state.end(), newest.state.begin());
    newest.action = action;
    newest.reward = reward;
    ++n_waiting_;
    if (terminated) {
      learn_all_waiting(0.0);
      return;
    }
    std::copy(next_state.begin(), next_state.end(), next_state_.begin());
    if (n_waiting_ == waiting_.size()) learn_oldest(next_value);
  }

 private:
  /// A transition whose target is not known yet.
  struct Step {
    std::vector<double> state;
    std::size_t action;
    double reward;
  };

  double state_value(std::span<const double> state) {
    action_value_.values(state, values_);
    return best_value(std::span<const double>(values_));
  }

  /// The target of the oldest waiting step: all rewards since, then `value`.
  double waiting_return(double value) const noexcept {
    for (std::size_t i = n_waiting_; i-- > 0;) {
      value = waiting_[(first_ + i) % waiting_.size()].reward + config_.discount * value;
    }
    return value;
  }

  void learn_oldest(double value) {
    const double target = waiting_return(value);
    const Step& oldest = waiting_[first_];
    first_ = (first_ + 1) % waiting_.size();
    --n_waiting_;
    action_value_.correct(oldest.state, oldest.action, target, config_.learning_rate);
  }

  void learn_all_waiting(double value) {
    while (n_waiting_ > 0) learn_oldest(value);
  }

  QLearningConfig config_;
  Q action_value_;
  EpsilonGreedy policy_;
  std::vector<double> values_;
  std::vector<Step> waiting_;  ///< a ring of n_steps
  std::size_t first_ = 0;      ///< the oldest one in it
  std::size_t n_waiting_ = 0;
  std::vector<double> next_state_;  ///< of the newest
  int step_ = 0;
};

}  // namespace sdnn::agents
