/// Layer 2: the patterns of +1 and -1 that stand for the bins of one input.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::coding {

/// The number of a sub-range of an input's range, and of the pattern that stands for it.
using Bin = std::int32_t;

/// The bin of `value` among `n_bins` equal half-open parts of [0, 1]; the last includes 1.
inline Bin bin_of(double value, std::size_t n_bins) noexcept {
  assert(value >= 0.0 && value <= 1.0);
  const auto bin = static_cast<std::size_t>(value * static_cast<double>(n_bins));
  return static_cast<Bin>(bin < n_bins ? bin : n_bins - 1);
}

/// A table of `n_bins` patterns of `n_units` units each (set = +1), made by every coding.
///
/// Source: section 3.1 (layer 2). Memory: n_bins * n_units / 8 bytes, patterns begin on words.
class PatternTable {
 public:
  /// Sets all units to -1. Throws std::invalid_argument unless there is at least one bin and one
  /// unit.
  PatternTable(std::size_t n_bins, std::size_t n_units)
      : n_bins_(n_bins), n_units_(n_units), n_words_(core::n_bit_words(n_units)) {
    core::require_in_range("n_bins", n_bins, 1, std::size_t{1} << 30);
    core::require_in_range("n_units", n_units, 1, std::size_t{1} << 24);
    words_.resize(core::checked_product(n_bins_, n_words_));
  }

  /// Makes patterns from signs, bin by bin.
  ///
  /// Shapes: signs (n_bins, n_units). Throws std::invalid_argument if a sign is not +1 or -1.
  static PatternTable from_signs(std::span<const std::int8_t> signs, std::size_t n_bins,
                                 std::size_t n_units) {
    PatternTable table(n_bins, n_units);
    core::require_size("signs", signs.size(), n_bins * n_units);
    const std::int8_t* sign = signs.data();
    for (std::size_t bin = 0; bin < n_bins; ++bin) {
      core::interruption_point();
      for (std::size_t unit = 0; unit < n_units; ++unit, ++sign) {
        if (*sign != 1 && *sign != -1) {
          core::require(false, "patterns", "+1 or -1 everywhere", static_cast<int>(*sign));
        }
        table.set(bin, unit, *sign > 0);
      }
    }
    return table;
  }

  std::size_t n_bins() const noexcept { return n_bins_; }
  std::size_t n_units() const noexcept { return n_units_; }
  /// The number of words of a pattern.
  std::size_t n_words() const noexcept { return n_words_; }
  /// The words of all patterns, one pattern after the other.
  const core::BitWord* words() const noexcept { return words_.data(); }

  core::BitLayer operator[](std::size_t bin) const noexcept {
    assert(bin < n_bins_);
    return {words_.data() + bin * n_words_, n_units_};
  }
  /// The sign of a unit in a pattern, +1 or -1.
  int sign(std::size_t bin, std::size_t unit) const noexcept { return (*this)[bin][unit] ? 1 : -1; }
  void set(std::size_t bin, std::size_t unit, bool on = true) noexcept {
    assert(bin < n_bins_ && unit < n_units_);
    words_[bin * n_words_ + unit / 64][unit % 64] = on;
  }
  void flip(std::size_t bin, std::size_t unit) noexcept {
    assert(bin < n_bins_ && unit < n_units_);
    words_[bin * n_words_ + unit / 64].flip(unit % 64);
  }
  /// Copies the pattern of `from` to `bin`.
  void copy(std::size_t from, std::size_t bin) noexcept {
    assert(from < n_bins_ && bin < n_bins_);
    std::copy_n(words_.data() + from * n_words_, n_words_, words_.data() + bin * n_words_);
  }

  bool operator==(const PatternTable&) const = default;

 private:
  std::size_t n_bins_;
  std::size_t n_units_;
  std::size_t n_words_;
  std::vector<core::BitWord> words_;
};

/// Makes `bin` a random pattern: `balanced`, with floor(n_units / 2) units at +1, or of independent
/// fair units. Its units must be -1 before.
inline void fill_random(PatternTable& table, std::size_t bin, bool balanced, core::Random& random) {
  if (!balanced) {
    for (std::size_t k = 0; k < table.n_units(); ++k) table.set(bin, k, random.below(2) == 1);
    return;
  }
  std::vector<std::size_t> order(table.n_units());
  std::iota(order.begin(), order.end(), std::size_t{0});
  random.shuffle(std::span(order));
  for (std::size_t k = 0; k < order.size() / 2; ++k) table.set(bin, order[k]);
}

/// Returns the table with an additional random pattern after the others.
inline PatternTable with_random_pattern(const PatternTable& table, bool balanced,
                                        core::Random& random) {
  PatternTable longer(table.n_bins() + 1, table.n_units());
  for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
    table[bin].for_each_set([&](std::size_t k) { longer.set(bin, k); });
  }
  fill_random(longer, table.n_bins(), balanced, random);
  return longer;
}

}  // namespace sdnn::coding
