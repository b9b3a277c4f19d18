#include "sdnn/experiments/detail/plain_rbf_network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "sdnn/agents/agent.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/action_value.hpp"

namespace sdnn::experiments {
namespace {

using approximators::RBFNetwork;
using approximators::RBFNetworkConfig;

static_assert(approximators::ActionValue<PlainRBFNetwork>);
static_assert(agents::Agent<agents::QLearning<PlainRBFNetwork>>);

// d = 1, two bases at 0 and 1; a step at x = 1/2 for the middle of three actions has all four
// joint bases 1/4: each weight becomes 1/2 of 8 of 1/4 = 1, so Q = 1 everywhere.
TEST(PlainRBFNetwork, OneGradientStepByHand) {
  PlainRBFNetwork network({.n_inputs = 1, .n_bases = 2, .n_actions = 3, .gradient_rate = 0.5});
  EXPECT_EQ(network.n_inputs(), 1U);
  EXPECT_EQ(network.n_actions(), 3U);
  const std::vector<double> state = {0.5}, other = {0.2};
  network.correct(state, 1, 8.0);
  std::vector<double> out(3);
  network.values(other, out);
  for (std::size_t action = 0; action < 3; ++action) {
    EXPECT_NEAR(out[action], 1.0, 1e-15);
    EXPECT_NEAR(network.value(other, action), 1.0, 1e-15);
  }
}

TEST(PlainRBFNetwork, GivesAndLearnsWhatTheFactoredOneDoes) {
  const RBFNetworkConfig config = {.n_inputs = 3, .n_actions = 17};
  RBFNetwork factored(config);
  PlainRBFNetwork plain(config);
  std::vector<double> expected(17), out(17);
  for (int i = 1; i <= 50; ++i) {
    const std::vector<double> state = {0.02 * i, 1.0 - 0.01 * i, 0.3};
    const auto action = static_cast<std::size_t>(i % 17);
    factored.values(state, expected);
    plain.values(state, out);
    for (std::size_t a = 0; a < 17; ++a) EXPECT_NEAR(out[a], expected[a], 1e-11);
    EXPECT_EQ(plain.value(state, action), factored.value(state, action));
    factored.correct(state, action, 0.5 * i);
    plain.correct(state, action, 0.5 * i);
  }
  EXPECT_TRUE(std::ranges::equal(plain.network().weights(), factored.weights()));
}

TEST(PlainRBFNetwork, RefusesWhatTheFactoredOneRefuses) {
  EXPECT_THROW(PlainRBFNetwork({.n_bases = 1}), std::invalid_argument);
  PlainRBFNetwork network({.n_inputs = 2, .n_actions = 3});
  const std::vector<double> good = {0.1, 0.2}, bad = {0.1, 1.2};
  std::vector<double> out(3), short_out(2);
  EXPECT_THROW(network.values(bad, out), std::invalid_argument);
  EXPECT_THROW(network.values(good, short_out), std::invalid_argument);
  EXPECT_THROW((void)network.value(good, 3), std::invalid_argument);
  EXPECT_THROW(network.correct(bad, 0, 1.0), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::experiments
