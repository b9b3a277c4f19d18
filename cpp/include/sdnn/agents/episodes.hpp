/// The present episodes of an agent, one for each environment that it learns in.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

/// The largest number of environments of an agent, a chosen limit.
inline constexpr std::size_t kMostEnvironments = std::size_t{1} << 14;

/// The state of the present episode in each environment of an agent, which has at least one.
template <class Episode>
class Episodes {
 public:
  explicit Episodes(Episode first) { episodes_.push_back(std::move(first)); }

  std::size_t size() const noexcept { return episodes_.size(); }
  auto begin() const noexcept { return episodes_.begin(); }
  auto end() const noexcept { return episodes_.end(); }
  auto begin() noexcept { return episodes_.begin(); }
  auto end() noexcept { return episodes_.end(); }

  /// The episode of an environment, from 0. Throws std::invalid_argument if it does not exist.
  Episode& of(std::size_t environment) {
    core::require_below("environment", environment, size());
    return episodes_[environment];
  }
  const Episode& of(std::size_t environment) const {
    core::require_below("environment", environment, size());
    return episodes_[environment];
  }

  /// Changes the number of environments: `make()` makes the episodes of new ones, and those of
  /// removed ones are deleted. Throws std::invalid_argument unless 1 <= n <= kMostEnvironments.
  template <class Make>
  void resize(std::size_t n, const Make& make) {
    core::require_in_range("n_environments", n, 1, kMostEnvironments);
    while (episodes_.size() > n) episodes_.pop_back();
    while (episodes_.size() < n) episodes_.push_back(make());
  }

  /// Saves or restores the members that `list(episode)` lists, for each episode; `make()` makes the
  /// episodes to restore. Names of environment 0 have no prefix, those of another one
  /// "environment.2.".
  template <class Self, class Archive, class Make, class List>
  static void serialize(Self& self, Archive& archive, const Make& make, const List& list) {
    if constexpr (Archive::kReads) self.resize(archive.n_numbered("environment") + 1, make);
    list(self.episodes_.front());
    for (std::size_t i = 1; i < self.size(); ++i) {
      archive.within(std::string("environment.").append(std::to_string(i)),
                     [&] { list(self.episodes_[i]); });
    }
  }

 private:
  std::vector<Episode> episodes_;
};

}  // namespace sdnn::agents
