/// Transfer of weights to the code of a state with additional inputs.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sdnn/coding/state_code.hpp"

namespace sdnn::approximators {

/// Copies rows of weights over a code to rows over a code with more inputs, such that their
/// products are the same. Both codes have all pairs and equal numbers of units; `to` is 0
/// elsewhere.
///
/// In the paired code the groups of a modifier are halves of sums and differences. If their number
/// is odd, the last group is unpaired, and becomes a sum of two such halves with an additional
/// group.
inline void copy_to_more_inputs(const coding::StateCode& fewer, std::span<const std::int32_t> from,
                                const coding::StateCode& more, std::span<std::int32_t> to) {
  const std::size_t n_columns = 64 * more.n_words() / more.n_groups();
  const std::size_t n_from = 64 * fewer.n_words(), n_to = 64 * more.n_words();
  const std::size_t n_before = fewer.n_partners(), n_now = more.n_partners();
  const std::size_t paired_before = n_before / 2 * 2, paired_now = n_now / 2 * 2;
  for (std::size_t row = 0; row < to.size() / n_to; ++row) {
    const auto copy = [&](std::size_t group, std::size_t group_now) {
      std::copy_n(&from[row * n_from + group * n_columns], n_columns,
                  &to[row * n_to + group_now * n_columns]);
    };
    for (std::size_t nu = 0; nu < fewer.n_inputs(); ++nu) {
      for (std::size_t k = 0; k < paired_before; ++k) {
        copy(nu * paired_before + k, nu * paired_now + k);
      }
      if (paired_before == n_before) continue;
      const std::size_t last = fewer.n_inputs() * paired_before + nu;
      if (paired_now > paired_before) {
        copy(last, nu * paired_now + paired_before);
        copy(last, nu * paired_now + paired_before + 1);
      } else {
        copy(last, more.n_inputs() * paired_now + nu);
      }
    }
  }
}

}  // namespace sdnn::approximators
