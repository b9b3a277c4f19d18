#include <gtest/gtest.h>

#include <vector>

#include "allocation_count.hpp"
#include "approximators/small_sdnn_c.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators::small_sdnn_c {
namespace {

SDNNCConfig averaging_config() {
  SDNNCConfig config = small_config();
  config.averaging_interval = 7;
  return config;
}

std::vector<double> averaged_values(Network& network, const State& state) {
  std::vector<double> out(network.n_actions());
  network.averaged_values(state, out);
  return out;
}

TEST(SDNNC, AveragingDoesNotChangeLearning) {
  Network network(small_config(), 5), averaging_network(averaging_config(), 5);
  core::Random random(1, core::Stream::weights);
  for (int t = 0; t < 400; ++t) {
    const State state = random_state(3, random);
    const std::size_t action = random.below(network.n_actions());
    const double target = 40.0 * random.uniform() - 20.0;
    network.update(state, action, target);
    averaging_network.update(state, action, target);
    if (t % 10 == 0) (void)averaged_values(averaging_network, state);
    ASSERT_EQ(values(averaging_network, state), values(network, state)) << t;
  }
  EXPECT_FALSE(network.has_average());
  EXPECT_TRUE(averaging_network.has_average());
  const State state = random_state(3, random);
  EXPECT_EQ(averaged_values(network, state), values(network, state));  // has no average
  EXPECT_NE(averaged_values(averaging_network, state), values(network, state));
}

// Weights are averaged every 7 corrections, so there is an average after 50.
TEST(SDNNC, SettingParametersRestartsTheAverage) {
  Network network(averaging_config(), 5);
  const State state = {0.2, 0.7, 0.4};
  for (int t = 0; t < 50; ++t) network.update(state, 30, 10.0);
  EXPECT_TRUE(network.has_average());
  const std::size_t n_units = 200, n_columns = network.state_code().n_columns();
  network.set_parameters(std::vector<std::int32_t>(n_units * n_columns),
                         std::vector<std::int32_t>(n_units));
  EXPECT_FALSE(network.has_average());
  EXPECT_EQ(averaged_values(network, state), values(network, state));
}

TEST(SDNNC, AveragingAllocatesNothingWhileItLearns) {
  Network network(averaging_config(), 5);
  core::Random random(1, core::Stream::weights);
  State state = random_state(3, random);
  for (int t = 0; t < 20; ++t) network.update(state, 3, 5.0);
  (void)averaged_values(network, state);
  std::vector<double> out(network.n_actions());
  const std::size_t before = testing::allocation_count();
  for (int t = 0; t < 100; ++t) {
    for (double& x : state) x = random.uniform();
    network.values(state, out);
    network.update(state, 3, 5.0);
  }
  EXPECT_EQ(testing::allocation_count(), before);
}

}  // namespace
}  // namespace sdnn::approximators::small_sdnn_c
