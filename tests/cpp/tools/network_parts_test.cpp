#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>

#include "tools/timings.hpp"

namespace sdnn::tools {
namespace {

using approximators::SDNNC;

SDNNC small_network() {
  return SDNNC({.n_inputs = 3, .n_pattern_units = 40, .n_hidden_units = 100, .n_active_units = 30},
               1);
}

int n_different_weights(const SDNNC& a, const SDNNC& b) {
  int n = 0;
  for (std::size_t i = 0; i < a.hidden_layer().n_units(); ++i) {
    for (std::size_t j = 0; j < a.hidden_layer().n_columns(); ++j) {
      n += a.hidden_layer().weight(i, j) != b.hidden_layer().weight(i, j);
    }
  }
  return n;
}

TEST(NetworkParts, OneTimePerRepetition) {
  NetworkParts parts(small_network(), 1);
  EXPECT_EQ(parts.time_values(5).size(), 5U);
  EXPECT_EQ(parts.time_remembered_values(4).size(), 4U);
  EXPECT_EQ(parts.time_selections(3, 10, 6).size(), 3U);
  EXPECT_EQ(n_different_weights(parts.network(), small_network()), 0);
  EXPECT_EQ(parts.time_corrections(2, 6).size(), 2U);
}

TEST(NetworkParts, ACorrectionCorrectsAsManyUnitsAsAsked) {
  NetworkParts parts(small_network(), 1);
  parts.time_corrections(1, 6);
  int n_changed = 0;
  const SDNNC before = small_network();
  for (std::size_t i = 0; i < 100; ++i) {
    n_changed += parts.network().hidden_layer().threshold(i) != before.hidden_layer().threshold(i);
  }
  EXPECT_EQ(n_changed, 6);
}

// A new state must mean a full pass: otherwise the pass is not what is timed.
TEST(NetworkParts, NewStatesOfThePapersSizesTakeFullPasses) {
  NetworkParts parts(SDNNC({.n_inputs = 6}, 1), 1);
  parts.time_values(200);
  EXPECT_GE(parts.workspace().cache().counts().full, 195U);
}

TEST(NetworkParts, RefusesImpossibleNumbers) {
  NetworkParts parts(small_network(), 1);
  EXPECT_THROW(parts.time_values(-1), std::invalid_argument);
  EXPECT_THROW(parts.time_corrections(1, 0), std::invalid_argument);
  EXPECT_THROW(parts.time_corrections(1, 31), std::invalid_argument);
  EXPECT_THROW(parts.time_selections(1, 0, 5), std::invalid_argument);
  EXPECT_THROW(parts.time_selections(1, 1, 31), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::tools
