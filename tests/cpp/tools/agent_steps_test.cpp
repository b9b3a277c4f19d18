#include <gtest/gtest.h>

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "tools/timings.hpp"

namespace sdnn::tools {
namespace {

using agents::QLearning;
using approximators::SDNNC;

/// An agent that records calls as letters: b for begin_episode, a for an exploring and g for a
/// greedy act, l for learn and t for learn of a terminated transition. Its action is the number of
/// acts before.
class RecordingAgent {
 public:
  struct Learned {
    std::vector<double> state;
    int action;
    double reward;
    std::vector<double> next_state;
  };

  std::size_t n_inputs() const { return 2; }
  void begin_episode() { calls += 'b'; }
  int act(std::span<const double> state, bool explore) {
    calls += explore ? 'a' : 'g';
    states.emplace_back(state.begin(), state.end());
    return static_cast<int>(states.size()) - 1;
  }
  double normalized_action(int) const { return 0.0; }
  void learn(std::span<const double> state, int action, double reward,
             std::span<const double> next_state, bool terminated) {
    calls += terminated ? 't' : 'l';
    learned.push_back(
        {{state.begin(), state.end()}, action, reward, {next_state.begin(), next_state.end()}});
  }

  std::string calls;
  std::vector<std::vector<double>> states;  ///< acted in
  std::vector<Learned> learned;
};

TEST(TimeAgentSteps, EachStepLearnsTheTransitionToANewStateAndActsThere) {
  RecordingAgent agent;
  const Times times = time_agent_steps(agent, /*n_repetitions=*/3, /*seed=*/5);
  EXPECT_EQ(times.size(), 3U);
  // Begin an episode and act; then three times learn and act.
  EXPECT_EQ(agent.calls, "balalala");
  ASSERT_EQ(agent.learned.size(), 3U);
  core::Random random(5, core::Stream::exploration);
  for (double& value : agent.states[0]) EXPECT_EQ(value, random.uniform());
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& learned = agent.learned[i];
    EXPECT_EQ(learned.state, agent.states[i]);
    EXPECT_EQ(learned.action, static_cast<int>(i));
    EXPECT_EQ(learned.next_state, agent.states[i + 1]);
    EXPECT_NE(learned.next_state, learned.state);
    for (const double value : learned.next_state) EXPECT_EQ(value, random.uniform());
    EXPECT_EQ(learned.reward, 2.0 * random.uniform() - 1.0);
  }
}

TEST(TimeAgentSteps, BadNumbersAndNoRepetitionsDoNotChangeTheAgent) {
  RecordingAgent agent;
  EXPECT_THROW(time_agent_steps(agent, -1, 1), std::invalid_argument);
  EXPECT_THROW(time_agent_steps(agent, kMaxRepetitions + 1, 1), std::invalid_argument);
  EXPECT_TRUE(time_agent_steps(agent, 0, 1).empty());
  EXPECT_EQ(agent.calls, "");
}

// With cached potentials the time would not be that of a pass over the weights.
TEST(TimeAgentSteps, EveryStepOfALargeNetworkTakesAFullPass) {
  QLearning<SDNNC> agent(SDNNC({.n_inputs = 6}, 1), {}, 1);
  constexpr int kSteps = 100;
  time_agent_steps(agent, kSteps, 1);
  const auto n_full = agent.agent_workspace().networks.front().cache().counts().full;
  EXPECT_GE(n_full, kSteps - 2U);  // a new state may be near the last one
  EXPECT_LE(n_full, kSteps + 1U);  // the steps and the first act, which is not timed
}

}  // namespace
}  // namespace sdnn::tools
