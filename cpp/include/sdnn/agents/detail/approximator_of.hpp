/// The settings of an approximator that follow from a task, and patterns in an agent's state.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sdnn/agents/actions.hpp"
#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/controller_config.hpp"
#include "sdnn/agents/history.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/approximators/detail/state_wiring.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/symbol_patterns.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents::detail {

/// Whether a linear readout has separate weights for every state: if states are countable and few
/// enough, so that this needs no more columns, and neither units nor patterns are set.
inline bool is_table(const ControllerConfig& config, const Observations& observations,
                     const std::vector<coding::PatternTable>& tables) noexcept {
  constexpr std::size_t kMostStates = 1536;  // a table of n states has 2 n columns, others 3,072
  const auto* const linear = std::get_if<approximators::LinearSDNNConfig>(&config.approximator);
  const std::size_t n = observations.n_states();
  return linear != nullptr && linear->n_pattern_units == 0 && tables.empty() && n >= 2 &&
         n <= kMostStates;
}

/// The number of bins of each input with tables; else a single number, that of inputs that are no
/// symbols. Empty for approximators without codes.
inline std::vector<std::size_t> n_bins_of_inputs(const AnyApproximatorConfig& approximator,
                                                 const std::vector<coding::PatternTable>& tables) {
  std::vector<std::size_t> n_bins;
  for (const coding::PatternTable& table : tables) n_bins.push_back(table.n_bins());
  std::visit(
      [&n_bins](const auto& config) {
        if constexpr (requires { config.n_anchor_patterns; }) {
          if (!n_bins.empty()) return;
          const auto n_anchors = static_cast<std::size_t>(std::max(config.n_anchor_patterns, 2));
          const auto n_portions = static_cast<std::size_t>(std::max(config.n_interpolated, 0)) + 1;
          n_bins.push_back((n_anchors - 1) * n_portions);
        }
      },
      approximator);
  return n_bins;
}

/// Returns the patterns of each input, or nothing if they follow from the approximator's settings:
/// one-hot patterns of a table of states, or the custom `tables`, with an additional pattern for
/// missing readings where these are coded.
inline std::vector<coding::PatternTable> tables_of(const ControllerConfig& config,
                                                   const Observations& observations,
                                                   const AnyApproximatorConfig& approximator,
                                                   std::vector<coding::PatternTable> tables) {
  if (is_table(config, observations, tables)) {
    return {2, coding::one_hot_patterns(observations.n_states())};
  }
  if (!observations.codes_missing()) return tables;
  return std::visit(
      [&](const auto& coded) {
        if constexpr (requires { coded.balanced_anchors; }) {
          return approximators::with_missing_patterns(coded, std::move(tables), {}, config.seed);
        } else {
          return tables;
        }
      },
      approximator);
}

/// The default limit of the number of pairs, which bounds the time of a linear readout's step; 0:
/// no limit. It applies only if inputs are selected, and allows all pairs of 32 inputs, 32 * 31.
inline int most_pairs(const ControllerConfig& config, std::int64_t n_inputs) noexcept {
  constexpr int kMost = 1024;
  const bool is_chosen = is_linear(config.approximator) && config.observation.relevant_only;
  return is_chosen && n_inputs * (n_inputs - 1) > kMost ? kMost : 0;
}

/// Returns the approximator's settings with the inputs (numbers, circular ones and symbols) and
/// actions of a task whose ranges are known. Throws std::invalid_argument for tables that do not
/// fit the symbols.
inline AnyApproximatorConfig approximator_of(const ControllerConfig& config,
                                             const Observations& observations,
                                             const HistoryFilter& history, const Actions& actions,
                                             const std::vector<coding::PatternTable>& tables) {
  const auto fill_in_sizes = [&](auto& sized) {
    sized.n_inputs = static_cast<int>(history.n_inputs());
    if (config.action.discrete && actions.n_dimensions() == 1 && !is_fuzzy(config.approximator)) {
      sized.n_actions = static_cast<int>(actions.n_actions().front());
    }
  };
  const auto fill_in_code = [&](auto& coded) {
    if constexpr (requires { coded.circular; }) {
      const auto circular = history.is_none() ? observations.circular() : history.circular();
      const auto n_symbols = history.is_none() ? observations.n_symbols() : history.n_symbols();
      const auto has = [](const auto& list) {
        return std::ranges::any_of(list, [](auto number) { return number != 0; });
      };
      if (has(circular) && coded.circular.empty()) coded.circular = circular;
      if (has(n_symbols) && coded.n_symbols.empty()) coded.n_symbols = n_symbols;
      if constexpr (requires { coded.action_window; }) {
        if (config.action.discrete) coded.action_window = 1;
        if (is_table(config, observations, tables)) {
          coded.n_pattern_units = static_cast<int>(observations.n_states());
        }
        auto first = coded;  // the first inputs decide the units, which added inputs do not change
        if (history.is_none()) first.n_inputs = static_cast<int>(observations.n_first_inputs());
        if (coded.max_pairs == 0) {
          coded.max_pairs = first.max_pairs = most_pairs(config, first.n_inputs);
        }
        coded.n_pattern_units = approximators::with_pattern_units(first).n_pattern_units;
      }
      for (std::size_t i = 0; i < std::min(tables.size(), n_symbols.size()); ++i) {
        auto n = static_cast<std::size_t>(n_symbols[i]);
        if (n > 0 && observations.codes_missing()) --n;
        core::require(n == 0 || tables[i].n_bins() == n, "tables[" + std::to_string(i) + "]",
                      "of a row for each of " + std::to_string(n) + " symbols", tables[i].n_bins());
      }
    }
  };
  AnyApproximatorConfig filled = config.approximator;
  std::visit(fill_in_sizes, filled);
  std::visit(fill_in_code, filled);
  return filled;
}

inline std::string name_of_table(std::size_t i) { return "table." + std::to_string(i); }

/// Lists the signs of custom patterns. A reader only checks them: tables_in has made the tables.
template <class Archive>
void serialize_tables(const std::vector<coding::PatternTable>& tables, Archive& archive) {
  for (std::size_t i = 0; i < tables.size(); ++i) {
    std::vector<std::int8_t> signs;
    signs.reserve(tables[i].n_bins() * tables[i].n_units());
    for (std::size_t bin = 0; bin < tables[i].n_bins(); ++bin) {
      for (std::size_t k = 0; k < tables[i].n_units(); ++k) {
        signs.push_back(static_cast<std::int8_t>(tables[i].sign(bin, k)));
      }
    }
    archive.fixed(name_of_table(i), {tables[i].n_bins(), tables[i].n_units()}, signs);
  }
}

/// Returns the custom patterns in a state. Throws std::invalid_argument naming a bad tensor.
inline std::vector<coding::PatternTable> tables_in(const core::State& state) {
  std::vector<coding::PatternTable> tables;
  for (;;) {
    const std::string name = name_of_table(tables.size());
    const auto item = state.find(name);
    if (item == state.end()) return tables;
    const core::Tensor& tensor = item->second;
    const bool is_table = tensor.type == core::TensorType::i8 && tensor.shape.size() == 2 &&
                          tensor.shape[0] * tensor.shape[1] == tensor.bytes.size();
    core::require(is_table, "state: " + name, "a table of I8", tensor.shape.size());
    const auto* const signs = reinterpret_cast<const std::int8_t*>(tensor.bytes.data());
    tables.push_back(coding::PatternTable::from_signs({signs, tensor.bytes.size()}, tensor.shape[0],
                                                      tensor.shape[1]));
  }
}

}  // namespace sdnn::agents::detail
