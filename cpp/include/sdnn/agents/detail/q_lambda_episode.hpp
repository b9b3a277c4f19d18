/// An episode of Q(lambda) in an environment, and functions of QLambda that need only its readout.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/duration.hpp"
#include "sdnn/agents/exploration.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents::detail {

/// The state of the present episode.
struct QLambdaEpisode {
  approximators::LinearSDNN::Trace trace;
  approximators::LinearSDNN::Workspace present;  ///< the code of `state`
  approximators::LinearSDNN::Workspace next;     ///< the code of the state that was read last
  /// Whether the last transition, in the members below, may be continued by another. Sarsa learns
  /// it then, as the next action is known; Q-learning ends the trace if that is not the best.
  bool waits = false;
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

/// Lists the saved members of an episode; see core/state.hpp. The readout computes restored codes.
template <class Readout, class Episode, class Archive>
void serialize_episode(Readout& readout, const Exploration& exploration, Episode& episode,
                       Archive& archive) {
  const auto n_actions = [&readout](std::size_t d) { return readout.n_actions(d); };
  archive.number("waits", episode.waits);
  archive.part("trace", episode.trace);
  archive.number("old_value", episode.old_value);
  serialize_duration("dt", episode.dt, archive);
  serialize_duration("trace_dt", episode.trace_dt, archive);
  archive.numbers("state", episode.state);
  serialize_action("action", episode.action, archive, n_actions);
  archive.number("reward", episode.reward);
  archive.numbers("next_state", episode.next_state);
  serialize_mask("next_mask", episode.next_mask, archive, readout.n_dimensions(), n_actions);
  exploration.serialize_episode(episode.exploration, archive, n_actions);
  if constexpr (Archive::kReads) {
    const auto is_state = [&readout](const std::vector<double>& state) {
      return state.size() == readout.n_inputs() && core::are_unit_values(state);
    };
    archive.expect(is_state(episode.state), "state", "a state in [0, 1]");
    archive.expect(is_state(episode.next_state), "next_state", "a state in [0, 1]");
    archive.expect(std::abs(episode.reward) <= kLargestReward, "reward", "a finite number");
    archive.expect(!readout.is_too_large(episode.old_value), "old_value", "below 2^33 in size");
    archive.naming("reward", [&] { readout.fit_unit(episode.reward); });
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

/// Writes an error for each row of the readout's weights, by which imitation separates actions: in
/// each dimension, if the best other action is less than `margin` below the teacher's `action`,
/// both move apart. An action's value is the sum of `action_window` rows. All numbers are in the
/// readout's units; `read` is its workspace with the state. Shape: errors (n_rows,).
inline void separate(const approximators::LinearSDNN& readout,
                     approximators::LinearSDNN::Workspace& read,
                     std::span<const std::size_t> action, std::int64_t margin,
                     std::vector<std::int64_t>& errors) {
  std::ranges::fill(errors, 0);
  const auto n_dimensions = static_cast<std::int64_t>(readout.n_dimensions());
  const auto window = static_cast<std::size_t>(readout.config().action_window);
  std::size_t first_row = 0;
  for (std::size_t d = 0; d < readout.n_dimensions(); ++d) {
    const auto sums = readout.sums(read, d);
    const std::size_t teacher = action[d];
    std::size_t other = teacher == 0 ? 1 : 0;
    for (std::size_t a = other; a < sums.size(); ++a) {
      if (a != teacher && sums[a] > sums[other]) other = a;
    }
    if (sums.size() > 1 && sums[other] + margin > sums[teacher]) {
      // Each of the two actions moves half of the way. The factor: LinearSDNN::move_rows divides an
      // error among the weights of all dimensions, of which only those of one move here.
      const std::int64_t error = (sums[other] + margin - sums[teacher]) * n_dimensions / 2;
      for (std::size_t row = first_row; row < first_row + window; ++row) {
        errors[row + teacher] += error;
        errors[row + other] -= error;
      }
    }
    first_row += sums.size() + window - 1;
  }
}

/// Returns the value of a schedule from `first` to `last` after n_done steps: first + (last -
/// first) n_done / (n_done + n_steps), as an integer in units of 1 / n_units, halves up.
inline std::int32_t scheduled(double first, double last, std::int64_t n_done, std::int64_t n_steps,
                              std::int32_t n_units) noexcept {
  const std::int64_t from = std::lround(first * n_units);
  const std::int64_t change = std::lround(last * n_units) - from;
  // p / q is rounded as the floor of (2 p + q) / (2 q). Division of integers rounds towards 0,
  // which is 1 too high for a negative quotient that is not whole.
  const std::int64_t dividend = 2 * change * n_done + n_done + n_steps;
  const std::int64_t divisor = 2 * (n_done + n_steps);
  const std::int64_t floor = dividend / divisor - (dividend % divisor < 0 ? 1 : 0);
  return static_cast<std::int32_t>(from + floor);
}

}  // namespace sdnn::agents::detail
