/// An actor-critic, linear in the SDNN code, in integers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/actor_critic_config.hpp"
#include "sdnn/agents/detail/error_scale.hpp"
#include "sdnn/agents/detail/linear_td.hpp"
#include "sdnn/agents/detail/q_lambda_episode.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/agents/softmax_policy.hpp"
#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// An agent that learns a softmax policy over the actions of each dimension, and the value of
/// states, by traces.
///
/// The critic learns V(s) by true-online TD(lambda), as QLambda learns Q(s, a), with one action.
/// The actor moves its preferences by
///
///     z <- gamma lambda z + gradient of log pi(a | s)
///     w <- w + beta / n (clip(delta / sigma) z + entropy * gradient of H(pi(. | s)))
///     delta = r + gamma V(s') - V(s)
///
/// where n is the number of columns of the code that are not 0, sigma the running root mean square
/// of delta, and clip limits to [-3, 3]. Since errors are divided by sigma and n hardly changes, a
/// step of beta moves preferences equally far in every state and for every scale of rewards.
///
/// After the scaling of observations everything is an integer; see QLambda and SoftmaxPolicy.
///
/// Source: Barto, A., Sutton, R., Anderson, C. (1983); Degris, T., Pilarski, P., Sutton, R. (2012),
/// Model-free reinforcement learning with continuous action in practice (traces of actor and
/// critic), with a softmax over bins.
class ActorCritic : public IndexAgent<ActorCritic> {
 public:
  using Readout = approximators::LinearSDNN;
  using Policy = SoftmaxPolicy;

  /// The memory in which a thread reads the agent.
  struct Workspace {
    Readout::Workspace critic;
    Policy::Workspace actor;
    std::vector<double> values;
    std::vector<std::size_t> action;
  };

  /// Takes a critic of one action. Throws std::invalid_argument naming a field out of range.
  ActorCritic(Readout critic, std::vector<std::size_t> n_actions, const ActorCriticConfig& config,
              std::uint64_t seed)
      : config_(config),
        td_(std::move(critic), config.discount, config.trace_decay),
        actor_(std::move(n_actions), this->critic().n_slots()),
        exploration_(seed, core::Stream::exploration),
        ties_(seed, core::Stream::evaluation_ties),
        workspace_(workspace()),
        episodes_(new_episode()) {
    core::check_fields(config_);
    apply_rates();
  }

  const ActorCriticConfig& config() const noexcept { return config_; }
  /// The critic, as the only network with values, like the networks of other agents.
  std::span<Readout> networks() noexcept { return {&td_.readout(), 1}; }
  std::span<const Readout> networks() const noexcept { return {&td_.readout(), 1}; }
  const Readout& critic() const noexcept { return td_.readout(); }
  const Policy& actor() const noexcept { return actor_; }

  std::size_t n_inputs() const { return critic().n_inputs(); }
  std::size_t n_dimensions() const { return actor_.n_dimensions(); }
  std::size_t n_actions(std::size_t d) const { return actor_.n_actions(d); }
  /// Transitions that were learned.
  std::int64_t n_learned() const noexcept { return n_learned_; }

  /// The critic's alpha at present, in steps of 2^-16; epsilon is 0: the policy itself is random.
  double learning_rate() const noexcept { return static_cast<double>(rate_) / kOne; }
  double epsilon() const noexcept { return 0.0; }

  /// Begins an episode: ends the traces. Throws std::invalid_argument if the environment does not
  /// exist.
  void begin_episode(std::size_t environment = 0) {
    Episode& episode = episodes_.of(environment);
    end(episode);
    episode.mask.clear();
    episode.has_acted = false;
  }

  Workspace workspace() const {
    return {critic().workspace(), actor_.workspace(), {}, std::vector<std::size_t>(n_dimensions())};
  }

  /// The probabilities of the dimension's actions. Valid until the workspace is used again. Shape:
  /// state (l,) in [0, 1]. Throws std::invalid_argument.
  std::span<const double> values(std::span<const double> state, Workspace& workspace,
                                 std::size_t d = 0, bool /*averaged*/ = false) const {
    read(state, workspace);
    actor_.allow({}, workspace.actor);
    const auto terms = actor_.terms(workspace.actor, d);
    std::uint64_t sum = 0;
    for (const auto& term : terms) sum += term.weight;
    workspace.values.clear();
    for (const auto& term : terms) {
      workspace.values.push_back(static_cast<double>(term.weight) / static_cast<double>(sum));
    }
    return workspace.values;
  }
  /// V(state). Throws std::invalid_argument.
  double value(std::span<const double> state) {
    critic().read(state, workspace_.critic);
    return critic().value_of(critic().sum(workspace_.critic, kOnlyAction));
  }

  /// Reads a state for best_of. Many threads may call it at once, with a workspace each.
  void read(std::span<const double> state, Workspace& workspace) const {
    critic().read(state, workspace.critic);
    actor_.read(workspace.critic.code(), workspace.actor);
  }

  /// Returns SoftmaxPolicy::mean_offset in the state that the workspace, or the agent, read last.
  double mean_offset(const Workspace& workspace, std::size_t d, std::size_t action) const {
    return actor_.mean_offset(workspace.actor, d, action);
  }
  double mean_offset(std::size_t d, std::size_t action) const {
    return mean_offset(workspace_, d, action);
  }

  /// Learns one transition of dt usual steps. Traces are reset if it does not begin in the state in
  /// which the last one ended. Throws std::invalid_argument for a reward that is not finite or
  /// beyond +- 1e300, an impossible dt, or an environment that does not exist; then nothing has
  /// been learned.
  void learn(std::span<const double> state, Action action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0,
             ActionMask next_mask = {}, double dt = 1.0) {
    require_transition(state, action, reward, next_state, next_mask);
    require_duration(dt);
    Episode& episode = episodes_.of(environment);
    if (!std::ranges::equal(episode.next_state, state)) {
      if (!episode.has_acted) episode.mask.clear();
      end(episode);
    }
    episode.has_acted = false;
    episode.dt = dt;
    critic().read_next(state, episode.next);  // at no cost if acting has read it
    std::swap(episode.present, episode.next);
    critic().read_next(next_state, episode.next);
    ++n_learned_;
    apply_rates();
    td_.fit_unit(reward, episodes_);
    std::int64_t next = 0;
    if (!terminated) {
      next = td_.in_range(episodes_, [&] { return critic().sum(episode.next, kOnlyAction); });
    }
    const bool is_allowed = allows_action(episode.mask, action, n_actions_of());
    learn_step(episode, action, reward, next, terminated ? nullptr : &episode.next.code(),
               is_allowed ? ActionMask(episode.mask) : ActionMask());
    if (terminated) {
      end(episode);
      episode.mask.clear();
      return;
    }
    episode.next_state.assign(next_state.begin(), next_state.end());
    episode.mask.assign(next_mask.begin(), next_mask.end());
  }

  /// Learns that a teacher chose an action in a state, and that its return was `value`: the critic
  /// by its error, the actor by a step along the gradient of log pi(action | state). Ends the
  /// episode of environment 0. Throws std::invalid_argument for the same arguments as `learn`.
  void imitate(std::span<const double> state, Action action, double value,
               double /*margin*/ = 0.0) {
    require_transition(state, action, value, state, {});
    begin_episode();
    Episode& episode = episodes_.of(0);
    critic().read_next(state, episode.present);
    ++n_learned_;
    apply_rates();
    td_.fit_unit(value, episodes_);
    const std::int64_t sum =
        td_.in_range(episodes_, [&] { return critic().sum(episode.present, kOnlyAction); });
    td_.correct(episode, episodes_, kOnlyAction, {critic().units_of(value) - sum, 0}, rate_, false);
    actor_.read(episode.present.code(), workspace_.actor);
    actor_.allow({}, workspace_.actor);
    actor_.learn(episode.present.code(), workspace_.actor, action, episode.actor_trace,
                 {.error = Policy::kErrorOne, .rate = kOne, .entropy = 0, .decay = 0});
    end(episode);
  }

  /// Makes the unit of values smaller if it is larger than necessary; see LinearTD.
  void refine_unit(std::int32_t size_in_window, std::int32_t size) {
    td_.refine_unit(size_in_window, size, episodes_);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.part("action_value", self.td_.readout());
    archive.part("actor", self.actor_);
    archive.part("exploration", self.exploration_);
    archive.part("ties", self.ties_);
    archive.part("error_scale", self.scale_);
    ActorCritic::serialize_rates(self, archive);
    archive.number("n_learned", self.n_learned_);
    Episodes<Episode>::serialize(
        self.episodes_, archive, [&self] { return self.new_episode(); },
        [&](auto& episode) { self.serialize_episode(self, episode, archive); });
    if constexpr (Archive::kReads) {
      archive.expect(self.n_learned_ >= 0 && self.n_learned_ <= kMostLearned, "n_learned",
                     "in [0, 2^45]");
      self.apply_rates();
    }
  }

 private:
  friend class WithRates<ActorCritic>;
  friend class IndexAgent<ActorCritic>;

  static constexpr std::int64_t kMostLearned = std::int64_t{1} << 45;
  static constexpr std::int32_t kOne = Readout::kRateOne;
  static constexpr std::size_t kOnlyActions[] = {0};
  static constexpr Action kOnlyAction{kOnlyActions};

  /// The state of the present episode in one environment.
  struct Episode {
    approximators::LinearTrace trace;  ///< of the critic
    approximators::LinearTrace actor_trace;
    Readout::Workspace present;      ///< the code of the state that is learned
    Readout::Workspace next;         ///< the code of the state that was read last
    std::vector<double> next_state;  ///< where the last transition ended; empty: it terminated
    std::vector<std::uint8_t> mask;  ///< of the state in which the next action is taken
    bool has_acted = false;          ///< whether the mask is that of an act not learned yet
    std::int64_t old_value = 0;      ///< V_old, in the critic's units
    double dt = 1.0;                 ///< the duration of the transition that is learned
    double trace_dt = 1.0;           ///< the duration of the one before, see LinearTD
  };

  /// The state of an environment before its first step.
  Episode new_episode() const {
    return {.trace = critic().trace(),
            .actor_trace = actor_.trace(),
            .present = critic().workspace(),
            .next = critic().workspace(),
            .next_state = {},
            .mask = {}};
  }

  /// Lists what is saved of an environment's episode; see core/state.hpp.
  template <class Self, class Listed, class Archive>
  static void serialize_episode(Self& self, Listed& episode, Archive& archive) {
    archive.part("trace", episode.trace);
    archive.part("actor_trace", episode.actor_trace);
    archive.number("old_value", episode.old_value);
    serialize_duration("trace_dt", episode.trace_dt, archive);
    archive.numbers("next_state", episode.next_state);
    archive.number("has_acted", episode.has_acted);
    serialize_mask("mask", episode.mask, archive, self.n_dimensions(), self.n_actions_of());
    if constexpr (Archive::kReads) {
      archive.expect(episode.next_state.empty() || (episode.next_state.size() == self.n_inputs() &&
                                                    core::are_unit_values(episode.next_state)),
                     "next_state", "a state in [0, 1], or empty");
      archive.expect(!Readout::is_too_large(episode.old_value), "old_value", "below 2^33 in size");
    }
  }

  void apply_rates(const auto& /*change*/) { apply_rates(); }
  /// Sets the learning rates of critic and actor by the schedule, or the one that a caller has set.
  void apply_rates() {
    const auto by_steps = [this](double first, const std::optional<double>& last) {
      return std::max(1, detail::scheduled(first, last.value_or(first), n_learned_,
                                           config_.schedule_steps, kOne));
    };
    rate_ = by_steps(config_.learning_rate, config_.final_learning_rate);
    if (rates_.set_learning_rate) {
      rate_ = std::max(1, static_cast<std::int32_t>(std::lround(*rates_.set_learning_rate * kOne)));
    }
    actor_rate_ = by_steps(config_.actor_learning_rate, config_.final_actor_learning_rate);
  }

  core::Random& evaluation_ties() noexcept { return ties_; }
  /// Draws an action by the policy.
  Action explore(std::span<const double> state, Episode& episode, ActionMask mask) {
    critic().read_next(state, episode.next);
    actor_.read_and_keep(episode.next.code(), workspace_.actor);
    actor_.allow(mask, workspace_.actor);
    actor_.draw(workspace_.actor, exploration_, workspace_.action);
    episode.mask.assign(mask.begin(), mask.end());
    episode.has_acted = true;
    return workspace_.action;
  }
  /// Returns a most probable one of the allowed actions in the state that was read last.
  Action best_of_read(Workspace& workspace, core::Random& ties, ActionMask mask) const {
    actor_.allow(mask, workspace.actor);
    actor_.best(workspace.actor, ties, workspace.action);
    return workspace.action;
  }

  /// Ends the traces, so that no later reward is credited to past steps.
  static void end(Episode& episode) noexcept {
    episode.trace.clear();
    episode.actor_trace.clear();
    episode.old_value = 0;
    episode.dt = episode.trace_dt = 1.0;
    episode.next_state.clear();
  }

  /// Learns one step; `next` is V(s') in the critic's units. Without a next code s' is terminal.
  void learn_step(Episode& episode, Action action, double reward, std::int64_t next,
                  const approximators::LinearCode* next_code, ActionMask mask) {
    const bool is_dutch = n_environments() == 1;
    const auto error = td_.error_of(episode, episodes_, kOnlyAction, reward, next, is_dutch);
    actor_.read(episode.present.code(), workspace_.actor);
    actor_.allow(mask, workspace_.actor);
    actor_.learn(episode.present.code(), workspace_.actor, action, episode.actor_trace,
                 {.error = scale_.normalized(error.error, critic().exponent().value_or(0)),
                  .rate = actor_rate_,
                  .entropy = static_cast<std::int32_t>(std::lround(config_.entropy * kOne)),
                  .decay = td_.decay(episode)},
                 // Another environment would change the weights before an act in s'.
                 n_environments() == 1 ? next_code : nullptr);
    td_.correct(episode, episodes_, kOnlyAction, error, rate_, is_dutch);
  }

  ActorCriticConfig config_;
  detail::LinearTD<Episode> td_;
  Policy actor_;
  core::Random exploration_;
  core::Random ties_;
  detail::ErrorScale scale_;
  std::int64_t n_learned_ = 0;
  std::int32_t rate_ = 0;        ///< the critic's alpha, in units of 1 / kOne
  std::int32_t actor_rate_ = 0;  ///< the actor's
  Workspace workspace_;
  Episodes<Episode> episodes_;
};

}  // namespace sdnn::agents
