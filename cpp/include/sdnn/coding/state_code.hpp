/// Layers 2 and 3 as fixed wiring: from a state to its ternary code.
#pragma once

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/coding/desensitization.hpp"
#include "sdnn/coding/pattern_code.hpp"
#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/check.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace sdnn::coding {

/// The columns (units of layer 3) whose value is not 0, by sign; one of value 2 comes twice.
struct SignedColumns {
  std::vector<std::uint32_t> positive;
  std::vector<std::uint32_t> negative;
  std::vector<std::int16_t> values = {};  ///< scratch of whoever needs the whole row

  /// No columns, but room for `n` of each sign, so that listing them allocates nothing.
  static SignedColumns with_capacity(std::size_t n) {
    SignedColumns columns;
    columns.positive.reserve(n);
    columns.negative.reserve(n);
    columns.values.reserve(n);
    return columns;
  }

  void clear() noexcept {
    positive.clear();
    negative.clear();
  }
};

/// Layers 2 and 3 as fixed wiring: from a state to its ternary code x_SD.
///
/// Group (mu, nu), nu != mu, has number mu * (l - 1) + (nu < mu ? nu : nu - 1), and holds the
/// columns [number * m, (number + 1) * m). Permuted patterns are looked up, not computed.
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

    permuted_.resize(n_groups());
    for_each_group([&](std::size_t group, std::size_t, std::size_t nu) {
      for (std::size_t bin = 0; bin < books_[nu].n_bins(); ++bin) {
        permuted_[group].push_back(
            permute(books_[nu][static_cast<Bin>(bin)], permutations_[group]));
      }
    });
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

  /// The ternary pattern of one group for a coded state.
  TernaryPattern<Capacity> group(std::size_t mu, std::size_t nu, std::span<const Bin> bins) const {
    return desensitize(books_[mu][bins[mu]], permuted_[group_of(mu, nu)][bins[nu]]);
  }

  /// Lists the columns of x_SD that are +1 and -1.
  void columns(std::span<const Bin> bins, SignedColumns& out) const {
    out.clear();
    for_each_group([&](std::size_t group, std::size_t mu, std::size_t nu) {
      const auto active = permuted_[group][bins[nu]].words();
      const auto positive = books_[mu][bins[mu]].words();
      for (std::size_t w = 0; w < active.size(); ++w) {
        const std::size_t first = group * n_pattern_units() + w * 64;
        append(active[w] & positive[w], first, out.positive);
        append(active[w] & ~positive[w], first, out.negative);
      }
    });
  }

  /// Lists the columns of x_SD(to) - x_SD(from), those that change by 2 twice.
  void difference(std::span<const Bin> from, std::span<const Bin> to, SignedColumns& out) const {
    out.clear();
    for_each_group([&](std::size_t group, std::size_t mu, std::size_t nu) {
      const auto active_from = permuted_[group][from[nu]].words();
      const auto active_to = permuted_[group][to[nu]].words();
      const auto x_from = books_[mu][from[mu]].words();
      const auto x_to = books_[mu][to[mu]].words();
      for (std::size_t w = 0; w < active_to.size(); ++w) {
        const std::size_t first = group * n_pattern_units() + w * 64;
        const std::uint64_t plus_from = active_from[w] & x_from[w];
        const std::uint64_t minus_from = active_from[w] & ~x_from[w];
        const std::uint64_t plus_to = active_to[w] & x_to[w];
        const std::uint64_t minus_to = active_to[w] & ~x_to[w];
        append(plus_to & ~plus_from, first, out.positive);
        append(minus_from & ~minus_to, first, out.positive);
        append(minus_to & ~minus_from, first, out.negative);
        append(plus_from & ~plus_to, first, out.negative);
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
  template <class Visit>
  void for_each_group(Visit&& visit) const {
    std::size_t group = 0;
    for (std::size_t mu = 0; mu < n_inputs(); ++mu) {
      for (std::size_t nu = 0; nu < n_inputs(); ++nu) {
        if (nu != mu) visit(group++, mu, nu);
      }
    }
  }

  [[gnu::always_inline]] std::int32_t inner_product_of_words(std::span<const Bin> a,
                                                             std::span<const Bin> b) const noexcept {
    int sum = 0;
    const std::size_t l = n_inputs();
    for (std::size_t mu = 0, group = 0; mu < l; ++mu) {
      const auto differing = (books_[mu][a[mu]] ^ books_[mu][b[mu]]).words();
      for (std::size_t nu = 0; nu < l; ++nu) {
        if (nu == mu) continue;
        const auto active_a = permuted_[group][a[nu]].words();
        const auto active_b = permuted_[group][b[nu]].words();
        for (std::size_t w = 0; w < differing.size(); ++w) {
          const std::uint64_t both = active_a[w] & active_b[w];
          sum += std::popcount(both) - 2 * std::popcount(both & differing[w]);
        }
        ++group;
      }
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
      list.push_back(static_cast<std::uint32_t>(
          first + static_cast<std::size_t>(std::countr_zero(word))));
    }
  }

  std::vector<CodeBook<Capacity>> books_;
  std::vector<Permutation> permutations_;
  std::vector<std::vector<Pattern>> permuted_;  ///< [group][bin of nu]
};

}  // namespace sdnn::coding
