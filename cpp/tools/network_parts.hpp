/// The parts of a decision that belong to the network, timed one by one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/approximators/error_correction.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"
#include "tools/stopwatch.hpp"

namespace sdnn::tools {

/// Times a network at random states, which are new to it: nothing it remembers helps.
///
/// It should have learned something before: a network that never learned has smaller weights than
/// one at work, and small weights are added quicker.
class NetworkParts {
 public:
  /// A copy of `network` is timed, and learns. The states follow from `seed`.
  NetworkParts(approximators::SDNNC network, std::uint64_t seed)
      : network_(std::move(network)),
        random_(seed, core::Stream::exploration),
        workspace_(network_.workspace()),
        state_(network_.n_inputs()),
        values_(network_.n_actions()),
        potentials_(network_.hidden_layer().n_units()) {}

  const approximators::SDNNC& network() const noexcept { return network_; }
  const approximators::SDNNC::Workspace& workspace() const noexcept { return workspace_; }

  /// Q(s, a) of all actions at a new state.
  Times time_values(int n_repetitions) {
    return time_each(
        n_repetitions, [this](int) { draw_state(); },
        [this](int) { network_.values(state_, workspace_, values_); });
  }

  /// Times all values of a state that the network has read just before.
  Times time_remembered_values(int n_repetitions) {
    return time_each(
        n_repetitions, [this](int) { recall_new_state(); },
        [this](int) { network_.values(state_, workspace_, values_); });
  }

  /// A learning step at a state the network was just asked about, as an agent takes it; Q moves up
  /// or down in turn by `n_corrected` units of its window, wherever that many can change.
  /// Throws std::invalid_argument unless n_corrected is in [1, n'].
  Times time_corrections(int n_repetitions, int n_corrected) {
    require_units("n_corrected", n_corrected);
    const auto& scale = network_.output_scale();
    const auto& config = network_.config();
    const double step =
        n_corrected * (config.q_high - config.q_low) / std::max(1, scale.u_high() - scale.u_low());
    std::size_t action = 0;
    double target = 0.0;
    return time_each(
        n_repetitions,
        [&](int i) {
          recall_new_state();
          action = random_.below(network_.n_actions());
          target = network_.value(state_, workspace_, action) + (i % 2 == 0 ? step : -step);
        },
        [&](int) { network_.update(state_, workspace_, action, target); });
  }

  /// `n_selections` selections of units per repetition, each for a deficit of `n_selected` up or
  /// down in a random action's window. Throws std::invalid_argument unless n_selected is in
  /// [1, n'] and n_selections in [1, kMaxRepetitions].
  Times time_selections(int n_repetitions, int n_selections, int n_selected) {
    require_units("n_selected", n_selected);
    core::require_in_range("n_selections", n_selections, 1, kMaxRepetitions);
    const std::size_t n_active = network_.action_code().n_active_units();
    std::vector<std::uint32_t> selected;
    selected.reserve(n_active);
    std::vector<std::size_t> windows(static_cast<std::size_t>(n_selections));
    return time_each(
        n_repetitions,
        [&](int) {
          draw_state();
          network_.potentials(state_, potentials_);
          for (std::size_t& first : windows) {
            first = network_.action_code().first_unit(random_.below(network_.n_actions()));
          }
        },
        [&](int) {
          int deficit = n_selected;
          for (const std::size_t first : windows) {
            approximators::select_units(std::span(potentials_).subspan(first, n_active), deficit,
                                        selected);
            keep(selected);
            deficit = -deficit;
          }
        });
  }

 private:
  void require_units(const char* name, int n_units) const {
    core::require_in_range(name, n_units, 1,
                           static_cast<int>(network_.action_code().n_active_units()));
  }

  void draw_state() {
    for (double& value : state_) value = random_.uniform();
  }

  void recall_new_state() {
    draw_state();
    network_.values(state_, workspace_, values_);
  }

  approximators::SDNNC network_;
  core::Random random_;
  approximators::SDNNC::Workspace workspace_;
  std::vector<double> state_;
  std::vector<double> values_;
  std::vector<std::int32_t> potentials_;
};

}  // namespace sdnn::tools
