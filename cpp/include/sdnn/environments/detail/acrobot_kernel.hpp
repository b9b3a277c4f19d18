/// The kernel of a batch of acrobots, which move in the widest registers of the processor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/environments/detail/acrobot_dynamics.hpp"

namespace sdnn::environments {

/// Arrays with a number for each acrobot; their lengths are multiples of kAcrobotLanes.
struct AcrobotArrays {
  std::array<double*, 4> state;  ///< theta1, theta2, theta1_dot, theta2_dot
  const double* torque;
  const double* goal_tolerance;
  std::uint64_t* mask;  ///< in: all ones where an acrobot moves; out: where it reached the goal
};

/// The number of doubles in the widest register of any processor.
inline constexpr std::size_t kAcrobotLanes = 8;

namespace detail {

#if SDNN_LANES
/// Implements move_acrobots with Size acrobots at once, in registers of Size doubles. It is inlined
/// into a function for an instruction set with such registers.
template <std::size_t Size>
SDNN_INLINE void move_in_lanes(const AcrobotDynamics& dynamics, const AcrobotArrays& arrays,
                               std::size_t n) noexcept {
  using Real = core::Lanes<Size>;
  using Form = SeparateForm<Real>;
  const double velocity_1 = dynamics.config().goal_velocity_1;
  const double velocity_2 = dynamics.config().goal_velocity_2;
  for (std::size_t i = 0; i < n; i += Size) {
    auto mask = core::LaneBits<Size>::load(arrays.mask + i);
    if (!core::any(mask)) continue;
    typename Form::State state;
    core::unrolled<4>([&](std::size_t k)
                          SDNN_INLINE_LAMBDA { state[k] = Real::load(arrays.state[k] + i); });
    const Real tolerance = Real::load(arrays.goal_tolerance + i);
    mask = dynamics.integrate<Form>(state, Real::load(arrays.torque + i), velocity_1 * tolerance,
                                    velocity_2 * tolerance, mask);
    core::unrolled<4>([&](std::size_t k)
                          SDNN_INLINE_LAMBDA { state[k].store(arrays.state[k] + i); });
    mask.store(arrays.mask + i);
  }
}
#else
/// Implements move_acrobots one acrobot after the other, in builds without vector registers.
template <std::size_t Size>
void move_in_lanes(const AcrobotDynamics& dynamics, const AcrobotArrays& arrays,
                   std::size_t n) noexcept {
  using Form = SeparateForm<double>;
  for (std::size_t i = 0; i < n; ++i) {
    if (arrays.mask[i] == 0) continue;
    Form::State state;
    for (std::size_t k = 0; k < 4; ++k) state[k] = arrays.state[k][i];
    const double tolerance = arrays.goal_tolerance[i];
    const bool goal = dynamics.integrate<Form>(state, arrays.torque[i],
                                               dynamics.config().goal_velocity_1 * tolerance,
                                               dynamics.config().goal_velocity_2 * tolerance, true);
    for (std::size_t k = 0; k < 4; ++k) arrays.state[k][i] = state[k];
    arrays.mask[i] = goal ? ~std::uint64_t{0} : 0;
  }
}
#endif

}  // namespace detail

// Registers of two doubles exist on every x86-64 and AArch64 processor.
SDNN_KERNEL_VERSION(, void, move_acrobots_portable,
                    (const AcrobotDynamics& dynamics, const AcrobotArrays& arrays, std::size_t n),
                    move_in_lanes<2>(dynamics, arrays, n))
SDNN_KERNEL_NEON(void, move_acrobots,
                 (const AcrobotDynamics& dynamics, const AcrobotArrays& arrays, std::size_t n),
                 (dynamics, arrays, n))
#if SDNN_X86_KERNELS
SDNN_KERNEL_VERSION([[SDNN_TARGET_AVX2]], void, move_acrobots_avx2,
                    (const AcrobotDynamics& dynamics, const AcrobotArrays& arrays, std::size_t n),
                    move_in_lanes<4>(dynamics, arrays, n))
SDNN_KERNEL_VERSION([[SDNN_TARGET_AVX512]], void, move_acrobots_avx512,
                    (const AcrobotDynamics& dynamics, const AcrobotArrays& arrays, std::size_t n),
                    move_in_lanes<8>(dynamics, arrays, n))
#endif

/// Advances the `n` acrobots in arrays, a multiple of kAcrobotLanes, by one decision interval or to
/// the goal, where their mask is set. Angles are not wrapped.
SDNN_DISPATCH(void, move_acrobots,
              (const AcrobotDynamics& dynamics, const AcrobotArrays& arrays, std::size_t n),
              (dynamics, arrays, n))

}  // namespace sdnn::environments
