/// The first steps of an agent that does not know the ranges of its observations yet.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/episodes.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/pcg64.hpp"

namespace sdnn::agents {

/// Acts at random and stores transitions, which the agent learns when the warm-up is over.
///
/// A random action is repeated for at least k steps with probability 1 / k, because single random
/// steps would stay near the start. Each environment has a separate action.
class WarmUp {
 public:
  /// A transition, with observations and the action in the units of the task.
  struct Step {
    bool begins;  ///< whether it is the first of an episode
    std::size_t environment;
    std::span<const double> observation, action;
    double reward;
    std::span<const double> next_observation;
    bool terminated;
    ActionMask next_mask = {};
    bool is_own = true;  ///< whether the agent acted in its episode; else it is from a log
    double dt = 1.0;     ///< its duration in usual steps
  };

  /// The warm-up lasts for n_steps transitions. Without `learns_any_transition`, for agents that
  /// learn only their last action, it does not end between an act and the learning of its result.
  WarmUp(std::size_t n_variables, std::size_t n_dimensions, std::size_t n_steps, std::uint64_t seed,
         bool learns_any_transition)
      : n_variables_(n_variables),
        n_dimensions_(n_dimensions),
        n_steps_(n_steps),
        learns_any_transition_(learns_any_transition),
        random_(std::array{seed, kStream}),
        evaluation_(std::array{seed, kStream + 1}),
        episodes_({Episode(n_dimensions)}) {}

  std::size_t n_environments() const noexcept { return episodes_.size(); }
  /// Adds or removes environments at the end. Throws std::invalid_argument outside [1, 2^14].
  void set_n_environments(std::size_t n) {
    episodes_.resize(n, [this] { return Episode(n_dimensions_); });
  }
  /// The number of environments that learning the stored transitions needs: that of now, or a
  /// larger one if transitions are of environments that were removed since.
  std::size_t n_in_all() const {
    std::size_t n = n_environments();
    for (const std::int64_t i : environments_) n = std::max(n, static_cast<std::size_t>(i) + 1);
    return n;
  }
  std::size_t size() const noexcept { return rewards_.size(); }
  /// Rewards of all transitions, shape (size,).
  std::span<const double> rewards() const noexcept { return rewards_; }
  bool is_over() const {
    return size() >= n_steps_ && std::ranges::none_of(episodes_, &Episode::acted);
  }

  /// Begins an episode, without repeating an action of the last. Throws std::invalid_argument.
  void begin_episode(std::size_t environment) {
    Episode& episode = episodes_.of(environment);
    episode.begins = true;
    episode.n_kept = 0;
    episode.acted = episode.has_acted = false;
  }
  /// Whether the agent has acted in the present episode. Throws std::invalid_argument.
  bool has_acted(std::size_t environment) const { return episodes_.of(environment).has_acted; }

  /// Returns a random action: the last one while it is repeated and allowed, else a new one that
  /// `draw(generator, action)` writes. Without `explore` a separate stream draws a new one. Throws
  /// std::invalid_argument if the environment does not exist.
  template <class Draw, class IsAllowed>
  std::vector<double> act(const Draw& draw, const IsAllowed& is_allowed, bool explore,
                          std::size_t environment) {
    Episode& episode = episodes_.of(environment);
    if (!explore) {
      std::vector<double> action(n_dimensions_);
      draw(evaluation_, action);
      return action;
    }
    if (episode.n_kept == 0 || !is_allowed(episode.kept)) {
      draw(random_, episode.kept);
      episode.n_kept =
          static_cast<std::int64_t>(std::min(1.0 / (1.0 - random_.uniform()), kMostRepetitions));
    }
    --episode.n_kept;
    episode.acted = !learns_any_transition_;
    episode.has_acted = true;
    return episode.kept;
  }

  /// Remembers a transition. Throws std::invalid_argument if there is no such environment.
  void learn(const Step& step) {
    Episode& episode = episodes_.of(step.environment);
    const auto append = [](auto& list, const auto& values) {
      list.insert(list.end(), values.begin(), values.end());
    };
    note_mask(step.next_mask);
    note_origin(step.is_own);
    note_duration(step.dt);
    append(observations_, step.observation);
    append(next_observations_, step.next_observation);
    append(actions_, step.action);
    rewards_.push_back(step.reward);
    terminated_.push_back(step.terminated ? 1 : 0);
    begins_.push_back(episode.begins ? 1 : 0);
    environments_.push_back(static_cast<std::int64_t>(step.environment));
    episode.begins = episode.acted = false;
    episode.has_acted = step.is_own;
  }

  /// All observations, then all next observations. Shape: (2 size, n_variables).
  std::vector<double> all_observations() const {
    std::vector<double> all = observations_;
    all.insert(all.end(), next_observations_.begin(), next_observations_.end());
    return all;
  }
  /// Transition number t, in the order in which they were learned.
  Step step(std::size_t t) const {
    const auto row = [t](const std::vector<double>& values, std::size_t n) {
      return std::span(values).subspan(t * n, n);
    };
    return {begins_[t] != 0,
            static_cast<std::size_t>(environments_[t]),
            row(observations_, n_variables_),
            row(actions_, n_dimensions_),
            rewards_[t],
            row(next_observations_, n_variables_),
            terminated_[t] != 0,
            std::span(next_masks_).subspan(t * mask_size(), mask_size()),
            logged_.empty() || logged_[t] == 0,
            dts_.empty() ? 1.0 : dts_[t]};
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.numbers("observations", self.observations_);
    archive.numbers("actions", self.actions_);
    archive.numbers("rewards", self.rewards_);
    archive.numbers("next_observations", self.next_observations_);
    archive.numbers("terminated", self.terminated_);
    archive.some_numbers("next_masks", self.next_masks_);
    archive.some_numbers("logged", self.logged_);
    archive.some_numbers("dts", self.dts_);
    archive.numbers("begins", self.begins_);
    archive.numbers("environments", self.environments_);
    archive.part("random", self.random_);
    archive.part("evaluation", self.evaluation_);
    Episodes<Episode>::serialize(
        self.episodes_, archive, [&self] { return Episode(self.n_dimensions_); },
        [&](auto& episode) {
          archive.number("episode.begins", episode.begins);
          archive.number("episode.acted", episode.acted);
          // Usually an agent has acted unless the episode begins with its next transition.
          archive.number_unless("episode.has_acted", episode.has_acted, !episode.begins);
          archive.number("episode.n_kept", episode.n_kept);
          archive.numbers("episode.kept", episode.kept);
          if constexpr (Archive::kReads) {
            archive.expect(episode.kept.size() == self.n_dimensions_, "episode.kept", "an action");
            archive.expect(episode.n_kept >= 0 && episode.n_kept <= 100, "episode.n_kept",
                           "in [0, 100]");
          }
        });
    if constexpr (Archive::kReads) self.check(archive);
  }

  /// Whether `holds(step)` of every transition, and `is_action(kept)` of every action kept.
  template <class Holds, class IsAction>
  bool each_is(const Holds& holds, const IsAction& is_action) const {
    for (std::size_t t = 0; t < size(); ++t) {
      if (!holds(step(t))) return false;
    }
    return std::ranges::all_of(episodes_, is_action, &Episode::kept);
  }

 private:
  /// The state of the present episode in one environment.
  struct Episode {
    explicit Episode(std::size_t n_dimensions) : kept(n_dimensions) {}
    bool begins = true;        ///< whether its next transition is its first
    bool acted = false;        ///< whether the result of an act must still be learned
    bool has_acted = false;    ///< whether the agent has acted in it
    std::vector<double> kept;  ///< the random action that is repeated
    std::int64_t n_kept = 0;   ///< steps for which it will be repeated
  };

  static constexpr std::uint64_t kStream = std::uint64_t{1} << 32U;  // of the agent's seed
  static constexpr double kMostRepetitions = 100.0;                  // chosen

  /// The size of each transition's mask: 0 until a transition had one.
  std::size_t mask_size() const noexcept { return size() == 0 ? 0 : next_masks_.size() / size(); }
  /// Appends the mask of a transition. Once a transition had one, all others get a mask that allows
  /// every action. Called before the transition's reward is appended, which size() counts.
  void note_mask(ActionMask mask) {
    const std::size_t n = std::max(mask.size(), mask_size());
    next_masks_.resize(size() * n, 1);
    next_masks_.insert(next_masks_.end(), mask.begin(), mask.end());
    next_masks_.resize((size() + 1) * n, 1);
  }

  /// Appends whether a transition is from a log. The list is empty until one is.
  void note_origin(bool is_own) {
    if (is_own && logged_.empty()) return;
    logged_.resize(size());
    logged_.push_back(is_own ? 0 : 1);
  }

  /// Appends the duration of a transition. The list is empty until one is not 1.
  void note_duration(double dt) {
    if (dt == 1.0 && dts_.empty()) return;
    dts_.resize(size(), 1.0);
    dts_.push_back(dt);
  }

  /// Checks what was read from a file: all lists belong to the same transitions.
  template <class Archive>
  void check(Archive& archive) const {
    const std::size_t n = size();
    archive.expect(observations_.size() == n * n_variables_, "observations", "one per reward");
    archive.expect(next_observations_.size() == n * n_variables_, "next_observations",
                   "one per reward");
    archive.expect(actions_.size() == n * n_dimensions_, "actions", "one per reward");
    archive.expect(terminated_.size() == n, "terminated", "one per reward");
    archive.expect(next_masks_.size() == n * mask_size(), "next_masks", "as many of every reward");
    archive.expect(logged_.empty() || logged_.size() == n, "logged", "one per reward, or none");
    expect_durations(dts_, n, archive);
    archive.expect(begins_.size() == n, "begins", "one per reward");
    archive.expect(environments_.size() == n, "environments", "one per reward");
    archive.expect(!is_over(), "rewards", "fewer than the warm-up's steps");
    const auto is_environment = [](std::int64_t i) {
      return i >= 0 && i < static_cast<std::int64_t>(kMostEnvironments);
    };
    archive.expect(std::ranges::all_of(environments_, is_environment), "environments",
                   "numbers of environments");
  }

  std::size_t n_variables_, n_dimensions_, n_steps_;
  bool learns_any_transition_;
  core::Pcg64 random_, evaluation_;
  std::vector<double> observations_, next_observations_, actions_, rewards_, dts_;
  std::vector<std::uint8_t> terminated_, begins_, next_masks_, logged_;
  std::vector<std::int64_t> environments_;
  Episodes<Episode> episodes_;
};

}  // namespace sdnn::agents
