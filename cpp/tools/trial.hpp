/// One trial: an agent meets the acrobot, by the paper's protocol, without Python in the loop.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/agents/agent.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/check_fields.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "sdnn/environments/acrobot_sensors.hpp"
#include "sdnn/environments/goal_schedule.hpp"

namespace sdnn::tools {

/// How long a trial is, and how often the agent is tested (section 4.2).
struct ProtocolConfig {
  int episodes = 15000;
  int evaluate_every_episodes = 10;
  bool limit_bootstraps = true;
  bool noisy_evaluations = true;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("episodes", &ProtocolConfig::episodes, "Learning episodes in a trial.",
                    core::within(1, 1 << 30)),
        core::field("evaluate_every_episodes", &ProtocolConfig::evaluate_every_episodes,
                    "Learning episodes between evaluations of one episode.",
                    core::within(1, 1 << 30)),
        core::field("limit_bootstraps", &ProtocolConfig::limit_bootstraps,
                    "Whether the last transition before a time limit bootstraps, as if the "
                    "episode continued; else it counts as terminated."),
        core::field("noisy_evaluations", &ProtocolConfig::noisy_evaluations,
                    "Whether the sensors are as noisy in evaluations as in learning."));
  }
  bool operator==(const ProtocolConfig&) const = default;
};

/// The outcome of one test episode.
struct TestRow {
  std::int32_t episode;   ///< learning episodes so far
  std::int32_t steps;     ///< decisions used; all of them if not solved
  double episode_return;  ///< undiscounted sum of rewards
  bool solved;            ///< the goal was reached
};

/// A learning agent on the acrobot swing-up; the same configs and seed give the same rows.
///
/// The agent's action, normalized, is its part of the largest torque. The sensors' noise has
/// streams of its own, so that the same seed gives every agent the same noise, observation by
/// observation. Source: method.md, section 5.2. A test episode is greedy, learns nothing, uses the
/// current lambda, and draws from random streams of its own.
template <agents::Agent Agent>
class AcrobotTrial {
 public:
  /// Throws std::invalid_argument if a config is impossible or agent and sensors do not fit.
  AcrobotTrial(Agent agent, const environments::AcrobotConfig& acrobot,
               const environments::GoalScheduleConfig& goal,
               const environments::SensorConfig& sensors, const ProtocolConfig& protocol,
               std::uint64_t seed)
      : agent_(std::move(agent)),
        max_torque_(acrobot.max_torque),
        steps_per_decision_(acrobot.decision_interval / acrobot.integration_step),
        acrobot_(acrobot),
        goal_(goal),
        sensors_(sensors, seed, core::Stream::sensor_noise),
        test_sensors_(of_tests(sensors, protocol), seed, core::Stream::evaluation_sensor_noise),
        protocol_(protocol),
        observed_(sensors_.n_inputs()),
        next_observed_(observed_.size()) {
    core::check_fields(protocol);
    core::require(agent_.n_inputs() == observed_.size(), "n_inputs",
                  "the number of inputs of the sensors, " + std::to_string(observed_.size()),
                  agent_.n_inputs());
    // No decision is to wait for memory it is the first to use: that of the agent, room for rows.
    if constexpr (requires { agent_.warm_caches(); }) agent_.warm_caches();
    core::require_bytes(
        "episodes / evaluate_every_episodes", "the rows of the test episodes",
        sizeof(TestRow) * static_cast<double>(protocol.episodes) / protocol.evaluate_every_episodes,
        core::kDefaultMaxTableBytes);
    rows_.resize(static_cast<std::size_t>(protocol.episodes / protocol.evaluate_every_episodes));
    rows_.clear();
  }

  int episode() const noexcept { return episode_; }
  bool finished() const noexcept { return episode_ == protocol_.episodes; }
  /// Decisions made so far, in learning and test episodes.
  std::int64_t n_decisions() const noexcept { return n_decisions_; }
  std::span<const TestRow> rows() const noexcept { return rows_; }
  const Agent& agent() const noexcept { return agent_; }
  /// To look inside while it learns: asking for values changes nothing that follows, acting and
  /// learning do.
  Agent& agent() noexcept { return agent_; }

  /// Runs up to `n_episodes` more learning episodes, with the test episodes that fall due.
  ///
  /// Long work: may be stopped between episodes and then resumed, and within a long one. Whatever
  /// is thrown within an episode ends the trial: it cannot be taken up there, and advance throws
  /// std::logic_error from then on.
  void advance(int n_episodes) {
    advance(n_episodes, [] {});
  }

  /// The same, calling `after_decision()` after every decision, of test episodes too.
  template <class AfterDecision>
  void advance(int n_episodes, AfterDecision&& after_decision) {
    core::require_in_range("n_episodes", n_episodes, 0, 1 << 30);
    if (in_episode_) {
      core::fail(std::logic_error("the trial was ended within an episode: make a new one"));
    }
    const int last = episode_ + std::min(n_episodes, protocol_.episodes - episode_);
    while (episode_ < last) {
      core::interruption_point();
      if constexpr (requires { agent_.set_progress(0.0); }) {
        agent_.set_progress(static_cast<double>(episode_) /
                            static_cast<double>(protocol_.episodes));
      }
      ++episode_;
      run_episode(sensors_, true, after_decision);
      if (episode_ % protocol_.evaluate_every_episodes == 0) {
        rows_.push_back(run_episode(test_sensors_, false, after_decision));
      }
    }
  }

 private:
  static environments::SensorConfig of_tests(environments::SensorConfig sensors,
                                             const ProtocolConfig& protocol) noexcept {
    if (!protocol.noisy_evaluations) sensors.noise = 0.0;
    return sensors;
  }

  template <class AfterDecision>
  TestRow run_episode(environments::AcrobotSensors& sensors, bool learning,
                      AfterDecision& after_decision) {
    const double lambda = goal_(episode_);
    TestRow row{.episode = episode_, .steps = 0, .episode_return = 0.0, .solved = false};
    double n_steps = 0.0;
    in_episode_ = true;
    acrobot_.reset();
    agent_.begin_episode();
    sensors.observe(acrobot_.state(), observed_);
    for (bool truncated = false; !row.solved && !truncated;) {
      const auto action = agent_.act(observed_, learning);
      const auto result = acrobot_.step(max_torque_ * agent_.normalized_action(action), lambda);
      sensors.observe(acrobot_.state(), next_observed_);
      if (learning) {
        agent_.learn(observed_, action, result.reward, next_observed_,
                     result.terminated || (result.truncated && !protocol_.limit_bootstraps));
      }
      std::swap(observed_, next_observed_);
      ++row.steps;
      row.episode_return += result.reward;
      row.solved = result.terminated;
      truncated = result.truncated;
      after_decision();
      n_steps += steps_per_decision_;
      if (n_steps > kStepsPerPoint) {  // a usual episode is over before
        core::interruption_point();
        n_steps = 0.0;
      }
    }
    in_episode_ = false;
    n_decisions_ += row.steps;
    return row;
  }

  static constexpr double kStepsPerPoint = 1 << 20;  ///< integration steps

  Agent agent_;
  double max_torque_;
  double steps_per_decision_;
  environments::Acrobot acrobot_;
  environments::GoalSchedule goal_;
  environments::AcrobotSensors sensors_;
  environments::AcrobotSensors test_sensors_;
  ProtocolConfig protocol_;
  std::vector<double> observed_;
  std::vector<double> next_observed_;
  std::vector<TestRow> rows_;
  std::int64_t n_decisions_ = 0;
  int episode_ = 0;
  bool in_episode_ = false;  // also after something was thrown there
};

}  // namespace sdnn::tools
