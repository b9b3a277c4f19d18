#include "sdnn/environments/detail/acrobot_kernel.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::environments {
namespace {

using One = SeparateForm<double>;

#if SDNN_LANES
// The widest kernel's template, on whatever registers there are: tested where AVX-512 is missing.
void move_eight(const AcrobotDynamics& dynamics, const AcrobotArrays& arrays, std::size_t n) {
  detail::move_in_lanes<8>(dynamics, arrays, n);
}
#endif

// Every kernel this processor can run, against one acrobot after the other.
TEST(AcrobotKernel, KeepsTheBitsAtEveryLevel) {
  constexpr std::size_t kSize = 4096;
  const AcrobotConfig config{.link_mass_1 = 0.9};
  const AcrobotDynamics dynamics(config);
  core::Random random(5, core::Stream::exploration);
  std::vector<One::State> starts(kSize);
  std::vector<double> torque(kSize), tolerance(kSize);
  std::vector<std::uint64_t> moving(kSize);
  for (std::size_t i = 0; i < kSize; ++i) {
    for (double& value : starts[i]) value = 6.0 * random.uniform() - 3.0;
    torque[i] = 20.0 * random.uniform() - 10.0;
    tolerance[i] = random.uniform();
    moving[i] = random.uniform() < 0.8 ? ~std::uint64_t{0} : 0;
  }
  for (std::size_t i = 512; i < 1024; ++i) moving[i] = 0;  // whole registers stand still
  const auto check = [&](const auto& move) {
    std::array<std::vector<double>, 4> state;
    for (std::size_t k = 0; k < 4; ++k) {
      for (const auto& start : starts) state[k].push_back(start[k]);
    }
    std::vector<std::uint64_t> mask = moving;
    move(dynamics,
         {{state[0].data(), state[1].data(), state[2].data(), state[3].data()},
          torque.data(),
          tolerance.data(),
          mask.data()},
         kSize);
    int n_goals = 0;
    for (std::size_t i = 0; i < kSize; ++i) {
      One::State expected = starts[i];
      const bool goal =
          dynamics.integrate<One>(expected, torque[i], config.goal_velocity_1 * tolerance[i],
                                  config.goal_velocity_2 * tolerance[i], moving[i] != 0);
      ASSERT_EQ(mask[i], goal ? ~std::uint64_t{0} : 0) << i;
      n_goals += goal;
      for (std::size_t k = 0; k < 4; ++k) {
        ASSERT_EQ(std::bit_cast<std::uint64_t>(state[k][i]),
                  std::bit_cast<std::uint64_t>(expected[k]))
            << i;
      }
    }
    EXPECT_GT(n_goals, 100);
  };
  sdnn::testing::on_every_instruction_set([&](auto level) {
    SCOPED_TRACE(level);
    check(move_acrobots);
  });
#if SDNN_LANES
  check(move_eight);
#endif
}

}  // namespace
}  // namespace sdnn::environments
