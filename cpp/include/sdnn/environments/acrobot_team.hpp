/// Several Acrobot objects that move at once in vector registers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/detail/acrobot_kernel.hpp"

namespace sdnn::environments {

/// Up to kMaxMembers acrobots of equal configurations, which step together. That takes little
/// longer than a step of a single acrobot, and gives the same bits as Acrobot::step.
class AcrobotTeam {
 public:
  static constexpr std::size_t kMaxMembers = kAcrobotLanes;

  /// Adds `acrobot` to the next step, and to that alone, as member `i`, below kMaxMembers; it must
  /// exist until then.
  /// Throws std::invalid_argument or std::logic_error if Acrobot::step would.
  void join(std::size_t i, Acrobot& acrobot, double torque, double goal_tolerance) {
    acrobot.check_step(torque, goal_tolerance);
    members_[i] = &acrobot;
    torque_[i] = torque;
    goal_tolerance_[i] = goal_tolerance;
  }

  /// Does what Acrobot::step does for all that have joined since the last step, and calls take(i,
  /// result) for each. Returns whether there were any. Throws std::overflow_error like
  /// Acrobot::step; then the members after the failed one get no result.
  template <class Take>
  bool step(Take&& take) {
    const Acrobot* any = nullptr;  // some member: all have the same dynamics
    for (std::size_t i = 0; i < kMaxMembers; ++i) {
      mask_[i] = members_[i] != nullptr ? ~std::uint64_t{0} : 0;
      if (members_[i] == nullptr) continue;
      any = members_[i];
      for (std::size_t k = 0; k < state_.size(); ++k) {
        state_[k][i] = any->state_[static_cast<Eigen::Index>(k)];
      }
    }
    if (any == nullptr) return false;
    move_acrobots(any->dynamics_,
                  {{state_[0].data(), state_[1].data(), state_[2].data(), state_[3].data()},
                   torque_.data(),
                   goal_tolerance_.data(),
                   mask_.data()},
                  kMaxMembers);
    const auto members = std::exchange(members_, {});
    for (std::size_t i = 0; i < kMaxMembers; ++i) {
      if (members[i] == nullptr) continue;
      members[i]->state_ = {state_[0][i], state_[1][i], state_[2][i], state_[3][i]};
      take(i, members[i]->end_step(mask_[i] != 0));
    }
    return true;
  }

 private:
  using Numbers = std::array<double, kMaxMembers>;

  std::array<Acrobot*, kMaxMembers> members_ = {};
  alignas(64) std::array<Numbers, 4> state_ = {};  // theta1, theta2, theta1_dot, theta2_dot
  alignas(64) Numbers torque_ = {};
  alignas(64) Numbers goal_tolerance_ = {};
  alignas(64) std::array<std::uint64_t, kMaxMembers> mask_ = {};  // see AcrobotArrays
};

}  // namespace sdnn::environments
