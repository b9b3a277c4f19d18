/// A softmax policy with preferences that are linear in the SDNN code, in integers.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/detail/softmax.hpp"
#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::agents {

/// A softmax policy for each dimension of the action: pi(a | s) = exp h(s, a) / sum_b exp h(s, b).
/// The preference h(s, a) is the inner product of the action's weights and the code of s.
///
/// A preference is an integer in units of 2^-n_unit_bits(). Weights, in the same units, are clipped
/// to 23 bits; preferences still reach at least +-64.
class SoftmaxPolicy {
 public:
  using Code = approximators::LinearCode;
  using Trace = approximators::LinearTrace;

  /// The memory in which a thread reads the policy: the preferences of the actions of all
  /// dimensions, one after the other, and their probabilities.
  struct Workspace {
    std::vector<std::int64_t> preferences;
    std::vector<detail::SoftmaxTerm> terms;
  };

  /// The rates of a step of learning.
  struct Step {
    std::int32_t error = 0;    ///< the normalized TD error, in units of 1 / kErrorOne
    std::int32_t rate = 0;     ///< the learning rate, in units of 2^-16
    std::int32_t entropy = 0;  ///< the weight of the entropy's gradient, in units of 2^-16
    std::int32_t decay = 0;    ///< gamma lambda, in units of 1 / kDecayOne
  };
  static constexpr int kErrorBits = 12;
  static constexpr std::int32_t kErrorOne = 1 << kErrorBits;

  /// Makes equal preferences for n_actions[d] actions of each dimension d, over codes of
  /// `n_columns` columns. About n = n_columns / 4 of these are not 0. With b = 16 + bit_width(n)
  /// bits of the unit, n weights of almost 2^23 units are a preference of n 2^23 / 2^b, at least
  /// 2^6 = 64, since bit_width(n) <= 1 + log2(n). Products in `learn` limit b to 40.
  SoftmaxPolicy(std::vector<std::size_t> n_actions, std::size_t n_columns)
      : n_actions_(std::move(n_actions)),
        n_columns_(n_columns),
        n_unit_bits_(std::min(40, 16 + static_cast<int>(std::bit_width(n_columns / 4)))) {
    for (const std::size_t n : n_actions_) n_rows_ += n;
    weights_.resize(n_rows_ * n_columns_);
    read_preferences_.resize(n_rows_);
  }

  std::size_t n_dimensions() const noexcept { return n_actions_.size(); }
  std::size_t n_actions(std::size_t d) const noexcept { return n_actions_[d]; }
  std::size_t n_rows() const noexcept { return n_rows_; }
  int n_unit_bits() const noexcept { return n_unit_bits_; }
  /// Shape: (n_rows, n_columns).
  std::span<const std::int32_t> weights() const noexcept { return weights_; }

  Workspace workspace() const {
    return {std::vector<std::int64_t>(n_rows_), std::vector<detail::SoftmaxTerm>(n_rows_)};
  }
  Trace trace() const { return {n_rows_, n_columns_}; }

  /// Computes the preferences for a code, the slow part of an act, or copies those that were kept.
  void read(const Code& code, Workspace& workspace) const {
    if (code.signs() == read_signs_) {
      std::ranges::copy(read_preferences_, workspace.preferences.begin());
      return;
    }
    sum_rows(code, 0, n_rows_, workspace.preferences);
  }
  /// Computes the preferences, and keeps them for calls of `read` until the next `learn`.
  void read_and_keep(const Code& code, Workspace& workspace) {
    read(code, workspace);
    if (code.signs() == read_signs_) return;
    read_signs_ = code.signs();
    read_preferences_ = workspace.preferences;
  }
  /// Computes the probabilities of the allowed actions in the state that was read last.
  void allow(ActionMask mask, Workspace& workspace) const {
    std::size_t first = 0;
    for (const std::size_t n : n_actions_) {
      detail::softmax(std::span(workspace.preferences).subspan(first, n), take_part(mask, n),
                      n_unit_bits_, std::span(workspace.terms).subspan(first, n));
      first += n;
    }
  }

  /// The terms of a dimension's actions, which `allow` has computed.
  std::span<const detail::SoftmaxTerm> terms(const Workspace& workspace, std::size_t d) const {
    std::size_t first = 0;
    for (std::size_t i = 0; i < d; ++i) first += n_actions_[i];
    return std::span(workspace.terms).subspan(first, n_actions_[d]);
  }

  /// Draws an action of each dimension by its probability.
  void draw(const Workspace& workspace, core::Random& random, std::span<std::size_t> action) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      action[d] = detail::draw_term(terms(workspace, d), random);
    }
  }
  /// Finds a most probable action of each dimension; `ties` decides between several.
  void best(const Workspace& workspace, core::Random& ties, std::span<std::size_t> action) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      action[d] = detail::best_term(terms(workspace, d), ties);
    }
  }

  /// Returns the offset from an action's index to the mean index of it and its neighbours, weighted
  /// by their probabilities: a multiple of 2^-16, within [-0.5, 0.5] for a most probable action.
  double mean_offset(const Workspace& workspace, std::size_t d, std::size_t action) const {
    const auto dimension = terms(workspace, d);
    const std::int64_t below = action > 0 ? dimension[action - 1].weight : 0;
    const std::int64_t above = action + 1 < dimension.size() ? dimension[action + 1].weight : 0;
    const std::int64_t sum = below + dimension[action].weight + above;
    return static_cast<double>((above - below) * (1 << 16) / sum) / (1 << 16);
  }

  /// Decays the trace, and adds the gradient of log pi(action | s). Then moves the weights by rate
  /// / n times the error along the trace, and by rate / n times the entropy's weight along the
  /// gradient of the entropy, where n is the number of columns of the code that are not 0. Requires
  /// that `read` has read the code, and `allow` was called.
  ///
  /// The preferences of a `next` code, if there is one, are computed while the changed rows are in
  /// the processor's cache, and kept for `read`.
  void learn(const Code& code, const Workspace& workspace, std::span<const std::size_t> action,
             Trace& trace, const Step& step, const Code* next = nullptr) {
    read_signs_.clear();
    const std::int64_t n = std::max<std::int64_t>(1, code.n_active());
    const std::int64_t rate = (std::int64_t{step.rate} << 12) / n;  // in units of 2^-28
    // Error times rate, in units of 2^-12 and 2^-28, converted to the unit of weights.
    const std::int64_t along_trace =
        approximators::scaled(step.error, rate, kErrorBits + 28 - n_unit_bits_);
    // RowStep::step has at most 13 bits. A larger step is divided by 2^n_bits, and the products
    // with traces, which have 12 fractional bits, are shifted by n_bits less.
    int n_bits = 0;
    while (std::abs(along_trace) >> n_bits >= (1 << 13) - 1) ++n_bits;
    approximators::RowStep row_step{
        .decay = step.decay,
        .gain = 0,
        .replace = 0,
        .step = static_cast<std::int32_t>(approximators::scaled(along_trace, 1, n_bits)),
        .shift = std::max(12 - n_bits, 1),
        .correction = 0};
    std::size_t row = 0;
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      const auto of_dimension = terms(workspace, d);
      for (std::size_t a = 0; a < of_dimension.size(); ++a, ++row) {
        const detail::SoftmaxTerm& term = of_dimension[a];
        // The gradient of log pi is (1 if it is the action) - p, in units of 2^-12 as traces are.
        row_step.gain =
            (a == action[d] ? approximators::kTraceOne : 0) -
            static_cast<std::int32_t>(approximators::scaled(term.probability, 1, 16 - 12));
        // Slope, weight and rate are in units of 2^-16, 2^-16 and 2^-28, 2^-60 in all.
        row_step.correction = static_cast<std::int32_t>(approximators::scaled(
            std::int64_t{term.entropy_slope} * step.entropy, rate, 60 - n_unit_bits_));
        std::int32_t* const weights = &weights_[row * n_columns_];
        const approximators::RowUse use = approximators::learn_row(
            weights, trace.row(row), code.signs().data(), n_columns_, row_step);
        trace.set_live(row, use.traces != 0);
        if (use.weights >= approximators::kLargestWeight - 1) clip(weights);
        const std::size_t end = row + 1;
        if (next != nullptr && (end % kRowsAtOnce == 0 || end == n_rows_)) {
          sum_rows(*next, row - row % kRowsAtOnce, end, read_preferences_);
        }
      }
    }
    if (next != nullptr) read_signs_ = next->signs();
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.fixed("weights", {self.n_rows_, self.n_columns_}, self.weights_);
    if constexpr (Archive::kReads) {
      const auto fits = [](std::int32_t w) {
        return w > -approximators::kLargestWeight && w < approximators::kLargestWeight;
      };
      archive.expect(std::ranges::all_of(self.weights_, fits), "weights", "below 2^23 in size");
      self.read_signs_.clear();
    }
  }

 private:
  /// Rows whose preferences `learn` computes together: `row_sums` reads a code once for four rows.
  static constexpr std::size_t kRowsAtOnce = 4;

  /// Computes the preferences of the rows from `row` to `end`, 64 at a time.
  void sum_rows(const Code& code, std::size_t row, std::size_t end,
                std::vector<std::int64_t>& preferences) const {
    constexpr std::size_t kAtOnce = 64;
    const std::int32_t* rows[kAtOnce];
    while (row < end) {
      const std::size_t first = row;
      for (; row < end && row - first < kAtOnce; ++row) {
        rows[row - first] = &weights_[row * n_columns_];
      }
      approximators::row_sums(rows, row - first, code.signs().data(), n_columns_,
                              &preferences[first]);
    }
  }

  /// Clips the weights of a row to 23 bits.
  void clip(std::int32_t* weights) const noexcept {
    constexpr std::int32_t kMost = approximators::kLargestWeight - 1;
    for (std::size_t j = 0; j < n_columns_; ++j) weights[j] = std::clamp(weights[j], -kMost, kMost);
  }

  std::vector<std::size_t> n_actions_;
  std::size_t n_rows_ = 0;
  std::size_t n_columns_;
  int n_unit_bits_;
  std::vector<std::int32_t> weights_;
  std::vector<std::int8_t> read_signs_;  ///< the code whose preferences are kept; empty: none
  std::vector<std::int64_t> read_preferences_;
};

}  // namespace sdnn::agents
