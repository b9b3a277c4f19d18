/// How observed variables use their ranges, for warnings about ranges that do not fit.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdnn/agents/observation_scale.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/core/pcg64.hpp"

namespace sdnn::agents {

/// The part of its range that an observed variable has recently used.
struct RangeUse {
  double share_used;    ///< the part of the range from the 5 % to the 95 % quantile of its values
  double share_beyond;  ///< the share of its values that were outside the range
};

/// Notes about one in eight observations, and remembers about the last 256 notes.
class RangeNotes {
 public:
  explicit RangeNotes(std::size_t n_variables)
      : n_variables_(n_variables),
        most_(std::clamp(kMostValues / n_variables, kRare, kMostNoted)),
        n_until_noted_(gap()) {}

  /// Notes one in about eight observations, in the place of an old one. Shape: (n_variables,).
  void note(std::span<const double> observation) {
    if (--n_until_noted_ > 0) return;
    n_until_noted_ = gap();
    if (notes_.size() < most_ * n_variables_) {
      notes_.insert(notes_.end(), observation.begin(), observation.end());
    } else {
      std::ranges::copy(observation,
                        notes_.begin() + static_cast<std::ptrdiff_t>(oldest_ * n_variables_));
      oldest_ = (oldest_ + 1) % most_;
    }
  }

  /// Returns for each variable the part of its range that is in use; nothing for variables of
  /// angles and symbols, and before there are enough observations.
  std::vector<std::optional<RangeUse>> use(const Observations& observations) const {
    std::vector<std::optional<RangeUse>> use(n_variables_);
    for (const ObservedInput& input : observations.inputs()) {
      if (input.kind != ObservedKind::variable) continue;
      const std::size_t i = input.first;
      const double low = observations.low()[i], high = observations.high()[i];
      std::vector<double> noted;
      std::size_t n_beyond = 0;
      for (std::size_t k = i; k < notes_.size(); k += n_variables_) {
        if (!std::isfinite(notes_[k])) continue;  // missing
        if (notes_[k] < low || notes_[k] > high) ++n_beyond;
        noted.push_back(std::clamp(notes_[k], low, high));
      }
      const std::size_t n = noted.size();
      if (n < kRare) continue;
      std::ranges::sort(noted);
      const std::size_t n_rare = n / kRare;
      use[i] = {(noted[n - 1 - n_rare] - noted[n_rare]) / (high - low),
                static_cast<double>(n_beyond) / static_cast<double>(n)};
    }
    return use;
  }

 private:
  // Chosen constants.
  static constexpr std::size_t kRare = 20;             // 1 in 20 values at each end is rare
  static constexpr std::size_t kMostNoted = 256;       // notes that are remembered
  static constexpr std::size_t kMostValues = 1 << 20;  // numbers in all notes, which limits memory

  /// Draws the observations to the next note; equal gaps could be in phase with episodes.
  std::uint32_t gap() noexcept { return 1 + gaps_.below(15); }

  std::size_t n_variables_, most_;  ///< most_: the number of notes that are remembered
  core::Pcg64 gaps_{std::array<std::uint64_t, 1>{0}};
  std::uint32_t n_until_noted_;
  std::vector<double> notes_;
  std::size_t oldest_ = 0;  ///< the number of the oldest note in a full list
};

}  // namespace sdnn::agents
