#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "approximators/small_sdnn_c.hpp"
#include "errors.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/coding/random_inverse.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators::small_sdnn_c {
namespace {

TEST(SDNNC, ThePapersSizesFollowFromTheDefaults) {
  const Network network({}, 1);
  EXPECT_EQ(network.n_inputs(), 4U);
  EXPECT_EQ(network.n_actions(), 601U);
  EXPECT_EQ(network.state_code().n_columns(), 4U * 3 * 200);  // of all ordered pairs of inputs
  EXPECT_EQ(network.state_code().table(0).n_bins(), 360U);
  EXPECT_EQ(network.hidden_layer().n_units(), 900U);
  EXPECT_EQ(network.output_scale().u_low(), 20);
  EXPECT_EQ(network.output_scale().u_high(), 280);
  EXPECT_EQ(Network({.n_inputs = 5}, 1).state_code().n_columns(), 5U * 4 * 200);
  EXPECT_EQ(Network({.n_inputs = 6}, 1).state_code().n_columns(), 6U * 5 * 200);
}

TEST(SDNNC, MaxPairsGivesEveryInputEquallyManyPartners) {
  const SDNNCConfig sizes{
      .n_inputs = 7, .n_pattern_units = 20, .n_hidden_units = 60, .n_active_units = 20};
  const auto partners = [&](int max_pairs) {
    SDNNCConfig config = sizes;
    config.max_pairs = max_pairs;
    const Network network(config, 3);
    std::vector<std::size_t> n_modifiers(7, 0), n_modified(7, 0);
    for (const coding::InputPair& pair : network.state_code().groups()) {
      ++n_modifiers[pair.modified];
      ++n_modified[pair.modifier];
    }
    EXPECT_EQ(n_modifiers, std::vector<std::size_t>(7, n_modifiers[0]));
    EXPECT_EQ(n_modified, n_modifiers);
    return n_modifiers[0];
  };
  // floor(max_pairs / 7), but at least 1 and at most all 6; 0 means all.
  EXPECT_EQ(partners(0), 6U);
  EXPECT_EQ(partners(1), 1U);
  EXPECT_EQ(partners(20), 2U);
  EXPECT_EQ(partners(21), 3U);
  EXPECT_EQ(partners(42), 6U);
  EXPECT_EQ(partners(1000), 6U);

  SDNNCConfig config = sizes;
  config.max_pairs = 21;
  Network network(config, 7);
  EXPECT_FALSE(
      std::ranges::equal(network.state_code().groups(), Network(config, 8).state_code().groups()));
  core::Random random(3, core::Stream::code_books);
  for (int i = 0; i < 60; ++i) {
    const State state = random_state(7, random);
    network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
    ASSERT_EQ(values(network, state), values_by_masks(network, state));
  }
  // The number of all pairs gives the paper's code, like the default.
  config.max_pairs = 42;
  expect_equal_parameters(Network(config, 7), Network(sizes, 7));
}

std::string error_of(const SDNNCConfig& config) {
  return testing::message_of([&] { Network(config, 1); });
}

void expect_error_of(const SDNNCConfig& config, const std::string& name) {
  EXPECT_EQ(error_of(config).rfind(name + " must be ", 0), 0U) << error_of(config);
}

// 16 inputs have 16 * 15 * 4096 = 983040 columns. Each needs 2 bytes for 900 weights and 4 of a
// permutation: 1773404160 bytes. Patterns take 16 * 360 * 512 * 16 = 47185920 bytes, remembered
// potentials 844800. Messages begin with the settings behind the largest of the three parts.
TEST(SDNNC, TooLargeANetworkIsRefusedBeforeMemoryIsAllocated) {
  const auto refusal = [](const SDNNCConfig& config) {
    return testing::message_of<std::length_error>([&] { Network(config, 1); });
  };
  EXPECT_EQ(refusal({.n_inputs = 16, .n_pattern_units = 4096}),
            "max_pairs, n_hidden_units, n_pattern_units or n_inputs must be smaller: weights, "
            "patterns and remembered potentials need 1821434880 bytes, but max_table_bytes is "
            "1073741824");
  const std::string patterns = refusal({.n_anchor_patterns = 10000, .n_interpolated = 10000});
  EXPECT_TRUE(patterns.starts_with("n_interpolated, n_anchor_patterns, n_pattern_units"))
      << patterns;
  const std::string symbols = refusal({.n_symbols = {1 << 24, 0, 0, 0}});
  EXPECT_TRUE(symbols.starts_with("n_symbols, n_interpolated")) << symbols;
  const std::string potentials = refusal(
      {.n_inputs = 2, .n_pattern_units = 2, .n_hidden_units = 1 << 20, .n_active_units = 1 << 20});
  EXPECT_TRUE(potentials.starts_with("n_hidden_units or n_active_units must")) << potentials;
  const SDNNCConfig small{.n_inputs = 2,
                          .n_pattern_units = 20,
                          .n_hidden_units = 64,
                          .n_active_units = 20,
                          .max_table_bytes = 1 << 20};
  EXPECT_EQ(refusal(small), "no error");
  SDNNCConfig smaller = small;  // less memory than the network needs
  smaller.max_table_bytes = 1 << 16;
  EXPECT_NE(refusal(smaller), "no error");
}

// By default there are 4 inputs, 900 hidden units, windows of 300 of them for 601 actions, values
// from -20 to 20 for 20 to 280 firing units, and a lattice of whole numbers.
TEST(SDNNC, NamesTheFieldThatDoesNotFitTheOthers) {
  EXPECT_EQ(error_of({.n_hidden_units = 900, .n_active_units = 901}),
            "n_active_units must be in [1, 900], got 901");
  EXPECT_EQ(error_of({.circular = {true}}), "circular must be empty or one flag per input, got 1");
  EXPECT_EQ(error_of({.n_symbols = {3}}), "n_symbols must be empty or a number per input, got 1");
  EXPECT_EQ(error_of({.n_symbols = {0, -1, 0, 0}}), "n_symbols must be in [0, 16777216], got -1");
  expect_error_of({.circular = {true, false, false, false}, .n_symbols = {3, 0, 0, 0}}, "circular");
  expect_error_of({.n_actions = 602}, "n_actions");
  expect_error_of({.q_low = 20.0}, "q_high");
  expect_error_of({.u_low = 290, .u_high = 280}, "u_high");
  expect_error_of({.u_high = 301}, "u_high");
  expect_error_of({.initial_threshold = 0.5}, "initial_threshold");
  expect_error_of({.initial_weights = InitialWeights::uniform, .initial_weight_limit = 1e300},
                  "initial_weight_limit");
}

}  // namespace
}  // namespace sdnn::approximators::small_sdnn_c
