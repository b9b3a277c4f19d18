/// The selection of the inputs that matter for a task's rewards or are changed by its actions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdnn/agents/detail/binary_groups.hpp"
#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/detail/interruption.hpp"

namespace sdnn::agents {

/// Transitions of random actions in the order of time, one environment after the other.
struct RandomExperience {
  std::size_t n_inputs = 0;
  std::vector<double> states = {};                ///< (n, n_inputs), in [0, 1]
  std::vector<double> next_states = {};           ///< (n, n_inputs), in [0, 1]
  std::vector<bool> circular = {};                ///< (n_inputs,): 0 and 1 are neighbours
  std::vector<double> rewards = {};               ///< (n,)
  std::vector<bool> ends = {};                    ///< (n,): another episode follows
  std::vector<std::vector<double>> actions = {};  ///< of each dimension, (n,)

  std::size_t size() const noexcept { return rewards.size(); }
};

/// Selects the relevant inputs: those on which the next rewards depend, those that actions change,
/// and all inputs on which these depend, directly or through others.
///
/// An input is relevant by itself if the next reward, or the sum of the next 20 rewards, differs
/// between its values, or if its change in a step differs between actions. Then every input is
/// relevant on which the change of a relevant one depends. A velocity that says nothing about the
/// reward is thus selected because it moves a position, even without any reward. Noise is not
/// selected, whatever its dynamics, because it changes only itself. Last, two inputs are relevant
/// together if these rewards differ between pairs of their values more than between the values of
/// each.
///
/// A dependence is a large F statistic over eight bins of equal counts. It is compared with the F
/// statistics of the same two series with one of them shifted in time, by 40 different lengths. It
/// must be larger than 1.5 times the largest of these; for pairs of inputs, than twice the largest.
/// Shifts preserve the dynamics of each series, so slow noise, which seems to depend on everything,
/// does so after shifts, too.
///
/// There are about n^2 comparisons of n inputs, so with many inputs some dependences are found by
/// chance. With more than 24 inputs evidence must therefore be *strict*: the cube root of F, which
/// is nearly normal, must also lie sqrt(2 log(10 n^2)) standard deviations above its mean over the
/// shifts, and rest on 8 values.
///
/// Three binary inputs or more form groups (see detail::binary_groups). A group matters as a whole
/// if one of its inputs does. Since each of them could do so by chance, the evidence must be
/// strict, also with few inputs. A one-hot vector matters, too, if actions decide which of its
/// inputs is on next.
///
/// The numbers are chosen constants.
class Relevance {
 public:
  /// `caution` multiplies the required evidence; callers that repeat the selection pass more
  /// than 1. The experience must outlive this object.
  explicit Relevance(const RandomExperience& experience, double caution = 1.0)
      : experience_(experience), caution_(caution) {}

  /// Returns for each input whether it is relevant; those that are `known` to be relevant stay so.
  /// All inputs are relevant if fewer than two are found. Shapes: (n_inputs,).
  std::vector<bool> inputs(const std::vector<bool>& known) const {
    const std::size_t n_inputs = experience_.n_inputs;
    if (experience_.size() < kLeast) return std::vector<bool>(n_inputs, true);
    const Series series = all_series();
    std::vector<bool> matters(n_inputs);
    std::vector<std::size_t> pending;      // inputs that matter, whose causes are not searched yet
    const auto add = [&](std::size_t i) {  // with its group
      const std::vector<std::size_t> alone{i};
      for (const std::size_t member : series.group_of[i].empty() ? alone : series.group_of[i]) {
        matters[member] = true;
        pending.push_back(member);
      }
    };
    for (std::size_t i = 0; i < n_inputs; ++i) {
      core::interruption_point();
      if (!matters[i] && (known[i] || matters_alone(series, i))) add(i);
    }
    for (const auto& group : series.groups) {
      if (!matters[group.inputs.front()] && are_steered(group, series)) add(group.inputs.front());
    }
    while (!pending.empty()) {
      const std::size_t effect = pending.back();
      pending.pop_back();
      for (std::size_t i = 0; i < n_inputs; ++i) {
        core::interruption_point();
        const bool is_strict = series.is_strict(i) || series.is_strict(effect);
        if (!matters[i] && depends(series.changes[effect], series.bins[i], is_strict)) add(i);
      }
    }
    if (n_inputs <= kMostInPairs) {
      const std::vector<bool> alone = matters;
      for (const auto& outcomes : series.outcomes) find_pairs(outcomes, series, alone, matters);
      for (const auto& group : series.groups) {
        const bool any = std::ranges::any_of(group.inputs, [&](auto i) { return matters[i]; });
        for (const std::size_t i : group.inputs) matters[i] = any;
      }
    }
    if (std::ranges::count(matters, true) < 2) matters.assign(n_inputs, true);
    return matters;
  }

 private:
  static constexpr std::size_t kLeast = 100;             // transitions; fewer are no evidence
  static constexpr std::size_t kMostWithoutChance = 24;  // inputs; with more, evidence is strict
  static constexpr std::size_t kLeastDeciding = 8;       // values on which strict evidence rests
  static constexpr std::size_t kBins = 8;                // of an input
  static constexpr std::size_t kMostBins = 16;           // of a pair: four of each of its inputs
  static constexpr std::size_t kMostInPairs = 64;        // inputs; the time grows as their square
  static constexpr std::size_t kShifts = 40;             // in time, to show what chance gives
  static constexpr std::size_t kRewards = 20;            // in a sum of the next rewards
  static constexpr double kDiscount = 0.95;              // in such a sum
  static constexpr double kFactor = 1.5;                 // of the largest F after shifts
  static constexpr double kFactorOfPairs = 2.0;  // higher, as there are more pairs than inputs

  using Bins = std::vector<std::uint8_t>;

  /// The series that are compared, of a number or bin for each transition, and groups of inputs.
  struct Series {
    std::vector<Bins> bins = {};                     ///< of the values of each input
    std::vector<std::vector<double>> changes = {};   ///< of each input
    std::vector<Bins> bins_of_actions = {};          ///< of each dimension
    std::vector<std::vector<double>> outcomes = {};  ///< the next reward, sums of the next rewards
    std::vector<detail::BinaryGroup> groups = {};
    std::vector<std::vector<std::size_t>> group_of = {};  ///< of each input; empty: it has none

    /// Whether dependences of an input need strict evidence.
    bool is_strict(std::size_t i) const {
      return bins.size() > kMostWithoutChance || !group_of[i].empty();
    }
  };

  /// Returns the series of the experience whose dependences are tested.
  Series all_series() const {
    const std::size_t n_inputs = experience_.n_inputs;
    Series series;
    for (std::size_t i = 0; i < n_inputs; ++i) {
      series.bins.push_back(binned(column(experience_.states, i)));
      series.changes.push_back(changes_of(i));
    }
    for (const auto& actions : experience_.actions) {
      series.bins_of_actions.push_back(binned(actions));
    }
    series.outcomes = {experience_.rewards, sums_of_rewards()};
    series.groups = detail::binary_groups(experience_.states, experience_.next_states, n_inputs);
    series.group_of.resize(n_inputs);
    for (const auto& group : series.groups) {
      for (const std::size_t i : group.inputs) {
        series.group_of[i] = group.inputs;
        series.bins[i] = halves(column(experience_.states, i));
      }
    }
    return series;
  }

  /// Whether outcomes depend on an input, or its changes on actions.
  bool matters_alone(const Series& series, std::size_t i) const {
    const bool is_strict = series.is_strict(i);
    return std::ranges::any_of(series.outcomes,
                               [&](const auto& outcomes) {
                                 return depends(outcomes, series.bins[i], is_strict);
                               }) ||
           std::ranges::any_of(series.bins_of_actions, [&](const Bins& actions) {
             return depends(series.changes[i], actions, is_strict);
           });
  }

  std::vector<double> column(const std::vector<double>& rows, std::size_t i) const {
    std::vector<double> values;
    for (; i < rows.size(); i += experience_.n_inputs) values.push_back(rows[i]);
    return values;
  }

  /// The change of input i in each transition; of an angle, the shorter way.
  std::vector<double> changes_of(std::size_t i) const {
    const std::vector<double> before = column(experience_.states, i);
    std::vector<double> changes = column(experience_.next_states, i);
    for (std::size_t t = 0; t < changes.size(); ++t) {
      changes[t] -= before[t];
      if (experience_.circular[i]) changes[t] -= std::round(changes[t]);
    }
    return changes;
  }

  /// The discounted sum of the next kRewards rewards of each transition, up to the episode's end.
  std::vector<double> sums_of_rewards() const {
    std::vector<double> sums(experience_.size());
    for (std::size_t t = 0; t < sums.size(); ++t) {
      double weight = 1.0;
      for (std::size_t k = t; k < std::min(sums.size(), t + kRewards); ++k) {
        sums[t] += weight * experience_.rewards[k];
        weight *= kDiscount;
        if (experience_.ends[k]) break;
      }
    }
    return sums;
  }

  /// The bin of each value. Bins have about equal counts of values, and equal values share one.
  static std::vector<std::uint8_t> binned(const std::vector<double>& values) {
    std::vector<double> sorted = values;
    std::ranges::sort(sorted);
    std::vector<double> edges;
    for (std::size_t b = 1; b < kBins; ++b) {
      const double edge = sorted[b * sorted.size() / kBins];
      if (edge > sorted.front() && (edges.empty() || edge > edges.back())) edges.push_back(edge);
    }
    std::vector<std::uint8_t> bins;
    for (const double value : values) {
      const auto bin = std::ranges::upper_bound(edges, value) - edges.begin();
      bins.push_back(static_cast<std::uint8_t>(bin));
    }
    return bins;
  }

  /// The two bins of a binary input, however rare its larger value is.
  static Bins halves(const std::vector<double>& values) {
    const double low = std::ranges::min(values);
    Bins bins;
    for (const double value : values) bins.push_back(value > low ? kBins - 1 : 0);
    return bins;
  }

  /// Returns the F statistic of values in bins: the variance between the means of the bins divided
  /// by the variance within bins; 0 if nothing varies. Value t belongs to bins[t + shift], where
  /// the end wraps around, or with `beside` to the pair of this bin and (*beside)[t].
  static double f_statistic(const std::vector<double>& values, const Bins& bins, std::size_t shift,
                            const Bins* beside) {
    double sums[kMostBins] = {}, counts[kMostBins] = {}, total = 0.0;
    const std::size_t n = values.size();
    for (std::size_t t = 0, s = shift; t < n; ++t, ++s) {
      if (s == n) s = 0;
      const std::size_t bin = beside == nullptr ? bins[s] : kBins / 2 * (*beside)[t] + bins[s];
      sums[bin] += values[t];
      counts[bin] += 1.0;
      total += values[t];
    }
    const double mean = total / static_cast<double>(n);
    double square = 0.0;
    for (const double value : values) square += (value - mean) * (value - mean);
    double between = 0.0, n_bins = 0.0;
    for (std::size_t b = 0; b < kMostBins; ++b) {
      if (counts[b] == 0.0) continue;
      const double difference = sums[b] / counts[b] - mean;
      between += counts[b] * difference * difference;
      n_bins += 1.0;
    }
    if (n_bins < 2.0 || !(square > 0.0)) return 0.0;
    const double within = std::max(square - between, 1e-12 * square);
    return between / (n_bins - 1.0) / (within / (static_cast<double>(n) - n_bins));
  }

  /// Adds the inputs that matter together with another one. Inputs that matter `alone` are tested
  /// with those that do not, and these with each other.
  void find_pairs(const std::vector<double>& outcomes, const Series& series,
                  const std::vector<bool>& alone, std::vector<bool>& matters) const {
    std::vector<Bins> bins = series.bins;
    for (Bins& of_input : bins) {
      for (std::uint8_t& bin : of_input) bin /= 2;  // four bins instead of eight
    }
    for (std::size_t i = 0; i < bins.size(); ++i) {
      const std::vector<double> beyond = without_means(outcomes, bins[i]);
      for (std::size_t j = 0; j < bins.size(); ++j) {
        core::interruption_point();
        if (j == i || alone[j] || (j < i && !alone[i])) continue;
        const bool is_strict = series.is_strict(i) || series.is_strict(j);
        if (!depends(beyond, bins[j], is_strict, &bins[i])) continue;
        matters[i] = matters[j] = true;
      }
    }
  }

  /// Subtracts from each value the mean of the values in its bin.
  static std::vector<double> without_means(std::vector<double> values, const Bins& bins) {
    double sums[kMostBins] = {}, counts[kMostBins] = {};
    for (std::size_t t = 0; t < values.size(); ++t) {
      sums[bins[t]] += values[t];
      counts[bins[t]] += 1.0;
    }
    for (std::size_t t = 0; t < values.size(); ++t) values[t] -= sums[bins[t]] / counts[bins[t]];
    return values;
  }

  /// The number of bins that hold values.
  static double n_different(const Bins& bins) {
    bool is_used[kMostBins] = {};
    for (const std::uint8_t bin : bins) is_used[bin] = true;
    return static_cast<double>(std::ranges::count(is_used, true));
  }

  /// Counts the values on which a dependence rests: those that differ from the median and are not
  /// in the fullest bin. If they are few, coincidences make any statistic large.
  static std::size_t n_deciding(const std::vector<double>& values, const Bins& bins) {
    std::size_t counts[kMostBins] = {};
    for (const std::uint8_t bin : bins) ++counts[bin];
    const auto fullest = std::ranges::max_element(counts) - counts;
    std::vector<double> sorted = values;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, middle);
    std::size_t n = 0;
    for (std::size_t t = 0; t < values.size(); ++t) {
      if (bins[t] != fullest && values[t] != *middle) ++n;
    }
    return n;
  }

  /// Whether values differ between bins, or between pairs of bins, by more than chance.
  bool depends(const std::vector<double>& values, const Bins& bins, bool is_strict,
               const Bins* beside = nullptr) const {
    const double factor = caution_ * (beside == nullptr ? kFactor : kFactorOfPairs);
    const double statistic = f_statistic(values, bins, 0, beside);
    if (!(statistic > 0.0)) return false;
    std::vector<double> by_chance;
    for (std::size_t k = 1; k <= kShifts; ++k) {
      const std::size_t shift = k * values.size() / (kShifts + 1);
      by_chance.push_back(f_statistic(values, bins, shift, beside));
      if (statistic <= factor * by_chance.back()) return false;
    }
    if (!is_strict) return true;
    for (double& x : by_chance) x = std::cbrt(x);
    return n_deciding(values, bins) >= kLeastDeciding &&
           stands_out(std::cbrt(statistic / caution_), by_chance,
                      2.0 / (9.0 * (n_different(bins) - 1.0)));
  }

  /// Whether actions decide which input of a one-hot vector is on next, given the one that is on.
  bool are_steered(const detail::BinaryGroup& group, const Series& series) const {
    if (group.symbols.empty()) return false;
    return std::ranges::any_of(series.bins_of_actions, [&](const Bins& actions) {
      std::vector<double> by_chance;
      for (std::size_t k = 1; k <= kShifts; ++k) {
        core::interruption_point();
        const std::size_t shift = k * actions.size() / (kShifts + 1);
        by_chance.push_back(detail::steering(group, actions, shift));
      }
      return stands_out(detail::steering(group, actions, 0) / caution_, by_chance, 0.0);
    });
  }

  /// Returns whether a statistic is probably larger than all of n^2 normal numbers with the mean
  /// and variance of the statistics `by_chance`, for n inputs. With a `least_variance` v above 0
  /// the statistics are cube roots of F. Their mean and variance count as at least 1 - v and v, as
  /// for independent normal values.
  bool stands_out(double statistic, const std::vector<double>& by_chance,
                  double least_variance) const {
    double mean = 0.0, variance = 0.0;
    for (const double x : by_chance) mean += x / kShifts;
    for (const double x : by_chance) variance += (x - mean) * (x - mean) / kShifts;
    if (least_variance > 0.0) mean = std::max(mean, 1.0 - least_variance);
    const auto n_inputs = static_cast<double>(experience_.n_inputs);
    const double margin = std::sqrt(2.0 * std::log(10.0 * n_inputs * n_inputs));
    return statistic > mean + margin * std::sqrt(std::max(variance, least_variance));
  }

  const RandomExperience& experience_;
  double caution_;
};

}  // namespace sdnn::agents
