/// The conversion of observations to states, with ranges that are known or fitted.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/agents/last_readings.hpp"
#include "sdnn/agents/observation_config.hpp"
#include "sdnn/agents/observation_scale.hpp"
#include "sdnn/agents/running_ranges.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::agents {

/// Scales observations to states in [0, 1]; see ObservationScale.
///
/// The range of a variable is fixed by the configuration, or fitted to observations: from the
/// lowest to the highest, plus a quarter of the width at each end. Three settings change this:
/// - `adaptive`: all ranges are fitted, without the lowest and the highest twentieth of the
///   observations, and stay within the fixed range.
/// - `narrowed`: a fixed range is replaced by the fitted one if it is more than twice as wide. Only
///   with few inputs: with many, the finer bins would get too little data.
/// - `running`: ranges change with each observation; see RunningRanges.
///
/// Neighbouring variables that move on the unit circle, apart from noise, can become angles.
class Observations {
 public:
  static constexpr double kHeadroom = 0.25;  ///< of fitted ranges at each end, in widths

  /// With `codes_symbols` a symbol, which is a one-hot vector of variables, is one input; otherwise
  /// each of its variables is. The last input is repeated if there are fewer than `least_inputs`.
  /// With Missing::code, `n_bins` has the number of bins of each input, or a single number for all
  /// inputs that are no symbols. Throws std::invalid_argument naming the impossible field.
  Observations(ObservationConfig config, bool codes_symbols, std::size_t least_inputs,
               std::vector<std::size_t> n_bins = {})
      : config_(std::move(config)), least_inputs_(least_inputs), n_bins_(std::move(n_bins)) {
    core::require(!codes_missing() || (codes_symbols && !n_bins_.empty()), "missing",
                  "'error' or 'hold': these agents have no patterns of inputs", "code");
    core::require(!codes_missing() || config_.history == History::none, "history",
                  "'none' with missing='code'", "another one");
    core::require(!config_.low.empty(), "observation.low", "of one variable at least", 0);
    core::require(config_.high.size() == n_variables(), "observation.high",
                  "as long as observation.low", config_.high.size());
    if (!codes_symbols) config_.symbols.clear();
    roles_.resize(n_variables());
    for (const auto& symbol : config_.symbols) {
      const bool fits = symbol.size() == 2 && is_variable(symbol[0]) && symbol[1] >= 1 &&
                        is_variable(symbol[0] + std::int64_t{symbol[1]} - 1);
      core::require(fits, "observation.symbols", "pairs of a variable and a number of variables",
                    symbol.size());
      for (int k = 0; k < symbol[1]; ++k) claim(Role::symbol, symbol[0] + k, "symbols");
    }
    for (const int variable : config_.angles) claim(Role::circular, variable, "angles");
    for (const auto& pair : config_.angle_pairs) {
      core::require(pair.size() == 2, "angle_pairs", "pairs of variables", pair.size());
      for (const int variable : pair) claim(Role::pair, variable, "angle_pairs");
    }
    for (const int variable : config_.inputs) require_variable("inputs", variable);
    if (config_.running) running_.emplace(n_variables());
    const Ranges fixed = fixed_ranges(config_.angle_pairs);
    needs_fit_ = may_find_pairs() || may_leave_out_inputs(config_.angle_pairs) ||
                 has_fixed_history() || std::ranges::any_of(fixed.low, is_unknown);
    if (!needs_fit_) set_ranges(fixed, config_.angle_pairs);
  }

  std::size_t n_variables() const noexcept { return config_.low.size(); }
  /// Whether observations of a warm-up are needed, for ranges, pairs, inputs or a history.
  bool needs_fit() const noexcept { return needs_fit_; }
  /// Whether all ranges are known. Inputs and states exist only then.
  bool is_fitted() const noexcept { return scale_.has_value(); }

  /// Shapes: (n_variables,).
  std::span<const double> low() const noexcept { return ranges_.low; }
  std::span<const double> high() const noexcept { return ranges_.high; }
  std::span<const ObservedInput> inputs() const noexcept { return inputs_; }
  std::size_t n_inputs() const noexcept { return inputs_.size(); }
  /// Whether irrelevant inputs may be left out. With one or two inputs, all are kept.
  bool has_choice() const { return may_leave_out_inputs(pairs_); }
  /// Which inputs are angles.
  std::vector<bool> circular() const {
    std::vector<bool> circular;
    for (const ObservedInput& input : inputs_) {
      circular.push_back(input.kind == ObservedKind::angle || input.kind == ObservedKind::circular);
    }
    return circular;
  }
  /// Whether there is a single possible input.
  bool has_single_input() const { return inputs_with(pairs_).size() == 1; }
  /// Sets whether a single input is repeated until the approximator has enough inputs. It is not
  /// where a HistoryFilter adds others. Requires that no input was left out.
  void repeat_input(bool is_repeated) {
    repeats_input_ = is_repeated;
    if (scale_) set_inputs(inputs_with(pairs_));
  }
  /// Whether `fit` or `keep` may reduce the inputs: by pairs of an angle, or by leaving some out.
  bool may_have_fewer_inputs() const { return may_find_pairs() || config_.relevant_only; }
  /// The number of symbols of each input, with one for missing readings if coded; 0 for a number.
  std::vector<int> n_symbols() const {
    std::vector<int> n_symbols;
    for (const ObservedInput& input : inputs_) {
      const int n = static_cast<int>(input.second) + (codes_missing() ? 1 : 0);
      n_symbols.push_back(input.kind == ObservedKind::symbol ? n : 0);
    }
    return n_symbols;
  }
  /// A memory for the last readings, without any reading yet.
  LastReadings last_readings() const {
    return {config_.missing == Missing::hold, n_variables(), config_.symbols};
  }
  /// Whether each input has a pattern for missing readings; a symbol's is its last one.
  bool codes_missing() const noexcept { return config_.missing == Missing::code; }

  /// The number of states if observations are a single symbol; 0 if they are not countable.
  std::size_t n_states() const noexcept {
    const bool is_symbol =
        !config_.symbols.empty() && index(config_.symbols.front()[1]) == n_variables();
    if (!is_symbol) return 0;
    return codes_missing() ? n_variables() + 1 : n_variables();
  }

  /// Writes the state of an observation; see ObservationScale. Requires fitted ranges.
  void scale(std::span<const double> observation, std::span<double> state,
             const char* name = "observation", bool is_wide = false) const {
    (*scale_)(observation, state, name, is_wide);
  }

  /// Whether ranges change.
  bool is_running() const noexcept { return running_.has_value(); }
  /// Resets running ranges to those before any observation.
  void forget() {
    if (running_) running_.emplace(n_variables());
  }
  /// Updates running ranges by an observation. Requires that there are some, and fitted ranges.
  void note(std::span<const double> observation) {
    running_->note(observation);
    use_running_ranges();
  }
  /// Which inputs are never left out: those of variables that the configuration lists in `inputs`.
  std::vector<bool> required() const {
    std::vector<bool> required;
    for (const ObservedInput& input : inputs_) {
      required.push_back(std::ranges::any_of(config_.inputs, [&input](int variable) {
        const std::size_t i = index(variable);
        if (input.kind == ObservedKind::symbol) return i - input.first < input.second;
        return i == input.first || (input.kind == ObservedKind::angle && i == input.second);
      }));
    }
    return required;
  }

  /// Throws std::invalid_argument unless there is a value, usable by Missing, for each variable.
  void require_readings(const char* name, std::span<const double> values) const {
    core::require_size(name, values.size(), n_variables(), "numbers");
    if (config_.missing == Missing::error) ObservationScale::require_present(name, values);
  }

  /// Fits unknown ranges and pairs to `observations`, ignoring missing readings, and narrows ranges
  /// that are much too wide. Shape: (n, n_variables), row by row: the first half are observations
  /// before steps, the second half those after the same steps. Ranges are wider than the
  /// observations by `headroom` times their width at each end. A variable without any reading
  /// counts as 0. Throws std::invalid_argument, and changes nothing, for an impossible range.
  void fit(std::span<const double> observations, double headroom = kHeadroom);

  /// Keeps the inputs whose entry is true, and drops the others. A later call may add dropped
  /// inputs, which become the last ones, but drops no further ones. Shape: an entry for each
  /// possible input. Requires fitted ranges, and that an input is kept.
  void keep(const std::vector<bool>& is_kept) {
    const std::vector<bool> was_kept = kept_inputs();
    assert(is_kept.size() == was_kept.size());
    const bool is_first_call = kept_.empty();
    for (std::size_t i = 0; i < is_kept.size(); ++i) {
      if (is_kept[i] && (is_first_call || !was_kept[i])) {
        kept_.push_back(static_cast<std::int32_t>(i));
      }
    }
    if (is_first_call) n_first_ = kept_.size();
    const std::vector<ObservedInput> all = inputs_with(pairs_);
    std::vector<ObservedInput> inputs;
    for (const std::int32_t i : kept_) inputs.push_back(all[static_cast<std::size_t>(i)]);
    set_inputs(std::move(inputs));
  }
  /// Whether each of all possible inputs is kept.
  std::vector<bool> kept_inputs() const {
    std::vector<bool> kept(inputs_with(pairs_).size(), kept_.empty());
    for (const std::int32_t i : kept_) kept[static_cast<std::size_t>(i)] = true;
    return kept;
  }
  /// The number of inputs before any dropped one was added.
  std::size_t n_first_inputs() const noexcept { return kept_.empty() ? n_inputs() : n_first_; }
  /// A copy with all possible inputs.
  Observations with_all_inputs() const {
    Observations all = *this;
    all.set_ranges(ranges_, pairs_);
    return all;
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    if (self.running_) {
      archive.part("running", *self.running_);
      if constexpr (Archive::kReads) {
        if (!self.needs_fit_) self.use_running_ranges();
      }
    }
    if (!self.needs_fit_) return;
    Ranges ranges = self.ranges_;
    std::vector<std::int32_t> listed;
    for (const auto& pair : self.pairs_) listed.insert(listed.end(), pair.begin(), pair.end());
    archive.numbers("low", ranges.low);
    archive.numbers("high", ranges.high);
    archive.numbers("angle_pairs", listed);
    std::vector<std::int32_t> kept = self.kept_;  // empty: all
    std::uint64_t n_first = self.n_first_;
    if (self.config_.relevant_only) {
      archive.numbers("kept", kept);
      archive.number("n_first", n_first);
    }
    if constexpr (Archive::kReads) {
      archive.expect(ranges.low.size() == self.n_variables(), "low", "one for each variable");
      archive.expect(listed.size() % 2 == 0, "angle_pairs", "pairs");
      std::vector<std::vector<int>> pairs;
      for (std::size_t k = 0; k < listed.size(); k += 2) {
        archive.expect(self.is_variable(listed[k]) && self.is_variable(listed[k + 1]),
                       "angle_pairs", "of variables");
        pairs.push_back({listed[k], listed[k + 1]});
      }
      archive.naming("low", [&] { self.set_ranges(ranges, pairs); });
      archive.expect(n_first <= kept.size() && (n_first > 0 || kept.empty()), "n_first",
                     "as many as are kept, or fewer");
      // `keep` receives the first n_first inputs together, then each added one, as when they were
      // saved. So the inputs get the order of `kept`, unless it is impossible.
      std::vector<bool> is_kept(self.kept_inputs().size());
      for (std::size_t k = 0; k < kept.size(); ++k) {
        const auto i = static_cast<std::size_t>(kept[k]);
        archive.expect(i < is_kept.size() && !is_kept[i], "kept", "different inputs");
        is_kept[i] = true;
        if (k + 1 >= n_first) self.keep(is_kept);
      }
      archive.expect(self.kept_ == kept, "kept", "in the order of inputs, but for those added");
    }
  }

 private:
  /// The use of a variable: a number, a circular one, or a part of a symbol or of cosine and sine.
  enum class Role { number, symbol, circular, pair };
  struct Ranges {
    std::vector<double> low, high;  ///< NaN: not known
  };
  using Pairs = std::vector<std::vector<int>>;

  // Chosen constants.
  static constexpr double kMuchWider = 2.0;  // ratio of widths above which ranges are narrowed
  static constexpr double kRounding = 1e-6;  // relative differences that single precision can cause
  static constexpr std::size_t kFewInputs = 4;   // with more inputs no range is narrowed
  static constexpr std::size_t kAlwaysKept = 2;  // so few inputs are kept without a selection
  static constexpr std::size_t kRare = 20;       // 1 in 20 observations at each end is rare
  static constexpr double kLargest = 1e300;  // largest end of a range, so that widths are finite

  static bool is_unknown(double x) noexcept { return std::isnan(x); }
  bool is_variable(std::int64_t i) const noexcept {
    return i >= 0 && static_cast<std::uint64_t>(i) < n_variables();
  }
  static std::size_t index(int variable) noexcept { return static_cast<std::size_t>(variable); }

  void require_variable(const char* name, int variable) const {
    core::require(is_variable(variable), name,
                  "of variables below " + std::to_string(n_variables()), variable);
  }

  /// Gives a variable its role. Throws std::invalid_argument if it has another one already.
  void claim(Role role, int variable, const char* name) {
    require_variable(name, variable);
    Role& present = roles_[index(variable)];
    core::require(present != Role::symbol, name, "of numbers, not of variables of a symbol",
                  variable);
    core::require(present == Role::number, name,
                  "of variables that angles and angle_pairs name once", variable);
    present = role;
  }

  /// Returns the ranges known without a fit: fixed, running, and [-1, 1] in pairs; others are NaN.
  Ranges fixed_ranges(const Pairs& pairs) const {
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    Ranges ranges{std::vector<double>(n_variables(), unknown),
                  std::vector<double>(n_variables(), unknown)};
    for (std::size_t i = 0; i < n_variables(); ++i) {
      const auto bounds = fixed_range(i);
      const bool is_fixed =
          !config_.adaptive || roles_[i] == Role::symbol || roles_[i] == Role::circular;
      if (bounds && is_fixed) std::tie(ranges.low[i], ranges.high[i]) = *bounds;
    }
    for (std::size_t i = 0; running_ && i < n_variables(); ++i) {
      if (roles_[i] == Role::number) std::tie(ranges.low[i], ranges.high[i]) = (*running_)[i];
    }
    for (const auto& pair : pairs) {
      for (const int variable : pair) {
        ranges.low[index(variable)] = -1.0;
        ranges.high[index(variable)] = 1.0;
      }
    }
    for (const int variable : config_.angles) {
      core::require(!is_unknown(ranges.low[index(variable)]), "angles",
                    "of variables with a range (observation_range: -pi to pi, for example)",
                    variable);
    }
    return ranges;
  }

  /// The range of a variable in the configuration, if both ends are given and finite.
  std::optional<std::pair<double, double>> fixed_range(std::size_t i) const {
    const double infinity = std::numeric_limits<double>::infinity();
    const double low = config_.low[i].value_or(-infinity);
    const double high = config_.high[i].value_or(infinity);
    if (!std::isfinite(low) || !std::isfinite(high)) return std::nullopt;
    return std::pair(low, high);
  }

  static bool is_one_of(const Pairs& pairs, std::size_t variable) {
    return std::ranges::any_of(pairs, [variable](const std::vector<int>& pair) {
      return index(pair[0]) == variable || index(pair[1]) == variable;
    });
  }

  Pairs pairs_in(std::span<const double> observations) const;
  static void narrow(Ranges& ranges, std::size_t i, const std::vector<double>& values,
                     double headroom);
  static std::pair<double, double> widened(double low, double high, double headroom) noexcept;
  std::pair<double, double> fitted_range(std::vector<double> values, std::size_t i,
                                         double headroom) const;

  /// Scales numbers by the running ranges as they are now.
  void use_running_ranges() {
    for (std::size_t i = 0; i < n_variables(); ++i) {
      if (roles_[i] != Role::number || is_one_of(pairs_, i)) continue;
      std::tie(ranges_.low[i], ranges_.high[i]) = (*running_)[i];
      scale_->set_range(i, ranges_.low[i], ranges_.high[i]);
    }
  }

  /// Whether neighbouring numbers may turn out to be cosine and sine of an angle.
  bool may_find_pairs() const {
    const auto are_numbers = [](Role a, Role b) { return a == Role::number && b == a; };
    return config_.find_angle_pairs &&
           std::ranges::adjacent_find(roles_, are_numbers) != roles_.end();
  }
  /// Whether states have a history in any case; an automatic one needs no warm-up.
  bool has_fixed_history() const noexcept {
    return config_.history != History::none && config_.history != History::automatic;
  }
  bool may_leave_out_inputs(const Pairs& pairs) const {
    return config_.relevant_only && inputs_with(pairs).size() > kAlwaysKept;
  }

  /// Lists the inputs of states in the order of their first variables; each pair is an angle.
  std::vector<ObservedInput> inputs_with(const Pairs& pairs) const {
    std::vector<ObservedInput> of_variable(n_variables());
    std::vector<bool> is_part(n_variables());  // of the input of an earlier variable
    for (std::size_t i = 0; i < n_variables(); ++i) {
      is_part[i] = roles_[i] == Role::symbol;
      const bool wraps = roles_[i] == Role::circular;
      of_variable[i] = {wraps ? ObservedKind::circular : ObservedKind::variable, i, 0};
    }
    for (const auto& pair : pairs) {
      of_variable[index(pair[0])] = {ObservedKind::angle, index(pair[0]), index(pair[1])};
      is_part[index(pair[1])] = true;
    }
    for (const auto& symbol : config_.symbols) {
      of_variable[index(symbol[0])] = {ObservedKind::symbol, index(symbol[0]), index(symbol[1])};
      is_part[index(symbol[0])] = false;
    }
    std::vector<ObservedInput> inputs;
    for (std::size_t i = 0; i < n_variables(); ++i) {
      if (!is_part[i]) inputs.push_back(of_variable[i]);
    }
    return inputs;
  }

  /// Replaces ranges and angle pairs, and takes all inputs that follow from them. Throws
  /// std::invalid_argument, and changes nothing, if a range is impossible.
  void set_ranges(const Ranges& ranges, const Pairs& pairs) {
    ObservationScale(ranges.low, ranges.high, {});  // throws before anything changes
    ranges_ = ranges;
    pairs_ = pairs;
    kept_.clear();
    n_first_ = 0;
    set_inputs(inputs_with(pairs));
  }

  /// Replaces the inputs; the last is repeated if the approximator needs more of them.
  void set_inputs(std::vector<ObservedInput> inputs) {
    const std::size_t least = repeats_input_ ? least_inputs_ : 1;
    while (!inputs.empty() && inputs.size() < least) inputs.push_back(inputs.back());
    std::vector<std::size_t> n_bins;
    if (codes_missing()) {
      for (std::size_t k = 0; k < inputs.size(); ++k) {
        const std::size_t of_number = n_bins_[std::min(k, n_bins_.size() - 1)];
        n_bins.push_back(inputs[k].kind == ObservedKind::symbol ? inputs[k].second : of_number);
      }
    }
    scale_.emplace(ranges_.low, ranges_.high, inputs, config_.missing, std::move(n_bins));
    inputs_ = std::move(inputs);
  }

  ObservationConfig config_;
  std::size_t least_inputs_;
  bool repeats_input_ = true;
  std::vector<std::size_t> n_bins_;
  std::vector<Role> roles_;  ///< of each variable, by the configuration
  bool needs_fit_ = false;
  std::optional<RunningRanges> running_;
  Ranges ranges_;
  Pairs pairs_;
  std::vector<ObservedInput> inputs_;
  std::vector<std::int32_t> kept_;  ///< numbers of the inputs that `keep` kept; empty: all
  std::size_t n_first_ = 0;         ///< how many of these its first call kept
  std::optional<ObservationScale> scale_;
};

}  // namespace sdnn::agents

#include "sdnn/agents/detail/fitted_ranges.hpp"
