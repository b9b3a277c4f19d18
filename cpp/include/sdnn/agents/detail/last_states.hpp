/// The states of each environment's episode, where they depend on more than one observation.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/history.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents::detail {

/// The last state of an episode.
struct LastState {
  std::vector<double> observation = {}, state = {};
  bool is_noted = false;  ///< whether the observation has updated running ranges
  HistoryFilter::Memory memory = {};
  std::vector<double> action = {};  ///< taken in the state; empty: none yet

  /// Empties all members, and keeps their allocated memory.
  void clear() noexcept {
    for (std::vector<double>* values : {&observation, &state, &memory, &action}) values->clear();
    is_noted = false;
  }
};

/// The last observation of each environment with its state, in which the next transition starts.
/// The state is kept and not computed again: changed ranges would make it another state and end the
/// traces, and a history depends on the earlier observations.
///
/// Greedy episodes may run between the steps of a learned episode. They have separate memories,
/// which start as a copy of the learned episode's and are dropped when that continues.
class LastStates {
 public:
  /// Memory in which a state is computed, so that a step allocates nothing.
  struct Room {
    LastState next = {};
    std::vector<double> inputs = {};
    HistoryFilter::Room history = {};
  };

  LastStates() = default;
  explicit LastStates(HistoryFilter history) : history_(std::move(history)) {}
  /// Fits a history to the transitions of a warm-up.
  LastStates(History history, const RandomExperience& experience, const Observations& observations)
      : history_(history, experience, observations.n_symbols(), experience.actions.size()) {}

  const HistoryFilter& history() const noexcept { return history_; }
  /// Forgets all episodes, and takes the sizes of the task, once the ranges are known.
  void restart(const Observations& observations, std::size_t n_dimensions) {
    n_variables_ = observations.n_variables();
    n_dimensions_ = n_dimensions;
    if (history_.is_none()) history_ = HistoryFilter(observations.n_inputs());
    last_.clear();
  }

  /// Writes the state in which an agent acts, in a learned or greedy episode. `keep` and then
  /// `note_action` may follow. Throws std::invalid_argument for an unusable observation.
  void read(const Observations& observations, std::size_t environment,
            std::span<const double> observation, std::span<double> state, bool is_learned) {
    if (!remembers(observations)) return observations.scale(observation, state);
    find(observations, last(environment, !is_learned), observation, next_, room_);
    std::ranges::copy(next_.state, state.begin());
  }
  /// Keeps the state that `read` computed last.
  void keep(const Observations& observations, std::size_t environment, bool is_learned) {
    const bool is_kept = !history_.is_none() || (is_learned && observations.is_running());
    if (!is_kept || environment >= kMostEnvironments) return;
    Environment& kept = of(environment);
    (is_learned ? kept.learned : kept.greedy) = next_;
    kept.is_greedy = !is_learned;
  }
  /// Notes the action that was taken in the state that was kept last.
  void note_action(std::size_t environment, std::span<const double> action, bool is_learned) {
    if (history_.is_none() || environment >= last_.size()) return;
    Environment& kept = last_[environment];
    if (is_learned || kept.is_greedy) {
      (is_learned ? kept.learned : kept.greedy).action.assign(action.begin(), action.end());
    }
  }
  /// Writes the state of an observation in a greedy episode, and keeps nothing. The observation is
  /// the last one, whose kept state is written, or that of the next step. Threads may call it at
  /// once, with a `room` each.
  void peek(const Observations& observations, std::size_t environment,
            std::span<const double> observation, std::span<double> state, Room& room) const {
    if (history_.is_none()) return observations.scale(observation, state);
    const LastState* const kept = last(environment, true);
    if (kept != nullptr && is_observation_of(*kept, observation)) {
      std::ranges::copy(kept->state, state.begin());
      return;
    }
    find(observations, kept, observation, room.next, room);
    std::ranges::copy(room.next.state, state.begin());
  }

  /// Writes the state in which a transition starts; `follow` writes the one in which it ends.
  /// Throws std::invalid_argument for an unusable observation.
  void start(const Observations& observations, std::size_t environment,
             std::span<const double> observation, std::span<double> state) {
    if (!remembers(observations)) return observations.scale(observation, state);
    const LastState* const before = last(environment, false);
    if (before != nullptr && is_observation_of(*before, observation)) {
      first_ = *before;
    } else {
      begin(observations, observation, first_, room_);
    }
    std::ranges::copy(first_.state, state.begin());
  }
  /// Writes the state in which the transition of `start` ends, and keeps it as the last one.
  /// Running ranges are updated by each observation once, but not in a replay of the warm-up, whose
  /// observations they were fitted to. Throws std::invalid_argument for an unusable observation.
  void follow(Observations& observations, std::size_t environment, std::span<const double> action,
              std::span<const double> next_observation, std::span<double> next_state,
              bool is_replayed = false) {
    constexpr auto kName = "next_observation";
    if (!remembers(observations)) return observations.scale(next_observation, next_state, kName);
    continue_with(observations, first_, action, next_observation, next_, kName, room_);
    const bool is_noted = observations.is_running() && !is_replayed;
    if (is_noted) {
      if (!first_.is_noted) observations.note(first_.observation);
      observations.note(next_observation);
      continue_with(observations, first_, action, next_observation, next_, kName, room_);
      next_.is_noted = true;
    }
    std::ranges::copy(next_.state, next_state.begin());
    const bool is_kept = is_noted || !history_.is_none();
    if (!is_kept || environment >= kMostEnvironments) return;
    Environment& kept = of(environment);
    kept.learned = next_;
    kept.is_greedy = false;
  }

  /// Forgets the episodes of an environment.
  void forget(std::size_t environment) {
    if (environment >= last_.size()) return;
    last_[environment].learned.clear();
    last_[environment].is_greedy = false;
  }
  /// Begins a greedy episode without the memory of another.
  void forget_greedy(std::size_t environment) {
    if (history_.is_none()) return;
    of(environment).greedy.clear();
    of(environment).is_greedy = true;
  }
  /// Forgets environments from this one on: others may come later.
  void forget_from(std::size_t environment) {
    if (last_.size() > environment) last_.resize(environment);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
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
        auto& kept = self.last_[i];
        self.list(kept.learned, archive);
        if (self.history_.is_none()) return;
        archive.number("is_greedy", kept.is_greedy);
        if (kept.is_greedy) archive.within("greedy", [&] { self.list(kept.greedy, archive); });
      });
    }
  }

 private:
  struct Environment {
    LastState learned = {}, greedy = {};
    bool is_greedy = false;  ///< whether greedy episodes use the memory `greedy`
  };

  /// Whether states depend on more than one observation.
  bool remembers(const Observations& observations) const noexcept {
    return observations.is_running() || !history_.is_none();
  }
  Environment& of(std::size_t environment) {
    if (last_.size() <= environment) last_.resize(environment + 1);
    return last_[environment];
  }
  /// The last state of an environment's present episode, or null if there is none.
  const LastState* last(std::size_t environment, bool is_greedy) const {
    if (environment >= last_.size()) return nullptr;
    const Environment& kept = last_[environment];
    const LastState& last = is_greedy && kept.is_greedy ? kept.greedy : kept.learned;
    return last.state.empty() ? nullptr : &last;
  }
  /// Whether this is the observation of a state. Missing readings, NaN or infinite, are equal.
  static bool is_observation_of(const LastState& last, std::span<const double> observation) {
    const auto are_alike = [](double x, double y) {
      return x == y || (!std::isfinite(x) && !std::isfinite(y));
    };
    return std::ranges::equal(last.observation, observation, are_alike);
  }

  /// Computes the state of an observation after the `last` one. If the agent has acted in the last
  /// state, the observation belongs to the next step. Otherwise an equal observation is the same
  /// state, and any other begins an episode.
  void find(const Observations& observations, const LastState* last,
            std::span<const double> observation, LastState& next, Room& room) const {
    const bool is_same = last != nullptr && is_observation_of(*last, observation);
    if (last != nullptr && !last->action.empty()) {
      continue_with(observations, *last, last->action, observation, next, "observation", room);
    } else if (is_same) {
      next = *last;
    } else {
      begin(observations, observation, next, room);
    }
  }
  /// Computes the state of an episode's first observation.
  void begin(const Observations& observations, std::span<const double> observation,
             LastState& first, Room& room) const {
    room.inputs.resize(history_.n_observed());
    observations.scale(observation, room.inputs, "observation", !history_.is_none());
    prepare(observation, first);
    history_.begin(room.inputs, first.memory, first.state, room.history);
  }
  /// Computes the state of an observation that follows `action` in the state `before`.
  void continue_with(const Observations& observations, const LastState& before,
                     std::span<const double> action, std::span<const double> observation,
                     LastState& next, const char* name, Room& room) const {
    room.inputs.resize(history_.n_observed());
    observations.scale(observation, room.inputs, name, !history_.is_none());
    prepare(observation, next);
    next.memory = before.memory;
    history_.follow(action, room.inputs, next.memory, next.state, room.history);
  }
  /// Stores the observation, and makes room for its state.
  void prepare(std::span<const double> observation, LastState& next) const {
    next.clear();
    next.observation.assign(observation.begin(), observation.end());
    next.state.resize(history_.n_inputs());
  }

  /// Lists what is saved of a state; see core/state.hpp.
  void list(auto& last, auto& archive) const {
    archive.numbers("observation", last.observation);
    archive.numbers("state", last.state);
    archive.number("is_noted", last.is_noted);
    if (!history_.is_none()) {
      archive.numbers("memory", last.memory);
      archive.numbers("action", last.action);
    }
    if constexpr (std::remove_cvref_t<decltype(archive)>::kReads) {
      const bool is_empty = last.observation.empty() && last.state.empty() && last.memory.empty();
      const bool is_whole = last.observation.size() == n_variables_ &&
                            last.state.size() == history_.n_inputs() && history_.fits(last.memory);
      archive.expect(is_empty || (is_whole && core::are_unit_values(last.state)), "state",
                     "a state in [0, 1] for an observation, or empty");
      archive.expect((last.action.empty() || last.action.size() == n_dimensions_) &&
                         core::are_finite(last.action),
                     "action", "finite, a number for each dimension, or empty");
    }
  }

  std::size_t n_variables_ = 0, n_dimensions_ = 0;
  HistoryFilter history_;
  std::vector<Environment> last_;
  LastState first_, next_;  ///< the ends of the present transition; next_ also what `read` computed
  Room room_;
};

}  // namespace sdnn::agents::detail
