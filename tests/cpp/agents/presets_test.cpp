#include "sdnn/agents/presets.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::agents {
namespace {

TEST(Presets, ThePapersAreTheDefaults) {
  const Preset preset = paper_preset(5);
  EXPECT_EQ(preset.approximator, (approximators::SDNNCConfig{.n_inputs = 5}));
  EXPECT_EQ(preset.learning, QLearningConfig{});
}

TEST(Presets, TheSmallOneIsTheGeneralOneWithFewerUnits) {
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

TEST(Presets, TheRobustOneMakesAnAgentThatLearns) {
  const Preset preset = robust_preset(2);
  constexpr std::uint64_t kSeed = 1;
  QLearning agent(approximators::SDNNC(preset.approximator, kSeed), preset.learning, kSeed);
  EXPECT_EQ(agent.networks().front().n_actions(), 61U);
  const std::vector<double> state = {0.2, 0.7};
  for (int episode = 0; episode < 20; ++episode) {
    agent.begin_episode();
    agent.learn(state, std::vector<std::size_t>{7}, 5.0, state, true);
  }
  auto workspace = agent.workspace();
  EXPECT_NEAR(agent.values(state, workspace)[7], 5.0, 0.2);
}

}  // namespace
}  // namespace sdnn::agents
