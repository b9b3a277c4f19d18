/// Member functions of LinearSDNN that are used outside the usual step of learning: moves of whole
/// rows, for imitation, and doublings of the unit that keep weights in their range.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"

namespace sdnn::approximators {

/// Doubles the unit, which halves the weights, until all are below kLargestWeight in size. `used`
/// has the bits that are set in the magnitude of any weight.
inline void LinearSDNN::shrink_weights(std::int32_t used) noexcept {
  while (used >= kLargestWeight) {
    double_unit();
    used >>= 1;
    // Rounding up may leave a weight of kLargestWeight, although its halved bits were below it.
    if (std::ranges::find(weights_, kLargestWeight) != weights_.end()) used |= kLargestWeight;
  }
}

/// Moves the sum of every row over the code by rate * error, in equal steps of the weights that the
/// code uses.
inline int LinearSDNN::move_rows(const Code& code, std::span<const std::int64_t> errors,
                                 std::int32_t rate) {
  assert(errors.size() == n_rows());
  // The rate of each weight, from units of 2^-16 to units of 2^-28.
  const std::int64_t rate_per_weight = (std::int64_t{rate} << 12) / n_weights_of(code);
  const std::int32_t exponent = exponent_.value_or(0);
  std::vector<std::int64_t> steps(errors.begin(), errors.end());
  std::int64_t largest = 0;
  for (std::int64_t& step : steps) {
    step = scaled(std::clamp(step, -kLargestError, kLargestError), rate_per_weight, 28);
    largest = std::max(largest, std::abs(step));
  }
  for (; largest >= kLargestWeight; largest = halved(largest)) {
    double_unit();
    for (std::int64_t& step : steps) step = halved(step);
  }
  ++version_;
  std::int32_t used = 0;
  const std::int8_t* const signs = code.signs().data();
  for (std::size_t row = 0; row < n_rows_; ++row) {
    const auto step = static_cast<std::int32_t>(steps[row]);
    if (step == 0) continue;
    std::int32_t* const weights = &weights_[row * n_slots()];
    for (std::size_t j = 0; j < n_slots(); ++j) {
      weights[j] += step * signs[j];
      used |= weights[j] ^ (weights[j] >> 31);
    }
    versions_[row] = version_;
  }
  shrink_weights(used);
  if (config_.averaging_interval > 0) note_step();
  return exponent_.value_or(0) - exponent;
}

}  // namespace sdnn::approximators
