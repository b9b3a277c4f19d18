/// The layer with averaged weights, rounded to steps of the lattice.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "sdnn/approximators/detail/correction_log.hpp"
#include "sdnn/approximators/detail/paired_weights.hpp"
#include "sdnn/approximators/detail/weight_average.hpp"
#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/coding/state_code.hpp"

namespace sdnn::approximators {

namespace detail {

/// Returns value / 2^bits, halves rounded up.
inline std::int64_t rounded_average(std::int64_t value, int bits) noexcept {
  return (value + (std::int64_t{1} << (bits - 1))) >> bits;
}

}  // namespace detail

/// The averages of a threshold, and of the weight of the unit of x_SD with these columns, whose
/// magnitude is at most `limit`, so that sums of two are within a layer's range.
inline std::int32_t averaged_threshold(const WeightAverage& average, std::size_t unit) noexcept {
  return static_cast<std::int32_t>(
      detail::rounded_average(average.threshold(unit), WeightAverage::kFractionBits));
}
inline std::int32_t averaged_weight(const WeightAverage& average, std::size_t unit,
                                    const PairedColumns& columns, std::int64_t limit) noexcept {
  std::int64_t weight = average.weight(unit, columns.first);
  if (columns.paired) weight += columns.sign * std::int64_t{average.weight(unit, columns.second)};
  return static_cast<std::int32_t>(std::clamp(
      detail::rounded_average(weight, average.fraction_bits() + (columns.paired ? 1 : 0)), -limit,
      limit));
}

/// A constant layer of averaged weights, and its log for caches.
struct AveragedLayer {
  AveragedLayer(const WeightAverage& average, const coding::StateCode& code, std::size_t n_units,
                std::int64_t limit)
      : layer(paired_layer(
            code, n_units,
            [&](std::size_t unit, const PairedColumns& columns, std::size_t) {
              return averaged_weight(average, unit, columns, limit);
            },
            [&](std::size_t unit) { return averaged_threshold(average, unit); })) {}

  HiddenLayer layer;
  CorrectionLog log;
};

}  // namespace sdnn::approximators
