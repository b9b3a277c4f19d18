/// Q(lambda) and Sarsa(lambda) with a linear readout of the SDNN code, in integers.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/detail/linear_td.hpp"
#include "sdnn/agents/detail/q_lambda_episode.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/agents/q_lambda_config.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// An agent that learns the values of a linear readout by traces, and acts epsilon-greedily.
///
/// With x the code of (s, a), n the number of its columns that are not 0, and z the trace:
///
///     z <- gamma lambda z + (1 - alpha / n gamma lambda <z, x>) x
///     w <- w + alpha / n (delta + Q - Q_old) z - alpha / n (Q - Q_old) x
///     delta = r + gamma Q' - Q,  Q_old <- Q'
///
/// Q' is the value of the next action (Sarsa), or of the best action (Q-learning, in which any
/// other action ends the trace). With Sarsa a transition is pending until the next one begins in
/// the state where it ended, or the episode ends. Q' is 0 after a terminated transition, and the
/// best value at any other end of an episode. With replacing traces, z is x where x is not 0, and w
/// moves along z alone. A step with alpha = 1 corrects the whole error of a new state; it never
/// overshoots, because <z, x> is bounded. In a transition of dt usual steps gamma is gamma^dt, also
/// where it decays the trace, at the transition after it; see LinearTD.
///
/// After the scaling of observations everything is an integer: alpha and epsilon in steps of 2^-16,
/// gamma of 2^-15, gamma lambda of 2^-13, traces of 2^-12, values and weights in the readout's
/// units. Products are rounded to the nearest, halves up, but for the decay of traces, which is
/// rounded towards 0. Every intermediate result fits into 64 bits, those of the columns into 32.
///
/// Source: van Seijen, H., Mahmood, A. R., Pilarski, P. M., Machado, M. C., Sutton, R. S. (2016).
/// True online temporal-difference learning (algorithm 2); Watkins, C. (1989), Q(lambda).
///
/// An agent may learn in several environments at once, numbered from 0, each with a separate trace.
/// Traces are replacing ones then: for dutch traces, Q - Q_old would contain the corrections of the
/// other environments.
class QLambda : public IndexAgent<QLambda> {
 public:
  using Readout = approximators::LinearSDNN;

  /// The memory in which a thread reads the agent.
  ///
  /// `values` are those of each dimension's actions; `action` is the best action.
  struct Workspace {
    Readout::Workspace readout;
    std::vector<std::vector<double>> values;
    std::vector<std::size_t> action;
  };

  /// Throws std::invalid_argument naming the field that is out of range.
  QLambda(Readout readout, const QLambdaConfig& config, std::uint64_t seed)
      : config_(checked_schedule(config)),
        td_(std::move(readout), config.discount, config.trace_decay),
        exploration_(config, seed),
        workspace_(workspace()),
        episodes_(new_episode()) {
    apply_rates();
  }

  const QLambdaConfig& config() const noexcept { return config_; }
  /// The readout of all dimensions.
  std::span<Readout> networks() noexcept { return {&td_.readout(), 1}; }
  std::span<const Readout> networks() const noexcept { return {&td_.readout(), 1}; }
  const Readout& readout() const noexcept { return td_.readout(); }

  std::size_t n_inputs() const { return readout().n_inputs(); }
  /// Dimensions of an action.
  std::size_t n_dimensions() const { return readout().n_dimensions(); }
  /// Actions of a dimension.
  std::size_t n_actions(std::size_t d) const { return readout().n_actions(d); }
  /// Transitions that were learned.
  std::int64_t n_learned() const noexcept { return n_learned_; }

  /// Alpha at present, a multiple of 2^-16 like epsilon.
  double learning_rate() const noexcept { return static_cast<double>(rate_) / kOne; }
  /// The value that epsilon approaches with schedule_steps, by default 0. With discrete states
  /// only, epsilon stays constant by default, so that every state continues to be explored: nothing
  /// is generalized between them.
  double final_epsilon() const {
    return config_.final_epsilon.value_or(has_symbols_only() ? config_.policy.epsilon : 0.0);
  }

  /// Begins an episode. If the last one did not terminate, its trace ends, and with Sarsa its
  /// pending transition is learned. Throws std::invalid_argument if the environment does not exist.
  void begin_episode(std::size_t environment = 0) {
    Episode& episode = episodes_.of(environment);
    episode.exploration.begin();
    if (episode.waits) finish_at_end(episode);
  }

  Workspace workspace() const {
    Workspace workspace{readout().workspace(), {}, std::vector<std::size_t>(n_dimensions())};
    for (std::size_t d = 0; d < n_dimensions(); ++d) workspace.values.emplace_back(n_actions(d));
    return workspace;
  }

  /// Returns the dimension's part of Q(state, a) for each of its actions; `averaged` selects the
  /// average of the weights, if there is one. The span is valid until the workspace is used again.
  /// Shape: state (l,) in [0, 1]. Throws std::invalid_argument for others.
  std::span<const double> values(std::span<const double> state, Workspace& workspace,
                                 std::size_t d = 0, bool averaged = false) const {
    readout().values(state, workspace.readout, workspace.values[d], d, averaged);
    return workspace.values[d];
  }

  /// Reads a state for best_of. Many threads may call it at once, with a workspace each.
  void read(std::span<const double> state, Workspace& workspace) const {
    readout().read(state, workspace.readout);
    take_values(workspace.readout, workspace.values, true);
  }

  /// Learns one transition of dt usual steps; with Sarsa it is pending until the next action is
  /// known, unless it terminated. Steps of excursions are not learned, see Exploration. `next_mask`
  /// restricts the actions of the next state. Throws std::invalid_argument for a reward that is not
  /// finite or beyond +- 1e300, an impossible dt, or an environment that does not exist; then
  /// nothing has been learned.
  void learn(std::span<const double> state, Action action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0,
             ActionMask next_mask = {}, double dt = 1.0) {
    require_transition(state, action, reward, next_state, next_mask);
    require_duration(dt);
    Episode& episode = episodes_.of(environment);
    const bool is_of_excursion = std::exchange(episode.exploration.skips_learning, false) &&
                                 std::ranges::equal(action, episode.exploration.kept);
    if (is_of_excursion && !terminated) {
      end(episode);
      return;
    }
    if (episode.waits && !std::ranges::equal(episode.next_state, state)) finish_at_end(episode);
    readout().read_next(state, episode.next);
    if (episode.waits) finish(episode, action);
    std::swap(episode.present, episode.next);
    episode.state.assign(state.begin(), state.end());
    episode.action.assign(action.begin(), action.end());
    episode.reward = reward;
    episode.next_state.assign(next_state.begin(), next_state.end());
    episode.next_mask.assign(next_mask.begin(), next_mask.end());
    episode.dt = dt;
    episode.waits = true;
    if (reward != 0.0 && lacks_rewards()) exploration_.note_first_reward(n_learned_ - n_logged_);
    td_.fit_unit(reward, episodes_);
    if (readout().exponent()) n_logged_ = 0;
    ++n_learned_;
    apply_rates();
    if (terminated) {
      correct(episode, 0);
      end(episode);
      exploration_.note_end();
    } else if (config_.bootstrap == Bootstrap::q_learning) {
      correct_by_best(episode);
    }
  }

  /// Learns that a teacher chose an action in a state, and that its return was `value`. The values
  /// of all actions move by the error of the action's value, so that errors of the returns do not
  /// change the order of actions. Then, in each dimension in which the best other action is less
  /// than `margin` below the teacher's, both move apart by a tenth of the gap. Ends the episode of
  /// environment 0. Throws std::invalid_argument for a bad state, value or margin.
  void imitate(std::span<const double> state, Action action, double value, double margin) {
    require_transition(state, action, value, state, {});
    core::require_in_range("margin", margin, std::numeric_limits<double>::min(), kLargestReward);
    begin_episode();
    Episode& episode = episodes_.of(0);
    readout().read_next(state, episode.present);
    td_.fit_unit(value, episodes_);
    td_.fit_unit(margin, episodes_);
    ++n_learned_;
    apply_rates();
    const std::int64_t sum =
        td_.in_range(episodes_, [&] { return readout().sum(episode.present, action); });
    std::vector<std::int64_t> errors(readout().n_rows(), readout().units_of(value) - sum);
    td_.move_rows(episode, episodes_, errors, rate_);
    detail::separate(readout(), episode.present, action, readout().units_of(margin), errors);
    td_.move_rows(episode, episodes_, errors, kSeparationRate);
  }

  /// Whether the agent has acted in the present episode of an environment. Throws
  /// std::invalid_argument if the environment does not exist.
  bool has_acted(std::size_t environment) const {
    return episodes_.of(environment).exploration.step > 0;
  }
  /// Notes that the transition learned last was read from a log, and not made by the agent. Such
  /// transitions do not count in the length of the search after the first reward; see Exploration.
  void note_logged() noexcept {
    if (!readout().exponent()) ++n_logged_;
  }

  /// Makes the unit of values smaller if it is larger than necessary; see LinearTD.
  void refine_unit(std::int32_t size_in_window, std::int32_t size) {
    td_.refine_unit(size_in_window, size, episodes_);
  }

  /// Takes over weights, rates and random numbers of an agent that lacks the last inputs of this
  /// one; see LinearSDNN. Pending transitions are learned first, and traces end.
  void continue_from(QLambda fewer) {
    for (Episode& episode : fewer.episodes_) {
      if (episode.waits) fewer.finish_at_end(episode);
    }
    td_.readout().continue_from(fewer.readout());
    exploration_ = std::move(fewer.exploration_);
    rates_ = fewer.rates_;
    n_learned_ = fewer.n_learned_;
    n_logged_ = fewer.n_logged_;
    episodes_.resize(fewer.n_environments(), [this] { return new_episode(); });
    for (std::size_t i = 0; i < n_environments(); ++i) {
      episodes_.of(i).exploration = std::move(fewer.episodes_.of(i).exploration);
    }
    apply_rates();
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.part("action_value", self.td_.readout());
    Exploration::serialize(self.exploration_, archive);
    QLambda::serialize_rates(self, archive);
    archive.number("n_learned", self.n_learned_);
    archive.number_unless("n_logged", self.n_logged_, 0);
    Episodes<Episode>::serialize(
        self.episodes_, archive, [&self] { return self.new_episode(); },
        [&](auto& episode) {
          detail::serialize_episode(self.td_.readout(), self.exploration_, episode, archive);
        });
    if constexpr (Archive::kReads) {
      archive.expect(self.n_learned_ >= 0 && self.n_learned_ <= kMostLearned, "n_learned",
                     "in [0, 2^45]");
      archive.expect(self.n_logged_ >= 0 && self.n_logged_ <= self.n_learned_, "n_logged",
                     "in [0, n_learned]");
      self.apply_rates();
    }
  }

 private:
  friend class WithRates<QLambda>;
  friend class IndexAgent<QLambda>;

  /// Whether all rewards so far were 0, and therefore all values. The agent then repeats random
  /// actions, which find a first reward sooner than random ties do. With discrete states only it
  /// does not, because repeating an action does not lead in one direction there.
  bool lacks_rewards() const noexcept {
    const bool may_search = config_.max_action_repeat > 1 && epsilon() > 0.0;
    return may_search && n_learned_ > 0 && !readout().exponent() && !has_symbols_only();
  }
  /// Whether long episodes have excursions. With Sarsa they would be a part of the policy that is
  /// valued, and with discrete states only they would never become rare.
  bool makes_excursions() const noexcept {
    return config_.max_action_repeat > 1 && config_.bootstrap == Bootstrap::q_learning &&
           !has_symbols_only();
  }
  bool has_symbols_only() const noexcept {
    const std::vector<int>& n_symbols = readout().config().n_symbols;
    return !n_symbols.empty() && std::ranges::find(n_symbols, 0) == n_symbols.end();
  }

  static constexpr double kMostTolerance = 0x1p62;  ///< in units: above any difference of values
  /// With more transitions, products in detail::scheduled could exceed 64 bits.
  static constexpr std::int64_t kMostLearned = std::int64_t{1} << 45;
  static constexpr std::int32_t kOne = Readout::kRateOne;     ///< units of rates in 1
  static constexpr std::int32_t kSeparationRate = kOne / 10;  ///< of imitation (chosen)

  using Episode = detail::QLambdaEpisode;

  /// The state of an environment before its first step.
  Episode new_episode() const {
    return {.trace = readout().trace(),
            .present = readout().workspace(),
            .next = readout().workspace(),
            .state = std::vector<double>(n_inputs()),
            .action = std::vector<std::size_t>(n_dimensions()),
            .next_state = std::vector<double>(n_inputs()),
            .next_mask = {},
            .exploration = {.kept = std::vector<std::size_t>(n_dimensions())}};
  }

  void apply_rates(const auto& /*change*/) { apply_rates(); }
  /// Sets learning rate and epsilon: as callers set them, or by the steps learned or the progress.
  void apply_rates() {
    double rate = rates_.learning_rate(config_);
    double epsilon = rates_.epsilon(config_);
    if (config_.schedule_steps > 0) {
      const auto by_steps = [this](double first, double last) {
        return detail::scheduled(first, last, n_learned_, config_.schedule_steps, kOne) /
               static_cast<double>(kOne);
      };
      if (!rates_.set_learning_rate) {
        rate = by_steps(config_.learning_rate,
                        config_.final_learning_rate.value_or(config_.learning_rate));
      }
      if (!rates_.set_epsilon) epsilon = by_steps(config_.policy.epsilon, final_epsilon());
    }
    rate_ = std::max(1, static_cast<std::int32_t>(std::lround(rate * kOne)));
    exploration_.policy().set_epsilon(static_cast<double>(std::lround(epsilon * kOne)) /
                                      static_cast<double>(kOne));
  }

  void read_to_explore(std::span<const double> state, Episode& episode) {
    readout().read_next(state, episode.next);
    take_values(episode.next, workspace_.values, false);
  }
  /// Writes the values of all actions in the state that was read, in whole units of the readout.
  void take_values(Readout::Workspace& read, std::vector<std::vector<double>>& values,
                   bool averaged) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      std::ranges::copy(readout().sums(read, d, averaged), values[d].begin());
    }
  }

  /// Returns a best allowed action in the state read last. The tolerance is rounded to whole units.
  Action best_of_read(Workspace& workspace, core::Random& ties, ActionMask mask) const {
    for (std::vector<double>& row : workspace.values) exclude(take_part(mask, row.size()), row);
    const EpsilonGreedy& policy = exploration_.policy();
    const double tolerance =
        std::ldexp(policy.config().tie_tolerance, -readout().exponent().value_or(0));
    // Masked actions have the value -infinity. With a finite tolerance they never tie.
    const double whole = std::floor(std::min(tolerance, kMostTolerance));
    for (std::size_t d = 0; d < workspace.action.size(); ++d) {
      const std::span<const double> row = workspace.values[d];
      workspace.action[d] = policy.best_action(row, best_value(row) - whole, ties);
    }
    return workspace.action;
  }

  /// Returns the allowed action of the lowest value in the state that was read last, the first of
  /// several. Negates the values of the workspace, so that masked actions are not the lowest.
  Action worst_of_read(Workspace& workspace, ActionMask mask) const {
    for (std::size_t d = 0; d < workspace.action.size(); ++d) {
      std::vector<double>& row = workspace.values[d];
      for (double& value : row) value = -value;
      exclude(take_part(mask, row.size()), row);
      workspace.action[d] = static_cast<std::size_t>(std::ranges::max_element(row) - row.begin());
    }
    return workspace.action;
  }

  /// Continues the episode by `action`, taken in the state of episode.next: learns the pending
  /// transition of Sarsa, or ends the trace of Q-learning if the action is not a best one.
  void finish(Episode& episode, Action action) {
    if (config_.bootstrap == Bootstrap::q_learning) {
      const std::int64_t best = detail::best_sum(readout(), episode.next, episode.next_mask);
      if (readout().sum(episode.next, action) < best) end(episode);
    } else {
      correct(episode,
              td_.in_range(episodes_, [&] { return readout().sum(episode.next, action); }));
    }
    episode.waits = false;
  }

  /// Ends an episode that did not terminate.
  void finish_at_end(Episode& episode) {
    if (config_.bootstrap == Bootstrap::sarsa) correct_by_best(episode);
    end(episode);
  }

  /// Learns a transition by the best value of its next state.
  void correct_by_best(Episode& episode) {
    readout().read_next(episode.next_state, episode.next);
    correct(episode, td_.in_range(episodes_, [&] {
      return detail::best_sum(readout(), episode.next, episode.next_mask);
    }));
  }

  /// Ends the trace, so that no later reward is credited to past steps.
  static void end(Episode& episode) noexcept {
    episode.trace.clear();
    episode.old_value = 0;
    episode.dt = episode.trace_dt = 1.0;
    episode.waits = false;
  }

  /// Learns the episode's last transition; `next` is Q' in units of the readout.
  void correct(Episode& episode, std::int64_t next) {
    const bool is_dutch = config_.traces == TraceKind::dutch && n_environments() == 1;
    const auto error =
        td_.error_of(episode, episodes_, episode.action, episode.reward, next, is_dutch);
    td_.correct(episode, episodes_, episode.action, error, rate_, is_dutch);
  }

  QLambdaConfig config_;
  detail::LinearTD<Episode> td_;
  Exploration exploration_;
  std::int64_t n_learned_ = 0;
  std::int64_t n_logged_ = 0;  ///< transitions from logs before the first reward; 0 after it
  std::int32_t rate_ = 0;      ///< alpha, in units of 1 / kOne
  Workspace workspace_;
  Episodes<Episode> episodes_;
};

}  // namespace sdnn::agents
