/// Q-learning over any approximator of action values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/detail/dimensions.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/agents/n_step_buffer.hpp"
#include "sdnn/agents/q_learning_config.hpp"
#include "sdnn/agents/return_range.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/approximators/action_value.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// An agent that learns Q(s, a) by Eq. (1) and acts epsilon-greedily.
///
/// q_hat = (1 - alpha) Q(s, a) + alpha (r + gamma max_a' Q(s', a')); a terminated transition has
/// target r alone. A time limit is no termination: it bootstraps. An action is an index for each of
/// its dimensions.
///
/// The rest is not in the paper.
///
/// Where actions have several dimensions, each dimension d has an approximator, and Q(s, a) is the
/// mean of all Q_d(s, a_d). The maximum over all actions is then the mean of the maxima: exact, one
/// pass per dimension. The model cannot express how dimensions act together: to each, the part of
/// the others is noise. A correction moves every Q_d by the error of the mean. Source: Seyde, T. et
/// al. (2022). Solving continuous control via Q-learning (Eqs. 2 and 3).
///
/// With n_steps = n > 1 the target is r_1 + gamma r_2 + ... + gamma^n max_a' Q. A transition is
/// pending until n steps are known or the episode ends, and is then learned once, as above. A
/// success thus reaches the n states before it at once. If a transition does not begin in the state
/// where the one before it ended, the pending ones are learned with the steps that are known.
/// Targets are not corrected for actions taken at random in between. Source: Watkins, C. (1989).
/// Learning from delayed rewards (corrected n-step returns); Sutton, R., Barto, A. (2018).
/// Reinforcement learning, section 7.1.
///
/// In a transition of dt usual steps gamma is gamma^dt (semi-Markov). Source: Bradtke, S., Duff, M.
/// (1994). Reinforcement learning methods for continuous-time Markov decision problems.
///
/// An agent may learn in several environments at once, numbered from 0. Each has a separate episode
/// (its pending steps, repeated action, number of steps and rewards); everything else is shared.
/// The caller may act and learn in them in any order.
template <approximators::ActionValue Q>
class QLearning : public IndexAgent<QLearning<Q>> {
 public:
  using typename IndexAgent<QLearning>::Action;

  /// The memory of one reader: a workspace and the values of each dimension, and the best action.
  struct Workspace {
    std::vector<typename Q::Workspace> networks;
    std::vector<std::vector<double>> values;
    std::vector<std::size_t> action;
  };

  /// Takes an approximator for each dimension of actions. Throws std::invalid_argument naming the
  /// field that is out of range, if there is no approximator, or if they differ in their inputs.
  QLearning(std::vector<Q> networks, const QLearningConfig& config, std::uint64_t seed)
      : config_(checked_schedule(config)),
        networks_(of_same_inputs(std::move(networks))),
        exploration_(config, seed),
        range_(config.discount),
        learning_rate_(config.learning_rate),
        workspace_(workspace()),
        action_values_(n_dimensions()),
        episodes_(new_episode()) {}
  /// With actions of one dimension.
  QLearning(Q network, const QLearningConfig& config, std::uint64_t seed)
      : QLearning(detail::only(std::move(network)), config, seed) {}

  const QLearningConfig& config() const noexcept { return config_; }
  /// The approximator of each dimension of actions.
  std::span<Q> networks() noexcept { return networks_; }
  std::span<const Q> networks() const noexcept { return networks_; }
  /// The workspace in which the agent itself acts and learns.
  const Workspace& agent_workspace() const noexcept { return workspace_; }

  std::size_t n_inputs() const { return networks_.front().n_inputs(); }
  /// Dimensions of an action.
  std::size_t n_dimensions() const noexcept { return networks_.size(); }
  /// Actions of a dimension.
  std::size_t n_actions(std::size_t d) const { return networks_[d].n_actions(); }

  /// Alpha, as set, or as progress has made it.
  double learning_rate() const noexcept { return learning_rate_; }

  /// Begins an episode: learns the pending transitions of the last one, and resets the number of
  /// steps, which decides about the greedy first steps. The caller must call it, since learning a
  /// terminated transition does not. Throws std::invalid_argument if the environment does not
  /// exist, and std::overflow_error if learning does.
  void begin_episode(std::size_t environment = 0) {
    Episode& episode = episodes_.of(environment);
    episode.exploration.begin();
    if (episode.buffer.size() > 0) learn_waiting(episode);
  }

  /// Lets the approximators write to the memory that they will need, so that first steps are fast.
  void warm_caches()
    requires requires(Q& q, typename Q::Workspace& workspace) { q.warm_caches(workspace); }
  {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      networks_[d].warm_caches(workspace_.networks[d]);
    }
  }

  /// Makes a workspace for values and best_action. Many threads may call these at once, each with a
  /// separate workspace, while the agent neither explores nor learns.
  Workspace workspace() const {
    Workspace workspace;
    for (const Q& network : networks_) {
      workspace.networks.push_back(network.workspace());
      workspace.values.emplace_back(network.n_actions());
    }
    workspace.action.resize(n_dimensions());
    return workspace;
  }

  /// Returns Q_d(state, a) for every action a of dimension d; `averaged` selects the average of the
  /// weights, if the approximator keeps one. The span is valid until the workspace is used again.
  /// Shape: state (l,) in [0, 1]. Throws std::invalid_argument for others.
  std::span<const double> values(std::span<const double> state, Workspace& workspace,
                                 std::size_t d = 0, bool averaged = false) const {
    const Q& q = networks_[d];
    std::vector<double>& row = workspace.values[d];
    if constexpr (requires { q.averaged_values(state, workspace.networks[d], row); }) {
      if (averaged) {
        q.averaged_values(state, workspace.networks[d], row);
        return row;
      }
    }
    q.values(state, workspace.networks[d], row);
    return row;
  }

  /// Reads a state for best_of. Many threads may call it at once, with a workspace each.
  void read(std::span<const double> state, Workspace& workspace) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) read(state, workspace, d, true);
  }

  /// Learns one transition of dt usual steps; `next_mask` restricts the actions of the next state.
  /// Throws std::invalid_argument for a reward that is not finite or beyond +- 1e300, an impossible
  /// dt, or an environment that does not exist; then nothing has been learned. Throws
  /// std::overflow_error if a weight of the approximator would leave its range; then the transition
  /// may have been learned in part.
  void learn(std::span<const double> state, Action action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0,
             ActionMask next_mask = {}, double dt = 1.0) {
    // Refuses at once what could not be learned: a correction may come later.
    this->require_transition(state, action, reward, next_state, next_mask);
    require_duration(dt);
    Episode& episode = episodes_.of(environment);
    if constexpr (kHasRange) {
      if (adapts_range() && range_.note(reward, terminated, episode.rewards, dt)) {
        for (Q& network : networks_) network.set_output_range(range_.low(), range_.high());
      }
    }
    // The next state first: the network then remembers it, corrected, for the next decision.
    const double next_value = terminated ? 0.0 : state_value(next_state, next_mask);
    NStepBuffer& buffer = episode.buffer;
    if (!buffer.is_continued_by(state)) learn_waiting(episode);
    buffer.add(state, action, reward, next_state, dt);
    episode.next_mask.assign(next_mask.begin(), next_mask.end());
    if (terminated) {
      learn_all(buffer, 0.0);
    } else if (buffer.is_full()) {
      learn_oldest(buffer, next_value);
    }
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    if (self.n_dimensions() == 1) {
      archive.part("action_value", self.networks_.front());
    } else {
      archive.within("action_value", [&] {
        for (std::size_t d = 0; d < self.n_dimensions(); ++d) {
          archive.part(std::to_string(d), self.networks_[d]);
        }
      });
    }
    Exploration::serialize(self.exploration_, archive);
    archive.part("range", self.range_);
    QLearning::serialize_rates(self, archive);
    Episodes<Episode>::serialize(
        self.episodes_, archive, [&self] { return self.new_episode(); },
        [&](auto& episode) { serialize_episode(self, episode, archive); });
    if constexpr (Archive::kReads) {
      self.apply_rates();
      self.workspace_ = self.workspace();  // with reserved memory, which copies do not keep
    }
  }

 private:
  friend class WithRates<QLearning>;
  friend class IndexAgent<QLearning>;

  /// Whether counts of firing units, which may have the order of the values, can be read instead.
  static constexpr bool kCounts = approximators::CountedActionValue<Q>;
  static constexpr bool kHasRange = requires(Q& q) { q.set_output_range(0.0, 1.0); };

  /// The state of the present episode in one environment.
  struct Episode {
    NStepBuffer buffer;
    std::vector<std::uint8_t> next_mask;  ///< of the state where the newest step led
    Exploration::Episode exploration;
    ReturnRange::Rewards rewards = {};
  };

  /// The state of an environment before its first step.
  Episode new_episode() const {
    return {NStepBuffer(static_cast<std::size_t>(config_.n_steps), n_inputs(), n_dimensions()),
            {},
            {.kept = std::vector<std::size_t>(n_dimensions())},
            adapts_range() ? range_.no_rewards() : ReturnRange::Rewards{}};
  }

  /// Lists what is saved of an environment's episode; see core/state.hpp.
  template <class Self, class Listed, class Archive>
  static void serialize_episode(Self& self, Listed& episode, Archive& archive) {
    archive.part("n_step_buffer", episode.buffer);
    const auto n_actions_of = self.n_actions_of();
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

  /// Returns the networks. Throws std::invalid_argument without any, or if their inputs differ.
  static std::vector<Q> of_same_inputs(std::vector<Q> networks) {
    core::require(!networks.empty(), "networks", "at least one", networks.size());
    const std::size_t n = networks.front().n_inputs();
    for (const Q& network : networks) {
      core::require(network.n_inputs() == n, "networks", "of the same inputs", network.n_inputs());
    }
    return networks;
  }

  /// Computes the values of all actions of dimension d, or only their firing counts if these have
  /// the same order, into the workspace; by the average of the weights if `averaged`.
  void read(std::span<const double> state, Workspace& workspace, std::size_t d,
            bool averaged) const {
    if constexpr (kCounts) {
      const Q& q = networks_[d];
      if (q.values_rise()) return q.count(state, workspace.networks[d], averaged);
    }
    static_cast<void>(values(state, workspace, d, averaged));
  }
  /// Makes the values or counts of actions that are not allowed lower than all others.
  void exclude(ActionMask mask, Workspace& workspace, std::size_t d) const {
    if constexpr (kCounts) {
      if (networks_[d].values_rise()) return workspace.networks[d].counts().exclude(mask);
    }
    agents::exclude(mask, workspace.values[d]);
  }
  /// The largest of the values that were read last.
  double best_value_of(const Workspace& workspace, std::size_t d) const {
    if constexpr (kCounts) {
      const Q& q = networks_[d];
      if (q.values_rise()) return q.value_of_count(workspace.networks[d].counts().largest());
    }
    return best_value(std::span<const double>(workspace.values[d]));
  }
  /// Returns an action with the largest value, or with a value that ties with it.
  std::size_t best_in(const Workspace& workspace, std::size_t d, core::Random& ties) const {
    const EpsilonGreedy& policy = exploration_.policy();
    if constexpr (kCounts) {
      const Q& q = networks_[d];
      if (q.values_rise()) {
        const auto& counts = workspace.networks[d].counts();
        const double least = best_value_of(workspace, d) - policy.config().tie_tolerance;
        std::int32_t tied = counts.largest();
        while (tied > 0 && q.value_of_count(tied - 1) >= least) --tied;
        return policy.best_action(counts.of_actions(), tied, ties);
      }
    }
    return policy.best_action(workspace.values[d], ties);
  }

  void read_to_explore(std::span<const double> state, const Episode& /*episode*/) {
    for (std::size_t d = 0; d < n_dimensions(); ++d) read(state, workspace_, d, false);
  }
  /// Returns a best one of the allowed actions in the state that was read last.
  Action best_of_read(Workspace& workspace, core::Random& ties, ActionMask mask) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      exclude(take_part(mask, n_actions(d)), workspace, d);
      workspace.action[d] = best_in(workspace, d, ties);
    }
    return workspace.action;
  }

  /// The value of a state: the mean over dimensions of the best value of an allowed action.
  double state_value(std::span<const double> state, ActionMask mask) {
    double sum = 0.0;
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      read(state, workspace_, d, false);
      exclude(take_part(mask, n_actions(d)), workspace_, d);
      sum += best_value_of(workspace_, d);
    }
    return sum / static_cast<double>(n_dimensions());
  }

  /// Learns the oldest step of the buffer; `value` is that of the state after the last one. Each
  /// dimension moves by the error of the mean over dimensions.
  void learn_oldest(NStepBuffer& buffer, double value) {
    const double target = buffer.return_of_oldest(value, config_.discount);
    const NStepBuffer::Step& oldest = buffer.take_oldest();
    if (n_dimensions() == 1) {  // passes the target on: value plus error would be rounded
      update(oldest, 0, target);
      return;
    }
    double sum = 0.0;
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      action_values_[d] =
          networks_[d].value(oldest.state, workspace_.networks[d], oldest.action[d]);
      sum += action_values_[d];
    }
    const double error = target - sum / static_cast<double>(n_dimensions());
    for (std::size_t d = 0; d < n_dimensions(); ++d) update(oldest, d, action_values_[d] + error);
  }
  void update(const NStepBuffer::Step& step, std::size_t d, double target) {
    networks_[d].update(step.state, workspace_.networks[d], step.action[d], target, learning_rate_);
  }

  /// Learns the pending steps, with the best value of the state after the newest one.
  void learn_waiting(Episode& episode) {
    learn_all(episode.buffer, state_value(episode.buffer.next_state(), episode.next_mask));
  }
  void learn_all(NStepBuffer& buffer, double value) {
    while (buffer.size() > 0) learn_oldest(buffer, value);
  }

  QLearningConfig config_;
  detail::Parts<Q> networks_;  ///< one for each dimension of actions
  Exploration exploration_;
  ReturnRange range_;
  double learning_rate_;
  Workspace workspace_;
  std::vector<double> action_values_;  ///< Q_d of the action that is corrected
  Episodes<Episode> episodes_;
};

}  // namespace sdnn::agents
