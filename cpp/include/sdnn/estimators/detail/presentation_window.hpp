/// A window of samples that are presented in sequence, with their potentials.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/detail/signed_sums.hpp"
#include "sdnn/estimators/detail/transposition.hpp"

namespace sdnn::estimators {

/// The numbers of corrections in a part of a training.
struct TrainingCount {
  std::size_t n_samples = 0;  ///< presentations that corrected something
  std::size_t n_units = 0;    ///< corrections of single units

  TrainingCount& operator+=(const TrainingCount& more) noexcept {
    n_samples += more.n_samples;
    n_units += more.n_units;
    return *this;
  }
};

/// The current potentials of all units for up to `capacity` samples. A correction by a sample
/// changes the potentials of later samples by the inner products of the codes.
///
/// Samples are presented in groups of kAtOnce. A correction is applied to the later samples of its
/// group one by one, and to all samples after the group at once, by a row of inner products.
class PresentationWindow {
 public:
  /// The number of samples in a group; rows are padded to a multiple of it.
  static constexpr std::size_t kAtOnce = 16;

  /// Makes a window of up to `capacity` samples; `n_padded_units` is a multiple of 16.
  PresentationWindow(std::size_t n_padded_units, std::size_t capacity)
      : n_padded_units_(n_padded_units),
        stride_(core::round_up(capacity, kAtOnce) + kAtOnce),
        by_unit_(n_padded_units * stride_),
        by_sample_(kAtOnce * n_padded_units) {}

  static std::uint64_t bytes(std::uint64_t n_padded_units, std::size_t capacity) noexcept {
    return sizeof(std::int32_t) * n_padded_units *
           (core::round_up(capacity, kAtOnce) + 2 * kAtOnce);
  }

  /// The potentials of a unit for the samples of the window; fill them before presenting the
  /// samples.
  std::int32_t* row(std::size_t unit) noexcept { return by_unit_.data() + unit * stride_; }
  std::size_t stride() const noexcept { return stride_; }

  /// Presents `samples` in their order, and calls note(b, correction) for each correction by the
  /// b-th sample.
  ///
  /// `products[b * stride + e]` is 1 plus the inner product of the b-th and the e-th sample, b <=
  /// e, with room for a multiple of kAtOnce products per row.
  template <class Product, class Rule, class Note>
  TrainingCount present(std::span<const std::int32_t> samples, const Product* products,
                        std::size_t stride, Rule& rule, const Note& note) {
    TrainingCount count;
    recent_.clear();
    for (std::size_t first = 0; first < samples.size(); first += kAtOnce) {
      const std::size_t left = core::round_up(samples.size() - first, kAtOnce);
      for (const auto& [b, correction] : recent_) {
        add_row(row(correction.unit) + first, products + b * stride + first, correction.direction,
                left);
      }
      recent_.clear();
      transpose(by_unit_.data() + first, stride_, n_padded_units_, kAtOnce, by_sample_.data(),
                n_padded_units_);
      for (std::size_t e = first; e < std::min(first + kAtOnce, samples.size()); ++e) {
        std::int32_t* const values = by_sample_.data() + (e - first) * n_padded_units_;
        for (const auto& [b, correction] : recent_) {
          values[correction.unit] += correction.direction * products[b * stride + e];
        }
        rule(static_cast<std::size_t>(samples[e]), values, corrections_);
        for (const Correction& correction : corrections_) {
          recent_.push_back({e, correction});
          note(e, correction);
        }
        count.n_samples += corrections_.empty() ? 0 : 1;
        count.n_units += corrections_.size();
      }
    }
    return count;
  }

 private:
  struct Recent {
    std::size_t index;  // position in the window of the sample that was learned
    Correction correction;
  };

  std::size_t n_padded_units_;
  std::size_t stride_;  // no power of two, with which rows would compete for cache sets
  core::AlignedBuffer<std::int32_t> by_unit_;    // (n_padded_units, stride)
  core::AlignedBuffer<std::int32_t> by_sample_;  // (kAtOnce, n_padded_units)
  std::vector<Correction> corrections_;
  std::vector<Recent> recent_;  // corrections in the current group, not yet applied after it
};

}  // namespace sdnn::estimators
