/// The ladder of compiled capacities: sizes are run-time numbers, storage comes in a few rungs.
#pragma once

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace sdnn::core {

/// One rung: how many units a pattern may have.
inline constexpr std::array<std::size_t, 3> kPatternCapacities = {256, 1024, 4096};

/// The number of the first rung that holds `n_pattern_units`.
///
/// Throws std::length_error naming the largest rung if none does.
inline std::size_t smallest_fit(std::size_t n_pattern_units) {
  for (std::size_t rung = 0; rung < kPatternCapacities.size(); ++rung) {
    if (n_pattern_units <= kPatternCapacities[rung]) return rung;
  }
  throw std::length_error("n_pattern_units must be at most " +
                          std::to_string(kPatternCapacities.back()) + ", got " +
                          std::to_string(n_pattern_units));
}

}  // namespace sdnn::core
