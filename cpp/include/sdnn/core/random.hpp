/// A fully specified random generator: the same numbers from every compiler and standard library.
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::core {

/// Purpose of a random number. Each purpose has a separate stream, so that drawing more numbers for
/// one never changes another. The numbers enter seeds: a changed one would change results.
enum class Stream : std::uint64_t {
  code_books = 1,
  permutations = 2,
  weights = 3,
  ties = 4,
  exploration = 5,
  sensor_noise = 6,
  evaluation_ties = 7,
  evaluation_sensor_noise = 8,
  rounding = 9,
  useless_inputs = 10,
  repetitions = 11,
  dimensions = 12,
  pairs = 13,
};

/// xoshiro256** (Blackman, Vigna 2018), seeded by SplitMix64 from (seed, stream, index).
///
/// Its results do not depend on the library, unlike std::shuffle and std::normal_distribution.
class Random {
 public:
  /// Makes generator number `index` of those that share a seed and a stream.
  Random(std::uint64_t seed, Stream stream, std::uint64_t index = 0) noexcept {
    std::uint64_t mixed = seed;
    mixed = split_mix(mixed) ^ static_cast<std::uint64_t>(stream);
    mixed = split_mix(mixed) ^ index;
    for (auto& word : state_) word = split_mix(mixed);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.fixed("words", {self.state_.size()}, self.state_);
    if constexpr (Archive::kReads) {  // a state of zeros gives only zeros
      archive.expect(self.state_ != std::array<std::uint64_t, 4>{}, "words", "not all 0");
    }
  }

  /// 64 uniformly random bits.
  std::uint64_t bits() noexcept {
    const std::uint64_t result = std::rotl(state_[1] * 5, 7) * 9;
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// A multiple of 2^-53 in [0, 1).
  double uniform() noexcept { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }

  /// An integer in [0, n), exactly uniform (rejection). Requires n > 0.
  template <std::integral Integer>
  std::make_unsigned_t<Integer> below(Integer n) noexcept {
    assert(n > 0);
    const auto size = static_cast<std::uint64_t>(n);
    const std::uint64_t rejected = (0 - size) % size;  // 2^64 mod n: the rest is a multiple of n
    std::uint64_t drawn = bits();
    while (drawn < rejected) drawn = bits();
    return static_cast<std::make_unsigned_t<Integer>>(drawn % size);
  }

  /// A standard normal number; always consumes one draw.
  ///
  /// Source: inverse of the distribution function, Wichura 1988 (AS 241, PPND16), about 16 digits,
  /// taken at the middle of one of 2^52 equal cells so that 0 and 1 cannot occur.
  double normal() noexcept {
    return normal_quantile((static_cast<double>(bits() >> 12) + 0.5) * 0x1.0p-52);
  }

  /// Puts `items` in a uniformly random order (Fisher-Yates, from the back). Can be interrupted.
  template <class Item>
  void shuffle(std::span<Item> items) {
    constexpr std::size_t kItemsPerPoint = std::size_t{1} << 16;  // between two interruption points
    for (std::size_t i = items.size(); i > 1; --i) {
      if (i % kItemsPerPoint == 0) interruption_point();
      std::swap(items[i - 1], items[below(i)]);
    }
  }

 private:
  /// SplitMix64 with its constants: advances the state, and returns a number.
  static std::uint64_t split_mix(std::uint64_t& state) noexcept {
    state += 0x9e3779b97f4a7c15;
    std::uint64_t z = state;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }

  std::array<std::uint64_t, 4> state_{};
};

}  // namespace sdnn::core
