#include <gtest/gtest.h>

#include <stdexcept>

#include "approximators/lookup_table.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "tools/timings.hpp"

namespace sdnn::tools {
namespace {

using Table = testing::LookupTable;
using Trial = tools::AcrobotTrial<agents::QLearning<Table>>;

Trial table_trial() {
  return Trial(agents::QLearning<Table>(Table(4, 8, 21), {}, 1), {}, {}, {},
               {.episodes = 40, .evaluate_every_episodes = 10}, 1);
}

TEST(TimeDecisions, ReturnsATimePerDecisionWithoutChangingTheTrial) {
  Trial timed = table_trial(), plain = table_trial();
  const Times times = time_decisions(timed, 25);
  plain.advance(25);
  EXPECT_EQ(times.size(), static_cast<std::size_t>(timed.n_decisions()));
  EXPECT_EQ(timed.n_decisions(), plain.n_decisions());
  ASSERT_EQ(timed.rows().size(), 2U);  // after 10 and 20 of 25 episodes
  EXPECT_EQ(timed.rows()[1].steps, plain.rows()[1].steps);
  EXPECT_EQ(timed.rows()[1].episode_return, plain.rows()[1].episode_return);
  EXPECT_THROW(time_decisions(timed, -1), std::invalid_argument);
}

TEST(AcrobotDecisions, ContinuesThroughAllEpisodes) {
  AcrobotDecisions decisions({}, 1);
  EXPECT_EQ(decisions.n_integration_steps(), 50);  // of 0.02 s in a second
  EXPECT_EQ(decisions.run(120).size(), 120U);
  EXPECT_EQ(decisions.acrobot().decisions(), 120 - 2 * 50);  // an episode has 50 decisions
  EXPECT_NE(decisions.acrobot().state()[0], 0.0);
  EXPECT_THROW(decisions.run(-1), std::invalid_argument);
}

TEST(AcrobotDecisions, CountsTheStepsOfOtherIntervals) {
  EXPECT_EQ(AcrobotDecisions({.decision_interval = 0.5, .integration_step = 0.1}, 1)
                .n_integration_steps(),
            5);
}

}  // namespace
}  // namespace sdnn::tools
