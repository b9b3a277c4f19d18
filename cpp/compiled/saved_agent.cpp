#include "sdnn/agents/saved_agent.hpp"

#include "sdnn/agents/agent_file.hpp"

namespace sdnn::agents {

SavedAgent::SavedAgent(const std::filesystem::path& path)
    : file_(std::make_unique<AgentFile>(path)) {}
SavedAgent::SavedAgent(SavedAgent&&) noexcept = default;
SavedAgent& SavedAgent::operator=(SavedAgent&&) noexcept = default;
SavedAgent::~SavedAgent() = default;

void SavedAgent::write(const std::filesystem::path& path) const { file_->write(path); }

std::size_t SavedAgent::n_variables() const noexcept { return file_->controller.n_variables(); }
std::size_t SavedAgent::n_dimensions() const noexcept { return file_->controller.n_dimensions(); }
void SavedAgent::set_n_environments(std::size_t n) { file_->controller.set_n_environments(n); }
void SavedAgent::begin_episode(std::size_t environment) {
  file_->controller.begin_episode(environment);
}

std::span<const double> SavedAgent::act(std::span<const double> observation, bool explore,
                                        std::size_t environment, Mask mask) {
  return file_->controller.act(observation, explore, environment, mask);
}

void SavedAgent::learn(std::span<const double> observation, std::span<const double> action,
                       double reward, std::span<const double> next_observation, bool terminated,
                       std::size_t environment, Mask next_mask, double dt) {
  file_->controller.learn(observation, action, reward, next_observation, terminated, environment,
                          next_mask, dt);
}

}  // namespace sdnn::agents
