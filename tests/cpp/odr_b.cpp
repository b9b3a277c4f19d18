#include <gtest/gtest.h>

#include "sdnn/sdnn.hpp"

std::size_t n_actions_seen_by_a(const sdnn::approximators::SDNNC& network);

namespace {

TEST(Umbrella, TwoTranslationUnitsOfAProgramMayIncludeEveryHeader) {
  const sdnn::approximators::SDNNC network(
      {.n_inputs = 2, .n_pattern_units = 8, .n_hidden_units = 20, .n_active_units = 6}, 1);
  EXPECT_EQ(network.n_actions(), 20U - 6 + 1);  // an action for each window of active units
  EXPECT_EQ(n_actions_seen_by_a(network), network.n_actions());
}

}  // namespace
