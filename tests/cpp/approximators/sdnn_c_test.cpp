#include "sdnn/approximators/sdnn_c.hpp"

#include <gtest/gtest.h>

#include <bitset>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "allocation_count.hpp"
#include "approximators/with_workspace.hpp"
#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/coding/random_inverse.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::approximators {
namespace {

using Network = testing::WithWorkspace<SDNNC>;
using State = std::vector<double>;

/// The learning tests run on a smaller network, which has the same parts.
SDNNCConfig small() {
  return {.n_inputs = 3, .n_pattern_units = 50, .n_hidden_units = 200, .n_active_units = 60};
}

State random_state(std::size_t n_inputs, core::Random& random) {
  State state(n_inputs);
  for (double& value : state) value = random.uniform();
  return state;
}

std::vector<double> values(Network& network, const State& state) {
  std::vector<double> out(network.n_actions());
  network.values(state, out);
  return out;
}

std::vector<std::int32_t> potentials(const Network& network, const State& state) {
  std::vector<std::int32_t> out(network.hidden_layer().n_units());
  network.potentials(state, out);
  return out;
}

/// Q(s, a) of every action from a full pass and window masks: nothing remembered, nothing sliding.
std::vector<double> values_by_masks(const Network& network, const State& state) {
  using Mask = std::bitset<1024>;
  const std::vector<std::int32_t> h = potentials(network, state);
  Mask hidden;
  for (std::size_t i = 0; i < h.size(); ++i) hidden[i] = h[i] > 0;
  const coding::ActionCode& code = network.action_code();
  std::vector<double> out(code.n_actions());
  for (std::size_t action = 0; action < code.n_actions(); ++action) {
    const Mask window = (~Mask{} >> (1024 - code.n_active_units())) << code.first_unit(action);
    out[action] = network.output_scale()(static_cast<int>((hidden & window).count()));
  }
  return out;
}

void expect_equal_parameters(const Network& a, const Network& b) {
  const HiddenLayer& p = a.hidden_layer();
  const HiddenLayer& q = b.hidden_layer();
  std::size_t n_different = 0;
  for (std::size_t i = 0; i < p.n_units(); ++i) {
    n_different += p.threshold(i) != q.threshold(i);
    for (std::size_t j = 0; j < a.state_code().n_columns(); ++j) {
      n_different += a.weight(i, j) != b.weight(i, j);
    }
  }
  EXPECT_EQ(n_different, 0U);
}

TEST(SDNNC, ThePapersSizesFollowFromTheDefaults) {
  const Network network({}, 1);
  EXPECT_EQ(network.n_inputs(), 4U);
  EXPECT_EQ(network.n_actions(), 601U);
  EXPECT_EQ(network.state_code().n_columns(), 2400U);
  EXPECT_EQ(network.state_code().table(0).n_bins(), 360U);
  EXPECT_EQ(network.hidden_layer().n_units(), 900U);
  EXPECT_EQ(network.output_scale().u_low(), 20);
  EXPECT_EQ(network.output_scale().u_high(), 280);
  EXPECT_EQ(Network({.n_inputs = 5}, 1).state_code().n_columns(), 4000U);
  EXPECT_EQ(Network({.n_inputs = 6}, 1).state_code().n_columns(), 6000U);
}

TEST(SDNNC, ThresholdsAlternateAndWeightsAreTernaryAtTheStart) {
  const Network network({}, 1);
  const HiddenLayer& p = network.hidden_layer();
  EXPECT_EQ(p.threshold(0), -200);  // unit 1 in the paper: odd, negative
  EXPECT_EQ(p.threshold(1), 200);
  std::array<double, 3> count{};
  for (std::size_t i = 0; i < p.n_units(); ++i) {
    for (std::size_t j = 0; j < network.state_code().n_columns(); ++j) {
      ++count.at(static_cast<std::size_t>(network.weight(i, j) + 1));
    }
  }
  const double n = 900.0 * 2400.0;
  EXPECT_NEAR(count[0] / n, 0.25, 0.002);
  EXPECT_NEAR(count[1] / n, 0.50, 0.002);
  EXPECT_NEAR(count[2] / n, 0.25, 0.002);
}

TEST(SDNNC, QIsExactlyZeroEverywhereAtTheStart) {
  for (const int n_inputs : {4, 6}) {
    Network network({.n_inputs = n_inputs}, 7);
    core::Random random(3, core::Stream::weights);
    const std::vector<double> zeros(601, 0.0);
    for (int i = 0; i < 150; ++i) {
      const State state = random_state(static_cast<std::size_t>(n_inputs), random);
      ASSERT_EQ(values(network, state), zeros);
    }
  }
}

TEST(SDNNC, UniformInitialWeightsStayWithinTheirLimitOnTheLattice) {
  SDNNCConfig config = small();
  config.lattice = 8;
  config.initial_weights = InitialWeights::uniform;
  config.initial_weight_limit = 0.5;
  config.initial_threshold = 10.0;
  const Network network(config, 1);
  int largest = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    EXPECT_EQ(network.hidden_layer().threshold(i), i % 2 == 0 ? -80 : 80);
    for (std::size_t j = 0; j < network.state_code().n_columns(); ++j) {
      largest = std::max(largest, std::abs(network.weight(i, j)));
    }
  }
  EXPECT_EQ(largest, 4);
}

// One correction by hand: d subsets, in each the nearest unit, moved by lattice * (|x|^2 + 1).
TEST(SDNNC, OneCorrectionMovesOneUnitOfEachSubset) {
  SDNNCConfig config = small();
  config.lattice = 4;
  config.initial_threshold = 2.0;
  Network network(config, 5);
  const State state = {0.1, 0.5, 0.9};
  const std::size_t action = 11;
  const std::vector<std::int32_t> before = potentials(network, state);
  std::vector<coding::Bin> bins(3);
  network.state_code().bins_of(state, bins);
  const std::int32_t self = network.state_code().inner_product(bins, bins);

  // Three units more: three subsets of twenty, in each the inactive unit nearest to 0.
  int n_firing = 0;
  for (std::size_t i = action; i < action + 60; ++i) n_firing += before[i] > 0;
  std::vector<std::int32_t> expected = before;
  for (std::size_t subset = 0; subset < 3; ++subset) {
    std::size_t best = 0;
    std::int32_t nearest = INT32_MAX;
    for (std::size_t i = action + 20 * subset; i < action + 20 * (subset + 1); ++i) {
      if (before[i] <= 0 && -before[i] < nearest) {
        nearest = -before[i];
        best = i;
      }
    }
    expected[best] += 4 * (self + 1);
  }
  network.update(state, action, network.output_scale()(n_firing + 3));
  EXPECT_EQ(potentials(network, state), expected);
  EXPECT_EQ(network.value(state, action), network.output_scale()(n_firing + 3));
}

TEST(SDNNC, NothingHappensWhenTheCountIsRightAlready) {
  Network network(small(), 5);
  const Network before = network;
  const State state = {0.1, 0.5, 0.9};
  network.update(state, 3, network.value(state, 3));
  network.update(state, 3, network.value(state, 3) + 0.01);  // rounds to the same count
  expect_equal_parameters(network, before);
}

// A quarter of a unit is missing: it is lost, or made up for by a whole unit, always or in a
// quarter of all cases.
TEST(SDNNC, RoundingDecidesWhatBecomesOfPartsOfAUnit) {
  const State state = {0.1, 0.5, 0.9};
  const auto moved = [&](Rounding rounding, double units, std::uint64_t seed) {
    SDNNCConfig config = small();
    config.initial_threshold = 2.0;  // less than a correction, so that each makes a unit fire
    config.rounding = rounding;
    Network network(config, seed);
    const double unit = network.output_scale()(31) - network.output_scale()(30);
    const double before = network.value(state, 3);
    network.update(state, 3, before + units * unit);
    return static_cast<int>(std::lround((network.value(state, 3) - before) / unit));
  };
  EXPECT_EQ(moved(Rounding::half_up, 0.25, 5), 0);
  EXPECT_EQ(moved(Rounding::half_up, 0.5, 5), 1);
  EXPECT_EQ(moved(Rounding::half_up, -0.5, 5), 0);
  EXPECT_EQ(moved(Rounding::away, 0.25, 5), 1);
  EXPECT_EQ(moved(Rounding::away, -0.25, 5), -1);
  EXPECT_EQ(moved(Rounding::away, 2.0, 5), 2);
  EXPECT_EQ(moved(Rounding::away, 0.0, 5), 0);
  int up = 0;
  int down = 0;
  constexpr int kNetworks = 400;
  for (std::uint64_t seed = 0; seed < kNetworks; ++seed) {
    const int rise = moved(Rounding::random, 0.25, seed);
    EXPECT_TRUE(rise == 0 || rise == 1);
    up += rise;
    down -= moved(Rounding::random, -1.75, seed);
  }
  const double sigma = std::sqrt(kNetworks * 0.25 * 0.75);
  EXPECT_NEAR(up, 0.25 * kNetworks, 5 * sigma);
  EXPECT_NEAR(down, 1.75 * kNetworks, 5 * sigma);
}

TEST(SDNNC, CorrectionsReachAnyTargetAndSaturateBeyond) {
  Network network(small(), 5);
  const State state = {0.3, 0.6, 0.2};
  for (const double target : {20.0, -20.0, 4.0, 1e300, -1e300, 0.0}) {
    for (int i = 0; i < 400; ++i) network.update(state, 70, target);
    EXPECT_NEAR(network.value(state, 70), std::clamp(target, -20.0, 20.0), 20.0 / 52);
  }
}

TEST(SDNNC, PopcountsOfWindowsEqualTheSlidingCount) {
  core::Random random(4, core::Stream::weights);
  for (const int n_actions : {0, 2, 7, 141}) {
    SDNNCConfig config = small();
    config.n_actions = n_actions;
    Network network(config, 9);
    for (int i = 0; i < 40; ++i) {
      const State state = random_state(3, random);
      network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
      EXPECT_EQ(values(network, state), values_by_masks(network, state));
    }
  }
}

/// A walk of transitions, as an agent meets them: mostly small steps, sometimes a jump.
void walk(State& state, core::Random& random) {
  if (random.below(20) == 0) {
    state = random_state(state.size(), random);
    return;
  }
  for (double& value : state) {
    value = std::clamp(value + 0.1 * (random.uniform() - 0.5), 0.0, 1.0);
  }
}

// The remembered potentials must be those of a full pass, whatever has been learned since.
TEST(SDNNC, RememberingChangesNothingOverThousandsOfLearningSteps) {
  Network remembering(small(), 2);
  Network forgetful(small(), 2);
  const State away = {0.0, 0.0, 0.0};
  const State further_away = {1.0, 1.0, 1.0};
  core::Random random(5, core::Stream::weights);
  State state = random_state(3, random);
  for (int step = 0; step < 4000; ++step) {
    const State next = [&] {
      State moved = state;
      walk(moved, random);
      return moved;
    }();
    const std::size_t action = random.below(remembering.n_actions());
    const double reward = random.below(10) == 0 ? 10.0 : -1.0;
    const auto learn = [&](Network& network, bool forget) {
      const std::vector<double> following = values(network, next);
      if (forget) {
        (void)network.value(away, 0);
        (void)network.value(further_away, 0);
      }
      network.update(
          state, action,
          0.5 * network.value(state, action) +
              0.5 * (reward + 0.9 * *std::max_element(following.begin(), following.end())));
      if (forget) {
        (void)network.value(away, 0);
        (void)network.value(further_away, 0);
      }
    };
    learn(remembering, false);
    learn(forgetful, true);
    if (step % 50 == 0) {
      ASSERT_EQ(values(remembering, next), values_by_masks(remembering, next)) << step;
      ASSERT_EQ(values(remembering, state), values_by_masks(remembering, state)) << step;
    }
    state = next;
  }
  expect_equal_parameters(remembering, forgetful);
}

TEST(SDNNC, ActingAndLearningAllocateNothing) {
  Network network({}, 1);
  network.warm_caches();
  core::Random random(6, core::Stream::weights);
  std::vector<double> out(network.n_actions());
  State state = random_state(4, random);
  const std::size_t before = testing::allocation_count();
  for (int step = 0; step < 300; ++step) {
    network.values(state, out);
    const std::size_t action = random.below(network.n_actions());
    network.update(state, action, 40.0 * random.uniform() - 20.0);
    for (double& value : state) value = random.uniform();
  }
  EXPECT_EQ(testing::allocation_count(), before);
}

// Weights that need two bytes take another way; it must not allocate on its first use either.
TEST(SDNNC, LargeWeightsAllocateNothing) {
  SDNNCConfig config = small();
  config.lattice = 64;
  config.initial_threshold = 0.0;
  Network network(config, 1);
  network.warm_caches();
  core::Random random(6, core::Stream::weights);
  std::vector<double> out(network.n_actions());
  State state = random_state(3, random);
  const std::size_t before = testing::allocation_count();
  for (int step = 0; step < 300; ++step) {
    network.values(state, out);
    network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
    for (double& value : state) value = random.uniform();
  }
  EXPECT_EQ(testing::allocation_count(), before);
  EXPECT_GT(network.hidden_layer().n_high_columns(), 1000U);
  EXPECT_EQ(values(network, state), values_by_masks(network, state));
}

TEST(SDNNC, CopiesShareNothingThatIsLearned) {
  Network original(small(), 3);
  const State state = {0.2, 0.4, 0.6};
  original.update(state, 5, 9.0);
  const std::vector<double> before = values(original, state);
  const std::vector<std::int32_t> potentials_before = potentials(original, state);
  Network copy = original;
  EXPECT_EQ(values(copy, state), before);
  expect_equal_parameters(copy, original);
  for (int i = 0; i < 100; ++i) copy.update(state, 5, -20.0);
  EXPECT_NE(values(copy, state), before);
  EXPECT_EQ(values(original, state), before);
  EXPECT_EQ(potentials(original, state), potentials_before);
  original = copy;
  EXPECT_EQ(values(original, state), values(copy, state));
}

TEST(SDNNC, ParametersCanBeMovedToAnotherNetworkOfTheSameWiring) {
  Network teacher(small(), 3);
  Network pupil(small(), 3);
  const State state = {0.2, 0.4, 0.6};
  for (int i = 0; i < 100; ++i) teacher.update(state, 5, 12.0);
  (void)pupil.value(state, 5);  // remembered: must be forgotten
  const HiddenLayer& p = teacher.hidden_layer();
  std::vector<std::int32_t> weights;
  std::vector<std::int32_t> thresholds;
  for (std::size_t i = 0; i < p.n_units(); ++i) {
    thresholds.push_back(p.threshold(i));
    for (std::size_t j = 0; j < teacher.state_code().n_columns(); ++j) {
      weights.push_back(teacher.weight(i, j));
    }
  }
  pupil.set_parameters(weights, thresholds);
  expect_equal_parameters(pupil, teacher);
  EXPECT_EQ(values(pupil, state), values(teacher, state));

  weights.back() = 1 << 20;
  thresholds.front() += 1;
  EXPECT_THROW(pupil.set_parameters(weights, thresholds), std::invalid_argument);
  expect_equal_parameters(pupil, teacher);
  weights.pop_back();
  EXPECT_THROW(pupil.set_parameters(weights, thresholds), std::invalid_argument);
}

TEST(SDNNC, TheSameSeedGivesTheSameNetworkAndAnotherSeedAnother) {
  const Network first(small(), 3), same(small(), 3), other(small(), 4);
  expect_equal_parameters(first, same);
  const auto pattern = [](const Network& network) { return network.state_code().table(1)[10]; };
  EXPECT_EQ(pattern(first), pattern(same));
  EXPECT_NE(pattern(first), pattern(other));
  EXPECT_EQ(first.state_code().permutation(0, 2), same.state_code().permutation(0, 2));
  EXPECT_NE(first.state_code().permutation(0, 2), other.state_code().permutation(0, 2));
  EXPECT_NE(first.state_code().permutation(0, 2), first.state_code().permutation(2, 0));
}

TEST(SDNNC, OddSizesLearnAsWell) {
  core::Random random(8, core::Stream::weights);
  for (const SDNNCConfig& config : {SDNNCConfig{.n_inputs = 2,
                                                .n_pattern_units = 2,
                                                .n_anchor_patterns = 2,
                                                .n_interpolated = 0,
                                                .n_hidden_units = 2,
                                                .n_active_units = 1},
                                    SDNNCConfig{.n_inputs = 5,
                                                .n_pattern_units = 37,
                                                .n_anchor_patterns = 4,
                                                .n_interpolated = 10,
                                                .n_hidden_units = 101,
                                                .n_active_units = 33},
                                    SDNNCConfig{.n_inputs = 2,
                                                .n_pattern_units = 256,
                                                .circular = {true, false},
                                                .n_hidden_units = 65,
                                                .n_active_units = 64,
                                                .n_actions = 2},
                                    SDNNCConfig{.n_inputs = 3,
                                                .n_pattern_units = 65,
                                                .balanced_anchors = false,
                                                .n_hidden_units = 1000,
                                                .n_active_units = 1000,
                                                .lattice = 64}}) {
    Network network(config, 1);
    for (int i = 0; i < 60; ++i) {
      const State state = random_state(network.n_inputs(), random);
      network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
      ASSERT_EQ(values(network, state), values_by_masks(network, state));
    }
  }
}

// Any coding's patterns will do: here angles, symbols and a chain, with as many bins as each has.
TEST(SDNNC, LearnsOverPatternsOfAnyCoding) {
  core::Random random(3, core::Stream::code_books);
  std::vector<coding::PatternTable> tables;
  tables.push_back(coding::anchor_patterns({.n_units = 50, .circular = true}, random));
  tables.push_back(coding::anchor_patterns(
      {.n_units = 50, .n_anchor_patterns = 5, .n_interpolated = 0}, random));
  tables.push_back(coding::random_inverse_patterns({50, 100, 1}, random));
  Network network(small(), tables, 7);
  EXPECT_EQ(network.state_code().table(1).n_bins(), 4U);
  for (int i = 0; i < 60; ++i) {
    const State state = random_state(3, random);
    network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
    ASSERT_EQ(values(network, state), values_by_masks(network, state));
  }
  EXPECT_EQ(values(network, {0.1, 0.0, 0.5}), values(network, {0.1, 0.24, 0.5}));  // one symbol
  EXPECT_THROW(Network({.n_inputs = 4}, tables, 7), std::invalid_argument);
  EXPECT_THROW(Network({.n_inputs = 3}, tables, 7), std::invalid_argument);  // 200 units
}

TEST(SDNNC, PairsOfInputsAreAnEvenShareOfAll) {
  const SDNNCConfig sizes{
      .n_inputs = 7, .n_pattern_units = 20, .n_hidden_units = 60, .n_active_units = 20};
  const auto partners = [&](int max_pairs) {
    SDNNCConfig config = sizes;
    config.max_pairs = max_pairs;
    const Network network(config, 3);
    std::vector<std::size_t> n_modifiers(7, 0);
    std::vector<std::size_t> n_modified(7, 0);
    for (const coding::InputPair& pair : network.state_code().groups()) {
      ++n_modifiers[pair.modified];
      ++n_modified[pair.modifier];
    }
    EXPECT_EQ(n_modifiers, std::vector<std::size_t>(7, n_modifiers[0]));
    EXPECT_EQ(n_modified, n_modifiers);
    return n_modifiers[0];
  };
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
  // All pairs are the paper's code, however they were asked for.
  config.max_pairs = 42;
  expect_equal_parameters(Network(config, 7), Network(sizes, 7));
}

TEST(SDNNC, SymbolsHavePatternsOfTheirOwn) {
  SDNNCConfig config = small();
  config.n_symbols = {4, 0, 7};
  Network network(config, 7);
  const coding::StateCode& code = network.state_code();
  EXPECT_EQ(code.table(0).n_bins(), 4U);
  EXPECT_EQ(code.table(1), Network(small(), 7).state_code().table(1));  // a number is as it was
  EXPECT_EQ(code.table(2).n_bins(), 7U);
  core::Random random(3, core::Stream::code_books);
  for (int i = 0; i < 60; ++i) {
    const auto symbol = static_cast<double>(random.below(4));
    const State state = {(symbol + 0.5) / 4.0, random.uniform(), random.uniform()};
    network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
    ASSERT_EQ(values(network, state), values_by_masks(network, state));
    const State same = {(symbol + 0.9) / 4.0, state[1], state[2]};
    ASSERT_EQ(values(network, same), values(network, state));
  }
}

TEST(SDNNC, ARateMixesTargetAndValue) {
  Network one(small(), 5);
  Network other(small(), 5);
  const State state = {0.3, 0.6, 0.2};
  for (int i = 0; i < 50; ++i) {
    one.update(state, 70, 12.0, 0.25);
    other.update(state, 70, 0.75 * other.value(state, 70) + 0.25 * 12.0);
  }
  expect_equal_parameters(one, other);
  for (const double rate : {0.0, -0.5, 1.5, std::nan("")}) {
    EXPECT_THROW(one.update(state, 70, 1.0, rate), std::invalid_argument);
  }
  expect_equal_parameters(one, other);
}

TEST(SDNNC, WarmCachesChangeNothing) {
  Network cold(small(), 5);
  Network warm = cold;
  warm.warm_caches();
  EXPECT_EQ(warm.own_workspace().cache().counts().full, 0U);
  const State state = {0.3, 0.6, 0.2};
  for (Network* const network : {&cold, &warm}) network->update(state, 70, 12.0);
  expect_equal_parameters(cold, warm);
  EXPECT_EQ(values(cold, state), values(warm, state));
}

TEST(SDNNC, TheEndsOfTheUnitIntervalAreStates) {
  Network network(small(), 1);
  EXPECT_EQ(values(network, {0.0, 0.0, 0.0}).size(), 141U);
  EXPECT_EQ(values(network, {1.0, 1.0, 1.0}), values(network, {0.9999, 0.9999, 0.9999}));
  EXPECT_EQ(values(network, {-0.0, 0.0, 0.0}), values(network, {0.0, 0.0, 0.0}));
}

std::string message(const SDNNCConfig& config) {
  try {
    Network(config, 1);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

void expect_named(const SDNNCConfig& config, const std::string& name) {
  EXPECT_EQ(message(config).rfind(name + " must be ", 0), 0U) << message(config);
}

TEST(SDNNC, TooLargeANetworkIsRefusedBeforeMemoryIsAskedFor) {
  const auto refusal = [](const SDNNCConfig& config) -> std::string {
    try {
      Network(config, 1);
    } catch (const std::length_error& error) {
      return error.what();
    }
    return "no error";
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
  SDNNCConfig smaller = small;
  smaller.max_table_bytes = 1 << 16;
  EXPECT_NE(refusal(smaller), "no error");
}

TEST(SDNNC, NamesTheFieldThatIsImpossible) {
  const double nan = std::nan("");
  EXPECT_EQ(message({.n_hidden_units = 900, .n_active_units = 901}),
            "n_active_units must be in [1, 900], got 901");
  EXPECT_EQ(message({.n_inputs = 1}), "n_inputs must be in [2, 1024], got 1");
  EXPECT_EQ(message({.circular = {true}}), "circular must be empty or one flag per input, got 1");
  EXPECT_EQ(message({.max_pairs = -1}), "max_pairs must be in [0, 1048576], got -1");
  EXPECT_EQ(message({.n_symbols = {3}}), "n_symbols must be empty or a number per input, got 1");
  EXPECT_EQ(message({.n_symbols = {0, -1, 0, 0}}), "n_symbols must be in [0, 16777216], got -1");
  expect_named({.circular = {true, false, false, false}, .n_symbols = {3, 0, 0, 0}}, "circular");
  expect_named({.n_pattern_units = 1}, "n_pattern_units");
  expect_named({.n_anchor_patterns = 1}, "n_anchor_patterns");
  expect_named({.n_interpolated = -1}, "n_interpolated");
  expect_named({.n_hidden_units = 0}, "n_hidden_units");
  expect_named({.n_actions = 602}, "n_actions");
  expect_named({.n_actions = -1}, "n_actions");
  expect_named({.q_low = 20.0}, "q_high");
  expect_named({.q_low = nan}, "q_low");
  expect_named({.u_low = -1}, "u_low");
  expect_named({.u_low = 290, .u_high = 280}, "u_high");
  expect_named({.u_high = 301}, "u_high");
  expect_named({.learning_coefficient = 0.0}, "learning_coefficient");
  expect_named({.learning_coefficient = nan}, "learning_coefficient");
  expect_named({.lattice = 0}, "lattice");
  expect_named({.lattice = 65}, "lattice");
  expect_named({.initial_threshold = -1.0}, "initial_threshold");
  expect_named({.initial_threshold = 0.5}, "initial_threshold");
  expect_named({.initial_threshold = nan}, "initial_threshold");
  expect_named({.initial_weight_limit = nan}, "initial_weight_limit");
  expect_named({.initial_weights = InitialWeights::uniform, .initial_weight_limit = 1e300},
               "initial_weight_limit");
}

TEST(SDNNC, ABadArgumentChangesNothing) {
  Network network(small(), 1);
  const Network before = network;
  const State good = {0.1, 0.2, 0.3};
  for (const double bad :
       {std::nan(""), -1e-300, 1.0000001, std::numeric_limits<double>::infinity()}) {
    const State state = {0.1, bad, 0.3};
    EXPECT_THROW((void)network.value(state, 0), std::invalid_argument);
    EXPECT_THROW(network.update(state, 0, 1.0), std::invalid_argument);
    EXPECT_THROW((void)values(network, state), std::invalid_argument);
    EXPECT_THROW((void)potentials(network, state), std::invalid_argument);
  }
  EXPECT_THROW(network.update(good, 0, std::nan("")), std::invalid_argument);
  EXPECT_THROW(network.update(good, 141, 1.0), std::invalid_argument);
  EXPECT_THROW((void)network.value(good, 141), std::invalid_argument);
  EXPECT_THROW((void)network.value(State{0.1, 0.2}, 0), std::invalid_argument);
  std::vector<double> short_row(140);
  EXPECT_THROW(network.values(good, short_row), std::invalid_argument);
  expect_equal_parameters(network, before);
  EXPECT_EQ(values(network, good), values_by_masks(network, good));
}

TEST(SDNNC, AnotherRangeMovesValuesButNotTheirPlaceInIt) {
  Network network(small(), 1);
  core::Random random(6, core::Stream::ties);
  const State state = random_state(3, random);
  network.update(state, 3, 9.0);
  const std::vector<double> before = values(network, state);
  const double low = network.output_scale().q_low(), high = network.output_scale().q_high();
  network.set_output_range(100.0, 300.0);
  const std::vector<double> after = values(network, state);
  for (std::size_t a = 0; a < before.size(); ++a) {
    EXPECT_NEAR((after[a] - 100.0) / 200.0, (before[a] - low) / (high - low), 1e-12);
    EXPECT_EQ(after[a], network.value(state, a));
  }
  for (const auto& [bad_low, bad_high] : {std::pair(1.0, 1.0), std::pair(std::nan(""), 2.0),
                                          std::pair(-1e302, 1.0), std::pair(0.0, 1e302)}) {
    EXPECT_THROW(network.set_output_range(bad_low, bad_high), std::invalid_argument);
  }
  EXPECT_EQ(values(network, state), after);
  network.set_output_range(low, high);
  EXPECT_EQ(values(network, state), before);
}

// 30 units for values from 0 to 30; Q = 15 everywhere at the start.
TEST(SDNNC, CountsWhatBecomesOfCorrections) {
  Network network({.n_inputs = 2,
                   .n_pattern_units = 40,
                   .n_hidden_units = 60,
                   .n_active_units = 30,
                   .q_low = 0.0,
                   .q_high = 30.0,
                   .u_low = 0,
                   .u_high = 30},
                  1);
  const State state = {0.2, 0.7};
  const auto expect_counts = [&network](unsigned changed, unsigned rounded, unsigned outside) {
    EXPECT_EQ(network.correction_counts().changed, changed);
    EXPECT_EQ(network.correction_counts().rounded_away, rounded);
    EXPECT_EQ(network.correction_counts().out_of_range, outside);
  };
  ASSERT_EQ(network.value(state, 0), 15.0);
  network.update(state, 0, 15.0);
  expect_counts(0, 0, 0);  // nothing was wanted
  network.update(state, 0, 15.4);
  expect_counts(0, 1, 0);
  network.update(state, 0, 16.0);
  expect_counts(1, 1, 0);
  network.update(state, 0, 31.0);
  expect_counts(2, 1, 1);
}

SDNNCConfig averaging() {
  SDNNCConfig config = small();
  config.averaging_interval = 7;
  return config;
}

std::vector<double> averaged_values(Network& network, const State& state) {
  std::vector<double> out(network.n_actions());
  network.averaged_values(state, out);
  return out;
}

TEST(SDNNC, AveragingDoesNotTouchLearning) {
  Network network(small(), 5), averaging_one(averaging(), 5);
  core::Random random(1, core::Stream::weights);
  for (int t = 0; t < 400; ++t) {
    const State state = random_state(3, random);
    const std::size_t action = random.below(network.n_actions());
    const double target = 40.0 * random.uniform() - 20.0;
    network.update(state, action, target);
    averaging_one.update(state, action, target);
    if (t % 10 == 0) (void)averaged_values(averaging_one, state);
    ASSERT_EQ(values(averaging_one, state), values(network, state)) << t;
  }
  EXPECT_FALSE(network.has_average());
  EXPECT_TRUE(averaging_one.has_average());
  const State state = random_state(3, random);
  EXPECT_EQ(averaged_values(network, state), values(network, state));  // as there is none
  EXPECT_NE(averaged_values(averaging_one, state), values(network, state));
}

TEST(SDNNC, AveragedValuesAreThoseOfTheAveragedWeights) {
  Network network(averaging(), 5), other(small(), 5);
  core::Random random(1, core::Stream::weights);
  const std::size_t n_columns = network.state_code().n_columns();
  for (int t = 0; t < 300; ++t) {
    const State state = random_state(3, random);
    EXPECT_EQ(network.has_average(), t >= 7);
    network.update(state, random.below(network.n_actions()), 40.0 * random.uniform() - 20.0);
    if (t % 20 != 8) continue;
    std::vector<std::int32_t> weights, thresholds;
    for (std::size_t unit = 0; unit < 200; ++unit) {
      thresholds.push_back(network.averaged_threshold(unit));
      for (std::size_t j = 0; j < n_columns; ++j) {
        weights.push_back(network.averaged_weight(unit, j));
      }
    }
    other.set_parameters(weights, thresholds);
    for (int i = 0; i < 5; ++i) {
      const State asked = random_state(3, random);
      ASSERT_EQ(averaged_values(network, asked), values(other, asked)) << t;
    }
  }
}

// Random targets from -5 to 15: the value is the last one, that of the average near their median.
TEST(SDNNC, TheAverageStillsWhatSwings) {
  Network network(averaging(), 5);
  core::Random random(2, core::Stream::weights);
  const State state = {0.2, 0.7, 0.4};
  double furthest = 0.0;
  for (int t = 0; t < 6000; ++t) {
    network.update(state, 30, 20.0 * random.uniform() - 5.0);
    if (t < 1000 || t % 50 != 0) continue;
    furthest = std::max(furthest, std::abs(network.value(state, 30) - 5.0));
    ASSERT_LT(std::abs(averaged_values(network, state)[30] - 5.0), 5.0) << t;
  }
  EXPECT_GT(furthest, 9.0);
}

TEST(SDNNC, OtherParametersBeginAnotherAverage) {
  Network network(averaging(), 5);
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
  Network network(averaging(), 5);
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

TEST(SDNNC, RefusesAStateThatDoesNotFit) {
  Network network({.n_inputs = 2,
                   .n_pattern_units = 8,
                   .n_anchor_patterns = 3,
                   .n_interpolated = 3,
                   .n_hidden_units = 12,
                   .n_active_units = 6},
                  1);
  testing::expect_that_damage_is_refused(network);
  const core::State good = core::state_of(network);
  EXPECT_EQ(good.at("weights").shape, (std::vector<std::size_t>{12, 16}));
  const auto refused = [&](const core::State& bad, const std::string& message) {
    testing::expect_refused(network, bad, "state: " + message);
  };
  using testing::with_number;
  refused(with_number(good, "weights", std::int16_t{32767}, 100), "weights must be such that ");
  refused(with_number(good, "weights", std::int16_t{-32768}, 100), "weights must be such that ");
  refused(with_number(good, "thresholds", std::int32_t{1} << 30, 3), "thresholds must be of less");
  refused(with_number(good, "thresholds", std::numeric_limits<std::int32_t>::min(), 3),
          "thresholds must be of less");
  for (const double bad : {std::nan(""), 20.0, -std::numeric_limits<double>::infinity(), 1e302}) {
    refused(with_number(good, "output_range", bad, 0), "output_range must be such that q_");
  }
}

}  // namespace
}  // namespace sdnn::approximators
