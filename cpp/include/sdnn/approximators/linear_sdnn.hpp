/// A linear readout of the SDNN code: Q(s, a) by integer weights, with eligibility traces.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/approximators/detail/state_wiring.hpp"
#include "sdnn/approximators/detail/thermometers.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/identity.hpp"

namespace sdnn::approximators {

/// Q(s, a) is the sum, over the dimensions d of the action and the rows in the window of a_d, of
/// the inner product of the row's weights and the code x_SD(s). The window of an action has
/// config.action_window neighbouring rows, so that neighbouring actions share rows.
///
/// The maximum over all actions is the sum of the dimensions' maxima, which a single pass finds.
///
/// All numbers are integers. A value counts *units* of 2^exponent; weights have the same unit. The
/// exponent follows the rewards: the first one that is not 0 has 31 bits, and when a weight would
/// need more than 23 bits, or a value more than 33, all are halved and the exponent grows by one.
/// The agent may make units smaller again (refine_unit). Thus no range of values needs to be
/// chosen, and sums are exact in any order.
///
/// The code is the paired code of StateCode, whose inner products are half of those of x_SD; a
/// quarter of its columns are not neutral.
///
/// Source: the code of section 3.1, layers 1 to 3, with a linear readout in the place of layers 4
/// and 5; not in the paper.
class LinearSDNN {
 public:
  using Code = LinearCode;
  using Workspace = LinearWorkspace;
  using Trace = LinearTrace;

  /// The rates of a step of learning; see QLambdaConfig.
  struct Step {
    std::int64_t error = 0;       ///< the factor of the trace, in units
    std::int64_t correction = 0;  ///< the factor of the code, in units
    std::int32_t rate = 0;        ///< alpha, in units of 2^-16
    std::int32_t decay = 0;       ///< gamma lambda, in units of 1 / kDecayOne
    bool is_dutch = true;         ///< else the trace is replaced
  };

  static constexpr std::int32_t kRateOne = 1 << 16;

  /// Makes code books by anchor interpolation, or of symbols. `n_actions` has the number of actions
  /// of each dimension. If `n_first` is not 0, only the first `n_first` inputs are those of an
  /// earlier readout, which continue_from can copy. Throws std::invalid_argument naming the
  /// impossible field; std::length_error naming bytes, before a large allocation; std::bad_alloc.
  LinearSDNN(const LinearSDNNConfig& config, std::span<const std::size_t> n_actions,
             std::uint64_t seed, std::size_t n_first = 0)
      : LinearSDNN(config, n_actions, code_books_of(with_pattern_units(config), seed), seed,
                   n_first) {}

  /// Takes code books of any coding, a table per input, and adds the columns of `thermometers`.
  /// Throws std::invalid_argument naming the impossible field, and std::length_error beyond
  /// max_table_bytes.
  LinearSDNN(const LinearSDNNConfig& config, std::span<const std::size_t> n_actions,
             std::vector<coding::PatternTable> tables, std::uint64_t seed, std::size_t n_first = 0,
             Thermometers thermometers = {})
      : config_(with_pattern_units(config)),
        code_(wiring_of(config_, std::move(tables), seed, n_first)),
        thermometers_(std::move(thermometers)),
        n_slots_(64 * code_->n_words() + thermometers_.n_columns()) {
    core::require(!n_actions.empty(), "n_actions", "of one dimension at least", 0);
    for (const std::size_t n : n_actions) {
      core::require_in_range("n_actions", n, std::size_t{1}, std::size_t{1} << 16);
    }
    double n_bins = 0.0;
    for (std::size_t i = 0; i < n_inputs(); ++i) {
      n_bins += static_cast<double>(code_->table(i).n_bins());
    }
    require_room(config_, n_bins, n_linear_weights(config_, n_actions));
    std::size_t row = 0;
    for (const std::size_t n : n_actions) {
      dimensions_.push_back({n, row});
      row += n + window() - 1;
    }
    n_rows_ = row;
    weights_.resize(n_rows_ * n_slots());
    versions_.resize(n_rows_, version_);
    if (config_.averaging_interval > 0) averaged_.resize(weights_.size());
  }

  const LinearSDNNConfig& config() const noexcept { return config_; }
  const coding::StateCode& state_code() const noexcept { return *code_; }
  /// A number that no other model of the process has.
  std::uint64_t identity() const noexcept { return identity_.number(); }
  std::size_t n_inputs() const noexcept { return code_->n_inputs(); }
  std::size_t n_dimensions() const noexcept { return dimensions_.size(); }
  std::size_t n_actions(std::size_t d = 0) const noexcept { return dimensions_[d].n_actions; }
  /// The number of rows of weights; a dimension has n_actions + window - 1 of them.
  std::size_t n_rows() const noexcept { return n_rows_; }
  /// The number of columns of a row, including those that are always 0.
  std::size_t n_slots() const noexcept { return n_slots_; }
  /// Shape: (n_rows, n_slots).
  std::span<const std::int32_t> weights() const noexcept { return weights_; }
  /// The exponent of the unit of values, 2^exponent; none before the first reward that is not 0.
  std::optional<std::int32_t> exponent() const noexcept { return exponent_; }

  /// Makes the memory of one reader, so that reading allocates nothing.
  Workspace workspace() const {
    Workspace workspace;
    workspace.code_.signs_.resize(n_slots());
    workspace.words_.resize(2 * code_->n_words());
    workspace.new_bins_.resize(n_inputs());
    workspace.row_sums_.resize(n_rows_);
    workspace.versions_.resize(n_rows_);
    workspace.sums_.resize(n_rows_);
    return workspace;
  }
  Trace trace() const { return {n_rows_, n_slots()}; }

  /// Reads a state. Shape: state (l,) in [0, 1]. Throws std::invalid_argument for other states.
  void read(std::span<const double> state, Workspace& workspace) const {
    workspace.bins_.clear();
    read_next(state, workspace);
  }
  /// Reads a state into a workspace that was last used with this model. If the state has the same
  /// bins as the state before, the sums of rows that have not changed since are kept.
  void read_next(std::span<const double> state, Workspace& workspace) const {
    code_->bins_of(state, workspace.new_bins_);
    if (workspace.bins_ == workspace.new_bins_) return;
    workspace.bins_ = workspace.new_bins_;
    std::ranges::fill(workspace.versions_, 0);
    std::uint64_t* const active = workspace.words_.data();
    std::uint64_t* const positive = active + code_->n_words();
    code_->encode(workspace.bins_, active, positive);
    std::size_t n_active = coding::n_active({active, positive}, code_->n_words());
    Code& code = workspace.code_;
    spread_signs(active, positive, code_->n_words(), code.signs_.data());
    n_active += thermometers_.write(workspace.bins_, code.signs_.data() + 64 * code_->n_words());
    code.n_active_ = static_cast<std::int32_t>(n_active);
  }

  /// The dimension's part of Q(s, a) of the state that was read, for each of its actions, in units;
  /// `averaged` selects the average of the weights, if there is one. Valid until the workspace is
  /// used again.
  std::span<const std::int64_t> sums(Workspace& workspace, std::size_t d,
                                     bool averaged = false) const {
    const Dimension& dimension = dimensions_[d];
    const std::size_t end = dimension.first_row + dimension.n_actions + window() - 1;
    sum_rows(dimension.first_row, end, averaged && n_snapshots_ > 0, workspace);
    std::int64_t sum = 0;  // of the rows in a window that slides from action to action
    for (std::size_t row = dimension.first_row; row < end; ++row) {
      sum += workspace.row_sums_[row];
      const std::size_t n_summed = row - dimension.first_row + 1;
      if (n_summed < window()) continue;
      workspace.sums_[n_summed - window()] = sum;
      sum -= workspace.row_sums_[row + 1 - window()];
    }
    return {workspace.sums_.data(), dimension.n_actions};
  }

  /// Q_d(state, a) as numbers. Shapes: state (l,), out (n_actions(d),).
  void values(std::span<const double> state, Workspace& workspace, std::span<double> out,
              std::size_t d = 0, bool averaged = false) const {
    assert(out.size() == n_actions(d));
    read(state, workspace);
    const auto units = sums(workspace, d, averaged);
    for (std::size_t a = 0; a < out.size(); ++a) out[a] = value_of(units[a]);
  }

  /// Q(s, a) of the state that was read, in units. Shape: action (n_dimensions,).
  std::int64_t sum(Workspace& workspace, std::span<const std::size_t> action) const noexcept {
    std::int64_t total = 0;
    for_window(action, [&](std::size_t row) {
      sum_rows(row, row + 1, false, workspace);
      total += workspace.row_sums_[row];
    });
    return total;
  }
  /// Computes what `sum` does from the trace instead of the weights, in units of 1 / kTraceOne.
  std::int64_t sum_of_trace(const Code& code, std::span<const std::size_t> action,
                            const Trace& trace) const noexcept {
    std::int64_t total = 0;
    for_window(action, [&](std::size_t row) {
      if (!trace.live_[row]) return;
      total += sum_of_row(trace.values_, row, code);
    });
    return total;
  }

  /// Adapts the unit to a number, such as a reward, that is to be expressed in it. The first number
  /// that is not 0 decides the size of the unit; larger numbers may double it. Returns the number
  /// of doublings. Requires a finite number of magnitude 1e300 at most.
  int fit_unit(double number) {
    if (number == 0.0) return 0;
    // The first number gets 31 bits: its highest bit has the exponent ilogb.
    if (!exponent_) exponent_ = std::max(std::ilogb(number) - 30, kLeastExponent);
    const std::int32_t before = *exponent_;
    while (std::abs(std::ldexp(number, -*exponent_)) >= kLargestReward) double_unit();
    return *exponent_ - before;
  }
  /// Returns a number in units, rounded to the nearest integer, halves up.
  std::int64_t units_of(double number) const noexcept {
    if (!exponent_) return 0;
    return static_cast<std::int64_t>(std::floor(std::ldexp(number, -*exponent_) + 0.5));
  }
  /// Returns the number that a value in units stands for, clipped to the finite doubles.
  double value_of(std::int64_t units) const noexcept {
    constexpr double kMost = std::numeric_limits<double>::max();
    return std::clamp(std::ldexp(static_cast<double>(units), exponent_.value_or(0)), -kMost, kMost);
  }

  /// Doubles the unit and halves the weights, halves rounded up. The caller must halve the values
  /// that it keeps.
  void double_unit() noexcept {
    assert(exponent_);
    ++*exponent_;
    for (std::int32_t& weight : weights_) weight = halved(weight);
    for (std::int32_t& weight : averaged_) weight = halved(weight);
    std::ranges::fill(versions_, ++version_);
  }
  /// The number of the 23 bits of a weight's magnitude that no weight uses, counted from the top.
  int spare_bits() const noexcept {
    std::uint32_t used = 0;
    for (const std::int32_t weight : weights_) used |= size_bits(weight);
    for (const std::int32_t weight : averaged_) used |= size_bits(weight);
    return kWeightBits - static_cast<int>(std::bit_width(used));
  }
  /// Makes the unit 2^n times smaller: weights are multiplied by 2^n and clipped to their range.
  /// The caller must multiply the values that it keeps. Returns n, or less if the unit would be too
  /// small for a number.
  int refine_unit(int n) noexcept {
    assert(exponent_ && n >= 0);
    n = std::min(n, *exponent_ - kLeastExponent);
    if (n == 0) return 0;
    *exponent_ -= n;
    for (std::int32_t& weight : weights_) weight = multiplied(weight, n);
    for (std::int32_t& weight : averaged_) weight = multiplied(weight, n);
    std::ranges::fill(versions_, ++version_);
    return n;
  }
  /// Returns a value in units that became 2^n times smaller, clipped to its range.
  static std::int64_t refined(std::int64_t units, int n) noexcept {
    return std::clamp(units << std::min(n, kWeightBits), 1 - kLargestValue, kLargestValue - 1);
  }
  /// Returns a number of bits, at most 33, that sums of `n_weights` weights can have.
  static int most_bits_of(std::int64_t n_weights) noexcept {
    const auto bits = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(n_weights)));
    return std::min(kWeightBits + bits - 1, 33);
  }
  /// Returns the number of weights that contribute to Q(s, a) of the code's state, at least 1.
  std::int64_t n_weights_of(const Code& code) const noexcept {
    return std::max<std::int64_t>(
        1, std::int64_t{code.n_active()} * static_cast<std::int64_t>(n_dimensions() * window()));
  }

  /// Whether a value has too many bits, so that the unit must be doubled.
  static bool is_too_large(std::int64_t units) noexcept {
    return units >= kLargestValue || units <= -kLargestValue;
  }

  /// Decays the trace, adds the code of (s, a) to it, and moves the weights by rate / n times the
  /// error along the trace, minus rate / n times the correction along the code, where n is the
  /// number of weights that contribute to Q(s, a). Returns the number of doublings of the unit.
  int learn(const Code& code, std::span<const std::size_t> action, Trace& trace, const Step& step) {
    const std::int64_t rate =  // of each weight, from units of 2^-16 to units of 2^-28
        (std::int64_t{step.rate} << 12) / n_weights_of(code);
    RowStep row_step{
        .decay = step.decay, .gain = 0, .replace = 0, .step = 0, .shift = 1, .correction = 0};
    // A dutch trace adds the code times 1 - rate / n * decay * (trace . code).
    std::int32_t gain = kTraceOne;
    if (step.is_dutch) {
      const std::int64_t before = scaled(sum_of_trace(code, action, trace), rate, 28);
      gain -= static_cast<std::int32_t>(
          std::clamp<std::int64_t>(scaled(before, step.decay, 13), -kLargestTrace, kLargestTrace));
    }
    const std::int32_t exponent = exponent_.value_or(0);
    ++version_;
    std::int64_t error = std::clamp(step.error, -kLargestError, kLargestError);
    std::int64_t drift = std::clamp(step.correction, -kLargestError, kLargestError);
    while (std::max(std::abs(scaled(error, rate, 28)), std::abs(scaled(drift, rate, 28))) >=
           kLargestWeight) {
      double_unit();
      error = halved(error);
      drift = halved(drift);
    }
    const std::int64_t along_trace = scaled(error, rate, 28);
    int n_bits = 0;
    // A step keeps 13 bits, so that its product with a trace of 17 bits fits into 32 bits.
    while (std::abs(along_trace) >> n_bits >= (1 << 13) - 1) ++n_bits;
    row_step.step = static_cast<std::int32_t>(scaled(along_trace, 1, n_bits));
    row_step.shift = 12 - n_bits;  // a trace of 1 has 12 bits of fraction
    const auto correction = static_cast<std::int32_t>(scaled(drift, rate, 28));
    std::int32_t used = 0;
    std::size_t row = 0;
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      const std::size_t first = dimensions_[d].first_row + action[d];
      const std::size_t end = dimensions_[d].first_row + n_actions(d) + window() - 1;
      for (; row < end; ++row) {
        const bool is_active = row >= first && row < first + window();
        if (!is_active && !trace.live_[row]) continue;
        row_step.gain = is_active ? gain : 0;
        row_step.replace = is_active && !step.is_dutch ? -1 : 0;
        row_step.correction = is_active ? correction : 0;
        const RowUse use = learn_row(&weights_[row * n_slots()], &trace.values_[row * n_slots()],
                                     code.signs().data(), n_slots(), row_step);
        trace.live_[row] = use.traces != 0;
        if (is_active || trace.live_[row]) versions_[row] = version_;
        used |= use.weights;
      }
    }
    shrink_weights(used);
    if (config_.averaging_interval > 0) note_step();
    return exponent_.value_or(0) - exponent;
  }

  /// Moves the weights of each row by rate / n times its error along the code, where n is as in
  /// `learn`. Returns the number of doublings of the unit. Shape: errors (n_rows,), in units.
  int move_rows(const Code& code, std::span<const std::int64_t> errors, std::int32_t rate);

  /// Copies the weights of a readout with fewer inputs, such that Q(s, a) does not depend on the
  /// added inputs. Both have equal numbers of actions and units, the same first inputs, and all
  /// pairs.
  void continue_from(const LinearSDNN& fewer) {
    assert(fewer.n_rows_ == n_rows_ && fewer.n_inputs() <= n_inputs());
    copy_to_more_inputs(*fewer.code_, fewer.weights_, *code_, weights_);
    copy_to_more_inputs(*fewer.code_, fewer.averaged_, *code_, averaged_);
    exponent_ = fewer.exponent_;
    n_steps_ = fewer.n_steps_;
    n_snapshots_ = fewer.n_snapshots_;
    std::ranges::fill(versions_, ++version_);
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.fixed("weights", {self.n_rows_, self.n_slots()}, self.weights_);
    archive.number("exponent", self.exponent_);
    if (self.config_.averaging_interval > 0) {
      archive.fixed("averaged_weights", {self.n_rows_, self.n_slots()}, self.averaged_);
      archive.number("n_steps", self.n_steps_);
      archive.number("n_snapshots", self.n_snapshots_);
    }
    if constexpr (Archive::kReads) {
      const auto fits = [](std::int32_t w) { return size_bits(w) < kLargestWeight; };
      archive.expect(std::ranges::all_of(self.weights_, fits), "weights", "below 2^23 in size");
      archive.expect(std::ranges::all_of(self.averaged_, fits), "averaged_weights",
                     "below 2^23 in size");
      archive.expect(!self.exponent_ || std::abs(*self.exponent_) <= 1100, "exponent",
                     "in [-1100, 1100]");
      archive.expect(self.n_steps_ >> 62 == 0, "n_steps", "in [0, 2^62)");
      archive.expect(self.n_snapshots_ >= 0 && self.n_snapshots_ <= kMostSnapshots, "n_snapshots",
                     "in [0, 3072]");
      std::ranges::fill(self.versions_, ++self.version_);
      self.identity_ = core::Identity();
    }
  }

 private:
  struct Dimension {
    std::size_t n_actions, first_row;
  };

  static constexpr std::int32_t kLeastExponent = -1074;  // the exponent of the smallest number
  static constexpr std::int64_t kLargestValue = std::int64_t{1} << 33;  // values have 33 bits
  static constexpr double kLargestReward = 0x1p32;  // a reward has 31 bits at first, or 32 later
  /// An error is reward + gamma Q' - Q at most: twice the largest value.
  static constexpr std::int64_t kLargestError = (std::int64_t{1} << 34) - 1;

  std::size_t window() const noexcept { return static_cast<std::size_t>(config_.action_window); }

  std::int64_t sum_of_row(const std::vector<std::int32_t>& rows, std::size_t row,
                          const Code& code) const noexcept {
    return row_sum(&rows[row * n_slots()], code.signs().data(), n_slots());
  }
  /// Updates the sums of the rows from `first` to `end`, unless they are up to date; `averaged`
  /// selects the average of the weights.
  void sum_rows(std::size_t first, std::size_t end, bool averaged,
                Workspace& workspace) const noexcept {
    const std::vector<std::int32_t>& weights = averaged ? averaged_ : weights_;
    constexpr std::size_t kMost = 64;  // rows at a time, so that the arrays have a fixed size
    const std::int32_t* rows[kMost];
    std::size_t places[kMost];
    std::int64_t sums[kMost];
    for (std::size_t row = first; row < end;) {
      std::size_t n = 0;
      for (; row < end && n < kMost; ++row) {
        if (!averaged && workspace.versions_[row] == versions_[row]) continue;
        places[n] = row;
        rows[n++] = &weights[row * n_slots()];
        workspace.versions_[row] = averaged ? 0 : versions_[row];
      }
      row_sums(rows, n, workspace.code_.signs_.data(), n_slots(), sums);
      for (std::size_t i = 0; i < n; ++i) workspace.row_sums_[places[i]] = sums[i];
    }
  }

  /// Calls call(row) for each row of weights in the windows of an action, in all dimensions.
  template <class Call>
  void for_window(std::span<const std::size_t> action, const Call& call) const {
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      for (std::size_t i = 0; i < window(); ++i) call(dimensions_[d].first_row + action[d] + i);
    }
  }

  /// Doubles the unit until all weights are in their range; `used` has the bits that they use.
  void shrink_weights(std::int32_t used) noexcept;
  /// Counts a step of learning; every averaging_interval steps moves the average to the weights by
  /// 1 / 2^k of the way, about 3 / (n + 3) after n such snapshots.
  void note_step() noexcept {
    if (++n_steps_ % config_.averaging_interval != 0) return;
    const int k = static_cast<int>(std::bit_width(std::uint64_t(n_snapshots_ / 3 + 1))) - 1;
    const std::int32_t half = k > 0 ? 1 << (k - 1) : 0;
    for (std::size_t j = 0; j < weights_.size(); ++j) {
      averaged_[j] += (weights_[j] - averaged_[j] + half) >> k;
    }
    if (n_snapshots_ < kMostSnapshots) ++n_snapshots_;
  }

  static constexpr std::int64_t kMostSnapshots = 3 << 10;  // from here on, k stays 10

  LinearSDNNConfig config_;
  std::shared_ptr<const coding::StateCode> code_;
  Thermometers thermometers_;
  std::size_t n_slots_;
  std::vector<Dimension> dimensions_;
  std::size_t n_rows_ = 0;
  std::vector<std::int32_t> weights_;
  std::vector<std::int32_t> averaged_;   ///< empty without averaging
  std::vector<std::uint64_t> versions_;  ///< versions of the rows of weights
  std::uint64_t version_ = 1;            ///< the latest version
  std::optional<std::int32_t> exponent_;
  std::int64_t n_steps_ = 0, n_snapshots_ = 0;
  core::Identity identity_;
};

}  // namespace sdnn::approximators

#include "sdnn/approximators/detail/linear_moves.hpp"
