/// The columns in which one code differs from another.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace sdnn::estimators {

namespace detail {

/// The bits of a word where the code's entry goes up or down, and those where it does so by 2.
struct WordChanges {
  SDNN_INLINE WordChanges(const coding::CodeWords& from, const coding::CodeWords& to,
                          std::size_t word) noexcept {
    const std::uint64_t plus = to.positive[word];
    const std::uint64_t minus = to.active[word] & ~plus;
    const std::uint64_t old_plus = from.positive[word];
    const std::uint64_t old_minus = from.active[word] & ~old_plus;
    up = (plus & ~old_plus) | (old_minus & ~minus);
    up_again = plus & old_minus;
    down = (minus & ~old_minus) | (old_plus & ~plus);
    down_again = minus & old_plus;
  }

  std::uint64_t up, up_again, down, down_again;
};

/// Writes `base` + the numbers of the set bits; returns their end. `Some` numbers are written at a
/// time, so that few bits need no jump: up to that many may lie beyond the end.
template <std::size_t Some, class Number>
SDNN_INLINE Number* append_bits(Number* to, std::uint64_t bits, std::size_t base) noexcept {
  Number* const end = to + std::popcount(bits);
  do {
    core::unrolled<Some>([&](std::size_t) SDNN_INLINE_LAMBDA {
      *to++ = static_cast<Number>(base + static_cast<std::size_t>(std::countr_zero(bits)));
      bits &= bits - 1;
    });
  } while (bits != 0);
  return end;
}

SDNN_INLINE void list_changes_body(const coding::CodeWords& from, const coding::CodeWords& to,
                                   std::size_t n_words, std::uint32_t* words, std::uint32_t** up,
                                   std::uint32_t** down) noexcept {
  std::uint32_t* end = words;
  for (std::size_t w = 0; w < n_words; ++w) {
    *end = static_cast<std::uint32_t>(w);
    end += ((from.active[w] ^ to.active[w]) | (from.positive[w] ^ to.positive[w])) != 0 ? 1 : 0;
  }
  for (; words != end; ++words) {
    const WordChanges changes(from, to, *words);
    const std::size_t base = std::size_t{64} * *words;
    *up = append_bits<1>(append_bits<1>(*up, changes.up, base), changes.up_again, base);
    *down = append_bits<1>(append_bits<1>(*down, changes.down, base), changes.down_again, base);
  }
}

}  // namespace detail

/// Appends to `up` and `down` the slots whose entry rises or falls from one code to another, twice
/// if by 2: up to 128 * n_words and one more. `words` is scratch for n_words and one more.
SDNN_KERNEL(void, list_changes,
            (const coding::CodeWords& from, const coding::CodeWords& to, std::size_t n_words,
             std::uint32_t* words, std::uint32_t** up, std::uint32_t** down),
            (from, to, n_words, words, up, down))

/// How many entries of a code are not 0.
inline std::size_t n_active(const coding::CodeWords& code, std::size_t n_words) noexcept {
  std::size_t n = 0;
  for (std::size_t w = 0; w < n_words; ++w) {
    n += static_cast<std::size_t>(std::popcount(code.active[w]));
  }
  return n;
}

/// Slots to add and slots to subtract: those of a code, or those in which two differ.
class SignedSlots {
 public:
  explicit SignedSlots(std::size_t n_words)
      : n_words_(n_words),
        nothing_(n_words),
        words_(n_words + 1),
        plus_(128 * n_words + 1),
        minus_(128 * n_words + 1) {}

  /// Overwrites them with what leads from one code to another.
  void read_changes(const coding::CodeWords& from, const coding::CodeWords& to) {
    std::uint32_t* up = plus_.data();
    std::uint32_t* down = minus_.data();
    list_changes(from, to, n_words_, words_.data(), &up, &down);
    n_plus_ = static_cast<std::size_t>(up - plus_.data());
    n_minus_ = static_cast<std::size_t>(down - minus_.data());
  }
  /// Overwrites them with those of a code.
  void read(const coding::CodeWords& code) {
    read_changes({nothing_.data(), nothing_.data()}, code);
  }

  std::span<const std::uint32_t> plus() const noexcept { return {plus_.data(), n_plus_}; }
  std::span<const std::uint32_t> minus() const noexcept { return {minus_.data(), n_minus_}; }
  std::size_t size() const noexcept { return n_plus_ + n_minus_; }

 private:
  std::size_t n_words_;
  std::vector<std::uint64_t> nothing_;
  std::vector<std::uint32_t> words_;
  std::vector<std::uint32_t> plus_;
  std::vector<std::uint32_t> minus_;
  std::size_t n_plus_ = 0;
  std::size_t n_minus_ = 0;
};

}  // namespace sdnn::estimators
