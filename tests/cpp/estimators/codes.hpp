/// Random codes, bit by bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::testing {

/// A code of +1, 0 and -1, as bits of the slots that are not 0 and of those that are +1.
struct Code {
  std::vector<std::uint64_t> active, positive;

  coding::TernaryCode words() const { return {active.data(), positive.data()}; }
  /// The entry of a slot: +1, 0 or -1.
  int at(std::size_t slot) const {
    if ((active[slot / 64] >> slot % 64 & 1) == 0) return 0;
    return (positive[slot / 64] >> slot % 64 & 1) != 0 ? 1 : -1;
  }
};

inline Code random_code(std::size_t n_words, core::Random& random) {
  Code code;
  for (std::size_t w = 0; w < n_words; ++w) {
    code.active.push_back(random.bits());
    code.positive.push_back(random.bits() & code.active.back());
  }
  return code;
}

/// Returns the code after `n_changes` entries, some perhaps twice, were replaced by random ones.
inline Code neighbour_of(const Code& code, std::size_t n_changes, core::Random& random) {
  Code changed = code;
  const Code other = random_code(code.active.size(), random);
  for (std::size_t k = 0; k < n_changes; ++k) {
    const std::size_t slot = random.below(64 * code.active.size());
    const std::uint64_t bit = std::uint64_t{1} << slot % 64;
    auto& active = changed.active[slot / 64];
    auto& positive = changed.positive[slot / 64];
    active = (active & ~bit) | (other.active[slot / 64] & bit);
    positive = (positive & ~bit) | (other.positive[slot / 64] & bit);
  }
  return changed;
}

}  // namespace sdnn::testing
