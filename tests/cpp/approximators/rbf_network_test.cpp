#include "sdnn/approximators/rbf_network.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "allocation_count.hpp"
#include "approximators/with_workspace.hpp"
#include "errors.hpp"
#include "sdnn/approximators/action_value.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::approximators {
namespace {

static_assert(ActionValue<RBFNetwork>);

using RBFWithWorkspace = testing::WithWorkspace<RBFNetwork>;

// An input with two bases at 0 and 1, of width 1: at 0 Gaussians 1 and e^-1/2, at 1/2 equal ones.
TEST(RBFNetwork, AGradientStepIsAsWorkedByHand) {
  RBFWithWorkspace network(
      {.n_inputs = 1, .n_bases = 2, .n_actions = 3, .width = 1.0, .gradient_rate = 0.5});
  EXPECT_EQ(network.n_joint_bases(), 4U);
  const std::vector<double> state = {0.5};
  // Action 0 is at the centre of the first basis of actions. The joint bases phi are products of
  // (1/2, 1/2) and (p, 1 - p), p = 1 / (1 + e^-1/2); the step adds 0.5 * (8 - 0) * phi.
  network.update(state, 0, 8.0);
  const double p = 1.0 / (1.0 + std::exp(-0.5));
  const std::vector<double> expected = {2.0 * p, 2.0 * (1.0 - p), 2.0 * p, 2.0 * (1.0 - p)};
  for (std::size_t j = 0; j < 4; ++j) EXPECT_NEAR(network.weights()[j], expected[j], 1e-15);
  // Q(x, a) does not depend on x, the action's bases mix (2 p, 2 (1 - p)).
  for (const double x : {0.0, 0.3, 1.0}) {
    const std::vector<double> at = {x};
    EXPECT_NEAR(network.value(at, 0), 2.0 * (p * p + (1.0 - p) * (1.0 - p)), 1e-15);
    EXPECT_NEAR(network.value(at, 1), 1.0, 1e-15);
    EXPECT_NEAR(network.value(at, 2), 4.0 * p * (1.0 - p), 1e-15);
  }
}

// With equal weights of 5, sums over normalized bases are 5 everywhere.
TEST(RBFNetwork, TheBasesSumToOne) {
  for (const double width : {0.1, 1.0, 100.0}) {
    RBFWithWorkspace network({.n_inputs = 3, .n_actions = 11, .width = width});
    network.set_weights(std::vector<double>(256, 5.0));  // 4^4 joint bases of 3 inputs, the action
    core::Random random(1, core::Stream::ties);
    std::vector<double> out(11);
    for (int i = 0; i < 100; ++i) {
      const auto state = testing::random_state(3, random);
      network.values(state, out);
      for (const double value : out) EXPECT_NEAR(value, 5.0, 1e-13);
    }
  }
}

// The weights' order is that of the bases of input 0, input 1 and the action; sums are computed in
// this order, so that the bits are equal.
TEST(RBFNetwork, ValuesAreSumsInTheOrderOfTheBases) {
  for (const int n_bases : {2, 3, 4, 7}) {
    RBFWithWorkspace network = testing::trained_at_random<RBFWithWorkspace>(
        RBFNetworkConfig{.n_inputs = 2, .n_bases = n_bases, .n_actions = 9}, 100);
    const std::vector<double> state = {0.25, 0.8};
    std::vector<double> out(9);
    network.values(state, out);
    const auto bases = [n_bases](double x) {  // widths in distances of centres
      std::vector<double> gaussians;
      double total = 0.0;
      for (int k = 0; k < n_bases; ++k) {
        const double distance = (x * (n_bases - 1) - k) / RBFNetworkConfig{}.width;
        gaussians.push_back(core::exp(-0.5 * distance * distance));
        total += gaussians.back();
      }
      for (double& basis : gaussians) basis /= total;
      return gaussians;
    };
    const auto first = bases(state[0]), second = bases(state[1]);
    const auto n = static_cast<std::size_t>(n_bases);
    std::vector<double> sums(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t b = 0; b < n; ++b) {
          sums[b] += first[i] * second[j] * network.weights()[(i * n + j) * n + b];
        }
      }
    }
    for (std::size_t action = 0; action < 9; ++action) {
      const auto of_action = bases(static_cast<double>(action) / 8.0);
      double q = 0.0;
      for (std::size_t b = 0; b < n; ++b) q += of_action[b] * sums[b];
      EXPECT_EQ(out[action], q);
      EXPECT_EQ(network.value(state, action), q);
    }
  }
}

// The digests were recorded once; the bits are the same with every compiler, optimization level and
// instruction set.
TEST(RBFNetwork, KeepsItsBits) {
  const auto digest_of = [](const RBFNetworkConfig& config) {
    RBFWithWorkspace network = testing::trained_at_random<RBFWithWorkspace>(config, 200);
    std::uint64_t digest = 0;
    for (const double w : network.weights()) digest = digest * 31 + std::bit_cast<std::uint64_t>(w);
    std::vector<double> out(601);
    network.values(std::vector<double>{0.3, 0.1, 0.7, 0.5}, out);
    for (const double q : out) digest = digest * 31 + std::bit_cast<std::uint64_t>(q);
    return digest;
  };

  EXPECT_EQ(digest_of({.width = 1.0}), 14708188747772810561U);
  EXPECT_EQ(digest_of({.n_bases = 3, .width = 1.0}), 12897390240334898970U);
}

TEST(RBFNetwork, AStepAllocatesNothing) {
  for (const int n_bases : {3, 4}) {
    RBFWithWorkspace network({.n_inputs = 5, .n_bases = n_bases});
    const std::vector<double> state = {0.1, 0.2, 0.3, 0.4, 0.5};
    std::vector<double> out(601);
    const std::size_t before = testing::allocation_count();
    network.values(state, out);
    network.update(state, 7, 1.0, 0.5);
    (void)network.value(state, 7);
    EXPECT_EQ(testing::allocation_count(), before);
  }
}

std::string size_error_of(const RBFNetworkConfig& config) {
  return testing::message_of<std::length_error>([&] { RBFWithWorkspace network(config); });
}

TEST(RBFNetwork, RefusesTooManyBasesBeforeItAllocatesMemory) {
  EXPECT_EQ(size_error_of({.n_inputs = 13}),
            "n_bases or n_inputs must be smaller: a table of 4^14 = 268435456 joint bases needs "
            "2147483648 bytes, but max_table_bytes is 1073741824");
  EXPECT_EQ(size_error_of({.n_inputs = 62, .max_table_bytes = UINT64_MAX}),
            "n_bases or n_inputs must be smaller: a table of 4^63 joint bases needs 2^64 bytes or "
            "more, but max_table_bytes is 18446744073709551615");
  EXPECT_EQ(
      size_error_of({.n_inputs = 1, .n_bases = 8000, .n_actions = 1 << 20}),
      "n_actions or n_bases must be smaller: the bases of all actions need 67108864000 bytes, "
      "but max_table_bytes is 1073741824");
}

TEST(RBFNetwork, RefusesBadArgumentsAndChangesNothing) {
  RBFWithWorkspace network = testing::trained_at_random<RBFWithWorkspace>(
      RBFNetworkConfig{.n_inputs = 2, .n_actions = 3}, 10);
  const std::vector<double> weights(network.weights().begin(), network.weights().end());
  const std::vector<double> good = {0.1, 0.2}, big = {0.1, 1.2};
  std::vector<double> out(3), short_out(2);
  EXPECT_THROW(network.set_weights(std::vector<double>(63)), std::invalid_argument);  // not 4^3
  EXPECT_THROW(network.values(big, out), std::invalid_argument);
  EXPECT_THROW(network.values(good, short_out), std::invalid_argument);
  EXPECT_THROW((void)network.value(good, 3), std::invalid_argument);
  EXPECT_THROW(network.update(big, 0, 1.0), std::invalid_argument);
  EXPECT_THROW(network.update(good, 3, 1.0), std::invalid_argument);
  EXPECT_THROW(network.update(good, 0, std::nan("")), std::invalid_argument);
  EXPECT_THROW(network.update(good, 0, 1.0, 0.0), std::invalid_argument);
  EXPECT_THROW(network.update(good, 0, 1.0, 1.5), std::invalid_argument);
  EXPECT_THROW(network.update(good, 0, 1.0, std::nan("")), std::invalid_argument);
  // The step towards an infinite target is beyond the limit of 1e305.
  EXPECT_THROW(network.update(good, 0, testing::kInfinity), std::overflow_error);
  EXPECT_TRUE(std::ranges::equal(network.weights(), weights));
}

}  // namespace
}  // namespace sdnn::approximators
