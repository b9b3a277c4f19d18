/// The potentials of recent states, which a log of a layer's corrections keeps exact while the
/// network learns.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/identity.hpp"
#include "sdnn/core/detail/kernel.hpp"
#include "sdnn/core/detail/lanes.hpp"

namespace sdnn::approximators {

/// The last kSize corrections of a layer's weights. All corrections are numbered from 0.
///
/// Whoever keeps results computed from the layer notes the log's identity and size, and can later
/// tell which corrections they lack. When the weights are replaced as a whole, the log gets another
/// identity, and such results are void.
class CorrectionLog {
 public:
  /// Cached potentials that lack more corrections than this are computed anew, which is then
  /// faster.
  static constexpr std::size_t kSize = 512;

  /// A correction: w_i += step * x_SD(bins) and w_i0 -= step for every i in `units`.
  struct Entry {
    std::span<const coding::Bin> bins;
    std::span<const std::uint32_t> units;
    std::int32_t step;  ///< by which the weights of the units changed, times the code
  };

  /// The log of a layer that is never corrected.
  CorrectionLog() = default;
  /// Makes an empty log, for corrections of up to `max_units` units each.
  CorrectionLog(std::size_t n_inputs, std::size_t max_units)
      : n_inputs_(n_inputs),
        max_units_(max_units),
        bins_(kSize * n_inputs),
        units_(kSize * max_units),
        sizes_(kSize) {}

  /// The bytes for the units of corrections, the largest part of a log.
  static constexpr std::size_t n_bytes(std::size_t max_units) noexcept {
    return kSize * max_units * sizeof(std::uint32_t);
  }

  /// The identity of the layer at the beginning of the log.
  std::uint64_t identity() const noexcept { return identity_.number(); }
  /// The number of corrections since the beginning.
  std::uint64_t size() const noexcept { return size_; }

  /// Returns the correction with this number, which must be one of the last kSize.
  Entry operator[](std::uint64_t number) const noexcept {
    assert(number < size_ && size_ - number <= kSize);
    const std::size_t slot = number % kSize;
    return {std::span(bins_).subspan(slot * n_inputs_, n_inputs_),
            std::span(units_).subspan(slot * max_units_, sizes_[slot].n_units), sizes_[slot].step};
  }

  /// Records a correction in place of the oldest one.
  void add(const Entry& entry) noexcept {
    assert(entry.units.size() <= max_units_);
    const std::size_t slot = size_ % kSize;
    std::ranges::copy(entry.bins, bins_.begin() + static_cast<std::ptrdiff_t>(slot * n_inputs_));
    std::ranges::copy(entry.units, units_.begin() + static_cast<std::ptrdiff_t>(slot * max_units_));
    sizes_[slot] = {entry.step, entry.units.size()};
    ++size_;
  }

  /// Restarts the log after the layer's weights were replaced.
  void restart() noexcept {
    identity_ = core::Identity();
    size_ = 0;
  }

 private:
  struct Size {
    std::int32_t step = 0;
    std::size_t n_units = 0;
  };

  core::Identity identity_;
  std::uint64_t size_ = 0;
  std::size_t n_inputs_ = 0;
  std::size_t max_units_ = 0;
  std::vector<coding::Bin> bins_;     ///< [slot][input]
  std::vector<std::uint32_t> units_;  ///< [slot][up to max_units_]
  std::vector<Size> sizes_;
};

namespace detail {

inline constexpr std::size_t kCacheEntries = 64;
using Distances = std::array<std::int32_t, kCacheEntries>;

/// The body of the kernel add_up_distances (see below), compiled for each instruction set.
SDNN_INLINE void add_up_distances_body(const coding::Bin* cached, std::span<const coding::Bin> bins,
                                       Distances& distances) noexcept {
  Distances sums{};
  for (const coding::Bin bin : bins) {
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += std::abs(cached[k] - bin);
    cached += sums.size();
  }
  distances = sums;
}

}  // namespace detail

/// Writes the distances of a state from all cached states: the sums of |cached bin - bin| over the
/// inputs. Shapes: cached (l, kCacheEntries), bins (l,).
SDNN_KERNEL(void, add_up_distances,
            (const coding::Bin* cached, std::span<const coding::Bin> bins,
             detail::Distances& distances),
            (cached, bins, distances))

/// A cache of the inner potentials of the states that were evaluated last with a workspace.
///
/// Most states are equal or near to earlier ones. Two exact identities use this:
///
/// - A correction of w_i by step * x_SD(s), and of w_i0 by -step, changes h_i(s') by step *
///   (<x_SD(s), x_SD(s')> + 1). A cached state is thus updated by one integer product for each
///   later correction.
/// - h(s') - h(s) = W (x_SD(s') - x_SD(s)) needs only the columns in which the two codes differ.
///
/// The potentials of a state come from a cached state or from a full pass, whichever is estimated
/// to be cheaper. Both give the same integers.
///
/// Any number of caches may follow a layer through its CorrectionLog.
class ActivationCache {
 public:
  /// A cached state. Shapes: bins (l,), potentials (n,).
  struct Entry {
    std::span<const coding::Bin> bins;
    std::span<const std::int32_t> potentials;
  };

  /// Sources of the potentials, counted since construction.
  struct Counts {
    std::uint64_t exact = 0;      ///< the state was cached
    std::uint64_t neighbour = 0;  ///< derived from a cached neighbour
    std::uint64_t full = 0;       ///< a full pass
    std::uint64_t columns = 0;    ///< columns of weights added, for `full` and `neighbour`
  };

  ActivationCache(const coding::StateCode& code, std::size_t n_units)
      : n_inputs_(code.n_inputs()),
        n_units_(n_units),
        bins_(kEntries * n_inputs_),
        bins_by_input_(n_inputs_ * kEntries),
        potentials_(kEntries * n_units),
        from_(code),
        to_(code),
        changes_(code.column_lists()),
        listed_{Listed(code), Listed(code)} {
    // Costs are estimated in columns, for an input with p partners. Neighbouring bins differ in
    // `differing` units of a pattern, measured over ten bins: about m / 2 / 45, because half of the
    // m units differ between two anchors that are 45 bins apart. Where the pattern is modified, in
    // p groups, half of these units are active, and each changes two columns of the paired code: p
    // columns for each differing unit. Where it is the modifier, a unit switches a unit in each of
    // p groups, which are p / 2 columns of the paired code.
    const double l = static_cast<double>(code.n_inputs());
    const coding::PatternTable& table = code.table(0);
    const double differing = static_cast<double>(table[0].distance(
                                 table[std::min<std::size_t>(10, table.n_bins() - 1)])) /
                             10.0;
    const double n_partners = static_cast<double>(code.n_partners());
    const std::size_t half_of_partners = (code.n_partners() + 1) / 2;
    const double columns_of_modifier = static_cast<double>(half_of_partners);
    columns_per_bin_ = (n_partners + columns_of_modifier) * std::max(differing, 0.05);  // not 0
    constexpr double kColumnsPerProduct = 0.15;  // time of a group's inner product, as measured
    columns_per_correction_ = kColumnsPerProduct * l * n_partners;
    columns_of_pass_ = 0.5 * l * static_cast<double>(code.n_pattern_units()) * columns_of_modifier;
    too_far_ = static_cast<std::int32_t>(
        std::min(std::ceil(columns_of_pass_ / columns_per_bin_), double{INT32_MAX}));
  }

  /// The bytes for potentials, the largest part of a cache.
  static constexpr std::size_t n_bytes(std::size_t n_units) noexcept {
    return kEntries * n_units * sizeof(std::int32_t);
  }

  const Counts& counts() const noexcept { return counts_; }
  std::size_t n_units() const noexcept { return n_units_; }

  /// Returns the potentials of the state with these bins, for the layer's current weights; valid
  /// until the next call. `log` must be the log of `hidden_layer`.
  Entry recall(const coding::StateCode& code, const HiddenLayer& hidden_layer,
               const CorrectionLog& log, std::span<const coding::Bin> bins) {
    if (layer_ != log.identity()) {
      last_use_.fill(0);
      layer_ = log.identity();
    }
    // A decision and the learning step after it usually read the same two states.
    for (const std::size_t slot : {latest_, before_latest_}) {
      if (last_use_[slot] != 0 && std::ranges::equal(bins_of(slot), bins) &&
          log.size() - up_to_[slot] <= CorrectionLog::kSize) {
        return use(code, log, slot);
      }
    }
    detail::Distances distances;
    add_up_distances(bins_by_input_.data(), bins, distances);
    std::size_t nearest = kEntries, oldest = 0;
    std::uint64_t oldest_use = last_use_[oldest];
    double least = columns_of_pass_;
    for (std::size_t slot = 0; slot < kEntries; ++slot) {
      if (last_use_[slot] < oldest_use) {
        oldest_use = last_use_[slot];
        oldest = slot;
      }
      if (distances[slot] >= too_far_) continue;
      const std::uint64_t lag = log.size() - up_to_[slot];
      if (last_use_[slot] == 0 || lag > CorrectionLog::kSize) continue;
      const double cost =
          columns_per_bin_ * distances[slot] + columns_per_correction_ * static_cast<double>(lag);
      if (cost < least) {
        least = cost;
        nearest = slot;
      }
    }
    const std::span<std::int32_t> fresh(potentials_.data() + oldest * n_units_, n_units_);
    if (nearest == kEntries) {
      const coding::SignedColumns columns = list(code, bins);
      hidden_layer.potentials(columns, fresh);
      ++counts_.full;
      counts_.columns += columns.size();
    } else {
      const Entry known = use(code, log, nearest);
      if (std::ranges::equal(known.bins, bins)) {
        ++counts_.exact;
        return known;
      }
      changes_.read_changes(from_.encode(code, known.bins), to_.encode(code, bins));
      if (oldest != nearest) std::ranges::copy(known.potentials, fresh.begin());
      hidden_layer.add(changes_.columns(), fresh);
      ++counts_.neighbour;
      counts_.columns += changes_.columns().size();
    }
    for (std::size_t i = 0; i < n_inputs_; ++i) {
      bins_[oldest * n_inputs_ + i] = bins[i];
      bins_by_input_[i * kEntries + oldest] = bins[i];
    }
    up_to_[oldest] = log.size();
    return use(code, log, oldest);
  }

  /// Returns the columns of the state with these bins. They are listed anew unless it is one of the
  /// last two states whose columns were listed; valid until the next call of any member.
  coding::SignedColumns columns(const coding::StateCode& code, std::span<const coding::Bin> bins) {
    for (const Listed& listed : listed_) {
      if (std::ranges::equal(listed.bins, bins)) return listed.lists.columns();
    }
    return list(code, bins);
  }

 private:
  /// Buffers for the paired code of a state.
  class Words {
   public:
    explicit Words(const coding::StateCode& code) : words_(2 * code.n_words()) {}

    coding::TernaryCode encode(const coding::StateCode& code,
                               std::span<const coding::Bin> bins) noexcept {
      code.encode(bins, words_.data(), words_.data() + code.n_words());
      return {words_.data(), words_.data() + code.n_words()};
    }

   private:
    std::vector<std::uint64_t> words_;  // active, then positive
  };

  /// A state's bins and columns.
  struct Listed {
    explicit Listed(const coding::StateCode& code) : lists(code.column_lists()) {
      bins.reserve(code.n_inputs());
    }

    std::vector<coding::Bin> bins = {};
    coding::ColumnLists lists;
  };

  static constexpr std::size_t kEntries = detail::kCacheEntries;

  std::span<const coding::Bin> bins_of(std::size_t slot) const noexcept {
    return {bins_.data() + slot * n_inputs_, n_inputs_};
  }

  /// Lists the columns of a state, in place of the older one of two kept lists.
  coding::SignedColumns list(const coding::StateCode& code, std::span<const coding::Bin> bins) {
    std::swap(listed_[0], listed_[1]);
    listed_[0].bins.assign(bins.begin(), bins.end());
    listed_[0].lists.read(to_.encode(code, bins));
    return listed_[0].lists.columns();
  }

  /// Updates the potentials of a slot by the corrections that they lack, and marks the slot as just
  /// used.
  Entry use(const coding::StateCode& code, const CorrectionLog& log, std::size_t slot) {
    const Entry entry{bins_of(slot), {potentials_.data() + slot * n_units_, n_units_}};
    std::int32_t* const potentials = potentials_.data() + slot * n_units_;
    for (std::uint64_t& next = up_to_[slot]; next < log.size(); ++next) {
      const CorrectionLog::Entry correction = log[next];
      const std::int32_t change =
          correction.step * (code.inner_product(correction.bins, entry.bins) + 1);
      for (const std::uint32_t unit : correction.units) potentials[unit] += change;
    }
    last_use_[slot] = ++clock_;
    if (slot != latest_) before_latest_ = std::exchange(latest_, slot);
    return entry;
  }

  std::uint64_t layer_ = 0;  ///< the identity of the layer of the slots

  std::size_t n_inputs_;
  std::size_t n_units_;
  std::vector<coding::Bin> bins_;                   ///< [slot][input]
  std::vector<coding::Bin> bins_by_input_;          ///< [input][slot], for quick comparison
  std::vector<std::int32_t> potentials_;            ///< [slot][unit]
  std::array<std::uint64_t, kEntries> up_to_{};     ///< by slot, the number of corrections included
  std::array<std::uint64_t, kEntries> last_use_{};  ///< by slot, a time of clock_; 0: empty
  std::uint64_t clock_ = 0;
  std::size_t latest_ = 0;
  std::size_t before_latest_ = 0;
  Words from_;
  Words to_;
  coding::ColumnLists changes_;
  std::array<Listed, 2> listed_;  ///< the latest is the first

  // Estimated costs, in columns.
  double columns_per_bin_;
  double columns_per_correction_;
  double columns_of_pass_;
  std::int32_t too_far_;  ///< distance in bins from which a full pass is cheaper
  Counts counts_;
};

}  // namespace sdnn::approximators
