/// Fuzzy rules over a grid of triangular sets, each with a value for every discrete action.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"

namespace sdnn::approximators {

/// The sizes of a rule table; the defaults are the paper's (method.md, section 3).
struct FuzzyRulesConfig {
  int n_inputs = 4;
  int n_sets = 9;
  int n_actions = 21;
  std::uint64_t max_table_bytes = core::kDefaultMaxTableBytes;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("n_inputs", &FuzzyRulesConfig::n_inputs, "d, number of inputs.",
                    core::within(1, 62)),
        core::field("n_sets", &FuzzyRulesConfig::n_sets,
                    "Triangular sets per input, evenly spaced over its range. There are n_sets to "
                    "the power of n_inputs rules of 4 n_actions bytes: 45 MB with 6 inputs.",
                    core::within(2, 1 << 20)),
        core::field("n_actions", &FuzzyRulesConfig::n_actions,
                    "Discrete actions that every rule has values of, evenly spaced over the "
                    "action's range.",
                    core::within(1, 1 << 20)),
        core::field("max_table_bytes", &FuzzyRulesConfig::max_table_bytes,
                    "A larger table is refused before memory is allocated; 1 GiB by default. For "
                    "all action dimensions together, where an agent has several."));
  }
  bool operator==(const FuzzyRulesConfig&) const = default;
};

/// The rules that fire in a state, with their truth values. A reader reuses it as a buffer.
struct FiredRules {
  std::vector<std::size_t> rules;
  std::vector<double> truth_values;  ///< truth values of `rules`, whose sum is 1 up to rounding

  std::size_t size() const noexcept { return rules.size(); }
};

/// A table of n_sets^d rules, one per combination of a set for each input, with the values v(rule,
/// action) of all actions as 32-bit floats.
///
/// A rule's truth value is the product of the memberships of the inputs in its sets. The triangle
/// of a set is 1 at its centre and falls to 0 at the neighbouring centres. So an input belongs to
/// two sets, or at a centre to a single set: at most 2^d rules fire, and only these are read or
/// written. All values start at 0; rules that never fire cost no memory where the operating system
/// provides zero pages on first use. Source: method.md, section 3. The table has 4 n_actions
/// n_sets^d bytes: 45 MB at d = 6. Thread safety: const functions may be called by many threads at
/// once.
class FuzzyRules {
 public:
  /// v(rule, action), a row per rule.
  using Table = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Makes rules whose values are 0. Throws std::invalid_argument naming the impossible size;
  /// std::length_error naming rules, bytes and limit, before any allocation; std::bad_alloc.
  explicit FuzzyRules(const FuzzyRulesConfig& config)
      : config_(checked(config)),
        n_rules_(core::grid_cells("n_sets or n_inputs", "rules",
                                  static_cast<std::size_t>(config.n_sets), n_inputs(),
                                  n_actions() * sizeof(float), config.max_table_bytes)),
        table_(n_rules_ * n_actions()) {}

  const FuzzyRulesConfig& config() const noexcept { return config_; }
  std::size_t n_inputs() const noexcept { return static_cast<std::size_t>(config_.n_inputs); }
  std::size_t n_sets() const noexcept { return static_cast<std::size_t>(config_.n_sets); }
  std::size_t n_actions() const noexcept { return static_cast<std::size_t>(config_.n_actions); }
  std::size_t n_rules() const noexcept { return n_rules_; }
  /// The largest number of rules that fire in a state.
  std::size_t max_fired() const noexcept { return std::size_t{1} << n_inputs(); }

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.finite("values", {self.n_rules_, self.n_actions()}, self.table_.span());
  }

  /// Writes the rules that fire in `state`, and their truth values. The number of a rule has a
  /// digit in base n_sets for each input, its set; the last input has the lowest digit. With two
  /// inputs between two centres each, lower sets (i, j), the order is (i, j), (i + 1, j), (i, j +
  /// 1), (i + 1, j + 1). Truth values are products in the order of the inputs.
  ///
  /// Shape: state (d,) in [0, 1]. Throws std::invalid_argument otherwise; then `fired` is
  /// unchanged. Allocates nothing once `fired` has room for max_fired().
  void fire(std::span<const double> state, FiredRules& fired) const {
    core::require_unit_values("state", state, n_inputs());
    fired.rules.assign(1, 0);
    fired.truth_values.assign(1, 1.0);
    const double n_gaps = static_cast<double>(n_sets() - 1);
    for (const double x : state) {
      const double position = x * n_gaps;
      const std::size_t lower = std::min(static_cast<std::size_t>(position), n_sets() - 2);
      const double membership = position - static_cast<double>(lower);       // in the upper set
      for (std::size_t& rule : fired.rules) rule = rule * n_sets() + lower;  // the next digit
      if (membership == 0.0) continue;
      if (membership == 1.0) {  // at x = 1, where `lower` is the last set but one
        for (std::size_t& rule : fired.rules) ++rule;
        continue;
      }
      const std::size_t n = fired.size();
      for (std::size_t i = 0; i < n; ++i) {
        fired.rules.push_back(fired.rules[i] + 1);
        fired.truth_values.push_back(fired.truth_values[i] * membership);
        fired.truth_values[i] *= 1.0 - membership;
      }
    }
  }

  /// An empty list with room for every rule that can fire at once.
  FiredRules workspace() const {
    FiredRules fired;
    fired.rules.reserve(max_fired());
    fired.truth_values.reserve(max_fired());
    return fired;
  }

  /// v(rule, action).
  float value(std::size_t rule, std::size_t action) const noexcept {
    assert(rule < n_rules_ && action < n_actions());
    return table()(index(rule), index(action));
  }
  void set_value(std::size_t rule, std::size_t action, float value) noexcept {
    assert(rule < n_rules_ && action < n_actions());
    table()(index(rule), index(action)) = value;
  }

  /// v(rule, a) for every action. Shape: (n_actions,).
  std::span<const float> values(std::size_t rule) const noexcept {
    assert(rule < n_rules_);
    return table_.span().subspan(rule * n_actions(), n_actions());
  }

  /// All values. Shape: (n_rules, n_actions).
  Eigen::Map<const Table, Eigen::Aligned64> table() const noexcept {
    return {table_.data(), index(n_rules_), index(n_actions())};
  }
  Eigen::Map<Table, Eigen::Aligned64> table() noexcept {
    return {table_.data(), index(n_rules_), index(n_actions())};
  }

 private:
  static FuzzyRulesConfig checked(const FuzzyRulesConfig& config) {
    core::check_fields(config);
    return config;
  }

  static Eigen::Index index(std::size_t i) noexcept { return static_cast<Eigen::Index>(i); }

  FuzzyRulesConfig config_;
  std::size_t n_rules_;
  core::AlignedBuffer<float> table_;
};

}  // namespace sdnn::approximators
