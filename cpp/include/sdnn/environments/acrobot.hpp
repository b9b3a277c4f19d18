/// The acrobot: a two-link pendulum with torque on the second joint, and its swing-up task.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <stdexcept>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "sdnn/environments/acrobot_state.hpp"
#include "sdnn/environments/detail/acrobot_dynamics.hpp"

namespace sdnn::environments {

/// The result of a decision: `terminated` at the goal, `truncated` after the episode's last
/// decision without it.
struct StepResult {
  double reward;
  bool terminated;
  bool truncated;
};

/// Returns the reward, and whether the episode ends, when decision number `decisions` (from 1) has
/// led to `state`; `goal` is whether it has reached the goal.
///
/// The penalty is for idling or too much speed in `state`, and not on the way to it; at the goal
/// there is none.
inline StepResult result_of(const AcrobotConfig& config, const AcrobotState& state, bool goal,
                            int decisions) noexcept {
  const bool penalized = std::abs(state[0]) < config.idle_angle ||
                         std::abs(state[2]) > config.goal_velocity_1 ||
                         std::abs(state[3]) > config.goal_velocity_2;
  return {goal ? config.goal_reward : (penalized ? config.penalty : 0.0), goal,
          !goal && decisions >= config.max_decisions};
}

/// The acrobot's dynamics, reward and episode end.
///
/// theta1 = 0 hangs down, theta2 is relative to link 1; torque acts on joint 2 alone. A step
/// allocates nothing.
class Acrobot {
 public:
  /// Starts at rest, hanging down. Throws std::invalid_argument if a number is outside its range.
  explicit Acrobot(const AcrobotConfig& config = {}) : dynamics_(config) {}

  /// Starts an episode at rest, hanging down.
  void reset() noexcept { begin_at(AcrobotState::Zero()); }

  /// Starts an episode at `state`; the angles are wrapped. Throws std::invalid_argument unless
  /// every number is finite.
  void set_state(const AcrobotState& state) { begin_at(wrapped(state)); }

  /// Holds `torque` (N m) for one decision interval, or until the goal is reached.
  /// `goal_tolerance`, the paper's lambda, is the factor of the goal's speed limits. Throws
  /// std::invalid_argument unless |torque| <= max_torque and goal_tolerance >= 0, std::logic_error
  /// if the episode is over, std::overflow_error if the speeds outgrow the integration step.
  StepResult step(double torque, double goal_tolerance) {
    check_step(torque, goal_tolerance);
    return end_step(integrate(torque, goal_tolerance));
  }

  /// The current state, with angles in [-pi, pi).
  AcrobotState state() const noexcept { return state_; }

  /// Height of the tip above joint 1, in m.
  double tip_height() const noexcept { return dynamics_.tip_height(state_); }

  /// Kinetic and potential energy in J, the latter counted from the height of joint 1.
  double energy() const noexcept { return dynamics_.energy(state_); }

  /// Time derivative of `state` under `torque` (N m).
  AcrobotState derivative(const AcrobotState& state, double torque) const noexcept {
    return dynamics_.derivative(state, torque);
  }

  /// The matrix M (kg m^2) of the equations M (theta1_dot_dot, theta2_dot_dot) = torques.
  Eigen::Matrix2d mass_matrix(double theta2) const noexcept {
    return dynamics_.mass_matrix(theta2);
  }

  /// The number of decisions in this episode.
  int decisions() const noexcept { return decisions_; }

  const AcrobotConfig& config() const noexcept { return dynamics_.config(); }

 private:
  friend class AcrobotTeam;  // it integrates several acrobots at once, between check and end of a
                             // step

  void check_step(double torque, double goal_tolerance) const {
    core::require_in_range("torque", torque, -config().max_torque, config().max_torque);
    core::require(goal_tolerance >= 0.0, "goal_tolerance", "at least 0", goal_tolerance);
    if (over_) core::fail(std::logic_error("the episode is over: call reset before step"));
  }

  // Ends a step after its integration; `goal` is whether that reached the goal.
  StepResult end_step(bool goal) {
    state_[0] = wrap_angle(state_[0]);
    state_[1] = wrap_angle(state_[1]);
    if (!state_.allFinite()) {
      over_ = true;
      core::fail(std::overflow_error("the acrobot's speed is too high for this integration_step"));
    }
    ++decisions_;
    const StepResult result = result_of(config(), state_, goal, decisions_);
    over_ = result.terminated || result.truncated;
    return result;
  }

  // Advances the state by one decision interval, or less if it reaches the goal: the tip is high
  // enough and the joints turn no faster than the limits. Returns whether it reached the goal.
  bool integrate(double torque, double goal_tolerance) noexcept {
    const double limit_1 = config().goal_velocity_1 * goal_tolerance;
    const double limit_2 = config().goal_velocity_2 * goal_tolerance;
#if SDNN_LANES
    PairedForm::State current{core::Lanes<2>::load(state_.data()),
                              core::Lanes<2>::load(state_.data() + 2)};
    const bool goal = dynamics_.integrate<PairedForm>(current, torque, limit_1, limit_2, true);
    current[0].store(state_.data());
    current[1].store(state_.data() + 2);
#else
    using Form = SeparateForm<double>;
    Form::State current{state_[0], state_[1], state_[2], state_[3]};
    const bool goal = dynamics_.integrate<Form>(current, torque, limit_1, limit_2, true);
    state_ = {current[0], current[1], current[2], current[3]};
#endif
    return goal;
  }

  void begin_at(const AcrobotState& state) noexcept {
    state_ = state;
    decisions_ = 0;
    over_ = false;
  }

  AcrobotDynamics dynamics_;
  AcrobotState state_ = AcrobotState::Zero();
  int decisions_ = 0;
  bool over_ = false;
};

}  // namespace sdnn::environments
