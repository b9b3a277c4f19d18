/// Q(lambda) and Sarsa(lambda) with a linear readout of the SDNN code, in integers.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/agents/q_lambda_config.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/coding/action_code.hpp"
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
/// Q' is the value of the action that is taken next (Sarsa), or the best one (Q-learning: then a
/// worse action ends the trace). With Sarsa a transition waits until the next one begins where it
/// ended, or the episode ends. A terminated one has Q' = 0, any other end the best value. With
/// replacing traces z is x where x is not 0, and w moves along z alone. A step of alpha = 1
/// corrects the whole error of a state that comes for the first time; it never overshoots, for <z,
/// x> is bounded.
///
/// After the scaling of observations everything is an integer: alpha and epsilon in steps of 2^-16,
/// gamma of 2^-15, gamma lambda of 2^-13, traces of 2^-12, values and weights in the readout's
/// units. Products are rounded to the nearest, halves up, but for the decay of traces, which is
/// rounded towards 0. Every intermediate result fits into 64 bits, those of the columns into 32.
///
/// Source: van Seijen, H., Mahmood, A. R., Pilarski, P. M., Machado, M. C., Sutton, R. S. (2016).
/// True online temporal-difference learning (algorithm 2); Watkins, C. (1989), Q(lambda).
///
/// An agent may learn in several environments at once, numbered from 0: each has a trace of its
/// own, a replacing one where there are several: Q - Q_old would hold what the others corrected,
/// and dutch traces would carry it further.
class QLambda : public WithRates<QLambda> {
 public:
  using Readout = approximators::LinearSDNN;
  using Action = std::vector<std::size_t>;
  static constexpr bool kDecoupled = true;

  /// What one reader needs: the workspace of the readout, and the values of each dimension.
  struct Workspace {
    Readout::Workspace approximator;
    std::vector<std::vector<double>> values;
  };

  /// Throws std::invalid_argument naming the field that is out of range.
  QLambda(Readout action_value, const QLambdaConfig& config, std::uint64_t seed)
      : config_(checked_schedule(config)),
        action_value_(std::move(action_value)),
        exploration_(config, seed),
        workspace_(workspace()),
        episodes_(new_episode()) {
    apply_rates();
  }

  const QLambdaConfig& config() const noexcept { return config_; }
  Readout& action_value() noexcept { return action_value_; }
  const Readout& action_value() const noexcept { return action_value_; }

  std::size_t n_inputs() const { return action_value_.n_inputs(); }
  /// Dimensions of an action.
  std::size_t n_dimensions() const { return action_value_.n_dimensions(); }
  /// Actions of a dimension.
  std::size_t n_actions(std::size_t d) const { return action_value_.n_actions(d); }
  /// Transitions that were learned.
  std::int64_t n_learned() const noexcept { return n_learned_; }

  /// As they are now, in steps of 2^-16.
  double learning_rate() const noexcept { return static_cast<double>(rate_) / kOne; }
  double epsilon() const noexcept { return exploration_.policy().config().epsilon; }
  /// Where epsilon goes with schedule_steps: by default to 0. Symbols tell nothing of each other:
  /// where states have nothing else, epsilon stays, so that all of them are tried for good.
  double final_epsilon() const {
    const std::vector<int>& n_symbols = action_value_.config().n_symbols;
    const bool is_symbol = !n_symbols.empty() && std::ranges::find(n_symbols, 0) == n_symbols.end();
    return config_.final_epsilon.value_or(is_symbol ? config_.policy.epsilon : 0.0);
  }

  /// In how many environments at once the agent learns. What waits of those that are no more is
  /// learned. Throws std::invalid_argument outside [1, 2^14].
  void set_n_environments(std::size_t n) {
    core::require_in_range("n_environments", n, 1, Episodes<Episode>::kMost);
    for (std::size_t i = n; i < n_environments(); ++i) begin_episode(i);
    episodes_.resize(n, [this] { return new_episode(); });
  }
  std::size_t n_environments() const noexcept { return episodes_.size(); }

  /// Ends the trace, and learns the transition that still waits of an episode that did not
  /// terminate. Throws std::invalid_argument if there is no such environment.
  void begin_episode(std::size_t environment = 0) {
    Episode& episode = episodes_.of(environment);
    episode.exploration.begin();
    if (episode.waits) finish_at_end(episode);
  }

  Workspace workspace() const {
    Workspace workspace{action_value_.workspace(), {}};
    for (std::size_t d = 0; d < n_dimensions(); ++d) workspace.values.emplace_back(n_actions(d));
    return workspace;
  }

  /// The dimension's part of Q(state, a) for each of its actions. The span is valid until the
  /// workspace is used again. Shape: state (l,) in [0, 1]. Throws std::invalid_argument.
  std::span<const double> values(std::span<const double> state, Workspace& workspace,
                                 std::size_t d = 0) const {
    action_value_.values(state, workspace.approximator, workspace.values[d], d);
    return workspace.values[d];
  }

  /// A best action, as act without `explore` gives it; `ties` decides between several.
  Action best_action(std::span<const double> state, Workspace& workspace, core::Random& ties,
                     ActionMask mask = {}) const {
    require_mask("mask", mask);
    read(state, workspace);
    exclude_from(workspace, mask);
    return each_best(workspace, ties);
  }

  /// The two steps of act without `explore`: `read` takes the time and is for many threads, as
  /// values is; `best_of` gives the action in the state that was read last.
  void read(std::span<const double> state, Workspace& workspace) const {
    read(state, workspace, true);
  }
  Action best_of(Workspace& workspace, ActionMask mask = {}) {
    require_mask("mask", mask);
    return best_of(workspace, false, mask);
  }

  /// The action to take in `state`, an allowed one; without `explore` a best one, by the average of
  /// the weights where there is one. Shapes: state (l,) in [0, 1], mask as ActionMask has it.
  /// Throws std::invalid_argument.
  Action act(std::span<const double> state, bool explore = true, std::size_t environment = 0,
             ActionMask mask = {}) {
    Episode& episode = episodes_.of(environment);
    core::require_unit_values("state", state, n_inputs());  // before anything is drawn
    require_mask("mask", mask);
    const auto n_actions_of = [this](std::size_t d) { return n_actions(d); };
    if (explore && exploration_.takes_random_action(episode.exploration, n_actions_of, mask)) {
      return episode.exploration.kept;
    }
    if (!explore) {
      read(state, workspace_, true);
      return best_of(workspace_, false, mask);
    }
    action_value_.read_next(state, episode.next);
    take_values(episode.next, workspace_.values, false);
    return best_of(workspace_, true, mask);
  }

  /// The action of the first dimension as a number in [-1, 1]: actions cut the range evenly.
  double normalized_action(const Action& action) const {
    return coding::action_value(action.front(), n_actions(0), -1.0, 1.0);
  }

  /// Learns one transition: with Sarsa when the next one is known, unless it terminated. The best
  /// value of the next state is that of its allowed actions. Throws
  /// std::invalid_argument for a reward that is not finite or beyond +- 1e300 or an environment
  /// that is none; then nothing has been learned.
  void learn(std::span<const double> state, const Action& action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0,
             ActionMask next_mask = {}) {
    core::require_unit_values("state", state, n_inputs());
    require_action(action);
    core::require_finite("reward", reward);
    core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
    core::require_unit_values("next_state", next_state, n_inputs());
    require_mask("next_mask", next_mask);
    Episode& episode = episodes_.of(environment);
    if (episode.waits && !std::ranges::equal(episode.next_state, state)) finish_at_end(episode);
    action_value_.read_next(state, episode.next);
    if (episode.waits) finish(episode, action);
    std::swap(episode.present, episode.next);
    episode.state.assign(state.begin(), state.end());
    episode.action = action;
    episode.reward = reward;
    episode.next_state.assign(next_state.begin(), next_state.end());
    episode.next_mask.assign(next_mask.begin(), next_mask.end());
    episode.waits = true;
    halve_old_values(action_value_.fit_unit(reward));
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

  /// Makes the unit of values smaller where it is larger than it has to be: while no weight needs
  /// its 8 upper bits; and where recent rewards have so few bits that values 1,024 times those they
  /// could sum up to would fit. Then weights of larger values are clipped. Sizes of rewards are
  /// those of RewardScale, the last window's and the recent one.
  void refine_unit(std::int32_t size_in_window, std::int32_t size) {
    if (!action_value_.exponent()) return;
    const std::int32_t exponent = *action_value_.exponent();
    const std::int64_t n_weights = action_value_.n_weights_of(episodes_.of(0).present.code());
    const std::int64_t rest = std::max<std::int64_t>(kDiscountOne - discount(), 1);
    const int least_bits =
        Readout::most_bits_of(n_weights) - (kDiscountBits - floor_log2(rest)) - kImplausibleBits;
    const int n_free =
        std::min(action_value_.spare_bits(), 30 - (size_in_window - exponent)) - kRoomBits;
    const int n_lacking = least_bits - (size - exponent);
    const int n_refined = action_value_.refine_unit(std::max({n_free, n_lacking, 0}));
    for (std::size_t i = 0; i < episodes_.size(); ++i) {
      std::int64_t& old_value = episodes_.of(i).old_value;
      old_value = Readout::refined(old_value, n_refined);
    }
  }

  /// Takes over what an agent with fewer inputs has learned; see LinearSDNN. In each environment
  /// the transition that waits is learned, and the trace ends.
  void continue_from(QLambda fewer) {
    for (std::size_t i = 0; i < fewer.n_environments(); ++i) {
      if (fewer.episodes_.of(i).waits) fewer.finish_at_end(fewer.episodes_.of(i));
    }
    action_value_.continue_from(fewer.action_value_);
    exploration_ = std::move(fewer.exploration_);
    rates_ = fewer.rates_;
    n_learned_ = fewer.n_learned_;
    episodes_.resize(fewer.n_environments(), [this] { return new_episode(); });
    for (std::size_t i = 0; i < n_environments(); ++i) {
      episodes_.of(i).exploration = std::move(fewer.episodes_.of(i).exploration);
    }
    apply_rates();
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.part("action_value", self.action_value_);
    Exploration::serialize(self.exploration_, archive);
    QLambda::serialize_rates(self, archive);
    archive.number("n_learned", self.n_learned_);
    Episodes<Episode>::serialize(
        self.episodes_, archive, [&self] { return self.new_episode(); },
        [&](auto& episode) { serialize_episode(self, episode, archive); });
    if constexpr (Archive::kReads) {
      archive.expect(self.n_learned_ >= 0 && self.n_learned_ <= kMostLearned, "n_learned",
                     "in [0, 2^45]");
      self.apply_rates();
    }
  }

 private:
  friend class WithRates<QLambda>;

  static constexpr double kLargestReward = 1e300;
  static constexpr double kMostTolerance = 0x1p62;  ///< in units: above any difference of values
  static constexpr std::int64_t kMostLearned = std::int64_t{1} << 45;
  static constexpr std::int32_t kOne = Readout::kRateOne;
  static constexpr int kDiscountBits = 15;
  static constexpr std::int64_t kDiscountOne = std::int64_t{1} << kDiscountBits;
  static constexpr int kRoomBits = 8;  ///< that a smaller unit leaves for larger weights
  static constexpr int kImplausibleBits = 10;

  /// What belongs to the present episode in one environment.
  struct Episode {
    Readout::Trace trace;
    Readout::Workspace present;  ///< of state
    Readout::Workspace next;     ///< of the state after it, or another
    bool waits = false;  ///< the episode continues; with Sarsa, this transition is to be learned:
    std::vector<double> state;
    std::vector<std::size_t> action;
    double reward = 0.0;
    std::vector<double> next_state;
    std::vector<std::uint8_t> next_mask;
    std::int64_t old_value = 0;  ///< Q_old, in units
    Exploration::Episode exploration;
  };

  Episode new_episode() const {
    return {.trace = action_value_.trace(),
            .present = action_value_.workspace(),
            .next = action_value_.workspace(),
            .state = std::vector<double>(n_inputs()),
            .action = std::vector<std::size_t>(n_dimensions()),
            .next_state = std::vector<double>(n_inputs()),
            .next_mask = {},
            .exploration = {.kept = std::vector<std::size_t>(n_dimensions())}};
  }

  template <class Self, class Listed, class Archive>
  static void serialize_episode(Self& self, Listed& episode, Archive& archive) {
    archive.number("waits", episode.waits);
    archive.part("trace", episode.trace);
    archive.number("old_value", episode.old_value);
    std::vector<std::int64_t> action(episode.action.begin(), episode.action.end());
    archive.numbers("state", episode.state);
    archive.numbers("action", action);
    archive.number("reward", episode.reward);
    archive.numbers("next_state", episode.next_state);
    serialize_mask("next_mask", episode.next_mask, archive, self.n_dimensions(),
                   [&self](std::size_t d) { return self.n_actions(d); });
    self.exploration_.serialize_episode(episode.exploration, archive,
                                        [&self](std::size_t d) { return self.n_actions(d); });
    if constexpr (Archive::kReads) {
      const auto is_state = [&self](const std::vector<double>& state) {
        return state.size() == self.n_inputs() &&
               std::ranges::all_of(state, [](double x) { return x >= 0.0 && x <= 1.0; });
      };
      archive.expect(is_state(episode.state), "state", "a state in [0, 1]");
      archive.expect(is_state(episode.next_state), "next_state", "a state in [0, 1]");
      archive.expect(action.size() == self.n_dimensions(), "action", "one per dimension");
      for (std::size_t d = 0; d < action.size(); ++d) {
        archive.expect(action[d] >= 0 && static_cast<std::uint64_t>(action[d]) < self.n_actions(d),
                       "action", "an action");
        episode.action[d] = static_cast<std::size_t>(action[d]);
      }
      archive.expect(std::abs(episode.reward) <= kLargestReward, "reward", "a finite number");
      archive.expect(!Readout::is_too_large(episode.old_value), "old_value", "below 2^33 in size");
      archive.taking("reward", [&] { self.action_value_.fit_unit(episode.reward); });
      self.action_value_.read(episode.state, episode.present);
    }
  }

  /// The part of the way from the first to the final value that is done, in whole numbers.
  std::int32_t scheduled(double first, double last) const noexcept {
    const std::int64_t from = std::lround(first * kOne);
    const std::int64_t all = std::lround(last * kOne) - from;
    const std::int64_t end = n_learned_ + config_.schedule_steps;
    // Halves up; the quotient of a negative number is rounded down likewise.
    const std::int64_t twice = 2 * all * n_learned_ + end;
    const std::int64_t quotient = twice / (2 * end) - (twice % (2 * end) < 0 ? 1 : 0);
    return static_cast<std::int32_t>(from + quotient);
  }

  void apply_rates(const auto& /*change*/) { apply_rates(); }
  void apply_rates() {
    double rate = rates_.learning_rate(config_);
    double epsilon = rates_.epsilon(config_);
    if (config_.schedule_steps > 0) {
      if (!rates_.set_learning_rate) {
        rate = scheduled(config_.learning_rate,
                         config_.final_learning_rate.value_or(config_.learning_rate)) /
               static_cast<double>(kOne);
      }
      if (!rates_.set_epsilon) {
        epsilon = scheduled(config_.policy.epsilon, final_epsilon()) / static_cast<double>(kOne);
      }
    }
    rate_ = std::max(1, static_cast<std::int32_t>(std::lround(rate * kOne)));
    exploration_.policy().set_epsilon(static_cast<double>(std::lround(epsilon * kOne)) /
                                      static_cast<double>(kOne));
  }

  static int floor_log2(std::int64_t x) noexcept {
    return static_cast<int>(std::bit_width(static_cast<std::uint64_t>(x))) - 1;
  }
  std::int64_t discount() const noexcept {
    return std::lround(config_.discount * static_cast<double>(kDiscountOne));
  }

  void require_mask(const char* name, ActionMask mask) const {
    agents::require_mask(name, mask, n_dimensions(), [this](auto d) { return n_actions(d); });
  }
  static void exclude_from(Workspace& workspace, ActionMask mask) {
    for (std::vector<double>& row : workspace.values) exclude(take_part(mask, row.size()), row);
  }
  void require_action(const Action& action) const {
    if (action.size() != n_dimensions()) {  // only a bad one's text costs memory
      core::require(false, "action", std::to_string(n_dimensions()) + " numbers", action.size());
    }
    for (std::size_t d = 0; d < action.size(); ++d) {
      if (action[d] < n_actions(d)) continue;
      core::require(false, "action", "less than " + std::to_string(n_actions(d)), action[d]);
    }
  }

  void read(std::span<const double> state, Workspace& workspace, bool averaged) const {
    action_value_.read(state, workspace.approximator);
    take_values(workspace.approximator, workspace.values, averaged);
  }
  /// Values in units, which are exact and in the same order.
  void take_values(Readout::Workspace& read, std::vector<std::vector<double>>& values,
                   bool averaged) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      std::ranges::copy(action_value_.sums(read, d, averaged), values[d].begin());
    }
  }

  /// One of the best actions in each dimension. The tolerance is in whole units, as values are.
  Action each_best(const Workspace& workspace, core::Random& ties) const {
    const EpsilonGreedy& policy = exploration_.policy();
    const double tolerance =
        std::ldexp(policy.config().tie_tolerance, -action_value_.exponent().value_or(0));
    // Finite, so that actions that are not allowed never tie.
    const double whole = std::floor(std::min(tolerance, kMostTolerance));
    Action action(workspace.values.size());
    for (std::size_t d = 0; d < action.size(); ++d) {
      const std::span<const double> row = workspace.values[d];
      action[d] = policy.best_action(row, best_value(row) - whole, ties);
    }
    return action;
  }
  Action best_of(Workspace& workspace, bool explore, ActionMask mask) {
    exclude_from(workspace, mask);
    return each_best(workspace, exploration_.policy().ties(explore));
  }

  std::int64_t best_sum(Readout::Workspace& read, ActionMask mask) const {
    std::int64_t total = 0;
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      const auto sums = action_value_.sums(read, d);
      const ActionMask part = take_part(mask, sums.size());
      if (part.empty()) {
        total += std::ranges::max(sums);
        continue;
      }
      std::int64_t best = std::numeric_limits<std::int64_t>::min();
      for (std::size_t a = 0; a < sums.size(); ++a) {
        if (part[a] != 0) best = std::max(best, sums[a]);
      }
      total += best;
    }
    return total;
  }

  /// After the unit was doubled so often.
  void halve_old_values(int n_doubled) {
    for (; n_doubled > 0; --n_doubled) {
      for (std::size_t i = 0; i < episodes_.size(); ++i) {
        std::int64_t& old_value = episodes_.of(i).old_value;
        old_value = approximators::halved(old_value);
      }
    }
  }

  /// A value that `compute` returns, in units that are large enough for it; `other` is in units
  /// too.
  template <class Compute>
  std::int64_t in_range(const Compute& compute, std::int64_t* other = nullptr) {
    std::int64_t value = compute();
    while (Readout::is_too_large(value)) {
      action_value_.double_unit();
      halve_old_values(1);
      if (other != nullptr) *other = approximators::halved(*other);
      value = compute();
    }
    return value;
  }

  /// Continues the episode: in the state of episode.next, `action` is taken.
  void finish(Episode& episode, const Action& action) {
    if (config_.bootstrap == Bootstrap::q_learning) {
      const std::int64_t best = best_sum(episode.next, episode.next_mask);
      if (action_value_.sum(episode.next, action) < best) end(episode);
    } else {
      correct(episode, in_range([&] { return action_value_.sum(episode.next, action); }));
    }
    episode.waits = false;
  }

  /// Ends an episode that has no terminal state.
  void finish_at_end(Episode& episode) {
    if (config_.bootstrap == Bootstrap::sarsa) correct_by_best(episode);
    end(episode);
  }

  /// Learns a transition by the best value of its next state.
  void correct_by_best(Episode& episode) {
    action_value_.read_next(episode.next_state, episode.next);
    correct(episode, in_range([&] { return best_sum(episode.next, episode.next_mask); }));
  }

  static void end(Episode& episode) noexcept {
    episode.trace.clear();
    episode.old_value = 0;
    episode.waits = false;
  }

  /// One step of learning, `next` being Q' in units.
  void correct(Episode& episode, std::int64_t next) {
    const std::int64_t value =
        in_range([&] { return action_value_.sum(episode.present, episode.action); }, &next);
    const std::int64_t target = action_value_.units_of(episode.reward) +
                                ((next * discount() + (kDiscountOne >> 1)) >> kDiscountBits);
    const bool is_dutch = config_.traces == TraceKind::dutch && n_environments() == 1;
    const std::int64_t drift = is_dutch ? value - episode.old_value : 0;
    episode.old_value = next;
    const auto decay = static_cast<std::int32_t>(
        std::lround(config_.discount * config_.trace_decay * approximators::kDecayOne));
    halve_old_values(action_value_.learn(episode.present.code(), episode.action, episode.trace,
                                         {.error = target - value + drift,
                                          .correction = drift,
                                          .rate = rate_,
                                          .decay = decay,
                                          .is_dutch = is_dutch}));
  }

  QLambdaConfig config_;
  Readout action_value_;
  Exploration exploration_;
  std::int64_t n_learned_ = 0;
  std::int32_t rate_ = 0;  ///< alpha, kOne for 1
  Workspace workspace_;
  Episodes<Episode> episodes_;
};

}  // namespace sdnn::agents
