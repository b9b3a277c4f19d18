/// The workspaces of a linear readout: codes, sums and traces.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/coding/pattern_table.hpp"

namespace sdnn::approximators {

class LinearSDNN;

/// The code of a state in the form for products with rows of weights.
class LinearCode {
 public:
  /// Columns that are not 0.
  std::int32_t n_active() const noexcept { return n_active_; }
  /// -1, 0 or +1 for each column.
  std::vector<std::int8_t> signs() const {
    std::vector<std::int8_t> signs(active_.size());
    for (std::size_t j = 0; j < signs.size(); ++j) {
      signs[j] = static_cast<std::int8_t>(times_code(1, active_[j], negative_[j]));
    }
    return signs;
  }

 private:
  friend class LinearSDNN;
  CodeMasks masks() const noexcept { return {active_.data(), negative_.data()}; }

  std::vector<std::int32_t> active_, negative_;
  std::int32_t n_active_ = 0;
};

/// The workspace of a user who reads the model: a state, its code, and the sums of rows over it,
/// each updated after its weights have changed.
class LinearWorkspace {
 public:
  const LinearCode& code() const noexcept { return code_; }

 private:
  friend class LinearSDNN;
  LinearCode code_;
  std::vector<coding::Bin> bins_, new_bins_;
  std::vector<std::uint64_t> words_;
  std::vector<std::int64_t> row_sums_;
  std::vector<std::uint64_t> versions_;  ///< versions of the summed rows; 0: none
  std::vector<std::int64_t> sums_;       ///< sums of the actions of a dimension
};

/// The traces of a stream of experience: the weights that contributed to earlier values.
class LinearTrace {
 public:
  void clear() noexcept {
    for (std::size_t row = 0; row < live_.size(); ++row) {
      if (live_[row]) std::fill_n(&values_[row * n_columns_], n_columns_, 0);
      live_[row] = false;
    }
  }

  /// Lists the state; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::vector<std::int32_t> values;  // empty without a trace
    if (std::ranges::find(self.live_, true) != self.live_.end()) values = self.values_;
    archive.numbers("values", values);
    if constexpr (Archive::kReads) {
      archive.expect(values.empty() || values.size() == self.values_.size(), "values",
                     "empty or one for each weight");
      archive.expect(
          std::ranges::all_of(values, [](std::int32_t z) { return std::abs(z) <= kLargestTrace; }),
          "values", "in their range");
      values.resize(self.values_.size());
      self.values_ = std::move(values);
      for (std::size_t row = 0; row < self.live_.size(); ++row) {
        const auto* const first = &self.values_[row * self.n_columns_];
        self.live_[row] = std::any_of(first, first + self.n_columns_, [](auto z) { return z; });
      }
    }
  }

 private:
  friend class LinearSDNN;
  LinearTrace(std::size_t n_rows, std::size_t n_columns)
      : n_columns_(n_columns), values_(n_rows * n_columns), live_(n_rows) {}

  std::size_t n_columns_;
  std::vector<std::int32_t> values_;
  std::vector<bool> live_;  ///< rows that are not all 0
};

}  // namespace sdnn::approximators
