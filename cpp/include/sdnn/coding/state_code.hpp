/// Layers 2 and 3, the fixed wiring from a state to its ternary code.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/permutation.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::coding {

/// The code x_SD of states in [0, 1]^l over ordered pairs of inputs, a table per input.
///
/// In the paper all pairs (mu, nu), nu != mu, have a *group* of m units. This class also allows
/// fewer partners, given by *strides*: mu is modified by mu + stride, modulo l, for each of p
/// strides, so that every input is modified by p others and modifies p others. With all l - 1
/// strides it is the paper's code.
///
/// In the paper's order groups are sorted by mu, then nu. Unit k of group g is unit g * m + k of
/// x_SD: unit k of x^mu, modified by unit sigma_mu_nu[k] of x^nu. The stored group is sorted by the
/// units that modify it: unit q is modified by unit q of x^nu. All groups (mu, nu) of one nu then
/// have the same neutral units, those that are -1 in the pattern of nu, their *gate*.
///
/// The *paired code* halves the number of columns to read or correct. Unit q of x^nu modifies one
/// unit in each of its p groups, and these are neutral together. Two of them, x_i and x_j, are
/// replaced by (x_i + x_j) / 2 and (x_i - x_j) / 2. Of these at least one is always neutral, as x_i
/// and x_j are both +1 or -1, or both neutral. The paired code has D columns too. Its first
/// n_double_columns() are such halves: for each nu and each two of its groups m half sums, then m
/// half differences, in the order of q. If p is odd, the group of the last mu of each nu has no
/// partner and follows unchanged.
class StateCode {
 public:
  /// Makes the wiring from tables, one per input, permutations, one per group in the paper's order,
  /// and strides, by default all of them.
  ///
  /// Throws std::invalid_argument unless there are at least two tables of one pattern size,
  /// ascending strides of 1 to l - 1, and l permutations of that size for each of them.
  StateCode(std::vector<PatternTable> tables, std::vector<Permutation> permutations,
            std::vector<std::size_t> strides = {})
      : tables_(checked(std::move(tables))),
        permutations_(std::move(permutations)),
        strides_(strides.empty() ? all_strides() : std::move(strides)),
        groups_(list_groups()),
        ranks_(rank_groups()),
        code_(make_code()) {}

  std::size_t n_inputs() const noexcept { return tables_.size(); }
  std::size_t n_pattern_units() const noexcept { return tables_.front()->n_units(); }
  /// p, the number of inputs that each input modifies, and by which it is modified; l - 1 in the
  /// paper.
  std::size_t n_partners() const noexcept { return strides_.size(); }
  std::size_t n_groups() const noexcept { return n_inputs() * n_partners(); }
  /// The pairs (mu, nu) of all groups in the paper's order.
  std::span<const InputPair> groups() const noexcept { return groups_; }
  /// D = m l p, the length of x_SD; m l (l - 1) in the paper.
  std::size_t n_columns() const noexcept { return n_pattern_units() * n_groups(); }
  /// The number of words of the paired code.
  std::size_t n_words() const noexcept { return n_groups() * code_.n_pair_words(); }
  /// Number of columns of the paired code that are half a sum or difference; they come first.
  std::size_t n_double_columns() const noexcept {
    return 2 * n_inputs() * n_pairs() * n_pattern_units();
  }
  /// Returns buffers for the columns of the paired code.
  ColumnLists column_lists() const { return {n_words(), code_.n_pair_words(), n_pattern_units()}; }

  /// The patterns of an input. Throws std::out_of_range if there is no such input.
  const PatternTable& table(std::size_t input) const { return *tables_.at(input); }
  /// sigma_mu_nu. Throws std::invalid_argument unless mu and nu are two inputs with a group.
  const Permutation& permutation(std::size_t mu, std::size_t nu) const {
    const auto found = std::ranges::find(groups_, InputPair{.modified = mu, .modifier = nu});
    core::require(found != groups_.end(), "(mu, nu)", "a pair of two different inputs in the code",
                  mu * n_inputs() + nu);
    return permutations_[static_cast<std::size_t>(found - groups_.begin())];
  }

  /// The bin of every input. Shapes: state (l,), bins (l,).
  ///
  /// Throws std::invalid_argument if the size is wrong or a value is not in [0, 1].
  void bins_of(std::span<const double> state, std::span<Bin> bins) const {
    core::require_unit_values("state", state, n_inputs());
    assert(bins.size() == n_inputs());
    for (std::size_t mu = 0; mu < state.size(); ++mu) {
      bins[mu] = bin_of(state[mu], tables_[mu]->n_bins());
    }
  }

  /// The columns of the paired code that a unit of x_SD has become. For a `paired` unit, the value
  /// is that of column `first` plus `sign` times that of column `second`, and the weight is half of
  /// the same sum of their weights. Any other unit has value and weight of column `first`.
  struct PairedColumns {
    bool paired;
    std::size_t first, second;
    int sign;
  };

  /// Finds the columns of a unit, numbered in the paper's order. Throws std::invalid_argument if
  /// there is no such unit.
  PairedColumns columns_of(std::size_t unit) const {
    core::require_below("unit", unit, n_columns());
    const std::size_t m = n_pattern_units();
    const std::size_t group = unit / m;
    const std::size_t nu = groups_[group].modifier;
    const std::size_t modifier = permutations_[group][unit % m];
    const std::size_t rank = ranks_[group];
    const std::size_t pair = rank / 2;
    if (pair == n_pairs()) return {false, n_double_columns() + nu * m + modifier, 0, 0};
    const std::size_t first = 2 * (nu * n_pairs() + pair) * m + modifier;
    return {true, first, first + m, rank % 2 == 0 ? 1 : -1};
  }

  /// The paired code of a state. Shapes: bins (l,), active and positive (n_words,).
  void encode(std::span<const Bin> bins, std::uint64_t* active,
              std::uint64_t* positive) const noexcept {
    code_.encode(bins, active, positive);
    // Two groups of one gate become their half sum and half difference. Signs (+1, +1) become
    // (+1, 0), (+1, -1) become (0, +1), (-1, +1) become (0, -1) and (-1, -1) become (-1, 0).
    const std::size_t width = code_.n_pair_words();
    for (std::size_t first = 0; first < 2 * n_inputs() * n_pairs() * width; first += 2 * width) {
      for (std::size_t w = first; w < first + width; ++w) {
        const std::uint64_t first_sign = positive[w];
        const std::uint64_t second_sign = positive[w + width];
        const std::uint64_t unlike = first_sign ^ second_sign;
        active[w] ^= unlike;  // the half sum is neutral where the signs differ
        positive[w] = first_sign & second_sign;
        active[w + width] = unlike;
        positive[w + width] = first_sign & ~second_sign;
      }
    }
  }

  /// The integer inner product <x_SD(a), x_SD(b)> of two samples' bins. Shapes: (l,).
  std::int32_t inner_product(std::span<const Bin> a, std::span<const Bin> b) const {
    return code_.inner_product(a, b);
  }

 private:
  /// The number of pairs that the groups modified by one input form.
  std::size_t n_pairs() const noexcept { return n_partners() / 2; }

  std::vector<std::size_t> all_strides() const {
    std::vector<std::size_t> strides(n_inputs() - 1);
    std::iota(strides.begin(), strides.end(), 1);
    return strides;
  }

  /// The ordered pairs of inputs at the distances `strides` in the circle of inputs, sorted.
  std::vector<InputPair> list_groups() const {
    for (std::size_t i = 0; i < strides_.size(); ++i) {
      core::require(strides_[i] > (i == 0 ? 0 : strides_[i - 1]) && strides_[i] < n_inputs(),
                    "strides", "ascending from 1 to n_inputs - 1", strides_[i]);
    }
    std::vector<InputPair> groups;
    for (std::size_t mu = 0; mu < n_inputs(); ++mu) {
      for (const std::size_t stride : strides_) {
        groups.push_back({.modified = mu, .modifier = (mu + stride) % n_inputs()});
      }
    }
    std::ranges::sort(groups);
    return groups;
  }

  /// For each group, the number of groups before it with the same modifier.
  std::vector<std::size_t> rank_groups() const {
    std::vector<std::size_t> n_before(n_inputs(), 0);
    std::vector<std::size_t> ranks;
    for (const InputPair& pair : groups_) ranks.push_back(n_before[pair.modifier]++);
    return ranks;
  }

  /// Shares the tables; throws std::invalid_argument unless there are 2 to 1024 of one pattern
  /// size.
  static SharedTables checked(std::vector<PatternTable> tables) {
    core::require_in_range("n_inputs", tables.size(), 2, 1024);
    SharedTables result;
    for (PatternTable& table : tables) {
      core::require(table.n_units() == tables.front().n_units(), "tables", "of one n_pattern_units",
                    table.n_units());
    }
    for (PatternTable& table : tables) {
      result.push_back(std::make_shared<const PatternTable>(std::move(table)));
    }
    return result;
  }

  /// Makes the code of all groups in the order of the paired code: first the groups in pairs,
  /// sorted by modifier, then those without a partner.
  SelectiveDesensitization make_code() const {
    core::require(permutations_.size() == n_groups(), "number of permutations",
                  "n_inputs times the number of strides", permutations_.size());
    for (const Permutation& sigma : permutations_) require_permutation(sigma, n_pattern_units());
    SharedTables modified, modifiers;
    std::vector<InputPair> pairs;
    std::vector<std::size_t> order(n_groups());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::sort(order, {}, [&](std::size_t group) {
      return std::tuple(ranks_[group] == 2 * n_pairs(), groups_[group].modifier, ranks_[group]);
    });
    for (const std::size_t group : order) {
      const auto [mu, nu] = groups_[group];
      pairs.push_back(groups_[group]);
      modified.push_back(std::make_shared<const PatternTable>(
          permuted(*tables_[mu], inverse(permutations_[group]))));
      modifiers.push_back(tables_[nu]);
    }
    return {std::move(modified), std::move(modifiers), std::move(pairs)};
  }

  SharedTables tables_;
  std::vector<Permutation> permutations_;
  std::vector<std::size_t> strides_;
  std::vector<InputPair> groups_;
  std::vector<std::size_t> ranks_;
  SelectiveDesensitization code_;
};

}  // namespace sdnn::coding
