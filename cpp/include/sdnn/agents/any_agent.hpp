/// Agents of every kind, made of their settings.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/agents/actor_critic.hpp"
#include "sdnn/agents/actor_critic_config.hpp"
#include "sdnn/agents/detail/dimensions.hpp"
#include "sdnn/agents/detail/make_actor_critic.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_lambda.hpp"
#include "sdnn/agents/q_lambda_config.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/agents/q_learning_config.hpp"
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
using AnyAgent = std::variant<QLearning<approximators::SDNNC>, QLearning<approximators::RBFNetwork>,
                              FuzzyQLearning, QLambda, ActorCritic>;

/// The workspace of an agent of any kind, in which a thread reads it.
template <class Agents>
struct WorkspacesOf;
template <class... Agent>
struct WorkspacesOf<std::variant<Agent...>> {
  using type = std::variant<typename Agent::Workspace...>;
};
using AnyWorkspace = WorkspacesOf<AnyAgent>::type;

/// The settings of an agent's approximator and learning rule. Fuzzy rules need fuzzy Q-learning.
using AnyApproximatorConfig =
    std::variant<approximators::SDNNCConfig, approximators::RBFNetworkConfig,
                 approximators::FuzzyRulesConfig, approximators::LinearSDNNConfig>;
using AnyLearningConfig =
    std::variant<QLearningConfig, FuzzyQLearningConfig, QLambdaConfig, ActorCriticConfig>;

inline bool is_fuzzy(const AnyApproximatorConfig& config) noexcept {
  return std::holds_alternative<approximators::FuzzyRulesConfig>(config);
}
/// Whether an agent can learn only its own policy's actions, and not those of a warm-up.
inline bool is_on_policy(const AnyLearningConfig& config) noexcept {
  return std::holds_alternative<FuzzyQLearningConfig>(config) ||
         std::holds_alternative<ActorCriticConfig>(config);
}
inline bool is_linear(const AnyApproximatorConfig& config) noexcept {
  return std::holds_alternative<approximators::LinearSDNNConfig>(config);
}
/// Whether states have an SDNN code.
inline bool is_sdnn(const AnyApproximatorConfig& config) noexcept {
  return std::holds_alternative<approximators::SDNNCConfig>(config) || is_linear(config);
}

/// The number of actions into which each dimension of a box is divided; 0: real numbers.
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

/// Returns base^exponent; if it is 1e300 or more, any number of at least 1e300.
inline double power(int base, int exponent) {
  double product = 1.0;
  for (int i = 0; i < exponent && product < 1e300; ++i) product *= base;
  return product;
}

/// Throws std::invalid_argument if the code books of an agent, one set for each dimension, would
/// need more memory than the default limit of a table, or than its weights if these are larger.
/// Files do not contain code books, so damaged settings could make them of any size.
template <class Config>
void expect_code_room(const Config& config, double weight_bytes, double n_dimensions) {
  const double n_bytes = coding::pattern_bytes_of(config, coding::n_bins_of(config));
  const double most = static_cast<double>(core::kDefaultMaxTableBytes) / n_dimensions;
  core::require(n_bytes <= std::max(most, weight_bytes), "n_interpolated or n_symbols",
                "smaller: code books would not fit", n_bytes);
}

}  // namespace detail

/// Throws std::invalid_argument unless the agent's arrays in a saved state have the sizes that
/// follow from the settings. It is called before memory is allocated by the settings, so that a
/// damaged file cannot cause large allocations. With `has_tables` the state has the code books.
template <class Reader>
void expect_sizes(const Reader& reader, const AnyApproximatorConfig& config,
                  const AnyLearningConfig& learning, const std::vector<std::size_t>& n_actions,
                  bool has_tables) {
  const std::string name = "agent.action_value.";
  if (const auto* const linear = std::get_if<approximators::LinearSDNNConfig>(&config)) {
    if (const auto* const actor_critic = std::get_if<ActorCriticConfig>(&learning)) {
      const auto thermometers = has_tables ? approximators::Thermometers()
                                           : detail::thermometers_of(*linear, *actor_critic);
      const double n_columns = detail::n_columns_of(*linear, thermometers);
      reader.expect_size(name + "weights", n_columns);
      reader.expect_size("agent.actor.weights", n_columns * detail::n_rows_of(n_actions));
      if (!has_tables) detail::expect_code_room(*linear, 4.0 * n_columns, 1.0);
      return;
    }
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

/// Makes an approximator for each dimension of actions by `make(config, seed)`. They differ in
/// their numbers of actions and in their seeds, and share the limit of memory equally. The number
/// of a single dimension, or of real numbers (n_actions[d] = 0), is the configuration's.
template <class Config, class Make>
auto each_dimension(Config config, const std::vector<std::size_t>& n_actions, std::uint64_t seed,
                    const Make& make) {
  std::vector<decltype(make(config, seed))> parts;
  parts.reserve(n_actions.size());
  config.max_table_bytes /= n_actions.size();
  for (std::size_t d = 0; d < n_actions.size(); ++d) {
    if (n_actions.size() > 1 && n_actions[d] > 0) config.n_actions = static_cast<int>(n_actions[d]);
    parts.push_back(make(config, seed_of_dimension(seed, d)));
  }
  return parts;
}
/// `make` for approximators without random numbers.
template <class Approximator>
constexpr auto kMakeUnseeded =
    [](const auto& config, std::uint64_t /*seed*/) { return Approximator(config); };

}  // namespace detail

/// Makes an agent with n_actions[d] actions in each dimension d. Throws std::invalid_argument or
/// std::length_error for impossible settings of a part.
///
/// `tables` are the custom patterns of each input; with SDNN-C they require actions of one
/// dimension. Without them, the patterns of an input follow from the settings; with `codes_missing`
/// there is another for missing readings, the last one. `n_first` inputs of a linear readout
/// existed before others were added, 0 if none was; see LinearSDNN.
inline AnyAgent make_agent(const AnyApproximatorConfig& config, const AnyLearningConfig& learning,
                           const std::vector<std::size_t>& n_actions, std::uint64_t seed,
                           const std::vector<coding::PatternTable>& tables = {},
                           std::size_t n_first = 0, bool codes_missing = false) {
  using namespace approximators;
  const bool fits = is_fuzzy(config)    ? std::holds_alternative<FuzzyQLearningConfig>(learning)
                    : is_linear(config) ? std::holds_alternative<QLambdaConfig>(learning) ||
                                              std::holds_alternative<ActorCriticConfig>(learning)
                                        : std::holds_alternative<QLearningConfig>(learning);
  core::require(fits, "learning",
                "FuzzyQLearningConfig with fuzzy rules, QLambdaConfig or ActorCriticConfig with a "
                "linear readout, else QLearningConfig",
                "another one");
  core::require(tables.empty() || is_linear(config) || (is_sdnn(config) && n_actions.size() == 1),
                "tables", "None where actions have several dimensions", tables.size());
  if (const auto* const rules = std::get_if<FuzzyRulesConfig>(&config)) {
    return FuzzyQLearning(
        detail::each_dimension(*rules, n_actions, seed, detail::kMakeUnseeded<FuzzyRules>),
        std::get<FuzzyQLearningConfig>(learning), seed);
  }
  if (const auto* const linear = std::get_if<LinearSDNNConfig>(&config)) {
    const auto books = [&, config = with_pattern_units(*linear)] {
      if (!tables.empty()) return tables;
      return codes_missing ? code_books_with_missing(config, seed) : code_books_of(config, seed);
    };
    if (const auto* const rule = std::get_if<ActorCriticConfig>(&learning)) {
      return detail::make_actor_critic(
          *linear, *rule, n_actions, books(),
          tables.empty() ? detail::thermometers_of(*linear, *rule) : Thermometers(), seed);
    }
    return QLambda(LinearSDNN(*linear, n_actions, books(), seed, tables.empty() ? n_first : 0),
                   std::get<QLambdaConfig>(learning), seed);
  }
  const auto& rule = std::get<QLearningConfig>(learning);
  if (const auto* const rbf = std::get_if<RBFNetworkConfig>(&config)) {
    return QLearning(
        detail::each_dimension(*rbf, n_actions, seed, detail::kMakeUnseeded<RBFNetwork>), rule,
        seed);
  }
  const auto make = [&](const SDNNCConfig& network, std::uint64_t network_seed) {
    if (!tables.empty()) return SDNNC(network, tables, network_seed);
    if (!codes_missing) return SDNNC(network, network_seed);
    return SDNNC(network, code_books_with_missing(network, network_seed), network_seed);
  };
  return QLearning(detail::each_dimension(std::get<SDNNCConfig>(config), n_actions, seed, make),
                   rule, seed);
}

}  // namespace sdnn::agents
