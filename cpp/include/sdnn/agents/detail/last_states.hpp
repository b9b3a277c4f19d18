/// The states in which transitions ended, where ranges change from step to step.
#pragma once

#include <algorithm>
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

  /// Finds the state of an observation from which a transition starts. Throws as
  /// Observations::scale.
  void read(const Observations& observations, std::size_t environment,
            std::span<const double> observation, std::span<double> state) const {
    // A missing reading equals none.
    if (environment < last_.size() &&
        std::ranges::equal(last_[environment].observation, observation)) {
      std::ranges::copy(last_[environment].state, state.begin());
    } else {
      observations.scale(observation, state);
    }
  }
  /// Finds the state in which it ends; running ranges follow the observation first.
  void follow(Observations& observations, std::size_t environment,
              std::span<const double> observation, std::span<double> state) {
    observations.scale(observation, state, "next_observation");
    if (!observations.is_running()) return;
    observations.note(observation);
    observations.scale(observation, state);
    if (last_.size() <= environment) last_.resize(environment + 1);
    last_[environment].observation.assign(observation.begin(), observation.end());
    last_[environment].state.assign(state.begin(), state.end());
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
        if constexpr (Archive::kReads) {
          const auto& [observation, state] = self.last_[i];
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
  };

  static constexpr std::uint64_t kMostEnvironments = 1 << 14;

  [[maybe_unused]] std::size_t n_variables_, n_inputs_;
  std::vector<Last> last_;
};

}  // namespace sdnn::agents::detail
