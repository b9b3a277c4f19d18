/// The acrobot's equations of motion, for one acrobot or for several side by side.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "sdnn/environments/acrobot_state.hpp"

namespace sdnn::environments {

/// Returns the state after a time `step` of y' = derivative(y), given the slope at the start.
///
/// `Real` is double or core::Lanes, a register of doubles; the derivative must be inlined for wide
/// registers. The slope at the start is an argument, because a caller that tests every state has
/// computed most of it already. The error of a step is O(step^5). It allocates nothing.
/// Source: Kutta 1901; the weights are 1/6, 1/3, 1/3, 1/6.
template <class Real, std::size_t Size, class Derivative>
SDNN_INLINE std::array<Real, Size> runge_kutta_step(const Derivative& derivative,
                                                    const std::array<Real, Size>& start,
                                                    const std::array<Real, Size>& start_slope,
                                                    double step) noexcept {
  using Vector = std::array<Real, Size>;
  const auto moved = [&start](double time, const Vector& slope) SDNN_INLINE_LAMBDA {
    Vector result;
    core::unrolled<Size>([&](std::size_t i)
                             SDNN_INLINE_LAMBDA { result[i] = start[i] + time * slope[i]; });
    return result;
  };
  const double half = 0.5 * step;
  const Vector second = derivative(moved(half, start_slope));
  const Vector third = derivative(moved(half, second));
  const Vector fourth = derivative(moved(step, third));
  Vector end;
  core::unrolled<Size>([&](std::size_t i) SDNN_INLINE_LAMBDA {
    const Real sum = (start_slope[i] + fourth[i]) + 2.0 * (second[i] + third[i]);
    end[i] = start[i] + step * (1.0 / 6.0) * sum;
  });
  return end;
}

/// Sines and cosines of theta1, theta2 and theta1 + theta2.
template <class Real>
struct AcrobotAngles {
  Real sin_1, cos_1, sin_2, cos_2, sin_12, cos_12;

  /// Adds those of the sum by the addition theorems.
  SDNN_INLINE static AcrobotAngles of(const core::BasicSinCos<Real>& joint_1,
                                      const core::BasicSinCos<Real>& joint_2) noexcept {
    return {joint_1.sin,
            joint_1.cos,
            joint_2.sin,
            joint_2.cos,
            joint_1.sin * joint_2.cos + joint_1.cos * joint_2.sin,
            joint_1.cos * joint_2.cos - joint_1.sin * joint_2.sin};
  }
};

/// The state as four numbers theta1, theta2 (rad), theta1_dot, theta2_dot (rad/s): of a single
/// acrobot (`Real` = double), or of several, one in each lane of four registers.
///
/// This is an array and not an Eigen vector, because Eigen does not support lanes as numbers, nor
/// guarantees that its calls are inlined into a kernel for one instruction set.
template <class Real>
struct SeparateForm {
  using Number = Real;
  using State = std::array<Real, 4>;

  SDNN_INLINE static AcrobotAngles<Real> angles(const State& state) noexcept {
    return AcrobotAngles<Real>::of(core::sin_cos(state[0]), core::sin_cos(state[1]));
  }
  SDNN_INLINE static Real velocity_1(const State& state) noexcept { return state[2]; }
  SDNN_INLINE static Real velocity_2(const State& state) noexcept { return state[3]; }
  SDNN_INLINE static State slope(const State& state, const Real& acceleration_1,
                                 const Real& acceleration_2) noexcept {
    return {state[2], state[3], acceleration_1, acceleration_2};
  }
};

#if SDNN_LANES
/// The state of a single acrobot as a register of two angles and a register of two velocities, so
/// that the sines of both angles are computed at once. Registers of two lanes exist on every
/// machine.
struct PairedForm {
  using Number = double;
  using State = std::array<core::Lanes<2>, 2>;

  SDNN_INLINE static AcrobotAngles<double> angles(const State& state) noexcept {
    const auto at = core::sin_cos(state[0]);
    return AcrobotAngles<double>::of({at.sin.v[0], at.cos.v[0]}, {at.sin.v[1], at.cos.v[1]});
  }
  SDNN_INLINE static double velocity_1(const State& state) noexcept { return state[1].v[0]; }
  SDNN_INLINE static double velocity_2(const State& state) noexcept { return state[1].v[1]; }
  SDNN_INLINE static State slope(const State& state, double acceleration_1,
                                 double acceleration_2) noexcept {
    return {state[1], core::Lanes<2>(core::Lanes<2>::Vector{acceleration_1, acceleration_2})};
  }
};
#endif

/// The equations of motion of an acrobot, and their integration over a decision interval.
///
/// theta1 = 0 hangs down, theta2 is relative to link 1; torque acts on joint 2 alone. `Form`,
/// SeparateForm or PairedForm, is how states are stored; every form and every lane gives equal
/// bits. Source: Spong, M. W. (1995). The swing up control problem for the acrobot. IEEE Control
/// Systems 15(1), 49-55, with m2 l1 lc2 theta1_dot^2 sin theta2 in the second equation.
class AcrobotDynamics {
 public:
  /// The largest number of integration steps in a decision.
  static constexpr double kMaxIntegrationSteps = 1e6;

  /// Throws std::invalid_argument if a number is outside its range.
  explicit AcrobotDynamics(const AcrobotConfig& config = {}) : config_(config) {
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
  }

  /// Returns the time derivative of `state` under `torque` (N m), given the sines and cosines of
  /// its angles.
  ///
  /// Spong's equations d11 a1 + d12 a2 + h1 + phi1 = 0 and d12 a1 + d22 a2 + h2 + phi2 = torque are
  /// solved for the accelerations a1 and a2 by Cramer's rule. The determinant depends on theta2
  /// alone, so the processor can divide by it while it computes the right-hand sides.
  template <class Form>
  SDNN_INLINE typename Form::State derivative(const typename Form::State& state,
                                              const AcrobotAngles<typename Form::Number>& at,
                                              const typename Form::Number& torque) const noexcept {
    using Real = typename Form::Number;
    const Real d12 = inertia_22_ + coupling_ * at.cos_2;
    const Real d11 = inertia_11_ + 2.0 * coupling_ * at.cos_2;
    const Real inverse_determinant = 1.0 / (d11 * inertia_22_ - d12 * d12);
    const Real v1 = Form::velocity_1(state), v2 = Form::velocity_2(state);
    const Real coriolis = coupling_ * at.sin_2;
    const Real phi2 = gravity_2_ * at.sin_12;
    const Real right_1 = coriolis * (v2 * (v2 + 2.0 * v1)) - (gravity_1_ * at.sin_1 + phi2);
    const Real right_2 = (torque - coriolis * (v1 * v1)) - phi2;
    return Form::slope(state, (inertia_22_ * right_1 - d12 * right_2) * inverse_determinant,
                       (d11 * right_2 - d12 * right_1) * inverse_determinant);
  }

  /// Height of the tip above joint 1, in m.
  template <class Real>
  SDNN_INLINE Real tip_height(const AcrobotAngles<Real>& at) const noexcept {
    return -config_.link_length_1 * at.cos_1 - config_.link_length_2 * at.cos_12;
  }

  /// Advances the states whose mask `moving` is set by one decision interval, or until they reach
  /// the goal; the others do not change. Returns the mask of those that have reached the goal.
  ///
  /// `limit_1` and `limit_2` are the goal's limits of speed (rad/s). Angles are not wrapped. For a
  /// single acrobot a mask is a bool.
  template <class Form, class Mask>
  SDNN_INLINE Mask integrate(typename Form::State& state, const typename Form::Number& torque,
                             const typename Form::Number& limit_1,
                             const typename Form::Number& limit_2,
                             const Mask& moving) const noexcept {
    using State = typename Form::State;
    constexpr std::size_t kSize = std::tuple_size_v<State>;
    const bool every_step = config_.goal_test == GoalTest::every_step;
    const auto slope = [this, &torque](const State& at_state) SDNN_INLINE_LAMBDA {
      return derivative<Form>(at_state, Form::angles(at_state), torque);
    };
    // All lanes step until the last has arrived; a lane that arrives stores its numbers in `state`.
    State current = state;
    Mask under_way = moving;
    auto at = Form::angles(current);
    for (int i = n_integration_steps_; i > 0; --i) {
      current = runge_kutta_step(slope, current, derivative<Form>(current, at, torque), time_step_);
      at = Form::angles(current);
      if (!every_step && i > 1) continue;
      Mask arrived = core::both(tip_height(at) >= config_.goal_height, under_way);
      if (!core::any(arrived)) continue;
      const Mask slow = core::both(core::magnitude(Form::velocity_1(current)) < limit_1,
                                   core::magnitude(Form::velocity_2(current)) < limit_2);
      arrived = core::both(arrived, slow);
      if (!core::any(arrived)) continue;
      core::unrolled<kSize>([&](std::size_t k) SDNN_INLINE_LAMBDA {
        state[k] = core::select(arrived, current[k], state[k]);
      });
      under_way = core::first_only(under_way, arrived);
      if (!core::any(under_way)) return moving;
    }
    core::unrolled<kSize>([&](std::size_t k) SDNN_INLINE_LAMBDA {
      state[k] = core::select(under_way, current[k], state[k]);
    });
    return core::first_only(moving, under_way);
  }

  /// Time derivative of `state` under `torque` (N m).
  AcrobotState derivative(const AcrobotState& state, double torque) const noexcept {
    using Form = SeparateForm<double>;
    const Form::State current = separate(state);
    const Form::State slope = derivative<Form>(current, Form::angles(current), torque);
    return {slope[0], slope[1], slope[2], slope[3]};
  }

  /// Height of the tip above joint 1, in m.
  double tip_height(const AcrobotState& state) const noexcept {
    return tip_height(SeparateForm<double>::angles(separate(state)));
  }

  /// Maps accelerations of the joints to torques on them: Spong's d11, d12 = d21, d22 in kg m^2.
  Eigen::Matrix2d mass_matrix(double theta2) const noexcept {
    const double coupling = coupling_ * core::sin_cos(theta2).cos;
    const double d12 = inertia_22_ + coupling;
    return Eigen::Matrix2d{{inertia_11_ + 2.0 * coupling, d12}, {d12, inertia_22_}};
  }

  /// Kinetic and potential energy in J, the latter counted from the height of joint 1.
  double energy(const AcrobotState& state) const noexcept {
    const auto at = SeparateForm<double>::angles(separate(state));
    const Eigen::Vector2d velocity = state.tail<2>();
    return 0.5 * velocity.dot(mass_matrix(state[1]) * velocity) - gravity_1_ * at.cos_1 -
           gravity_2_ * at.cos_12;
  }

  const AcrobotConfig& config() const noexcept { return config_; }

 private:
  static constexpr double square(double x) noexcept { return x * x; }

  static SeparateForm<double>::State separate(const AcrobotState& state) noexcept {
    return {state[0], state[1], state[2], state[3]};
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
};

/// Throws std::invalid_argument for fields out of range, or integration steps that do not divide a
/// decision.
inline void AcrobotDynamics::check(const AcrobotConfig& config) {
  core::check_fields(config);
  const double ratio = config.decision_interval / config.integration_step;
  core::require(ratio > 0.5 && ratio <= kMaxIntegrationSteps &&
                    std::abs(ratio - std::nearbyint(ratio)) <= 1e-9 * ratio,
                "integration_step", "a whole fraction of decision_interval, at most 1e6 of them",
                config.integration_step);
}

}  // namespace sdnn::environments
