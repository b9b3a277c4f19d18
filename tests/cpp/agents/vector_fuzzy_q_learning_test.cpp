#include "sdnn/agents/vector_fuzzy_q_learning.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "lives.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"
#include "threads.hpp"

namespace sdnn::agents {
namespace {

using approximators::FuzzyRules;
using Numbers = std::vector<double>;

FuzzyQLearning part(std::uint64_t seed) {
  return {FuzzyRules({.n_inputs = 2, .n_sets = 4, .n_actions = 5}),
          {.trace_decay = 0.7, .policy = {.epsilon = 0.3, .n_greedy_steps = 0}},
          seed};
}

VectorFuzzyQLearning agent_of_two() { return VectorFuzzyQLearning({part(1), part(2)}); }

TEST(VectorFuzzyQLearning, EachDimensionLearnsAsAnAgentOfItsOwn) {
  VectorFuzzyQLearning both = agent_of_two();
  FuzzyQLearning first = part(1), second = part(2);
  EXPECT_EQ(both.n_dimensions(), 2U);
  EXPECT_EQ(both.n_inputs(), 2U);
  Numbers state = {0.2, 0.9};
  for (int t = 0; t < 200; ++t) {
    const Numbers action = both.act(state);
    ASSERT_EQ(action, (Numbers{first.act(state), second.act(state)}));
    ASSERT_EQ(both.last_action(), action);
    ASSERT_EQ(testing::value_of(both, state),
              (testing::value_of(first, state) + testing::value_of(second, state)) / 2.0);
    const double reward = action[0] - action[1];
    const Numbers next = {0.5 + 0.4 * action[0], 0.5 + 0.4 * action[1]};
    both.learn(state, action, reward, next, t % 9 == 8);
    first.learn(state, action[0], reward, next, t % 9 == 8);
    second.learn(state, action[1], reward, next, t % 9 == 8);
    state = next;
    if (t % 9 != 8) continue;
    both.begin_episode();
    first.begin_episode();
    second.begin_episode();
  }
  EXPECT_EQ(core::state_of(both.part(0)), core::state_of(first));
  EXPECT_EQ(core::state_of(both.part(1)), core::state_of(second));
}

// What helps is that the first is high and the second low, and each is told the sum only.
TEST(VectorFuzzyQLearning, LearnsWhatEachDimensionIsGoodFor) {
  VectorFuzzyQLearning agent = agent_of_two();
  const Numbers state = {0.5, 0.5};
  for (int t = 0; t < 3000; ++t) {
    const Numbers action = agent.act(state);
    agent.learn(state, action, action[0] - action[1], state, true);
  }
  const Numbers greedy = agent.act(state, false);
  EXPECT_GT(greedy[0], 0.5);
  EXPECT_LT(greedy[1], -0.5);
}

TEST(VectorFuzzyQLearning, ALifeCanBeCutAnywhere) {
  testing::expect_that_a_life_can_be_cut(agent_of_two);
  testing::expect_that_a_life_can_be_cut(agent_of_two, 3);
}

TEST(VectorFuzzyQLearning, ABadTransitionTeachesNothing) {
  VectorFuzzyQLearning agent = agent_of_two();
  const Numbers state = {0.2, 0.9};
  const Numbers action = agent.act(state);
  const core::State before = core::state_of(agent);
  for (const Numbers& bad :
       {Numbers{action[0]}, Numbers{action[0], 0.123}, Numbers{0.123, action[1]}, Numbers{}}) {
    EXPECT_THROW(agent.learn(state, bad, 1.0, state, false), std::invalid_argument);
  }
  EXPECT_THROW(agent.learn(Numbers{0.2, 0.8}, action, 1.0, state, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(state, action, 1.0, Numbers{0.2, 1.1}, false), std::invalid_argument);
  EXPECT_THROW(agent.learn(state, action, 1.0, state, false, 1), std::invalid_argument);
  EXPECT_EQ(core::state_of(agent), before);
}

TEST(VectorFuzzyQLearning, NamesWhatIsImpossible) {
  EXPECT_THROW(VectorFuzzyQLearning({}), std::invalid_argument);
  const FuzzyQLearning other(FuzzyRules({.n_inputs = 3}), {}, 1);
  EXPECT_THROW(VectorFuzzyQLearning({part(1), other}), std::invalid_argument);
}

// Between two updates many threads may ask for values and choose greedy actions.
TEST(VectorFuzzyQLearning, ManyThreadsMayReadIt) {
  VectorFuzzyQLearning agent = agent_of_two();
  testing::World<VectorFuzzyQLearning> world(agent.n_inputs(), 7);
  for (int t = 0; t < 300; ++t) world.tick(agent);
  const auto read = [](const VectorFuzzyQLearning& learned) {
    core::Random random(5, core::Stream::sensor_noise), ties(1, core::Stream::evaluation_ties);
    auto workspace = learned.workspace();
    std::vector<Numbers> all;
    Numbers state(learned.n_inputs());
    for (int i = 0; i < 50; ++i) {
      for (double& x : state) x = random.uniform();
      all.push_back(learned.best_action(state, workspace, ties));
      all.back().push_back(learned.value(state, workspace));
    }
    return all;
  };
  const VectorFuzzyQLearning alone = agent;
  const auto expected = read(alone);
  for (const auto& values : testing::in_threads(4, [&](std::size_t) { return read(agent); })) {
    EXPECT_EQ(values, expected);
  }
}

}  // namespace
}  // namespace sdnn::agents
