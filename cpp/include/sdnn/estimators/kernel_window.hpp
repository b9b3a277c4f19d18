/// Kernel ridge regression on the last samples of a stream.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/estimators/detail/stream_limits.hpp"

namespace sdnn::estimators {

/// Kernel ridge regression on a sliding window of samples; the inverse of the kernel matrix is
/// updated with each sample.
///
/// The kernel of two samples is exp(-d / (length_scale * sqrt(n_inputs))), where d is the sum over
/// the inputs of |difference|, in widths of the input's first range. A missing input, NaN, counts
/// as the middle of the range. Targets may be limited to a multiple of their mean size.
///
/// All sums have a fixed order, so that results have the same bits on every machine.
///
/// Source: Van Vaerenbergh, S., Via, J., Santamaria, I. (2006). A sliding-window kernel RLS
/// algorithm and its application to nonlinear channel identification. ICASSP 2006.
/// Cost: a prediction needs capacity^2 multiplications and additions, learning three times as many.
class KernelWindow {
 public:
  static constexpr double kUnlimited = std::numeric_limits<double>::infinity();

  /// Takes the first ranges of the inputs, shape (n_inputs,) each. `ridge` is added to the diagonal
  /// of the kernel matrix; `target_limit` is the largest target in mean sizes of targets. Throws
  /// std::invalid_argument naming the impossible argument.
  KernelWindow(std::span<const double> low, std::span<const double> high, std::size_t n_outputs,
               std::size_t capacity, double length_scale, double ridge,
               double target_limit = kUnlimited)
      : capacity_(capacity),
        length_scale_(length_scale),
        ridge_(ridge),
        target_limit_(target_limit) {
    core::require_in_range("capacity", capacity, 2, kMostSamples);
    core::require_in_range("length_scale", length_scale, 1e-3, 1e3);
    core::require_in_range("ridge", ridge, 1e-3, 1e3);
    core::require(target_limit >= 1.0, "target_limit", "at least 1", target_limit);
    inverse_.resize(capacity * capacity);
    add_outputs(n_outputs);
    add_inputs(low, high);
  }

  std::size_t n_inputs() const noexcept { return middle_.size(); }
  std::size_t n_outputs() const noexcept { return mean_sizes_.size(); }
  std::size_t n_samples() const noexcept { return n_samples_; }

  /// Adds inputs after the others, which all samples so far had missed. Throws
  /// std::invalid_argument naming the impossible argument.
  void add_inputs(std::span<const double> low, std::span<const double> high) {
    detail::require_ranges(low, high, n_inputs());
    const std::size_t n_before = n_inputs(), n = n_before + low.size();
    std::vector<double> inputs(capacity_ * n);
    for (std::size_t slot = 0; slot < n_samples_; ++slot) {
      std::copy_n(inputs_.data() + slot * n_before, n_before, inputs.data() + slot * n);
    }
    inputs_ = std::move(inputs);
    for (std::size_t i = 0; i < low.size(); ++i) {
      middle_.push_back(low[i] / 2.0 + high[i] / 2.0);
      half_width_.push_back(high[i] / 2.0 - low[i] / 2.0);
    }
    rebuild();
  }

  /// Adds outputs after the others, whose targets so far were 0. Throws std::invalid_argument
  /// naming the impossible argument.
  void add_outputs(std::size_t n) {
    const std::size_t n_before = n_outputs(), size = detail::n_outputs_with(n, n_before);
    std::vector<double> targets(capacity_ * size);
    for (std::size_t slot = 0; slot < n_samples_; ++slot) {
      std::copy_n(targets_.data() + slot * n_before, n_before, targets.data() + slot * size);
    }
    targets_ = std::move(targets);
    mean_sizes_.resize(size);
  }

  /// Predicts the outputs for a sample; 0 before the first one. Shapes: inputs (n_inputs,), outputs
  /// (n_outputs,). Throws std::invalid_argument for another size. Thread safety: calls may run at
  /// the same time.
  void predict(std::span<const double> inputs, std::span<double> outputs) const {
    core::require_size("inputs", inputs.size(), n_inputs());
    core::require_size("outputs", outputs.size(), n_outputs());
    std::vector<double> scaled(n_inputs()), kernel(n_samples_), coefficients(n_samples_);
    scale(inputs, scaled);
    kernels(scaled, kernel);
    solve(kernel, coefficients);
    std::ranges::fill(outputs, 0.0);
    for (std::size_t slot = 0; slot < n_samples_; ++slot) {
      for (std::size_t o = 0; o < n_outputs(); ++o) {
        outputs[o] += coefficients[slot] * targets_[slot * n_outputs() + o];
      }
    }
    for (double& output : outputs) output = std::isnan(output) ? 0.0 : detail::finite(output);
  }

  /// Learns a sample in the place of the oldest. Shapes: inputs (n_inputs,), targets (n_outputs,),
  /// finite. Throws std::invalid_argument for another size, and targets that are not finite.
  void learn(std::span<const double> inputs, std::span<const double> targets) {
    core::require_size("inputs", inputs.size(), n_inputs());
    core::require_size("targets", targets.size(), n_outputs());
    for (const double target : targets) core::require_finite("targets", target);
    std::vector<double> scaled(n_inputs());
    scale(inputs, scaled);
    n_learned_ = std::min(n_learned_ + 1.0, detail::kSizeMemory);
    const std::size_t slot = next_;
    const bool replaces = n_samples_ == capacity_;
    const bool is_exact = add(slot, scaled, replaces);
    for (std::size_t o = 0; o < n_outputs(); ++o) {
      targets_[slot * n_outputs() + o] =
          detail::limited(targets[o], target_limit_, n_learned_, mean_sizes_[o]);
    }
    next_ = (slot + 1) % capacity_;
    n_replaced_ = replaces ? n_replaced_ + 1 : 0;
    if (!is_exact || n_replaced_ >= kMostReplaced) rebuild();
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    const std::size_t n = self.n_inputs(), n_outputs = self.n_outputs(), size = self.capacity_;
    std::uint64_t n_samples = self.n_samples_, next = self.next_, n_replaced = self.n_replaced_;
    archive.number("n_samples", n_samples);
    archive.number("next", next);
    archive.number("n_replaced", n_replaced);
    archive.number("n_learned", self.n_learned_);
    archive.finite("middle", {n}, self.middle_);
    archive.finite("half_width", {n}, self.half_width_);
    archive.finite("inputs", {size, n}, self.inputs_);
    archive.finite("targets", {size, n_outputs}, self.targets_);
    archive.finite("inverse", {size, size}, self.inverse_);
    archive.finite("mean_sizes", {n_outputs}, self.mean_sizes_);
    if constexpr (Archive::kReads) {
      archive.expect(n_samples <= size, "n_samples", "at most capacity");
      archive.expect(next < size && (n_samples == size || next == n_samples), "next",
                     "the slot after the samples");
      archive.expect(self.n_learned_ >= 0.0 && self.n_learned_ <= detail::kSizeMemory, "n_learned",
                     "in [0, 100]");
      self.n_samples_ = static_cast<std::size_t>(n_samples);
      self.next_ = static_cast<std::size_t>(next);
      self.n_replaced_ = static_cast<std::size_t>(n_replaced);
    }
  }

 private:
  static constexpr std::size_t kMostSamples = 4096;
  /// The number of replaced samples after which the inverse is computed anew, against rounding
  /// errors; chosen.
  static constexpr std::size_t kMostReplaced = 2000;
  static constexpr double kFarthest = 1e6;  ///< limit of scaled inputs, in widths from the middle

  /// Writes inputs as distances from the middles of their ranges, in widths; see detail::scaled.
  void scale(std::span<const double> inputs, std::span<double> scaled) const noexcept {
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const double distance = detail::scaled(inputs[i], middle_[i], half_width_[i]);
      scaled[i] = std::clamp(distance, -kFarthest, kFarthest);
    }
  }

  /// Writes the kernel between scaled inputs and each sample.
  void kernels(std::span<const double> scaled, std::span<double> out) const noexcept {
    const std::size_t n = n_inputs();
    const double root = std::sqrt(static_cast<double>(std::max<std::size_t>(n, 1)));
    const double factor = -1.0 / (length_scale_ * root);
    for (std::size_t slot = 0; slot < out.size(); ++slot) {
      const double* const of_slot = inputs_.data() + slot * n;
      double sum = 0.0;
      for (std::size_t i = 0; i < n; ++i) sum += std::abs(of_slot[i] - scaled[i]);
      out[slot] = factor * sum;
    }
    for (double& value : out) value = core::exp(value);
  }

  /// Writes the product of the inverse matrix and a vector of kernels, the coefficients of samples.
  void solve(std::span<const double> kernel, std::span<double> out) const noexcept {
    std::ranges::fill(out, 0.0);
    for (std::size_t row = 0; row < kernel.size(); ++row) {
      const double* const inverses = inverse_.data() + row * capacity_;
      const double value = kernel[row];
      for (std::size_t i = 0; i < out.size(); ++i) out[i] += inverses[i] * value;
    }
  }

  /// Puts inputs into a slot, that of the oldest sample (`replaces`) or the first empty one, and
  /// updates the inverse. Returns false if rounding errors made the inverse useless.
  bool add(std::size_t slot, std::span<const double> scaled, bool replaces) {
    std::vector<double> kernel(n_samples_), gains(n_samples_), removed(n_samples_);
    kernels(scaled, kernel);
    solve(kernel, gains);
    double factor_removed = 0.0;
    // The inverse A without the sample in `slot` is A - r r^T / r[slot], where r is row `slot` of
    // A. Its row and column `slot` become 0, and so must the kernel and gains.
    if (replaces) {
      const double* const inverses = inverse_.data() + slot * capacity_;
      std::copy_n(inverses, n_samples_, removed.begin());
      factor_removed = 1.0 / removed[slot];
      const double share = gains[slot] * factor_removed;
      for (std::size_t i = 0; i < n_samples_; ++i) gains[i] -= removed[i] * share;
      gains[slot] = 0.0;
      kernel[slot] = 0.0;
    }
    // The new sample adds a row and a column, by the formula for the inverse of a block matrix.
    // `variance` is the kernel of the sample with itself, 1, plus the ridge, minus the part that
    // the other samples explain; without rounding errors it is in [ridge, 1 + ridge].
    double variance = 1.0 + ridge_;
    for (std::size_t i = 0; i < n_samples_; ++i) variance -= kernel[i] * gains[i];
    std::ranges::copy(scaled, inputs_.begin() + static_cast<std::ptrdiff_t>(slot * n_inputs()));
    const double factor = 1.0 / variance;
    for (std::size_t row = 0; row < n_samples_; ++row) {
      double* const inverses = inverse_.data() + row * capacity_;
      const double gain = gains[row], removed_entry = removed[row];
      for (std::size_t i = 0; i < n_samples_; ++i) {  // the order of factors keeps it symmetric
        inverses[i] += gain * gains[i] * factor - removed_entry * removed[i] * factor_removed;
      }
    }
    if (!replaces) ++n_samples_;
    for (std::size_t i = 0; i < gains.size(); ++i) {
      inverse_[slot * capacity_ + i] = inverse_[i * capacity_ + slot] = -gains[i] * factor;
    }
    inverse_[slot * capacity_ + slot] = factor;
    return variance > ridge_ / 2.0 && variance <= 1.0 + ridge_ && factor_removed >= 0.0;
  }

  /// Computes the inverse matrix anew from all samples.
  void rebuild() {
    const std::size_t n_samples = std::exchange(n_samples_, 0);
    n_replaced_ = 0;
    std::vector<double> scaled(n_inputs());
    for (std::size_t slot = 0; slot < n_samples; ++slot) {
      std::copy_n(inputs_.data() + slot * n_inputs(), n_inputs(), scaled.begin());
      add(slot, scaled, false);
    }
  }

  std::size_t capacity_;
  double length_scale_;
  double ridge_;
  double target_limit_;
  std::size_t n_samples_ = 0;
  std::size_t next_ = 0;                     ///< slot of the next sample
  std::size_t n_replaced_ = 0;               ///< samples since the inverse was exact
  double n_learned_ = 0.0;                   ///< at most detail::kSizeMemory
  std::vector<double> middle_, half_width_;  ///< of the ranges of inputs
  std::vector<double> inputs_;               ///< scaled, (capacity, n_inputs)
  std::vector<double> targets_;              ///< (capacity, n_outputs)
  std::vector<double> inverse_;              ///< (capacity, capacity)
  std::vector<double> mean_sizes_;           ///< of targets
};

}  // namespace sdnn::estimators
