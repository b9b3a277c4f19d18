#include "sdnn/agents/compiled_controller.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>

#include "sdnn/agents/agent_file.hpp"
#include "sdnn/agents/presets.hpp"

namespace sdnn::agents {

namespace {

using nlohmann::json;

/// Copies the preset that `spec` names to the configuration: by default the only preset, or
/// "general" if there are several. Throws std::invalid_argument for an unknown name.
template <class Preset, std::size_t N>
void choose(const std::array<Named<Preset>, N>& presets, const AgentSpec& spec,
            ControllerConfig& config) {
  const std::string name = spec.preset.empty() && N > 1 ? "general" : spec.preset;
  std::string expected = "of the agent " + spec.agent + ", one of";
  for (const auto& [known, title, preset] : presets) {
    if (name == known || (name.empty() && N == 1)) {
      config.approximator = preset.approximator;
      config.learning = preset.learning;
      config.observation = preset.observation;
      return;
    }
    (expected += ' ') += known;
  }
  detail::refuse("preset", expected, name);
}

/// Returns the configuration of the agent and preset that `spec` names, without a task.
ControllerConfig preset_of(const AgentSpec& spec) {
  using namespace approximators;
  using RBFPreset = Settings<RBFNetworkConfig, QLearningConfig>;
  using FuzzyPreset = Settings<FuzzyRulesConfig, FuzzyQLearningConfig>;
  ControllerConfig config;
  switch (detail::index_of_kind("agent", spec.agent)) {
    case 0:
      choose(presets(SDNNCConfig().n_inputs), spec, config);
      break;
    case 1:
      choose(std::array<Named<RBFPreset>, 1>{{{"paper", "", {}}}}, spec, config);
      break;
    case 2:
      choose(std::array<Named<FuzzyPreset>, 1>{{{"paper", "", {}}}}, spec, config);
      break;
    case 3:
      choose(q_lambda_presets(LinearSDNNConfig().n_inputs), spec, config);
      break;
    default:
      choose(actor_critic_presets(LinearSDNNConfig().n_inputs), spec, config);
  }
  return config;
}

/// Sets the known bounds of variables in the configuration: the finite ones, which must
/// differ if ranges are running.
/// Throws std::invalid_argument for bounds that are not ordered.
void set_bounds(const Box& box, ObservationConfig& config) {
  core::require_size("observation.high", box.high.size(), box.low.size(),
                     "numbers, one per variable as in observation.low");
  for (std::size_t i = 0; i < box.low.size(); ++i) {
    const double low = box.low[i], high = box.high[i];
    core::require(low <= high, "observation.low", "at most observation.high, and not NaN", low);
    // Equal bounds are kept, so that they are refused later, unless running ranges ignore bounds.
    const bool is_known =
        std::isfinite(low) && std::isfinite(high) && (low < high || !config.running);
    config.low.push_back(is_known ? std::optional(low) : std::nullopt);
    config.high.push_back(is_known ? std::optional(high) : std::nullopt);
  }
}

/// Returns the configuration of the actions of a space.
ActionConfig action_of(const Box& box) { return {.low = box.low, .high = box.high}; }
ActionConfig action_of(const MultiDiscrete& space) {
  ActionConfig config{.discrete = true, .number = ActionNumber::whole};
  if (!space.start.empty()) {
    core::require_size("action.start", space.start.size(), space.n.size(),
                       "numbers, one per dimension as in action.n");
  }
  for (std::size_t d = 0; d < space.n.size(); ++d) {
    core::require(space.n[d] >= 1, "action.n", "at least 1", space.n[d]);
    config.low.push_back(space.start.empty() ? 0.0 : space.start[d]);
    config.high.push_back(config.low[d] + space.n[d] - 1.0);
  }
  return config;
}
ActionConfig action_of(const Discrete& space) {
  return action_of(MultiDiscrete{.n = {space.n}, .start = {space.start}});
}

/// Converts a setting's value to JSON. A text that is JSON, such as a list, is parsed.
json json_of(const SettingValue& value) {
  const auto* const text = std::get_if<std::string>(&value);
  if (text != nullptr && json::accept(*text)) return json::parse(*text);
  return std::visit([](const auto& number_or_text) { return json(number_or_text); }, value);
}

/// Returns the configuration of a new agent: its preset, its task, and then its settings.
ControllerConfig config_of(const AgentSpec& spec) {
  ControllerConfig config = preset_of(spec);
  // The setting that decides which bounds are kept is read before all others.
  const auto running = spec.settings.find("observation.running");
  if (running != spec.settings.end()) {
    if (const bool* is = std::get_if<bool>(&running->second)) config.observation.running = *is;
  }
  set_bounds(spec.observation, config.observation);
  core::require(spec.agent != "fuzzy" || std::holds_alternative<Box>(spec.action), "action",
                "a Box for the agent fuzzy", "whole numbers");
  config.action = std::visit([](const auto& space) { return action_of(space); }, spec.action);
  config.seed = spec.seed;
  json description;
  detail::describe(config, description);
  for (const auto& [name, value] : spec.settings) {
    const std::size_t dot = name.find('.');
    const std::string part = name.substr(0, dot);
    const bool is_part =
        part == "approximator" || part == "learning" || part == "observation" || part == "action";
    if (dot == std::string::npos ? name != "warm_up_steps" : !is_part) {
      detail::refuse("settings",
                     "warm_up_steps, or fields of approximator., learning., observation. and "
                     "action., such as learning.discount",
                     name);
    }
    (is_part ? description[part][name.substr(dot + 1)] : description[name]) = json_of(value);
  }
  config = detail::controller_config_in(description);
  if (config.observation.missing == Missing::code &&
      !spec.settings.contains("observation.history")) {
    config.observation.history = History::none;
  }
  return config;
}

}  // namespace

CompiledController::CompiledController(const AgentSpec& spec)
    : file_(std::make_unique<AgentFile>(Controller(config_of(spec)))) {}
CompiledController::CompiledController(const std::filesystem::path& path)
    : file_(std::make_unique<AgentFile>(path)) {}
CompiledController::CompiledController(CompiledController&&) noexcept = default;
CompiledController& CompiledController::operator=(CompiledController&&) noexcept = default;
CompiledController::~CompiledController() = default;

void CompiledController::write(const std::filesystem::path& path) const { file_->write(path); }

std::size_t CompiledController::n_variables() const noexcept {
  return file_->controller.n_variables();
}
std::size_t CompiledController::n_dimensions() const noexcept {
  return file_->controller.n_dimensions();
}
bool CompiledController::is_warming_up() const noexcept {
  return file_->controller.is_warming_up();
}
void CompiledController::set_n_environments(std::size_t n) {
  file_->controller.set_n_environments(n);
}
void CompiledController::set_progress(double progress) { file_->controller.set_progress(progress); }
void CompiledController::begin_episode(std::size_t environment) {
  file_->controller.begin_episode(environment);
}
void CompiledController::begin_greedy_episode(std::size_t environment) {
  file_->controller.begin_greedy_episode(environment);
}

std::span<const double> CompiledController::act(std::span<const double> observation, bool explore,
                                                std::size_t environment, Mask mask) {
  return file_->controller.act(observation, explore, environment, mask);
}

void CompiledController::learn(std::span<const double> observation, std::span<const double> action,
                               double reward, std::span<const double> next_observation,
                               bool terminated, std::size_t environment, Mask next_mask,
                               double dt) {
  file_->controller.learn(observation, action, reward, next_observation, terminated, environment,
                          next_mask, dt);
}

}  // namespace sdnn::agents
