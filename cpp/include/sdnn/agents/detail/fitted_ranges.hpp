/// Fits the ranges of observations to observed values.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/agents/detail/circles.hpp"
#include "sdnn/agents/observations.hpp"

namespace sdnn::agents {

/// Fits unknown ranges and narrows those that are much too wide. `seen` has observations, then as
/// many next ones.
inline void Observations::fit(std::span<const double> seen, double headroom) {
  const auto pairs = config_.find_angle_pairs ? pairs_in(seen) : config_.angle_pairs;
  for (std::size_t i = 0; running_ && i < seen.size() / 2; i += n_variables()) {
    running_->note(seen.subspan(i, n_variables()));
  }
  Ranges ranges = fixed_ranges(pairs);
  const bool narrows = config_.narrowed && inputs_with(pairs).size() <= kFewInputs;
  for (std::size_t i = 0; i < n_variables(); ++i) {
    if (is_unknown(ranges.low[i])) {
      std::tie(ranges.low[i], ranges.high[i]) =
          fitted_range(detail::column(seen, n_variables(), i), i, headroom);
    } else if (narrows && roles_[i] == Role::number && !is_one_of(pairs, i)) {
      narrow(ranges, i, detail::column(seen, n_variables(), i), headroom);
    }
  }
  take(ranges, pairs);
}

/// Replaces the range of variable i by a fitted one if it is much wider than the observed values
/// and contains them.
inline void Observations::narrow(Ranges& ranges, std::size_t i, const std::vector<double>& seen,
                                 double headroom) {
  const auto [least, most] = std::ranges::minmax(seen);
  const double rounding = kRounding * std::max(std::abs(least), std::abs(most));
  if (!(most - least > rounding)) return;
  const auto [low, high] = widened(least, most, headroom);
  const bool is_much_wider = ranges.high[i] - ranges.low[i] > kMuchWider * (high - low);
  const bool is_within = least >= ranges.low[i] && most <= ranges.high[i];
  if (!is_much_wider || !is_within) return;
  ranges.low[i] = std::max(low, ranges.low[i]);
  ranges.high[i] = std::min(high, ranges.high[i]);
}

/// The range with `headroom` times its width more at each end; for a constant, times its size.
inline std::pair<double, double> Observations::widened(double low, double high,
                                                       double headroom) noexcept {
  low = std::clamp(low, -kLargest, kLargest);
  high = std::clamp(high, -kLargest, kLargest);
  const double width = high > low ? high - low : std::max(std::abs(high), 1.0);
  return {low - headroom * width, high + headroom * width};
}

/// Returns the range of variable i that fits its observed values. Adaptive ranges leave out the
/// most extreme twentieth at each end; a variable that hardly moves keeps its fixed range.
inline std::pair<double, double> Observations::fitted_range(std::vector<double> seen, std::size_t i,
                                                            double headroom) const {
  std::ranges::sort(seen);
  auto [low, high] = widened(seen.front(), seen.back(), headroom);
  if (!config_.adaptive) return {low, high};
  const std::size_t n_rare = seen.size() / kRare;
  const double first = seen[n_rare], last = seen[seen.size() - 1 - n_rare];
  if (const auto bounds = fixed_range(i)) std::tie(low, high) = *bounds;
  if (!(last > first)) return {low, high};
  const auto [wide_low, wide_high] = widened(first, last, headroom);
  return {std::max(wide_low, std::min(low, first)), std::min(wide_high, std::max(high, last))};
}

}  // namespace sdnn::agents
