/// The acrobot: a two-link pendulum with torque on the second joint, and its swing-up task.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <stdexcept>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/environments/detail/acrobot_dynamics.hpp"

namespace sdnn::environments {

/// What one decision brought. `terminated`: the goal; `truncated`: the last decision was made.
struct StepResult {
  double reward;
  bool terminated;
  bool truncated;
};

/// The angle plus the whole number of turns that brings it into [-pi, pi).
///
/// std::remainder is exact by IEEE 754, hence the same everywhere; an angle that lies in the
/// interval stays as it is.
inline double wrap_angle(double angle) noexcept {
  if (angle >= -core::kPi && angle < core::kPi) return angle;
  const double wrapped = std::remainder(angle, core::kTwoPi);
  return wrapped >= core::kPi ? -core::kPi : wrapped;
}

/// Reward and episode end after the `decisions`-th decision of an episode led to `state`.
///
/// The goal overrides the penalty, which looks at the decision instant only.
inline StepResult result_of(const AcrobotConfig& config, const std::array<double, 4>& state,
                            bool goal, int decisions) noexcept {
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
  /// theta1, theta2 (rad), theta1_dot, theta2_dot (rad/s).
  using State = std::array<double, 4>;

  /// At rest, hanging down. Throws std::invalid_argument if a number is outside its range.
  explicit Acrobot(const AcrobotConfig& config = {}) : dynamics_(config) {}

  /// Starts an episode at rest, hanging down.
  void reset() noexcept { begin_at({0.0, 0.0, 0.0, 0.0}); }

  /// Starts an episode at `state`; the angles are wrapped. Throws std::invalid_argument unless
  /// every number is finite.
  void set_state(const Eigen::Vector4d& state) {
    for (const double value : state) core::require_finite("state", value);
    begin_at({wrap_angle(state[0]), wrap_angle(state[1]), state[2], state[3]});
  }

  /// Holds `torque` (N m) for one decision interval; `lambda` scales the goal's speed limits.
  /// The goal overrides the penalty, which looks at the decision instant only. Throws
  /// std::invalid_argument unless |torque| <= max_torque and lambda >= 0, std::logic_error if the
  /// episode is over, std::overflow_error if the speeds outgrow the integration step.
  StepResult step(double torque, double lambda) {
    core::require_in_range("torque", torque, -config().max_torque, config().max_torque);
    core::require(lambda >= 0.0, "lambda", "at least 0", lambda);
    if (over_) throw std::logic_error("the episode is over: call reset before step");
    const bool goal = integrate(torque, lambda);
    state_[0] = wrap_angle(state_[0]);
    state_[1] = wrap_angle(state_[1]);
    if (!std::isfinite(state_[0] + state_[1] + state_[2] + state_[3])) {
      over_ = true;
      throw std::overflow_error("the acrobot's speed is too high for this integration_step");
    }
    ++decisions_;
    const StepResult result = result_of(config(), state_, goal, decisions_);
    over_ = result.terminated || result.truncated;
    return result;
  }

  /// theta1, theta2 in [-pi, pi) (rad), theta1_dot, theta2_dot (rad/s).
  Eigen::Vector4d state() const noexcept { return {state_[0], state_[1], state_[2], state_[3]}; }

  /// Height of the tip above joint 1, in m.
  double tip_height() const noexcept {
    return dynamics_.tip_height(SeparateForm<double>::angles(state_));
  }

  /// Kinetic and potential energy in J, the latter counted from the height of joint 1.
  double energy() const noexcept { return dynamics_.energy(state_); }

  /// Time derivative of `state` under `torque` (N m).
  State derivative(const State& state, double torque) const noexcept {
    using Form = SeparateForm<double>;
    return dynamics_.derivative<Form>(state, Form::angles(state), torque);
  }

  /// Decisions made in this episode.
  int decisions() const noexcept { return decisions_; }

  const AcrobotConfig& config() const noexcept { return dynamics_.config(); }

 private:
  // Moves the state on by one decision interval, or to the goal: then true.
  bool integrate(double torque, double lambda) noexcept {
    const double limit_1 = config().goal_velocity_1 * lambda;
    const double limit_2 = config().goal_velocity_2 * lambda;
#if SDNN_LANES
    PairedForm::State pairs{core::Lanes<2>::load(&state_[0]), core::Lanes<2>::load(&state_[2])};
    const bool goal = dynamics_.integrate<PairedForm>(pairs, torque, limit_1, limit_2, true);
    pairs[0].store(&state_[0]);
    pairs[1].store(&state_[2]);
    return goal;
#else
    return dynamics_.integrate<SeparateForm<double>>(state_, torque, limit_1, limit_2, true);
#endif
  }

  void begin_at(const State& state) noexcept {
    state_ = state;
    decisions_ = 0;
    over_ = false;
  }

  AcrobotDynamics dynamics_;
  State state_{};
  int decisions_ = 0;
  bool over_ = false;
};

}  // namespace sdnn::environments
