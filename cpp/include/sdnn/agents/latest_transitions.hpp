/// The latest transitions of an agent, to test again which inputs are relevant.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "sdnn/agents/warm_up.hpp"

namespace sdnn::agents {

/// Remembers the last n transitions before transition number 2 n, 4 n, 8 n and so on, where n is
/// the length of the warm-up, n_steps. It is empty except during these n transitions.
class LatestTransitions {
 public:
  /// `empty` is a store without transitions. Those of the warm-up, n_steps, count already.
  LatestTransitions(WarmUp empty, std::size_t n_steps)
      : empty_(std::move(empty)), latest_(empty_), n_steps_(n_steps), n_seen_(n_steps) {}

  void set_n_environments(std::size_t n) {
    empty_.set_n_environments(n);
    latest_.set_n_environments(n);
  }
  void begin_episode(std::size_t environment) { latest_.begin_episode(environment); }

  /// Counts a transition, and stores it if it is one of the n_steps before the next of the times.
  /// Returns whether all n_steps are stored; the caller then tests them and calls `forget`.
  bool learn(const WarmUp::Step& step) {
    const bool is_noted = n_seen_ >= next_time() - n_steps_;
    ++n_seen_;
    if (is_noted) latest_.learn(step);
    return latest_.size() >= n_steps_;
  }
  const WarmUp& transitions() const noexcept { return latest_; }
  void forget() { latest_ = empty_; }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("n_seen", self.n_seen_);
    archive.part("transitions", self.latest_);
    if constexpr (Archive::kReads) {
      archive.expect(self.n_seen_ >= self.n_steps_ && self.n_seen_ <= kMostSeen, "n_seen",
                     "in [warm_up_steps, 2^62]");
      const std::uint64_t first = self.next_time() - self.n_steps_;
      const std::uint64_t n_noted = self.n_seen_ < first ? 0 : self.n_seen_ - first;
      archive.expect(self.latest_.size() == n_noted, "n_seen", "that of the transitions");
      self.set_n_environments(self.latest_.n_environments());
    }
  }

 private:
  static constexpr std::uint64_t kMostSeen = std::uint64_t{1} << 62;

  /// The next of the times 2 n, 4 n, 8 n, ..., as a number of transitions.
  std::uint64_t next_time() const noexcept {
    std::uint64_t time = 2 * n_steps_;
    while (time <= n_seen_) time *= 2;
    return time;
  }

  WarmUp empty_, latest_;
  std::uint64_t n_steps_, n_seen_;
};

}  // namespace sdnn::agents
