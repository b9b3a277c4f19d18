#include "sdnn/approximators/decoupled.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <stdexcept>
#include <vector>

#include "approximators/lookup_table.hpp"
#include "approximators/with_workspace.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::approximators {
namespace {

using testing::LookupTable;
using Indices = std::vector<std::size_t>;

constexpr std::array<double, 1> kHere = {0.25}, kThere = {0.75};

static_assert(DecoupledActionValue<Decoupled<LookupTable>>);
static_assert(DecoupledActionValue<Decoupled<SDNNC>>);
static_assert(!DecoupledActionValue<LookupTable>);

template <class Q>
using Used = testing::WithWorkspace<Decoupled<Q>>;

/// Two dimensions, of 2 and 3 actions: Q_0 = 2 and Q_1 = 6 for action (1, 2) at kHere.
Used<LookupTable> two_tables() {
  LookupTable first(1, 2, 2), second(1, 2, 3);
  first.update(kHere, 1, 2.0);
  second.update(kHere, 2, 6.0);
  return Used<LookupTable>({first, second});
}

TEST(Decoupled, TheValueIsTheMean) {
  auto q = two_tables();
  EXPECT_EQ(q.n_dimensions(), 2U);
  EXPECT_EQ(q.n_inputs(), 1U);
  EXPECT_EQ(q.part(1).n_actions(), 3U);
  EXPECT_EQ(q.value(kHere, Indices{1, 2}), 4.0);
  EXPECT_EQ(q.value(kHere, Indices{1, 0}), 1.0);
  EXPECT_EQ(q.value(kHere, Indices{0, 2}), 3.0);
  EXPECT_EQ(q.value(kThere, Indices{1, 2}), 0.0);
}

TEST(Decoupled, ACorrectionMovesEveryPartByTheErrorOfTheMean) {
  auto q = two_tables();
  q.update(kHere, Indices{1, 2}, 8.0, 0.5);                 // the error is 8 - 4
  EXPECT_EQ(q.part(0).value(kHere, 1), 4.0);                // half of 2 and half of 2 + 4
  EXPECT_EQ(q.part(1).value(kHere, 2), 8.0);                // half of 6 and half of 6 + 4
  EXPECT_EQ(q.value(kHere, Indices{1, 2}), 0.5 * (4 + 8));  // half way from 4 to 8
  EXPECT_EQ(q.part(0).value(kHere, 0), 0.0);
  EXPECT_EQ(q.part(1).value(kHere, 1), 0.0);
}

TEST(Decoupled, TheLargestValueIsTheMeanOfTheLargest) {
  core::Random random(3, core::Stream::weights);
  std::vector<LookupTable> tables(3, LookupTable(1, 2, 4));
  for (LookupTable& table : tables) {
    for (std::size_t a = 0; a < 4; ++a) {
      table.update(kHere, a, static_cast<double>(random.below(1000)));
    }
  }
  Used<LookupTable> q(tables);
  double largest = -1.0, sum = 0.0;
  for (std::size_t a = 0; a < 64; ++a) {
    largest = std::max(largest, q.value(kHere, Indices{a / 16, a / 4 % 4, a % 4}));
  }
  for (LookupTable& table : tables) {
    std::array<double, 4> values{};
    table.values(kHere, values);
    sum += *std::ranges::max_element(values);
  }
  EXPECT_EQ(largest, sum / 3.0);
}

TEST(Decoupled, HasTheRangeOfItsParts) {
  const SDNNCConfig config{
      .n_inputs = 2, .n_pattern_units = 16, .n_hidden_units = 40, .n_active_units = 20};
  Used<SDNNC> q({SDNNC(config, 1), SDNNC(config, 2)});
  q.set_output_range(-3.0, 5.0);
  for (const std::size_t d : {0U, 1U}) {
    EXPECT_EQ(q.part(d).output_scale().q_low(), -3.0);
    EXPECT_EQ(q.part(d).output_scale().q_high(), 5.0);
  }
}

TEST(Decoupled, EveryDimensionHasAnotherSeedTheFirstThatOfTheWhole) {
  EXPECT_EQ(seed_of_dimension(7, 0), 7U);
  std::set<std::uint64_t> seeds;
  for (std::size_t d = 0; d < 100; ++d) seeds.insert(seed_of_dimension(7, d));
  for (std::size_t d = 1; d < 100; ++d) seeds.insert(seed_of_dimension(8, d));
  EXPECT_EQ(seeds.size(), 199U);
}

TEST(Decoupled, RefusesWhatDoesNotFit) {
  EXPECT_THROW(Used<LookupTable>({}), std::invalid_argument);
  EXPECT_THROW(Used<LookupTable>({LookupTable(1, 2, 2), LookupTable(2, 2, 2)}),
               std::invalid_argument);
  auto q = two_tables();
  for (const Indices& bad : {Indices{}, Indices{1}, Indices{1, 2, 0}}) {
    EXPECT_THROW((void)q.value(kHere, bad), std::invalid_argument);
    EXPECT_THROW(q.update(kHere, bad, 1.0, 0.5), std::invalid_argument);
  }
  EXPECT_EQ(q.value(kHere, Indices{1, 2}), 4.0);
  const RBFNetworkConfig config{.n_inputs = 1, .n_actions = 3};
  Used<RBFNetwork> networks({RBFNetwork(config), RBFNetwork(config)});
  const core::State before = core::state_of(networks);
  for (const Indices& bad : {Indices{1, 3}, Indices{3, 1}}) {
    EXPECT_THROW(networks.update(kHere, bad, 1.0, 0.5), std::invalid_argument);
  }
  EXPECT_EQ(core::state_of(networks), before);
}

TEST(Decoupled, RestoresItsPartsOrNone) {
  const RBFNetworkConfig config{.n_inputs = 1, .n_bases = 2, .n_actions = 3};
  Used<RBFNetwork> q({RBFNetwork(config), RBFNetwork(config)});
  q.update(kHere, Indices{1, 2}, 8.0, 0.5);
  testing::expect_that_damage_is_refused(q);
  Used<RBFNetwork> other({RBFNetwork(config), RBFNetwork(config)});
  core::restore(other, core::state_of(q));
  EXPECT_EQ(other.value(kHere, Indices{1, 2}), q.value(kHere, Indices{1, 2}));
  testing::expect_refused(
      other, testing::with_number(core::state_of(q), "1.weights", testing::kInfinity, 2),
      "state: 1.weights must be finite");
}

}  // namespace
}  // namespace sdnn::approximators
