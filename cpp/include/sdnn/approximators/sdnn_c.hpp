/// SDNN-C: a network that gives Q(s, a) for every action at once.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/approximators/detail/activation_cache.hpp"
#include "sdnn/approximators/detail/weight_average.hpp"
#include "sdnn/approximators/detail/wiring.hpp"
#include "sdnn/approximators/error_correction.hpp"
#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/approximators/output_scale.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {

/// What became of the corrections that a network was asked for.
struct CorrectionCounts {
  std::uint64_t asked = 0;         ///< all of them
  std::uint64_t changed = 0;       ///< units were corrected
  std::uint64_t rounded_away = 0;  ///< another value was wanted, nearer than the next count's
  std::uint64_t out_of_range = 0;  ///< wanted were values outside [q_low, q_high]
};

/// The network of section 3.
///
/// Wiring (code books, permutations) is fixed by config and seed. Reading does not change what is
/// returned, but the network remembers the potentials of recent states and keeps them exact while
/// it learns (see ActivationCache), so that one decision needs at most one pass over the weights.
///
/// With averaging_interval > 0 it also keeps an average of its weights (see WeightAverage), of
/// which averaged_values are the values. Learning uses the weights themselves. Not in the paper.
///
/// An object must not be used by two threads at once; copies share the wiring and nothing else.
class SDNNC {
 public:
  /// Code books by anchor interpolation, or of symbols. Throws std::invalid_argument naming the
  /// field that is impossible; std::length_error naming bytes, max_table_bytes and what to reduce,
  /// before much memory is asked for; std::bad_alloc.
  SDNNC(const SDNNCConfig& config, std::uint64_t seed)
      : SDNNC(config, code_books_of(config, seed), seed) {}

  /// Code books of any coding, a table per input: the range [0, 1] is cut into as many equal bins
  /// as the table has patterns. The config's fields about anchors and symbols do not matter then.
  /// Throws std::invalid_argument if n_inputs or n_pattern_units are not the tables', and as above.
  SDNNC(const SDNNCConfig& config, std::vector<coding::PatternTable> tables, std::uint64_t seed)
      : config_(config),
        code_(wiring_of(config, std::move(tables), seed)),
        actions_(config.n_hidden_units, config.n_active_units, config.n_actions),
        scale_(make_scale(config)),
        hidden_layer_(actions_.n_hidden_units(), code_->n_columns(), code_->n_double_columns()),
        rounding_(seed, core::Stream::rounding),
        memory_(*code_, actions_.n_hidden_units(), actions_.n_active_units()) {
    core::require_positive("learning_coefficient", config.learning_coefficient);
    core::require_in_range("lattice", config.lattice, 1, 64);
    core::require_in_range("averaging_interval", config.averaging_interval, 0, 1000000000);
    if (config.averaging_interval > 0) average_.emplace(hidden_layer_, config.averaging_interval);
    tabulate_values();
    initialize_weights(seed);
    initialize_thresholds();
    bins_.resize(code_->n_inputs());
    moves_.resize(actions_.n_hidden_units() - actions_.n_active_units());
    selected_.reserve(actions_.n_active_units());
  }

  const SDNNCConfig& config() const noexcept { return config_; }
  const coding::StateCode& state_code() const noexcept { return *code_; }
  const coding::ActionCode& action_code() const noexcept { return actions_; }
  const OutputScale& output_scale() const noexcept { return scale_; }
  const HiddenLayer& hidden_layer() const noexcept { return hidden_layer_; }
  const ActivationCache& memory() const noexcept { return memory_; }
  const CorrectionCounts& correction_counts() const noexcept { return counts_; }
  std::size_t n_inputs() const noexcept { return code_->n_inputs(); }
  std::size_t n_actions() const noexcept { return actions_.n_actions(); }

  /// Whether config and this seed give its code books, so that they make it anew: not those of a
  /// network that was given tables. Makes them. Throws as the constructor.
  bool is_wired_by(std::uint64_t seed) const {
    const auto tables = code_books_of(config_, seed);
    for (std::size_t i = 0; i < tables.size(); ++i) {
      if (tables[i] != code_->table(i)) return false;
    }
    return true;
  }

  /// The weight of a hidden unit for a unit of x_SD, in the paper's order, in lattice steps.
  std::int32_t weight(std::size_t unit, std::size_t j) const {
    return weight_at(unit, code_->columns_of(j));
  }

  /// Q(state, a) for every action. Shapes: state (l,) in [0, 1], out (n_actions,).
  ///
  /// Throws std::invalid_argument for a state of wrong size or outside [0, 1].
  void values(std::span<const double> state, std::span<double> out) {
    if (out.size() != n_actions()) {
      core::require(false, "out", std::to_string(n_actions()) + " values", out.size());
    }
    fill_values(recall(state).potentials, out);
  }

  /// As values, by the average of the weights, rounded to steps of the lattice, where there is one.
  /// The first call after the average has changed takes some milliseconds. Throws as values.
  void averaged_values(std::span<const double> state, std::span<double> out) {
    if (!has_average()) return values(state, out);
    if (out.size() != n_actions()) {
      core::require(false, "out", std::to_string(n_actions()) + " values", out.size());
    }
    code_->bins_of(state, bins_);
    Averaged& averaged = up_to_date_average();
    fill_values(averaged.memory.recall(*code_, averaged.layer, bins_).potentials, out);
  }

  /// Whether there has been a snapshot for the average.
  bool has_average() const noexcept { return average_ && average_->n_snapshots() > 0; }

  /// The average of a weight, in the paper's order, and of a threshold, rounded to steps of the
  /// lattice. Requires has_average().
  std::int32_t averaged_weight(std::size_t unit, std::size_t j) const {
    return averaged_weight_at(unit, code_->columns_of(j));
  }
  std::int32_t averaged_threshold(std::size_t unit) const {
    return static_cast<std::int32_t>(rounded(average_->threshold(unit), 0));
  }

  /// Q(state, action). Throws like values, and std::invalid_argument for an action out of range.
  double value(std::span<const double> state, std::size_t action) {
    return scale_(count_in_window(recall(state).potentials, action));
  }

  /// One step of error correction: Q = Q(state, action) moves towards
  /// q_hat = (1 - rate) Q + rate * target.
  ///
  /// Source: Fig. 2, Eqs. (1) to (3); method.md, section 1.8. Throws std::invalid_argument for
  /// a bad state, action or rate or a NaN target, std::overflow_error; then no weight or threshold
  /// has changed and nothing is counted, though a random rounding may have been drawn.
  void update(std::span<const double> state, std::size_t action, double target,
               double rate = 1.0) {
    core::require(!std::isnan(target), "target", "a number", target);
    core::require(rate > 0.0 && rate <= 1.0, "rate", "in (0, 1]", rate);
    correct_weights(state, action, target, rate);
    if (average_) average_->note(counts_.asked, hidden_layer_);
  }

  /// The inner potentials in lattice steps (c / lattice), by a full pass. Shape: out (n,).
  ///
  /// Thread-safe: uses nothing remembered. Allocates.
  void potentials(std::span<const double> state, std::span<std::int32_t> out) const {
    core::require(out.size() == hidden_layer_.n_units(), "out",
                  std::to_string(hidden_layer_.n_units()) + " values", out.size());
    std::vector<coding::Bin> bins(n_inputs());
    code_->bins_of(state, bins);
    std::vector<std::uint64_t> words(2 * code_->n_words());
    code_->encode(bins, words.data(), words.data() + code_->n_words());
    coding::ColumnLists lists = code_->column_lists();
    lists.read({words.data(), words.data() + code_->n_words()});
    hidden_layer_.potentials(lists.columns(), out);
  }

  /// Asks for some states and forgets them, and touches the memory that learning may need: the
  /// first decision then finds everything in the caches, as every later one does. Nothing that is
  /// ever returned changes.
  void warm_caches() {
    constexpr int kStates = 8;  // each reads a third of the weights
    hidden_layer_.touch_memory();
    std::vector<double> out(n_actions());
    for (int i = 0; i < kStates; ++i) {
      values(std::vector<double>(n_inputs(), (i + 0.5) / kStates), out);
    }
    memory_ = ActivationCache(*code_, actions_.n_hidden_units(), actions_.n_active_units());
    if (has_average()) up_to_date_average();
  }

  /// Replaces weights and thresholds, in lattice steps. Shapes: weights (n, D) row by row,
  /// thresholds (n,). Throws std::invalid_argument, and then nothing has changed.
  void set_parameters(std::span<const std::int32_t> weights,
                      std::span<const std::int32_t> thresholds) {
    const std::size_t n_columns = code_->n_columns();
    core::require(weights.size() == hidden_layer_.n_units() * n_columns, "weights",
                  "n_hidden_units x D values", weights.size());
    core::require(thresholds.size() == hidden_layer_.n_units(), "thresholds",
                  "n_hidden_units values", thresholds.size());
    for (const std::int32_t weight : weights) {
      core::require_in_range("weight", weight, -largest_initial_weight(), largest_initial_weight());
    }
    replace_parameters(weights, thresholds);
    if (average_) average_->forget(counts_.asked);
  }

  /// Gives the range of values other ends. What was learned keeps its place in the range, and so
  /// its order. Throws std::invalid_argument naming q_low or q_high, and then nothing has changed.
  void set_output_range(double q_low, double q_high) {
    scale_ = OutputScale(scale_.u_low(), scale_.u_high(), q_low, q_high);
    tabulate_values();
  }

  /// Lists what is remembered; see core/state.hpp.
  template <class Self, class Archive>
  static void exchange(Self& self, Archive& archive) {
    const std::size_t n_units = self.hidden_layer_.n_units();
    const std::size_t n_columns = self.code_->n_columns();
    std::vector<std::int16_t> weights(n_units * n_columns);  // weight_limit() is below 2^15
    std::vector<std::int32_t> thresholds(n_units);
    std::array<double, 2> range{self.scale_.q_low(), self.scale_.q_high()};
    if constexpr (!Archive::kReads) {
      for (std::size_t unit = 0; unit < n_units; ++unit) {
        thresholds[unit] = self.hidden_layer_.threshold(unit);
      }
      for (std::size_t j = 0; j < n_columns; ++j) {
        const auto columns = self.code_->columns_of(j);
        for (std::size_t unit = 0; unit < n_units; ++unit) {
          weights[unit * n_columns + j] = static_cast<std::int16_t>(self.weight_at(unit, columns));
        }
      }
    }
    archive.fixed("weights", {n_units, n_columns}, weights);
    archive.fixed("thresholds", {n_units}, thresholds);
    archive.fixed("output_range", {2}, range);
    archive.part("rounding", self.rounding_);
    archive.number("n_asked", self.counts_.asked);
    archive.number("n_changed", self.counts_.changed);
    archive.number("n_rounded_away", self.counts_.rounded_away);
    archive.number("n_out_of_range", self.counts_.out_of_range);
    if (self.average_) archive.part("average", *self.average_);
    if constexpr (Archive::kReads) {
      archive.taking("output_range", [&] { self.set_output_range(range[0], range[1]); });
      for (const std::int32_t threshold : thresholds) {
        archive.expect(HiddenLayer::is_threshold(threshold), "thresholds", "of less than 2^30");
      }
      archive.taking("weights", [&] {
        self.replace_parameters(std::vector<std::int32_t>(weights.begin(), weights.end()),
                                thresholds);
      });
      self.selected_.reserve(self.actions_.n_active_units());  // a copy has no room
      self.averaged_.reset();
    }
  }

 private:
  using Remembered = ActivationCache::Entry;

  static OutputScale make_scale(const SDNNCConfig& config) {
    const int u_low = config.u_low.value_or(config.n_active_units / 15);
    core::require_in_range("u_low", u_low, 0, config.n_active_units);
    const int u_high = config.u_high.value_or(config.n_active_units - u_low);
    core::require_in_range("u_high", u_high, 0, config.n_active_units);
    return {u_low, u_high, config.q_low, config.q_high};
  }

  void tabulate_values() {
    value_of_count_.resize(actions_.n_active_units() + 1);
    for (std::size_t u = 0; u < value_of_count_.size(); ++u) {
      value_of_count_[u] = scale_(static_cast<int>(u));
    }
  }

  /// Shapes: weights (n, D), in the paper's order, thresholds (n,). Throws std::invalid_argument
  /// for a weight or threshold out of range, and then nothing has changed.
  void replace_parameters(std::span<const std::int32_t> weights,
                          std::span<const std::int32_t> thresholds) {
    const std::size_t n_columns = code_->n_columns();
    HiddenLayer replaced = layer_with(
        [&](std::size_t unit, const auto&, std::size_t j) { return weights[unit * n_columns + j]; },
        [&](std::size_t unit) { return thresholds[unit]; });
    hidden_layer_ = std::move(replaced);
    memory_.forget();
  }

  /// A hidden layer with the weights weight(unit, columns, j) and the thresholds threshold(unit).
  template <class Weight, class Threshold>
  HiddenLayer layer_with(const Weight& weight, const Threshold& threshold) const {
    HiddenLayer layer(actions_.n_hidden_units(), code_->n_columns(), code_->n_double_columns());
    for (std::size_t j = 0; j < code_->n_columns(); ++j) {
      core::interruption_point();
      const auto columns = code_->columns_of(j);
      for (std::size_t unit = 0; unit < layer.n_units(); ++unit) {
        add_weight(layer, unit, columns, weight(unit, columns, j));
      }
    }
    for (std::size_t unit = 0; unit < layer.n_units(); ++unit) {
      layer.set_threshold(unit, threshold(unit));
    }
    return layer;
  }

  /// Q of every action, where these are the potentials.
  void fill_values(std::span<const std::int32_t> h, std::span<double> out) {
    const std::int32_t* const leaving = h.data();
    const std::int32_t* const entering = h.data() + actions_.n_active_units();
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      moves_[i] = static_cast<std::int8_t>((entering[i] > 0) - (leaving[i] > 0));
    }
    const double* const value = value_of_count_.data();
    std::ptrdiff_t n_firing = count_in_window(h, 0);
    out[0] = value[n_firing];
    if (out.size() == moves_.size() + 1) {  // every window: the usual case, in a tight loop
      for (std::size_t i = 0; i < moves_.size(); ++i) out[i + 1] = value[n_firing += moves_[i]];
      return;
    }
    for (std::size_t action = 1; action < out.size(); ++action) {
      for (std::size_t i = actions_.first_unit(action - 1); i < actions_.first_unit(action); ++i) {
        n_firing += moves_[i];
      }
      out[action] = value[n_firing];
    }
  }

  /// A hidden layer with the average of the weights.
  struct Averaged {
    HiddenLayer layer;
    ActivationCache memory;
    std::uint64_t n_snapshots;
  };

  Averaged& up_to_date_average() {
    if (!averaged_) {
      averaged_.emplace(Averaged{
          HiddenLayer(1, 1),
          ActivationCache(*code_, actions_.n_hidden_units(), actions_.n_active_units()), 0});
    }
    if (averaged_->n_snapshots != average_->n_snapshots()) {
      averaged_->layer =
          layer_with([this](std::size_t unit, const auto& columns,
                            std::size_t) { return averaged_weight_at(unit, columns); },
                     [this](std::size_t unit) { return averaged_threshold(unit); });
      averaged_->memory.forget();
      averaged_->n_snapshots = average_->n_snapshots();
    }
    return *averaged_;
  }

  /// value / 2^(kFractionBits + more), halves up.
  static std::int64_t rounded(std::int64_t value, int more) noexcept {
    const int bits = WeightAverage::kFractionBits + more;
    return (value + (std::int64_t{1} << (bits - 1))) >> bits;
  }

  std::int32_t averaged_weight_at(std::size_t unit,
                                  const coding::StateCode::PairedColumns& columns) const noexcept {
    std::int64_t weight = average_->weight(unit, columns.first);
    if (columns.paired)
      weight += columns.sign * std::int64_t{average_->weight(unit, columns.second)};
    const std::int64_t limit = largest_initial_weight();  // no sum of two leaves the layer's range
    return static_cast<std::int32_t>(
        std::clamp(rounded(weight, columns.paired ? 1 : 0), -limit, limit));
  }

  std::int32_t weight_at(std::size_t unit,
                         const coding::StateCode::PairedColumns& columns) const noexcept {
    const std::int32_t first = hidden_layer_.weight(unit, columns.first);
    return columns.paired ? (first + columns.sign * hidden_layer_.weight(unit, columns.second)) / 2
                          : first;
  }

  /// Two weights make a sum that has to fit.
  std::int32_t largest_initial_weight() const noexcept { return hidden_layer_.weight_limit() / 2; }

  /// Adds to the weight of a unit of x_SD, where the paired code keeps it.
  static void add_weight(HiddenLayer& hidden_layer, std::size_t unit,
                         const coding::StateCode::PairedColumns& columns, std::int32_t weight) {
    const auto add = [&](std::size_t column, std::int32_t change) {
      hidden_layer.set_weight(unit, column, hidden_layer.weight(unit, column) + change);
    };
    add(columns.first, weight);
    if (columns.paired) add(columns.second, columns.sign * weight);
  }

  void initialize_weights(std::uint64_t seed) {
    core::require(std::isfinite(config_.initial_weight_limit) && config_.initial_weight_limit >= 0,
                  "initial_weight_limit", "finite and not negative", config_.initial_weight_limit);
    const double limit = config_.initial_weight_limit * config_.lattice;
    core::require(limit <= largest_initial_weight(), "initial_weight_limit",
                  "at most " + std::to_string(largest_initial_weight()) + " / lattice",
                  config_.initial_weight_limit);
    core::Random random(seed, core::Stream::weights);
    std::vector<std::int32_t> drawn(hidden_layer_.n_units());
    for (std::size_t j = 0; j < code_->n_columns(); ++j) {
      core::interruption_point();
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < drawn.size(); ++i) {
        if (config_.initial_weights == InitialWeights::ternary) {
          if (i % 32 == 0) bits = random.bits();  // two bits a weight
          drawn[i] = static_cast<std::int32_t>(bits & 1) - static_cast<std::int32_t>(bits >> 1 & 1);
          bits >>= 2;
        } else {
          const double weight = limit * (2.0 * random.uniform() - 1.0);
          drawn[i] = static_cast<std::int32_t>(std::floor(weight + 0.5));
        }
      }
      const auto columns = code_->columns_of(j);
      hidden_layer_.add_to_column(columns.first, drawn, 1);
      if (columns.paired) hidden_layer_.add_to_column(columns.second, drawn, columns.sign);
    }
  }

  /// Units are numbered from 1 in the paper: the first one is odd and starts active.
  void initialize_thresholds() {
    const double steps = config_.initial_threshold * config_.lattice;
    core::require(steps >= 0 && steps < (1 << 30) && std::floor(steps) == steps,
                  "initial_threshold", "a multiple of 1 / lattice, not negative",
                  config_.initial_threshold);
    const auto threshold = static_cast<std::int32_t>(steps);
    for (std::size_t i = 0; i < hidden_layer_.n_units(); ++i) {
      hidden_layer_.set_threshold(i, i % 2 == 0 ? -threshold : threshold);
    }
  }

  /// Corrects, after the arguments have been looked at.
  void correct_weights(std::span<const double> state, std::size_t action, double target,
                       double rate) {
    const Remembered entry = recall(state);
    const int n_firing = count_in_window(entry.potentials, action);
    const double wanted = (1.0 - rate) * scale_(n_firing) + rate * target;
    const int deficit = rounded_count(wanted, n_firing) - n_firing;
    const bool changes = deficit != 0 && move_count(entry, action, deficit);
    ++counts_.asked;
    if (wanted < scale_.q_low() || wanted > scale_.q_high()) ++counts_.out_of_range;
    if (deficit == 0 && wanted != scale_(n_firing)) ++counts_.rounded_away;
    if (changes) ++counts_.changed;
  }

  /// Lets `deficit` units more of the action's window fire, or fewer if it is negative, as far as
  /// there are any; returns whether there are.
  bool move_count(const Remembered& entry, std::size_t action, int deficit) {
    const std::size_t first = actions_.first_unit(action);
    select_units(std::span(entry.potentials).subspan(first, actions_.n_active_units()), deficit,
                 selected_);
    if (selected_.empty()) return false;
    for (std::uint32_t& unit : selected_) unit += static_cast<std::uint32_t>(first);

    const std::int32_t step = deficit > 0 ? config_.lattice : -config_.lattice;
    hidden_layer_.update(selected_, memory_.columns(*code_, entry.bins), step);
    memory_.corrected(entry.bins, selected_, step);
    return true;
  }

  Remembered recall(std::span<const double> state) {
    code_->bins_of(state, bins_);
    return memory_.recall(*code_, hidden_layer_, bins_);
  }

  /// How many units are to fire for the value `wanted`, where `n_firing` do.
  int rounded_count(double wanted, int n_firing) {
    if (config_.rounding == Rounding::half_up) return scale_.inverse(wanted);
    const double exact = scale_.exact_inverse(wanted);
    if (config_.rounding == Rounding::random) {
      return static_cast<int>(std::floor(exact + rounding_.uniform()));
    }
    constexpr double kNothing = 1e-9;  // what rounding errors may leave of no change
    return static_cast<int>(exact > n_firing ? std::ceil(exact - kNothing)
                                             : std::floor(exact + kNothing));
  }

  int count_in_window(std::span<const std::int32_t> potentials, std::size_t action) const {
    if (action >= n_actions()) {
      core::require(false, "action", "less than " + std::to_string(n_actions()), action);
    }
    const std::size_t first = actions_.first_unit(action);
    int n_firing = 0;
    for (std::size_t i = first; i < first + actions_.n_active_units(); ++i) {
      n_firing += potentials[i] > 0;
    }
    return n_firing;
  }

  SDNNCConfig config_;
  std::shared_ptr<const coding::StateCode> code_;
  coding::ActionCode actions_;
  OutputScale scale_;
  HiddenLayer hidden_layer_;
  std::optional<WeightAverage> average_;
  std::optional<Averaged> averaged_;  ///< made when it is asked for
  core::Random rounding_;
  std::vector<double> value_of_count_;
  CorrectionCounts counts_;

  // Workspace: sized once, so that a step allocates nothing.
  ActivationCache memory_;
  std::vector<coding::Bin> bins_;
  std::vector<std::int8_t> moves_;  ///< what the count changes by as the window moves on a unit
  std::vector<std::uint32_t> selected_;
};

}  // namespace sdnn::approximators
