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
#include "sdnn/approximators/detail/paired_weights.hpp"
#include "sdnn/approximators/detail/sdnn_c_room.hpp"
#include "sdnn/approximators/detail/state_wiring.hpp"
#include "sdnn/approximators/detail/weight_average.hpp"
#include "sdnn/approximators/detail/window_counts.hpp"
#include "sdnn/approximators/error_correction.hpp"
#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/approximators/output_scale.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/threads.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {

/// Counts of the calls of a network's update, by their outcomes.
struct CorrectionCounts {
  std::uint64_t asked = 0;         ///< all calls
  std::uint64_t changed = 0;       ///< calls that corrected units
  std::uint64_t rounded_away = 0;  ///< calls whose change of the value was rounded to no unit
  std::uint64_t out_of_range = 0;  ///< calls whose new value would be outside [q_low, q_high]
  double mean_error = 0.0;         ///< mean |clipped target - Q| of about the last 1000
};

/// The network SDNN-C of the paper's section 3, a model for any number of users.
///
/// Wiring (code books, permutations) is fixed by config and seed and shared by copies. Each user
/// reads the network through a separate Workspace, which caches the potentials of recent states and
/// keeps them exact while the network learns (see ActivationCache), so that a decision needs at
/// most one pass over the weights. It affects the time of a call, but not its result. Many threads
/// may call const functions at once, with a workspace each.
///
/// With averaging_interval > 0 it also keeps an average of its weights (see WeightAverage), used by
/// averaged_values. Learning uses the weights themselves. The average is not in the paper.
class SDNNC {
 public:
  /// The workspace of a user who reads or trains a network: the potentials of recent states, and
  /// buffers. It serves the network that made it and all copies of it, at any time; an assertion
  /// checks the sizes. Its own size is fixed, so that a step allocates nothing.
  class Workspace {
   public:
    const ActivationCache& cache() const noexcept { return cache_; }
    /// The counts of the state that was evaluated last.
    const WindowCounts& counts() const noexcept { return counts_; }
    WindowCounts& counts() noexcept { return counts_; }

   private:
    friend class SDNNC;

    /// Makes the memory of one reader of the network.
    explicit Workspace(const SDNNC& network)
        : cache_(network.state_code(), network.actions_.n_hidden_units()),
          bins_(network.n_inputs()),
          counts_(network.actions_) {
      selected_.reserve(network.actions_.n_active_units());
    }

    /// The cache of the averaged network, which is made when it is first used.
    ActivationCache& averaged_cache(const SDNNC& network) {
      if (!averaged_cache_) {
        averaged_cache_.emplace(network.state_code(), network.actions_.n_hidden_units());
      }
      return *averaged_cache_;
    }

    ActivationCache cache_;
    std::optional<ActivationCache> averaged_cache_;  ///< made on demand
    std::vector<coding::Bin> bins_;
    WindowCounts counts_;
    std::vector<std::uint32_t> selected_;
  };

  /// Makes code books by anchor interpolation, or of symbols. Throws std::invalid_argument naming
  /// the impossible field; std::length_error naming bytes, max_table_bytes and the fields to
  /// reduce, before a large allocation; std::bad_alloc.
  SDNNC(const SDNNCConfig& config, std::uint64_t seed)
      : SDNNC(config, code_books_of(config, seed), seed) {}

  /// Takes code books of any coding, a table per input: the range [0, 1] is divided into equal
  /// bins, one for each pattern of the table. The config's fields about anchors and symbols are
  /// ignored. Throws std::invalid_argument naming an impossible field, or if n_inputs or
  /// n_pattern_units do not fit the tables; std::length_error beyond max_table_bytes.
  SDNNC(const SDNNCConfig& config, std::vector<coding::PatternTable> tables, std::uint64_t seed)
      : config_(config),
        code_(wiring_of(config, std::move(tables), seed)),
        actions_(config.n_hidden_units, config.n_active_units, config.n_actions),
        scale_(make_scale(config)),
        hidden_layer_(paired_layer(*code_, actions_.n_hidden_units())),
        log_(code_->n_inputs(), actions_.n_active_units()),
        rounding_(seed, core::Stream::rounding) {
    if (config.averaging_interval > 0) average_.emplace(hidden_layer_, config.averaging_interval);
    tabulate_values();
    add_initial_weights(hidden_layer_, *code_, config, seed);
    set_initial_thresholds(hidden_layer_, config);
  }

  Workspace workspace() const { return Workspace(*this); }

  const SDNNCConfig& config() const noexcept { return config_; }
  const coding::StateCode& state_code() const noexcept { return *code_; }
  const coding::ActionCode& action_code() const noexcept { return actions_; }
  const OutputScale& output_scale() const noexcept { return scale_; }
  const HiddenLayer& hidden_layer() const noexcept { return hidden_layer_; }
  const CorrectionCounts& correction_counts() const noexcept { return counts_; }
  /// A number that no other network has, and that changes when weights are replaced.
  std::uint64_t identity() const noexcept { return log_.identity(); }
  std::size_t n_inputs() const noexcept { return code_->n_inputs(); }
  std::size_t n_actions() const noexcept { return actions_.n_actions(); }

  /// The weight of a hidden unit for a unit of x_SD, in the paper's order, in lattice steps.
  std::int32_t weight(std::size_t unit, std::size_t j) const {
    return paired_weight(hidden_layer_, unit, code_->columns_of(j));
  }

  /// Writes Q(state, a) for every action. Shapes: state (l,) in [0, 1], out (n_actions,).
  ///
  /// Throws std::invalid_argument for a state of wrong size or outside [0, 1].
  void values(std::span<const double> state, Workspace& workspace, std::span<double> out) const {
    fill_values(state, workspace, out, false);
  }

  /// Writes the values by the average of the weights, rounded to steps of the lattice, if there is
  /// an average. The first call after a change of the average takes some milliseconds. Throws
  /// std::invalid_argument for a state of wrong size or outside [0, 1].
  void averaged_values(std::span<const double> state, Workspace& workspace,
                       std::span<double> out) const {
    fill_values(state, workspace, out, true);
  }

  /// Counts the firing units in the window of every action. workspace.counts() then has the counts,
  /// and value_of_count gives their values. `averaged` selects the average of the weights, as in
  /// averaged_values. Throws std::invalid_argument for a state of wrong size or outside [0, 1].
  void count(std::span<const double> state, Workspace& workspace, bool averaged) const {
    assert(fits(workspace));
    code_->bins_of(state, workspace.bins_);
    if (averaged && has_average()) {
      const auto layer = averaged_layer();
      ActivationCache& cache = workspace.averaged_cache(*this);
      const Cached entry = cache.recall(*code_, layer->layer, layer->log, workspace.bins_);
      return workspace.counts_.count(entry.potentials, actions_);
    }
    const Cached entry = workspace.cache_.recall(*code_, hidden_layer_, log_, workspace.bins_);
    workspace.counts_.count(entry.potentials, actions_);
  }
  double value_of_count(std::int32_t count) const noexcept {
    return value_of_count_[static_cast<std::size_t>(count)];
  }
  /// Whether no value is below that of a smaller count, which is true unless rounding errors exceed
  /// the step of a unit.
  bool values_rise() const noexcept { return values_rise_; }

  /// Whether the average has a snapshot.
  bool has_average() const noexcept { return average_ && average_->n_snapshots() > 0; }

  /// The average of a weight, in the paper's order, and of a threshold, rounded to steps of the
  /// lattice. Requires has_average().
  std::int32_t averaged_weight(std::size_t unit, std::size_t j) const {
    return approximators::averaged_weight(*average_, unit, code_->columns_of(j),
                                          largest_paired_weight(hidden_layer_));
  }
  std::int32_t averaged_threshold(std::size_t unit) const {
    return approximators::averaged_threshold(*average_, unit);
  }

  /// Q(state, action). Throws std::invalid_argument for a bad state or action.
  double value(std::span<const double> state, Workspace& workspace, std::size_t action) const {
    return scale_(count_in_window(recall(state, workspace).potentials, action));
  }

  /// Corrects the error once: Q = Q(state, action) moves towards q_hat = (1 - rate) Q + rate *
  /// target.
  ///
  /// Source: Fig. 2, Eqs. (1) to (3); method.md, section 1.8. Throws std::invalid_argument for a
  /// bad state, action or rate or a NaN target, std::overflow_error; then no weight or threshold
  /// has changed and nothing is counted, but a random number for rounding may have been drawn.
  void update(std::span<const double> state, Workspace& workspace, std::size_t action,
              double target, double rate = 1.0) {
    core::require(!std::isnan(target), "target", "a number", target);
    core::require(rate > 0.0 && rate <= 1.0, "rate", "in (0, 1]", rate);
    correct(state, workspace, action, target, rate);
    if (average_ && average_->note(counts_.asked, hidden_layer_)) averaged_.reset();
  }

  /// Writes the inner potentials in lattice steps (c / lattice), by a full pass without a
  /// workspace. Shape: out (n,). Allocates.
  void potentials(std::span<const double> state, std::span<std::int32_t> out) const {
    core::require_size("out", out.size(), hidden_layer_.n_units());
    std::vector<coding::Bin> bins(n_inputs());
    code_->bins_of(state, bins);
    std::vector<std::uint64_t> words(2 * code_->n_words());
    code_->encode(bins, words.data(), words.data() + code_->n_words());
    coding::ColumnLists lists = code_->column_lists();
    lists.read({words.data(), words.data() + code_->n_words()});
    hidden_layer_.potentials(lists.columns(), out);
  }

  /// Evaluates and discards some states, and touches the memory that learning may need, so that the
  /// first decision is as fast as later ones. It changes no result.
  void warm_caches(Workspace& workspace) {
    constexpr int kStates = 8;  // each reads a third of the weights, so that all are read
    hidden_layer_.touch_memory();
    std::vector<double> out(n_actions());
    for (int i = 0; i < kStates; ++i) {
      values(std::vector<double>(n_inputs(), (i + 0.5) / kStates), workspace, out);
    }
    workspace = this->workspace();
    if (has_average()) averaged_layer();
  }

  /// Replaces weights and thresholds, in lattice steps. Shapes: weights (n, D) row by row,
  /// thresholds (n,). Throws std::invalid_argument; then nothing has changed.
  void set_parameters(std::span<const std::int32_t> weights,
                      std::span<const std::int32_t> thresholds) {
    const std::size_t n_columns = code_->n_columns();
    core::require(weights.size() == hidden_layer_.n_units() * n_columns, "weights",
                  "n_hidden_units x D values", weights.size());
    core::require(thresholds.size() == hidden_layer_.n_units(), "thresholds",
                  "n_hidden_units values", thresholds.size());
    for (const std::int32_t weight : weights) {
      core::require_in_range("weight", weight, -largest_paired_weight(hidden_layer_),
                             largest_paired_weight(hidden_layer_));
    }
    replace_parameters(weights, thresholds);
    if (average_) average_->forget(counts_.asked);
    averaged_.reset();
  }

  /// Changes the range of values. Learned values keep their relative positions in the range, and
  /// thus their order. Throws std::invalid_argument naming q_low or q_high; then nothing has
  /// changed.
  void set_output_range(double q_low, double q_high) {
    scale_ = OutputScale(scale_.u_low(), scale_.u_high(), q_low, q_high);
    tabulate_values();
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
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
        const PairedColumns columns = self.code_->columns_of(j);
        for (std::size_t unit = 0; unit < n_units; ++unit) {
          weights[unit * n_columns + j] =
              static_cast<std::int16_t>(paired_weight(self.hidden_layer_, unit, columns));
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
    archive.number("mean_error", self.counts_.mean_error);
    if (self.average_) archive.part("average", *self.average_);
    if constexpr (Archive::kReads) {
      const bool is_mean = self.counts_.mean_error >= 0.0 && self.counts_.mean_error <= 1e302;
      archive.expect(is_mean, "mean_error", "finite and at least 0");
      archive.naming("output_range", [&] { self.set_output_range(range[0], range[1]); });
      for (const std::int32_t threshold : thresholds) {
        archive.expect(HiddenLayer::is_threshold(threshold), "thresholds", "of less than 2^30");
      }
      archive.naming("weights", [&] { self.replace_parameters(std::span(weights), thresholds); });
      self.averaged_.reset();
    }
  }

 private:
  using Cached = ActivationCache::Entry;

  static constexpr std::uint64_t kMostErrors = 1000;  // from here on the mean is exponential

  /// Makes the scale between numbers of firing units and values. By default, as in the paper, it is
  /// constant over the lowest and the highest fifteenth of the numbers.
  static OutputScale make_scale(const SDNNCConfig& config) {
    const int u_low = config.u_low.value_or(config.n_active_units / 15);
    core::require_in_range("u_low", u_low, 0, config.n_active_units);
    const int u_high = config.u_high.value_or(config.n_active_units - u_low);
    core::require_in_range("u_high", u_high, 0, config.n_active_units);
    return {u_low, u_high, config.q_low, config.q_high};
  }

  /// Tabulates the value of each number of firing units.
  void tabulate_values() {
    value_of_count_.resize(actions_.n_active_units() + 1);
    for (std::size_t u = 0; u < value_of_count_.size(); ++u) {
      value_of_count_[u] = scale_(static_cast<int>(u));
    }
    values_rise_ = std::ranges::is_sorted(value_of_count_);
  }

  /// Replaces weights and thresholds by those given for x_SD, the code before pairing. Shapes:
  /// weights (n, D), in the paper's order, thresholds (n,). Throws std::invalid_argument for a
  /// weight or threshold out of range; then nothing has changed.
  template <class Weight>
  void replace_parameters(std::span<Weight> weights, std::span<const std::int32_t> thresholds) {
    const std::size_t n_columns = code_->n_columns();
    hidden_layer_ = paired_layer(
        *code_, actions_.n_hidden_units(),
        [&](std::size_t unit, const PairedColumns&, std::size_t j) {
          return weights[unit * n_columns + j];
        },
        [&](std::size_t unit) { return thresholds[unit]; });
    log_.restart();
  }

  /// Whether the workspace fits a network of these sizes.
  bool fits(const Workspace& workspace) const noexcept {
    return workspace.bins_.size() == n_inputs() &&
           workspace.cache_.n_units() == actions_.n_hidden_units() &&
           workspace.counts_.of_actions().size() == n_actions();
  }

  /// Writes the values of all actions, of the averaged or of the present weights.
  void fill_values(std::span<const double> state, Workspace& workspace, std::span<double> out,
                   bool averaged) const {
    core::require_size("out", out.size(), n_actions());
    count(state, workspace, averaged);
    std::ranges::transform(workspace.counts_.of_actions(), out.begin(),
                           [this](std::int32_t count) { return value_of_count(count); });
  }

  /// Returns the hidden layer with the averaged weights. It is computed when it is first needed
  /// after a correction.
  std::shared_ptr<const AveragedLayer> averaged_layer() const {
    return averaged_.get([this] {
      return AveragedLayer(*average_, *code_, actions_.n_hidden_units(),
                           largest_paired_weight(hidden_layer_));
    });
  }

  /// Makes units fire or stop firing, so that Q(state, action) moves towards the target, and counts
  /// the outcome. The arguments have been checked.
  void correct(std::span<const double> state, Workspace& workspace, std::size_t action,
               double target, double rate) {
    const Cached entry = recall(state, workspace);
    const int n_firing = count_in_window(entry.potentials, action);
    const double new_value = (1.0 - rate) * scale_(n_firing) + rate * target;
    const int deficit = rounded_count(new_value, n_firing) - n_firing;
    const bool changes = deficit != 0 && move_count(entry, workspace, action, deficit);
    ++counts_.asked;
    if (new_value < scale_.q_low() || new_value > scale_.q_high()) ++counts_.out_of_range;
    if (deficit == 0 && new_value != scale_(n_firing)) ++counts_.rounded_away;
    if (changes) ++counts_.changed;
    const double error =
        std::abs(std::clamp(target, scale_.q_low(), scale_.q_high()) - scale_(n_firing));
    const auto n_counted =
        static_cast<double>(std::clamp<std::uint64_t>(counts_.asked, 1, kMostErrors));
    counts_.mean_error += (error - counts_.mean_error) / n_counted;
  }

  /// Corrects units so that `deficit` more units of the action's window fire, or -deficit fewer if
  /// it is negative, as far as there are units to correct. Returns whether any unit was corrected.
  bool move_count(const Cached& entry, Workspace& workspace, std::size_t action, int deficit) {
    const std::size_t first = actions_.first_unit(action);
    std::vector<std::uint32_t>& selected = workspace.selected_;
    select_units(std::span(entry.potentials).subspan(first, actions_.n_active_units()), deficit,
                 selected);
    if (selected.empty()) return false;
    for (std::uint32_t& unit : selected) unit += static_cast<std::uint32_t>(first);

    const std::int32_t step = deficit > 0 ? config_.lattice : -config_.lattice;
    const coding::SignedColumns columns = workspace.cache_.columns(*code_, entry.bins);
    if (config_.weight_limit > 0) {
      std::erase_if(selected, [&](std::uint32_t unit) {
        return !hidden_layer_.has_room(unit, columns, step, config_.weight_limit);
      });
      if (selected.empty()) return false;
    }
    hidden_layer_.update(selected, columns, step);
    log_.add({entry.bins, selected, step});
    return true;
  }

  /// Returns the potentials of a state with the present weights, from the cache if possible.
  Cached recall(std::span<const double> state, Workspace& workspace) const {
    assert(fits(workspace));
    code_->bins_of(state, workspace.bins_);
    return workspace.cache_.recall(*code_, hidden_layer_, log_, workspace.bins_);
  }

  /// Returns the number of units that should fire for `new_value`; `n_firing` fire now.
  int rounded_count(double new_value, int n_firing) {
    if (config_.rounding == Rounding::half_up) return scale_.inverse(new_value);
    const double exact = scale_.exact_inverse(new_value);
    if (config_.rounding == Rounding::random) {
      return static_cast<int>(std::floor(exact + rounding_.uniform()));
    }
    constexpr double kNothing = 1e-9;  // largest error of exact_inverse for an unchanged value
    return static_cast<int>(exact > n_firing ? std::ceil(exact - kNothing)
                                             : std::floor(exact + kNothing));
  }

  /// Counts the firing units in an action's window. Throws std::invalid_argument for a bad action.
  int count_in_window(std::span<const std::int32_t> potentials, std::size_t action) const {
    core::require_below("action", action, n_actions());
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
  CorrectionLog log_;
  std::optional<WeightAverage> average_;
  core::OnDemand<AveragedLayer> averaged_;
  core::Random rounding_;
  std::vector<double> value_of_count_;
  bool values_rise_;
  CorrectionCounts counts_;
};

}  // namespace sdnn::approximators
