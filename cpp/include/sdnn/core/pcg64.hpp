/// NumPy's default random generator, seeded as NumPy does it.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::core {

/// PCG64 with a SeedSequence; it gives the numbers of NumPy's
/// Generator(PCG64(SeedSequence(seeds))).
///
/// Only warm-ups use this generator, to reproduce results that were recorded with NumPy; everything
/// else uses Random.
///
/// Source: O'Neill, M. (2014). PCG (XSL RR 128/64); O'Neill, M. (2015). Developing a seed_seq
/// alternative; numpy/random/src/distributions/distributions.c (bounded integers after Lemire).
class Pcg64 {
 public:
  /// Seeds like NumPy's PCG64(SeedSequence(seeds)).
  explicit Pcg64(std::span<const std::uint64_t> seeds) noexcept {
    std::vector<std::uint32_t> entropy;  // as NumPy splits seeds: low half first, no leading zeros
    for (const std::uint64_t seed : seeds) {
      entropy.push_back(static_cast<std::uint32_t>(seed));
      if (seed >> 32U != 0) entropy.push_back(static_cast<std::uint32_t>(seed >> 32U));
    }
    const std::array<std::uint64_t, 4> drawn = generated_state(entropy);
    increment_ = {(drawn[2] << 1U) | (drawn[3] >> 63U), (drawn[3] << 1U) | 1U};
    advance();
    state_ = sum(state_, {drawn[0], drawn[1]});
    advance();
  }

  /// 64 uniformly random bits.
  std::uint64_t bits() noexcept {
    advance();
    const std::uint64_t folded = state_.high ^ state_.low;
    const auto turn = static_cast<int>(state_.high >> 58U);
    return turn == 0 ? folded : (folded >> turn) | (folded << (64 - turn));
  }

  /// A multiple of 2^-53 in [0, 1).
  double uniform() noexcept { return static_cast<double>(bits() >> 11U) * 0x1.0p-53; }

  /// An integer in [0, n). Requires 0 < n < 2^32.
  std::uint32_t below(std::uint32_t n) noexcept {
    assert(n > 0);
    if (n == 1) return 0;
    const std::uint32_t rejected = (0U - n) % n;  // 2^32 mod n
    std::uint64_t scaled = std::uint64_t{half()} * n;
    while (static_cast<std::uint32_t>(scaled) < rejected) scaled = std::uint64_t{half()} * n;
    return static_cast<std::uint32_t>(scaled >> 32U);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::array<std::uint64_t, 6> members{self.state_.high,    self.state_.low, self.increment_.high,
                                         self.increment_.low, self.has_half_,  self.half_};
    archive.fixed("words", {members.size()}, members);
    if constexpr (Archive::kReads) {
      self.state_ = {members[0], members[1]};
      self.increment_ = {members[2], members[3]};
      self.has_half_ = members[4] != 0;
      self.half_ = static_cast<std::uint32_t>(members[5]);
    }
  }

  /// Returns NumPy's SeedSequence(entropy).generate_state(4, uint64), with the constants of its
  /// definition: mixes the entropy into a pool of four numbers, and hashes these twice.
  static std::array<std::uint64_t, 4> generated_state(
      std::span<const std::uint32_t> entropy) noexcept {
    std::uint32_t constant = 0x43b0d7e5;
    const auto hashed = [&constant](std::uint32_t value) {
      value ^= constant;
      constant *= 0x931e8875;
      value *= constant;
      return value ^ (value >> 16U);
    };
    const auto mixed = [](std::uint32_t x, std::uint32_t y) {
      const std::uint32_t value = 0xca01f9dd * x - 0x4973f715 * y;
      return value ^ (value >> 16U);
    };
    std::array<std::uint32_t, 4> pool{};
    for (std::size_t i = 0; i < pool.size(); ++i) {
      pool[i] = hashed(i < entropy.size() ? entropy[i] : 0);
    }
    for (std::size_t from = 0; from < pool.size(); ++from) {
      for (std::size_t to = 0; to < pool.size(); ++to) {
        if (from != to) pool[to] = mixed(pool[to], hashed(pool[from]));
      }
    }
    for (std::size_t from = pool.size(); from < entropy.size(); ++from) {
      for (std::uint32_t& number : pool) number = mixed(number, hashed(entropy[from]));
    }
    constant = 0x8b51f9dd;
    std::array<std::uint64_t, 4> drawn{};
    for (std::size_t i = 0; i < 8; ++i) {
      std::uint32_t value = pool[i % pool.size()] ^ constant;
      constant *= 0x58f38ded;
      value *= constant;
      value ^= value >> 16U;
      drawn[i / 2] |= std::uint64_t{value} << (32U * (i % 2));
    }
    return drawn;
  }

 private:
  /// An unsigned integer of 128 bits, which not every compiler has.
  struct Wide {
    std::uint64_t high = 0, low = 0;
  };

  static Wide sum(Wide a, Wide b) noexcept {
    const std::uint64_t low = a.low + b.low;
    return {a.high + b.high + (low < a.low ? 1U : 0U), low};
  }

  /// The product of two numbers of 64 bits, by the halves of their digits as on paper.
  static Wide product(std::uint64_t a, std::uint64_t b) noexcept {
    constexpr std::uint64_t kHalf = 0xffffffff;
    const std::uint64_t a_low = a & kHalf, a_high = a >> 32U, b_low = b & kHalf, b_high = b >> 32U;
    const std::uint64_t first = a_low * b_low, second = a_high * b_low + (first >> 32U);
    const std::uint64_t third = a_low * b_high + (second & kHalf);
    return {a_high * b_high + (second >> 32U) + (third >> 32U), (third << 32U) | (first & kHalf)};
  }

  /// Advances the state, state = state * factor + increment modulo 2^128.
  void advance() noexcept {
    // The default multiplier of PCG with 128 bits.
    constexpr Wide kFactor{2549297995355413924U, 4865540595714422341U};
    Wide next = product(state_.low, kFactor.low);
    next.high += state_.high * kFactor.low + state_.low * kFactor.high;
    state_ = sum(next, increment_);
  }

  /// 32 random bits. Like NumPy, it draws 64 in every other call, and keeps the upper half.
  std::uint32_t half() noexcept {
    if (has_half_) {
      has_half_ = false;
      return half_;
    }
    const std::uint64_t drawn = bits();
    has_half_ = true;
    half_ = static_cast<std::uint32_t>(drawn >> 32U);
    return static_cast<std::uint32_t>(drawn);
  }

  Wide state_, increment_;
  bool has_half_ = false;
  std::uint32_t half_ = 0;
};

}  // namespace sdnn::core
