/// The last readings of an agent's sensors, which can replace missing ones.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/agents/episodes.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

/// The last readings of all variables in the present episode of each environment, which replace
/// missing ones.
///
/// Greedy episodes may run between the steps of a learned episode. They have separate readings,
/// which start as a copy of the learned episode's and are dropped when that continues.
class LastReadings {
 public:
  /// An observation and the next one.
  struct Step {
    std::span<const double> observation, next_observation;
  };

  /// Without `is_held` observations are not changed. Each of the `symbols` is a group of variables,
  /// given by the first one and their number: all are missing if one is.
  LastReadings(bool is_held, std::size_t n_variables, std::vector<std::vector<int>> symbols)
      : is_held_(is_held), n_variables_(n_variables), symbols_(std::move(symbols)) {}

  /// Whether missing readings are replaced by the last ones.
  bool is_held() const noexcept { return is_held_; }

  /// Returns the observation with the last readings in the place of missing ones, which become NaN
  /// if there is no last reading. The result is in `room`. The observation itself is returned if
  /// nothing is held, or its size is wrong, which callers check later. Shape: (n_variables,).
  std::span<const double> filled(std::span<const double> observation, std::size_t environment,
                                 bool is_greedy, std::vector<double>& room) const {
    return filled(observation, readings(environment, is_greedy), room);
  }
  /// Replaces missing readings in both observations of a transition. Valid until the next call.
  Step filled(std::span<const double> observation, std::span<const double> next_observation,
              std::size_t environment) {
    const auto before = filled(observation, environment, false, held_);
    return {before, filled(next_observation, before, next_held_)};
  }

  /// Stores what `filled` wrote into `room`; note_step, the transition's next observation.
  void note(const std::vector<double>& room, std::size_t environment, bool is_greedy) {
    if (!is_held_) return;
    if (last_.size() <= environment) last_.resize(environment + 1);
    (is_greedy ? last_[environment].greedy : last_[environment].learned) = room;
    if (!is_greedy) last_[environment].greedy.clear();
  }
  void note_step(std::size_t environment) { note(next_held_, environment, false); }

  /// Forgets the readings of an environment, or those of greedy episodes only.
  void forget(std::size_t environment) {
    if (environment < last_.size()) last_[environment] = {};
  }
  void forget_greedy(std::size_t environment) {
    note(std::vector<double>(n_variables_, kNone), environment, true);
  }
  /// Forgets environments from this one on: others may come later.
  void forget_from(std::size_t environment) {
    if (last_.size() > environment) last_.resize(environment);
  }

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    serialize(self, archive, "learned", &Environment::learned);
    serialize(self, archive, "greedy", &Environment::greedy);
  }

 private:
  /// The last readings in an environment's learned episode and in greedy ones; empty: none.
  struct Environment {
    std::vector<double> learned, greedy;
  };

  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  std::span<const double> readings(std::size_t environment, bool is_greedy) const noexcept {
    if (environment >= last_.size()) return {};
    const Environment& last = last_[environment];
    return is_greedy && !last.greedy.empty() ? last.greedy : last.learned;
  }

  /// Returns the observation with the readings `last` in the place of missing ones. If a variable
  /// of a symbol is missing, all of its variables are replaced.
  std::span<const double> filled(std::span<const double> observation, std::span<const double> last,
                                 std::vector<double>& room) const {
    if (!is_held_ || observation.size() != n_variables_) return observation;
    const auto last_of = [this, last](std::size_t i) {
      return last.size() == n_variables_ ? last[i] : kNone;
    };
    room.assign(observation.begin(), observation.end());
    for (std::size_t i = 0; i < room.size(); ++i) {
      if (!std::isfinite(room[i])) room[i] = last_of(i);
    }
    for (const auto& symbol : symbols_) {
      const auto first = static_cast<std::size_t>(symbol[0]);
      const auto n = static_cast<std::size_t>(symbol[1]);
      if (core::are_finite(observation.subspan(first, n))) continue;
      for (std::size_t i = first; i < first + n; ++i) room[i] = last_of(i);
    }
    return room;
  }

  /// Lists the readings of all environments that have some, and the numbers of these environments.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive, const std::string& name,
                        std::vector<double> Environment::* member) {
    std::vector<std::int32_t> environments;
    std::vector<double> values;
    for (std::size_t i = 0; i < self.last_.size(); ++i) {
      const std::vector<double>& last = self.last_[i].*member;
      if (last.empty()) continue;
      environments.push_back(static_cast<std::int32_t>(i));
      values.insert(values.end(), last.begin(), last.end());
    }
    archive.numbers(name + ".environments", environments);
    archive.numbers(name, values);
    if constexpr (Archive::kReads) {
      const std::size_t n = self.n_variables_;
      archive.expect(values.size() == environments.size() * n, name, "one for each variable");
      for (Environment& environment : self.last_) (environment.*member).clear();
      for (std::size_t k = 0; k < environments.size(); ++k) {
        const auto i = static_cast<std::size_t>(environments[k]);
        archive.expect(environments[k] >= 0 && i < kMostEnvironments, name,
                       "of numbers of environments");
        if (self.last_.size() <= i) self.last_.resize(i + 1);
        const auto first = values.begin() + static_cast<std::ptrdiff_t>(k * n);
        (self.last_[i].*member).assign(first, first + static_cast<std::ptrdiff_t>(n));
      }
    }
  }

  bool is_held_;
  std::size_t n_variables_;
  std::vector<std::vector<int>> symbols_;
  std::vector<Environment> last_;
  std::vector<double> held_, next_held_;
};

}  // namespace sdnn::agents
