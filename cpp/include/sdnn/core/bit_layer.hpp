/// Layers of binary units in std::bitset words, with sizes chosen at run time.
#pragma once

#include <algorithm>
#include <bit>
#include <bitset>
#include <cassert>
#include <cstddef>
#include <span>

namespace sdnn::core {

/// A word of 64 binary units; rows of words form layers of any size. The standard gives access to
/// the bits of a std::bitset as a number, by to_ullong, up to this size.
using BitWord = std::bitset<64>;

/// The number of words that hold `n_units` binary units.
constexpr std::size_t n_bit_words(std::size_t n_units) noexcept { return (n_units + 63) / 64; }

/// A view of binary units: unit i is bit i % 64 of word i / 64; the last word is padded with 0.
class BitLayer {
 public:
  BitLayer(const BitWord* words, std::size_t size) noexcept : words_(words), size_(size) {}

  std::size_t size() const noexcept { return size_; }
  std::size_t n_words() const noexcept { return n_bit_words(size_); }
  std::span<const BitWord> words() const noexcept { return {words_, n_words()}; }

  bool operator[](std::size_t unit) const noexcept {
    assert(unit < size_);
    return words_[unit / 64][unit % 64];
  }
  /// Number of units that are on.
  std::size_t count() const noexcept {
    std::size_t n = 0;
    for (const BitWord& word : words()) n += word.count();
    return n;
  }
  /// Number of units that differ from those of a layer of the same size.
  std::size_t distance(const BitLayer& other) const noexcept {
    assert(size_ == other.size_);
    std::size_t n = 0;
    for (std::size_t w = 0; w < n_words(); ++w) n += (words_[w] ^ other.words_[w]).count();
    return n;
  }
  /// Calls `visit(unit)` for every unit that is on, in rising order.
  template <class Visit>
  void for_each_set(Visit&& visit) const {
    for (std::size_t w = 0; w < n_words(); ++w) {
      // rest & (rest - 1) is `rest` without its lowest bit: 0b1100 & 0b1011 = 0b1000.
      for (unsigned long long rest = words_[w].to_ullong(); rest != 0; rest &= rest - 1) {
        visit(w * 64 + static_cast<std::size_t>(std::countr_zero(rest)));
      }
    }
  }
  friend bool operator==(const BitLayer& a, const BitLayer& b) noexcept {
    return a.size_ == b.size_ && std::ranges::equal(a.words(), b.words());
  }

 private:
  const BitWord* words_;
  std::size_t size_;
};

}  // namespace sdnn::core
