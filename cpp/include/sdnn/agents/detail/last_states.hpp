/// The states in which transitions ended, where ranges change from step to step.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sdnn/agents/observations.hpp"

namespace sdnn::agents::detail {

/// In each environment the last observation and its state, which is the next transition's first: it
/// stays as it was, so that traces go on.
class LastStates {
 public:
  LastStates(std::size_t n_variables, std::size_t n_inputs)
      : n_variables_(n_variables), n_inputs_(n_inputs) {}

  /// Finds the state of an observation in which an agent acts, or from which a transition starts;
  /// `is_kept` where the agent may learn from it. Throws as Observations::scale.
  void read(const Observations& observations, std::size_t environment,
            std::span<const double> observation, std::span<double> state, bool is_kept = false) {
    if (is_last(environment, observation)) {
      std::ranges::copy(last_[environment].state, state.begin());
      return;
    }
    observations.scale(observation, state);
    if (is_kept && observations.is_running()) keep(environment, observation, state, false);
  }
  /// Finds the state in which a transition ends. Running ranges follow both observations, each
  /// once.
  void follow(Observations& observations, std::size_t environment,
              std::span<const double> observation, std::span<const double> next_observation,
              std::span<double> next_state) {
    observations.scale(next_observation, next_state, "next_observation");
    if (!observations.is_running()) return;
    if (!is_last(environment, observation) || !last_[environment].is_noted) {
      observations.note(observation);
    }
    observations.note(next_observation);
    observations.scale(next_observation, next_state);
    keep(environment, next_observation, next_state, true);
  }
  void forget(std::size_t environment) {
    if (environment < last_.size()) last_[environment] = {};
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
        archive.numbers("observation", self.last_[i].observation);
        archive.numbers("state", self.last_[i].state);
        archive.number("is_noted", self.last_[i].is_noted);
        if constexpr (Archive::kReads) {
          const auto& [observation, state, is_noted] = self.last_[i];
          const auto is_unit = [](double x) { return x >= 0.0 && x <= 1.0; };
          const bool is_empty = observation.empty() && state.empty();
          const bool is_whole =
              observation.size() == self.n_variables_ && state.size() == self.n_inputs_;
          archive.expect(is_empty || (is_whole && std::ranges::all_of(state, is_unit)), "state",
                         "a state in [0, 1] for an observation, or empty");
        }
      });
    }
  }

 private:
  struct Last {
    std::vector<double> observation, state;
    bool is_noted = false;  ///< whether ranges have followed it
  };

  static constexpr std::uint64_t kMostEnvironments = 1 << 14;

  /// Whether this is the environment's last observation; missing readings are alike.
  bool is_last(std::size_t environment, std::span<const double> observation) const {
    const auto are_alike = [](double x, double y) {
      return x == y || (!std::isfinite(x) && !std::isfinite(y));
    };
    return environment < last_.size() &&
           std::ranges::equal(last_[environment].observation, observation, are_alike);
  }
  void keep(std::size_t environment, std::span<const double> observation,
            std::span<const double> state, bool is_noted) {
    if (environment >= kMostEnvironments) return;  // there is none, as the agent will say
    if (last_.size() <= environment) last_.resize(environment + 1);
    last_[environment] = {
        {observation.begin(), observation.end()}, {state.begin(), state.end()}, is_noted};
  }

  [[maybe_unused]] std::size_t n_variables_, n_inputs_;
  std::vector<Last> last_;
};

}  // namespace sdnn::agents::detail
