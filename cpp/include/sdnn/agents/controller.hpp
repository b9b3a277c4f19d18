/// An agent in the units of its task: observations in, actions out.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/actions.hpp"
#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/controller_config.hpp"
#include "sdnn/agents/detail/approximator_of.hpp"
#include "sdnn/agents/detail/greedy_action.hpp"
#include "sdnn/agents/detail/last_actions.hpp"
#include "sdnn/agents/detail/last_states.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/history.hpp"
#include "sdnn/agents/last_readings.hpp"
#include "sdnn/agents/latest_transitions.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/agents/range_use.hpp"
#include "sdnn/agents/reward_scale.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/agents/warm_up.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/identity.hpp"
#include "sdnn/core/pcg64.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents {

/// An agent of any kind that observes variables and chooses actions in the units of its task.
///
/// If the ranges of observations are not known, it begins with a *warm-up*: it acts at random, fits
/// the ranges to the observations, and then learns its transitions in order (fuzzy Q-learning does
/// not). Afterwards ranges are fixed, unless they are running ranges.
///
/// Thread safety: const functions may be called by many threads at once, with a workspace each.
class Controller : public WithRates<Controller> {
 public:
  /// The memory in which a thread reads the controller, valid while identity() stays the same.
  struct Workspace {
    AnyWorkspace agent;
    std::vector<double> state, action, held;
    std::vector<std::size_t> indices;
    detail::LastStates::Room room;
  };

  /// `tables` are the patterns of each input. Throws std::invalid_argument naming the impossible
  /// field; std::length_error if the approximator would exceed its limit of memory.
  explicit Controller(ControllerConfig config, std::vector<coding::PatternTable> tables = {})
      : Controller(std::move(config), std::move(tables), PrivateTag()) {
    if (observations_.is_fitted()) {
      fit(observations_, {});
      return;
    }
    try_to_fit();
    warm_up_.emplace(new_warm_up());
  }

  /// Restores a controller from a state that core::state_of wrote. Throws std::invalid_argument
  /// naming the part that does not fit, before large allocations, and the constructor's errors.
  static Controller restored(ControllerConfig config, const core::State& state) {
    core::StateReader reader(state);
    Controller controller(std::move(config), detail::tables_in(state), PrivateTag());
    serialize(controller, reader);
    reader.finish();
    return controller;
  }

  const ControllerConfig& config() const noexcept { return config_; }
  /// The settings as used: sizes that follow from the task are known once the warm-up is over.
  const AnyApproximatorConfig& approximator() const noexcept { return approximator_; }
  const Observations& observations() const noexcept { return observations_; }
  const Actions& actions() const noexcept { return actions_; }
  /// The filter by which states depend on earlier observations; without effect in the warm-up.
  const HistoryFilter& history() const noexcept { return last_states_.history(); }
  std::size_t n_variables() const noexcept { return observations_.n_variables(); }
  std::size_t n_dimensions() const noexcept { return actions_.n_dimensions(); }

  /// Whether it still acts at random to find the ranges of its observations.
  bool is_warming_up() const noexcept { return warm_up_.has_value(); }

  /// The agent, whose states are in [0, 1]. Requires that the warm-up is over.
  AnyAgent& agent() { return agent_.value(); }
  const AnyAgent& agent() const { return agent_.value(); }

  /// Alpha and epsilon as they are now; 0 in fuzzy Q-learning, which has no schedule.
  double learning_rate() const {
    return rate([](const auto& agent) { return agent.learning_rate(); },
                [this](const auto& config) { return rates_.learning_rate(config); });
  }
  double epsilon() const {
    return rate([](const auto& agent) { return agent.epsilon(); },
                [this](const auto& config) { return rates_.epsilon(config); });
  }

  /// Sets the number of environments (or robots) from which the agent learns at once. Environments
  /// are numbered from 0 and have separate episodes; the agent learns the pending transitions of
  /// removed ones, then forgets them. Throws std::invalid_argument unless n is in [1, 2^14].
  void set_n_environments(std::size_t n) {
    if (warm_up_) {
      warm_up_->set_n_environments(n);
    } else {
      std::visit([n](auto& agent) { agent.set_n_environments(n); }, *agent_);
      if (latest_) latest_->set_n_environments(n);
    }
    last_actions_.forget_from(n);
    last_states_.forget_from(n);
    readings_.forget_from(n);
  }
  std::size_t n_environments() const {
    if (warm_up_) return warm_up_->n_environments();
    return std::visit([](const auto& agent) { return agent.n_environments(); }, *agent_);
  }

  /// Begins an episode in the environment. Throws std::invalid_argument if it does not exist.
  void begin_episode(std::size_t environment = 0) {
    if (warm_up_) {
      warm_up_->begin_episode(environment);
    } else {
      begin_learned_episode(environment);
    }
    readings_.forget(environment);
  }
  /// Begins a greedy episode: later acts without `explore` do not continue the learned one.
  void begin_greedy_episode(std::size_t environment = 0) {
    require_environment(environment);
    readings_.forget_greedy(environment);
    last_states_.forget_greedy(environment);
  }

  /// Returns the action to take, a best one without `explore`. The span is valid until the next
  /// act. `mask` may restrict discrete actions. Shapes: observation (n_variables,), the action
  /// (n_dimensions,). Throws std::invalid_argument naming an unusable number of the observation
  /// (see ObservationScale), mask or environment; then nothing has changed. With Missing::hold
  /// readings are stored, separately for greedy episodes.
  std::span<const double> act(std::span<const double> observation, bool explore = true,
                              std::size_t environment = 0, ActionMask mask = {}) {
    actions_.require_mask("mask", mask);
    const auto filled = readings_.filled(observation, environment, !explore, held_);
    if (warm_up_) {
      act_at_random(observation, explore, environment, mask);
      readings_.note(held_, environment, !explore);
      return action_;
    }
    last_states_.read(observations_, environment, filled, state_, explore);
    std::visit(
        [&](auto& agent) {
          actions_.take(agent.act(state_, explore, environment, mask), action_, indices_);
          if (!explore) detail::move_to_mean(actions_, agent, action_, indices_);
        },
        *agent_);
    last_states_.keep(observations_, environment, explore);
    last_states_.note_action(environment, action_, explore);
    if (explore && !is_fuzzy(approximator_)) last_actions_.note(environment, action_, indices_);
    readings_.note(held_, environment, !explore);
    return action_;
  }

  /// Makes the memory of a thread that calls `best_action`. Requires that the warm-up is over.
  Workspace workspace() const {
    return {std::visit([](const auto& agent) { return AnyWorkspace(agent.workspace()); }, *agent_),
            std::vector<double>(state_.size()),
            std::vector<double>(n_dimensions()),
            {},
            std::vector<std::size_t>(n_dimensions()),
            {}};
  }
  /// A number that no other controller has. It changes when inputs are added.
  std::uint64_t identity() const noexcept { return identity_.number(); }

  /// Returns the greedy action without changing the controller, so that several threads may call
  /// it; `ties` draws among several best ones. The span is valid until the workspace is used again.
  /// Requires that the warm-up is over. Missing readings are the last ones of environment 0.
  std::span<const double> best_action(std::span<const double> observation, Workspace& workspace,
                                      core::Random& ties, ActionMask mask = {}) const {
    actions_.require_mask("mask", mask);
    find_state(observation, workspace);
    std::visit(
        [&](const auto& agent) {
          auto& agent_workspace = workspace_of(workspace, agent);
          detail::take_greedy(actions_, agent,
                              agent.best_action(workspace.state, agent_workspace, ties, mask),
                              workspace, agent_workspace);
        },
        *agent_);
    return workspace.action;
  }

  /// The three steps of a greedy act, of which threads can share the longest. `prepare` returns and
  /// stores the state of an observation; `read` evaluates the approximator, in any thread;
  /// `best_of` returns a best allowed action for it. Spans are valid until the next call.
  std::span<const double> prepare(std::span<const double> observation, std::size_t environment) {
    const auto filled = readings_.filled(observation, environment, true, held_);
    last_states_.read(observations_, environment, filled, state_, false);
    last_states_.keep(observations_, environment, false);
    readings_.note(held_, environment, true);
    return state_;
  }
  void read(std::span<const double> state, Workspace& workspace) const {
    std::visit([&](const auto& agent) { agent.read(state, workspace_of(workspace, agent)); },
               *agent_);
  }
  std::span<const double> best_of(Workspace& workspace, std::size_t environment,
                                  ActionMask mask = {}) {
    actions_.require_mask("mask", mask);
    std::visit(
        [&](auto& agent) {
          auto& agent_workspace = workspace_of(workspace, agent);
          detail::take_greedy(actions_, agent, agent.best_of(agent_workspace, mask), workspace,
                              agent_workspace);
        },
        *agent_);
    last_states_.note_action(environment, workspace.action, false);
    return workspace.action;
  }

  /// Returns the values of all actions of dimension d, which decide greedy actions; fuzzy rules
  /// return only the value of the observation. The span is valid until the workspace is used again.
  /// Requires that the warm-up is over and d < n_dimensions(). Missing readings as in best_action.
  /// Throws std::invalid_argument for an unusable observation.
  std::span<const double> values(std::span<const double> observation, Workspace& workspace,
                                 std::size_t d) const {
    find_state(observation, workspace);
    return std::visit(
        [&](const auto& agent) {
          return agent.values(workspace.state, workspace_of(workspace, agent), d, true);
        },
        *agent_);
  }

  /// The size of recent rewards, and the first reward that was refused as far too large.
  const RewardScale& reward_scale() const noexcept { return reward_scale_; }
  /// The number of learned transitions. Those of a warm-up count, unless the agent is on-policy;
  /// steps of excursions do not. Where an agent does not count itself, refused rewards count, too.
  std::uint64_t n_learned() const;

  /// Learns a transition, unless its reward is far larger than the recent ones; see RewardScale.
  /// The action may be any action of the task; in a box, the agent's nearest action is learned.
  /// Fuzzy Q-learning accepts only the action of the last act with `explore` in the environment.
  /// `next_mask` restricts the actions of the next state; dt is the duration in usual steps, after
  /// which gamma^dt remains of the next state's value. Throws std::invalid_argument for unusable
  /// arguments, and then nothing has changed; std::overflow_error for a weight beyond its range.
  void learn(std::span<const double> observation, std::span<const double> action, double reward,
             std::span<const double> next_observation, bool terminated, std::size_t environment = 0,
             ActionMask next_mask = {}, double dt = 1.0) {
    if (terminated) next_mask = {};
    actions_.require_mask("next_mask", next_mask);
    core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
    require_duration(dt);
    require_environment(environment);
    const auto filled = readings_.filled(observation, next_observation, environment);
    if (warm_up_) {
      remember({false, environment, observation, action, reward, next_observation, terminated,
                next_mask, warm_up_->has_acted(environment), dt});
      return;
    }
    last_states_.start(observations_, environment, filled.observation, state_);
    find_indices(action, environment);
    last_states_.follow(observations_, environment, action, filled.next_observation, next_state_);
    learn_scaled(reward, terminated, environment, next_mask, has_acted(environment), dt);
    readings_.note_step(environment);
    notes_.note(observation);
    const WarmUp::Step step{false,  environment,      observation, action,
                            reward, next_observation, terminated};
    if (latest_ && latest_->learn(step)) add_inputs();
  }

  /// Throws std::invalid_argument for a transition that learn would refuse; changes nothing.
  void check(std::span<const double> observation, std::span<const double> action, double reward,
             std::span<const double> next_observation, bool terminated, std::size_t environment,
             ActionMask next_mask, double dt = 1.0) const;

  /// Ends a warm-up in which a teacher acted. Ranges extend beyond the observations by twice their
  /// width at each end, because the agent will leave the teacher's path. Throws
  /// std::invalid_argument without a warm-up, or one without transitions.
  void end_warm_up_of_teacher();
  /// Learns an action that a teacher chose, and its return; see QLambda::imitate. Requires that the
  /// warm-up is over. Throws std::invalid_argument for an unusable observation and for agents
  /// without a linear readout; then nothing has changed.
  void imitate(std::span<const double> observation, std::span<const double> action, double value,
               double margin);

  /// Continues the episode of environment 0 by a teacher's action, for the history and the held
  /// readings of later observations. Learns nothing. Throws std::invalid_argument like imitate.
  void follow_teacher(std::span<const double> observation, std::span<const double> action);

  /// Returns the state of an observation in the greedy episode of environment 0, valid until the
  /// next call. Throws std::invalid_argument for an unusable observation.
  std::span<const double> state_of(std::span<const double> observation) {
    last_states_.peek(observations_, 0, readings_.filled(observation, 0, true, held_), state_,
                      peeked_);
    return state_;
  }

  /// How each variable used its range in the last 2,048 transitions or so.
  std::vector<std::optional<RangeUse>> range_use() const { return notes_.use(observations_); }

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive);

 private:
  friend class WithRates<Controller>;
  struct PrivateTag {};

  /// Factor of the evidence that inputs need after the warm-up, where they are tested repeatedly.
  static constexpr double kCaution = 1.5;

  Controller(ControllerConfig config, std::vector<coding::PatternTable> tables, PrivateTag)
      : config_(std::move(config)),
        tables_(std::move(tables)),
        approximator_(config_.approximator),
        observations_(config_.observation, is_sdnn(approximator_), is_sdnn(approximator_) ? 2 : 1,
                      detail::n_bins_of_inputs(approximator_, tables_)),
        actions_(config_.action, n_actions_in_box(approximator_)),
        notes_(n_variables()),
        readings_(observations_.last_readings()),
        last_actions_(n_dimensions()) {
    core::check_fields(config_);
    action_.resize(n_dimensions());
    indices_.resize(n_dimensions());
  }

  WarmUp new_warm_up() const;
  void try_to_fit() const;
  void fit(Observations observations, detail::LastStates last_states,
           const core::StateReader* reader = nullptr);
  void fit_to_warm_up(History history, double headroom);
  void act_at_random(std::span<const double> observation, bool explore, std::size_t environment,
                     ActionMask mask);
  void remember(const WarmUp::Step& step);
  void end_warm_up(double headroom = Observations::kHeadroom);
  void watch_for_inputs();
  void add_inputs();
  void replay(const WarmUp::Step& step, LastReadings& readings);
  template <class Archive>
  void begin_reading(bool is_warming_up, const Archive& archive);
  template <class Archive>
  void end_reading(const Archive& archive);

  /// Makes a change of rates in the agent, if there is one and it has rates.
  void apply_rates(const auto& change) {
    if (!agent_) return;
    std::visit(
        [&change](auto& agent) {
          if constexpr (requires { agent.set_progress(0.0); }) change(agent);
        },
        *agent_);
  }

  /// Returns of_agent(agent), or of_config(config) in the warm-up; 0 for agents without rates.
  double rate(const auto& of_agent, const auto& of_config) const {
    const auto agent_rate = [&of_agent](const auto& agent) {
      if constexpr (requires { agent.learning_rate(); }) return of_agent(agent);
      return 0.0;
    };
    const auto planned_rate = [&of_config](const auto& config) {
      if constexpr (requires { config.learning_rate; }) return of_config(config);
      return 0.0;
    };
    return agent_ ? std::visit(agent_rate, *agent_) : std::visit(planned_rate, config_.learning);
  }

  template <class Agent>
  static typename Agent::Workspace& workspace_of(Workspace& workspace, const Agent&) {
    return std::get<typename Agent::Workspace>(workspace.agent);
  }

  /// Writes the state of an observation into the workspace; see state_of.
  void find_state(std::span<const double> observation, Workspace& workspace) const {
    last_states_.peek(observations_, 0, readings_.filled(observation, 0, true, workspace.held),
                      workspace.state, workspace.room);
  }

  void require_environment(std::size_t environment) const {
    core::require(environment < n_environments(), "environment", "of those that there are",
                  environment);
  }

  void begin_learned_episode(std::size_t environment) {
    std::visit([environment](auto& agent) { agent.begin_episode(environment); }, *agent_);
    last_states_.forget(environment);
    if (latest_) latest_->begin_episode(environment);
  }

  void find_indices(std::span<const double> action, std::size_t environment);
  /// The action to learn, after find_indices: the indices, or numbers of a fuzzy agent.
  std::span<const std::size_t> learned_action(const auto& /*agent*/, std::size_t) const {
    return indices_;
  }
  static std::span<const double> learned_action(FuzzyQLearning& agent, std::size_t environment) {
    return agent.last_action(environment);
  }

  bool has_acted(std::size_t environment) const;
  void learn_scaled(double reward, bool terminated, std::size_t environment, ActionMask next_mask,
                    bool is_own, double dt);

  ControllerConfig config_;
  std::vector<coding::PatternTable> tables_;
  AnyApproximatorConfig approximator_;  ///< with the sizes of the task once the warm-up is over
  Observations observations_;
  Actions actions_;
  RangeNotes notes_;
  LastReadings readings_;
  std::optional<WarmUp> warm_up_;
  std::optional<AnyAgent> agent_;            ///< once the warm-up is over
  std::optional<LatestTransitions> latest_;  ///< where inputs that are left out can be added
  /// The last observation with held readings, its state, the state after it, and the last action.
  std::vector<double> held_, state_, next_state_, action_;
  std::vector<std::size_t> indices_;  ///< of the last action
  detail::LastActions last_actions_;
  detail::LastStates last_states_;
  detail::LastStates::Room peeked_;
  RewardScale reward_scale_;
  core::Identity identity_;
};

}  // namespace sdnn::agents

#include "sdnn/agents/detail/controller_imitation.hpp"
#include "sdnn/agents/detail/controller_warm_up.hpp"
