/// Q-learning over any approximator of action values.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/agents/return_range.hpp"
#include "sdnn/agents/waiting_steps.hpp"
#include "sdnn/approximators/action_value.hpp"
#include "sdnn/approximators/decoupled.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// Whether the range of values is the approximator's, or follows the rewards.
enum class ValueRange {
  given,  ///< as the approximator was made
  seen,   ///< that of ReturnRange, where the approximator has a range
};

/// The agent's parameters; the defaults are the paper's (section 4.2).
struct QLearningConfig {
  double learning_rate = 0.5;  ///< alpha, in (0, 1]
  double discount = 0.9;       ///< gamma, in [0, 1]
  EpsilonGreedyConfig policy = {};
  int n_steps = 1;          ///< rewards in a target before it bootstraps, in [1, 1000]
  int max_repetitions = 1;  ///< steps that a random action may last, in [1, 10^6]
  std::optional<double> final_learning_rate = {};  ///< at progress 1, in (0, 1]; none: the same
  std::optional<double> final_epsilon = {};        ///< at progress 1, in [0, 1]; none: the same
  ValueRange value_range = ValueRange::given;

  static constexpr auto fields() noexcept {
    return std::tuple_cat(
        std::tuple(core::field("learning_rate", &QLearningConfig::learning_rate),
                   core::field("discount", &QLearningConfig::discount)),
        core::nested_fields(&QLearningConfig::policy),
        std::tuple(core::field("n_steps", &QLearningConfig::n_steps),
                   core::field("max_repetitions", &QLearningConfig::max_repetitions),
                   core::field("final_learning_rate", &QLearningConfig::final_learning_rate),
                   core::field("final_epsilon", &QLearningConfig::final_epsilon),
                   core::field("value_range", &QLearningConfig::value_range)));
  }
  bool operator==(const QLearningConfig&) const = default;
};

/// An agent that learns Q(s, a) by Eq. (1) and acts epsilon-greedily.
///
/// q_hat = (1 - alpha) Q(s, a) + alpha (r + gamma max_a' Q(s', a')); a terminated transition has
/// target r alone. A time limit is no termination: it bootstraps. An action is an index, or as many
/// of them as the approximator has dimensions.
///
/// What follows is not in the paper.
///
/// With n_steps = n > 1 the target is r_1 + gamma r_2 + ... + gamma^n max_a' Q: a transition waits
/// until n steps are known, or the episode ends, and is then corrected, once, as before. A success
/// thus reaches the n states before it in the episode that had it. A transition that does not begin
/// where the one before it ended begins anew: what waits is then learned with the steps it has.
/// Targets are not corrected for actions taken at random in between. Source: Watkins, C. (1989).
/// Learning from delayed rewards (corrected n-step returns); Sutton, R., Barto, A. (2018).
/// Reinforcement learning, section 7.1.
///
/// With max_repetitions = m > 1 a random action is kept for d steps, where d is at least k with
/// probability 1 / k, and m at most: what single random steps do not reach, some of these do.
/// Source: Dabney, W., Ostrovski, G., Barreto, A. (2021). Temporally-extended epsilon-greedy
/// exploration (with this distribution in the place of the zeta one, which it resembles).
template <class Q>
class QLearning {
 public:
  static constexpr bool kDecoupled = approximators::DecoupledActionValue<Q>;
  static_assert(kDecoupled || approximators::ActionValue<Q>);
  using Action = std::conditional_t<kDecoupled, std::vector<std::size_t>, std::size_t>;

  /// Throws std::invalid_argument naming the field that is out of range.
  QLearning(Q action_value, const QLearningConfig& config, std::uint64_t seed)
      : config_(checked(config)),
        action_value_(std::move(action_value)),
        policy_(config.policy, seed),
        repetitions_(seed, core::Stream::repetitions),
        range_(config.discount),
        learning_rate_(config.learning_rate),
        kept_(n_dimensions()),
        waiting_(static_cast<std::size_t>(config.n_steps), action_value_.n_inputs(),
                 n_dimensions()) {
    for (std::size_t d = 0; d < n_dimensions(); ++d) values_.emplace_back(n_actions(d));
  }

  const QLearningConfig& config() const noexcept { return config_; }
  Q& action_value() noexcept { return action_value_; }
  const Q& action_value() const noexcept { return action_value_; }

  std::size_t n_inputs() const { return action_value_.n_inputs(); }
  /// Dimensions of an action.
  std::size_t n_dimensions() const {
    if constexpr (kDecoupled) return action_value_.n_dimensions();
    return 1;
  }
  /// Actions of a dimension.
  std::size_t n_actions(std::size_t d) const {
    if constexpr (kDecoupled) {
      return action_value_.part(d).n_actions();
    } else {
      assert(d == 0);
      return action_value_.n_actions();
    }
  }

  /// How much of the learning is done, in [0, 1], where alpha and epsilon go from one value to
  /// another with it. Throws std::invalid_argument outside.
  void set_progress(double progress) {
    core::require_in_range("progress", progress, 0.0, 1.0);
    progress_ = progress;
    const auto between = [progress](double first, const std::optional<double>& last) {
      return last ? (1.0 - progress) * first + progress * *last : first;
    };
    learning_rate_ = between(config_.learning_rate, config_.final_learning_rate);
    policy_.set_epsilon(between(config_.policy.epsilon, config_.final_epsilon));
  }
  double progress() const noexcept { return progress_; }
  /// As progress has made them.
  double learning_rate() const noexcept { return learning_rate_; }
  double epsilon() const noexcept { return policy_.config().epsilon; }

  /// Starts counting the steps of an episode anew, for the greedy first steps, and learns what
  /// still waits of an episode that did not terminate. The caller says when: learning a terminated
  /// transition does not. Throws as learn does.
  void begin_episode() {
    step_ = 0;
    n_kept_ = 0;
    range_.begin_episode();
    if (waiting_.size() > 0) learn_all_waiting(state_value(waiting_.next_state()));
  }

  /// Lets the approximator write to the memory that it will need, where it knows how.
  void warm_caches()
    requires requires(Q& q) { q.warm_caches(); }
  {
    action_value_.warm_caches();
  }

  /// The action to take in `state`; without `explore` a best one. Shape: state (l,) in [0, 1].
  Action act(std::span<const double> state, bool explore = true) {
    if (!explore) return best_action(state, false);
    core::require_unit_values("state", state, n_inputs());  // before anything is drawn
    // Evaluating is no step of the episode: it must not move the end of the greedy phase.
    const int step = step_++;
    if (n_kept_ == 0 && !policy_.explores(step)) return best_action(state, true);
    if (n_kept_ > 0) {
      --n_kept_;
      return as_action(kept_);
    }
    for (std::size_t d = 0; d < kept_.size(); ++d) kept_[d] = policy_.random_action(n_actions(d));
    if (config_.max_repetitions > 1) {
      const double drawn = 1.0 - repetitions_.uniform();  // in (0, 1]
      const double most = static_cast<double>(config_.max_repetitions);
      n_kept_ = static_cast<int>(std::min(1.0 / drawn, most)) - 1;
    }
    return as_action(kept_);
  }

  /// The action as a number in [-1, 1]: actions cut the range evenly.
  double normalized_action(std::size_t action, std::size_t d = 0) const {
    return coding::action_value(action, n_actions(d), -1.0, 1.0);
  }

  /// Learns one transition. Throws std::invalid_argument for a reward that is not finite or beyond
  /// +- 1e300, and as the approximator does; then nothing has been learned.
  void learn(std::span<const double> state, const Action& action, double reward,
             std::span<const double> next_state, bool terminated) {
    // Refuses at once what could not be learned: a correction may come later.
    core::require_unit_values("state", state, n_inputs());
    require_action(indices(action));
    core::require_finite("reward", reward);
    core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
    core::require_unit_values("next_state", next_state, n_inputs());
    if constexpr (kHasRange) {
      if (adapts_range() && range_.note(reward)) {
        action_value_.set_output_range(range_.low(), range_.high());
      }
    }
    // The next state first: the network then remembers it, corrected, for the next decision.
    const double next_value = terminated ? 0.0 : state_value(next_state);
    if (!waiting_.is_continued_by(state)) {
      learn_all_waiting(state_value(waiting_.next_state()));
    }
    waiting_.add(state, indices(action), reward, next_state);
    if (terminated) {
      learn_all_waiting(0.0);
    } else if (waiting_.is_full()) {
      learn_oldest(next_value);
    }
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void exchange(Self& self, Archive& archive) {
    archive.part("action_value", self.action_value_);
    archive.part("policy", self.policy_);
    archive.part("repetitions", self.repetitions_);
    archive.part("range", self.range_);
    archive.part("waiting", self.waiting_);
    archive.number("step", self.step_);
    std::vector<std::int64_t> kept(self.kept_.begin(), self.kept_.end());
    archive.numbers("kept_action", kept);
    archive.number("n_kept", self.n_kept_);
    archive.number("progress", self.progress_);
    if constexpr (Archive::kReads) {
      archive.expect(kept.size() == self.kept_.size(), "kept_action", "one per dimension");
      for (std::size_t d = 0; d < kept.size(); ++d) {
        archive.expect(self.has_action(d, kept[d]), "kept_action", "an action");
        self.kept_[d] = static_cast<std::size_t>(kept[d]);
      }
      const auto is_of_actions = [&self](const WaitingSteps::Step& step) {
        for (std::size_t d = 0; d < step.action.size(); ++d) {
          if (step.action[d] >= self.n_actions(d)) return false;
        }
        return true;
      };
      archive.expect(self.waiting_.each_is(is_of_actions), "waiting.actions", "of actions");
      archive.expect(!self.waiting_.is_full(), "waiting.rewards", "fewer than n_steps");
      archive.expect(self.step_ >= 0, "step", "0 or more");
      archive.expect(self.n_kept_ >= 0 && self.n_kept_ < self.config_.max_repetitions, "n_kept",
                     "in [0, max_repetitions)");
      archive.expect(self.progress_ >= 0.0 && self.progress_ <= 1.0, "progress", "in [0, 1]");
      self.set_progress(self.progress_);
    }
  }

 private:
  static constexpr double kLargestReward = 1e300;  // sums of some, and steps to them, stay finite
  static constexpr bool kHasRange = requires(Q& q) { q.set_output_range(0.0, 1.0); };

  static QLearningConfig checked(const QLearningConfig& config) {
    core::require(config.learning_rate > 0.0 && config.learning_rate <= 1.0, "learning_rate",
                  "in (0, 1]", config.learning_rate);
    core::require_in_range("discount", config.discount, 0.0, 1.0);
    core::require_in_range("n_steps", config.n_steps, 1, 1000);
    core::require_in_range("max_repetitions", config.max_repetitions, 1, 1000000);
    const double last_rate = config.final_learning_rate.value_or(1.0);
    core::require(last_rate > 0.0 && last_rate <= 1.0, "final_learning_rate", "in (0, 1]",
                  last_rate);
    core::require_in_range("final_epsilon", config.final_epsilon.value_or(0.0), 0.0, 1.0);
    return config;
  }

  bool adapts_range() const noexcept { return config_.value_range == ValueRange::seen; }

  void require_action(std::span<const std::size_t> action) const {
    if (action.size() != n_dimensions()) {  // only a bad one's text costs memory
      core::require(false, "action", std::to_string(n_dimensions()) + " numbers", action.size());
    }
    for (std::size_t d = 0; d < action.size(); ++d) {
      if (action[d] < n_actions(d)) continue;
      core::require(false, "action", "less than " + std::to_string(n_actions(d)), action[d]);
    }
  }

  bool has_action(std::size_t d, std::int64_t action) const {
    return action >= 0 && static_cast<std::uint64_t>(action) < n_actions(d);
  }

  static std::span<const std::size_t> indices(const Action& action) noexcept {
    if constexpr (kDecoupled) {
      return action;
    } else {
      return {&action, 1};
    }
  }
  static Action as_action(const std::vector<std::size_t>& indices) {
    if constexpr (kDecoupled) {
      return indices;
    } else {
      return indices.front();
    }
  }

  /// Fills values_ of a dimension.
  std::span<const double> values(std::span<const double> state, std::size_t d) {
    if constexpr (kDecoupled) {
      action_value_.part(d).values(state, values_[d]);
    } else {
      action_value_.values(state, values_[d]);
    }
    return values_[d];
  }

  Action best_action(std::span<const double> state, bool explore) {
    if constexpr (kDecoupled) {
      Action action(n_dimensions());
      for (std::size_t d = 0; d < action.size(); ++d) {
        action[d] = policy_.best_action(values(state, d), explore);
      }
      return action;
    } else {
      return policy_.best_action(values(state, 0), explore);
    }
  }

  double state_value(std::span<const double> state) {
    double sum = 0.0;
    for (std::size_t d = 0; d < n_dimensions(); ++d) sum += best_value(values(state, d));
    if constexpr (kDecoupled) sum /= static_cast<double>(n_dimensions());
    return sum;
  }

  void learn_oldest(double value) {
    const double target = waiting_.return_of_oldest(value, config_.discount);
    const WaitingSteps::Step& oldest = waiting_.take_oldest();
    if constexpr (kDecoupled) {
      action_value_.correct(oldest.state, oldest.action, target, learning_rate_);
    } else {
      action_value_.correct(oldest.state, oldest.action.front(), target, learning_rate_);
    }
  }

  void learn_all_waiting(double value) {
    while (waiting_.size() > 0) learn_oldest(value);
  }

  QLearningConfig config_;
  Q action_value_;
  EpsilonGreedy policy_;
  core::Random repetitions_;
  ReturnRange range_;
  double progress_ = 0.0;
  double learning_rate_;
  std::vector<std::vector<double>> values_;  ///< of every dimension
  std::vector<std::size_t> kept_;            ///< the random action
  int n_kept_ = 0;                           ///< steps that it will still last
  WaitingSteps waiting_;
  int step_ = 0;
};

}  // namespace sdnn::agents
