/// An episode of Q(lambda) in one environment.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"

namespace sdnn::agents::detail {

/// The state of the present episode.
struct QLambdaEpisode {
  approximators::LinearSDNN::Trace trace;
  approximators::LinearSDNN::Workspace present;  ///< workspace of `state`
  approximators::LinearSDNN::Workspace next;     ///< of the next state, or of a greedy step's state
  bool waits = false;  ///< the episode continues; with Sarsa, its last transition is pending
  // The last transition, which Sarsa learns once the next action is known.
  std::vector<double> state;
  std::vector<std::size_t> action;
  double reward = 0.0;
  std::vector<double> next_state;
  std::vector<std::uint8_t> next_mask;
  std::int64_t old_value = 0;  ///< Q_old, in units
  double dt = 1.0;             ///< the duration of the transition that is to be learned
  double trace_dt = 1.0;       ///< the duration of the transition before, see LinearTD
  Exploration::Episode exploration;
};

/// Lists the members of an episode that are saved and restored; see core/state.hpp. The code of a
/// restored state is computed by the readout.
template <class Readout, class Episode, class Archive>
void serialize_episode(Readout& readout, const Exploration& exploration, Episode& episode,
                       Archive& archive) {
  const auto n_actions = [&readout](std::size_t d) { return readout.n_actions(d); };
  archive.number("waits", episode.waits);
  archive.part("trace", episode.trace);
  archive.number("old_value", episode.old_value);
  serialize_duration("dt", episode.dt, archive);
  serialize_duration("trace_dt", episode.trace_dt, archive);
  std::vector<std::int64_t> action(episode.action.begin(), episode.action.end());
  archive.numbers("state", episode.state);
  archive.numbers("action", action);
  archive.number("reward", episode.reward);
  archive.numbers("next_state", episode.next_state);
  serialize_mask("next_mask", episode.next_mask, archive, readout.n_dimensions(), n_actions);
  exploration.serialize_episode(episode.exploration, archive, n_actions);
  if constexpr (Archive::kReads) {
    const auto is_state = [&readout](const std::vector<double>& state) {
      return state.size() == readout.n_inputs() &&
             std::ranges::all_of(state, [](double x) { return x >= 0.0 && x <= 1.0; });
    };
    archive.expect(is_state(episode.state), "state", "a state in [0, 1]");
    archive.expect(is_state(episode.next_state), "next_state", "a state in [0, 1]");
    archive.expect(action.size() == readout.n_dimensions(), "action", "one per dimension");
    for (std::size_t d = 0; d < action.size(); ++d) {
      archive.expect(action[d] >= 0 && static_cast<std::uint64_t>(action[d]) < n_actions(d),
                     "action", "an action");
      episode.action[d] = static_cast<std::size_t>(action[d]);
    }
    archive.expect(std::abs(episode.reward) <= kLargestReward, "reward", "a finite number");
    archive.expect(!readout.is_too_large(episode.old_value), "old_value", "below 2^33 in size");
    archive.taking("reward", [&] { readout.fit_unit(episode.reward); });
    readout.read(episode.state, episode.present);
  }
}

/// Returns the largest sum of a state's values over allowed actions, in units of the readout.
template <class Readout>
std::int64_t best_sum(const Readout& readout, typename Readout::Workspace& read, ActionMask mask) {
  std::int64_t total = 0;
  for (std::size_t d = 0; d < readout.n_dimensions(); ++d) {
    const auto sums = readout.sums(read, d);
    const ActionMask dimension_mask = take_part(mask, sums.size());
    if (dimension_mask.empty()) {
      total += std::ranges::max(sums);
      continue;
    }
    std::int64_t best = std::numeric_limits<std::int64_t>::min();
    for (std::size_t a = 0; a < sums.size(); ++a) {
      if (dimension_mask[a] != 0) best = std::max(best, sums[a]);
    }
    total += best;
  }
  return total;
}

/// Returns the value of a schedule from `first` to `last` after n_done steps, as an integer in
/// units of 1 / one, with halves rounded up. The share n_done / (n_done + n_steps) of the way to
/// `last` is done.
inline std::int32_t scheduled(double first, double last, std::int64_t n_done, std::int64_t n_steps,
                              std::int32_t one) noexcept {
  const std::int64_t from = std::lround(first * one);
  const std::int64_t all = std::lround(last * one) - from;
  const std::int64_t end = n_done + n_steps;
  // The quotient of a negative number is rounded down likewise.
  const std::int64_t twice = 2 * all * n_done + end;
  const std::int64_t quotient = twice / (2 * end) - (twice % (2 * end) < 0 ? 1 : 0);
  return static_cast<std::int32_t>(from + quotient);
}

}  // namespace sdnn::agents::detail
