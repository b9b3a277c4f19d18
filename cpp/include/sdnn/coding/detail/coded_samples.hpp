/// The codes of several samples, as words of bits or as bytes +1, 0 and -1, and the inner products
/// of two codes.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/interruption.hpp"

namespace sdnn::coding {

/// The codes of several samples, each padded with zeros to a multiple of 4 words, the 256 bits of a
/// vector register, as inner_product reads them fastest.
class CodedSamples {
 public:
  /// Encodes samples. Shapes: bins (n_samples, n_inputs), checked before.
  CodedSamples(const SelectiveDesensitization& code, std::span<const Bin> bins)
      : n_words_(padded_words(code)),
        size_(bins.size() / code.n_inputs()),
        words_(2 * n_words_ * size_) {
    for (std::size_t t = 0; t < size_; ++t) {
      code.encode(bins.subspan(t * code.n_inputs(), code.n_inputs()),
                  words_.data() + 2 * t * n_words_, words_.data() + (2 * t + 1) * n_words_);
    }
  }

  std::size_t size() const noexcept { return size_; }
  /// The number of words of a code, a multiple of 4.
  std::size_t n_words() const noexcept { return n_words_; }
  TernaryCode operator[](std::size_t t) const noexcept {
    const std::uint64_t* const active = words_.data() + 2 * t * n_words_;
    return {active, active + n_words_};
  }
  /// Returns the memory of the codes of `n_samples` samples.
  static std::uint64_t bytes(const SelectiveDesensitization& code,
                             std::uint64_t n_samples) noexcept {
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

/// Writes the entries +1, 0, -1 of the codes of samples.
///
/// Shapes: bins (n_samples, n_inputs), signs (n_samples, n_columns). Throws std::invalid_argument
/// for bins out of range.
inline void write_signs(const SelectiveDesensitization& code, std::span<const Bin> bins,
                        std::span<std::int8_t> signs) {
  code.check_bins(bins);
  const CodedSamples coded(code, bins);
  assert(signs.size() == coded.size() * code.n_columns());
  std::int8_t* sign = signs.data();
  for (std::size_t t = 0; t < coded.size(); ++t) {
    for (std::size_t j = 0; j < code.n_columns(); ++j) {
      const std::size_t slot = code.slot_of(j);
      const auto active = static_cast<int>(coded[t].active[slot / 64] >> slot % 64 & 1);
      const auto positive = static_cast<int>(coded[t].positive[slot / 64] >> slot % 64 & 1);
      *sign++ = static_cast<std::int8_t>(2 * positive - active);
    }
  }
}

/// Writes the inner products of the codes of n samples with those of m other samples.
///
/// Shapes: bins (n, n_inputs), others (m, n_inputs), products (n, m). Throws std::invalid_argument
/// for bins out of range.
inline void write_products(const SelectiveDesensitization& code, std::span<const Bin> bins,
                           std::span<const Bin> others, std::span<std::int32_t> products) {
  code.check_bins(bins);
  code.check_bins(others);
  const CodedSamples coded(code, bins);
  const CodedSamples coded_others(code, others);
  assert(products.size() == coded.size() * coded_others.size());
  std::int32_t* product = products.data();
  for (std::size_t t = 0; t < coded.size(); ++t) {
    core::interruption_point();
    for (std::size_t s = 0; s < coded_others.size(); ++s) {
      *product++ = inner_product(coded[t], coded_others[s], coded.n_words());
    }
  }
}

}  // namespace sdnn::coding
