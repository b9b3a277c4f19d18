#include "tools/plain_rbf_network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "approximators/with_workspace.hpp"
#include "sdnn/agents/agent.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/action_value.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::tools {
namespace {

using approximators::RBFNetwork;
using approximators::RBFNetworkConfig;

static_assert(approximators::ActionValue<PlainRBFNetwork>);
static_assert(agents::Agent<agents::QLearning<PlainRBFNetwork>>);

using Plain = testing::WithWorkspace<PlainRBFNetwork>;
using Factored = testing::WithWorkspace<RBFNetwork>;

TEST(PlainRBFNetwork, LearnsLikeTheFactoredNetwork) {
  const RBFNetworkConfig config = {.n_inputs = 3, .n_actions = 17};
  Factored factored(config);
  Plain plain(config);
  std::vector<double> expected(17), out(17);
  for (int i = 1; i <= 50; ++i) {
    const std::vector<double> state = {0.02 * i, 1.0 - 0.01 * i, 0.3};
    const auto action = static_cast<std::size_t>(i % 17);
    factored.values(state, expected);
    plain.values(state, out);
    for (std::size_t a = 0; a < 17; ++a) EXPECT_NEAR(out[a], expected[a], 1e-11);
    EXPECT_EQ(plain.value(state, action), factored.value(state, action));
    factored.update(state, action, 0.5 * i);
    plain.update(state, action, 0.5 * i);
  }
  EXPECT_TRUE(std::ranges::equal(plain.network().weights(), factored.weights()));
}

/// A network that has learned random targets in [-10, 10], so that its weights differ.
Plain taught(const RBFNetworkConfig& config, int n_corrections) {
  Plain network(config);
  core::Random random(7, core::Stream::weights);
  for (int i = 0; i < n_corrections; ++i) {
    std::vector<double> state(network.n_inputs());
    for (double& x : state) x = random.uniform();
    const auto action = static_cast<std::size_t>(random.below(network.n_actions()));
    network.update(state, action, 20.0 * random.uniform() - 10.0);
  }
  return network;
}

// Compares the sum over all joint bases with the product over the dimensions.
TEST(PlainRBFNetwork, HasTheValuesOfTheFactoredNetworkAtEverySize) {
  for (const int d : {1, 2, 3, 4}) {
    for (const RBFNetworkConfig& config :
         {RBFNetworkConfig{.n_inputs = d, .n_actions = 17},
          RBFNetworkConfig{.n_inputs = d, .n_bases = 3, .n_actions = 5, .width = 0.4},
          RBFNetworkConfig{
              .n_inputs = d, .n_bases = 5, .n_actions = 2, .width = 0.1, .gradient_rate = 1.0}}) {
      Plain plain = taught(config, 300);
      Factored factored(plain.network());
      double largest = 0.0;
      for (const double w : factored.weights()) largest = std::max(largest, std::abs(w));
      ASSERT_GT(largest, 0.0);
      core::Random random(2, core::Stream::ties);
      std::vector<double> expected(plain.n_actions()), out(plain.n_actions());
      for (int i = 0; i < 20; ++i) {
        std::vector<double> state(plain.n_inputs());
        for (double& x : state) x = random.uniform();
        factored.values(state, expected);
        plain.values(state, out);
        for (std::size_t a = 0; a < out.size(); ++a) {
          EXPECT_NEAR(out[a], expected[a], 1e-12 * largest);
          EXPECT_EQ(factored.value(state, a), expected[a]);
        }
      }
    }
  }
}

}  // namespace
}  // namespace sdnn::tools
