/// SDNN-C: a network that gives Q(s, a) for every action at once.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/approximators/detail/potential_memory.hpp"
#include "sdnn/approximators/error_correction.hpp"
#include "sdnn/approximators/hidden_layer.hpp"
#include "sdnn/approximators/output_scale.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/desensitization.hpp"
#include "sdnn/coding/pattern_code.hpp"
#include "sdnn/coding/state_code.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {

/// How the weights start (spec section 1, "Start").
enum class InitialWeights {
  ternary,  ///< -1, 0 or +1 lattice steps with probabilities 1/4, 1/2, 1/4
  uniform,  ///< uniform within +- initial_weight_limit, rounded to the lattice
};

/// Everything that defines an SDNN-C; the defaults are the paper's values.
struct SDNNCConfig {
  int n_inputs = 4;                 ///< l >= 2
  int n_pattern_units = 200;        ///< m
  int n_anchor_patterns = 9;        ///< p_1 .. p_9
  int n_interpolated = 44;          ///< patterns between neighbouring anchors
  bool balanced_anchors = true;     ///< reading: anchors have as many +1 as -1
  std::vector<bool> circular = {};  ///< per input; empty: none (reading: p_9 independent of p_1)
  int n_hidden_units = 900;         ///< n
  int n_active_units = 300;         ///< n', units in an action's window
  int n_actions = 0;                ///< 0: all n - n' + 1 windows
  double q_low = -20.0;             ///< g saturates at these values ...
  double q_high = 20.0;
  std::optional<int> u_low = {};      ///< ... at these counts; none: n' / 15 rounded down (20),
  std::optional<int> u_high = {};     ///< and n' - u_low (280)
  double learning_coefficient = 0.1;  ///< c; scales weights only, never decisions
  int lattice = 1;                    ///< weights are multiples of c / lattice
  double initial_threshold = 200.0;   ///< |w_i0| at the start, in units of c
  InitialWeights initial_weights = InitialWeights::ternary;
  double initial_weight_limit = 0.1;  ///< of InitialWeights::uniform, in units of c

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("n_inputs", &SDNNCConfig::n_inputs),
        core::field("n_pattern_units", &SDNNCConfig::n_pattern_units),
        core::field("n_anchor_patterns", &SDNNCConfig::n_anchor_patterns),
        core::field("n_interpolated", &SDNNCConfig::n_interpolated),
        core::field("balanced_anchors", &SDNNCConfig::balanced_anchors),
        core::field("circular", &SDNNCConfig::circular),
        core::field("n_hidden_units", &SDNNCConfig::n_hidden_units),
        core::field("n_active_units", &SDNNCConfig::n_active_units),
        core::field("n_actions", &SDNNCConfig::n_actions),
        core::field("q_low", &SDNNCConfig::q_low), core::field("q_high", &SDNNCConfig::q_high),
        core::field("u_low", &SDNNCConfig::u_low), core::field("u_high", &SDNNCConfig::u_high),
        core::field("learning_coefficient", &SDNNCConfig::learning_coefficient),
        core::field("lattice", &SDNNCConfig::lattice),
        core::field("initial_threshold", &SDNNCConfig::initial_threshold),
        core::field("initial_weights", &SDNNCConfig::initial_weights),
        core::field("initial_weight_limit", &SDNNCConfig::initial_weight_limit));
  }
  bool operator==(const SDNNCConfig&) const = default;
};

/// The network of section 3 with patterns of at most `Capacity` units.
///
/// Wiring (code books, permutations) is fixed by config and seed. Reading does not change what is
/// returned, but the network remembers the potentials of recent states and keeps them exact while
/// it learns (see PotentialMemory), so that one decision needs at most one pass over the weights.
/// An object must not be used by two threads at once; copies share the wiring and nothing else.
template <std::size_t Capacity>
class SDNNC {
 public:
  /// Throws std::invalid_argument naming the field that is impossible; std::length_error if a
  /// pattern does not fit into Capacity; std::bad_alloc.
  SDNNC(const SDNNCConfig& config, std::uint64_t seed)
      : config_(config),
        code_(make_code(config, seed)),
        actions_(config.n_hidden_units, config.n_active_units, config.n_actions),
        scale_(make_scale(config)),
        hidden_layer_(actions_.n_hidden_units(), code_->n_columns(), code_->n_double_columns()),
        memory_(*code_, actions_.n_hidden_units(), actions_.n_active_units()) {
    core::require_positive("learning_coefficient", config.learning_coefficient);
    core::require_in_range("lattice", config.lattice, 1, 64);
    value_of_count_.resize(actions_.n_active_units() + 1);
    for (std::size_t u = 0; u < value_of_count_.size(); ++u) {
      value_of_count_[u] = scale_(static_cast<int>(u));
    }
    initialize_weights(seed);
    initialize_thresholds();
    bins_.resize(code_->n_inputs());
    moves_.resize(actions_.n_hidden_units() - actions_.n_active_units());
    selected_.reserve(actions_.n_active_units());
    rehearse();
  }

  const SDNNCConfig& config() const noexcept { return config_; }
  const coding::StateCode<Capacity>& state_code() const noexcept { return *code_; }
  const coding::ActionCode& action_code() const noexcept { return actions_; }
  const OutputScale& output_scale() const noexcept { return scale_; }
  const HiddenLayer& hidden_layer() const noexcept { return hidden_layer_; }
  const PotentialMemory<Capacity>& memory() const noexcept { return memory_; }
  std::size_t n_inputs() const noexcept { return code_->n_inputs(); }
  std::size_t n_actions() const noexcept { return actions_.n_actions(); }

  /// The weight of a hidden unit for a unit of x_SD, in the paper's order, in lattice steps.
  std::int32_t weight(std::size_t unit, std::size_t j) const {
    const auto place = code_->place(j);
    const std::int32_t first = hidden_layer_.weight(unit, place.first);
    return place.paired ? (first + place.sign * hidden_layer_.weight(unit, place.second)) / 2
                        : first;
  }

  /// Q(state, a) for every action. Shapes: state (l,) in [0, 1], out (n_actions,).
  ///
  /// Throws std::invalid_argument for a state of wrong size or outside [0, 1].
  void values(std::span<const double> state, std::span<double> out) {
    if (out.size() != n_actions()) {
      core::require(false, "out", std::to_string(n_actions()) + " values", out.size());
    }
    const std::span<const std::int32_t> h = recall(state).potentials;
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

  /// Q(state, action). Throws like values, and std::invalid_argument for an action out of range.
  double value(std::span<const double> state, std::size_t action) {
    return scale_(count_in_window(recall(state).potentials, action));
  }

  /// One step of error correction: Q = Q(state, action) moves towards
  /// q_hat = (1 - rate) Q + rate * target.
  ///
  /// Source: Fig. 2, Eqs. (1) to (3); spec section 1, "Learning". Throws std::invalid_argument for
  /// a bad state, action or rate or a NaN target, std::overflow_error; then nothing has changed.
  void correct(std::span<const double> state, std::size_t action, double target,
               double rate = 1.0) {
    core::require(!std::isnan(target), "target", "a number", target);
    core::require(rate > 0.0 && rate <= 1.0, "rate", "in (0, 1]", rate);
    const Remembered entry = recall(state);
    const int n_firing = count_in_window(entry.potentials, action);
    const double wanted = (1.0 - rate) * scale_(n_firing) + rate * target;
    const int deficit = scale_.inverse(wanted) - n_firing;
    if (deficit == 0) return;
    const std::size_t first = actions_.first_unit(action);
    select_units(std::span(entry.potentials).subspan(first, actions_.n_active_units()), deficit,
                 selected_);
    if (selected_.empty()) return;
    for (std::uint32_t& unit : selected_) unit += static_cast<std::uint32_t>(first);

    const std::int32_t step = deficit > 0 ? config_.lattice : -config_.lattice;
    hidden_layer_.correct(selected_, memory_.columns(*code_, entry.bins), step);
    memory_.corrected(entry.bins, selected_, step);
  }

  /// The inner potentials in lattice steps (c / lattice), by a full pass. Shape: out (n,).
  ///
  /// Thread-safe: uses nothing remembered. Allocates.
  void potentials(std::span<const double> state, std::span<std::int32_t> out) const {
    core::require(out.size() == hidden_layer_.n_units(), "out",
                  std::to_string(hidden_layer_.n_units()) + " values", out.size());
    std::vector<coding::Bin> bins(n_inputs());
    coding::SignedColumns columns;
    code_->encode(state, bins);
    code_->columns(bins, columns);
    hidden_layer_.potentials(columns, out);
  }

  /// Replaces weights and thresholds, in lattice steps. Shapes: weights (n, D) row by row,
  /// thresholds (n,). Throws std::invalid_argument, and then nothing has changed.
  void set_parameters(std::span<const std::int32_t> weights,
                      std::span<const std::int32_t> thresholds) {
    const std::size_t n_columns = hidden_layer_.n_columns();
    core::require(weights.size() == hidden_layer_.n_units() * n_columns, "weights",
                  "n_hidden_units x D values", weights.size());
    core::require(thresholds.size() == hidden_layer_.n_units(), "thresholds",
                  "n_hidden_units values", thresholds.size());
    for (const std::int32_t weight : weights) {
      core::require_in_range("weight", weight, -largest_initial_weight(), largest_initial_weight());
    }
    HiddenLayer replaced(hidden_layer_.n_units(), n_columns, hidden_layer_.n_double_columns());
    for (std::size_t j = 0; j < n_columns; ++j) {
      const auto place = code_->place(j);
      for (std::size_t unit = 0; unit < hidden_layer_.n_units(); ++unit) {
        add_weight(replaced, unit, place, weights[unit * n_columns + j]);
      }
    }
    for (std::size_t unit = 0; unit < hidden_layer_.n_units(); ++unit) {
      replaced.set_threshold(unit, thresholds[unit]);
    }
    hidden_layer_ = std::move(replaced);
    memory_.forget();
  }

 private:
  using Remembered = typename PotentialMemory<Capacity>::Entry;

  static std::shared_ptr<const coding::StateCode<Capacity>> make_code(const SDNNCConfig& config,
                                                                      std::uint64_t seed) {
    core::require_in_range("n_inputs", config.n_inputs, 2, 1024);
    const auto l = static_cast<std::size_t>(config.n_inputs);
    core::require(config.circular.empty() || config.circular.size() == l, "circular",
                  "empty or one flag per input", config.circular.size());
    std::vector<coding::CodeBook<Capacity>> books;
    for (std::size_t mu = 0; mu < l; ++mu) {
      core::Random random(seed, core::Stream::code_books, mu);
      books.push_back(coding::anchor_interpolation<Capacity>(
          {.n_pattern_units = config.n_pattern_units,
           .n_anchor_patterns = config.n_anchor_patterns,
           .n_interpolated = config.n_interpolated,
           .balanced_anchors = config.balanced_anchors,
           .circular = !config.circular.empty() && config.circular[mu]},
          random));
    }
    std::vector<coding::Permutation> permutations;
    for (std::size_t group = 0; group < l * (l - 1); ++group) {
      core::Random random(seed, core::Stream::permutations, group);
      permutations.push_back(
          coding::random_permutation(static_cast<std::size_t>(config.n_pattern_units), random));
    }
    return std::make_shared<const coding::StateCode<Capacity>>(std::move(books),
                                                               std::move(permutations));
  }

  static OutputScale make_scale(const SDNNCConfig& config) {
    const int u_low = config.u_low.value_or(config.n_active_units / 15);
    core::require_in_range("u_low", u_low, 0, config.n_active_units);
    const int u_high = config.u_high.value_or(config.n_active_units - u_low);
    core::require_in_range("u_high", u_high, 0, config.n_active_units);
    return {u_low, u_high, config.q_low, config.q_high};
  }

  /// Two weights make a sum that has to fit.
  std::int32_t largest_initial_weight() const noexcept { return hidden_layer_.weight_limit() / 2; }

  /// Adds to the weight of a unit of x_SD, where the paired code keeps it.
  static void add_weight(HiddenLayer& hidden_layer, std::size_t unit,
                         const typename coding::StateCode<Capacity>::Place& place,
                         std::int32_t weight) {
    const auto add = [&](std::size_t column, std::int32_t change) {
      hidden_layer.set_weight(unit, column, hidden_layer.weight(unit, column) + change);
    };
    add(place.first, weight);
    if (place.paired) add(place.second, place.sign * weight);
  }

  void initialize_weights(std::uint64_t seed) {
    core::require(std::isfinite(config_.initial_weight_limit) && config_.initial_weight_limit >= 0,
                  "initial_weight_limit", "finite and not negative", config_.initial_weight_limit);
    const double limit = config_.initial_weight_limit * config_.lattice;
    core::require(limit <= largest_initial_weight(), "initial_weight_limit",
                  "at most " + std::to_string(largest_initial_weight()) + " / lattice",
                  config_.initial_weight_limit);
    core::Random random(seed, core::Stream::weights);
    for (std::size_t j = 0; j < hidden_layer_.n_columns(); ++j) {
      const auto place = code_->place(j);
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < hidden_layer_.n_units(); ++i) {
        if (config_.initial_weights == InitialWeights::ternary) {
          if (i % 32 == 0) bits = random.bits();  // two bits a weight
          add_weight(
              hidden_layer_, i, place,
              static_cast<std::int32_t>(bits & 1) - static_cast<std::int32_t>(bits >> 1 & 1));
          bits >>= 2;
        } else {
          const double drawn = limit * (2.0 * random.uniform() - 1.0);
          add_weight(hidden_layer_, i, place, static_cast<std::int32_t>(std::floor(drawn + 0.5)));
        }
      }
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

  /// Asks for some states and forgets them: the first decision then finds the weights, the wiring
  /// and the code in the caches, as every later one does.
  void rehearse() {
    constexpr int kStates = 8;  // each reads a third of the weights
    std::vector<double> out(n_actions());
    for (int i = 0; i < kStates; ++i) {
      values(std::vector<double>(n_inputs(), (i + 0.5) / kStates), out);
    }
    memory_ =
        PotentialMemory<Capacity>(*code_, actions_.n_hidden_units(), actions_.n_active_units());
  }

  Remembered recall(std::span<const double> state) {
    code_->encode(state, bins_);
    return memory_.recall(*code_, hidden_layer_, bins_);
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
  std::shared_ptr<const coding::StateCode<Capacity>> code_;
  coding::ActionCode actions_;
  OutputScale scale_;
  HiddenLayer hidden_layer_;
  std::vector<double> value_of_count_;

  // Workspace: sized once, so that a step allocates nothing.
  PotentialMemory<Capacity> memory_;
  std::vector<coding::Bin> bins_;
  std::vector<std::int8_t> moves_;  ///< what the count changes by as the window moves on a unit
  std::vector<std::uint32_t> selected_;
};

}  // namespace sdnn::approximators
