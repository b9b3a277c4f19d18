/// Functions of Controller that find ranges and inputs: in a warm-up, later, in a saved state.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/detail/approximator_of.hpp"
#include "sdnn/agents/detail/last_states.hpp"
#include "sdnn/agents/history.hpp"
#include "sdnn/agents/last_readings.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/agents/relevance.hpp"
#include "sdnn/agents/reward_scale.hpp"
#include "sdnn/agents/warm_up.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/core/detail/identity.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents {

namespace detail {

/// Returns transitions with states scaled by `fitted`, one environment after the other. A reward
/// that will be refused because it is far too large counts as 0.
inline RandomExperience experience_of(const Observations& fitted, const WarmUp& transitions,
                                      std::size_t n_dimensions) {
  std::vector<std::size_t> order(transitions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](auto t) { return transitions.step(t).environment; });
  RandomExperience experience{.n_inputs = fitted.n_inputs(), .circular = fitted.circular()};
  experience.actions.resize(n_dimensions);
  RewardScale scale(transitions.rewards());
  LastReadings readings = fitted.last_readings();
  std::vector<double> state(fitted.n_inputs());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const WarmUp::Step step = transitions.step(order[k]);
    if (step.begins) readings.forget(step.environment);
    const auto [observation, next_observation] =
        readings.filled(step.observation, step.next_observation, step.environment);
    readings.note_step(step.environment);
    fitted.scale(observation, state);
    experience.states.insert(experience.states.end(), state.begin(), state.end());
    fitted.scale(next_observation, state, "next_observation");
    experience.next_states.insert(experience.next_states.end(), state.begin(), state.end());
    for (std::size_t d = 0; d < n_dimensions; ++d) {
      experience.actions[d].push_back(step.action[d]);
    }
    experience.rewards.push_back(scale.accepts(step.reward) ? step.reward : 0.0);
    if (k > 0 && step.begins) experience.ends.back() = true;
    experience.ends.push_back(step.terminated);
  }
  return experience;
}

/// The number of inputs before others were added, as make_agent takes it; 0 if none was added.
inline std::size_t n_first_inputs(const Observations& observations) noexcept {
  const std::size_t n = observations.n_first_inputs();
  return n < observations.n_inputs() ? n : 0;
}

}  // namespace detail

inline WarmUp Controller::new_warm_up() const {
  return {n_variables(), n_dimensions(), static_cast<std::size_t>(config_.warm_up_steps),
          config_.seed, !is_on_policy(config_.learning)};
}

/// Makes the agent for observations whose ranges are known. With a `reader`, first compares sizes
/// with the saved state. Throws the errors of the approximator; then nothing has changed.
inline void Controller::fit(Observations observations, detail::LastStates last_states,
                            const core::StateReader* reader) {
  last_states.restart(observations, n_dimensions());
  AnyApproximatorConfig approximator =
      detail::approximator_of(config_, observations, last_states.history(), actions_, tables_);
  const auto tables = detail::tables_of(config_, observations, approximator, tables_);
  if (reader != nullptr) {
    expect_sizes(*reader, approximator, config_.learning, actions_.n_actions(), !tables.empty());
  }
  agent_.emplace(make_agent(approximator, config_.learning, actions_.n_actions(), config_.seed,
                            tables, detail::n_first_inputs(observations),
                            observations.codes_missing()));
  observations_ = std::move(observations);
  last_states_ = std::move(last_states);
  approximator_ = std::move(approximator);
  if (auto* const sdnn = std::get_if<approximators::SDNNCConfig>(&approximator_)) {
    if (n_dimensions() == 1) sdnn->n_actions = static_cast<int>(actions_.n_actions().front());
  }
  apply_rates([this](auto& agent) { agent.set_rates(rates_); });
  state_.resize(history().n_inputs());
  next_state_.resize(state_.size());
}

/// Throws for settings that would be impossible at the end of the warm-up: makes the agent in a
/// copy of the controller, with all inputs that there may be, and ranges of observations of 0.
inline void Controller::try_to_fit() const {
  const History history = config_.observation.history;
  Controller trial = *this;
  Observations observations = observations_;
  observations.fit(std::vector<double>(n_variables()));
  HistoryFilter::require_possible(history, observations.n_symbols(),
                                  observations.may_have_fewer_inputs(),
                                  static_cast<std::size_t>(config_.warm_up_steps));
  if (history == History::none || history == History::automatic) {
    trial.fit(std::move(observations), {});
    return;
  }
  observations.repeat_input(!HistoryFilter::adds_inputs(history));
  const HistoryFilter filter(history, observations.circular(), observations.n_symbols(),
                             n_dimensions());
  trial.fit(std::move(observations), detail::LastStates(filter));
}

/// Writes a random action of the warm-up into action_.
inline void Controller::act_at_random(std::span<const double> observation, bool explore,
                                      std::size_t environment, ActionMask mask) {
  observations_.require_readings("observation", observation);
  const auto draw = [&](core::Pcg64& random, std::vector<double>& action) {
    actions_.draw(random, action, mask);
  };
  const auto is_allowed = [&](const std::vector<double>& action) {
    return actions_.allows_drawn(action, mask);
  };
  const std::vector<double> drawn = warm_up_->act(draw, is_allowed, explore, environment);
  actions_.take(std::span(drawn), action_, indices_);
}

/// Checks a transition and remembers it for the end of the warm-up, which it may be.
inline void Controller::remember(const WarmUp::Step& step) {
  observations_.require_readings("observation", step.observation);
  actions_.require_action(step.action);
  observations_.require_readings("next_observation", step.next_observation);
  warm_up_->learn(step);
  readings_.note_step(step.environment);
  if (warm_up_->is_over()) end_warm_up();
}

/// Fits ranges, relevant inputs and the history to the warm-up, and makes the agent. A history is
/// fitted to all inputs first, as their relevance depends on it, then to those kept.
inline void Controller::fit_to_warm_up(History history, double headroom) {
  Observations fitted = observations_;
  fitted.fit(warm_up_->all_observations(), headroom);
  detail::LastStates states;
  if (const bool has_choice = fitted.has_choice(); has_choice || history != History::none) {
    auto experience = detail::experience_of(fitted, *warm_up_, n_dimensions());
    if (history != History::none) states = {history, experience, fitted};
    const bool is_single =
        HistoryFilter::adds_inputs(states.history().kind()) && fitted.has_single_input();
    if (has_choice) fitted.keep(states.history().relevant(experience, fitted.required()));
    if (is_single) fitted.repeat_input(false);
    if (has_choice || is_single) {
      experience = detail::experience_of(fitted, *warm_up_, n_dimensions());
      history = states.history().kind();
      if (history != History::none) states = {history, experience, fitted};
    }
  }
  fit(std::move(fitted), std::move(states));
}

/// Makes the agent, and lets it learn the transitions of the warm-up unless it is on-policy.
inline void Controller::end_warm_up(double headroom) {
  const History history = config_.observation.history;
#if SDNN_EXCEPTIONS
  try {
    fit_to_warm_up(history, headroom);
  } catch (const std::logic_error&) {  // more inputs than the approximator can have
    if (history != History::automatic) throw;
    fit_to_warm_up(History::none, headroom);
  }
#else
  fit_to_warm_up(history, headroom);
#endif
  const WarmUp warm_up = std::move(*warm_up_);
  reward_scale_ = RewardScale(warm_up.rewards());
  warm_up_.reset();
  set_n_environments(warm_up.n_in_all());  // the transitions may be of removed environments
  if (is_on_policy(config_.learning)) {
    for (std::size_t i = 0; i < n_environments(); ++i) begin_learned_episode(i);
  } else {
    LastReadings readings = observations_.last_readings();
    for (std::size_t t = 0; t < warm_up.size(); ++t) replay(warm_up.step(t), readings);
  }
  set_n_environments(warm_up.n_environments());
  watch_for_inputs();
}

/// Starts to store the latest transitions, in which inputs that were left out may prove relevant.
/// Only Q(lambda) without a history, custom patterns or a limit of pairs can add inputs.
inline void Controller::watch_for_inputs() {
  latest_.reset();
  const auto* const linear = std::get_if<approximators::LinearSDNNConfig>(&approximator_);
  const auto kept = observations_.kept_inputs();
  if (!history().is_none() || linear == nullptr ||
      !std::holds_alternative<QLambdaConfig>(config_.learning) || linear->max_pairs != 0 ||
      !tables_.empty() || std::ranges::find(kept, false) == kept.end()) {
    return;
  }
  latest_.emplace(new_warm_up(), static_cast<std::size_t>(config_.warm_up_steps));
  latest_->set_n_environments(n_environments());
}

/// Tests the latest transitions, and adds the inputs that are relevant in them to the agent.
inline void Controller::add_inputs() {
  const std::vector<bool> kept = observations_.kept_inputs();
  const RandomExperience latest = detail::experience_of(observations_.with_all_inputs(),
                                                        latest_->transitions(), n_dimensions());
  const std::vector<bool> relevant = Relevance(latest, kCaution).inputs(kept);
  latest_->forget();
  if (relevant == kept) return;
  Observations observations = observations_;
  observations.keep(relevant);
  auto before = std::move(std::get<QLambda>(*agent_));
  fit(std::move(observations), last_states_);
  std::get<QLambda>(*agent_).continue_from(std::move(before));
  identity_ = core::Identity();  // readers have workspaces for fewer inputs
}

/// Lets the agent learn a transition of the warm-up. The held `readings` are those of the replay.
inline void Controller::replay(const WarmUp::Step& step, LastReadings& readings) {
  if (step.begins) {
    begin_learned_episode(step.environment);
    readings.forget(step.environment);
  }
  const auto filled = readings.filled(step.observation, step.next_observation, step.environment);
  readings.note_step(step.environment);
  last_states_.start(observations_, step.environment, filled.observation, state_);
  last_states_.follow(observations_, step.environment, step.action, filled.next_observation,
                      next_state_, true);
  for (std::size_t d = 0; d < n_dimensions(); ++d) {
    indices_[d] = actions_.index_of(step.action[d], d);
  }
  learn_scaled(step.reward, step.terminated, step.environment, step.next_mask, step.is_own,
               step.dt);
}

/// Prepares to restore a saved state: makes an empty warm-up, or lets `serialize` make the agent.
template <class Archive>
void Controller::begin_reading(bool is_warming_up, const Archive& archive) {
  archive.expect(!is_warming_up || observations_.needs_fit(), "is_warming_up",
                 "0, as all ranges are known");
  agent_.reset();
  warm_up_.reset();
  observations_.forget();
  if (is_warming_up) warm_up_.emplace(new_warm_up());
}

/// Checks that restored parts fit each other, such as remembered actions and the action space.
template <class Archive>
void Controller::end_reading(const Archive& archive) {
  archive.expect(last_actions_.fits(n_environments(), actions_), "taken.indices",
                 "of actions and environments");
  if (agent_) {
    std::visit(
        [this](const auto& agent) {
          if constexpr (requires { agent.progress(); }) rates_.progress = agent.progress();
        },
        *agent_);
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
  archive.naming("warm_up.actions", [&] {
    archive.expect(warm_up_->each_is(can_be_learned, is_action), "warm_up",
                   "of transitions and actions");
  });
}

template <class Self, class Archive>
void Controller::serialize(Self& self, Archive& archive) {
  detail::serialize_tables(self.tables_, archive);
  bool is_warming_up = self.is_warming_up();
  archive.number("is_warming_up", is_warming_up);
  serialize_rates(self, archive);
  if constexpr (Archive::kReads) self.begin_reading(is_warming_up, archive);
  if (is_warming_up) {
    archive.part("warm_up", *self.warm_up_);
  } else {
    HistoryFilter history = self.history();
    const bool may_have_history =
        self.observations_.needs_fit() && self.config_.observation.history != History::none;
    if (may_have_history) {
      History kind = history.kind();
      archive.within("history", [&] { HistoryFilter::serialize_kind(kind, archive); });
      if constexpr (Archive::kReads) {
        history = HistoryFilter(kind, std::vector<bool>(), {}, self.n_dimensions());
      }
    }
    archive.part("observations", self.observations_);
    if (may_have_history) {
      if constexpr (Archive::kReads) {  // the sizes of a history follow from the observations
        if (HistoryFilter::adds_inputs(history.kind()) && self.observations_.has_single_input()) {
          self.observations_.repeat_input(false);
        }
        history = HistoryFilter(history.kind(), self.observations_.circular(),
                                self.observations_.n_symbols(), self.n_dimensions());
      }
      archive.part("history", history);
    }
    if constexpr (Archive::kReads) {
      self.fit(self.observations_, detail::LastStates(std::move(history)), &archive);
      self.watch_for_inputs();
    }
    if (self.latest_) archive.part("latest", *self.latest_);
    std::visit([&archive](auto& agent) { archive.part("agent", agent); }, *self.agent_);
    archive.part("reward_scale", self.reward_scale_);
  }
  archive.part("taken", self.last_actions_);
  if (!is_warming_up && (self.observations_.is_running() || !self.history().is_none())) {
    archive.part("last_states", self.last_states_);
  }
  if (self.readings_.is_held()) archive.part("readings", self.readings_);
  if constexpr (Archive::kReads) self.end_reading(archive);
}

}  // namespace sdnn::agents
