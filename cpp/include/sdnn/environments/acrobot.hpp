/// The acrobot: a two-link pendulum with torque on the second joint, and its swing-up task.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sdnn/core/check.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/environments/runge_kutta.hpp"

namespace sdnn::environments {

/// When the goal is looked for; the paper is silent.
enum class GoalTest {
  every_step,        ///< after every integration step: the episode ends at that instant
  decision_instant,  ///< only when the next decision is due
};

/// The task's numbers; the defaults are the paper's.
struct AcrobotConfig {
  double link_mass_1 = 1.0;       ///< kg
  double link_mass_2 = 1.0;       ///< kg
  double link_length_1 = 1.0;     ///< m
  double link_length_2 = 1.0;     ///< m
  double center_of_mass_1 = 0.5;  ///< m from joint 1
  double center_of_mass_2 = 0.5;  ///< m from joint 2
  double inertia_1 = 1.0;         ///< kg m^2, about the link's centre of mass
  double inertia_2 = 1.0;         ///< kg m^2
  double gravity = 9.8;           ///< m/s^2
  double max_torque = 10.0;       ///< N m
  double decision_interval = 1.0;             ///< s, the torque is held for it
  double integration_step = 0.02;             ///< s, a whole fraction of decision_interval
  int max_decisions = 50;                     ///< in an episode
  double goal_height = 1.5;                   ///< m, of the tip above joint 1
  double goal_velocity_1 = 3.0 * core::kPi;   ///< rad/s; times lambda for the goal, as it is for
  double goal_velocity_2 = 5.0 * core::kPi;   ///< rad/s; the penalty
  GoalTest goal_test = GoalTest::every_step;
  double goal_reward = 10.0;
  double penalty = -5.0;                      ///< for idling or too much speed; ends nothing
  double idle_angle = core::kPi / 36.0;       ///< rad: |theta1| below it is idling; 0 = never
};

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
  const double wrapped = std::remainder(angle, core::kTwoPi);
  return wrapped >= core::kPi ? -core::kPi : wrapped;
}

/// The acrobot's dynamics, reward and episode end.
///
/// theta1 = 0 hangs down, theta2 is relative to link 1; torque acts on joint 2 alone. A step
/// allocates nothing.
/// Source: Spong, M. W. (1995). The swing up control problem for the acrobot. IEEE Control Systems
/// 15(1), 49-55, with m2 l1 lc2 theta1_dot^2 sin theta2 in the second equation.
class Acrobot {
 public:
  /// theta1, theta2 (rad), theta1_dot, theta2_dot (rad/s).
  using State = std::array<double, 4>;

  /// The most integration steps in one decision.
  static constexpr double kMaxIntegrationSteps = 1e6;

  /// At rest, hanging down. Throws std::invalid_argument if a number is outside its range.
  explicit Acrobot(const AcrobotConfig& config = {}) : config_(config) {
    check(config);
    const double steps = std::nearbyint(config.decision_interval / config.integration_step);
    n_integration_steps_ = static_cast<int>(steps);
    time_step_ = config.decision_interval / steps;
    coupling_ = config.link_mass_2 * config.link_length_1 * config.center_of_mass_2;
    inertia_22_ = config.link_mass_2 * square(config.center_of_mass_2) + config.inertia_2;
    inertia_11_ = config.link_mass_1 * square(config.center_of_mass_1) + config.inertia_1 +
                  config.link_mass_2 * square(config.link_length_1) + inertia_22_;
    gravity_1_ = config.gravity * (config.link_mass_1 * config.center_of_mass_1 +
                                   config.link_mass_2 * config.link_length_1);
    gravity_2_ = config.gravity * config.link_mass_2 * config.center_of_mass_2;
    reset();
  }

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
    core::require_in_range("torque", torque, -config_.max_torque, config_.max_torque);
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
    const bool truncated = !goal && decisions_ >= config_.max_decisions;
    over_ = goal || truncated;
    return {goal ? config_.goal_reward : (is_penalized() ? config_.penalty : 0.0), goal, truncated};
  }

  /// theta1, theta2 in [-pi, pi) (rad), theta1_dot, theta2_dot (rad/s).
  Eigen::Vector4d state() const noexcept { return {state_[0], state_[1], state_[2], state_[3]}; }

  /// Height of the tip above joint 1, in m.
  double tip_height() const noexcept { return height_at(angles(state_)); }

  /// Kinetic and potential energy in J, the latter counted from the height of joint 1.
  double energy() const noexcept {
    const Angles at = angles(state_);
    const double v1 = state_[2], v2 = state_[3];
    const double bend = coupling_ * at.cos_2;
    return 0.5 * (inertia_11_ + 2.0 * bend) * v1 * v1 + 0.5 * inertia_22_ * v2 * v2 +
           (inertia_22_ + bend) * v1 * v2 - gravity_1_ * at.cos_1 - gravity_2_ * at.cos_12;
  }

  /// Time derivative of `state` under `torque` (N m).
  State derivative(const State& state, double torque) const noexcept {
    return derivative(state, angles(state), torque);
  }

  /// Decisions made in this episode.
  int decisions() const noexcept { return decisions_; }

  const AcrobotConfig& config() const noexcept { return config_; }

 private:
  struct Angles {
    double sin_1, cos_1, sin_2, cos_2, sin_12, cos_12;
  };

  static constexpr double square(double x) noexcept { return x * x; }

  static Angles angles(const State& state) noexcept {
    const core::SinCos one = core::sin_cos(state[0]);
    const core::SinCos two = core::sin_cos(state[1]);
    return {one.sin, one.cos, two.sin, two.cos, one.sin * two.cos + one.cos * two.sin,
            one.cos * two.cos - one.sin * two.sin};
  }

  // Spong's d11 a1 + d12 a2 + h1 + phi1 = 0, d12 a1 + d22 a2 + h2 + phi2 = torque by Cramer's rule:
  // the determinant depends on theta2 alone, so its division hides behind the right-hand sides.
  State derivative(const State& state, const Angles& at, double torque) const noexcept {
    const double d12 = inertia_22_ + coupling_ * at.cos_2;
    const double d11 = inertia_11_ + 2.0 * coupling_ * at.cos_2;
    const double inverse = 1.0 / (d11 * inertia_22_ - d12 * d12);
    const double v1 = state[2], v2 = state[3];
    const double swirl = coupling_ * at.sin_2;
    const double phi2 = gravity_2_ * at.sin_12;
    const double right_1 = swirl * (v2 * (v2 + 2.0 * v1)) - (gravity_1_ * at.sin_1 + phi2);
    const double right_2 = (torque - swirl * (v1 * v1)) - phi2;
    return {v1, v2, (inertia_22_ * right_1 - d12 * right_2) * inverse,
            (d11 * right_2 - d12 * right_1) * inverse};
  }

  double height_at(const Angles& at) const noexcept {
    return -config_.link_length_1 * at.cos_1 - config_.link_length_2 * at.cos_12;
  }

  // Moves the state on by one decision interval, or to the goal: then true.
  bool integrate(double torque, double lambda) noexcept {
    const double limit_1 = config_.goal_velocity_1 * lambda;
    const double limit_2 = config_.goal_velocity_2 * lambda;
    const bool every_step = config_.goal_test == GoalTest::every_step;
    const auto slope = [this, torque](const State& state) { return derivative(state, torque); };
    State state = state_;
    Angles at = angles(state);
    bool goal = false;
    for (int i = n_integration_steps_; i > 0 && !goal; --i) {
      state = runge_kutta_step(slope, state, derivative(state, at, torque), time_step_);
      at = angles(state);
      goal = (every_step || i == 1) && height_at(at) >= config_.goal_height &&
             std::abs(state[2]) < limit_1 && std::abs(state[3]) < limit_2;
    }
    state_ = state;
    return goal;
  }

  bool is_penalized() const noexcept {
    return std::abs(state_[0]) < config_.idle_angle ||
           std::abs(state_[2]) > config_.goal_velocity_1 ||
           std::abs(state_[3]) > config_.goal_velocity_2;
  }

  void begin_at(const State& state) noexcept {
    state_ = state;
    decisions_ = 0;
    over_ = false;
  }

  static void check(const AcrobotConfig& config);

  AcrobotConfig config_;
  int n_integration_steps_ = 0;
  double time_step_ = 0.0;
  double coupling_ = 0.0;    // m2 l1 lc2
  double inertia_11_ = 0.0;  // d11 without its cosine
  double inertia_22_ = 0.0;  // d22
  double gravity_1_ = 0.0;   // (m1 lc1 + m2 l1) g
  double gravity_2_ = 0.0;   // m2 lc2 g
  State state_{};
  int decisions_ = 0;
  bool over_ = false;
};

inline void Acrobot::check(const AcrobotConfig& config) {
  const std::pair<const char*, double> positive[] = {
      {"link_mass_1", config.link_mass_1}, {"link_mass_2", config.link_mass_2},
      {"link_length_1", config.link_length_1}, {"link_length_2", config.link_length_2},
      {"center_of_mass_1", config.center_of_mass_1}, {"center_of_mass_2", config.center_of_mass_2},
      {"inertia_1", config.inertia_1}, {"inertia_2", config.inertia_2},
      {"max_torque", config.max_torque}, {"decision_interval", config.decision_interval},
      {"integration_step", config.integration_step}, {"goal_velocity_1", config.goal_velocity_1},
      {"goal_velocity_2", config.goal_velocity_2}};
  for (const auto& [name, value] : positive) core::require_positive(name, value);
  core::require_finite("gravity", config.gravity);
  const double ratio = config.decision_interval / config.integration_step;
  core::require(ratio > 0.5 && ratio <= kMaxIntegrationSteps &&
                    std::abs(ratio - std::nearbyint(ratio)) <= 1e-9 * ratio,
                "integration_step", "a whole fraction of decision_interval, at most 1e6 of them",
                config.integration_step);
  core::require(config.max_decisions >= 1, "max_decisions", "at least 1", config.max_decisions);
  core::require_finite("goal_height", config.goal_height);
  core::require_finite("goal_reward", config.goal_reward);
  core::require_finite("penalty", config.penalty);
  core::require_in_range("idle_angle", config.idle_angle, 0.0, core::kPi);
}

}  // namespace sdnn::environments
