/// Patterns of +1 and -1 for the bins of one input, at a length chosen at run time.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// `n_bins` patterns of `n_units` units each, one bit per unit (set = +1); unused bits are zero.
///
/// Unlike a CodeBook it has no compiled capacity: the codes of a regressor are thousands of units
/// long. Unit k of a pattern is bit k % 64 of its word k / 64.
class PatternTable {
 public:
  /// All units -1. Throws std::invalid_argument unless there is at least one bin and one unit.
  PatternTable(std::size_t n_bins, std::size_t n_units)
      : n_bins_(n_bins), n_units_(n_units), n_words_((n_units + 63) / 64) {
    core::require_in_range("n_bins", n_bins, 1, std::size_t{1} << 30);
    core::require_in_range("n_units", n_units, 1, std::size_t{1} << 24);
    words_.resize(n_bins_ * n_words_);
  }

  /// Patterns from signs, bin by bin.
  ///
  /// Shapes: signs (n_bins, n_units). Throws std::invalid_argument if a sign is not +1 or -1.
  static PatternTable from_signs(std::span<const std::int8_t> signs, std::size_t n_bins,
                                 std::size_t n_units) {
    PatternTable table(n_bins, n_units);
    core::require(signs.size() == n_bins * n_units, "signs",
                  std::to_string(n_bins * n_units) + " values", signs.size());
    const std::int8_t* sign = signs.data();
    for (std::size_t bin = 0; bin < n_bins; ++bin) {
      for (std::size_t unit = 0; unit < n_units; ++unit, ++sign) {
        if (*sign != 1 && *sign != -1) {
          core::require(false, "patterns", "+1 or -1 everywhere", static_cast<int>(*sign));
        }
        const auto on = static_cast<std::uint64_t>(*sign > 0);
        table.words_[bin * table.n_words_ + unit / 64] |= on << unit % 64;
      }
    }
    return table;
  }

  std::size_t n_bins() const noexcept { return n_bins_; }
  std::size_t n_units() const noexcept { return n_units_; }
  /// Words of 64 units per pattern.
  std::size_t n_words() const noexcept { return n_words_; }

  std::span<const std::uint64_t> operator[](std::size_t bin) const noexcept {
    assert(bin < n_bins_);
    return {words_.data() + bin * n_words_, n_words_};
  }
  /// +1 or -1.
  int sign(std::size_t bin, std::size_t unit) const noexcept {
    assert(bin < n_bins_ && unit < n_units_);
    return (words_[bin * n_words_ + unit / 64] >> unit % 64 & 1) != 0 ? 1 : -1;
  }
  void flip(std::size_t bin, std::size_t unit) noexcept {
    assert(bin < n_bins_ && unit < n_units_);
    words_[bin * n_words_ + unit / 64] ^= std::uint64_t{1} << unit % 64;
  }
  /// Makes the pattern of `bin` a copy of that of `from`.
  void copy(std::size_t from, std::size_t bin) noexcept {
    for (std::size_t w = 0; w < n_words_; ++w) {
      words_[bin * n_words_ + w] = words_[from * n_words_ + w];
    }
  }

  bool operator==(const PatternTable&) const = default;

 private:
  std::size_t n_bins_;
  std::size_t n_units_;
  std::size_t n_words_;
  std::vector<std::uint64_t> words_;
};

/// Makes `bin` a random pattern with floor(n_units / 2) units at +1; it must be all -1 before.
inline void fill_balanced(PatternTable& table, std::size_t bin, core::Random& random) {
  std::vector<std::size_t> order(table.n_units());
  std::iota(order.begin(), order.end(), std::size_t{0});
  random.shuffle(std::span(order));
  for (std::size_t k = 0; k < order.size() / 2; ++k) table.flip(bin, order[k]);
}

}  // namespace sdnn::coding
