/// Exploration, which decides when actions are random, and how long they are repeated; and the base
/// class of agents whose actions are indices.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// An epsilon-greedy policy for actions of any number of dimensions. In a random action all
/// dimensions are random.
///
/// With max_action_repeat = m > 1 a random action is repeated for d steps, where P(d >= k) = 1 / k
/// for k <= m. Repeated actions reach states that single random steps do not reach.
/// Source: Dabney, W., Ostrovski, G., Barreto, A. (2021). Temporally-extended epsilon-greedy
/// exploration (with this distribution in the place of the zeta one, which it resembles).
///
/// Each terminated episode that is reported (note_end) halves m, down to five: where episodes
/// terminate, long random actions mostly end them early. Where none has terminated, the goal may be
/// a terminal state that only long actions reach.
///
/// A *search* is a time in which all actions are random, and their lengths uniform up to m / 2: a
/// rare reward often needs many steps in the same direction. QLambda searches while all rewards
/// were 0, and for some time after the first other reward.
///
/// In an episode without an end an agent would stay in good states and learn little of all others.
/// After kLongEpisode steps of an episode, each 1 in kDrawsForExcursion of the explorations is an
/// *excursion* instead of a random action: several steps that take the worst action, in a number
/// that is uniform up to the longest random action at present. These steps are not learned unless
/// they terminate. If they were, values of all actions would rise: errors of the best values are
/// corrected only where best actions are taken.
///
/// In its first start_steps steps an agent takes random actions only, so that it finds a rare
/// success before greedy actions have learned to avoid effort. Source: the start_steps of Achiam,
/// J. (2018), Spinning up in deep reinforcement learning; here the actions are repeated as above.
class Exploration {
 public:
  /// The action of a step: one with the largest value, a random one, or one with the least value.
  enum class Choice { best, random, worst };

  /// The state of the present episode in one environment.
  struct Episode {
    std::vector<std::size_t> kept;  ///< the random action, or the last one of the excursion
    int n_kept = 0;                 ///< further steps of this random action, or of the excursion
    bool is_excursion = false;      ///< whether these are steps of an excursion
    bool skips_learning = false;    ///< whether the last act was one of an excursion
    int step = 0;                   ///< the number of the next act in the episode

    void begin() noexcept {
      step = 0;
      n_kept = 0;
      is_excursion = skips_learning = false;
    }
  };

  /// Takes the fields of a learning configuration. Throws std::invalid_argument naming the field.
  template <class Config>
  Exploration(const Config& config, std::uint64_t seed)
      : policy_(config.policy, seed),
        repetitions_(seed, core::Stream::repetitions),
        max_action_repeat_(config.max_action_repeat),
        start_steps_(config.start_steps),
        // Only QLambda, whose configuration has traces, searches for first rewards.
        most_random_left_(requires { config.traces; } ? 1 << 30 : config.start_steps),
        n_random_left_(config.start_steps) {}

  EpsilonGreedy& policy() noexcept { return policy_; }
  const EpsilonGreedy& policy() const noexcept { return policy_; }

  /// Notes that an episode terminated, which halves the largest number of repetitions. It has no
  /// effect during a search, whose goal may be a terminal state.
  void note_end() noexcept {
    if (start_steps_ == 0 && n_random_left_ > 0) return;
    n_ended_ = std::min(n_ended_ + 1, kMostEnded);
  }
  /// Notes that the first reward other than 0 came after n_steps: the next 2 n_steps are random.
  void note_first_reward(std::int64_t n_steps) noexcept {
    if (start_steps_ > 0) return;  // the first steps are random in any case
    n_random_left_ = static_cast<int>(std::min<std::int64_t>(2 * n_steps, most_random_left_));
  }

  /// Returns which action the next step takes. A random one is written to episode.kept: an index
  /// below n_actions(d) in each dimension d, allowed by `mask`. A repeated action ends early if it
  /// is no longer allowed. With `lacks_order`, when no action is known to be better than another,
  /// every step is random. Excursions need `makes_excursions`.
  template <class NActions>
  Choice choose(Episode& episode, const NActions& n_actions, ActionMask mask = {},
                bool lacks_order = false, bool makes_excursions = false) {
    const int step = episode.step;
    if (step < kMostSteps) ++episode.step;
    episode.skips_learning = false;
    if (episode.is_excursion && !policy_.may_explore(step)) episode.n_kept = 0;
    if (episode.n_kept == 0) episode.is_excursion = false;
    if (!episode.is_excursion && !allows_action(mask, episode.kept, n_actions)) episode.n_kept = 0;
    const bool at_random = n_random_left_ > 0 && (start_steps_ > 0 || policy_.may_explore(step));
    if (at_random) --n_random_left_;
    const bool must_explore = at_random || (lacks_order && policy_.may_explore(step));
    if (episode.n_kept == 0 && !must_explore && !policy_.explores(step)) return Choice::best;
    if (episode.n_kept > 0) {
      --episode.n_kept;
      episode.skips_learning = episode.is_excursion;
      return episode.is_excursion ? Choice::worst : Choice::random;
    }
    episode.is_excursion = makes_excursions && !must_explore && step >= kLongEpisode &&
                           repetitions_.below(kDrawsForExcursion) == 0;
    if (episode.is_excursion) {
      episode.skips_learning = true;
      episode.n_kept = static_cast<int>(repetitions_.below(static_cast<std::uint64_t>(longest())));
      return Choice::worst;
    }
    draw_action(episode.kept, n_actions, mask);
    if (max_action_repeat_ > 1) {
      const bool is_search = must_explore && start_steps_ == 0;
      episode.n_kept = is_search ? draw_length_of_search() : draw_length();
    }
    return Choice::random;
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.part("policy", self.policy_);
    archive.part("repetitions", self.repetitions_);
    archive.number_unless("n_random_left", self.n_random_left_, 0);
    archive.number_unless("n_ended", self.n_ended_, 0);
    if constexpr (Archive::kReads) {
      archive.expect(
          self.n_random_left_ >= 0 && self.n_random_left_ <= self.most_random_left_,
          "n_random_left",
          self.most_random_left_ == self.start_steps_ ? "in [0, start_steps]" : "in [0, 2^30]");
      archive.expect(self.n_ended_ >= 0 && self.n_ended_ <= kMostEnded, "n_ended", "in [0, 20]");
    }
  }
  /// Lists what is saved of an environment's episode; see core/state.hpp.
  template <class Listed, class Archive, class NActions>
  void serialize_episode(Listed& episode, Archive& archive, const NActions& n_actions) const {
    archive.number("step", episode.step);
    serialize_action("kept_action", episode.kept, archive, n_actions);
    archive.number("n_kept", episode.n_kept);
    archive.number_unless("is_excursion", episode.is_excursion, false);
    archive.number_unless("skips_learning", episode.skips_learning, false);
    if constexpr (Archive::kReads) {
      archive.expect(episode.step >= 0, "step", "0 or more");
      archive.expect(episode.n_kept >= 0 && episode.n_kept < max_action_repeat_, "n_kept",
                     "in [0, max_action_repeat)");
    }
  }

 private:
  static constexpr int kShort = 5;           // length to which ends shorten random actions (chosen)
  static constexpr int kLongEpisode = 2000;  // steps before the first excursion (chosen)
  static constexpr std::uint64_t kDrawsForExcursion = 4;  // explorations for each (chosen)
  static constexpr int kMostSteps = 1 << 30;              // further steps are not counted
  static constexpr int kMostEnded = 20;  // ends; max_action_repeat, at most 10^6, is below 2^20

  /// Draws an allowed index below n_actions(d) for each dimension d.
  void draw_action(std::vector<std::size_t>& action, const auto& n_actions, ActionMask mask) {
    for (std::size_t d = 0; d < action.size(); ++d) {
      const std::size_t n = n_actions(d);
      action[d] = draw_allowed(take_part(mask, n), n, [this](std::size_t n_allowed) {
        return policy_.random_action(n_allowed);
      });
    }
  }
  /// Draws how long a random action is repeated: with u uniform in (0, 1], P(1 / u >= k) is 1 / k.
  int draw_length() noexcept {
    const double u = 1.0 - repetitions_.uniform(), most = longest();
    return static_cast<int>(std::min(1.0 / u, most)) - 1;
  }
  int draw_length_of_search() noexcept {
    return static_cast<int>(repetitions_.below(static_cast<std::uint64_t>(max_action_repeat_ / 2)));
  }

  /// Steps that a random action may last now.
  int longest() const noexcept {
    return std::max(max_action_repeat_ >> n_ended_, std::min(kShort, max_action_repeat_));
  }

  EpsilonGreedy policy_;
  core::Random repetitions_;
  int max_action_repeat_;
  int start_steps_;
  int most_random_left_;  ///< the largest possible n_random_left_
  int n_random_left_;     ///< further steps that are random: start steps, or those of a search
  int n_ended_ = 0;       ///< episodes that terminated, kMostEnded at most
};

/// The largest magnitude of a reward. Doubles reach 1.8e308, so sums of many rewards stay finite.
inline constexpr double kLargestReward = 1e300;

/// Base of agents whose actions are indices, one for each dimension; `Agent` is the derived class.
///
/// It must have `workspace_`, `episodes_`, and
/// - new_episode();
/// - read(state, workspace): reads a state for greedy actions;
/// - best_of_read(workspace, ties, mask): a best action in the state that was read last.
/// An epsilon-greedy agent has `exploration_`, a member `exploration` in each episode, and
/// - read_to_explore(state, episode): reads a state into workspace_ for exploring actions;
/// - worst_of_read(workspace, mask), lacks_rewards() and makes_excursions(), if it makes any.
/// Any other agent hides epsilon, explore and evaluation_ties.
template <class Agent>
class IndexAgent : public WithRates<Agent> {
 public:
  using Action = std::span<const std::size_t>;

  double epsilon() const noexcept { return agent().exploration_.policy().config().epsilon; }

  /// Sets the number of environments in which the agent learns at once; each has a separate
  /// episode. Pending transitions of removed environments are learned first. Throws
  /// std::invalid_argument outside [1, 2^14], and std::overflow_error if learning does.
  void set_n_environments(std::size_t n) {
    core::require_in_range("n_environments", n, 1, kMostEnvironments);
    for (std::size_t i = n; i < n_environments(); ++i) agent().begin_episode(i);
    agent().episodes_.resize(n, [this] { return agent().new_episode(); });
  }
  std::size_t n_environments() const noexcept { return agent().episodes_.size(); }

  /// Returns an allowed action to take in `state`. Without `explore` it is a best one, by the
  /// average of the weights if the approximator keeps an average. The span is valid until the next
  /// act. Shapes: state (l,) in [0, 1], mask as in ActionMask. Throws std::invalid_argument.
  Action act(std::span<const double> state, bool explore = true, std::size_t environment = 0,
             ActionMask mask = {}) {
    Agent& self = agent();
    auto& episode = self.episodes_.of(environment);
    core::require_unit_values("state", state, self.n_inputs());  // before anything is drawn
    require_mask("mask", mask);
    if (explore) return self.explore(state, episode, mask);
    self.read(state, self.workspace_);
    return self.best_of_read(self.workspace_, self.evaluation_ties(), mask);
  }

  /// Returns a best action without changing the agent, so that several threads may call it; `ties`
  /// draws among several. The span is valid until the workspace is used again.
  template <class Workspace>
  Action best_action(std::span<const double> state, Workspace& workspace, core::Random& ties,
                     ActionMask mask = {}) const {
    require_mask("mask", mask);
    agent().read(state, workspace);
    return agent().best_of_read(workspace, ties, mask);
  }
  /// Returns a best action in the state that `read` has read last: the second step of a greedy act.
  template <class Workspace>
  Action best_of(Workspace& workspace, ActionMask mask = {}) {
    require_mask("mask", mask);
    return agent().best_of_read(workspace, agent().evaluation_ties(), mask);
  }

  /// The action of the first dimension as a number: actions are evenly spaced in [-1, 1].
  double normalized_action(Action action) const {
    return coding::action_value(action.front(), agent().n_actions(0), -1.0, 1.0);
  }

 protected:
  core::Random& evaluation_ties() noexcept { return agent().exploration_.policy().ties(false); }
  /// Returns the action of an exploring act in an episode, of an epsilon-greedy agent.
  Action explore(std::span<const double> state, auto& episode, ActionMask mask) {
    Agent& self = agent();
    Exploration& exploration = self.exploration_;
    auto choice = Exploration::Choice::best;
    if constexpr (requires { self.worst_of_read(self.workspace_, mask); }) {
      choice = exploration.choose(episode.exploration, n_actions_of(), mask, self.lacks_rewards(),
                                  self.makes_excursions());
    } else {
      choice = exploration.choose(episode.exploration, n_actions_of(), mask);
    }
    if (choice == Exploration::Choice::random) return episode.exploration.kept;
    self.read_to_explore(state, episode);
    if constexpr (requires { self.worst_of_read(self.workspace_, mask); }) {
      if (choice == Exploration::Choice::worst) {
        const Action worst = self.worst_of_read(self.workspace_, mask);
        std::ranges::copy(worst, episode.exploration.kept.begin());
        return worst;
      }
    }
    return self.best_of_read(self.workspace_, exploration.policy().ties(true), mask);
  }
  /// The function that gives the number of actions of a dimension.
  auto n_actions_of() const noexcept {
    return [this](std::size_t d) { return agent().n_actions(d); };
  }
  void require_mask(const char* name, ActionMask mask) const {
    agents::require_mask(name, mask, agent().n_dimensions(), n_actions_of());
  }
  /// Throws std::invalid_argument unless `learn` accepts these arguments.
  void require_transition(std::span<const double> state, Action action, double reward,
                          std::span<const double> next_state, ActionMask next_mask) const {
    core::require_unit_values("state", state, agent().n_inputs());
    agents::require_action(action, agent().n_dimensions(), n_actions_of());
    core::require_finite("reward", reward);
    core::require_in_range("reward", reward, -kLargestReward, kLargestReward);
    core::require_unit_values("next_state", next_state, agent().n_inputs());
    require_mask("next_mask", next_mask);
  }

 private:
  Agent& agent() noexcept { return static_cast<Agent&>(*this); }
  const Agent& agent() const noexcept { return static_cast<const Agent&>(*this); }
};

}  // namespace sdnn::agents
