/// Rules for the units that a sample corrects: the p-delta rule and error correction.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/errors.hpp"
#include "sdnn/estimators/detail/unit_ranking.hpp"

namespace sdnn::estimators {

/// A correction of a unit: direction * x_SD is added to its weights, and direction is subtracted
/// from its threshold.
struct Correction {
  std::uint32_t unit = 0;
  std::int32_t direction = 0;  ///< +1 or -1
};

/// The p-delta rule, which moves the number of firing units of each group to its target.
///
/// If n units too few (too many) fire, the n silent (firing) units nearest to their threshold are
/// corrected, of equally near units those with the lowest index; with a `share` below 1 only max(1,
/// int(0.5 + share * n)) units. A target is rounded to int(0.5 + target) and clipped to 0 and the
/// group's size.
///
/// Source: Auer, Burgsteiner, Maass 2008; Nonaka, Tanaka, Morita 2011.
class PDeltaRule {
 public:
  /// Takes the target numbers of firing units, not rounded: (t - b) / a for an output
  /// t = a * number + b.
  ///
  /// Shapes: targets (n_samples, n_groups). Throws std::invalid_argument if a target is not finite,
  /// if n_units is 0, if n_groups does not divide it, or if share is not in (0, 1].
  PDeltaRule(std::size_t n_units, std::span<const double> targets, std::size_t n_groups,
             double share = 1.0)
      : n_groups_(n_groups), share_(share) {
    core::require(share > 0.0 && share <= 1.0, "share", "in (0, 1]", share);
    core::require_in_range("n_units", n_units, 1, std::size_t{1} << 20);
    core::require(n_groups > 0 && n_units % n_groups == 0, "n_groups",
                  "a divisor of n_units = " + std::to_string(n_units), n_groups);
    core::require(targets.size() % n_groups == 0, "targets", "n_groups values per sample",
                  targets.size());
    group_size_ = n_units / n_groups;
    targets_.reserve(targets.size());
    for (std::size_t i = 0; i < targets.size(); ++i) {
      if (!std::isfinite(targets[i])) {
        core::require_finite(
            "targets[" + std::to_string(i / n_groups) + ", " + std::to_string(i % n_groups) + "]",
            targets[i]);
      }
      targets_.push_back(static_cast<std::int32_t>(
          std::clamp(0.5 + targets[i], 0.0, static_cast<double>(group_size_))));
    }
    keys_.resize(group_size_);
    n_index_bits_ = static_cast<int>(std::bit_width(group_size_ - 1));
    distance_limit_ = std::numeric_limits<std::int32_t>::max() >> n_index_bits_;
  }

  std::size_t n_samples() const noexcept { return targets_.size() / n_groups_; }
  std::size_t n_units() const noexcept { return n_groups_ * group_size_; }

  /// Overwrites `corrections` with those of a sample. Shapes: potentials (n_units,).
  void operator()(std::size_t sample, const std::int32_t* potentials,
                  std::vector<Correction>& corrections) {
    corrections.clear();
    for (std::size_t g = 0; g < n_groups_; ++g) {
      const std::int32_t* const group = potentials + g * group_size_;
      const std::int32_t deficit =
          targets_[sample * n_groups_ + g] - count_firing(group, group_size_);
      if (deficit != 0) correct_group(group, g * group_size_, deficit, corrections);
    }
  }

 private:
  /// Appends corrections of the units of a group that are nearest to their threshold: units that
  /// do not fire where the deficit is positive, else firing ones, a share of the deficit in number.
  void correct_group(const std::int32_t* potentials, std::size_t first_unit, std::int32_t deficit,
                     std::vector<Correction>& corrections) {
    const std::int32_t direction = deficit > 0 ? 1 : -1;
    const auto n_corrected =
        static_cast<std::size_t>(std::max(1.0, std::floor(0.5 + share_ * std::abs(deficit))));
    const auto add = [&](std::size_t i) {
      corrections.push_back({static_cast<std::uint32_t>(first_unit + i), direction});
    };
    // Few units are found by a scan for the least key of rank_units, then for the next larger one,
    // and so on. A key ends with the unit's index, in n_index_bits_ bits.
    if (n_corrected <= kScans) {
      const std::size_t n_before = corrections.size();
      std::int32_t key = rank_units(potentials, group_size_, deficit < 0, n_index_bits_,
                                    distance_limit_, keys_.data());
      for (std::size_t left = n_corrected; key >> n_index_bits_ < distance_limit_;) {
        add(static_cast<std::size_t>(key & ((1 << n_index_bits_) - 1)));
        if (--left == 0) return;
        key = least_above(keys_.data(), group_size_, key);
      }
      corrections.resize(n_before);  // keys do not distinguish distances of the limit and above
    }
    ranked_.clear();
    for (std::size_t i = 0; i < group_size_; ++i) {
      if ((potentials[i] > 0) == (deficit < 0)) {
        ranked_.emplace_back(std::abs(potentials[i]), static_cast<std::uint32_t>(i));
      }
    }
    const auto end = ranked_.begin() + static_cast<std::ptrdiff_t>(n_corrected);
    std::nth_element(ranked_.begin(), end - 1, ranked_.end());
    std::for_each(ranked_.begin(), end, [&](const auto& ranked) { add(ranked.second); });
  }

  /// The number of corrections up to which repeated scans are taken to be faster than nth_element.
  static constexpr std::size_t kScans = 12;

  std::size_t n_groups_;
  double share_;
  std::size_t group_size_ = 0;
  std::vector<std::int32_t> targets_;
  std::vector<std::int32_t> keys_;
  int n_index_bits_ = 0;
  std::int32_t distance_limit_ = 0;  // keys distinguish smaller distances only
  std::vector<std::pair<std::int32_t, std::uint32_t>> ranked_;
};

/// How several classes are separated by units, each of which separates only two sides: the classes
/// for which it should fire, and those for which it should not.
enum class ClassScheme {
  one_vs_rest,  ///< unit k fires for class k
  one_vs_one,   ///< units (0,1), (0,2), ..., (1,2), ...: fires for the first, silent for the second
};

inline constexpr std::array kClassSchemes{ClassScheme::one_vs_rest, ClassScheme::one_vs_one};

inline std::string_view name_of(ClassScheme scheme) noexcept {
  return scheme == ClassScheme::one_vs_rest ? "one_vs_rest" : "one_vs_one";
}

/// Returns the scheme with this name. Throws std::invalid_argument if there is no such scheme.
inline ClassScheme class_scheme_named(std::string_view name) {
  for (const auto scheme : kClassSchemes) {
    if (name == name_of(scheme)) return scheme;
  }
  core::fail(
      std::invalid_argument("scheme must be one_vs_rest or one_vs_one, got " + std::string(name)));
}

/// Returns the number of units that a scheme needs. Throws std::invalid_argument if there are fewer
/// than 2 classes or more than 1024.
inline std::size_t n_units_for(ClassScheme scheme, std::size_t n_classes) {
  core::require_in_range("n_classes", n_classes, 2, 1024);
  return scheme == ClassScheme::one_vs_rest ? n_classes : n_classes * (n_classes - 1) / 2;
}

/// The perceptron rule: it corrects every unit that fires but should not for the sample's class, or
/// the reverse. A one-vs-one unit is not corrected for classes other than its two.
///
/// Source: the LIBSDNN manual (both schemes).
class PerceptronRule {
 public:
  /// Takes the class of each sample. Shapes: labels (n_samples,) in [0, n_classes). Throws
  /// std::invalid_argument otherwise, or if n_units is not what the scheme needs.
  PerceptronRule(std::size_t n_units, std::span<const std::int32_t> labels, std::size_t n_classes,
                 ClassScheme scheme)
      : n_units_(n_units), labels_(labels.begin(), labels.end()) {
    const std::size_t needed = n_units_for(scheme, n_classes);
    core::require(n_units == needed, "n_units",
                  std::to_string(needed) + " for " + std::to_string(n_classes) + " classes",
                  n_units);
    for (std::size_t t = 0; t < labels.size(); ++t) {
      if (labels[t] >= 0 && static_cast<std::size_t>(labels[t]) < n_classes) continue;
      core::require_in_range("labels[" + std::to_string(t) + "]", labels[t], 0,
                             static_cast<std::int32_t>(n_classes) - 1);
    }
    wanted_.resize(n_classes);
    std::uint32_t unit = 0;
    for (std::size_t i = 0; i < n_classes; ++i) {
      if (scheme == ClassScheme::one_vs_rest) {
        for (std::size_t k = 0; k < n_classes; ++k) {
          wanted_[i].push_back({static_cast<std::uint32_t>(k), k == i ? 1 : -1});
        }
        continue;
      }
      for (std::size_t j = i + 1; j < n_classes; ++j, ++unit) {
        wanted_[i].push_back({unit, 1});
        wanted_[j].push_back({unit, -1});
      }
    }
  }

  std::size_t n_samples() const noexcept { return labels_.size(); }
  std::size_t n_units() const noexcept { return n_units_; }

  /// Overwrites `corrections` with those of a sample. Shapes: potentials (n_units,).
  void operator()(std::size_t sample, const std::int32_t* potentials,
                  std::vector<Correction>& corrections) {
    corrections.clear();
    for (const Correction& wanted : wanted_[static_cast<std::size_t>(labels_[sample])]) {
      if ((potentials[wanted.unit] > 0) != (wanted.direction > 0)) corrections.push_back(wanted);
    }
  }

 private:
  std::size_t n_units_;
  std::vector<std::int32_t> labels_;
  /// For each class, the units that separate it; direction: +1 if the unit should fire, else -1.
  std::vector<std::vector<Correction>> wanted_;
};

}  // namespace sdnn::estimators
