#include "sdnn/agents/presets.hpp"

#include <gtest/gtest.h>

#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::agents {
namespace {

TEST(Presets, SmallDiffersFromGeneralInItsSizesOnly) {
  const Preset small = small_preset(4);
  const Preset general = general_preset(4);
  EXPECT_EQ(small.learning, general.learning);
  approximators::SDNNCConfig resized = small.approximator;
  resized.n_pattern_units = general.approximator.n_pattern_units;
  resized.n_hidden_units = general.approximator.n_hidden_units;
  resized.n_active_units = general.approximator.n_active_units;
  EXPECT_EQ(resized, general.approximator);
  // At eight bits a weight, and 360 patterns for each of four inputs.
  const int n_weights = 12 * small.approximator.n_pattern_units * small.approximator.n_hidden_units;
  EXPECT_LE(n_weights + 4 * 360 * small.approximator.n_pattern_units / 8, 512 * 1024);
}

}  // namespace
}  // namespace sdnn::agents
