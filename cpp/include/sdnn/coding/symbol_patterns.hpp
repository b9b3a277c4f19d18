/// The code of symbols without order: a random pattern for each.
#pragma once

#include <cstddef>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// Draws n_symbols independent patterns, so that nothing is generalized between symbols.
///
/// `balanced` patterns have equal numbers of +1 and -1; other patterns have independent fair units.
/// Source: the anchors of section 3.1 (layer 2). Throws std::invalid_argument naming the impossible
/// argument.
inline PatternTable symbol_patterns(int n_symbols, int n_units, bool balanced,
                                    core::Random& random) {
  core::require_in_range("n_symbols", n_symbols, 1, 1 << 24);
  core::require_in_range("n_units", n_units, 2, 1 << 24);
  PatternTable table(static_cast<std::size_t>(n_symbols), static_cast<std::size_t>(n_units));
  for (std::size_t symbol = 0; symbol < table.n_bins(); ++symbol) {
    core::interruption_point();
    fill_random(table, symbol, balanced, random);
  }
  return table;
}

/// Makes patterns with a unit for each of n_symbols, of which only that of the symbol is +1.
///
/// An input that is modified by itself then has a single non-neutral unit in each group, a
/// different one for each symbol. The weights are then an exact table.
inline PatternTable one_hot_patterns(std::size_t n_symbols) {
  PatternTable table(n_symbols, n_symbols);
  for (std::size_t symbol = 0; symbol < n_symbols; ++symbol) table.set(symbol, symbol);
  return table;
}

}  // namespace sdnn::coding
