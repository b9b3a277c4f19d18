/// A trial by the paper's protocol: an agent in the acrobot, without Python in the loop.
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
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "sdnn/environments/acrobot_sensors.hpp"
#include "sdnn/environments/acrobot_team.hpp"
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

/// The outcome of a test episode.
struct TestRow {
  std::int32_t episode;   ///< learning episodes so far
  std::int32_t steps;     ///< decisions used; all of them if not solved
  double episode_return;  ///< undiscounted sum of rewards
  bool solved;            ///< the goal was reached
};

/// A learning agent on the acrobot swing-up; equal configurations and seeds give equal rows.
///
/// The torque is the agent's normalized action, in [-1, 1], times the largest torque. Sensor noise
/// has random streams that nothing else draws from, so that with the same seed every agent gets the
/// same noise in each observation. In a test episode the agent is greedy and learns nothing; the
/// goal tolerance lambda is that of the last learning episode, and noise has another stream.
/// Source: method.md, section 5.2.
template <agents::Agent Agent>
class AcrobotTrial {
 public:
  /// Takes the agent and makes its task. Throws std::invalid_argument if a configuration is
  /// impossible, or if the agent does not have as many inputs as there are sensors.
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
    // The memory of the agent and of the rows is written to, so that the operating system provides
    // its pages now and not during a decision.
    if constexpr (requires { agent_.warm_caches(); }) agent_.warm_caches();
    core::require_bytes(
        "episodes / evaluate_every_episodes", "the rows of the test episodes",
        sizeof(TestRow) * static_cast<double>(protocol.episodes) / protocol.evaluate_every_episodes,
        core::kDefaultMaxTableBytes);
    rows_.resize(static_cast<std::size_t>(protocol.episodes / protocol.evaluate_every_episodes));
    rows_.clear();
  }

  /// The number of learning episodes that have begun.
  int episode() const noexcept { return episode_; }
  bool finished() const noexcept {
    return episode_ == protocol_.episodes && !in_episode_ && !is_test_;
  }
  /// Decisions made so far, in learning and test episodes.
  std::int64_t n_decisions() const noexcept { return n_decisions_; }
  std::span<const TestRow> rows() const noexcept { return rows_; }
  const Agent& agent() const noexcept { return agent_; }
  /// The agent, for inspection during the trial. Reading its values does not change the trial;
  /// acting and learning would.
  Agent& agent() noexcept { return agent_; }
  /// The acrobot as the last decision left it.
  const environments::Acrobot& acrobot() const noexcept { return acrobot_; }
  /// The torque of the last decision, N m.
  double torque() const noexcept { return torque_; }
  /// The factor of the goal's speed limits in the last episode that began.
  double goal_tolerance() const noexcept { return lambda_; }

  /// Runs up to `n_episodes` more learning episodes, with the test episodes that are due; an
  /// unfinished episode is finished first.
  ///
  /// It may be interrupted between decisions and then resumed. An exception within a decision ends
  /// the trial: later calls throw std::logic_error.
  void advance(int n_episodes) {
    advance(n_episodes, [] {});
  }

  /// Advances and calls `after_decision()` after every decision, of test episodes too.
  template <class AfterDecision>
  void advance(int n_episodes, AfterDecision&& after_decision) {
    core::require_in_range("n_episodes", n_episodes, 0, 1 << 30);
    require_whole();
    const int last = episode_ + std::min(n_episodes, protocol_.episodes - episode_);
    while (begin_decision(last)) {
      end_decision(acrobot_.step(torque_, lambda_));
      after_decision();
    }
  }

  /// Advances several trials until each has made `n_decisions` more or is finished. This is faster
  /// than one after another, because their acrobots are computed in the lanes of a vector register.
  /// The rows are the same.
  ///
  /// Trials may stop within an episode. Throws std::invalid_argument unless there are 1 to
  /// AcrobotTeam::kMaxMembers different trials of equal acrobots. Any other exception may end all
  /// of them.
  static void advance_together(std::span<AcrobotTrial* const> trials, int n_decisions) {
    core::require_in_range("n_decisions", n_decisions, 0, 1 << 30);
    core::require_in_range("number of trials", trials.size(), 1,
                           environments::AcrobotTeam::kMaxMembers);
    for (std::size_t i = 0; i < trials.size(); ++i) {
      trials[i]->require_whole();
      const auto before = trials.first(i);
      core::require(std::ranges::find(before, trials[i]) == before.end(), "trials",
                    "different ones", "one twice");
      core::require(trials[i]->acrobot_.config() == trials[0]->acrobot_.config(), "trials",
                    "of the same acrobot", "different ones");
    }
    environments::AcrobotTeam team;
    for (; n_decisions > 0; --n_decisions) {
      for (std::size_t i = 0; i < trials.size(); ++i) {
        AcrobotTrial& trial = *trials[i];
        if (trial.begin_decision(trial.protocol_.episodes)) {
          team.join(i, trial.acrobot_, trial.torque_, trial.lambda_);
        }
      }
      const bool any = team.step([&](std::size_t i, const environments::StepResult& result) {
        trials[i]->end_decision(result);
      });
      if (!any) return;
    }
  }

 private:
  using Action = decltype(std::declval<Agent&>().act(std::span<const double>(), true));

  /// Returns the configuration of the sensors in test episodes.
  static environments::SensorConfig of_tests(environments::SensorConfig sensors,
                                             const ProtocolConfig& protocol) noexcept {
    if (!protocol.noisy_evaluations) sensors.noise = 0.0;
    return sensors;
  }

  /// Throws std::logic_error if an exception has ended a decision in the middle.
  void require_whole() const {
    if (in_decision_) {
      core::fail(std::logic_error("the trial was ended within a decision: make a new one"));
    }
  }

  environments::AcrobotSensors& sensors() noexcept { return is_test_ ? test_sensors_ : sensors_; }

  /// Chooses the next torque, in a new episode if none is running. Returns false if `last` learning
  /// episodes are done, with their tests.
  bool begin_decision(int last) {
    if (!in_episode_) {
      if (!is_test_ && episode_ >= last) return false;
      core::interruption_point();
    }
    in_decision_ = true;
    if (!in_episode_) begin_episode();
    action_ = agent_.act(observed_, !is_test_);
    torque_ = max_torque_ * agent_.normalized_action(action_);
    return true;
  }

  /// Begins a learning episode or, if a test is due, a test episode, with the goal tolerance of the
  /// latest learning episode.
  void begin_episode() {
    if (!is_test_) {
      if constexpr (requires { agent_.set_progress(0.0); }) {
        agent_.set_progress(static_cast<double>(episode_) /
                            static_cast<double>(protocol_.episodes));
      }
      ++episode_;
    }
    lambda_ = goal_(episode_);
    row_ = {.episode = episode_, .steps = 0, .episode_return = 0.0, .solved = false};
    acrobot_.reset();
    agent_.begin_episode();
    sensors().observe(acrobot_.state(), observed_);
    in_episode_ = true;
  }

  /// Observes and learns the result of the decision that was begun, and ends the episode if it is
  /// over.
  void end_decision(const environments::StepResult& result) {
    sensors().observe(acrobot_.state(), next_observed_);
    if (!is_test_) {
      agent_.learn(observed_, action_, result.reward, next_observed_,
                   result.terminated || (result.truncated && !protocol_.limit_bootstraps));
    }
    std::swap(observed_, next_observed_);
    ++n_decisions_;
    ++row_.steps;
    row_.episode_return += result.reward;
    row_.solved = result.terminated;
    if (result.terminated || result.truncated) {
      if (is_test_) rows_.push_back(row_);
      is_test_ = !is_test_ && episode_ % protocol_.evaluate_every_episodes == 0;
      in_episode_ = false;
    }
    in_decision_ = false;
    n_steps_ += steps_per_decision_;
    if (n_steps_ > kStepsPerPoint) {  // usual episodes, which begin at such a point, are shorter
      n_steps_ = 0.0;
      core::interruption_point();
    }
  }

  static constexpr double kStepsPerPoint = 1 << 20;  ///< integration steps

  Agent agent_;
  double max_torque_, steps_per_decision_;
  environments::Acrobot acrobot_;
  environments::GoalSchedule goal_;
  environments::AcrobotSensors sensors_;
  environments::AcrobotSensors test_sensors_;
  ProtocolConfig protocol_;
  std::vector<double> observed_, next_observed_;
  std::vector<TestRow> rows_;
  std::int64_t n_decisions_ = 0;
  int episode_ = 0;
  bool is_test_ = false;  // whether the current episode, or else the next one, is a test episode
  bool in_episode_ = false;
  bool in_decision_ = false;  // still true after an exception within a decision
  TestRow row_ = {};          // of the current learning or test episode
  double lambda_ = 0.0;
  Action action_ = {};
  double torque_ = 0.0;
  double n_steps_ = 0.0;  // of integration since the last point of interruption
};

}  // namespace sdnn::tools
