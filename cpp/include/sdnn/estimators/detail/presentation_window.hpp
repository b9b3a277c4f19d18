/// Samples presented one after the other, with the potentials that each of them will meet.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"
#include "sdnn/estimators/correction_rules.hpp"
#include "sdnn/estimators/detail/transposition.hpp"

namespace sdnn::estimators {

/// What a stretch of training changed.
struct TrainingCount {
  std::size_t n_samples = 0;  ///< presentations that corrected something
  std::size_t n_units = 0;    ///< corrections of single units

  TrainingCount& operator+=(const TrainingCount& more) noexcept {
    n_samples += more.n_samples;
    n_units += more.n_units;
    return *this;
  }
};

namespace detail {

template <class Product>
SDNN_INLINE void add_row_body(std::int32_t* to, const Product* row, std::int32_t direction,
                              std::size_t size) noexcept {
  if (direction > 0) {
    for (std::size_t i = 0; i < size; ++i) to[i] += row[i];
  } else {
    for (std::size_t i = 0; i < size; ++i) to[i] -= row[i];
  }
}

}  // namespace detail

/// to[i] += direction (+1 or -1) * row[i].
SDNN_KERNEL(void, add_row,
            (std::int32_t* to, const std::int16_t* row, std::int32_t direction, std::size_t size),
            (to, row, direction, size))
SDNN_KERNEL(void, add_row,
            (std::int32_t* to, const std::int32_t* row, std::int32_t direction, std::size_t size),
            (to, row, direction, size))

/// The potentials of all units for up to `capacity` samples, unit by unit, as of now; presenting
/// the samples moves those of the later ones by the inner products of the codes.
///
/// A correction reaches the next few samples one by one, the others a row at a time.
class PresentationWindow {
 public:
  /// Places that are read together: what holds places is filled up to a multiple of it.
  static constexpr std::size_t kAtOnce = 16;

  /// `n_padded_units` is a multiple of 16.
  PresentationWindow(std::size_t n_padded_units, std::size_t capacity)
      : n_padded_units_(n_padded_units),
        stride_(core::round_up(capacity, kAtOnce) + kAtOnce),
        by_unit_(n_padded_units * stride_),
        by_sample_(kAtOnce * n_padded_units) {}

  static std::size_t bytes(std::size_t n_padded_units, std::size_t capacity) noexcept {
    return sizeof(std::int32_t) * n_padded_units *
           (core::round_up(capacity, kAtOnce) + 2 * kAtOnce);
  }

  /// Potentials of a unit for the samples of the window: to be filled before they are presented.
  std::int32_t* row(std::size_t unit) noexcept { return by_unit_.data() + unit * stride_; }
  std::size_t stride() const noexcept { return stride_; }

  /// Presents `samples` in their order, and calls note(place, correction) for what each corrects.
  ///
  /// `products[b * stride + e]` is 1 plus the inner product of the samples at places b and e, with
  /// room for a multiple of kAtOnce places.
  template <class Product, class Rule, class Note>
  TrainingCount present(std::span<const std::int32_t> samples, const Product* products,
                        std::size_t stride, Rule& rule, const Note& note) {
    TrainingCount count;
    made_.clear();
    for (std::size_t first = 0; first < samples.size(); first += kAtOnce) {
      const std::size_t left = core::round_up(samples.size() - first, kAtOnce);
      for (const Made& made : made_) {
        add_row(row(made.what.unit) + first, products + made.place * stride + first,
                made.what.direction, left);
      }
      made_.clear();
      transpose(by_unit_.data() + first, stride_, n_padded_units_, kAtOnce, by_sample_.data(),
                n_padded_units_);
      for (std::size_t b = first; b < std::min(first + kAtOnce, samples.size()); ++b) {
        std::int32_t* const values = by_sample_.data() + (b - first) * n_padded_units_;
        for (const Made& made : made_) {
          values[made.what.unit] += made.what.direction * products[made.place * stride + b];
        }
        rule(static_cast<std::size_t>(samples[b]), values, corrections_);
        for (const Correction& correction : corrections_) {
          made_.push_back({b, correction});
          note(b, correction);
        }
        count.n_samples += corrections_.empty() ? 0 : 1;
        count.n_units += corrections_.size();
      }
    }
    return count;
  }

 private:
  struct Made {
    std::size_t place;
    Correction what;
  };

  std::size_t n_padded_units_;
  std::size_t
      stride_;  // a little more than the capacity: at a power of two, rows share cache lines
  core::AlignedBuffer<std::int32_t> by_unit_;    // (n_padded_units, stride)
  core::AlignedBuffer<std::int32_t> by_sample_;  // (kAtOnce, n_padded_units)
  std::vector<Correction> corrections_;
  std::vector<Made> made_;  // corrections that have reached the next few samples only
};

}  // namespace sdnn::estimators
