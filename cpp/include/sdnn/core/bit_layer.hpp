/// A layer of binary units: one std::bitset with a size chosen at run time.
#pragma once

#include <array>
#include <bit>
#include <bitset>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace sdnn::core {

/// `size` binary units in a std::bitset of `Capacity` bits; the padding is always zero.
///
/// std::bitset offers neither iteration nor its words: this class adds both, and nothing outside it
/// uses a raw bitset. Unit i is bit i % 64 of word i / 64.
template <std::size_t Capacity>
class BitLayer {
  static_assert(Capacity > 0 && Capacity % 64 == 0, "Capacity is a whole number of 64-bit words");

 public:
  static constexpr std::size_t kCapacity = Capacity;
  static constexpr std::size_t kWords = Capacity / 64;
  using Words = std::array<std::uint64_t, kWords>;

  BitLayer() = default;

  /// All units off. Throws std::length_error if `size` exceeds the capacity.
  explicit BitLayer(std::size_t size) : size_(size) {
    if (size > Capacity) {
      throw std::length_error("a BitLayer of capacity " + std::to_string(Capacity) +
                              " cannot hold " + std::to_string(size) + " units");
    }
  }

  std::size_t size() const noexcept { return size_; }
  std::size_t count() const noexcept { return bits_.count(); }

  bool operator[](std::size_t unit) const noexcept {
    assert(unit < size_);
    return bits_[unit];
  }
  void set(std::size_t unit, bool on = true) noexcept {
    assert(unit < size_);
    bits_[unit] = on;
  }
  void flip(std::size_t unit) noexcept {
    assert(unit < size_);
    bits_[unit] = !bits_[unit];
  }

  BitLayer& operator&=(const BitLayer& other) noexcept {
    assert(size_ == other.size_);
    bits_ &= other.bits_;
    return *this;
  }
  BitLayer& operator|=(const BitLayer& other) noexcept {
    assert(size_ == other.size_);
    bits_ |= other.bits_;
    return *this;
  }
  BitLayer& operator^=(const BitLayer& other) noexcept {
    assert(size_ == other.size_);
    bits_ ^= other.bits_;
    return *this;
  }
  friend BitLayer operator&(BitLayer a, const BitLayer& b) noexcept { return a &= b; }
  friend BitLayer operator|(BitLayer a, const BitLayer& b) noexcept { return a |= b; }
  friend BitLayer operator^(BitLayer a, const BitLayer& b) noexcept { return a ^= b; }
  friend bool operator==(const BitLayer&, const BitLayer&) = default;

  /// Every unit flipped; the padding stays zero.
  BitLayer operator~() const noexcept {
    BitLayer flipped = *this;
    flipped.bits_.flip();
    flipped.bits_ &= mask(size_);
    return flipped;
  }

  /// The units as 64-bit words, unit 0 in the lowest bit of the first.
  Words words() const noexcept {
    static_assert(sizeof(std::bitset<Capacity>) == sizeof(Words));
    return std::bit_cast<Words>(bits_);
  }

  /// Calls `visit(unit)` for every unit that is on, in rising order.
  template <class Visit>
  void for_each_set(Visit&& visit) const {
    const Words all = words();
    for (std::size_t w = 0; w < kWords; ++w) {
      for (std::uint64_t rest = all[w]; rest != 0; rest &= rest - 1) {
        visit(w * 64 + static_cast<std::size_t>(std::countr_zero(rest)));
      }
    }
  }

 private:
  static std::bitset<Capacity> mask(std::size_t size) noexcept {
    return size == 0 ? std::bitset<Capacity>{} : ~std::bitset<Capacity>{} >> (Capacity - size);
  }

  std::bitset<Capacity> bits_;
  std::size_t size_ = 0;
};

}  // namespace sdnn::core
