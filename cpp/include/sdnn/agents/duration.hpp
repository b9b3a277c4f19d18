/// The duration of a transition, and the discount over it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string_view>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::agents {

/// The limits (chosen) of a duration dt, in usual steps: those for which settings give discounts.
inline constexpr double kShortestDuration = 1e-3;
inline constexpr double kLongestDuration = 1e6;

constexpr bool is_duration(double dt) noexcept {
  return dt >= kShortestDuration && dt <= kLongestDuration;
}

/// Throws std::invalid_argument unless dt is within the limits.
inline void require_duration(double dt) {
  core::require(is_duration(dt), "dt", "a number of usual steps in [0.001, 1000000]", dt);
}

/// Returns discount^dt, the discount of a transition of dt usual steps, with the same bits
/// everywhere. Requires a discount in [0, 1].
inline double discount_over(double discount, double dt) noexcept {
  return dt == 1.0 ? discount : core::power(discount, dt);
}

/// Lists a duration, unless it is 1, a usual step.
template <class Archive, class Duration>
void serialize_duration(std::string_view name, Duration& dt, Archive& archive) {
  archive.number_unless(name, dt, 1.0);
  if constexpr (Archive::kReads) {
    archive.expect(is_duration(dt), name, "in [0.001, 1000000]");
  }
}

/// Throws unless there are durations of n rewards or none, which means that all are 1.
template <class Archive>
void expect_durations(const std::vector<double>& dts, std::size_t n, const Archive& archive) {
  archive.expect(dts.empty() || dts.size() == n, "dts", "one per reward, or none");
  archive.expect(std::ranges::all_of(dts, is_duration), "dts", "in [0.001, 1000000]");
}

/// Lists the durations of n rewards, unless all are 1.
template <class Archive>
void serialize_durations(std::vector<double>& dts, std::size_t n, Archive& archive) {
  if (std::ranges::count(dts, 1.0) == std::ssize(dts)) dts.clear();
  archive.some_numbers("dts", dts);
  if constexpr (Archive::kReads) {
    expect_durations(dts, n, archive);
    dts.resize(n, 1.0);
  }
}

}  // namespace sdnn::agents
