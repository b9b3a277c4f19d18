/// The paper's learning rule: which units to correct.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

namespace sdnn::approximators {

/// Selects the units of a window whose correction moves the number of active ones by `deficit`.
///
/// The window is split in index order into |deficit| contiguous subsets, cut at
/// floor(i * size / |deficit|). Of each, the unit nearest to its threshold is taken among the
/// inactive ones (deficit > 0: they should become active) or the active ones (deficit < 0); equal
/// distances go to the lowest index, and a subset without such a unit gives none. Nothing is
/// selected when deficit is 0.
///
/// Source: Fig. 2, steps 1 and 2. Shapes: potentials (n',), those of the window's units; `selected`
/// is overwritten with positions in the window. Requires |deficit| <= n' and |potential| < 2^31.
inline void select_units(std::span<const std::int32_t> potentials, int deficit,
                         std::vector<std::uint32_t>& selected) {
  selected.clear();
  const auto n_subsets = static_cast<std::size_t>(std::abs(deficit));
  assert(n_subsets <= potentials.size());
  const bool want_active = deficit < 0;
  constexpr std::uint32_t kNone = std::uint32_t{1} << 31;
  for (std::size_t i = 0; i < n_subsets; ++i) {
    const std::size_t begin = i * potentials.size() / n_subsets;
    const std::size_t end = (i + 1) * potentials.size() / n_subsets;
    std::uint32_t nearest = kNone;
    std::size_t best = end;
    for (std::size_t unit = begin; unit < end; ++unit) {
      const auto h = static_cast<std::uint32_t>(potentials[unit]);
      const std::uint32_t distance = want_active ? h - 1 : 0 - h;  // kNone or more for the others
      if (distance < nearest) {
        nearest = distance;
        best = unit;
      }
    }
    if (best != end) selected.push_back(static_cast<std::uint32_t>(best));
  }
}

}  // namespace sdnn::approximators
