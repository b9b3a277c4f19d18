/// The policy: the best action, or with probability epsilon a random one.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// Which of several best actions is taken (an assumption: the paper does not specify it).
enum class TieRule {
  uniform,  ///< each with the same probability
  lowest,   ///< the one with the lowest index
  middle,   ///< the middle (rounded down) of the widest run of neighbours, the first such run
};
constexpr std::array<std::string_view, 3> words_of(TieRule) noexcept {
  return {"uniform", "lowest", "middle"};
}

/// The policy's parameters; the defaults are the paper's (section 4.2).
struct EpsilonGreedyConfig {
  double epsilon = 0.1;
  int n_greedy_steps = 10;
  TieRule tie_rule = TieRule::uniform;
  double tie_tolerance = 0.0;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("epsilon", &EpsilonGreedyConfig::epsilon,
                    "Probability of a random action; in fuzzy Q-learning each fired rule picks "
                    "one for itself.",
                    core::within(0, 1)),
        core::field("n_greedy_steps", &EpsilonGreedyConfig::n_greedy_steps,
                    "First steps of an episode in which epsilon is 0.", core::within(0, 1 << 30)),
        core::field("tie_rule", &EpsilonGreedyConfig::tie_rule,
                    "Which of several best actions is taken: `uniform`: any with the same "
                    "probability; `lowest`: the one with the lowest index; `middle`: the middle "
                    "of the widest run of neighbours. An assumption."),
        core::field("tie_tolerance", &EpsilonGreedyConfig::tie_tolerance,
                    "Values at most this far below the best tie with it. Not in the paper: with "
                    "`middle` the agent acts from the middle of the widest high plateau.",
                    core::at_least(0)));
  }
  bool operator==(const EpsilonGreedyConfig&) const = default;
};

/// Returns the largest of one or more values; if some are NaN, any (Eigen leaves it open).
template <class Value>
Value best_value(std::span<const Value> values) noexcept {
  // Eight at a time: quicker than maxCoeff of all, and provably within the span.
  using Eight = Eigen::Array<Value, 8, 1>;
  const Eigen::Map<const Eigen::Array<Value, 8, Eigen::Dynamic>> columns(
      values.data(), 8, static_cast<Eigen::Index>(values.size() / 8));
  Eight best = Eight::Constant(values[0]);
  for (Eigen::Index j = 0; j < columns.cols(); ++j) best = best.max(columns.col(j));
  Value largest = best.maxCoeff();
  for (const Value value : values.last(values.size() % 8)) largest = std::max(largest, value);
  return largest;
}

/// Epsilon-greedy selection over a row of action values.
///
/// Evaluation breaks ties by a separate random stream, so it does not change what is learned later.
class EpsilonGreedy {
 public:
  /// Throws std::invalid_argument naming the field that is out of range.
  EpsilonGreedy(const EpsilonGreedyConfig& config, std::uint64_t seed)
      : config_(config),
        exploration_(seed, core::Stream::exploration),
        ties_(seed, core::Stream::ties),
        evaluation_ties_(seed, core::Stream::evaluation_ties) {
    core::check_fields(config);
  }

  const EpsilonGreedyConfig& config() const noexcept { return config_; }

  /// Sets the probability of random actions. Throws std::invalid_argument outside [0, 1].
  void set_epsilon(double epsilon) {
    core::require_in_range("epsilon", epsilon, 0.0, 1.0);
    config_.epsilon = epsilon;
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.part("exploration", self.exploration_);
    archive.part("ties", self.ties_);
    archive.part("evaluation_ties", self.evaluation_ties_);
  }

  /// Whether step number `step` (from 0) of an episode may take a random action.
  bool may_explore(int step) const noexcept {
    return step >= config_.n_greedy_steps && config_.epsilon > 0.0;
  }
  /// Draws whether step number `step` of an episode takes a random action.
  bool explores(int step) noexcept {
    return may_explore(step) && exploration_.uniform() < config_.epsilon;
  }
  /// Any of `n_actions` actions, with the same probability. Requires n_actions > 0.
  std::size_t random_action(std::size_t n_actions) noexcept {
    return static_cast<std::size_t>(exploration_.below(n_actions));
  }
  /// Returns a best action; `ties` draws among several. Shape: values (n_actions,). Throws
  /// std::invalid_argument if `values` is empty or the best is NaN.
  std::size_t best_action(std::span<const double> values, core::Random& ties) const {
    return greedy(values, ties);
  }
  std::size_t best_action(std::span<const float> values, core::Random& ties) const {
    return greedy(values, ties);
  }
  /// Returns a best action by numbers that rise with the values, such as firing counts. All actions
  /// whose number is at least `least` tie with the best one.
  template <class Number>
  std::size_t best_action(std::span<const Number> numbers, Number least, core::Random& ties) const {
    return select_by_tie_rule(numbers, least, ties);
  }
  /// The stream that breaks ties in learning, or without `explore` in evaluation.
  core::Random& ties(bool explore) noexcept { return explore ? ties_ : evaluation_ties_; }

  /// Takes the action of step number `step` (from 0) of an episode: a random one, or a best one.
  /// Shape: values (n_actions,). Throws std::invalid_argument if it is empty or the best is NaN.
  std::size_t select(std::span<const float> values, int step) {
    core::require(!values.empty(), "values", "not empty", values.size());
    return explores(step) ? random_action(values.size()) : greedy(values, ties_);
  }

 private:
  template <class Value>
  std::size_t greedy(std::span<const Value> values, core::Random& ties) const {
    const Value best = best_value(values);
    core::require(!std::isnan(best), "values", "numbers", best);
    return select_by_tie_rule(values, static_cast<Value>(best - config_.tie_tolerance), ties);
  }

  /// Returns the index of a value that is at least `least`, selected by the tie rule.
  template <class Value>
  std::size_t select_by_tie_rule(std::span<const Value> values, Value least,
                                 core::Random& ties) const {
    switch (config_.tie_rule) {
      case TieRule::lowest:
        return nth_of(values, least, 0);
      case TieRule::middle:
        return middle_of_widest_run(values, least);
      case TieRule::uniform:
        break;
    }
    const std::uint64_t n_tied = count_of(values, least);
    return nth_of(values, least, n_tied > 1 ? ties.below(n_tied) : 0);
  }

  template <class Value>
  static std::uint64_t count_of(std::span<const Value> values, Value least) noexcept {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(values, [least](Value value) { return value >= least; }));
  }

  /// The index of value number n, from 0, of the more than n values that are at least `least`.
  template <class Value>
  static std::size_t nth_of(std::span<const Value> values, Value least, std::uint64_t n) noexcept {
    constexpr std::size_t kAtOnce = 64;  // skips whole blocks, which are counted by vectors
    std::size_t i = 0;
    for (; i + kAtOnce < values.size(); i += kAtOnce) {
      const std::uint64_t n_in_block = count_of(values.subspan(i, kAtOnce), least);
      if (n < n_in_block) break;
      n -= n_in_block;
    }
    while (values[i] < least || n-- > 0) ++i;
    return i;
  }

  /// The middle of the first longest run of actions with values of at least `least`.
  template <class Value>
  static std::size_t middle_of_widest_run(std::span<const Value> values, Value least) noexcept {
    std::size_t widest = 0, middle = 0, run = 0;
    for (std::size_t action = 0; action < values.size(); ++action) {
      run = values[action] >= least ? run + 1 : 0;
      if (run > widest) {
        widest = run;
        middle = action - run / 2;  // of actions action - run + 1 .. action, rounded down
      }
    }
    return middle;
  }

  EpsilonGreedyConfig config_;
  core::Random exploration_;
  core::Random ties_;
  core::Random evaluation_ties_;
};

}  // namespace sdnn::agents
