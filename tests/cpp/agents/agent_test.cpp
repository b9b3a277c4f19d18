#include "sdnn/agents/agent.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "approximators/lookup_table.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace sdnn::agents {
namespace {

static_assert(Agent<QLearning<testing::LookupTable>>);
static_assert(Agent<QLearning<approximators::SDNNC>>);
static_assert(Agent<QLearning<approximators::RBFNetwork>>);
static_assert(Agent<FuzzyQLearning>);
static_assert(!Agent<approximators::RBFNetwork>);

TEST(Agent, DiscreteActionsCutTheRangeEvenly) {
  const QLearning<testing::LookupTable> agent(testing::LookupTable(1, 2, 5), {}, 1);
  const std::vector<double> shares = {-1.0, -0.5, 0.0, 0.5, 1.0};
  for (std::size_t action = 0; action < 5; ++action) {
    EXPECT_EQ(agent.share(action), shares[action]);
  }
  EXPECT_EQ(agent.n_inputs(), 1U);
}

}  // namespace
}  // namespace sdnn::agents
