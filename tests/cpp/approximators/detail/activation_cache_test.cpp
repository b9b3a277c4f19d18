#include "sdnn/approximators/detail/activation_cache.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "approximators/with_workspace.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::approximators {
namespace {

// A walk with repeated states, small steps and jumps, with corrections in between: potentials are
// found in the cache, computed from those of a neighbour, or in full, always with equal integers.
TEST(ActivationCache, CachedPotentialsEqualThoseOfAFullPass) {
  const SDNNCConfig config{.n_pattern_units = 90, .n_hidden_units = 130, .n_active_units = 50};
  testing::WithWorkspace<SDNNC> network(config, 3);
  core::Random random(5, core::Stream::sensor_noise);
  std::vector<double> centre(4), state(4), values(network.n_actions());
  std::vector<std::int32_t> potentials(network.hidden_layer().n_units());
  for (int step = 0; step < 6000; ++step) {
    if (step % 150 == 0) {
      for (double& x : centre) x = random.uniform();
    }
    const double noise = step % 3 == 0 ? 0.0 : 0.02;
    for (std::size_t i = 0; i < 4; ++i) {
      state[i] = std::clamp(centre[i] + noise * random.normal(), 0.0, 1.0);
    }
    network.values(state, values);
    network.potentials(state, potentials);
    for (std::size_t action = 0; action < values.size(); ++action) {
      const auto first = potentials.begin() + static_cast<std::ptrdiff_t>(action);
      const auto n_firing =
          std::count_if(first, first + config.n_active_units, [](auto h) { return h > 0; });
      ASSERT_EQ(values[action], network.output_scale()(static_cast<int>(n_firing)));
    }
    if (random.below(3) != 0) {
      network.update(state, random.below(values.size()), 20.0 * random.uniform() - 10.0);
    }
  }
  const auto& counts = network.own_workspace().cache().counts();
  // All three ways were taken often.
  EXPECT_GT(counts.exact, 1000U);
  EXPECT_GT(counts.neighbour, 1000U);
  EXPECT_GT(counts.full, 20U);
}

TEST(ActivationCache, IsInvalidatedBySettingParameters) {
  const SDNNCConfig config{.n_pattern_units = 10, .n_hidden_units = 20, .n_active_units = 10};
  testing::WithWorkspace<SDNNC> network(config, 1);
  const std::vector<double> state = {0.1, 0.2, 0.3, 0.4};
  EXPECT_EQ(network.value(state, 0), 0.0);
  // 20 units; 4 * 3 pairs of inputs have 10 columns each. All potentials are 0 - (-1) = 1, so that
  // all units fire, which stands for the highest value.
  network.set_parameters(std::vector<std::int32_t>(20 * 120, 0), std::vector<std::int32_t>(20, -1));
  EXPECT_EQ(network.value(state, 0), config.q_high);
}

}  // namespace
}  // namespace sdnn::approximators
