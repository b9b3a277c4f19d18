/// Errors by which imitation makes the value of the teacher's action the highest.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/approximators/linear_sdnn.hpp"

namespace sdnn::agents::detail {

/// Computes the errors of rows by which imitation separates actions: in each dimension, if the best
/// other action is less than `margin` below the teacher's action, both move apart. All numbers are
/// in the readout's units. Shape: errors (n_rows,).
inline void separate(const approximators::LinearSDNN& readout,
                     approximators::LinearSDNN::Workspace& read,
                     std::span<const std::size_t> action, std::int64_t margin,
                     std::vector<std::int64_t>& errors) {
  std::ranges::fill(errors, 0);
  const auto n_dimensions = static_cast<std::int64_t>(readout.n_dimensions());
  const auto window = static_cast<std::size_t>(readout.config().action_window);
  std::size_t first_row = 0;
  for (std::size_t d = 0; d < readout.n_dimensions(); ++d) {
    const auto sums = readout.sums(read, d);
    const std::size_t teacher = action[d];
    std::size_t other = teacher == 0 ? 1 : 0;
    for (std::size_t a = other; a < sums.size(); ++a) {
      if (a != teacher && sums[a] > sums[other]) other = a;
    }
    if (sums.size() > 1 && sums[other] + margin > sums[teacher]) {
      // Each of the two actions moves half of the way. Q(s, a) sums over dimensions, and a step
      // divides an error by the weights of all of them, hence the factor.
      const std::int64_t error = (sums[other] + margin - sums[teacher]) * n_dimensions / 2;
      for (std::size_t row = first_row; row < first_row + window; ++row) {
        errors[row + teacher] += error;
        errors[row + other] -= error;
      }
    }
    first_row += sums.size() + window - 1;
  }
}

}  // namespace sdnn::agents::detail
