/// The settings of observed variables.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <tuple>
#include <vector>

#include "sdnn/agents/observation_scale.hpp"
#include "sdnn/core/config_fields.hpp"

namespace sdnn::agents {

/// Selects how states depend on the observations before the present one.
enum class History {
  none,         ///< nothing
  differences,  ///< an additional input for each: its difference from the last observation
  averages,     ///< two additional inputs for each: running averages
  observer,     ///< estimates in place of the inputs; see detail::Observer
  automatic,    ///< the kind that fits the transitions of the warm-up, see HistoryFilter
};
constexpr std::array<std::string_view, 5> words_of(History) noexcept {
  return {"none", "differences", "averages", "observer", "auto"};
}

/// The observed variables of a task.
struct ObservationConfig {
  std::vector<std::optional<double>> low = {};
  std::vector<std::optional<double>> high = {};
  bool adaptive = false;
  bool narrowed = false;
  bool running = false;
  std::vector<int> angles = {};
  std::vector<std::vector<int>> angle_pairs = {};
  bool find_angle_pairs = false;
  std::vector<std::vector<int>> symbols = {};
  bool relevant_only = false;
  std::vector<int> inputs = {};
  Missing missing = Missing::error;
  History history = History::none;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("low", &ObservationConfig::low,
                    "Lowest value of each variable; none: not known."),
        core::field("high", &ObservationConfig::high,
                    "Highest value of each variable; none: not known."),
        core::field("adaptive", &ObservationConfig::adaptive,
                    "Whether ranges of numbers are fitted, within low and high."),
        core::field("narrowed", &ObservationConfig::narrowed,
                    "Whether ranges of few inputs that are far wider than what is observed are "
                    "fitted."),
        core::field("running", &ObservationConfig::running,
                    "Whether ranges of numbers follow what is observed, whatever low and high."),
        core::field("angles", &ObservationConfig::angles,
                    "Variables that wrap around in their ranges."),
        core::field("angle_pairs", &ObservationConfig::angle_pairs,
                    "Variables that are the cosine and the sine of an angle."),
        core::field("find_angle_pairs", &ObservationConfig::find_angle_pairs,
                    "Whether angle_pairs are those that observations have."),
        core::field("symbols", &ObservationConfig::symbols,
                    "First variables, and how many there are, of which one is 1."),
        core::field("relevant_only", &ObservationConfig::relevant_only,
                    "Whether inputs that have nothing to do with rewards or actions, "
                    "as the warm-up finds, are left out."),
        core::field("inputs", &ObservationConfig::inputs, "Variables that are never left out."),
        core::field("missing", &ObservationConfig::missing,
                    "Whether readings that are NaN or infinite are refused, the last reading is "
                    "used instead, or each input has a pattern for them."),
        core::field("history", &ObservationConfig::history,
                    "Whether states have nothing of earlier observations, differences from the "
                    "last one, running averages, estimates of an observer in place of the inputs, "
                    "or what the warm-up finds."));
  }
  bool operator==(const ObservationConfig&) const = default;
};

}  // namespace sdnn::agents
