/// Q-learning over any approximator of action values.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/agents/n_step_buffer.hpp"
#include "sdnn/agents/q_learning_config.hpp"
#include "sdnn/agents/return_range.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/approximators/action_value.hpp"
#include "sdnn/approximators/decoupled.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/check_fields.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

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
/// An agent may learn in several environments at once, numbered from 0: what belongs to an episode
/// (the steps that wait, the kept action, the number of its steps, its rewards) is then
/// kept for each, all else is shared. Which of them acts or learns when is the caller's choice.
template <class Q>
class QLearning : public WithRates<QLearning<Q>> {
 public:
  static constexpr bool kDecoupled = approximators::DecoupledActionValue<Q>;
  static_assert(kDecoupled || approximators::ActionValue<Q>);
  using Action = std::conditional_t<kDecoupled, std::vector<std::size_t>, std::size_t>;

  /// What one reader needs: the workspace of the approximator, and the values of each dimension.
  struct Workspace {
    typename Q::Workspace approximator;
    std::vector<std::vector<double>> values;
  };

  /// Throws std::invalid_argument naming the field that is out of range.
  QLearning(Q action_value, const QLearningConfig& config, std::uint64_t seed)
      : config_(checked_schedule(config)),
        action_value_(std::move(action_value)),
        exploration_(config, seed),
        range_(config.discount),
        learning_rate_(config.learning_rate),
        workspace_(workspace()),
        episodes_(new_episode()) {}

  const QLearningConfig& config() const noexcept { return config_; }
  Q& action_value() noexcept { return action_value_; }
  const Q& action_value() const noexcept { return action_value_; }
  /// In which the agent itself acts and learns.
  const Workspace& own_workspace() const noexcept { return workspace_; }

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

  /// As they were set, or as progress has made them.
  double learning_rate() const noexcept { return learning_rate_; }
  double epsilon() const noexcept { return exploration_.policy().config().epsilon; }

  /// In how many environments at once the agent learns: each has an episode of its own. Of those
  /// that are no more, what waits is learned. Throws std::invalid_argument outside [1, 2^14], and
  /// as learn does.
  void set_n_environments(std::size_t n) {
    core::require_in_range("n_environments", n, 1, Episodes<Episode>::kMost);
    for (std::size_t i = n; i < n_environments(); ++i) begin_episode(i);
    episodes_.resize(n, [this] { return new_episode(); });
  }
  std::size_t n_environments() const noexcept { return episodes_.size(); }

  /// Starts counting the steps of an episode anew, for the greedy first steps, and learns what
  /// still waits of an episode that did not terminate. The caller decides when: learning a
  /// terminated transition does not. Throws std::invalid_argument if there is no such environment,
  /// and as learn does.
  void begin_episode(std::size_t environment = 0) {
    Episode& episode = episodes_.of(environment);
    episode.exploration.begin();
    if (episode.buffer.size() > 0) learn_waiting(episode);
  }

  /// Lets the approximator write to the memory that it will need, where it knows how.
  void warm_caches()
    requires requires(Q& q, typename Q::Workspace& workspace) { q.warm_caches(workspace); }
  {
    action_value_.warm_caches(workspace_.approximator);
  }

  /// A workspace for a reader beside the agent itself: as long as the agent neither acts with
  /// `explore` nor learns, many threads may call values and best_action, with one each.
  Workspace workspace() const {
    Workspace workspace{action_value_.workspace(), {}};
    for (std::size_t d = 0; d < n_dimensions(); ++d) workspace.values.emplace_back(n_actions(d));
    return workspace;
  }

  /// Q(state, a) for every action of dimension d. The span is valid until the workspace is used
  /// again. Shape: state (l,) in [0, 1]. Throws as the approximator does.
  std::span<const double> values(std::span<const double> state, Workspace& workspace,
                                 std::size_t d = 0) const {
    part(d).values(state, part(workspace, d), workspace.values[d]);
    return workspace.values[d];
  }

  /// A best action, as act without `explore` gives it; `ties` decides between several.
  Action best_action(std::span<const double> state, Workspace& workspace, core::Random& ties,
                     ActionMask mask = {}) const {
    require_mask("mask", mask);
    read(state, workspace);
    return each_best([&](std::size_t d) {
      exclude(take_part(mask, n_actions(d)), workspace, d);
      return best_of(workspace, d, ties);
    });
  }

  /// The two steps of act without `explore`: `read` takes the time and is for many threads, as
  /// values is; `best_of` gives the action in the state that was read last.
  void read(std::span<const double> state, Workspace& workspace) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) read(state, workspace, d, true);
  }
  Action best_of(Workspace& workspace, ActionMask mask = {}) {
    require_mask("mask", mask);
    core::Random& ties = exploration_.policy().ties(false);
    return each_best([&](std::size_t d) {
      exclude(take_part(mask, n_actions(d)), workspace, d);
      return best_of(workspace, d, ties);
    });
  }

  /// The action to take in `state`, an allowed one; without `explore` a best one, by the average of
  /// the weights where the approximator keeps one. Shapes: state (l,) in [0, 1], mask as ActionMask
  /// has it.
  Action act(std::span<const double> state, bool explore = true, std::size_t environment = 0,
             ActionMask mask = {}) {
    Episode& episode = episodes_.of(environment);
    if (!explore) {
      read(state, workspace_);
      return best_of(workspace_, mask);
    }
    core::require_unit_values("state", state, n_inputs());  // before anything is drawn
    require_mask("mask", mask);
    const auto n_actions_of = [this](std::size_t d) { return n_actions(d); };
    if (!exploration_.takes_random_action(episode.exploration, n_actions_of, mask)) {
      return each_best([&](std::size_t d) {
        read(state, workspace_, d, false);
        exclude(take_part(mask, n_actions(d)), workspace_, d);
        return best_of(workspace_, d, exploration_.policy().ties(true));
      });
    }
    return as_action(episode.exploration.kept);
  }

  /// The action as a number in [-1, 1]: actions cut the range evenly.
  double normalized_action(std::size_t action, std::size_t d = 0) const {
    return coding::action_value(action, n_actions(d), -1.0, 1.0);
  }

  /// Learns one transition; the best value of the next state is that of its allowed actions.
  /// Throws std::invalid_argument for a reward that is not finite or beyond
  /// +- 1e300 or an environment that is none; then nothing has been learned. Throws
  /// std::overflow_error as the approximator does; then it may have been learned in part.
  void learn(std::span<const double> state, const Action& action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0,
             ActionMask next_mask = {}) {
    // Refuses at once what could not be learned: a correction may come later.
    core::require_unit_values("state", state, n_inputs());
    require_action(indices(action));
    core::require_finite("reward", reward);
    core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
    core::require_unit_values("next_state", next_state, n_inputs());
    require_mask("next_mask", next_mask);
    Episode& episode = episodes_.of(environment);
    if constexpr (kHasRange) {
      if (adapts_range() && range_.note(reward, terminated, episode.rewards)) {
        action_value_.set_output_range(range_.low(), range_.high());
      }
    }
    // The next state first: the network then remembers it, corrected, for the next decision.
    const double next_value = terminated ? 0.0 : state_value(next_state, next_mask);
    NStepBuffer& buffer = episode.buffer;
    if (!buffer.is_continued_by(state)) learn_waiting(episode);
    buffer.add(state, indices(action), reward, next_state);
    episode.next_mask.assign(next_mask.begin(), next_mask.end());
    if (terminated) {
      learn_all(buffer, 0.0);
    } else if (buffer.is_full()) {
      learn_oldest(buffer, next_value);
    }
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.part("action_value", self.action_value_);
    Exploration::serialize(self.exploration_, archive);
    archive.part("range", self.range_);
    QLearning::serialize_rates(self, archive);
    Episodes<Episode>::serialize(
        self.episodes_, archive, [&self] { return self.new_episode(); },
        [&](auto& episode) { serialize_episode(self, episode, archive); });
    if constexpr (Archive::kReads) {
      self.apply_rates();
      self.workspace_ = self.workspace();  // a copy's has no room
    }
  }

 private:
  friend class WithRates<QLearning>;

  static constexpr double kLargestReward = 1e300;  // sums of some, and steps to them, stay finite
  /// Whether numbers that stand for values may be read in their place.
  static constexpr bool kCounts = [] {
    if constexpr (kDecoupled) {
      using Part = std::remove_cvref_t<decltype(std::declval<Q&>().part(0))>;
      return approximators::CountedActionValue<Part>;
    } else {
      return approximators::CountedActionValue<Q>;
    }
  }();
  static constexpr bool kHasRange = requires(Q& q) { q.set_output_range(0.0, 1.0); };

  /// What belongs to the present episode in one environment.
  struct Episode {
    NStepBuffer buffer;
    std::vector<std::uint8_t> next_mask;  ///< of the state where the newest step led
    Exploration::Episode exploration;
    ReturnRange::Rewards rewards = {};
  };

  Episode new_episode() const {
    return {NStepBuffer(static_cast<std::size_t>(config_.n_steps), n_inputs(), n_dimensions()),
            {},
            {.kept = std::vector<std::size_t>(n_dimensions())},
            adapts_range() ? range_.no_rewards() : ReturnRange::Rewards{}};
  }

  template <class Self, class Listed, class Archive>
  static void serialize_episode(Self& self, Listed& episode, Archive& archive) {
    archive.part("n_step_buffer", episode.buffer);
    const auto n_actions_of = [&self](std::size_t d) { return self.n_actions(d); };
    serialize_mask("next_mask", episode.next_mask, archive, self.n_dimensions(), n_actions_of);
    archive.within("range", [&] { self.range_.serialize_rewards(episode.rewards, archive); });
    self.exploration_.serialize_episode(episode.exploration, archive, n_actions_of);
    if constexpr (Archive::kReads) {
      const auto is_of_actions = [&self](const NStepBuffer::Step& step) {
        for (std::size_t d = 0; d < step.action.size(); ++d) {
          if (step.action[d] >= self.n_actions(d)) return false;
        }
        return true;
      };
      archive.expect(episode.buffer.each_is(is_of_actions), "n_step_buffer.actions", "of actions");
      archive.expect(!episode.buffer.is_full(), "n_step_buffer.rewards", "fewer than n_steps");
    }
  }

  void apply_rates(const auto& /*change*/) { apply_rates(); }
  void apply_rates() {
    learning_rate_ = this->rates_.learning_rate(config_);
    exploration_.policy().set_epsilon(this->rates_.epsilon(config_));
  }

  bool adapts_range() const noexcept {
    return kHasRange && config_.value_range == ValueRange::adaptive;
  }

  void require_mask(const char* name, ActionMask mask) const {
    agents::require_mask(name, mask, n_dimensions(), [this](auto d) { return n_actions(d); });
  }
  void require_action(std::span<const std::size_t> action) const {
    if (action.size() != n_dimensions()) {  // only a bad one's text costs memory
      core::require(false, "action", std::to_string(n_dimensions()) + " numbers", action.size());
    }
    for (std::size_t d = 0; d < action.size(); ++d) {
      if (action[d] < n_actions(d)) continue;
      core::require(false, "action", "less than " + std::to_string(n_actions(d)), action[d]);
    }
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

  /// The approximator of a dimension, and its workspace.
  const auto& part(std::size_t d) const {
    if constexpr (kDecoupled) {
      return action_value_.part(d);
    } else {
      assert(d == 0);
      return action_value_;
    }
  }
  template <class AWorkspace>
  static auto& part(AWorkspace& workspace, std::size_t d) {
    if constexpr (kDecoupled) {
      return workspace.approximator.parts[d];
    } else {
      assert(d == 0);
      return workspace.approximator;
    }
  }

  /// Reads the values of a dimension; `averaged`: by the average of the weights where the
  /// approximator keeps one.
  void read(std::span<const double> state, Workspace& workspace, std::size_t d,
            bool averaged) const {
    const auto& q = part(d);
    auto& own = part(workspace, d);
    if constexpr (kCounts) {
      if (q.values_rise()) return q.count(state, own, averaged);
    }
    if constexpr (requires { q.averaged_values(state, own, workspace.values[d]); }) {
      if (averaged) return q.averaged_values(state, own, workspace.values[d]);
    }
    q.values(state, own, workspace.values[d]);
  }
  /// Makes those of actions that are not allowed lower than all others.
  void exclude(ActionMask mask, Workspace& workspace, std::size_t d) const {
    if constexpr (kCounts) {
      if (part(d).values_rise()) return part(workspace, d).counts().exclude(mask);
    }
    agents::exclude(mask, workspace.values[d]);
  }
  /// The largest of the values that were read last.
  double best_value_of(const Workspace& workspace, std::size_t d) const {
    if constexpr (kCounts) {
      if (part(d).values_rise()) {
        return part(d).value_of_count(part(workspace, d).counts().largest());
      }
    }
    return best_value(std::span<const double>(workspace.values[d]));
  }
  /// An action that has it, or ties with those that have.
  std::size_t best_of(const Workspace& workspace, std::size_t d, core::Random& ties) const {
    const EpsilonGreedy& policy = exploration_.policy();
    if constexpr (kCounts) {
      if (part(d).values_rise()) {
        const auto& counts = part(workspace, d).counts();
        const double least = best_value_of(workspace, d) - policy.config().tie_tolerance;
        std::int32_t tied = counts.largest();
        while (tied > 0 && part(d).value_of_count(tied - 1) >= least) --tied;
        return policy.best_action(counts.of_actions(), tied, ties);
      }
    }
    return policy.best_action(workspace.values[d], ties);
  }

  /// The action that has best(d) in dimension d.
  template <class Best>
  Action each_best(const Best& best) const {
    if constexpr (kDecoupled) {
      Action action(n_dimensions());
      for (std::size_t d = 0; d < action.size(); ++d) action[d] = best(d);
      return action;
    } else {
      return best(0);
    }
  }

  double state_value(std::span<const double> state, ActionMask mask) {
    double sum = 0.0;
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      read(state, workspace_, d, false);
      exclude(take_part(mask, n_actions(d)), workspace_, d);
      sum += best_value_of(workspace_, d);
    }
    if constexpr (kDecoupled) sum /= static_cast<double>(n_dimensions());
    return sum;
  }

  void learn_oldest(NStepBuffer& buffer, double value) {
    const double target = buffer.return_of_oldest(value, config_.discount);
    const NStepBuffer::Step& oldest = buffer.take_oldest();
    typename Q::Workspace& workspace = workspace_.approximator;
    if constexpr (kDecoupled) {
      action_value_.update(oldest.state, workspace, oldest.action, target, learning_rate_);
    } else {
      action_value_.update(oldest.state, workspace, oldest.action.front(), target, learning_rate_);
    }
  }

  /// Learns the steps that wait, by the best value of the state where the newest one led.
  void learn_waiting(Episode& episode) {
    learn_all(episode.buffer, state_value(episode.buffer.next_state(), episode.next_mask));
  }
  void learn_all(NStepBuffer& buffer, double value) {
    while (buffer.size() > 0) learn_oldest(buffer, value);
  }

  QLearningConfig config_;
  Q action_value_;
  Exploration exploration_;
  ReturnRange range_;
  double learning_rate_;
  Workspace workspace_;
  Episodes<Episode> episodes_;
};

}  // namespace sdnn::agents
