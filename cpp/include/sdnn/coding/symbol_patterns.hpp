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

/// Makes a pattern of n_symbols units for each symbol: unit k is +1 for symbol k, all others are
/// -1.
///
/// If an input with these patterns is modified by itself, its only unit that is not neutral is the
/// symbol's. A weight then belongs to a single symbol, and the weights are an exact table.
inline PatternTable one_hot_patterns(std::size_t n_symbols) {
  PatternTable table(n_symbols, n_symbols);
  for (std::size_t symbol = 0; symbol < n_symbols; ++symbol) table.set(symbol, symbol);
  return table;
}

}  // namespace sdnn::coding
