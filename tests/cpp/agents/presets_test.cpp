#include "sdnn/agents/presets.hpp"

#include <gtest/gtest.h>

#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::agents {
namespace {

TEST(Presets, SmallDiffersFromGeneralInItsSizesOnlyAndTakes512KBWithFourInputs) {
  const Preset small = small_preset(4);
  const Preset general = general_preset(4);
  EXPECT_EQ(small.learning, general.learning);
  approximators::SDNNCConfig resized = small.approximator;
  resized.n_pattern_units = general.approximator.n_pattern_units;
  resized.n_hidden_units = general.approximator.n_hidden_units;
  resized.n_active_units = general.approximator.n_active_units;
  EXPECT_EQ(resized, general.approximator);
  // A byte for each weight of 4 * 3 pairs of inputs, and 360 patterns of bits for each input.
  const int n_units = small.approximator.n_pattern_units;
  const int weight_bytes = 4 * 3 * n_units * small.approximator.n_hidden_units;
  const int pattern_bytes = 4 * 360 * n_units / 8;
  EXPECT_LE(weight_bytes + pattern_bytes, 512 * 1024);
}

}  // namespace
}  // namespace sdnn::agents
