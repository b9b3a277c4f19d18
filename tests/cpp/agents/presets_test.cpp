#include "sdnn/agents/presets.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::agents {
namespace {

TEST(Presets, ThePapersAreTheDefaults) {
  const Preset preset = paper_preset(5);
  EXPECT_EQ(preset.approximator, (approximators::SDNNCConfig{.n_inputs = 5}));
  EXPECT_EQ(preset.learning, QLearningConfig{});
}

TEST(Presets, TheRobustOneMakesAnAgentThatLearns) {
  const Preset preset = robust_preset(2);
  constexpr std::uint64_t kSeed = 1;
  QLearning agent(approximators::SDNNC(preset.approximator, kSeed), preset.learning, kSeed);
  EXPECT_EQ(agent.action_value().n_actions(), 61U);
  const std::vector<double> state = {0.2, 0.7};
  for (int episode = 0; episode < 20; ++episode) {
    agent.begin_episode();
    agent.learn(state, 7, 5.0, state, true);
  }
  EXPECT_NEAR(agent.action_value().value(state, 7), 5.0, 0.2);
}

}  // namespace
}  // namespace sdnn::agents
