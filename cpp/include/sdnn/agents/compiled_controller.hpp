/// Agents that are compiled apart: this header includes no templates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

class AgentFile;

/// Real numbers from `low` to `high`, in the units of the task. Shapes: (n,) each.
struct Box {
  std::vector<double> low, high;
};
/// The whole numbers from `start` to start + n - 1.
struct Discrete {
  int n = 1;
  int start = 0;
};
/// A whole number in each dimension. Shapes: (n_dimensions,) each; an empty start: zeros.
struct MultiDiscrete {
  std::vector<int> n;
  std::vector<int> start = {};
};

/// The value of a setting. A text is a word, such as "hold", or JSON, such as "[[0, 1]]", "null".
using SettingValue = std::variant<bool, std::int64_t, double, std::string>;

/// The definition of a new agent.
///
/// Its bits are those of the agent that Python makes of the same spaces with dtype float64, preset,
/// settings and seed. With float32, set "action.number" to "float32".
struct AgentSpec {
  /// "q-lambda", "actor-critic", "sdnn-c", "rbf" or "fuzzy".
  std::string agent = "q-lambda";
  /// A name in agents/presets.hpp; empty: "general", or "paper" of "rbf" and "fuzzy".
  std::string preset = {};
  /// The observed variables. A variable with an infinite bound has no known range.
  Box observation = {};
  /// The actions. A box needs finite bounds.
  std::variant<Box, Discrete, MultiDiscrete> action = {};
  std::uint64_t seed = 0;
  /// Values that differ from the preset, by names as in files: "warm_up_steps", or fields of
  /// "approximator.", "learning.", "observation." and "action.", such as "learning.discount". A
  /// discrete variable is observed as a one-hot vector and listed in "observation.symbols".
  std::map<std::string, SettingValue> settings = {};
};

/// The part of a Controller and its file that programs and robots need, with the same bits.
///
/// Programs that include this header compile in seconds and are linked to the CMake target
/// sdnn::controller, which is compiled once. Observations and actions are in the units of the task,
/// shapes (n_variables,) and (n_dimensions,). An object serves one thread at a time.
class CompiledController {
 public:
  /// Which actions are allowed, as ActionMask has it; empty: all.
  using Mask = std::span<const std::uint8_t>;

  /// Makes an agent. Throws std::invalid_argument naming the member or setting, what was expected
  /// and what was given; std::length_error if the agent would exceed its limit of memory.
  explicit CompiledController(const AgentSpec& spec);
  /// Reads a file of an agent or a training. Throws std::runtime_error naming file and problem.
  explicit CompiledController(const std::filesystem::path& path);
  CompiledController(CompiledController&&) noexcept;
  CompiledController& operator=(CompiledController&&) noexcept;
  ~CompiledController();

  /// Writes a file, whole or not at all; Python's load_agent reads it. Throws std::runtime_error
  /// naming the file.
  void write(const std::filesystem::path& path) const;

  std::size_t n_variables() const noexcept;
  std::size_t n_dimensions() const noexcept;
  /// Whether it still acts at random to find the ranges of its observations.
  bool is_warming_up() const noexcept;

  /// Sets the number of environments or robots, each with separate episodes. Throws
  /// std::invalid_argument unless n is in [1, 2^14].
  void set_n_environments(std::size_t n);
  /// Sets the part of the learning that is done, for schedules that follow it, as those of "sdnn-c"
  /// do. Throws std::invalid_argument unless it is in [0, 1].
  void set_progress(double progress);
  /// Begins an episode: learn does not, even after a terminated transition. Throws
  /// std::invalid_argument if there is no such environment.
  void begin_episode(std::size_t environment = 0);
  /// The next acts without `explore` are those of another episode.
  void begin_greedy_episode(std::size_t environment = 0);

  /// Returns the action to take, a best one without `explore`. Valid until the next act. Throws
  /// std::invalid_argument, and changes nothing, for an unusable observation, mask or environment.
  std::span<const double> act(std::span<const double> observation, bool explore = true,
                              std::size_t environment = 0, Mask mask = {});

  /// Learns a transition. The action may be any one of the task (except with "fuzzy"); `next_mask`
  /// restricts the next state's actions; dt is the duration in usual steps. Throws
  /// std::invalid_argument for unusable arguments, and then nothing has changed;
  /// std::overflow_error for a weight beyond its range.
  void learn(std::span<const double> observation, std::span<const double> action, double reward,
             std::span<const double> next_observation, bool terminated, std::size_t environment = 0,
             Mask next_mask = {}, double dt = 1.0);

 private:
  std::unique_ptr<AgentFile> file_;
};

}  // namespace sdnn::agents
