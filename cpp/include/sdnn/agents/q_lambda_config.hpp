/// The parameters of Q(lambda) and Sarsa(lambda).
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <tuple>

#include "sdnn/agents/epsilon_greedy.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/core/config_fields.hpp"

namespace sdnn::agents {

/// The value that a target bootstraps from.
enum class Bootstrap {
  sarsa,       ///< the value of the action that is taken next
  q_learning,  ///< the best value; traces end where a worse action is taken
};
constexpr std::array<std::string_view, 2> words_of(Bootstrap) noexcept {
  return {"sarsa", "q_learning"};
}

/// The change of a trace in a state that returns.
enum class TraceKind {
  dutch,      ///< such that learning equals the forward view at every step (true online)
  replacing,  ///< as if it were the first time
};
constexpr std::array<std::string_view, 2> words_of(TraceKind) noexcept {
  return {"dutch", "replacing"};
}

/// The agent's parameters, with defaults for any task. The defaults were tuned with seeds from 1000
/// on, on the tasks of docs/evidence/benchmarks.md.
struct QLambdaConfig {
  double learning_rate = 1.0;
  double discount = 0.99;
  EpsilonGreedyConfig policy = {.epsilon = 0.05, .n_greedy_steps = 0};
  double trace_decay = 0.8;
  Bootstrap bootstrap = Bootstrap::q_learning;
  TraceKind traces = TraceKind::dutch;
  int schedule_steps = 20000;
  int max_action_repeat = 100;
  std::optional<double> final_learning_rate = 0.03;
  std::optional<double> final_epsilon = {};
  Schedule schedule = Schedule::linear;
  double exploration_fraction = 1.0;
  int start_steps = 0;

  static constexpr auto fields() noexcept {
    return std::tuple_cat(
        learning_fields<QLambdaConfig>(),
        std::tuple(
            core::field("trace_decay", &QLambdaConfig::trace_decay,
                        "lambda: what remains of a trace after a step, beside the discount. 0: "
                        "one-step targets.",
                        core::within(0, 1)),
            core::field("bootstrap", &QLambdaConfig::bootstrap,
                        "What targets bootstrap from: `sarsa`: the value of the next action; "
                        "`q_learning`: the best value, and traces end where a worse action is "
                        "taken (Watkins)."),
            core::field("traces", &QLambdaConfig::traces,
                        "What a trace becomes in a state that returns: `dutch`: such that learning "
                        "equals the forward view at every step (true online), in one environment; "
                        "`replacing`: as if it were the first time, always so in several."),
            core::field(
                "schedule_steps", &QLambdaConfig::schedule_steps,
                "Steps after which alpha and epsilon have gone half of the way to their "
                "final values: after t steps they have gone t / (t + schedule_steps) of "
                "it, whatever the planned end; epsilon goes to 0 by default, but stays where "
                "observations are discrete alone. With 0 they follow the agent's progress.",
                core::within(0, 1 << 30))),
        schedule_fields<QLambdaConfig>());
  }
  bool operator==(const QLambdaConfig&) const = default;
};

}  // namespace sdnn::agents
