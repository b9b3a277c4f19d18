/// The wiring of a state's code: code books, pairs and permutations from config and seed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/permutation.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/coding/state_code_config.hpp"
#include "sdnn/coding/symbol_patterns.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

// In this file Config is the configuration of an approximator. It has the fields of
// coding/state_code_config.hpp, and an overload of require_room(config, n_bins), which throws if
// the approximator would need too much memory.

namespace sdnn::approximators {

/// Returns the number of inputs, after a check of all fields.
template <class Config>
std::size_t checked_inputs(const Config& config) {
  core::check_fields(config);
  return static_cast<std::size_t>(config.n_inputs);
}

/// Draws the patterns of every input, by anchors or of symbols. Throws std::invalid_argument naming
/// the impossible field, and std::length_error, before an allocation, beyond max_table_bytes.
template <class Config>
std::vector<coding::PatternTable> code_books_of(const Config& config, std::uint64_t seed) {
  const std::size_t l = checked_inputs(config);
  core::require(config.circular.empty() || config.circular.size() == l, "circular",
                "empty or one flag per input", config.circular.size());
  core::require(config.n_symbols.empty() || config.n_symbols.size() == l, "n_symbols",
                "empty or a number per input", config.n_symbols.size());
  const auto n_symbols_of = [&config](std::size_t mu) {
    return config.n_symbols.empty() ? 0 : config.n_symbols[mu];
  };
  const auto is_circular = [&config](std::size_t mu) {
    return !config.circular.empty() && config.circular[mu];
  };
  for (std::size_t mu = 0; mu < l; ++mu) {
    core::require(n_symbols_of(mu) == 0 || !is_circular(mu), "circular",
                  "false for an input of symbols", true);
  }
  require_room(config, coding::n_bins_of(config));
  std::vector<coding::PatternTable> tables;
  for (std::size_t mu = 0; mu < l; ++mu) {
    core::Random random(seed, core::Stream::code_books, mu);
    tables.push_back(n_symbols_of(mu) > 0
                         ? coding::symbol_patterns(n_symbols_of(mu), config.n_pattern_units,
                                                   config.balanced_anchors, random)
                         : coding::anchor_patterns({.n_units = config.n_pattern_units,
                                                    .n_anchor_patterns = config.n_anchor_patterns,
                                                    .n_interpolated = config.n_interpolated,
                                                    .balanced = config.balanced_anchors,
                                                    .circular = is_circular(mu)},
                                                   random));
  }
  return tables;
}

/// Adds a random pattern, for missing readings, to the end of each table, except to the tables of
/// inputs with symbols (symbols[mu] > 0), where a symbol already stands for them.
template <class Config>
std::vector<coding::PatternTable> with_missing_patterns(const Config& config,
                                                        std::vector<coding::PatternTable> tables,
                                                        std::span<const int> symbols,
                                                        std::uint64_t seed) {
  constexpr std::size_t kFirstStream = 1024;  // earlier streams draw the other patterns
  for (std::size_t mu = 0; mu < tables.size(); ++mu) {
    if (mu < symbols.size() && symbols[mu] > 0) continue;
    core::Random random(seed, core::Stream::code_books, kFirstStream + mu);
    tables[mu] = coding::with_random_pattern(tables[mu], config.balanced_anchors, random);
  }
  return tables;
}
/// Draws the patterns of every input; the last pattern of each stands for missing readings.
template <class Config>
std::vector<coding::PatternTable> code_books_with_missing(const Config& config,
                                                          std::uint64_t seed) {
  return with_missing_patterns(config, code_books_of(config, seed), config.n_symbols, seed);
}

/// Draws the strides of the code, in ascending order: input mu is paired with the inputs mu +
/// stride in the circle of inputs.
template <class Config>
std::vector<std::size_t> strides_of(const Config& config, std::uint64_t seed) {
  core::Random random(seed, core::Stream::pairs);
  coding::Permutation order = coding::random_permutation(checked_inputs(config) - 1, random);
  order.resize(static_cast<std::size_t>(coding::n_partners_of(config)));
  std::ranges::sort(order);
  std::vector<std::size_t> strides;
  for (const auto index : order) strides.push_back(std::size_t{index} + 1);  // from 1 on
  return strides;
}

/// Returns the number of the random stream that draws a pair's permutation. The pairs among the
/// first `n_first` inputs are numbered in the paper's order, then come the pairs of each added
/// input. So the permutations of the first inputs do not depend on how many inputs are added.
inline std::size_t stream_of_pair(std::size_t mu, std::size_t nu, std::size_t n_first) noexcept {
  const std::size_t last = std::max(mu, nu);
  if (last < n_first) return mu * (n_first - 1) + nu - (nu > mu ? 1 : 0);
  return last * (last - 1) + 2 * std::min(mu, nu) + (mu > nu ? 1 : 0);
}

/// Makes the code over these tables, with a random permutation for each pair. If `n_first` is not
/// 0, which needs all pairs, the permutations among the first `n_first` inputs are the same as
/// without the other inputs. Throws std::invalid_argument if the tables do not fit the config, and
/// std::length_error beyond max_table_bytes.
template <class Config>
std::shared_ptr<const coding::StateCode> wiring_of(const Config& config,
                                                   std::vector<coding::PatternTable> tables,
                                                   std::uint64_t seed, std::size_t n_first = 0) {
  const std::size_t l = checked_inputs(config);
  core::require(tables.size() == l, "tables", "one per input", tables.size());
  std::size_t n_bins = 0;
  for (const coding::PatternTable& table : tables) {
    core::require(table.n_units() == static_cast<std::size_t>(config.n_pattern_units), "tables",
                  "of n_pattern_units = " + std::to_string(config.n_pattern_units) + " units",
                  table.n_units());
    n_bins += table.n_bins();
  }
  require_room(config, static_cast<double>(n_bins));
  const std::vector<std::size_t> strides = strides_of(config, seed);
  std::vector<coding::Permutation> permutations;
  for (std::size_t group = 0; group < l * strides.size(); ++group) {
    const std::size_t mu = group / strides.size();
    const std::size_t rank = group % strides.size();
    const std::size_t stream =
        n_first == 0 ? group : stream_of_pair(mu, rank + (rank >= mu ? 1 : 0), n_first);
    core::Random random(seed, core::Stream::permutations, stream);
    permutations.push_back(
        coding::random_permutation(static_cast<std::size_t>(config.n_pattern_units), random));
  }
  return std::make_shared<const coding::StateCode>(std::move(tables), std::move(permutations),
                                                   strides);
}

/// Copies rows of weights for the code `fewer` to rows for the code `more`, which has more inputs,
/// such that the products of rows and codes stay the same. Both codes have all pairs of their
/// inputs and equal numbers of units. Elsewhere `to` must be 0. Shapes: from (n_rows, slots of
/// `fewer`), to (n_rows, slots of `more`).
///
/// In the paired code the groups of a modifier are half sums and half differences of two groups. If
/// their number is odd, the last group x is unpaired. With more inputs it may get a partner y: then
/// x = (x + y) / 2 + (x - y) / 2, so both halves get the weight of x.
inline void copy_to_more_inputs(const coding::StateCode& fewer, std::span<const std::int32_t> from,
                                const coding::StateCode& more, std::span<std::int32_t> to) {
  const std::size_t n_columns = 64 * more.n_words() / more.n_groups();
  const std::size_t n_from = 64 * fewer.n_words(), n_to = 64 * more.n_words();
  // The groups of each modifier that are in pairs: the even part of its number of groups.
  const std::size_t n_before = fewer.n_partners(), n_now = more.n_partners();
  const std::size_t paired_before = n_before / 2 * 2, paired_now = n_now / 2 * 2;
  for (std::size_t row = 0; row < to.size() / n_to; ++row) {
    const auto copy = [&](std::size_t group, std::size_t group_now) {
      std::copy_n(&from[row * n_from + group * n_columns], n_columns,
                  &to[row * n_to + group_now * n_columns]);
    };
    for (std::size_t nu = 0; nu < fewer.n_inputs(); ++nu) {
      for (std::size_t k = 0; k < paired_before; ++k) {
        copy(nu * paired_before + k, nu * paired_now + k);
      }
      if (paired_before == n_before) continue;
      const std::size_t last = fewer.n_inputs() * paired_before + nu;
      if (paired_now > paired_before) {
        copy(last, nu * paired_now + paired_before);
        copy(last, nu * paired_now + paired_before + 1);
      } else {
        copy(last, more.n_inputs() * paired_now + nu);
      }
    }
  }
}

}  // namespace sdnn::approximators
