/// The states of each environment's episode, where they depend on more than one observation.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "sdnn/agents/history.hpp"
#include "sdnn/agents/observations.hpp"

namespace sdnn::agents::detail {

/// A state of an episode, and what belongs to it.
struct LastState {
  std::vector<double> observation = {}, state = {};
  bool is_noted = false;  ///< whether ranges have followed it
  HistoryFilter::Memory memory = {};
  std::vector<double> action = {};  ///< in that state; empty: none yet
};

/// In each environment the last observation and its state, which is the next transition's first: it
/// stays as it was where ranges change, so that traces go on, and it holds what a history
/// remembers.
///
/// Greedy episodes may run beside those that are learned: they have a memory apart, which begins
/// with those that are learned and is forgotten when one of these goes on.
class LastStates {
 public:
  LastStates() = default;
  /// Fits a history to the transitions of a warm-up.
  LastStates(History history, const RandomExperience& experience, const Observations& observations)
      : history_(history, experience, observations.n_symbols(), experience.actions.size()) {}

  const HistoryFilter& history() const noexcept { return history_; }
  /// Forgets all episodes, of a task whose ranges are known.
  void restart(const Observations& observations, std::size_t n_dimensions) {
    n_variables_ = observations.n_variables();
    n_dimensions_ = n_dimensions;
    if (history_.is_none()) history_ = HistoryFilter(observations.n_inputs());
    last_.clear();
  }

  /// Finds the state of an observation in which an agent acts; `keep` and `note_action` may follow.
  /// Throws as Observations::scale.
  void read(const Observations& observations, std::size_t environment,
            std::span<const double> observation, std::span<double> state, bool is_learned) {
    if (!remembers(observations)) return observations.scale(observation, state);
    find(observations, last(environment, !is_learned), observation, next_);
    std::ranges::copy(next_.state, state.begin());
  }
  /// Keeps the state that was read last.
  void keep(const Observations& observations, std::size_t environment, bool is_learned) {
    const bool is_kept = !history_.is_none() || (is_learned && observations.is_running());
    if (!is_kept || environment >= kMostEnvironments) return;
    Environment& kept = of(environment);
    if (is_learned) {
      kept = {next_, {}};
    } else {
      kept.greedy = next_;
    }
  }
  /// Notes the action that was taken in the state that was kept last.
  void note_action(std::size_t environment, std::span<const double> action, bool is_learned) {
    if (history_.is_none() || environment >= last_.size()) return;
    Environment& kept = last_[environment];
    if (is_learned || kept.greedy) {
      (is_learned ? kept.learned : *kept.greedy).action.assign(action.begin(), action.end());
    }
  }
  /// Finds the state of an observation, in the order of greedy episodes, and keeps nothing: of the
  /// last one as it is, of another one that of the next step.
  void peek(const Observations& observations, std::size_t environment,
            std::span<const double> observation, std::span<double> state) const {
    if (history_.is_none()) return observations.scale(observation, state);
    const LastState* const kept = last(environment, true);
    LastState next;
    if (kept != nullptr && is_observation_of(*kept, observation)) {
      next.state = kept->state;
    } else {
      find(observations, kept, observation, next);
    }
    std::ranges::copy(next.state, state.begin());
  }

  /// Finds the state in which a transition starts; `follow` may come next. Throws as
  /// Observations::scale.
  void start(const Observations& observations, std::size_t environment,
             std::span<const double> observation, std::span<double> state) {
    if (!remembers(observations)) return observations.scale(observation, state);
    const LastState* const before = last(environment, false);
    if (before != nullptr && is_observation_of(*before, observation)) {
      first_ = *before;
    } else {
      begin(observations, observation, first_);
    }
    std::ranges::copy(first_.state, state.begin());
  }
  /// Finds the state in which it ends. Running ranges follow both observations, each once, unless
  /// the transition is replayed. Throws as Observations::scale.
  void follow(Observations& observations, std::size_t environment, std::span<const double> action,
              std::span<const double> next_observation, std::span<double> next_state,
              bool is_replayed = false) {
    constexpr auto kName = "next_observation";
    if (!remembers(observations)) return observations.scale(next_observation, next_state, kName);
    continue_with(observations, first_, action, next_observation, next_, kName);
    const bool is_noted = observations.is_running() && !is_replayed;
    if (is_noted) {
      if (!first_.is_noted) observations.note(first_.observation);
      observations.note(next_observation);
      continue_with(observations, first_, action, next_observation, next_, kName);
      next_.is_noted = true;
    }
    std::ranges::copy(next_.state, next_state.begin());
    const bool is_kept = is_noted || !history_.is_none();
    if (is_kept && environment < kMostEnvironments) of(environment) = {next_, {}};
  }

  void forget(std::size_t environment) {
    if (environment < last_.size()) last_[environment] = {};
  }
  /// Forgets greedy episodes: the next one begins with its first observation.
  void forget_greedy(std::size_t environment) {
    if (!history_.is_none()) of(environment).greedy.emplace();
  }
  /// Forgets environments from this one on: others may come later.
  void forget_from(std::size_t environment) {
    if (last_.size() > environment) last_.resize(environment);
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::uint64_t n = self.last_.size();
    archive.number("n", n);
    if constexpr (Archive::kReads) {
      archive.expect(n <= kMostEnvironments, "n", "2^14 at most");
      self.last_.assign(static_cast<std::size_t>(n), {});
    }
    for (std::size_t i = 0; i < self.last_.size(); ++i) {
      archive.within(std::to_string(i), [&] {
        auto& greedy = self.last_[i].greedy;
        self.list(self.last_[i].learned, archive);
        if (self.history_.is_none()) return;
        bool is_greedy = greedy.has_value();
        archive.number("is_greedy", is_greedy);
        if constexpr (Archive::kReads) {
          if (is_greedy) greedy.emplace();
        }
        if (is_greedy) archive.within("greedy", [&] { self.list(*greedy, archive); });
      });
    }
  }
  /// Lists the history, of a task whose ranges are known.
  template <class Self, class Archive>
  static void serialize_history(Self& self, const Observations& observations,
                                std::size_t n_dimensions, Archive& archive) {
    if constexpr (Archive::kReads) {
      self.history_ =
          HistoryFilter(observations.circular(), observations.n_symbols(), n_dimensions);
    }
    archive.part("history", self.history_);
  }

 private:
  struct Environment {
    LastState learned;
    std::optional<LastState> greedy;
  };

  static constexpr std::uint64_t kMostEnvironments = 1 << 14;

  /// Whether states depend on more than one observation.
  bool remembers(const Observations& observations) const noexcept {
    return observations.is_running() || !history_.is_none();
  }
  Environment& of(std::size_t environment) {
    if (last_.size() <= environment) last_.resize(environment + 1);
    return last_[environment];
  }
  /// The last state of an episode that goes on, or null.
  const LastState* last(std::size_t environment, bool is_greedy) const {
    if (environment >= last_.size()) return nullptr;
    const Environment& kept = last_[environment];
    const LastState& last = is_greedy && kept.greedy ? *kept.greedy : kept.learned;
    return last.state.empty() ? nullptr : &last;
  }
  /// Whether this is the observation of a state; missing readings are alike.
  static bool is_observation_of(const LastState& last, std::span<const double> observation) {
    const auto are_alike = [](double x, double y) {
      return x == y || (!std::isfinite(x) && !std::isfinite(y));
    };
    return std::ranges::equal(last.observation, observation, are_alike);
  }

  /// The state of an observation that comes after the last one: of the next step if the agent has
  /// acted there, else of the same one or, unless they are equal, of an episode that begins.
  void find(const Observations& observations, const LastState* last,
            std::span<const double> observation, LastState& next) const {
    const bool is_same = last != nullptr && is_observation_of(*last, observation);
    if (last != nullptr && !last->action.empty()) {
      continue_with(observations, *last, last->action, observation, next, "observation");
    } else if (is_same) {
      next = *last;
    } else {
      begin(observations, observation, next);
    }
  }
  void begin(const Observations& observations, std::span<const double> observation,
             LastState& first) const {
    std::vector<double> inputs(history_.n_observed());
    observations.scale(observation, inputs, "observation", !history_.is_none());
    first = {{observation.begin(), observation.end()}, std::vector<double>(history_.n_inputs())};
    history_.begin(inputs, first.memory, first.state);
  }
  void continue_with(const Observations& observations, const LastState& before,
                     std::span<const double> action, std::span<const double> observation,
                     LastState& next, const char* name) const {
    std::vector<double> inputs(history_.n_observed());
    observations.scale(observation, inputs, name, !history_.is_none());
    next = {{observation.begin(), observation.end()}, std::vector<double>(history_.n_inputs())};
    next.memory = before.memory;
    history_.follow(action, inputs, next.memory, next.state);
  }

  void list(auto& last, auto& archive) const {
    archive.numbers("observation", last.observation);
    archive.numbers("state", last.state);
    archive.number("is_noted", last.is_noted);
    if (!history_.is_none()) {
      archive.numbers("memory", last.memory);
      archive.numbers("action", last.action);
    }
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
      const auto is_unit = [](double x) { return x >= 0.0 && x <= 1.0; };
      const auto is_finite = [](double x) { return std::isfinite(x); };
      const bool is_empty = last.observation.empty() && last.state.empty() && last.memory.empty();
      const bool is_whole = last.observation.size() == n_variables_ &&
                            last.state.size() == history_.n_inputs() && history_.fits(last.memory);
      archive.expect(is_empty || (is_whole && std::ranges::all_of(last.state, is_unit)), "state",
                     "a state in [0, 1] for an observation, or empty");
      archive.expect((last.action.empty() || last.action.size() == n_dimensions_) &&
                         std::ranges::all_of(last.action, is_finite),
                     "action", "finite, a number for each dimension, or empty");
    }
  }

  std::size_t n_variables_ = 0, n_dimensions_ = 0;
  HistoryFilter history_;
  std::vector<Environment> last_;
  LastState first_, next_;  ///< of the transition or the state that is being found
};

}  // namespace sdnn::agents::detail
