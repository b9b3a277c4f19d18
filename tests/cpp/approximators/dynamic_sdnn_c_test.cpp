#include "sdnn/approximators/dynamic_sdnn_c.hpp"

#include <gtest/gtest.h>

#include <string>
#include <type_traits>
#include <vector>

#include "allocation_count.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

SDNNCConfig with_pattern_units(int m) {
  return {.n_inputs = 2, .n_pattern_units = m, .n_hidden_units = 90, .n_active_units = 30};
}

template <class Network>
std::vector<double> values(Network& network, const std::vector<double>& state) {
  std::vector<double> out(network.n_actions());
  network.values(state, out);
  return out;
}

std::size_t capacity(const DynamicSDNNC& network) {
  return network.visit([](const auto& net) {
    return std::remove_cvref_t<decltype(net.state_code().book(0)[0])>::kCapacity;
  });
}

TEST(DynamicSDNNC, TakesTheSmallestCapacityThatFits) {
  EXPECT_EQ(capacity(DynamicSDNNC(with_pattern_units(2), 1)), 256U);
  EXPECT_EQ(capacity(DynamicSDNNC(with_pattern_units(256), 1)), 256U);
  EXPECT_EQ(capacity(DynamicSDNNC(with_pattern_units(257), 1)), 1024U);
  EXPECT_EQ(capacity(DynamicSDNNC(with_pattern_units(1025), 1)), 4096U);
  EXPECT_EQ(capacity(DynamicSDNNC(with_pattern_units(4096), 1)), 4096U);
}

// The capacity is storage alone: the same config and seed learn the same on every rung.
TEST(DynamicSDNNC, EqualsTheFixedNetworkOfAnyCapacity) {
  const SDNNCConfig config = with_pattern_units(50);
  DynamicSDNNC dynamic(config, 4);
  SDNNC<256> narrow(config, 4);
  SDNNC<4096> wide(config, 4);
  core::Random random(1, core::Stream::weights);
  for (int step = 0; step < 300; ++step) {
    const std::vector<double> state = {random.uniform(), random.uniform()};
    const std::size_t action = random.below(dynamic.n_actions());
    const double target = 40.0 * random.uniform() - 20.0;
    dynamic.correct(state, action, target);
    narrow.correct(state, action, target);
    wide.correct(state, action, target);
    EXPECT_EQ(dynamic.value(state, action), narrow.value(state, action));
    EXPECT_EQ(values(dynamic, state), values(narrow, state));
    EXPECT_EQ(values(dynamic, state), values(wide, state));
  }
  std::vector<std::int32_t> h(90), expected(90);
  dynamic.potentials(std::vector<double>{0.5, 0.5}, h);
  narrow.potentials(std::vector<double>{0.5, 0.5}, expected);
  EXPECT_EQ(h, expected);
}

TEST(DynamicSDNNC, CopiesAreIndependent) {
  DynamicSDNNC original(with_pattern_units(50), 4);
  DynamicSDNNC copy = original;
  const std::vector<double> state = {0.3, 0.8};
  const std::vector<double> before = values(original, state);
  for (int i = 0; i < 20; ++i) copy.correct(state, 7, 15.0);
  EXPECT_EQ(values(original, state), before);
  EXPECT_NE(values(copy, state), before);
}

TEST(DynamicSDNNC, ActingAndLearningAllocateNothing) {
  DynamicSDNNC network(with_pattern_units(300), 4);
  std::vector<double> out(network.n_actions());
  std::vector<double> state(2);
  core::Random random(2, core::Stream::weights);
  const std::size_t before = testing::allocation_count();
  for (int step = 0; step < 100; ++step) {
    for (double& value : state) value = random.uniform();
    network.values(state, out);
    network.correct(state, random.below(network.n_actions()), 10.0);
  }
  EXPECT_EQ(testing::allocation_count(), before);
}

TEST(DynamicSDNNC, NamesTheLargestCapacity) {
  try {
    DynamicSDNNC(with_pattern_units(4097), 1);
    FAIL();
  } catch (const std::length_error& error) {
    EXPECT_EQ(std::string(error.what()), "n_pattern_units must be at most 4096, got 4097");
  }
  EXPECT_THROW(DynamicSDNNC(with_pattern_units(1), 1), std::invalid_argument);
  EXPECT_THROW(DynamicSDNNC(with_pattern_units(-5), 1), std::invalid_argument);
  EXPECT_THROW(DynamicSDNNC({.n_inputs = 1}, 1), std::invalid_argument);
}

TEST(DynamicSDNNC, PassesOnWhatItHolds) {
  const DynamicSDNNC network(with_pattern_units(20), 1);
  EXPECT_EQ(network.config().n_pattern_units, 20);
  EXPECT_EQ(network.n_inputs(), 2U);
  EXPECT_EQ(network.n_actions(), 61U);
  EXPECT_EQ(network.action_code().first_unit(60), 60U);
  EXPECT_EQ(network.output_scale().u_high(), 28);
  EXPECT_EQ(network.hidden_layer().n_columns(), 40U);
}

}  // namespace
}  // namespace sdnn::approximators
