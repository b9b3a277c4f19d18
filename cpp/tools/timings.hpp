/// Timings of the computations of a decision: those of the network, those of the acrobot, whole
/// decisions in a trial, and steps of any agent.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/agent.hpp"
#include "sdnn/approximators/error_correction.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "tools/stopwatch.hpp"
#include "tools/trial.hpp"

namespace sdnn::tools {

/// Timings of a network at random states, which its caches do not contain.
///
/// The network should have learned before: untrained weights are smaller, and small weights are
/// added faster.
class NetworkParts {
 public:
  /// Takes the network to time, which will learn; states are drawn from `seed`.
  NetworkParts(approximators::SDNNC network, std::uint64_t seed)
      : network_(std::move(network)),
        random_(seed, core::Stream::exploration),
        workspace_(network_.workspace()),
        state_(network_.n_inputs()),
        values_(network_.n_actions()),
        potentials_(network_.hidden_layer().n_units()) {}

  const approximators::SDNNC& network() const noexcept { return network_; }
  const approximators::SDNNC::Workspace& workspace() const noexcept { return workspace_; }

  /// Times Q(s, a) of all actions at a new state.
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

  /// Times a correction at a state that was just evaluated, as in an agent. The number of firing
  /// units in the window of a random action is moved up and down in turn by `n_corrected`, if so
  /// many units can change. Throws std::invalid_argument unless n_corrected is in [1, n'].
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

  /// Times `n_selections` selections of units per repetition, each for a deficit of + or -
  /// `n_selected` in a random action's window. Throws std::invalid_argument unless n_selected is in
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

  /// Draws a state and evaluates it, so that the workspace has it.
  void recall_new_state() {
    draw_state();
    network_.values(state_, workspace_, values_);
  }

  approximators::SDNNC network_;
  core::Random random_;
  approximators::SDNNC::Workspace workspace_;
  std::vector<double> state_, values_;
  std::vector<std::int32_t> potentials_;
};

/// Times all decisions in the next `n_episodes` learning episodes of a trial: choosing an action,
/// the acrobot's step, its sensors, and learning. Test episodes among them count, too.
///
/// Equal trials make the same decisions, so several runs can be compared decision by decision.
/// Throws std::logic_error if the trial has ended by an error.
template <agents::Agent Agent>
Times time_decisions(AcrobotTrial<Agent>& trial, int n_episodes) {
  Times times;
  std::int64_t before = now();
  trial.advance(n_episodes, [&] {
    const std::int64_t after = now();
    times.push_back(after - before);
    before = now();  // again, so that the time of push_back does not count
  });
  return times;
}

/// An acrobot under random torques, which never reaches the goal: every decision takes all of its
/// integration steps.
class AcrobotDecisions {
 public:
  /// Takes the acrobot's configuration, except for its goal height and max_decisions, which are
  /// replaced.
  AcrobotDecisions(environments::AcrobotConfig config, std::uint64_t seed)
      : acrobot_(endless(config)), random_(seed, core::Stream::exploration) {}

  /// Integration steps in one decision.
  int n_integration_steps() const noexcept {
    const auto& config = acrobot_.config();
    return static_cast<int>(std::lround(config.decision_interval / config.integration_step));
  }

  const environments::Acrobot& acrobot() const noexcept { return acrobot_; }

  /// Times `n_repetitions` decisions; the acrobot starts at rest again after every 50.
  Times run(int n_repetitions) {
    double torque = 0.0;
    return time_each(
        n_repetitions,
        [&](int) {
          if (acrobot_.decisions() == kDecisionsPerEpisode) acrobot_.reset();
          torque = acrobot_.config().max_torque * (2.0 * random_.uniform() - 1.0);
        },
        [&](int) { keep(acrobot_.step(torque, 1.0)); });
  }

 private:
  static constexpr int kDecisionsPerEpisode = 50;

  static environments::AcrobotConfig endless(environments::AcrobotConfig config) {
    config.goal_height = std::numeric_limits<double>::max();
    config.max_decisions = kDecisionsPerEpisode + 1;
    return config;
  }

  environments::Acrobot acrobot_;
  core::Random random_;
};

/// Times `n_repetitions` whole steps at random states: learning the transition to a new state, then
/// acting in it with exploration.
///
/// States are uniform in [0, 1)^d and rewards in [-1, 1), both drawn from `seed`, in a single
/// episode that does not terminate. Drawing them, the first act and other programs are not timed.
/// Give each call another seed, so that no state is in the agent's caches. Discard the times of a
/// first call, because an untrained agent can be faster. Throws
/// std::invalid_argument unless n_repetitions is in [0, kMaxRepetitions], and the agent's errors.
template <agents::Agent Agent>
Times time_agent_steps(Agent& agent, int n_repetitions, std::uint64_t seed) {
  core::Random random(seed, core::Stream::exploration);
  std::vector<double> before(agent.n_inputs()), state(agent.n_inputs());
  const auto draw_state = [&] {
    for (double& value : state) value = random.uniform();
  };
  decltype(agent.act(std::span<const double>(state), true)) action{};
  double reward = 0.0;
  return time_each(
      n_repetitions,
      [&](int i) {
        if (i == 0) {
          draw_state();
          agent.begin_episode();
          action = agent.act(state, true);
        }
        std::swap(before, state);
        draw_state();
        reward = 2.0 * random.uniform() - 1.0;
      },
      [&](int) {
        agent.learn(before, action, reward, state, false);
        action = agent.act(state, true);
      },
      true);
}

}  // namespace sdnn::tools
