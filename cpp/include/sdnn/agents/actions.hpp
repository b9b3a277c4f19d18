/// Conversions between an agent's actions and those of its task.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "sdnn/agents/action_mask.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/pcg64.hpp"

namespace sdnn::agents {

/// The type of the numbers that a task accepts as actions.
enum class ActionNumber {
  float64,
  float32,
  float16,
  whole,  ///< the nearest one, halves upwards
};
constexpr std::array<std::string_view, 4> words_of(ActionNumber) noexcept {
  return {"float64", "float32", "float16", "whole"};
}

/// The actions of a task: a box, or whole numbers with an index each.
struct ActionConfig {
  std::vector<double> low = {};
  std::vector<double> high = {};
  bool discrete = false;
  ActionNumber number = ActionNumber::float64;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("low", &ActionConfig::low, "Lowest action of each dimension."),
        core::field("high", &ActionConfig::high, "Highest action of each dimension."),
        core::field("discrete", &ActionConfig::discrete,
                    "Every whole number from low to high is an action of its own."),
        core::field("number", &ActionConfig::number, "To what numbers actions are rounded."));
  }
  bool operator==(const ActionConfig&) const = default;
};

/// Converts actions between an agent and its task.
///
/// In a box, dimension d has n_actions[d] values at even distances from low to high
/// (coding::action_value). If n_actions[d] is 0, a number a in [-1, 1] stands for the value (low +
/// high) / 2 + (high - low) / 2 a. Values are rounded to the task's type. A discrete action is low
/// plus the index.
class Actions {
 public:
  static constexpr std::size_t kMostDimensions = 1024;  ///< chosen
  static constexpr double kMostActions = 1 << 20;       ///< of a dimension, chosen

  /// Divides each dimension of a box into `n_in_box` actions; 0 stands for real numbers. Throws
  /// std::invalid_argument naming the field that does not fit.
  Actions(ActionConfig config, std::size_t n_in_box) : config_(std::move(config)) {
    core::require(n_dimensions() >= 1 && n_dimensions() <= kMostDimensions, "action.low",
                  "of 1 to 1024 dimensions", n_dimensions());
    core::require(config_.high.size() == n_dimensions(), "action.high", "as long as action.low",
                  config_.high.size());
    for (std::size_t d = 0; d < n_dimensions(); ++d) check(d);
    core::require(!config_.discrete || n_in_box > 0, "action.discrete",
                  "false where an agent's actions are continuous", config_.discrete);
    for (std::size_t d = 0; d < n_dimensions(); ++d) {
      n_actions_.push_back(config_.discrete
                               ? static_cast<std::size_t>(config_.high[d] - config_.low[d] + 1.0)
                               : n_in_box);
    }
  }

  const ActionConfig& config() const noexcept { return config_; }
  std::size_t n_dimensions() const noexcept { return config_.low.size(); }
  /// The number of actions of each dimension; 0: any number in [-1, 1].
  const std::vector<std::size_t>& n_actions() const noexcept { return n_actions_; }

  /// The action with an index in dimension d.
  double of_index(std::size_t index, std::size_t d) const noexcept {
    if (config_.discrete) return config_.low[d] + static_cast<double>(index);
    return rounded(coding::action_value(index, n_actions_[d], config_.low[d], config_.high[d]), d);
  }
  /// The value of a box at a fractional index, index + offset; discrete actions ignore the offset.
  double beside_index(std::size_t index, double offset, std::size_t d) const noexcept {
    if (config_.discrete || n_actions_[d] == 1) return of_index(index, d);
    const double share =  // of the way from low to high
        (static_cast<double>(index) + offset) / static_cast<double>(n_actions_[d] - 1);
    return rounded(config_.low[d] + (config_.high[d] - config_.low[d]) * share, d);
  }
  /// The action of a number in [-1, 1] in dimension d.
  double of_normalized(double action, std::size_t d) const noexcept {
    const double low = config_.low[d], high = config_.high[d];
    return rounded(std::clamp(0.5 * (low + high) + 0.5 * (high - low) * action, low, high), d);
  }
  /// The index of an action that can be taken, or of the nearest one to it.
  std::size_t index_of(double action, std::size_t d) const noexcept {
    const double distance = action - config_.low[d];
    if (config_.discrete) return static_cast<std::size_t>(distance);
    const double share = distance / (config_.high[d] - config_.low[d]);
    return static_cast<std::size_t>(std::nearbyint(share * static_cast<double>(n_actions_[d] - 1)));
  }

  /// Converts an agent's action, indices or numbers, to the units of the task and to indices.
  template <class Number>
  void take(std::span<const Number> action, std::vector<double>& in_units,
            std::vector<std::size_t>& indices) const {
    for (std::size_t d = 0; d < in_units.size(); ++d) {
      if (n_actions_[d] == 0) {
        in_units[d] = of_normalized(static_cast<double>(action[d]), d);
      } else {
        indices[d] = static_cast<std::size_t>(action[d]);
        in_units[d] = of_index(indices[d], d);
      }
    }
  }

  /// Draws an action as agents have it: an allowed index per dimension, or a number in [-1, 1].
  void draw(core::Pcg64& random, std::vector<double>& action, ActionMask mask = {}) const {
    const auto below = [&random](std::size_t n) {
      return static_cast<std::size_t>(random.below(static_cast<std::uint32_t>(n)));
    };
    for (std::size_t d = 0; d < action.size(); ++d) {
      const std::size_t n = n_actions_[d];
      action[d] = n == 0 ? -1.0 + 2.0 * random.uniform()
                         : static_cast<double>(draw_allowed(take_part(mask, n), n, below));
    }
  }
  /// Whether a mask allows an action that `draw` returned.
  bool allows_drawn(std::span<const double> action, ActionMask mask) const {
    return allows_action(mask, action, [this](std::size_t d) { return n_actions_[d]; });
  }
  /// Whether these are numbers that `draw` can return.
  bool can_be_drawn(std::span<const double> action) const noexcept {
    for (std::size_t d = 0; d < action.size(); ++d) {
      const auto n = static_cast<double>(n_actions_[d]);
      const bool fits =
          n == 0.0 ? action[d] >= -1.0 && action[d] <= 1.0 : action[d] >= 0.0 && action[d] < n;
      if (!fits) return false;
    }
    return true;
  }

  /// Throws std::invalid_argument for a mask of a box, or one that does not fit the actions.
  void require_mask(std::string_view name, ActionMask mask) const {
    if (mask.empty()) return;
    core::require(config_.discrete, name, "None where actions are a box", mask.size());
    agents::require_mask(name, mask, n_dimensions(),
                         [this](std::size_t d) { return n_actions_[d]; });
  }

  /// Throws std::invalid_argument unless the task has such an action. Shape: (n_dimensions,).
  void require_action(std::span<const double> action) const {
    core::require_size("action", action.size(), n_dimensions(), "numbers");
    for (std::size_t d = 0; d < action.size(); ++d) {
      const double x = action[d], low = config_.low[d], high = config_.high[d];
      if (x >= low && x <= high && (!config_.discrete || std::floor(x) == x)) continue;
      const std::string name = "action[" + std::to_string(d) + "]";
      core::require_in_range(name, x, low, high);
      core::require(false, name, "a whole number", x);
    }
  }

 private:
  static constexpr double kFurthest = 1e300;  // largest bound: the width of a range is finite
  static constexpr double kLargestWhole = 9007199254740992.0;  // 2^53: exact in doubles

  /// Throws std::invalid_argument if the bounds of a dimension are impossible.
  void check(std::size_t d) const {
    const std::string low_name = "action.low[" + std::to_string(d) + "]";
    const std::string high_name = "action.high[" + std::to_string(d) + "]";
    const double low = config_.low[d], high = config_.high[d];
    const bool is_whole = config_.discrete || config_.number == ActionNumber::whole;
    const double furthest = is_whole ? kLargestWhole : kFurthest;
    core::require_in_range(low_name, low, -furthest, furthest);
    core::require_in_range(high_name, high, -furthest, furthest);
    if (config_.discrete) {
      core::require(std::floor(low) == low, low_name, "a whole number", low);
      core::require(std::floor(high) == high, high_name, "a whole number", high);
      core::require(high >= low, high_name, "at least action.low", high);
      core::require(high - low < kMostActions, high_name, "at most 2^20 - 1 above action.low",
                    high);
    } else {
      core::require_greater(high_name, high, low_name, low);
    }
  }

  /// Rounds to a number of the space's type, within its bounds.
  double rounded(double action, std::size_t d) const noexcept {
    switch (config_.number) {
      case ActionNumber::float64:
        return action;
      case ActionNumber::float32:
        action = static_cast<double>(static_cast<float>(action));
        break;
      case ActionNumber::float16:
        action = rounded_to_half(action);
        break;
      case ActionNumber::whole:
        action = std::floor(action + 0.5);
        break;
    }
    return std::clamp(action, config_.low[d], config_.high[d]);
  }

  /// The nearest number with 11 significant bits that is a multiple of 2^-24, ties to even.
  static double rounded_to_half(double x) noexcept {
    int exponent = 0;
    (void)std::frexp(x, &exponent);
    const double unit = std::ldexp(1.0, std::max(exponent - 11, -24));
    return std::nearbyint(x / unit) * unit;
  }

  ActionConfig config_;
  std::vector<std::size_t> n_actions_;
};

}  // namespace sdnn::agents
