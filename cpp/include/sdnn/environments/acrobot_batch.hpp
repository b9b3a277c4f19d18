/// Many acrobots at once, several side by side in the lanes of vector registers.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/detail/acrobot_dynamics.hpp"
#include "sdnn/environments/detail/acrobot_kernel.hpp"

namespace sdnn::environments {

/// The most acrobots in one batch.
inline constexpr std::size_t kMaxAcrobots = std::size_t{1} << 24;

/// N acrobots in step, each with the bits that an Acrobot of its own would have.
///
/// The torques, the goal's limits and the instants at which episodes end are each acrobot's own.
/// A step allocates nothing.
class AcrobotBatch {
 public:
  /// All at rest, hanging down. Throws std::invalid_argument if a number is outside its range.
  AcrobotBatch(const AcrobotConfig& config, std::size_t n_acrobots)
      : dynamics_(config),
        size_(checked(n_acrobots)),
        padded_size_(core::round_up(n_acrobots, kAcrobotLanes)),
        torque_(padded_size_),
        lambda_(padded_size_),
        mask_(padded_size_),
        decisions_(n_acrobots),
        over_(n_acrobots) {
    for (auto& numbers : state_) numbers = core::AlignedBuffer<double>(padded_size_);
  }

  std::size_t size() const noexcept { return size_; }

  /// Starts an episode of acrobot `i` at rest, hanging down. Throws std::out_of_range.
  void reset(std::size_t i) { begin_at(i, {0.0, 0.0, 0.0, 0.0}); }

  /// Starts an episode of every acrobot.
  void reset() {
    for (std::size_t i = 0; i < size_; ++i) reset(i);
  }

  /// Starts an episode of acrobot `i` at `state`; the angles are wrapped. Throws
  /// std::invalid_argument unless every number is finite, std::out_of_range.
  void set_state(std::size_t i, const Eigen::Vector4d& state) {
    for (const double value : state) core::require_finite("state", value);
    begin_at(i, {wrap_angle(state[0]), wrap_angle(state[1]), state[2], state[3]});
  }

  /// Acrobot::step for every acrobot whose item of `moving` is not 0; the others stay as they are
  /// (reward 0, no end), whatever their torque and lambda.
  ///
  /// Shapes: all (size(),). Throws std::invalid_argument or std::logic_error, like Acrobot::step,
  /// before anything moves; std::overflow_error after all have moved.
  void step(std::span<const double> torques, std::span<const double> lambdas,
            std::span<const std::uint8_t> moving, std::span<StepResult> results) {
    check_step(torques, lambdas, moving, results);
    for (std::size_t i = 0; i < size_; ++i) {
      torque_[i] = moving[i] ? torques[i] : 0.0;
      lambda_[i] = moving[i] ? lambdas[i] : 0.0;
      mask_[i] = moving[i] ? ~std::uint64_t{0} : 0;
    }
    move_acrobots_kernel()(
        dynamics_,
        {{state_[0].data(), state_[1].data(), state_[2].data(), state_[3].data()},
         torque_.data(),
         lambda_.data(),
         mask_.data()},
        padded_size_);
    std::size_t n_overflows = 0, first_overflow = 0;
    for (std::size_t i = size_; i-- > 0;) {
      if (!moving[i]) {
        results[i] = {0.0, false, false};
        continue;
      }
      state_[0][i] = wrap_angle(state_[0][i]);
      state_[1][i] = wrap_angle(state_[1][i]);
      const auto now = numbers(i);
      if (!std::isfinite(now[0] + now[1] + now[2] + now[3])) {
        over_[i] = true;
        first_overflow = i;
        ++n_overflows;
        continue;
      }
      results[i] = result_of(config(), now, mask_[i] != 0, ++decisions_[i]);
      over_[i] = results[i].terminated || results[i].truncated;
    }
    if (n_overflows > 0) {
      throw std::overflow_error("the speed of acrobot " + std::to_string(first_overflow) +
                                " is too high for this integration_step");
    }
  }

  /// theta1, theta2 in [-pi, pi) (rad), theta1_dot, theta2_dot (rad/s). Throws std::out_of_range.
  Eigen::Vector4d state(std::size_t i) const {
    require_index(i);
    const auto now = numbers(i);
    return {now[0], now[1], now[2], now[3]};
  }

  /// Height of the tip above joint 1, in m. Throws std::out_of_range.
  double tip_height(std::size_t i) const {
    require_index(i);
    return dynamics_.tip_height(SeparateForm<double>::angles(numbers(i)));
  }

  /// Decisions made in the episode of acrobot `i`. Throws std::out_of_range.
  int decisions(std::size_t i) const {
    require_index(i);
    return decisions_[i];
  }

  const AcrobotConfig& config() const noexcept { return dynamics_.config(); }

 private:
  using State = std::array<double, 4>;

  static std::size_t checked(std::size_t n_acrobots) {
    core::require_in_range("n_acrobots", n_acrobots, 1, kMaxAcrobots);
    return n_acrobots;
  }

  void require_index(std::size_t i) const {
    if (i >= size_) {
      throw std::out_of_range("index must be below " + std::to_string(size_) + ", got " +
                              std::to_string(i));
    }
  }

  State numbers(std::size_t i) const noexcept {
    return {state_[0][i], state_[1][i], state_[2][i], state_[3][i]};
  }

  void begin_at(std::size_t i, const State& state) {
    require_index(i);
    for (std::size_t k = 0; k < state.size(); ++k) state_[k][i] = state[k];
    decisions_[i] = 0;
    over_[i] = false;
  }

  void check_step(std::span<const double> torques, std::span<const double> lambdas,
                  std::span<const std::uint8_t> moving, std::span<StepResult> results) const {
    const auto require_size = [this](const char* name, std::size_t size) {
      core::require(size == size_, name, "of " + std::to_string(size_) + " items", size);
    };
    require_size("torques", torques.size());
    require_size("lambdas", lambdas.size());
    require_size("moving", moving.size());
    require_size("results", results.size());
    const double max_torque = config().max_torque;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!moving[i]) continue;
      if (std::abs(torques[i]) <= max_torque && lambdas[i] >= 0.0 && !over_[i]) continue;
      const std::string item = "[" + std::to_string(i) + "]";
      core::require_in_range("torques" + item, torques[i], -max_torque, max_torque);
      core::require(lambdas[i] >= 0.0, "lambdas" + item, "at least 0", lambdas[i]);
      throw std::logic_error("the episode of acrobot " + std::to_string(i) +
                             " is over: call reset before step");
    }
  }

  AcrobotDynamics dynamics_;
  std::size_t size_;
  std::size_t padded_size_;
  std::array<core::AlignedBuffer<double>, 4> state_;  // theta1, theta2, theta1_dot, theta2_dot
  core::AlignedBuffer<double> torque_;
  core::AlignedBuffer<double> lambda_;
  core::AlignedBuffer<std::uint64_t> mask_;
  std::vector<int> decisions_;
  std::vector<char> over_;
};

}  // namespace sdnn::environments
