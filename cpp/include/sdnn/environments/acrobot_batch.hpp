/// Batches of acrobots, several of which move at a time in a vector register.
#pragma once

#include <Eigen/Core>
#include <algorithm>
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
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "sdnn/environments/acrobot_sensors.hpp"
#include "sdnn/environments/acrobot_state.hpp"
#include "sdnn/environments/detail/acrobot_dynamics.hpp"
#include "sdnn/environments/detail/acrobot_kernel.hpp"

namespace sdnn::environments {

/// The largest number of acrobots in a batch.
inline constexpr std::size_t kMaxAcrobots = std::size_t{1} << 24;

/// Results of a step for every acrobot of a batch: StepResult's members. Shapes: all (size(),).
struct AcrobotBatchResults {
  std::span<double> rewards;
  std::span<std::uint8_t> terminated;  ///< 1 at the goal, else 0
  std::span<std::uint8_t> truncated;   ///< 1 after the last decision without the goal, else 0
};

/// A batch of acrobots that move together; each gives the same bits as an Acrobot. Each has a
/// separate torque, goal tolerance and end of episode. A step allocates nothing.
class AcrobotBatch {
 public:
  /// Starts all at rest, hanging down. Throws std::invalid_argument if a number is outside its
  /// range.
  AcrobotBatch(const AcrobotConfig& config, std::size_t n_acrobots)
      : dynamics_(config),
        size_(checked(n_acrobots)),
        padded_size_(core::round_up(n_acrobots, kAcrobotLanes)),
        torque_(padded_size_),
        goal_tolerance_(padded_size_),
        mask_(padded_size_),
        decisions_(n_acrobots),
        over_(n_acrobots) {
    for (auto& numbers : state_) numbers = core::AlignedBuffer<double>(padded_size_);
  }

  std::size_t size() const noexcept { return size_; }

  /// Starts an episode of acrobot `i` at rest, hanging down. Throws std::out_of_range.
  void reset(std::size_t i) { begin_at(i, AcrobotState::Zero()); }

  /// Starts an episode of every acrobot.
  void reset() {
    for (std::size_t i = 0; i < size_; ++i) reset(i);
  }

  /// Starts an episode of every acrobot whose item of `mask` is not 0.
  ///
  /// Shape: (size(),). Throws std::invalid_argument for another size.
  void reset(std::span<const std::uint8_t> mask) {
    require_size("mask", mask.size());
    for (std::size_t i = 0; i < size_; ++i) {
      if (mask[i]) reset(i);
    }
  }

  /// Starts an episode of acrobot `i` at `state`; the angles are wrapped. Throws
  /// std::invalid_argument unless every number is finite, std::out_of_range.
  void set_state(std::size_t i, const AcrobotState& state) { begin_at(i, wrapped(state)); }

  /// Calls Acrobot::step for every acrobot whose item of `moving` is not 0; the others do not
  /// change (reward 0, no end) and their torques and tolerances are ignored.
  ///
  /// Shapes: all (size(),). Throws std::invalid_argument or std::logic_error, like Acrobot::step,
  /// before anything moves; std::overflow_error after all have moved. The computation may be
  /// interrupted; then the episodes of all moving acrobots are over.
  void step(std::span<const double> torques, std::span<const double> goal_tolerances,
            std::span<const std::uint8_t> moving, const AcrobotBatchResults& results) {
    check_step(torques, goal_tolerances, moving, results);
    for (std::size_t i = 0; i < size_; ++i) {
      torque_[i] = moving[i] ? torques[i] : 0.0;
      goal_tolerance_[i] = moving[i] ? goal_tolerances[i] : 0.0;
      mask_[i] = moving[i] ? ~std::uint64_t{0} : 0;
    }
    move_all(moving);
    std::size_t n_overflows = 0, first_overflow = 0;
    for (std::size_t i = size_; i-- > 0;) {  // backwards, so that the first overflow is kept
      StepResult result{0.0, false, false};
      if (moving[i]) {
        state_[0][i] = wrap_angle(state_[0][i]);
        state_[1][i] = wrap_angle(state_[1][i]);
        const AcrobotState now = state_of(i);
        if (now.allFinite()) {
          result = result_of(config(), now, mask_[i] != 0, ++decisions_[i]);
          over_[i] = result.terminated || result.truncated;
        } else {
          over_[i] = true;
          first_overflow = i;
          ++n_overflows;
        }
      }
      results.rewards[i] = result.reward;
      results.terminated[i] = result.terminated;
      results.truncated[i] = result.truncated;
    }
    if (n_overflows > 0) {
      core::fail(std::overflow_error("the speed of acrobot " + std::to_string(first_overflow) +
                                     " is too high for this integration_step"));
    }
  }

  /// The current state of acrobot `i`, with angles in [-pi, pi). Throws std::out_of_range.
  AcrobotState state(std::size_t i) const {
    require_index(i);
    return state_of(i);
  }

  /// Writes every state. Shape: (size(), 4), row after row. Throws std::invalid_argument.
  void states(std::span<double> out) const {
    write_rows(out, [](const AcrobotState& state) { return state; });
  }

  /// Writes the basic observation s1..s4 of every acrobot. Shape: (size(), 4), row after row.
  /// Throws std::invalid_argument.
  void observations(std::span<double> out) const { write_rows(out, basic_observation); }

  /// Height of the tip of acrobot `i` above joint 1, in m. Throws std::out_of_range.
  double tip_height(std::size_t i) const { return dynamics_.tip_height(state(i)); }

  /// Writes the height of every tip. Shape: (size(),). Throws std::invalid_argument.
  void tip_heights(std::span<double> out) const {
    require_size("out", out.size());
    for (std::size_t i = 0; i < size_; ++i) out[i] = dynamics_.tip_height(state_of(i));
  }

  /// The number of decisions in the episode of acrobot `i`. Throws std::out_of_range.
  int decisions(std::size_t i) const {
    require_index(i);
    return decisions_[i];
  }

  const AcrobotConfig& config() const noexcept { return dynamics_.config(); }

 private:
  static std::size_t checked(std::size_t n_acrobots) {
    core::require_in_range("n_acrobots", n_acrobots, 1, kMaxAcrobots);
    return n_acrobots;
  }

  void require_index(std::size_t i) const {
    if (i >= size_) {
      core::fail(std::out_of_range("index must be below " + std::to_string(size_) + ", got " +
                                   std::to_string(i)));
    }
  }

  void require_size(const char* name, std::size_t size, std::size_t width = 1) const {
    const std::size_t expected = width * size_;
    if (size == expected) return;  // only the message allocates
    core::require(false, name, "of " + std::to_string(expected) + " items", size);
  }

  /// Integrates one decision of the moving acrobots, some of them at a time. An interruption
  /// between these parts ends the episodes of all moving acrobots, because only some of them have
  /// moved.
  void move_all(std::span<const std::uint8_t> moving) {
    constexpr double kStepsPerPoint = 1 << 20;  // these take a fraction of a second
    const double steps = std::nearbyint(config().decision_interval / config().integration_step);
    const std::size_t n_at_once =
        core::round_up(static_cast<std::size_t>(kStepsPerPoint / steps) + 1, kAcrobotLanes);
    // All moving episodes count as over until `step` has decided, in case of an interruption.
    for (std::size_t i = 0; i < size_; ++i) over_[i] = over_[i] || moving[i];
    for (std::size_t first = 0; first < padded_size_; first += n_at_once) {
      core::interruption_point();
      move_acrobots(dynamics_,
                    {{state_[0].data() + first, state_[1].data() + first, state_[2].data() + first,
                      state_[3].data() + first},
                     torque_.data() + first,
                     goal_tolerance_.data() + first,
                     mask_.data() + first},
                    std::min(n_at_once, padded_size_ - first));
    }
  }

  AcrobotState state_of(std::size_t i) const noexcept {
    return {state_[0][i], state_[1][i], state_[2][i], state_[3][i]};
  }

  /// Writes four numbers for each acrobot, row_of(state).
  template <class RowOf>
  void write_rows(std::span<double> out, const RowOf& row_of) const {
    require_size("out", out.size(), 4);
    for (std::size_t i = 0; i < size_; ++i) {
      Eigen::Vector4d::Map(&out[4 * i]) = row_of(state_of(i));
    }
  }

  /// Begins an episode of acrobot i at a state.
  void begin_at(std::size_t i, const AcrobotState& state) {
    require_index(i);
    for (std::size_t k = 0; k < state_.size(); ++k) {
      state_[k][i] = state[static_cast<Eigen::Index>(k)];
    }
    decisions_[i] = 0;
    over_[i] = false;
  }

  /// Checks the arguments of a step before any acrobot moves. Torques and tolerances of acrobots
  /// that do not move may have any value.
  void check_step(std::span<const double> torques, std::span<const double> goal_tolerances,
                  std::span<const std::uint8_t> moving, const AcrobotBatchResults& results) const {
    require_size("torques", torques.size());
    require_size("goal_tolerances", goal_tolerances.size());
    require_size("moving", moving.size());
    require_size("rewards", results.rewards.size());
    require_size("terminated", results.terminated.size());
    require_size("truncated", results.truncated.size());
    const double max_torque = config().max_torque;
    for (std::size_t i = 0; i < size_; ++i) {
      if (!moving[i]) continue;
      if (std::abs(torques[i]) <= max_torque && goal_tolerances[i] >= 0.0 && !over_[i]) continue;
      const std::string item = "[" + std::to_string(i) + "]";
      core::require_in_range("torques" + item, torques[i], -max_torque, max_torque);
      core::require(goal_tolerances[i] >= 0.0, "goal_tolerances" + item, "at least 0",
                    goal_tolerances[i]);
      core::fail(std::logic_error("the episode of acrobot " + std::to_string(i) +
                                  " is over: call reset before step"));
    }
  }

  AcrobotDynamics dynamics_;
  std::size_t size_;
  std::size_t padded_size_;
  std::array<core::AlignedBuffer<double>, 4> state_;  // theta1, theta2, theta1_dot, theta2_dot
  core::AlignedBuffer<double> torque_;
  core::AlignedBuffer<double> goal_tolerance_;
  core::AlignedBuffer<std::uint64_t> mask_;  // see AcrobotArrays
  std::vector<int> decisions_;
  std::vector<char> over_;
};

}  // namespace sdnn::environments
