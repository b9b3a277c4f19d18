/// From what is observed to what an agent sees: numbers in [0, 1].
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::agents {

/// What an input of an agent is made of; its value where x is what is observed:
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
  std::size_t second;  ///< of an angle; how many variables encode a symbol
};

/// Scales what is observed, with a range for each observed variable.
class ObservationScale {
 public:
  /// Shapes: low and high (n_observed,). Throws std::invalid_argument naming what does not
  /// fit.
  ObservationScale(std::vector<double> low, std::vector<double> high,
                   std::vector<ObservedInput> inputs)
      : low_(std::move(low)), high_(std::move(high)), inputs_(std::move(inputs)) {
    core::require(low_.size() == high_.size(), "observation.high", "as long as observation.low",
                  high_.size());
    for (std::size_t i = 0; i < low_.size(); ++i) {
      core::require(std::isfinite(high_[i] - low_[i]) && low_[i] < high_[i],
                    "observation.high[" + std::to_string(i) + "]",
                    "finite and greater than observation.low", high_[i]);
    }
    for (std::size_t k = 0; k < inputs_.size(); ++k) check(k);
    has_angles_ = std::ranges::any_of(inputs_, [](const ObservedInput& input) {
      return input.kind == ObservedKind::angle || input.kind == ObservedKind::circular;
    });
  }

  std::size_t n_observed() const noexcept { return low_.size(); }
  std::size_t n_inputs() const noexcept { return inputs_.size(); }

  /// Shapes: observation (n_observed,), state (n_inputs,). Throws std::invalid_argument naming the
  /// number of the observation, called `name`, that has no state: none may be NaN, nor infinite
  /// where there are angles. A variable that is infinite is at an end of its range.
  void operator()(std::span<const double> observation, std::span<double> state,
                  const char* name = "observation") const {
    if (observation.size() != n_observed()) {
      core::require(false, name, std::to_string(n_observed()) + " numbers", observation.size());
    }
    for (std::size_t i = 0; i < observation.size(); ++i) {
      if (can_scale(observation[i])) continue;
      core::require(false, name + ("[" + std::to_string(i) + "]"),
                    has_angles_ ? "finite, as there are angles" : "a number", observation[i]);
    }
    for (std::size_t k = 0; k < inputs_.size(); ++k) state[k] = value(inputs_[k], observation);
  }

 private:
  bool can_scale(double x) const noexcept {
    return has_angles_ ? std::isfinite(x) : !std::isnan(x);
  }

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

  double value(const ObservedInput& input, std::span<const double> observation) const noexcept {
    const std::size_t i = input.first;
    if (input.kind == ObservedKind::angle) {
      return (core::atan2(observation[input.second], observation[i]) + core::kPi) / core::kTwoPi;
    }
    if (input.kind == ObservedKind::symbol) {
      const auto one_hot = observation.subspan(i, input.second);
      const auto k = std::ranges::max_element(one_hot) - one_hot.begin();
      return (static_cast<double>(k) + 0.5) / static_cast<double>(input.second);
    }
    const double u = (observation[i] - low_[i]) / (high_[i] - low_[i]);
    if (input.kind == ObservedKind::variable) return u > 0.0 ? std::min(u, 1.0) : 0.0;
    return std::isfinite(u) ? u - std::floor(u) : 0.0;  // beyond the range of numbers
  }

  std::vector<double> low_, high_;
  std::vector<ObservedInput> inputs_;
  bool has_angles_ = false;
};

}  // namespace sdnn::agents
