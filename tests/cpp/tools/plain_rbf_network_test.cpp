#include "tools/plain_rbf_network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "allocation_count.hpp"
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

// d = 1, two bases at 0 and 1; a step at x = 1/2 for the middle of three actions has all four
// joint bases 1/4: each weight becomes 1/2 of 8 of 1/4 = 1, so Q = 1 everywhere.
TEST(PlainRBFNetwork, OneGradientStepByHand) {
  Plain network({.n_inputs = 1, .n_bases = 2, .n_actions = 3, .gradient_rate = 0.5});
  EXPECT_EQ(network.n_inputs(), 1U);
  EXPECT_EQ(network.n_actions(), 3U);
  const std::vector<double> state = {0.5}, other = {0.2};
  network.update(state, 1, 8.0);
  std::vector<double> out(3);
  network.values(other, out);
  for (std::size_t action = 0; action < 3; ++action) {
    EXPECT_NEAR(out[action], 1.0, 1e-15);
    EXPECT_NEAR(network.value(other, action), 1.0, 1e-15);
  }
}

TEST(PlainRBFNetwork, GivesAndLearnsWhatTheFactoredOneDoes) {
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

/// A network with weights of several sizes and signs, learned from random targets.
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

// Two algorithms: every joint basis against the product over the dimensions.
TEST(PlainRBFNetwork, AgreesWithTheFactoredOneAtEverySize) {
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

TEST(PlainRBFNetwork, ValuesAllocateNothing) {
  Plain network({.n_inputs = 3});
  const std::vector<double> state = {0.1, 0.2, 0.3};
  std::vector<double> out(601);
  const std::size_t before = testing::allocation_count();
  network.values(state, out);
  EXPECT_EQ(testing::allocation_count(), before);
}

// The bits are the same with every compiler and optimization level.
TEST(PlainRBFNetwork, KeepsItsBits) {
  Plain network = taught({.width = 1.0}, 200);
  std::uint64_t digest = 0;
  for (const double w : network.network().weights()) {
    digest = digest * 31 + std::bit_cast<std::uint64_t>(w);
  }
  std::vector<double> out(601);
  network.values(std::vector<double>{0.3, 0.1, 0.7, 0.5}, out);
  for (const double q : out) digest = digest * 31 + std::bit_cast<std::uint64_t>(q);
  EXPECT_EQ(digest, 9187274102790421898U);
}

TEST(PlainRBFNetwork, RefusesWhatTheFactoredOneRefuses) {
  EXPECT_THROW(PlainRBFNetwork({.n_bases = 1}), std::invalid_argument);
  Plain network({.n_inputs = 2, .n_actions = 3});
  const std::vector<double> good = {0.1, 0.2}, bad = {0.1, 1.2};
  std::vector<double> out(3), short_out(2);
  EXPECT_THROW(network.values(bad, out), std::invalid_argument);
  EXPECT_THROW(network.values(good, short_out), std::invalid_argument);
  EXPECT_THROW((void)network.value(good, 3), std::invalid_argument);
  EXPECT_THROW(network.update(bad, 0, 1.0), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::tools
