/// An agent in a file, compiled apart: this header includes no templates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

class AgentFile;

/// The part of an AgentFile and its controller that a robot needs, with the same bits.
///
/// Programs that include this header are compiled in a second and linked to the CMake target
/// sdnn::saved_agent, which is compiled once. Shapes, units and errors are those of Controller.
class SavedAgent {
 public:
  /// Which actions are allowed, as ActionMask has it; empty: all.
  using Mask = std::span<const std::uint8_t>;

  /// Reads a file of an agent or a training. Throws std::runtime_error naming the file and what is
  /// wrong with it.
  explicit SavedAgent(const std::filesystem::path& path);
  SavedAgent(SavedAgent&&) noexcept;
  SavedAgent& operator=(SavedAgent&&) noexcept;
  ~SavedAgent();

  /// Writes a file, whole or not at all. Throws std::runtime_error naming the file.
  void write(const std::filesystem::path& path) const;

  std::size_t n_variables() const noexcept;
  std::size_t n_dimensions() const noexcept;
  void set_n_environments(std::size_t n);
  void begin_episode(std::size_t environment = 0);

  /// Valid until the next act.
  std::span<const double> act(std::span<const double> observation, bool explore = true,
                              std::size_t environment = 0, Mask mask = {});

  void learn(std::span<const double> observation, std::span<const double> action, double reward,
             std::span<const double> next_observation, bool terminated, std::size_t environment = 0,
             Mask next_mask = {}, double dt = 1.0);

 private:
  std::unique_ptr<AgentFile> file_;
};

}  // namespace sdnn::agents
