/// Fuzzy Q-learning of one dimension of an action.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/agents/fuzzy_q_learning_config.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents::detail {

/// The rules of one dimension of a fuzzy agent's action, which choose its number in [-1, 1] and
/// learn from every reward; see FuzzyQLearning.
class FuzzyDimension {
 public:
  /// Smaller eligibilities count as 0 (chosen).
  static constexpr double kForgottenTrace = 1e-3;

  /// Throws std::invalid_argument naming the field that is out of range; std::length_error if the
  /// rules that fire at once and their traces need more than max_table_bytes.
  FuzzyDimension(approximators::FuzzyRules rules, const FuzzyQLearningConfig& config,
                 std::uint64_t seed)
      : config_(checked(config)),
        rules_(with_room(std::move(rules))),
        policy_(config.policy, seed),
        episodes_(new_episode()) {
    for (std::size_t action = 0; action < rules_.n_actions(); ++action) {
      actions_.push_back(coding::action_value(action, rules_.n_actions(), -1.0, 1.0));
    }
  }

  const FuzzyQLearningConfig& config() const noexcept { return config_; }
  const approximators::FuzzyRules& rules() const noexcept { return rules_; }
  approximators::FuzzyRules& rules() noexcept { return rules_; }
  void set_n_environments(std::size_t n) {
    episodes_.resize(n, [this] { return new_episode(); });
  }
  std::size_t n_environments() const noexcept { return episodes_.size(); }

  /// The rules that fired in the last exploring act in an environment, and the actions they picked.
  const approximators::FiredRules& fired(std::size_t environment = 0) const {
    return episodes_.of(environment).fired;
  }
  std::span<const std::size_t> picked(std::size_t environment = 0) const {
    return episodes_.of(environment).picked;
  }
  /// The number in [-1, 1] of the last exploring act.
  double last_action(std::size_t environment = 0) const { return episodes_.of(environment).action; }
  /// Whether the last exploring act was in this state.
  bool explored_in(std::span<const double> state, std::size_t environment) const {
    const Episode& episode = episodes_.of(environment);
    return !episode.picked.empty() && std::ranges::equal(state, episode.state);
  }

  /// Begins an episode: resets its number of steps and ends its traces.
  void begin_episode(std::size_t environment) {
    Episode& episode = episodes_.of(environment);
    episode.step = 0;
    end_traces(episode);
  }

  /// Returns the number to take in `state`, and remembers both for `learn`. Throws
  /// std::invalid_argument, and changes nothing, unless the state has d numbers in [0, 1].
  double explore(std::span<const double> state, std::size_t environment) {
    Episode& episode = episodes_.of(environment);
    rules_.fire(state, episode.fired);
    std::copy(state.begin(), state.end(), episode.state.begin());
    episode.picked.clear();
    episode.action = clamped_mean(episode.fired, [&](std::size_t i) {
      return episode.picked.emplace_back(
          policy_.select(rules_.values(episode.fired.rules[i]), episode.step));
    });
    ++episode.step;
    return episode.action;
  }

  /// Returns the weighted mean of the best actions of the rules that fired; `ties` breaks ties.
  double best_of(const approximators::FiredRules& fired, core::Random& ties) const {
    return clamped_mean(fired, [&](std::size_t i) {
      return policy_.best_action(rules_.values(fired.rules[i]), ties);
    });
  }
  /// The random stream that breaks ties in acts without `explore`.
  core::Random& evaluation_ties() noexcept { return policy_.ties(false); }

  /// Returns sum max_a v_i[a] alpha_i / sum alpha_i over rules that fired.
  double value(const approximators::FiredRules& fired) const {
    return mean_over(
        fired, [&](std::size_t i) -> double { return best_value(rules_.values(fired.rules[i])); });
  }

  /// Learns the outcome of the last exploring act in the environment, after dt usual steps, from
  /// the reward and the value of the next state, which is 0 if the episode terminated. Throws
  /// std::overflow_error, and learns nothing, if a value would exceed the range of floats.
  void learn(double reward, std::span<const double> next_state, bool terminated,
             std::size_t environment, approximators::FiredRules& fired, double dt) {
    Episode& episode = episodes_.of(environment);
    double target = reward;
    if (!terminated) {
      rules_.fire(next_state, fired);
      target += discount_over(config_.discount, dt) * value(fired);
    }
    const double value_of_picks = mean_over(episode.fired, [&](std::size_t i) -> double {
      return rules_.value(episode.fired.rules[i], episode.picked[i]);
    });
    const double step = config_.learning_coefficient * (target - value_of_picks);
    // Only a large step can fail and needs a copy of the traces, which allocates, to restore them.
    const bool is_large = !(std::abs(step) < kLargeStep);
    const std::vector<Trace> before = is_large ? episode.traces : std::vector<Trace>();
    renew_traces(episode);
    for (const Trace& trace : episode.traces) {
      if (std::abs(moved(trace, step)) <= kLargest) continue;
      if (is_large) episode.traces.assign(before.begin(), before.end());
      core::fail(std::overflow_error(
          "reward is too large: a value of a fuzzy rule would leave the range of floats"));
    }
    for (const Trace& trace : episode.traces) {
      rules_.set_value(trace.rule, trace.action, static_cast<float>(moved(trace, step)));
    }
    episode.trace_dt = dt;
    if (terminated) end_traces(episode);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.part("rules", self.rules_);
    archive.part("policy", self.policy_);
    Episodes<Episode>::serialize(
        self.episodes_, archive, [&self] { return self.new_episode(); },
        [&](auto& episode) { serialize_episode(self, episode, archive); });
  }

 private:
  /// The eligibility of a rule's action; those without a trace have the eligibility 0.
  struct Trace {
    std::size_t rule, action;
    double eligibility;
  };

  /// Returns the rules. Throws std::length_error before memory is allocated if the rules that fire
  /// and their traces need too much: the number of rules that fire doubles with every input.
  approximators::FuzzyRules with_room(approximators::FuzzyRules rules) const {
    // A fired rule and its truth value, twice (episode and workspace), its action, and its traces.
    const double per_rule = 2.0 * (sizeof(std::size_t) + sizeof(double)) + sizeof(std::size_t) +
                            static_cast<double>(trace_lifetime() + 1) * sizeof(Trace);
    core::require_table_bytes("n_inputs or trace_decay", "rules that fire and their traces",
                              per_rule * static_cast<double>(rules.max_fired()),
                              rules.config().max_table_bytes);
    return rules;
  }

  /// The state of the present episode in one environment.
  struct Episode {
    // The last exploring act: its state, the rules that fired, their picks, the mean of these.
    std::vector<double> state;
    approximators::FiredRules fired;
    std::vector<std::size_t> picked;
    double action = 0.0;
    std::vector<Trace> traces;  ///< the oldest first
    double trace_dt = 1.0;      ///< the time by which the traces must fade in the next transition
    int step = 0;               ///< the number of the next exploring act in the episode
  };

  static void end_traces(Episode& episode) noexcept {
    episode.traces.clear();
    episode.trace_dt = 1.0;
  }

  /// Makes an episode and reserves all memory that it may need. Copies do not keep such reserves.
  Episode new_episode() const {
    Episode episode;
    episode.state.resize(rules_.n_inputs());
    episode.fired = rules_.workspace();
    episode.picked.reserve(rules_.max_fired());
    episode.traces.reserve(most_traces());
    return episode;
  }

  /// Lists what is saved of an environment's episode; see core/state.hpp. Traces are saved as pairs
  /// of rule and action, and their eligibilities.
  template <class Self, class Listed, class Archive>
  static void serialize_episode(Self& self, Listed& listed, Archive& archive) {
    archive.number("step", listed.step);
    archive.fixed("last_state", {listed.state.size()}, listed.state);
    archive.number("last_action", listed.action);
    std::vector<std::int64_t> picked(listed.picked.begin(), listed.picked.end());
    archive.numbers("picked", picked);
    std::vector<std::int64_t> traced;
    std::vector<double> eligibilities;
    for (const Trace& trace : listed.traces) {
      traced.push_back(static_cast<std::int64_t>(trace.rule));
      traced.push_back(static_cast<std::int64_t>(trace.action));
      eligibilities.push_back(trace.eligibility);
    }
    archive.numbers("traced", traced);
    archive.numbers("eligibilities", eligibilities);
    serialize_duration("trace_dt", listed.trace_dt, archive);
    if constexpr (Archive::kReads) self.take(archive, listed, picked, traced, eligibilities);
  }

  /// Checks the members that were read, and takes them over.
  template <class Archive>
  void take(const Archive& archive, Episode& read, const std::vector<std::int64_t>& picked,
            const std::vector<std::int64_t>& traced, const std::vector<double>& eligibilities) {
    const auto is_below = [](std::int64_t number, std::size_t end) {
      return number >= 0 && static_cast<std::uint64_t>(number) < end;
    };
    archive.expect(read.step >= 0, "step", "0 or more");
    for (const double x : read.state)
      archive.expect(x >= 0.0 && x <= 1.0, "last_state", "in [0, 1]");
    archive.expect(read.action >= -1.0 && read.action <= 1.0, "last_action", "in [-1, 1]");
    Episode episode = new_episode();
    episode.step = read.step;
    episode.state = read.state;
    episode.action = read.action;
    episode.trace_dt = read.trace_dt;
    if (!picked.empty()) {
      rules_.fire(episode.state, episode.fired);
      archive.expect(picked.size() == episode.fired.size(), "picked", "one per rule that fired");
      for (const std::int64_t action : picked) {
        archive.expect(is_below(action, rules_.n_actions()), "picked", "of actions");
        episode.picked.push_back(static_cast<std::size_t>(action));
      }
    }
    archive.expect(traced.size() == 2 * eligibilities.size(), "traced", "two per eligibility");
    archive.expect(eligibilities.size() <= most_traces(), "eligibilities", "not too many");
    for (std::size_t i = 0; i < eligibilities.size(); ++i) {
      archive.expect(is_below(traced[2 * i], rules_.n_rules()) &&
                         is_below(traced[2 * i + 1], rules_.n_actions()),
                     "traced", "of rules and actions");
      archive.expect(std::isfinite(eligibilities[i]) && eligibilities[i] >= 0.0, "eligibilities",
                     "finite and 0 or more");
      episode.traces.push_back({static_cast<std::size_t>(traced[2 * i]),
                                static_cast<std::size_t>(traced[2 * i + 1]), eligibilities[i]});
    }
    read = std::move(episode);
  }

  /// Returns the configuration if it is valid; traces must decay, since their number is limited.
  static FuzzyQLearningConfig checked(const FuzzyQLearningConfig& config) {
    core::check_fields(config);
    core::require(config.discount * config.trace_decay <= kSlowestFading, "trace_decay",
                  "at most 0.99 / discount", config.trace_decay);
    return config;
  }

  static constexpr double kSlowestFading = 0.99;  // limits the memory for traces
  static constexpr double kLargest = std::numeric_limits<float>::max();
  /// A smaller step is below half the distance of floats near kLargest: rounding ignores it there.
  static constexpr double kLargeStep = 1e28;

  /// Returns sum value(i) alpha_i / sum alpha_i over the fired rules, with the truth values alpha.
  template <class Value>
  static double mean_over(const approximators::FiredRules& fired, Value&& value) {
    double weighted = 0.0, total = 0.0;
    for (std::size_t i = 0; i < fired.size(); ++i) {
      weighted += value(i) * fired.truth_values[i];
      total += fired.truth_values[i];
    }
    return weighted / total;
  }

  /// The mean of the actions pick(i) over the fired rules i, clipped, as rounding may exceed 1.
  template <class Pick>
  double clamped_mean(const approximators::FiredRules& fired, const Pick& pick) const {
    return std::clamp(mean_over(fired, [&](std::size_t i) { return actions_[pick(i)]; }), -1.0,
                      1.0);
  }

  /// The factor of the traces in a transition of one usual step.
  double fading() const noexcept { return config_.discount * config_.trace_decay; }

  /// Steps after which the largest possible eligibility, 1 / (1 - fading), is forgotten.
  std::size_t trace_lifetime() const noexcept {
    if (fading() == 0.0) return 0;
    return static_cast<std::size_t>(
        std::ceil(core::log(kForgottenTrace * (1.0 - fading())) / core::log(fading())));
  }

  std::size_t most_traces() const noexcept { return (trace_lifetime() + 1) * rules_.max_fired(); }

  /// The value of a trace's rule and action after a step of learning.
  double moved(const Trace& trace, double step) const noexcept {
    return static_cast<double>(rules_.value(trace.rule, trace.action)) + step * trace.eligibility;
  }

  /// Fades the old traces and adds the truth values of the picks, each of another rule. After short
  /// transitions there may be more traces than there is room for; then the oldest are forgotten.
  void renew_traces(Episode& episode) {
    std::vector<Trace>& traces = episode.traces;
    const double faded = discount_over(config_.discount, episode.trace_dt) * config_.trace_decay;
    for (Trace& trace : traces) trace.eligibility *= faded;
    std::erase_if(traces, [](const Trace& t) { return !(t.eligibility >= kForgottenTrace); });
    const std::size_t n_most_old = most_traces() - episode.fired.size();
    if (traces.size() > n_most_old) {
      const auto n_forgotten = static_cast<std::ptrdiff_t>(traces.size() - n_most_old);
      traces.erase(traces.begin(), traces.begin() + n_forgotten);
    }
    const std::size_t n_old = traces.size();
    for (std::size_t i = 0; i < episode.fired.size(); ++i) {
      const std::size_t rule = episode.fired.rules[i], action = episode.picked[i];
      const auto old_end = traces.begin() + static_cast<std::ptrdiff_t>(n_old);
      const auto old = std::find_if(traces.begin(), old_end, [&](const Trace& trace) {
        return trace.rule == rule && trace.action == action;
      });
      if (old != old_end) {
        old->eligibility += episode.fired.truth_values[i];
      } else {
        traces.push_back({rule, action, episode.fired.truth_values[i]});
      }
    }
  }

  FuzzyQLearningConfig config_;
  approximators::FuzzyRules rules_;
  EpsilonGreedy policy_;
  std::vector<double> actions_;  ///< the discrete ones, in [-1, 1]
  Episodes<Episode> episodes_;
};

}  // namespace sdnn::agents::detail
