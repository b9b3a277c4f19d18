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

inline void Observations::fit(std::span<const double> observations, double headroom) {
  const auto pairs = config_.find_angle_pairs ? pairs_in(observations) : config_.angle_pairs;
  if (running_) {  // the observations before steps; those after them are mostly the same
    for (std::size_t i = 0; i < observations.size() / 2; i += n_variables()) {
      running_->note(observations.subspan(i, n_variables()));
    }
  }
  Ranges ranges = fixed_ranges(pairs);
  const bool narrows = config_.narrowed && inputs_with(pairs).size() <= kFewInputs;
  for (std::size_t i = 0; i < n_variables(); ++i) {
    if (is_unknown(ranges.low[i])) {
      std::tie(ranges.low[i], ranges.high[i]) =
          fitted_range(detail::column(observations, n_variables(), i), i, headroom);
    } else if (narrows && roles_[i] == Role::number && !is_one_of(pairs, i)) {
      narrow(ranges, i, detail::column(observations, n_variables(), i), headroom);
    }
  }
  set_ranges(ranges, pairs);
}

/// Finds neighbouring variables that are cosine and sine of an angle.
inline Observations::Pairs Observations::pairs_in(std::span<const double> observations) const {
  Pairs pairs;
  for (std::size_t i = 0; i + 1 < n_variables(); ++i) {
    if (roles_[i] != Role::number || roles_[i + 1] != Role::number) continue;
    const auto [cosines, sines] = detail::columns(observations, n_variables(), i, i + 1);
    if (detail::is_on_circle(cosines, sines) || detail::is_around_circle(cosines, sines)) {
      pairs.push_back({static_cast<int>(i), static_cast<int>(i + 1)});
      ++i;  // the sine is no part of another pair
    }
  }
  return pairs;
}

/// Replaces the range of variable i by one that is fitted to its observed values, if it is much
/// wider and contains the values. A variable that hardly moves keeps its range.
inline void Observations::narrow(Ranges& ranges, std::size_t i, const std::vector<double>& values,
                                 double headroom) {
  const auto [least, most] = std::ranges::minmax(values);
  const double rounding = kRounding * std::max(std::abs(least), std::abs(most));
  if (!(most - least > rounding)) return;
  const auto [low, high] = widened(least, most, headroom);
  const bool is_much_wider = ranges.high[i] - ranges.low[i] > kMuchWider * (high - low);
  const bool is_within = least >= ranges.low[i] && most <= ranges.high[i];
  if (!is_much_wider || !is_within) return;
  ranges.low[i] = std::max(low, ranges.low[i]);
  ranges.high[i] = std::min(high, ranges.high[i]);
}

/// Returns a range that is wider at each end by `headroom` times its width. The width of a single
/// value x counts as the larger of |x| and 1.
inline std::pair<double, double> Observations::widened(double low, double high,
                                                       double headroom) noexcept {
  low = std::clamp(low, -kLargest, kLargest);
  high = std::clamp(high, -kLargest, kLargest);
  const double width = high > low ? high - low : std::max(std::abs(high), 1.0);
  return {low - headroom * width, high + headroom * width};
}

/// Returns the range of variable i that fits its observed values. Adaptive ranges leave out the
/// most extreme twentieth at each end, and stay within the fixed range unless other values are
/// observed. A variable that hardly moves keeps its fixed range.
inline std::pair<double, double> Observations::fitted_range(std::vector<double> values,
                                                            std::size_t i, double headroom) const {
  std::ranges::sort(values);
  auto [low, high] = widened(values.front(), values.back(), headroom);
  if (!config_.adaptive) return {low, high};
  const std::size_t n_rare = values.size() / kRare;
  const double first = values[n_rare], last = values[values.size() - 1 - n_rare];
  if (const auto bounds = fixed_range(i)) std::tie(low, high) = *bounds;
  if (!(last > first)) return {low, high};
  const auto [wide_low, wide_high] = widened(first, last, headroom);
  return {std::max(wide_low, std::min(low, first)), std::min(wide_high, std::max(high, last))};
}

}  // namespace sdnn::agents
