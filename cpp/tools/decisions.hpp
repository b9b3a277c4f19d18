/// Whole decisions, and the acrobot's share of them.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "sdnn/agents/agent.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "tools/stopwatch.hpp"
#include "tools/trial.hpp"

namespace sdnn::tools {

/// The times of all decisions in the next `n_episodes` learning episodes of a trial: choosing an
/// action, the acrobot, its sensors, and learning from it. Test episodes among them count too.
///
/// Equal trials make the same decisions whenever it is run, so several runs can be compared
/// decision by decision. Throws as the trial's advance does.
template <agents::Agent Agent>
Times time_decisions(tools::AcrobotTrial<Agent>& trial, int n_episodes) {
  Times times;
  std::int64_t before = now();
  trial.advance(n_episodes, [&] {
    const std::int64_t after = now();
    times.push_back(after - before);
    before = now();  // without the vector's growth
  });
  return times;
}

/// An acrobot under random torques, which never reaches the goal: every decision takes all of its
/// integration steps.
class AcrobotDecisions {
 public:
  /// The goal and the number of decisions of `config` are not used. Throws as Acrobot does.
  AcrobotDecisions(environments::AcrobotConfig config, std::uint64_t seed)
      : acrobot_(endless(config)), random_(seed, core::Stream::exploration) {}

  /// Integration steps in one decision.
  int n_integration_steps() const noexcept {
    const auto& config = acrobot_.config();
    return static_cast<int>(std::lround(config.decision_interval / config.integration_step));
  }

  const environments::Acrobot& acrobot() const noexcept { return acrobot_; }

  /// Times of `n_repetitions` decisions; one in 50 starts at rest.
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

}  // namespace sdnn::tools
