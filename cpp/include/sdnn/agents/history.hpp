/// States that depend on earlier observations of an episode, too.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/detail/observer.hpp"
#include "sdnn/agents/observation_config.hpp"
#include "sdnn/agents/relevance.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

/// Makes states from the inputs of the present and earlier observations; all are in [0, 1].
///
/// With `automatic`, an observer's estimates replace the inputs if they reduce squared prediction
/// errors by an eighth, which shows noisy sensors. Otherwise differences are added if they explain
/// 20 % of the changes of an input beyond what the present state explains, and leave less than 30 %
/// unexplained, which shows velocities that are not observed. Symbols have no history. There is no
/// automatic history and no observer if the experience is too small or there are too many inputs.
class HistoryFilter {
 public:
  /// Makes a filter without any history, for observations of `n` inputs.
  explicit HistoryFilter(std::size_t n = 0) : circular_(n), n_symbols_(n) {}
  /// Fits a history to transitions; n_symbols is 0 for inputs that are numbers. Shape: (n_inputs,).
  HistoryFilter(History history, const RandomExperience& experience, std::vector<int> n_symbols,
                std::size_t n_dimensions)
      : circular_(experience.circular),
        n_symbols_(std::move(n_symbols)),
        n_dimensions_(n_dimensions) {
    if (history == History::automatic || history == History::observer) {
      fit_observer(history, numbers_of(experience));
    } else {
      kind_ = history;
    }
    if (kind_ == History::differences) find_largest_differences(experience);
  }

  /// Makes a filter with the sizes of a kind, whose fitted members are restored from a state or
  /// never used. Requires that the kind is not `automatic`.
  HistoryFilter(History kind, std::vector<bool> circular, std::vector<int> n_symbols,
                std::size_t n_dimensions)
      : circular_(std::move(circular)),
        n_symbols_(std::move(n_symbols)),
        n_dimensions_(n_dimensions),
        kind_(kind),
        largest_(circular_.size(), 1.0) {}

  /// Whether states have additional inputs for each number of an observation.
  static bool adds_inputs(History kind) noexcept {
    return kind == History::differences || kind == History::averages;
  }
  /// Throws std::invalid_argument naming why no history of this kind can be fitted: to inputs with
  /// `n_symbols`, unless some of them may be left out, in a warm-up of n_steps.
  static void require_possible(History kind, const std::vector<int>& n_symbols, bool may_be_fewer,
                               std::size_t n_steps) {
    if (kind == History::none || kind == History::automatic) return;
    const auto n_numbers = static_cast<std::size_t>(std::ranges::count(n_symbols, 0));
    core::require(n_numbers > 0, "history", "'none' or 'auto' where all observations are discrete",
                  "another one");
    if (kind != History::observer) return;
    core::require(n_steps >= detail::Observer::kFewestTransitions, "history",
                  "'none', 'differences' or 'averages' with fewer than 100 warm_up_steps",
                  "observer");
    core::require(may_be_fewer || n_numbers <= detail::Observer::kMostInputs, "history",
                  "'none', 'differences' or 'averages' with more than 16 numeric inputs",
                  "observer");
  }

  History kind() const noexcept { return kind_; }
  /// Whether states are the inputs of the present observation alone.
  bool is_none() const noexcept { return kind_ == History::none; }
  /// The number of inputs of an observation.
  std::size_t n_observed() const noexcept { return circular_.size(); }
  /// The number of inputs of a state.
  std::size_t n_inputs() const { return n_observed() + n_added() * n_numbers(); }
  /// Which inputs of states are angles, and how many symbols each may be. Shapes: (n_inputs,).
  std::vector<bool> circular() const {
    return extended<bool>(
        circular_, [this](std::size_t i) { return kind_ == History::averages && circular_[i]; });
  }
  std::vector<int> n_symbols() const {
    return extended<int>(n_symbols_, [](std::size_t) { return 0; });
  }
  /// Observer::gain, or 1 without an observer.
  double gain() const noexcept { return observer_.gain(); }

  /// The remembered part of an episode: its last inputs, averages or estimates. Empty before the
  /// episode's first observation, and without a history.
  using Memory = std::vector<double>;
  /// Memory in which the next step of an episode is computed.
  struct Room {
    std::vector<double> last = {}, numbers = {}, features = {};
  };

  /// Begins an episode with the inputs of its first observation, and writes the state. With a
  /// history the inputs may be outside [0, 1]. Shapes: inputs (n_observed,), state (n_inputs,).
  void begin(std::span<const double> inputs, Memory& memory, std::span<double> state,
             Room& room) const {
    if (is_none()) {
      std::ranges::copy(inputs, state.begin());
      return;
    }
    memory.assign(inputs.begin(), inputs.end());
    if (kind_ == History::averages) memory.insert(memory.end(), inputs.begin(), inputs.end());
    if (kind_ == History::observer) {
      find_numbers(inputs, room.numbers);
      memory.assign(observer_.n_inputs(), 0.0);
      observer_.begin(room.numbers, memory);
    }
    find_state(inputs, inputs, memory, state, room);
  }
  /// Continues an episode with an action and the inputs of the next observation, and writes the
  /// state. Shapes: action (n_dimensions,), inputs (n_observed,), state (n_inputs,).
  void follow(std::span<const double> action, std::span<const double> inputs, Memory& memory,
              std::span<double> state, Room& room) const {
    if (is_none()) {
      std::ranges::copy(inputs, state.begin());
      return;
    }
    room.last.assign(memory.begin(), memory.end());
    if (kind_ == History::differences) memory.assign(inputs.begin(), inputs.end());
    if (kind_ == History::observer) {
      find_numbers(inputs, room.numbers);
      observer_.follow(action, room.numbers, memory, room.features);
    }
    if (kind_ == History::averages) {  // the fast averages of all inputs, then the slow ones
      for (std::size_t k = 0; k < memory.size(); ++k) {
        const std::size_t i = k % n_observed();
        const double rate = k < n_observed() ? kFastRate : kSlowRate;
        const double average = memory[k] + rate * difference(inputs[i], memory[k], i);
        memory[k] = circular_[i] ? average - std::floor(average) : average;
      }
    }
    find_state(inputs, room.last, memory, state, room);
  }

  /// Returns for each input of the observation whether it is relevant, by its estimate or by its
  /// difference; see Relevance. Shapes: (n_observed,).
  std::vector<bool> relevant(const RandomExperience& experience,
                             const std::vector<bool>& required) const {
    if (is_none()) return Relevance(experience).inputs(required);
    RandomExperience states = experience;
    states.n_inputs = n_inputs();
    states.circular = circular();
    states.states.clear();
    states.next_states.clear();
    Memory memory;
    Room room;
    std::vector<double> state(n_inputs());
    const auto append = [&state](std::vector<double>& rows) {
      rows.insert(rows.end(), state.begin(), state.end());
    };
    for (std::size_t t = 0; t < experience.size(); ++t) {
      const auto row = [&](const std::vector<double>& rows) {
        return std::span(rows).subspan(t * n_observed(), n_observed());
      };
      std::vector<double> action;
      for (const auto& actions : experience.actions) action.push_back(actions[t]);
      if (t == 0 || experience.ends[t - 1]) begin(row(experience.states), memory, state, room);
      append(states.states);
      follow(action, row(experience.next_states), memory, state, room);
      append(states.next_states);
    }
    std::vector<std::size_t>
        origins;  // for each input of states, the observation's input it is from
    for (std::size_t k = 0; k <= n_added(); ++k) {
      for (std::size_t i = 0; i < n_observed(); ++i) {
        if (k == 0 || is_number(i)) origins.push_back(i);
      }
    }
    std::vector<bool> required_states, kept(n_observed());
    for (const std::size_t i : origins) required_states.push_back(required[i]);
    const std::vector<bool> kept_states = Relevance(states).inputs(required_states);
    for (std::size_t k = 0; k < origins.size(); ++k) {
      if (kept_states[k]) kept[origins[k]] = true;
    }
    return kept;
  }

  /// Whether a memory that was read from a file has the right size and finite numbers.
  bool fits(const Memory& memory) const {
    if (is_none()) return memory.empty();
    std::size_t n = n_observed();
    if (kind_ == History::averages) n = 2 * n_observed();
    if (kind_ == History::observer) n = observer_.n_inputs();
    return memory.size() == n && core::are_finite(memory);
  }

  /// Lists the kind separately from `serialize`, because other parts of a state need it first.
  template <class Archive>
  static void serialize_kind(History& kind, Archive& archive) {
    auto number = static_cast<std::int32_t>(kind);
    archive.number("kind", number);
    if constexpr (Archive::kReads) {
      archive.expect(number >= 0 && number < static_cast<std::int32_t>(History::automatic), "kind",
                     "in [0, 3]");
      kind = static_cast<History>(number);
    }
  }
  /// Lists the fitted members; see core/state.hpp. A filter of the same kind and inputs reads them.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    if constexpr (Archive::kReads) {
      if (self.kind_ == History::observer) {
        const RandomExperience shape =
            self.numbers_of({.n_inputs = self.n_observed(), .circular = self.circular_});
        archive.expect(shape.n_inputs > 0, "kind", "one for symbols");
        self.observer_ = detail::Observer(shape.circular, self.n_dimensions_);
      }
    }
    if (self.kind_ == History::differences) {
      archive.fixed("largest", {self.n_observed()}, self.largest_);
      if constexpr (Archive::kReads) {
        archive.expect(
            std::ranges::all_of(self.largest_, [](double x) { return x > 0.0 && x <= 2.0; }),
            "largest", "in (0, 2]");
      }
    }
    if (self.kind_ == History::observer) archive.part("observer", self.observer_);
  }

 private:
  static constexpr double kLeastImprovement =
      0.1335;                                 // of logarithms of squared errors: log(8 / 7)
  static constexpr double kLeastShare = 0.2;  // of changes, explained by differences
  static constexpr double kFastRate = 0.5, kSlowRate = 0.2;  // of the two running averages
  static constexpr double kHeadroom = 1.5;          // of the largest difference in the experience
  static constexpr double kLeastDifference = 1e-9;  // not 0, as differences are divided by it

  /// Whether an input of observations is no symbol.
  bool is_number(std::size_t i) const noexcept { return n_symbols_[i] == 0; }
  std::size_t n_numbers() const {
    return static_cast<std::size_t>(std::ranges::count(n_symbols_, 0));
  }
  /// The number of inputs that a state has for each number beside the number itself.
  std::size_t n_added() const noexcept {
    return kind_ == History::differences ? 1 : kind_ == History::averages ? 2 : 0;
  }

  /// The values of the observation's inputs, then those of the inputs that are added.
  template <class T>
  std::vector<T> extended(const std::vector<T>& values, const auto& added) const {
    std::vector<T> all = values;
    for (std::size_t k = 0; k < n_added(); ++k) {
      for (std::size_t i = 0; i < n_observed(); ++i) {
        if (is_number(i)) all.push_back(added(i));
      }
    }
    return all;
  }

  /// Writes the inputs that are not symbols, of one row or of several.
  void find_numbers(std::span<const double> inputs, std::vector<double>& numbers) const {
    numbers.clear();
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (is_number(i % n_observed())) numbers.push_back(inputs[i]);
    }
  }
  /// The experience without inputs that are symbols.
  RandomExperience numbers_of(RandomExperience experience) const {
    experience.circular.clear();
    for (std::size_t i = 0; i < n_observed(); ++i) {
      if (is_number(i)) experience.circular.push_back(circular_[i]);
    }
    experience.n_inputs = experience.circular.size();
    for (std::vector<double>* const rows : {&experience.states, &experience.next_states}) {
      const std::vector<double> inputs = std::exchange(*rows, {});
      find_numbers(inputs, *rows);
    }
    return experience;
  }

  /// Fits an observer, unless the experience is too small or there are too many numbers, and uses
  /// it if `history` is observer. With `automatic`, selects what the experience needs: an observer
  /// against noise, differences for velocities, or nothing.
  void fit_observer(History history, const RandomExperience& numbers) {
    if (numbers.n_inputs == 0 || numbers.n_inputs > detail::Observer::kMostInputs ||
        numbers.size() < detail::Observer::kFewestTransitions) {
      return;
    }
    detail::Observer observer(numbers);
    if (history == History::observer ||
        (observer.gain() < 1.0 && observer.improvement() >= kLeastImprovement)) {
      kind_ = History::observer;
      observer_ = std::move(observer);
      observer_.refine(numbers);
    } else if (observer.share_of_last_changes(numbers) >= kLeastShare) {
      kind_ = History::differences;
    }
  }

  /// The first value minus the second; of angles the shorter way.
  double difference(double first, double second, std::size_t i) const noexcept {
    const double change = first - second;
    return circular_[i] ? change - std::round(change) : change;
  }
  /// Sets the difference of each input that states encode as 1: kHeadroom times the largest one in
  /// the experience. States encode its negative as 0.
  void find_largest_differences(const RandomExperience& experience) {
    largest_.assign(n_observed(), kLeastDifference);
    for (std::size_t k = 0; k < experience.states.size(); ++k) {
      const std::size_t i = k % n_observed();
      const double change = difference(experience.next_states[k], experience.states[k], i);
      largest_[i] = std::max(largest_[i], kHeadroom * std::abs(change));
    }
  }

  /// Writes a state: the inputs, then differences from the `last` inputs, or averages, of numbers.
  /// An observer's estimates replace the numbers. All entries are in [0, 1].
  void find_state(std::span<const double> inputs, std::span<const double> last,
                  const Memory& memory, std::span<double> state, Room& room) const {
    const auto clipped = [](double x) { return std::clamp(x, 0.0, 1.0); };
    std::ranges::transform(inputs, state.begin(), clipped);
    std::size_t next = n_observed();
    if (kind_ == History::observer) {
      room.numbers.resize(observer_.n_inputs());
      observer_.state_of(memory, room.numbers);
      for (std::size_t i = 0, k = 0; i < n_observed(); ++i) {
        if (is_number(i)) state[i] = room.numbers[k++];
      }
    } else if (kind_ == History::differences) {
      for (std::size_t i = 0; i < n_observed(); ++i) {
        if (!is_number(i)) continue;
        const double scaled = difference(inputs[i], last[i], i) / largest_[i];
        state[next++] = (std::clamp(scaled, -1.0, 1.0) + 1.0) / 2.0;
      }
    } else {
      for (std::size_t k = 0; k < memory.size(); ++k) {
        if (is_number(k % n_observed())) state[next++] = clipped(memory[k]);
      }
    }
  }

  std::vector<bool> circular_;  ///< of the observation's inputs
  std::vector<int> n_symbols_;
  [[maybe_unused]] std::size_t n_dimensions_ = 0;  ///< of actions
  History kind_ = History::none;
  std::vector<double> largest_ = {};  ///< the difference of each input that states encode as 1
  detail::Observer observer_ = {};
};

}  // namespace sdnn::agents
