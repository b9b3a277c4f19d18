/// Layer 3: for every pair of inputs, the pattern of one desensitized by that of the other.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/bit_layer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace sdnn::coding {

/// A pair of inputs: the pattern of `modified` is desensitized by that of `modifier`.
struct InputPair {
  std::size_t modified = 0;
  std::size_t modifier = 0;

  auto operator<=>(const InputPair&) const = default;
};

/// A table of patterns for each pair of inputs; pairs may share tables.
using SharedTables = std::vector<std::shared_ptr<const PatternTable>>;

namespace detail {

/// The words of a table, and the input whose bin selects a pattern of it.
struct TableOfInput {
  const core::BitWord* words;
  std::size_t input;

  /// Returns the pattern, of `n_words` words, for a sample with `bins`, one bin per input.
  SDNN_INLINE const core::BitWord* pattern(const Bin* bins, std::size_t n_words) const noexcept {
    return words + static_cast<std::size_t>(bins[input]) * n_words;
  }
};

/// A modifier's table and the pairs that it desensitizes, `begin` to `end`.
struct Gate {
  TableOfInput modifier;
  std::size_t begin;
  std::size_t end;
};

/// Computes the product <x_SD(a), x_SD(b)>, gate by gate: where both modifiers are +1, the number
/// of equal signs minus that of unequal signs. `Words` is n_words as a constant, which lets the
/// compiler unroll the loops; 0 stands for any number.
template <std::size_t Words>
SDNN_INLINE std::int32_t gated_product_of_width(std::span<const Gate> gates,
                                                const TableOfInput* modified, std::size_t n_words,
                                                const Bin* a, const Bin* b) noexcept {
  const std::size_t width = Words > 0 ? Words : n_words;
  std::int32_t sum = 0;
  for (const Gate& gate : gates) {
    const core::BitWord* const gate_a = gate.modifier.pattern(a, width);
    const core::BitWord* const gate_b = gate.modifier.pattern(b, width);
    std::int32_t both = 0;
    for (std::size_t w = 0; w < width; ++w) {
      both += std::popcount((gate_a[w] & gate_b[w]).to_ullong());
    }
    std::int32_t unlike = 0;
    for (std::size_t pair = gate.begin; pair < gate.end; ++pair) {
      const core::BitWord* const x_a = modified[pair].pattern(a, width);
      const core::BitWord* const x_b = modified[pair].pattern(b, width);
      for (std::size_t w = 0; w < width; ++w) {
        unlike += std::popcount((gate_a[w] & gate_b[w] & (x_a[w] ^ x_b[w])).to_ullong());
      }
    }
    sum += static_cast<std::int32_t>(gate.end - gate.begin) * both - 2 * unlike;
  }
  return sum;
}

SDNN_INLINE std::int32_t gated_product_body(std::span<const Gate> gates,
                                            const TableOfInput* modified, std::size_t n_words,
                                            const Bin* a, const Bin* b) noexcept {
  // The paper's 200 units have four words, so the loop is compiled for this number too.
  return n_words == 4 ? gated_product_of_width<4>(gates, modified, n_words, a, b)
                      : gated_product_of_width<0>(gates, modified, n_words, a, b);
}

}  // namespace detail

/// The inner product of the codes of two samples, read from the tables.
SDNN_KERNEL(std::int32_t, gated_product,
            (std::span<const detail::Gate> gates, const detail::TableOfInput* modified,
             std::size_t n_words, const Bin* a, const Bin* b),
            (gates, modified, n_words, a, b))

/// x_SD: for each pair (mu, nu) the pattern of input mu where that of nu is +1, and 0 elsewhere.
///
/// In the paper x^mu(nu)_k = (1 + (sigma_mu_nu x^nu)_k) / 2 * x^mu_k. Every pair has a table of its
/// modified input and a table of its modifier. Permutations are applied to the tables before, and
/// pairs may share a table.
///
/// Columns are numbered pair by pair, n_units each. Kernels number them in *slots*: each pair
/// begins on a 64-bit word, so slots and columns differ if n_units % 64 != 0.
///
/// Source: section 3.1 (layer 3); Nonaka, Tanaka, Morita 2011.
class SelectiveDesensitization {
 public:
  /// Makes the code of `pairs`; pair p uses tables modified[p] and modifiers[p]. Consecutive pairs
  /// with the same modifier and modifier table form a gate, so that inner products read this table
  /// once.
  ///
  /// Throws std::invalid_argument if the lists differ in length or are empty, if the tables differ
  /// in n_units, or if two tables of one input differ in n_bins.
  SelectiveDesensitization(SharedTables modified, SharedTables modifiers,
                           std::vector<InputPair> pairs)
      : modified_(std::move(modified)), modifiers_(std::move(modifiers)), pairs_(std::move(pairs)) {
    core::instruction_set();  // an unusable level throws here, not later in a thread or kernel
    core::require(!pairs_.empty(), "pairs", "at least one pair", pairs_.size());
    core::require(modified_.size() == pairs_.size(), "modified", "one table per pair",
                  modified_.size());
    core::require(modifiers_.size() == pairs_.size(), "modifiers", "one table per pair",
                  modifiers_.size());
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      record_bins(pairs_[p].modified, *modified_[p]);
      record_bins(pairs_[p].modifier, *modifiers_[p]);
    }
    const std::uint64_t n_columns = std::uint64_t{n_pairs()} * n_units();
    core::require(n_columns <= (std::uint64_t{1} << 30), "n_pairs * n_units", "at most 2^30",
                  n_columns);
    std::size_t most_on = 0;  // the largest number of +1 in a pattern of the latest gate
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      modified_at_.push_back({modified_[p]->words(), pairs_[p].modified});
      const bool is_new = p == 0 || modifiers_[p] != modifiers_[p - 1] ||
                          pairs_[p].modifier != pairs_[p - 1].modifier;
      if (is_new) {
        gates_.push_back({{modifiers_[p]->words(), pairs_[p].modifier}, p, p});
        most_on = largest_count(*modifiers_[p]);
      }
      gates_.back().end = p + 1;
      max_active_ += most_on;
    }
  }
  /// Takes tables that no pairs share.
  SelectiveDesensitization(std::vector<PatternTable> modified, std::vector<PatternTable> modifiers,
                           std::vector<InputPair> pairs)
      : SelectiveDesensitization(shared(std::move(modified)), shared(std::move(modifiers)),
                                 std::move(pairs)) {}

  std::size_t n_inputs() const noexcept { return n_bins_.size(); }
  std::size_t n_pairs() const noexcept { return pairs_.size(); }
  std::size_t n_units() const noexcept { return modified_.front()->n_units(); }
  std::size_t n_columns() const noexcept { return n_pairs() * n_units(); }
  /// The number of words of a pair's columns.
  std::size_t n_pair_words() const noexcept { return modified_.front()->n_words(); }
  /// The number of words of 64 slots in the code of a sample.
  std::size_t n_words() const noexcept { return n_pairs() * n_pair_words(); }
  std::size_t n_slots() const noexcept { return 64 * n_words(); }
  /// The largest number of columns of a code that are not 0, a bound of all inner products.
  std::size_t max_active() const noexcept { return max_active_; }
  /// The number of patterns of an input; 0 if no pair uses it.
  std::size_t n_bins(std::size_t input) const noexcept { return n_bins_[input]; }
  InputPair pair(std::size_t p) const noexcept { return pairs_[p]; }

  /// Returns the slot of a column, which lies at the same unit of the same pair.
  std::size_t slot_of(std::size_t column) const noexcept {
    return column / n_units() * 64 * n_pair_words() + column % n_units();
  }

  /// Throws std::invalid_argument unless all `bins` are bins of their inputs.
  ///
  /// Shapes: bins (n_samples, n_inputs).
  void check_bins(std::span<const Bin> bins) const {
    core::require(bins.size() % n_inputs() == 0, "bins",
                  "n_inputs = " + std::to_string(n_inputs()) + " per sample", bins.size());
    for (std::size_t i = 0; i < bins.size(); ++i) {
      const std::size_t limit = n_bins_[i % n_inputs()];
      if (bins[i] >= 0 && (limit == 0 || static_cast<std::size_t>(bins[i]) < limit)) continue;
      core::require(
          false,
          "bins[" + std::to_string(i / n_inputs()) + ", " + std::to_string(i % n_inputs()) + "]",
          "in [0, " + std::to_string(limit) + ")", bins[i]);
    }
  }

  /// Units of a sample's code that are not 0 (`active`) and that are +1 (`positive`).
  ///
  /// Shapes: bins (n_inputs,), checked before; active and positive (n_words,).
  void encode(std::span<const Bin> bins, std::uint64_t* active,
              std::uint64_t* positive) const noexcept {
    const std::size_t n_words = n_pair_words();
    for (const detail::Gate& gate : gates_) {
      const core::BitWord* const gate_bits = gate.modifier.pattern(bins.data(), n_words);
      for (std::size_t p = gate.begin; p < gate.end; ++p) {
        const core::BitWord* const x = modified_at_[p].pattern(bins.data(), n_words);
        for (std::size_t w = 0; w < n_words; ++w) {
          *active++ = gate_bits[w].to_ullong();
          *positive++ = (gate_bits[w] & x[w]).to_ullong();
        }
      }
    }
  }

  /// Encodes a single word, number `word` of a pair, from the bins of the pair's inputs.
  void encode_word(std::size_t pair, std::size_t word, Bin modified, Bin modifier,
                   std::uint64_t* active, std::uint64_t* positive) const noexcept {
    const std::size_t n_words = n_pair_words();
    const auto x = modified_[pair]->words()[static_cast<std::size_t>(modified) * n_words + word];
    const auto gate_bits =
        modifiers_[pair]->words()[static_cast<std::size_t>(modifier) * n_words + word];
    *active = gate_bits.to_ullong();
    *positive = (gate_bits & x).to_ullong();
  }

  /// The inner product of the codes of two samples. Shapes: (n_inputs,), checked before.
  std::int32_t inner_product(std::span<const Bin> a, std::span<const Bin> b) const {
    assert(a.size() == n_inputs() && b.size() == n_inputs());
    return gated_product(gates_, modified_at_.data(), n_pair_words(), a.data(), b.data());
  }

 private:
  /// Moves tables into shared ownership, since a table is often used by several pairs.
  static SharedTables shared(std::vector<PatternTable> tables) {
    SharedTables result;
    for (PatternTable& table : tables) {
      result.push_back(std::make_shared<const PatternTable>(std::move(table)));
    }
    return result;
  }

  /// Returns the largest number of +1 in a pattern: the columns that it can leave undesensitized.
  static std::size_t largest_count(const PatternTable& table) noexcept {
    std::size_t most = 0;
    for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
      most = std::max(most, table[bin].count());
    }
    return most;
  }

  /// Records the number of bins of an input. Throws std::invalid_argument unless all tables have
  /// the same number of units, and all tables of one input the same number of bins.
  void record_bins(std::size_t input, const PatternTable& table) {
    core::require(input < (std::size_t{1} << 20), "pairs", "inputs below 2^20", input);
    core::require(table.n_units() == n_units(), "tables", "all of one n_units", table.n_units());
    if (input >= n_bins_.size()) n_bins_.resize(input + 1);
    core::require(n_bins_[input] == 0 || n_bins_[input] == table.n_bins(), "tables of one input",
                  "all of one n_bins", table.n_bins());
    n_bins_[input] = table.n_bins();
  }

  SharedTables modified_;
  SharedTables modifiers_;
  std::vector<InputPair> pairs_;
  std::vector<std::size_t> n_bins_;
  std::vector<detail::Gate> gates_;
  std::vector<detail::TableOfInput> modified_at_;  // for each pair, where its modified patterns are
  std::size_t max_active_ = 0;
};

}  // namespace sdnn::coding
