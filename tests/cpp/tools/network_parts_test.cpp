#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>

#include "tools/timings.hpp"

namespace sdnn::tools {
namespace {

using approximators::SDNNC;

constexpr int kActive = 30;  // n', the units of a window, which are all that a correction changes

SDNNC small_network() {
  return SDNNC(
      {.n_inputs = 3, .n_pattern_units = 40, .n_hidden_units = 100, .n_active_units = kActive}, 1);
}

TEST(NetworkParts, ATimedCorrectionChangesTheRequestedNumberOfUnits) {
  NetworkParts parts(small_network(), 1);
  constexpr int kCorrected = 6;
  parts.time_corrections(/*n_repetitions=*/1, kCorrected);
  int n_changed = 0;
  const SDNNC before = small_network();
  for (std::size_t i = 0; i < 100; ++i) {
    n_changed += parts.network().hidden_layer().threshold(i) != before.hidden_layer().threshold(i);
  }
  EXPECT_EQ(n_changed, kCorrected);
}

// A new state needs a full pass over the weights, whose time is to be measured.
TEST(NetworkParts, AlmostAllNewStatesOfThePapersSizesTakeFullPasses) {
  NetworkParts parts(SDNNC({.n_inputs = 6}, 1), 1);
  constexpr int kStates = 200;
  parts.time_values(kStates);
  EXPECT_GE(parts.workspace().cache().counts().full, kStates - 5U);
}

TEST(NetworkParts, RefusesImpossibleNumbers) {
  NetworkParts parts(small_network(), 1);
  EXPECT_THROW(parts.time_values(-1), std::invalid_argument);
  EXPECT_THROW(parts.time_corrections(1, 0), std::invalid_argument);
  EXPECT_THROW(parts.time_corrections(1, kActive + 1), std::invalid_argument);
  EXPECT_THROW(parts.time_selections(1, /*n_selections=*/0, 5), std::invalid_argument);
  EXPECT_THROW(parts.time_selections(1, 1, kActive + 1), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::tools
