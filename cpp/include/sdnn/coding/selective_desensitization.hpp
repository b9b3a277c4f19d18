/// The code of a sample: for every pair of inputs, one pattern desensitized by another.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::coding {

/// A pair of inputs: the pattern of `modified` is desensitized by that of `modifier`.
struct InputPair {
  std::size_t modified = 0;
  std::size_t modifier = 0;
};

/// A code as words of bits: where it is not 0, and where it is +1.
struct CodeWords {
  const std::uint64_t* active;
  const std::uint64_t* positive;
};

/// x_SD: for each pair (mu, nu) the pattern of input mu where that of nu is +1, and 0 elsewhere.
///
/// Columns are numbered pair by pair. Inside, a pair starts on a 64-bit word: *slot* s of the
/// padded numbering is bit s % 64 of word s / 64, so slots and columns differ if n_units % 64 != 0.
///
/// Source: Nonaka, Tanaka, Morita 2011; section 3.1 of the acrobot paper, layer 3. One table per
/// pair and role: separate tables, shared ones and permuted ones differ only in what they hold.
class SelectiveDesensitization {
 public:
  /// One table of each list per pair.
  ///
  /// Throws std::invalid_argument if the lists differ in length or are empty, if the tables differ
  /// in n_units, or if two tables of one input differ in n_bins.
  SelectiveDesensitization(std::vector<PatternTable> modified, std::vector<PatternTable> modifiers,
                           std::vector<InputPair> pairs)
      : modified_(std::move(modified)), modifiers_(std::move(modifiers)), pairs_(std::move(pairs)) {
    core::require(!pairs_.empty(), "pairs", "at least one pair", pairs_.size());
    core::require(modified_.size() == pairs_.size(), "modified", "one table per pair",
                  modified_.size());
    core::require(modifiers_.size() == pairs_.size(), "modifiers", "one table per pair",
                  modifiers_.size());
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      note_input(pairs_[p].modified, modified_[p]);
      note_input(pairs_[p].modifier, modifiers_[p]);
    }
    core::require(n_columns() <= (std::size_t{1} << 30), "n_pairs * n_units", "at most 2^30",
                  n_columns());
    for (const PatternTable& table : modifiers_) {
      std::size_t most = 0;
      for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
        std::size_t n_on = 0;
        for (const std::uint64_t word : table[bin]) {
          n_on += static_cast<std::size_t>(std::popcount(word));
        }
        most = std::max(most, n_on);
      }
      max_active_ += most;
    }
  }

  std::size_t n_inputs() const noexcept { return n_bins_.size(); }
  std::size_t n_pairs() const noexcept { return pairs_.size(); }
  std::size_t n_units() const noexcept { return modified_.front().n_units(); }
  std::size_t n_columns() const noexcept { return n_pairs() * n_units(); }
  /// Words of 64 slots in the code of a sample.
  std::size_t n_words() const noexcept { return n_pairs() * modified_.front().n_words(); }
  std::size_t n_slots() const noexcept { return 64 * n_words(); }
  /// The most columns of a code that are not 0: no code's products exceed it.
  std::size_t max_active() const noexcept { return max_active_; }
  /// The patterns of an input; 0 if no pair uses it.
  std::size_t n_bins(std::size_t input) const noexcept { return n_bins_[input]; }
  InputPair pair(std::size_t p) const noexcept { return pairs_[p]; }

  std::size_t slot_of(std::size_t column) const noexcept {
    return column / n_units() * 64 * modified_.front().n_words() + column % n_units();
  }

  /// Throws std::invalid_argument unless every one of `bins` is a bin of its input.
  ///
  /// Shapes: bins (n_samples, n_inputs).
  void check_bins(std::span<const std::int32_t> bins) const {
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

  /// Where the code of a sample is not 0 (`active`) and where it is +1 (`positive`).
  ///
  /// Shapes: bins (n_inputs,), checked before; active and positive (n_words,).
  void encode(std::span<const std::int32_t> bins, std::uint64_t* active,
              std::uint64_t* positive) const noexcept {
    const std::size_t n_words = modified_.front().n_words();
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      const auto mu = modified_[p][static_cast<std::size_t>(bins[pairs_[p].modified])];
      const auto nu = modifiers_[p][static_cast<std::size_t>(bins[pairs_[p].modifier])];
      for (std::size_t w = 0; w < n_words; ++w) {
        active[p * n_words + w] = nu[w];
        positive[p * n_words + w] = nu[w] & mu[w];
      }
    }
  }

 private:
  void note_input(std::size_t input, const PatternTable& table) {
    core::require(input < (std::size_t{1} << 20), "pairs", "inputs below 2^20", input);
    core::require(table.n_units() == n_units(), "tables", "all of one n_units", table.n_units());
    if (input >= n_bins_.size()) n_bins_.resize(input + 1);
    core::require(n_bins_[input] == 0 || n_bins_[input] == table.n_bins(), "tables of one input",
                  "all of one n_bins", table.n_bins());
    n_bins_[input] = table.n_bins();
  }

  std::vector<PatternTable> modified_;
  std::vector<PatternTable> modifiers_;
  std::vector<InputPair> pairs_;
  std::vector<std::size_t> n_bins_;
  std::size_t max_active_ = 0;
};

/// The codes of several samples, filled up with zeros to a multiple of 4 words: what popcounts and
/// weight updates read.
class CodedSamples {
 public:
  /// Shapes: bins (n_samples, n_inputs), checked before.
  CodedSamples(const SelectiveDesensitization& code, std::span<const std::int32_t> bins)
      : n_words_(padded_words(code)),
        size_(bins.size() / code.n_inputs()),
        words_(2 * n_words_ * size_) {
    for (std::size_t t = 0; t < size_; ++t) {
      code.encode(bins.subspan(t * code.n_inputs(), code.n_inputs()),
                  words_.data() + 2 * t * n_words_, words_.data() + (2 * t + 1) * n_words_);
    }
  }

  std::size_t size() const noexcept { return size_; }
  /// Words of a code, a multiple of 4.
  std::size_t n_words() const noexcept { return n_words_; }
  CodeWords operator[](std::size_t t) const noexcept {
    const std::uint64_t* const active = words_.data() + 2 * t * n_words_;
    return {active, active + n_words_};
  }
  static std::size_t bytes(const SelectiveDesensitization& code, std::size_t n_samples) noexcept {
    return 2 * sizeof(std::uint64_t) * padded_words(code) * n_samples;
  }

 private:
  static std::size_t padded_words(const SelectiveDesensitization& code) noexcept {
    return core::round_up(code.n_words(), 4);
  }

  std::size_t n_words_;
  std::size_t size_;
  std::vector<std::uint64_t> words_;
};

}  // namespace sdnn::coding
