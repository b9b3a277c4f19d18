// Any configuration of an agent, then any states, actions, rewards and parameters: values stay in
// their range, and a state that is restored is the state that was saved.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "input.hpp"
#include "sdnn/agents/actor_critic.hpp"
#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_lambda.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/random.hpp"
#include "sdnn/core/state.hpp"

namespace {

using namespace sdnn;

constexpr std::uint64_t kMostBytes = 1 << 20;

template <class Agent>
void save_and_restore(Agent& agent) {
  const core::State saved = core::state_of(agent);
  core::restore(agent, saved);
  fuzz::expect(core::state_of(agent) == saved, "a restored state differs");
}

/// Acts, learns, begins episodes, and saves and restores the agent, in any order.
template <class Agent>
void use(Agent& agent, FuzzedDataProvider& input) {
  const std::size_t n_inputs = agent.n_inputs();
  double last_reward = 0.0;  // of the last transition that was learned
  agent.begin_episode();
  while (input.remaining_bytes() > 0) {
    const auto state = fuzz::any_doubles(input, n_inputs, 0.0, 1.0);
    switch (input.ConsumeIntegralInRange(0, 4)) {
      case 0:
        fuzz::accepted([&] { agent.act(state, input.ConsumeBool()); });
        break;
      case 1:
        agent.begin_episode();
        break;
      case 2:
        save_and_restore(agent);
        break;
      default: {
        const auto next = fuzz::any_doubles(input, n_inputs, 0.0, 1.0);
        const double reward = fuzz::any_double(input, -10.0, 10.0);
        const bool terminated = input.ConsumeBool();
        const bool is_learned = fuzz::accepted([&] {
          const auto action = agent.act(state, true);
          agent.learn(state, action, reward, next, terminated);
        });
        if (is_learned) last_reward = reward;
        if constexpr (requires { agent.refine_unit(0, 0); }) {
          // Requires sizes of rewards, as powers of two, of at least the last reward's.
          const int least = last_reward == 0.0 ? -1100 : std::ilogb(last_reward);
          const int size = std::max(least, input.ConsumeIntegralInRange(-1100, 1100));
          if (input.ConsumeBool())
            agent.refine_unit(size, size + input.ConsumeIntegralInRange(0, 9));
        }
        // Tiny and huge rewards change the unit of all values.
        if (reward != 0.0 && std::abs(std::log2(std::abs(reward))) > 30.0) save_and_restore(agent);
      }
    }
  }
}

void use_sdnn_c(FuzzedDataProvider& input) {
  approximators::SDNNCConfig config{.n_inputs = input.ConsumeIntegralInRange(2, 4),
                                    .n_pattern_units = 20,
                                    .n_interpolated = 4,
                                    .n_hidden_units = 60,
                                    .n_active_units = 30};
  fuzz::change(config, input);
  config.max_table_bytes = kMostBytes;
  agents::QLearningConfig learning;
  fuzz::change(learning, input);
  const std::vector networks(input.ConsumeIntegralInRange<std::size_t>(1, 2),
                             approximators::SDNNC(config, 1));
  agents::QLearning agent(networks, learning, 1);
  use(agent, input);
  auto workspace = agent.workspace();
  const std::vector<double> state(agent.n_inputs(), 0.5);
  for (std::size_t d = 0; d < agent.n_dimensions(); ++d) {
    const auto& scale = agent.networks()[d].output_scale();
    for (const double value : agent.values(state, workspace, d)) {
      fuzz::expect(value >= scale.q_low() && value <= scale.q_high(), "a value out of range");
    }
  }
}

void use_rbf(FuzzedDataProvider& input) {
  approximators::RBFNetworkConfig config{.n_inputs = 2, .n_bases = 3, .n_actions = 5};
  fuzz::change(config, input);
  config.max_table_bytes = kMostBytes;
  agents::QLearningConfig learning;
  fuzz::change(learning, input);
  approximators::RBFNetwork network(config);
  if (input.ConsumeBool()) {
    const auto weights = fuzz::any_doubles(input, network.n_joint_bases(), -1.0, 1.0);
    fuzz::accepted([&] { network.set_weights(weights); });
  }
  agents::QLearning agent(std::move(network), learning, 1);
  use(agent, input);
  for (const double weight : agent.networks().front().weights()) {
    fuzz::expect(std::isfinite(weight), "a weight is not finite");
  }
}

void use_fuzzy(FuzzedDataProvider& input) {
  approximators::FuzzyRulesConfig rules{.n_inputs = 2, .n_sets = 3, .n_actions = 4};
  fuzz::change(rules, input);
  rules.max_table_bytes = kMostBytes;
  agents::FuzzyQLearningConfig learning;
  fuzz::change(learning, input);
  const std::vector dimensions(input.ConsumeIntegralInRange<std::size_t>(1, 2),
                               approximators::FuzzyRules(rules));
  agents::FuzzyQLearning agent(dimensions, learning, 1);
  use(agent, input);
}

/// Returns the numbers of actions of one or two dimensions.
std::vector<std::size_t> some_actions(FuzzedDataProvider& input) {
  std::vector<std::size_t> n_actions(input.ConsumeIntegralInRange<std::size_t>(1, 2));
  for (auto& n : n_actions) n = input.ConsumeIntegralInRange<std::size_t>(1, 9);
  return n_actions;
}

void use_q_lambda(FuzzedDataProvider& input) {
  approximators::LinearSDNNConfig config{.n_inputs = input.ConsumeIntegralInRange(2, 4),
                                         .n_pattern_units = 20,
                                         .n_interpolated = 4,
                                         .averaging_interval = 2};
  fuzz::change(config, input);
  config.max_table_bytes = kMostBytes;
  agents::QLambdaConfig learning;
  fuzz::change(learning, input);
  const auto n_actions = some_actions(input);
  agents::QLambda agent(approximators::LinearSDNN(config, n_actions, 1), learning, 1);
  use(agent, input);
  auto workspace = agent.workspace();
  const std::vector<double> state(agent.n_inputs(), 0.5);
  for (std::size_t d = 0; d < agent.n_dimensions(); ++d) {
    for (const double value : agent.values(state, workspace, d)) {
      fuzz::expect(std::isfinite(value), "a value is not finite");
    }
  }
}

void use_actor_critic(FuzzedDataProvider& input) {
  approximators::LinearSDNNConfig config{
      .n_inputs = input.ConsumeIntegralInRange(2, 4), .n_pattern_units = 20, .n_interpolated = 4};
  fuzz::change(config, input);
  config.max_table_bytes = kMostBytes;
  agents::ActorCriticConfig learning;
  fuzz::change(learning, input);
  const auto n_actions = some_actions(input);
  auto made = agents::make_agent(config, learning, n_actions, 1);
  auto& agent = std::get<agents::ActorCritic>(made);
  use(agent, input);
  auto workspace = agent.workspace();
  const std::vector<double> state(agent.n_inputs(), 0.5);
  for (std::size_t d = 0; d < agent.n_dimensions(); ++d) {
    double sum = 0.0;
    for (const double p : agent.values(state, workspace, d)) sum += p;
    fuzz::expect(std::abs(sum - 1.0) < 1e-9, "probabilities do not sum to 1");
  }
  fuzz::expect(std::isfinite(agent.value(state)), "a value is not finite");
}

/// Uses an agent in the units of its task, with a history and a short warm-up.
void use_controller(FuzzedDataProvider& input) {
  using agents::History;
  const std::size_t n_variables = input.ConsumeIntegralInRange<std::size_t>(1, 3);
  agents::ControllerConfig config{
      .approximator = approximators::LinearSDNNConfig{.n_pattern_units = 20, .n_interpolated = 4},
      .learning = agents::QLambdaConfig{},
      .observation = {.low = std::vector<std::optional<double>>(n_variables, 0.0),
                      .high = std::vector<std::optional<double>>(n_variables, 1.0),
                      .running = input.ConsumeBool(),
                      .relevant_only = input.ConsumeBool(),
                      .missing =
                          input.ConsumeBool() ? agents::Missing::hold : agents::Missing::error,
                      .history = static_cast<History>(input.ConsumeIntegralInRange(0, 4))},
      .action = {.low = {0.0}, .high = {2.0}, .discrete = true},
      .warm_up_steps = input.ConsumeIntegralInRange(1, 120)};
  if (input.ConsumeBool()) config.learning = agents::ActorCriticConfig{};
  if (input.ConsumeBool()) config.observation.angles = {0};
  agents::Controller agent(config);
  agent.begin_episode();
  core::Random random(input.ConsumeIntegral<std::uint8_t>(), core::Stream::weights);
  std::vector<double> observation(n_variables, 0.5);
  for (int t = 0; t < 400 && input.remaining_bytes() > 0; ++t) {
    std::vector<double> next = observation;
    for (double& x : next) x += 0.2 * random.uniform() - 0.1;
    if (input.ConsumeIntegralInRange(0, 15) == 0) {
      next = fuzz::any_doubles(input, n_variables, 0.0, 1.0);
    }
    fuzz::accepted([&] { (void)agent.act(observation, false); });
    fuzz::accepted([&] {
      const double action = agent.act(observation)[0];
      agent.learn(observation, {&action, 1}, random.uniform(), next, random.below(50) == 0);
    });
    switch (input.ConsumeIntegralInRange(0, 31)) {
      case 0:
        agent.begin_episode();
        break;
      case 1:
        agent.begin_greedy_episode();
        break;
      case 2: {
        const core::State saved = core::state_of(agent);
        agent = agents::Controller::restored(config, saved);
        fuzz::expect(core::state_of(agent) == saved, "a restored state differs");
        break;
      }
      default:
        break;
    }
    observation = next;
  }
  if (agent.is_warming_up() || !fuzz::accepted([&] { (void)agent.state_of(observation); })) return;
  for (const double x : agent.state_of(observation)) {
    fuzz::expect(x >= 0.0 && x <= 1.0, "a state out of range");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  sdnn::fuzz::accepted([&] {
    switch (input.ConsumeIntegralInRange(0, 5)) {
      case 0:
        return use_sdnn_c(input);
      case 1:
        return use_rbf(input);
      case 2:
        return use_q_lambda(input);
      case 3:
        return use_actor_critic(input);
      case 4:
        return use_controller(input);
      default:
        return use_fuzzy(input);
    }
  });
  return 0;
}
