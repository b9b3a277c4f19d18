/// The conversion of observations to states, numbers in [0, 1].
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::agents {

/// Selects what replaces a missing reading, which is NaN or infinite.
enum class Missing {
  error,  ///< it is refused
  hold,   ///< the variable's last reading; before the first one the middle of its range
  code,   ///< a pattern that each input has for missing readings
};
constexpr std::array<std::string_view, 3> words_of(Missing) noexcept {
  return {"error", "hold", "code"};
}

/// The way in which an agent's input is computed from an observation x:
///
/// | kind     | first, second | value                                                          |
/// |----------|---------------|----------------------------------------------------------------|
/// | variable | i             | (x_i - low_i) / (high_i - low_i), clipped to [0, 1]            |
/// | angle    | i, j          | (atan2(x_j, x_i) + pi) / (2 pi): x_i the cosine, x_j the sine  |
/// | circular | i             | u - floor(u) with u = (x_i - low_i) / (high_i - low_i)         |
/// | symbol   | i, n          | (k + 1/2) / n, where x_{i+k} is the first largest of the n     |
enum class ObservedKind { variable, angle, circular, symbol };

/// An input, and the observed variables that it is made of.
struct ObservedInput {
  ObservedKind kind;
  std::size_t first;
  std::size_t second;  ///< the sine of an angle; or the number of variables of a symbol
};

/// Scales observations to states in [0, 1], with a range for each observed variable.
///
/// With Missing::hold the caller has already replaced missing readings by the last ones (see
/// LastReadings). A variable that is still missing has none: it gets the middle of its range, and a
/// symbol with such a variable becomes the first symbol. With Missing::code an input with n bins
/// has an additional bin for missing readings, and values are middles of bins; an input is missing
/// if a variable of it is.
class ObservationScale {
 public:
  /// Takes the ranges of variables, and the inputs that are made of them. Shapes: low and high
  /// (n_observed,), n_bins (n_inputs,) with Missing::code. Throws std::invalid_argument.
  ObservationScale(std::vector<double> low, std::vector<double> high,
                   std::vector<ObservedInput> inputs, Missing missing = Missing::error,
                   std::vector<std::size_t> n_bins = {})
      : low_(std::move(low)),
        high_(std::move(high)),
        inputs_(std::move(inputs)),
        missing_(missing),
        n_bins_(std::move(n_bins)) {
    core::require(low_.size() == high_.size(), "observation.high", "as long as observation.low",
                  high_.size());
    for (std::size_t i = 0; i < low_.size(); ++i) {
      core::require(std::isfinite(high_[i] - low_[i]) && low_[i] < high_[i],
                    "observation.high[" + std::to_string(i) + "]",
                    "finite and greater than observation.low", high_[i]);
    }
    for (std::size_t k = 0; k < inputs_.size(); ++k) check(k);
    core::require(missing_ != Missing::code || n_bins_.size() == n_inputs(), "n_bins",
                  "one number for each input", n_bins_.size());
  }

  /// Gives a variable another range, of finite ends.
  void set_range(std::size_t i, double low, double high) noexcept {
    low_[i] = low;
    high_[i] = high;
  }

  std::size_t n_observed() const noexcept { return low_.size(); }
  std::size_t n_inputs() const noexcept { return inputs_.size(); }

  /// Writes the state of an observation. Shapes: observation (n_observed,), state (n_inputs,). With
  /// `is_wide` variables are clipped to [-1, 2] instead of [0, 1]. Throws std::invalid_argument
  /// naming the unusable number of the observation, which messages call `name`; see Missing.
  void operator()(std::span<const double> observation, std::span<double> state,
                  const char* name = "observation", bool is_wide = false) const {
    core::require_size(name, observation.size(), n_observed(), "numbers");
    if (missing_ == Missing::error) {
      require_present(name, observation);
      for (std::size_t k = 0; k < inputs_.size(); ++k) state[k] = value(inputs_[k], observation);
    } else {
      for (std::size_t k = 0; k < inputs_.size(); ++k) {
        state[k] = missing_ == Missing::code ? coded(k, observation)
                                             : value_or_middle(inputs_[k], observation);
      }
    }
    for (double& x : state.first(is_wide ? 0 : n_inputs())) x = x > 0.0 ? std::min(x, 1.0) : 0.0;
  }

  /// Throws std::invalid_argument naming the first missing reading.
  static void require_present(const char* name, std::span<const double> observation) {
    for (std::size_t i = 0; i < observation.size(); ++i) {
      if (std::isfinite(observation[i])) continue;
      core::require(false, name + ("[" + std::to_string(i) + "]"),
                    "finite and not masked (agents with missing='hold' or 'code' take such)",
                    observation[i]);
    }
  }

 private:
  /// Throws std::invalid_argument if input k has impossible variables.
  void check(std::size_t k) const {
    const ObservedInput& input = inputs_[k];
    const std::string name = "observation.inputs[" + std::to_string(k) + "]";
    const auto require_variable = [&](std::size_t i) {
      core::require(i < n_observed(), name, "of a variable below " + std::to_string(n_observed()),
                    i);
    };
    require_variable(input.first);
    if (input.kind == ObservedKind::angle) require_variable(input.second);
    if (input.kind == ObservedKind::symbol) {
      const std::size_t most = n_observed() - input.first;
      core::require(input.second >= 1 && input.second <= most, name,
                    "of 1 to " + std::to_string(most) + " variables", input.second);
    }
  }

  /// Whether a variable of the input is missing.
  static bool is_missing(const ObservedInput& input, std::span<const double> observation) noexcept {
    if (input.kind == ObservedKind::symbol) {
      return !core::are_finite(observation.subspan(input.first, input.second));
    }
    return !std::isfinite(observation[input.first]) ||
           (input.kind == ObservedKind::angle && !std::isfinite(observation[input.second]));
  }

  /// The middle of the bin of input k; the last of its n + 1 bins is for missing readings.
  double coded(std::size_t k, std::span<const double> observation) const noexcept {
    const std::size_t n = n_bins_[k];
    const std::size_t bin = is_missing(inputs_[k], observation)
                                ? n
                                : static_cast<std::size_t>(coding::bin_of(
                                      std::clamp(value(inputs_[k], observation), 0.0, 1.0), n));
    return (static_cast<double>(bin) + 0.5) / static_cast<double>(n + 1);
  }

  /// Returns the input's value. A missing reading counts as the middle of its range (for an angle,
  /// the middle of the missing coordinate's range), and a missing symbol as the first one.
  double value_or_middle(const ObservedInput& input,
                         std::span<const double> observation) const noexcept {
    if (!is_missing(input, observation)) return value(input, observation);
    if (input.kind == ObservedKind::symbol) return 0.5 / static_cast<double>(input.second);
    if (input.kind != ObservedKind::angle) return 0.5;
    const auto reading = [&](std::size_t i) {
      return std::isfinite(observation[i]) ? observation[i] : (low_[i] + high_[i]) / 2.0;
    };
    return angle(reading(input.first), reading(input.second));
  }

  static double angle(double cosine, double sine) noexcept {
    return (core::atan2(sine, cosine) + core::kPi) / core::kTwoPi;
  }

  /// The value of an input without missing readings; a number may be outside [0, 1].
  double value(const ObservedInput& input, std::span<const double> observation) const noexcept {
    const std::size_t i = input.first;
    if (input.kind == ObservedKind::angle) {
      return angle(observation[i], observation[input.second]);
    }
    if (input.kind == ObservedKind::symbol) {
      const auto one_hot = observation.subspan(i, input.second);
      const auto k = std::ranges::max_element(one_hot) - one_hot.begin();
      return (static_cast<double>(k) + 0.5) / static_cast<double>(input.second);
    }
    const double u = (observation[i] - low_[i]) / (high_[i] - low_[i]);
    if (input.kind == ObservedKind::variable) return u > -1.0 ? std::min(u, 2.0) : -1.0;
    return std::isfinite(u) ? u - std::floor(u) : 0.0;  // the quotient may overflow
  }

  std::vector<double> low_, high_;
  std::vector<ObservedInput> inputs_;
  Missing missing_;
  std::vector<std::size_t> n_bins_;  ///< of each input, without that of missing readings
};

}  // namespace sdnn::agents
