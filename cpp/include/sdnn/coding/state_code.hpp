/// Layers 2 and 3 as fixed wiring: from a state to its ternary code.
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/coding/desensitization.hpp"
#include "sdnn/coding/pattern_code.hpp"
#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace sdnn::coding {

/// The columns whose value is not 0, by sign; one of value 2 comes twice.
struct SignedColumns {
  std::vector<std::uint32_t> positive;
  std::vector<std::uint32_t> negative;
  std::vector<std::int16_t> values = {};  ///< scratch of whoever needs the whole row

  /// No columns, but room for `n` of each sign, so that listing them allocates nothing and meets
  /// no memory that was never written.
  static SignedColumns with_capacity(std::size_t n) {
    SignedColumns columns;
    columns.positive.resize(n + 8);  // listing overwrites up to eight more
    columns.negative.resize(n + 8);
    columns.values.resize(n);
    columns.clear();
    return columns;
  }

  void clear() noexcept {
    positive.clear();
    negative.clear();
    values.clear();
  }
};

namespace detail {

/// The set bits of a byte, in rising order.
struct SetBits {
  std::array<std::uint32_t, 8> bits{};
  std::uint32_t n = 0;
};

inline constexpr std::array<SetBits, 256> kSetBits = [] {
  std::array<SetBits, 256> table{};
  for (std::size_t byte = 0; byte < table.size(); ++byte) {
    for (std::uint32_t bit = 0; bit < 8; ++bit) {
      if (byte >> bit & 1) table[byte].bits[table[byte].n++] = bit;
    }
  }
  return table;
}();

/// Writes the numbers of the set bits among the first `n_bits`, plus `first`, a byte of bits at a
/// time: always eight numbers, of which those of the set bits count, so that no branch depends on
/// the bits. Returns the end of what counts; up to eight more are overwritten.
template <std::size_t NWords>
[[gnu::noinline]] std::uint32_t* list_set_bits(const std::array<std::uint64_t, NWords>& words,
                                               std::size_t first, std::size_t n_bits,
                                               std::uint32_t* end) noexcept {
  for (std::size_t bit = 0; bit < n_bits; bit += 8) {
    const SetBits& set = kSetBits[words[bit / 64] >> bit % 64 & 0xff];
    std::array<std::uint32_t, 8> numbers = set.bits;
    for (std::uint32_t& number : numbers) number += static_cast<std::uint32_t>(first + bit);
    std::memcpy(end, numbers.data(), sizeof numbers);
    end += set.n;
  }
  return end;
}

}  // namespace detail

/// Layers 2 and 3 as fixed wiring: from a state to its ternary code x_SD.
///
/// In the paper's order group (mu, nu), nu != mu, has number mu * (l - 1) + (nu < mu ? nu : nu - 1)
/// and its unit k is unit number * m + k of x_SD.
///
/// The l - 1 units that unit q of x^nu modifies, one in each group (mu, nu), are neutral together.
/// Two of them, x_j and x_k, are stored as (x_j + x_k) / 2 and (x_j - x_k) / 2. One of these is
/// always neutral, so whoever reads or corrects the columns that are not has half as many of them.
/// This is the *paired code*. Its first n_double_columns() columns are such halves: for each nu and
/// each two of its groups m half sums, then m half differences, in the order of q. If l is even,
/// the group of the last mu is left over for each nu and follows as it is, also in the order of q.
template <std::size_t Capacity>
class StateCode {
 public:
  using Pattern = core::BitLayer<Capacity>;

  /// Wiring from given code books, one per input, and permutations, one per group.
  ///
  /// Throws std::invalid_argument unless there are at least two books of one pattern size, and
  /// l (l - 1) permutations of that size.
  StateCode(std::vector<CodeBook<Capacity>> books, std::vector<Permutation> permutations)
      : books_(std::move(books)), permutations_(std::move(permutations)) {
    core::require_in_range("n_inputs", books_.size(), 2, 1024);
    for (const auto& book : books_) {
      core::require(book.n_pattern_units() == n_pattern_units(), "code books",
                    "of one n_pattern_units", book.n_pattern_units());
    }
    core::require(permutations_.size() == n_groups(), "number of permutations",
                  "n_inputs * (n_inputs - 1)", permutations_.size());
    for (const auto& permutation : permutations_) require_permutation(permutation);

    in_order_of_modifier_.resize(n_groups());
    for (std::size_t mu = 0; mu < n_inputs(); ++mu) {
      for (std::size_t nu = 0; nu < n_inputs(); ++nu) {
        if (nu == mu) continue;
        const Permutation modified = inverse(permutations_[group_of(mu, nu)]);
        auto& patterns = in_order_of_modifier_[group_of(mu, nu)];
        for (std::size_t bin = 0; bin < books_[mu].n_bins(); ++bin) {
          patterns.push_back(permute(books_[mu][static_cast<Bin>(bin)], modified));
        }
      }
    }
  }

  std::size_t n_inputs() const noexcept { return books_.size(); }
  std::size_t n_pattern_units() const noexcept { return books_.front().n_pattern_units(); }
  std::size_t n_groups() const noexcept { return n_inputs() * (n_inputs() - 1); }
  /// D = m l (l - 1), the length of x_SD.
  std::size_t n_columns() const noexcept { return n_pattern_units() * n_groups(); }

  const CodeBook<Capacity>& book(std::size_t input) const { return books_.at(input); }
  const Permutation& permutation(std::size_t mu, std::size_t nu) const {
    core::require(mu < n_inputs() && nu < n_inputs() && mu != nu, "(mu, nu)",
                  "two different inputs", mu * n_inputs() + nu);
    return permutations_[group_of(mu, nu)];
  }

  /// The bin of every input. Shapes: state (l,), bins (l,).
  ///
  /// Throws std::invalid_argument if the size is wrong or a value is not in [0, 1].
  void encode(std::span<const double> state, std::span<Bin> bins) const {
    core::require(state.size() == n_inputs(), "state", std::to_string(n_inputs()) + " values",
                  state.size());
    assert(bins.size() == n_inputs());
    for (std::size_t mu = 0; mu < state.size(); ++mu) {
      if (!(state[mu] >= 0.0 && state[mu] <= 1.0)) {
        core::require_in_range("state[" + std::to_string(mu) + "]", state[mu], 0.0, 1.0);
      }
      bins[mu] = books_[mu].bin_of(state[mu]);
    }
  }

  /// The ternary pattern of one group for a coded state, in the paper's order.
  TernaryPattern<Capacity> group(std::size_t mu, std::size_t nu, std::span<const Bin> bins) const {
    return desensitize(books_[mu][bins[mu]], permute(books_[nu][bins[nu]], permutation(mu, nu)));
  }

  /// Where a unit of x_SD is in the paired code: x = first + sign * second, or, unless it is
  /// paired, first alone; and its weight is half of that sum of their weights, or the weight alone.
  struct Place {
    bool paired;
    std::size_t first;
    std::size_t second;
    int sign;
  };

  /// Throws std::invalid_argument if there is no such unit.
  Place place(std::size_t unit) const {
    core::require(unit < n_columns(), "unit", "less than " + std::to_string(n_columns()), unit);
    const std::size_t m = n_pattern_units();
    const std::size_t group = unit / m;
    const std::size_t mu = group / (n_inputs() - 1);
    const std::size_t nu = group % (n_inputs() - 1) + (group % (n_inputs() - 1) >= mu ? 1 : 0);
    const std::size_t modifier = permutations_[group][unit % m];
    const std::size_t among = mu < nu ? mu : mu - 1;  // of the groups that nu modifies
    const std::size_t pair = among / 2;
    if (pair == n_pairs()) return {false, n_double_columns() + nu * m + modifier, 0, 0};
    const std::size_t first = 2 * (nu * n_pairs() + pair) * m + modifier;
    return {true, first, first + m, among % 2 == 0 ? 1 : -1};
  }

  /// How many columns of the paired code are half a sum or difference; they come first.
  std::size_t n_double_columns() const noexcept {
    return 2 * n_inputs() * n_pairs() * n_pattern_units();
  }

  /// Lists the columns of the paired code that are +1 and -1, double columns first.
  void columns(std::span<const Bin> bins, SignedColumns& out) const {
    const std::size_t m = n_pattern_units();
    const std::size_t most = n_columns() - n_double_columns() / 2 + 8;
    out.positive.resize(most);
    out.negative.resize(most);
    std::uint32_t* positive = out.positive.data();
    std::uint32_t* negative = out.negative.data();
    for_each_pair([&](std::size_t first, std::size_t nu, std::size_t mu_1, std::size_t mu_2) {
      const PairWords x(pattern(nu, bins), signs(mu_1, nu, bins), signs(mu_2, nu, bins));
      positive = detail::list_set_bits(x.sum_plus, first, m, positive);
      negative = detail::list_set_bits(x.sum_minus, first, m, negative);
      positive = detail::list_set_bits(x.difference_plus, first + m, m, positive);
      negative = detail::list_set_bits(x.difference_minus, first + m, m, negative);
    });
    for_each_single([&](std::size_t first, std::size_t nu, std::size_t mu) {
      const Pattern& active = pattern(nu, bins);
      const Pattern plus = active & signs(mu, nu, bins);
      positive = detail::list_set_bits(plus.words(), first, m, positive);
      negative = detail::list_set_bits((active ^ plus).words(), first, m, negative);
    });
    out.positive.resize(static_cast<std::size_t>(positive - out.positive.data()));
    out.negative.resize(static_cast<std::size_t>(negative - out.negative.data()));
  }

  /// Lists the columns in which the paired codes of two states differ, x(to) - x(from); those that
  /// change by 2 twice.
  void difference(std::span<const Bin> from, std::span<const Bin> to, SignedColumns& out) const {
    out.clear();
    const auto change = [&out](std::uint64_t plus_from, std::uint64_t minus_from,
                               std::uint64_t plus_to, std::uint64_t minus_to, std::size_t first) {
      append(plus_to & ~plus_from, first, out.positive);
      append(minus_from & ~minus_to, first, out.positive);
      append(minus_to & ~minus_from, first, out.negative);
      append(plus_from & ~plus_to, first, out.negative);
    };
    for_each_pair([&](std::size_t first, std::size_t nu, std::size_t mu_1, std::size_t mu_2) {
      const PairWords a(pattern(nu, from), signs(mu_1, nu, from), signs(mu_2, nu, from));
      const PairWords b(pattern(nu, to), signs(mu_1, nu, to), signs(mu_2, nu, to));
      for (std::size_t w = 0; w < Pattern::kWords; ++w, first += 64) {
        change(a.sum_plus[w], a.sum_minus[w], b.sum_plus[w], b.sum_minus[w], first);
        change(a.difference_plus[w], a.difference_minus[w], b.difference_plus[w],
               b.difference_minus[w], first + n_pattern_units());
      }
    });
    for_each_single([&](std::size_t first, std::size_t nu, std::size_t mu) {
      const auto active_from = pattern(nu, from).words();
      const auto active_to = pattern(nu, to).words();
      const auto x_from = signs(mu, nu, from).words();
      const auto x_to = signs(mu, nu, to).words();
      for (std::size_t w = 0; w < Pattern::kWords; ++w, first += 64) {
        change(active_from[w] & x_from[w], active_from[w] & ~x_from[w], active_to[w] & x_to[w],
               active_to[w] & ~x_to[w], first);
      }
    });
  }

  /// The integer inner product <x_SD(a), x_SD(b)>.
  std::int32_t inner_product(std::span<const Bin> a, std::span<const Bin> b) const noexcept {
#if SDNN_X86_KERNELS
    if (core::instruction_set() >= core::InstructionSet::avx2) return inner_product_popcnt(a, b);
#endif
    return inner_product_of_words(a, b);
  }

 private:
  /// Two groups with one modifier as half their sum and half their difference.
  struct PairWords {
    PairWords(const Pattern& modifier, const Pattern& x_1, const Pattern& x_2) noexcept {
      const auto active = modifier.words();
      const auto positive_1 = x_1.words();
      const auto positive_2 = x_2.words();
      for (std::size_t w = 0; w < active.size(); ++w) {
        sum_plus[w] = active[w] & positive_1[w] & positive_2[w];
        sum_minus[w] = active[w] & ~(positive_1[w] | positive_2[w]);
        difference_plus[w] = active[w] & positive_1[w] & ~positive_2[w];
        difference_minus[w] = active[w] & positive_2[w] & ~positive_1[w];
      }
    }

    typename Pattern::Words sum_plus;
    typename Pattern::Words sum_minus;
    typename Pattern::Words difference_plus;
    typename Pattern::Words difference_minus;
  };

  /// How often two of the groups that one input modifies are taken together.
  std::size_t n_pairs() const noexcept { return (n_inputs() - 1) / 2; }

  const Pattern& pattern(std::size_t input, std::span<const Bin> bins) const noexcept {
    return books_[input][bins[input]];
  }

  /// x^mu in the order of the units of x^nu that modify it.
  const Pattern& signs(std::size_t mu, std::size_t nu, std::span<const Bin> bins) const noexcept {
    return in_order_of_modifier_[group_of(mu, nu)][bins[mu]];
  }

  /// Calls visit(first column of the sums, nu, mu_1, mu_2).
  template <class Visit>
  void for_each_pair(Visit&& visit) const {
    std::size_t first = 0;
    for (std::size_t nu = 0; nu < n_inputs(); ++nu) {
      for (std::size_t among = 0; among < 2 * n_pairs(); among += 2) {
        visit(first, nu, among + (among >= nu), among + 1 + (among + 1 >= nu));
        first += 2 * n_pattern_units();
      }
    }
  }

  /// Calls visit(first column, nu, mu) for the groups that are left over.
  template <class Visit>
  void for_each_single(Visit&& visit) const {
    if (n_inputs() % 2 != 0) return;
    std::size_t first = n_double_columns();
    for (std::size_t nu = 0; nu < n_inputs(); ++nu, first += n_pattern_units()) {
      visit(first, nu, nu + 1 < n_inputs() ? n_inputs() - 1 : n_inputs() - 2);
    }
  }

  [[gnu::always_inline]] std::int32_t inner_product_of_words(
      std::span<const Bin> a, std::span<const Bin> b) const noexcept {
    int sum = 0;
    const std::size_t l = n_inputs();
    for (std::size_t nu = 0; nu < l; ++nu) {
      const auto active = (books_[nu][a[nu]] & books_[nu][b[nu]]).words();
      int n_active = 0;
      for (const std::uint64_t word : active) n_active += std::popcount(word);
      int n_differing = 0;
      for (std::size_t mu = 0; mu < l; ++mu) {
        if (mu == nu) continue;
        const auto differing = (signs(mu, nu, a) ^ signs(mu, nu, b)).words();
        for (std::size_t w = 0; w < active.size(); ++w) {
          n_differing += std::popcount(active[w] & differing[w]);
        }
      }
      sum += static_cast<int>(l - 1) * n_active - 2 * n_differing;
    }
    return sum;
  }

#if SDNN_X86_KERNELS
  /// The same with the processor's own bit count, which every processor with AVX2 has.
  [[gnu::target("popcnt")]] std::int32_t inner_product_popcnt(
      std::span<const Bin> a, std::span<const Bin> b) const noexcept {
    return inner_product_of_words(a, b);
  }
#endif

  std::size_t group_of(std::size_t mu, std::size_t nu) const noexcept {
    return mu * (n_inputs() - 1) + (nu < mu ? nu : nu - 1);
  }

  void require_permutation(const Permutation& permutation) const {
    core::require(permutation.size() == n_pattern_units(), "permutation",
                  std::to_string(n_pattern_units()) + " units long", permutation.size());
    std::vector<bool> seen(permutation.size(), false);
    for (const std::uint32_t unit : permutation) {
      core::require(unit < seen.size() && !seen[unit], "permutation",
                    "every unit number exactly once", unit);
      seen[unit] = true;
    }
  }

  static void append(std::uint64_t word, std::size_t first, std::vector<std::uint32_t>& list) {
    for (; word != 0; word &= word - 1) {
      list.push_back(
          static_cast<std::uint32_t>(first + static_cast<std::size_t>(std::countr_zero(word))));
    }
  }

  std::vector<CodeBook<Capacity>> books_;
  std::vector<Permutation> permutations_;
  std::vector<std::vector<Pattern>> in_order_of_modifier_;  ///< [group][bin of mu]
};

}  // namespace sdnn::coding
