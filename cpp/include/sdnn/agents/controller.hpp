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
#include "sdnn/agents/detail/experience_of.hpp"
#include "sdnn/agents/detail/saved_tables.hpp"
#include "sdnn/agents/detail/taken_actions.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/last_readings.hpp"
#include "sdnn/agents/latest_transitions.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/agents/range_use.hpp"
#include "sdnn/agents/relevance.hpp"
#include "sdnn/agents/reward_scale.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/agents/warm_up.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/check_fields.hpp"
#include "sdnn/core/detail/identity.hpp"
#include "sdnn/core/pcg64.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents {

/// An agent of any kind that observes variables and chooses actions in the units of its task.
///
/// Where ranges of observations are not known it begins with a *warm-up*: it acts at random for a
/// while, takes the ranges from what it observed, and then learns what it did, in order; fuzzy
/// Q-learning, which can learn its own actions only, begins anew. From then on the ranges stay.
///
/// Thread safety: const functions may be called by many threads at once, with a workspace each.
class Controller : public WithRates<Controller> {
 public:
  /// What one reader owns, once the warm-up is over: for that controller and what it becomes.
  struct Workspace {
    AnyWorkspace agent;
    std::vector<double> state, action, held;
    std::vector<std::size_t> indices;
  };

  /// With SDNN-C, `tables` are patterns of each input. Throws std::invalid_argument naming the
  /// field that is impossible; std::length_error as the approximator does.
  explicit Controller(ControllerConfig config, std::vector<coding::PatternTable> tables = {})
      : Controller(std::move(config), std::move(tables), Unborn()) {
    if (observations_.is_fitted()) {
      fit();
      return;
    }
    Controller trial = *this;  // finds impossible settings before the warm-up
    trial.observations_.fit(std::vector<double>(n_variables()));
    trial.fit();
    warm_up_.emplace(new_warm_up());
  }

  /// A controller as it was when core::state_of wrote `state`. Throws std::invalid_argument naming
  /// what does not fit, before much memory is asked for; and as the constructor does.
  static Controller restored(ControllerConfig config, const core::State& state) {
    core::StateReader reader(state);
    Controller controller(std::move(config), detail::tables_in(state), Unborn());
    serialize(controller, reader);
    reader.finish();
    return controller;
  }

  const ControllerConfig& config() const noexcept { return config_; }
  /// As it is used: sizes that follow from the task are known once the warm-up is over.
  const AnyApproximatorConfig& approximator() const noexcept { return approximator_; }
  const Observations& observations() const noexcept { return observations_; }
  const Actions& actions() const noexcept { return actions_; }
  std::size_t n_variables() const noexcept { return observations_.n_variables(); }
  std::size_t n_dimensions() const noexcept { return actions_.n_dimensions(); }

  /// Whether it still acts at random to find the ranges of its observations.
  bool is_warming_up() const noexcept { return warm_up_.has_value(); }

  /// The agent in itself, with states in [0, 1]. Requires that the warm-up is over.
  AnyAgent& agent() { return agent_.value(); }
  const AnyAgent& agent() const { return agent_.value(); }

  /// Of the agent, once there is one that follows it.
  double progress() const {
    return of_q_learning(
        agent_, [](const auto& agent) { return agent.progress(); }, rates_.progress);
  }
  /// Alpha and epsilon as they are now. Require Q-learning.
  double learning_rate() const {
    return of_q_learning(
        agent_, [](const auto& agent) { return agent.learning_rate(); },
        planned([this](const auto& config) { return rates_.learning_rate(config); }));
  }
  double epsilon() const {
    return of_q_learning(
        agent_, [](const auto& agent) { return agent.epsilon(); },
        planned([this](const auto& config) { return rates_.epsilon(config); }));
  }

  /// How many robots, or environments, the agent learns from at once: each has an episode of its
  /// own, and a number from 0. Throws as the agent does.
  void set_n_environments(std::size_t n) {
    if (warm_up_) {
      warm_up_->set_n_environments(n);
    } else {
      std::visit([n](auto& agent) { agent.set_n_environments(n); }, *agent_);
      if (latest_) latest_->set_n_environments(n);
    }
    taken_.forget_from(n);
    readings_.forget_from(n);
  }
  std::size_t n_environments() const {
    if (warm_up_) return warm_up_->n_environments();
    return std::visit([](const auto& agent) { return agent.n_environments(); }, *agent_);
  }

  /// The next act in the environment is an episode's first. Throws as the agent does.
  void begin_episode(std::size_t environment = 0) {
    if (warm_up_) {
      warm_up_->begin_episode(environment);
    } else {
      begin_learned_episode(environment);
    }
    readings_.forget(environment);
  }
  /// The next acts without `explore` are those of another episode: none of its sensors was read.
  void begin_greedy_episode(std::size_t environment = 0) {
    require_environment(environment);
    readings_.forget_greedy(environment);
  }

  /// The action to take; without `explore` a best one. The span is valid until the next act.
  /// Where actions are discrete, `mask` may allow some of them only. Shapes: observation
  /// (n_variables,), the action (n_dimensions,). Throws std::invalid_argument naming a number that
  /// has no state (see ObservationScale) or a mask that does not fit, or if there is no such
  /// environment; then nothing has changed. With Missing::hold last readings are noted, of greedy
  /// episodes apart.
  std::span<const double> act(std::span<const double> observation, bool explore = true,
                              std::size_t environment = 0, ActionMask mask = {}) {
    actions_.require_mask("mask", mask);
    const auto held = readings_.filled(observation, environment, !explore, held_);
    if (warm_up_) {
      observations_.require_readings("observation", observation);
      const auto draw = [&](core::Pcg64& random, std::vector<double>& action) {
        actions_.draw(random, action, mask);
      };
      const auto is_allowed = [&](const std::vector<double>& action) {
        return actions_.allows_drawn(action, mask);
      };
      actions_.take(warm_up_->act(draw, is_allowed, explore, environment), action_, indices_);
      readings_.note(held_, environment, !explore);
      return action_;
    }
    observations_.scale(held, state_);
    std::visit(
        [&](auto& agent) {
          actions_.take(agents::act(agent, state_, explore, environment, mask), action_, indices_);
        },
        *agent_);
    if (explore && !is_fuzzy(approximator_)) {
      taken_.note(environment, action_, indices_);
    }
    readings_.note(held_, environment, !explore);
    return action_;
  }

  /// For a reader. Requires that the warm-up is over.
  Workspace workspace() const {
    return {std::visit([](const auto& agent) { return AnyWorkspace(agent.workspace()); }, *agent_),
            std::vector<double>(state_.size()),
            std::vector<double>(n_dimensions()),
            {},
            std::vector<std::size_t>(n_dimensions())};
  }
  /// A number that no other controller has.
  std::uint64_t identity() const noexcept { return identity_.number(); }

  /// The action of act without `explore`; `ties` decides between several best ones. Valid until
  /// the workspace is used again. Requires that the warm-up is over. Missing readings are the last
  /// ones noted in environment 0, and none is noted. Throws as act.
  std::span<const double> best_action(std::span<const double> observation, Workspace& workspace,
                                      core::Random& ties, ActionMask mask = {}) const {
    actions_.require_mask("mask", mask);
    observations_.scale(readings_.filled(observation, 0, true, workspace.held), workspace.state);
    std::visit(
        [&](const auto& agent) {
          auto& own = own_workspace(agent, workspace);
          actions_.take(agents::best_action(agent, workspace.state, own, ties, mask),
                        workspace.action, workspace.indices);
        },
        *agent_);
    return workspace.action;
  }

  /// The observation with missing readings as act without `explore` has them, which it notes. Valid
  /// until the next call.
  std::span<const double> hold(std::span<const double> observation, std::size_t environment) {
    const auto held = readings_.filled(observation, environment, true, held_);
    if (held.size() == n_variables()) readings_.note(held_, environment, true);
    return held;
  }

  /// The two steps of act without `explore`: `read` takes the time and is for many threads;
  /// `best_of` gives the action, of those that `mask` allows, for the observation that was read
  /// last. With Missing::hold it is what `hold` returned.
  void read(std::span<const double> observation, Workspace& workspace) const {
    observations_.scale(observation, workspace.state);
    std::visit(
        [&](const auto& agent) { agent.read(workspace.state, own_workspace(agent, workspace)); },
        *agent_);
  }
  std::span<const double> best_of(Workspace& workspace, ActionMask mask = {}) {
    actions_.require_mask("mask", mask);
    std::visit(
        [&](auto& agent) {
          actions_.take(agents::best_of(agent, own_workspace(agent, workspace), mask),
                        workspace.action, workspace.indices);
        },
        *agent_);
    return workspace.action;
  }

  /// How large rewards are, and which one was too large to be learned.
  const RewardScale& reward_scale() const noexcept { return reward_scale_; }
  void set_reward_scale(const RewardScale& scale) { reward_scale_ = scale; }

  /// Learns a transition, unless its reward is far beyond the recent ones; see RewardScale. The
  /// action is any of the task's, of a box the nearest one that can be taken; of fuzzy Q-learning,
  /// that of the last act with `explore` in the environment. Of a state that is not terminal,
  /// `next_mask` may allow some actions only. Shapes as in act. Throws std::invalid_argument for
  /// others and for numbers that have no state, and then nothing has changed; as the agent does.
  void learn(std::span<const double> observation, std::span<const double> action, double reward,
             std::span<const double> next_observation, bool terminated, std::size_t environment = 0,
             ActionMask next_mask = {}) {
    if (terminated) next_mask = {};
    actions_.require_mask("next_mask", next_mask);
    core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
    require_environment(environment);
    const auto held = readings_.filled(observation, next_observation, environment);
    if (warm_up_) {
      observations_.require_readings("observation", observation);
      actions_.require_action(action);
      observations_.require_readings("next_observation", next_observation);
      warm_up_->learn({false, environment, observation, action, reward, next_observation,
                       terminated, next_mask});
      readings_.note_step(environment);
      if (warm_up_->is_over()) end_warm_up();
      return;
    }
    observations_.scale(held.observation, state_);
    find_indices(action, environment);
    observations_.scale(held.next_observation, next_state_, "next_observation");
    learn_scaled(reward, terminated, environment, next_mask);
    readings_.note_step(environment);
    notes_.note(observation);
    const WarmUp::Step step{false,  environment,      observation, action,
                            reward, next_observation, terminated};
    if (latest_ && latest_->learn(step)) add_inputs();
  }

  /// Throws what learn would for a transition that cannot be learned; changes nothing.
  void check(std::span<const double> observation, std::span<const double> action, double reward,
             std::span<const double> next_observation, bool terminated, std::size_t environment,
             ActionMask next_mask) const {
    actions_.require_mask("next_mask", terminated ? ActionMask() : next_mask);
    core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
    require_environment(environment);
    observations_.require_readings("observation", observation);
    actions_.require_action(action);
    observations_.require_readings("next_observation", next_observation);
    if (is_warming_up()) return;
    std::vector<double> state(observations_.n_inputs());
    observations_.scale(observation, state);
    observations_.scale(next_observation, state, "next_observation");
  }

  /// The state that the agent has for an observation. Valid until the next call. Throws as act.
  std::span<const double> state_of(std::span<const double> observation) {
    observations_.scale(readings_.filled(observation, 0, true, held_), state_);
    return state_;
  }

  /// How each variable used its range in the last 2,048 transitions or so.
  std::vector<std::optional<RangeUse>> range_use() const { return notes_.use(observations_); }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    detail::serialize_tables(self.tables_, archive);
    bool is_warming_up = self.is_warming_up();
    archive.number("is_warming_up", is_warming_up);
    serialize_rates(self, archive);
    if constexpr (Archive::kReads) self.begin_reading(is_warming_up, archive);
    if (is_warming_up) {
      archive.part("warm_up", *self.warm_up_);
    } else {
      archive.part("observations", self.observations_);
      if constexpr (Archive::kReads) {
        self.fit(&archive);
        self.watch();
      }
      if (self.latest_) archive.part("latest", *self.latest_);
      std::visit([&archive](auto& agent) { archive.part("agent", agent); }, *self.agent_);
      archive.part("reward_scale", self.reward_scale_);
    }
    archive.part("taken", self.taken_);
    if (self.readings_.is_held()) archive.part("readings", self.readings_);
    if constexpr (Archive::kReads) self.end_reading(archive);
  }

 private:
  friend class WithRates<Controller>;
  struct Unborn {};

  static constexpr double kLargestReward = 1e300;
  static constexpr double kCaution = 1.5;  // of looking again and again

  Controller(ControllerConfig config, std::vector<coding::PatternTable> tables, Unborn)
      : config_(std::move(config)),
        tables_(std::move(tables)),
        approximator_(config_.approximator),
        observations_(config_.observation, is_sdnn(approximator_), is_sdnn(approximator_) ? 2 : 1,
                      detail::n_bins_of_inputs(approximator_, tables_)),
        actions_(config_.action, n_actions_in_box(approximator_)),
        notes_(n_variables()),
        readings_(observations_.last_readings()),
        taken_(n_dimensions()) {
    core::check_fields(config_);
    action_.resize(n_dimensions());
    indices_.resize(n_dimensions());
  }

  WarmUp new_warm_up() const {
    return {n_variables(), n_dimensions(), static_cast<std::size_t>(config_.warm_up_steps),
            config_.seed, !is_fuzzy(approximator_)};
  }

  /// Makes the agent: all ranges are known. Of a state that is read, sizes are compared first.
  void fit(const core::StateReader* reader = nullptr) {
    approximator_ = detail::approximator_of(config_, observations_, actions_, tables_);
    const auto tables = detail::tables_of(config_, observations_, approximator_, tables_);
    if (reader != nullptr) {
      expect_sizes(*reader, approximator_, actions_.n_actions(), !tables.empty());
    }
    agent_.emplace(make_agent(approximator_, config_.learning, actions_.n_actions(), config_.seed,
                              tables, n_first_inputs(), observations_.codes_missing()));
    if (auto* const sdnn = std::get_if<approximators::SDNNCConfig>(&approximator_)) {
      if (n_dimensions() == 1) sdnn->n_actions = static_cast<int>(actions_.n_actions().front());
    }
    with_q_learning(agent_, [this](auto& agent) { agent.set_rates(rates_); });
    state_.resize(observations_.n_inputs());
    next_state_.resize(state_.size());
  }

  void apply_rates(const auto& change) { with_q_learning(agent_, change); }

  /// What `call` gives of the settings of learning, but for fuzzy Q-learning.
  template <class Call>
  double planned(const Call& call) const {
    return std::visit(
        [&call](const auto& config) {
          if constexpr (std::is_same_v<std::remove_cvref_t<decltype(config)>, FuzzyQLearningConfig>)
            return 0.0;
          else
            return call(config);
        },
        config_.learning);
  }

  template <class Agent>
  static typename Agent::Workspace& own_workspace(const Agent&, Workspace& workspace) {
    return std::get<typename Agent::Workspace>(workspace.agent);
  }

  void require_environment(std::size_t environment) const {
    core::require(environment < n_environments(), "environment", "of those that there are",
                  environment);
  }

  void begin_learned_episode(std::size_t environment) {
    std::visit([environment](auto& agent) { agent.begin_episode(environment); }, *agent_);
    if (latest_) latest_->begin_episode(environment);
  }

  /// Finds the indices of an action: those of the last exploring act where it is the same one. A
  /// fuzzy agent knows that one only.
  void find_indices(std::span<const double> action, std::size_t environment) {
    actions_.require_action(action);
    if (is_fuzzy(approximator_)) {
      require_last(action, environment);
      return;
    }
    if (taken_.find(environment, action, indices_)) return;
    for (std::size_t d = 0; d < action.size(); ++d) indices_[d] = actions_.index_of(action[d], d);
  }

  /// Throws unless a fuzzy agent chose the action in state_ when it explored last.
  void require_last(std::span<const double> action, std::size_t environment) {
    std::visit(
        [&](auto& agent) {
          if constexpr (kIsFuzzy<std::remove_cvref_t<decltype(agent)>>) {
            actions_.take(agent.last_action(environment), action_, indices_);
            core::require(
                agent.explored_in(state_, environment) && std::ranges::equal(action, action_),
                "observation and action", "those of the last exploring act", "others");
          }
        },
        *agent_);
  }

  void end_warm_up() {
    Observations fitted = observations_;
    fitted.fit(warm_up_->seen());
    if (fitted.has_choice()) {
      fitted.keep(Relevance(detail::experience_of(fitted, *warm_up_, n_dimensions()))
                      .inputs(fitted.required()));
    }
    observations_ = std::move(fitted);
    fit();
    const WarmUp warm_up = std::move(*warm_up_);
    reward_scale_ = RewardScale(warm_up.rewards());
    warm_up_.reset();
    set_n_environments(warm_up.n_in_all());
    if (is_fuzzy(approximator_)) {
      for (std::size_t i = 0; i < n_environments(); ++i) begin_learned_episode(i);
    } else {
      LastReadings readings = observations_.last_readings();
      for (std::size_t t = 0; t < warm_up.size(); ++t) relive(warm_up.step(t), readings);
    }
    set_n_environments(warm_up.n_environments());
    watch();
  }

  /// The number of inputs that came first, where others were added; else 0.
  std::size_t n_first_inputs() const noexcept {
    const std::size_t n = observations_.n_first_inputs();
    return n < observations_.n_inputs() ? n : 0;
  }

  /// Looks for inputs that matter later, where some are left out and can be added.
  void watch() {
    latest_.reset();
    const auto* const linear = std::get_if<approximators::LinearSDNNConfig>(&approximator_);
    const auto kept = observations_.kept_inputs();
    if (linear == nullptr || linear->max_pairs != 0 || !tables_.empty() ||
        std::ranges::find(kept, false) == kept.end()) {
      return;
    }
    latest_.emplace(new_warm_up(), static_cast<std::size_t>(config_.warm_up_steps));
    latest_->set_n_environments(n_environments());
  }

  void add_inputs() {
    const std::vector<bool> kept = observations_.kept_inputs();
    const RandomExperience latest = detail::experience_of(observations_.with_all_inputs(),
                                                          latest_->transitions(), n_dimensions());
    const std::vector<bool> found = Relevance(latest, kCaution).inputs(kept);
    latest_->forget();
    if (found == kept) return;
    observations_.keep(found);
    auto before = std::move(std::get<QLambda>(*agent_));
    fit();
    std::get<QLambda>(*agent_).continue_from(std::move(before));
    identity_ = core::Identity();  // readers have workspaces for fewer inputs
  }

  /// Learns a transition of the warm-up, after which there were these readings.
  void relive(const WarmUp::Step& step, LastReadings& readings) {
    if (step.begins) {
      begin_learned_episode(step.environment);
      readings.forget(step.environment);
    }
    const auto held = readings.filled(step.observation, step.next_observation, step.environment);
    readings.note_step(step.environment);
    observations_.scale(held.observation, state_);
    observations_.scale(held.next_observation, next_state_, "next_observation");
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      indices_[d] = actions_.index_of(step.action[d], d);
    }
    learn_scaled(step.reward, step.terminated, step.environment, step.next_mask);
  }

  /// Learns the transition in state_, indices_ and next_state_.
  void learn_scaled(double reward, bool terminated, std::size_t environment, ActionMask next_mask) {
    RewardScale scale = reward_scale_;  // unchanged if the agent throws
    if (!scale.accepts(reward)) {
      reward_scale_ = scale;
      return;
    }
    agents::learn(*agent_, state_, indices_, reward, next_state_, terminated, environment,
                  next_mask);
    const auto size_in_window = scale.end_window();
    reward_scale_ = scale;
    if (auto* const linear = std::get_if<QLambda>(&*agent_); linear != nullptr && size_in_window) {
      linear->refine_unit(*size_in_window, *scale.size());
    }
  }

  template <class Archive>
  void begin_reading(bool is_warming_up, const Archive& archive) {
    archive.expect(!is_warming_up || observations_.needs_fit(), "is_warming_up",
                   "0, as all ranges are known");
    agent_.reset();
    warm_up_.reset();
    if (is_warming_up) warm_up_.emplace(new_warm_up());
  }

  template <class Archive>
  void end_reading(const Archive& archive) {
    archive.expect(taken_.fits(n_environments(), actions_), "taken.indices",
                   "of actions and environments");
    if (agent_) {
      rates_.progress = progress();
      return;
    }
    const auto can_be_learned = [&](const WarmUp::Step& step) {
      actions_.require_action(step.action);
      actions_.require_mask("next_masks", step.next_mask);
      observations_.require_readings("observation", step.observation);
      observations_.require_readings("next_observation", step.next_observation);
      return std::abs(step.reward) <= kLargestReward;
    };
    const auto is_action = [this](const auto& kept) { return actions_.can_be_drawn(kept); };
    archive.taking("warm_up.actions", [&] {
      archive.expect(warm_up_->each_is(can_be_learned, is_action), "warm_up",
                     "of transitions and actions");
    });
  }

  ControllerConfig config_;
  std::vector<coding::PatternTable> tables_;
  AnyApproximatorConfig approximator_;  ///< as used
  Observations observations_;
  Actions actions_;
  RangeNotes notes_;
  LastReadings readings_;
  std::optional<WarmUp> warm_up_;
  std::optional<AnyAgent> agent_;            ///< once the warm-up is over
  std::optional<LatestTransitions> latest_;  ///< where inputs that are left out can be added
  std::vector<double> held_, state_, next_state_, action_;
  std::vector<std::size_t> indices_;
  detail::TakenActions taken_;
  RewardScale reward_scale_;
  core::Identity identity_;
};

}  // namespace sdnn::agents
