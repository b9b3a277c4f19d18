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

// The plain network sums over all joint bases, the factored one multiplies over the dimensions.
TEST(PlainRBFNetwork, HasTheValuesOfTheFactoredNetworkAtEverySize) {
  for (const int d : {1, 2, 3, 4}) {
    for (const RBFNetworkConfig& config :
         {RBFNetworkConfig{.n_inputs = d, .n_actions = 17},
          RBFNetworkConfig{.n_inputs = d, .n_bases = 3, .n_actions = 5, .width = 0.4},
          RBFNetworkConfig{
              .n_inputs = d, .n_bases = 5, .n_actions = 2, .width = 0.1, .gradient_rate = 1.0}}) {
      Plain plain = testing::trained_at_random<Plain>(config, /*n_corrections=*/300);
      Factored factored(plain.network());
      double largest = 0.0;
      for (const double w : factored.weights()) largest = std::max(largest, std::abs(w));
      ASSERT_GT(largest, 0.0);
      core::Random random(2, core::Stream::ties);
      std::vector<double> expected(plain.n_actions()), out(plain.n_actions());
      for (int i = 0; i < 20; ++i) {
        const auto state = testing::random_state(plain.n_inputs(), random);
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
