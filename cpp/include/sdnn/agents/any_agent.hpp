/// Agents of every kind, made of their settings.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_lambda.hpp"
#include "sdnn/agents/q_lambda_config.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/agents/q_learning_config.hpp"
#include "sdnn/agents/vector_fuzzy_q_learning.hpp"
#include "sdnn/approximators/decoupled.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/state_code_config.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"

namespace sdnn::agents {

/// An agent of any kind.
using AnyAgent = std::variant<QLearning<approximators::SDNNC>,
                              QLearning<approximators::Decoupled<approximators::SDNNC>>,
                              QLearning<approximators::RBFNetwork>,
                              QLearning<approximators::Decoupled<approximators::RBFNetwork>>,
                              FuzzyQLearning, VectorFuzzyQLearning, QLambda>;

/// What one reader of such an agent needs.
template <class Agents>
struct WorkspacesOf;
template <class... Agent>
struct WorkspacesOf<std::variant<Agent...>> {
  using type = std::variant<typename Agent::Workspace...>;
};
using AnyWorkspace = WorkspacesOf<AnyAgent>::type;

/// The settings of its parts. Fuzzy rules belong to fuzzy Q-learning.
using AnyApproximatorConfig =
    std::variant<approximators::SDNNCConfig, approximators::RBFNetworkConfig,
                 approximators::FuzzyRulesConfig, approximators::LinearSDNNConfig>;
using AnyLearningConfig = std::variant<QLearningConfig, FuzzyQLearningConfig, QLambdaConfig>;

/// Whether it is one of the two that learn by fuzzy rules.
template <class Agent>
inline constexpr bool kIsFuzzy =
    std::is_same_v<Agent, FuzzyQLearning> || std::is_same_v<Agent, VectorFuzzyQLearning>;

inline bool is_fuzzy(const AnyApproximatorConfig& config) noexcept {
  return std::holds_alternative<approximators::FuzzyRulesConfig>(config);
}
inline bool is_linear(const AnyApproximatorConfig& config) noexcept {
  return std::holds_alternative<approximators::LinearSDNNConfig>(config);
}
/// Whether states have an SDNN code.
inline bool is_sdnn(const AnyApproximatorConfig& config) noexcept {
  return std::holds_alternative<approximators::SDNNCConfig>(config) || is_linear(config);
}

/// How many actions of a box there are in each dimension; 0: any.
inline std::size_t n_actions_in_box(const AnyApproximatorConfig& config) {
  if (is_fuzzy(config)) return 0;
  int n = 1;
  if (const auto* const sdnn = std::get_if<approximators::SDNNCConfig>(&config)) {
    n = sdnn->n_actions;
    if (n == 0) n = sdnn->n_hidden_units - sdnn->n_active_units + 1;
  } else if (const auto* const linear = std::get_if<approximators::LinearSDNNConfig>(&config)) {
    n = linear->n_actions;
  } else {
    n = std::get<approximators::RBFNetworkConfig>(config).n_actions;
  }
  return static_cast<std::size_t>(std::max(n, 1));
}

namespace detail {

inline double power(int base, int exponent) {
  double product = 1.0;
  for (int i = 0; i < exponent && product < 1e300; ++i) product *= base;
  return product;
}

/// Code books are in no array of a file. Those of agents take less than their weights.
template <class Config>
void expect_code_room(const Config& config, double weight_bytes, double n_dimensions) {
  const double n_bytes = coding::pattern_bytes_of(config, coding::n_bins_of(config));
  const double most = static_cast<double>(core::kDefaultMaxTableBytes) / n_dimensions;
  core::require(n_bytes <= std::max(most, weight_bytes), "n_interpolated or n_symbols",
                "smaller: code books would not fit", n_bytes);
}

}  // namespace detail

/// Throws std::invalid_argument unless an agent's arrays in a state, called "agent." and so on, are
/// as large as the settings make them: before memory is asked for.
template <class Reader>
void expect_sizes(const Reader& reader, const AnyApproximatorConfig& config,
                  const std::vector<std::size_t>& n_actions, bool has_tables) {
  const std::string name = "agent.action_value.";
  if (const auto* const linear = std::get_if<approximators::LinearSDNNConfig>(&config)) {
    const double n_weights = approximators::n_linear_weights(*linear, n_actions);
    reader.expect_size(name + "weights", n_weights);
    if (!has_tables) detail::expect_code_room(*linear, 4.0 * n_weights, 1.0);
    return;
  }
  const std::size_t n_dimensions = n_actions.size();
  for (std::size_t d = 0; d < n_dimensions; ++d) {
    const std::string number = n_dimensions > 1 ? std::to_string(d) + "." : "";
    if (const auto* const rules = std::get_if<approximators::FuzzyRulesConfig>(&config)) {
      reader.expect_size("agent." + number + "rules.values",
                         detail::power(rules->n_sets, rules->n_inputs) * rules->n_actions);
    } else if (const auto* const rbf = std::get_if<approximators::RBFNetworkConfig>(&config)) {
      reader.expect_size(name + number + "weights", detail::power(rbf->n_bases, rbf->n_inputs + 1));
    } else {
      const auto& sdnn = std::get<approximators::SDNNCConfig>(config);
      const double n_weights = 1.0 * sdnn.n_hidden_units * sdnn.n_pattern_units * sdnn.n_inputs *
                               coding::n_partners_of(sdnn);
      reader.expect_size(name + number + "weights", n_weights);
      if (!has_tables) {
        detail::expect_code_room(sdnn, 2.0 * n_weights, static_cast<double>(n_dimensions));
      }
    }
  }
}

namespace detail {

template <class Config, class Make>
AnyAgent make_q_learning(Config config, const QLearningConfig& learning,
                         const std::vector<std::size_t>& n_actions, std::uint64_t seed,
                         const Make& make) {
  if (n_actions.size() == 1) return QLearning(make(config, seed), learning, seed);
  config.max_table_bytes /= n_actions.size();
  const std::vector<int> numbers(n_actions.begin(), n_actions.end());
  return QLearning(approximators::make_decoupled(config, numbers, seed, make), learning, seed);
}

}  // namespace detail

/// Makes an agent with so many actions in each dimension, and, with SDNN-C and actions of one
/// dimension, patterns of its own for each input. With a linear readout `n_first` inputs may have
/// come first; see LinearSDNN. Where there are no tables, each input may have a pattern for missing
/// readings beside the others, of symbols the last one. Throws as the parts do.
inline AnyAgent make_agent(const AnyApproximatorConfig& config, const AnyLearningConfig& learning,
                           const std::vector<std::size_t>& n_actions, std::uint64_t seed,
                           const std::vector<coding::PatternTable>& tables = {},
                           std::size_t n_first = 0, bool codes_missing = false) {
  using namespace approximators;
  const bool fits = is_fuzzy(config)    ? std::holds_alternative<FuzzyQLearningConfig>(learning)
                    : is_linear(config) ? std::holds_alternative<QLambdaConfig>(learning)
                                        : std::holds_alternative<QLearningConfig>(learning);
  core::require(fits, "learning",
                "FuzzyQLearningConfig with fuzzy rules, QLambdaConfig with a linear readout, else "
                "QLearningConfig",
                "another one");
  core::require(tables.empty() || is_linear(config) || (is_sdnn(config) && n_actions.size() == 1),
                "tables", "None where actions have several dimensions", tables.size());
  if (const auto* const rules = std::get_if<FuzzyRulesConfig>(&config)) {
    const auto& rule = std::get<FuzzyQLearningConfig>(learning);
    if (n_actions.size() == 1) return FuzzyQLearning(FuzzyRules(*rules), rule, seed);
    FuzzyRulesConfig of_dimension = *rules;
    of_dimension.max_table_bytes /= n_actions.size();
    return VectorFuzzyQLearning(of_dimension, n_actions.size(), rule, seed);
  }
  if (const auto* const linear = std::get_if<LinearSDNNConfig>(&config)) {
    const auto books = [&, config = with_pattern_units(*linear)] {
      if (!tables.empty()) return tables;
      return codes_missing ? code_books_with_missing(config, seed) : code_books_of(config, seed);
    };
    return QLambda(LinearSDNN(*linear, n_actions, books(), seed, tables.empty() ? n_first : 0),
                   std::get<QLambdaConfig>(learning), seed);
  }
  const auto& rule = std::get<QLearningConfig>(learning);
  if (const auto* const rbf = std::get_if<RBFNetworkConfig>(&config)) {
    return detail::make_q_learning(
        *rbf, rule, n_actions, seed,
        [](const RBFNetworkConfig& one, std::uint64_t) { return RBFNetwork(one); });
  }
  return detail::make_q_learning(std::get<SDNNCConfig>(config), rule, n_actions, seed,
                                 [&](const SDNNCConfig& one, std::uint64_t seed_of_part) {
                                   if (!tables.empty()) return SDNNC(one, tables, seed_of_part);
                                   if (!codes_missing) return SDNNC(one, seed_of_part);
                                   return SDNNC(one, code_books_with_missing(one, seed_of_part),
                                                seed_of_part);
                                 });
}

/// Calls what Q-learning is changed by, where there is such an agent.
template <class Call>
void with_q_learning(std::optional<AnyAgent>& any, const Call& call) {
  if (!any) return;
  std::visit(
      [&call](auto& agent) {
        if constexpr (!kIsFuzzy<std::remove_cvref_t<decltype(agent)>>) call(agent);
      },
      *any);
}
/// What Q-learning returns; `otherwise` where there is no such agent.
template <class Call>
double of_q_learning(const std::optional<AnyAgent>& any, const Call& call, double otherwise) {
  if (!any) return otherwise;
  return std::visit(
      [&](const auto& agent) {
        if constexpr (kIsFuzzy<std::remove_cvref_t<decltype(agent)>>)
          return otherwise;
        else
          return call(agent);
      },
      *any);
}

/// The action to take in a state. Of a fuzzy agent, whose actions have no mask, any.
template <class Agent>
auto act(Agent& agent, std::span<const double> state, bool explore, std::size_t environment,
         ActionMask mask) {
  if constexpr (kIsFuzzy<Agent>)
    return agent.act(state, explore, environment);
  else
    return agent.act(state, explore, environment, mask);
}
template <class Agent>
auto best_action(const Agent& agent, std::span<const double> state,
                 typename Agent::Workspace& workspace, core::Random& ties, ActionMask mask) {
  if constexpr (kIsFuzzy<Agent>)
    return agent.best_action(state, workspace, ties);
  else
    return agent.best_action(state, workspace, ties, mask);
}
template <class Agent>
auto best_of(Agent& agent, typename Agent::Workspace& workspace, ActionMask mask) {
  if constexpr (kIsFuzzy<Agent>)
    return agent.best_of(workspace);
  else
    return agent.best_of(workspace, mask);
}

/// Learns a transition between two states; of a fuzzy agent, its last action.
inline void learn(AnyAgent& any, std::span<const double> state,
                  const std::vector<std::size_t>& indices, double reward,
                  std::span<const double> next_state, bool terminated, std::size_t environment,
                  ActionMask next_mask) {
  std::visit(
      [&](auto& agent) {
        using Agent = std::remove_cvref_t<decltype(agent)>;
        if constexpr (kIsFuzzy<Agent>) {
          agent.learn(state, agent.last_action(environment), reward, next_state, terminated,
                      environment);
        } else {
          const auto& action = [&]() -> const auto& {
            if constexpr (Agent::kDecoupled)
              return indices;
            else
              return indices[0];
          }();
          agent.learn(state, action, reward, next_state, terminated, environment, next_mask);
        }
      },
      any);
}

}  // namespace sdnn::agents
