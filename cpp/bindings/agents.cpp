#include "agents.hpp"

#include <type_traits>
#include <utility>
#include <variant>

#include "objects.hpp"

namespace sdnn::bindings {

namespace {

/// The parts of an agent that learn: the dimensions of fuzzy rules, or networks.
auto parts_of(agents::FuzzyQLearning& agent) { return agent.dimensions(); }
auto parts_of(auto& agent) { return agent.networks(); }

/// The object of a part that has a class in Python.
approximators::FuzzyRules& bound_part(agents::detail::FuzzyDimension& part) { return part.rules(); }
auto& bound_part(auto& network) { return network; }

}  // namespace

pybind11::list networks_of(agents::AnyAgent& agent, pybind11::handle owner) {
  pybind11::list networks;
  const auto add = [&](auto& typed_agent) {
    for (auto& part : parts_of(typed_agent)) {
      networks.append(pybind11::cast(bound_part(part),
                                     pybind11::return_value_policy::reference_internal, owner));
    }
  };
  std::visit(add, agent);
  return networks;
}

std::span<std::byte> memory_of_parts(agents::AnyAgent& agent) {
  return std::visit(
      [](auto& typed_agent) { return std::as_writable_bytes(std::span(parts_of(typed_agent))); },
      agent);
}

}  // namespace sdnn::bindings

namespace sdnn::tools {

namespace {

/// Whether an agent's actions are numbers in [-1, 1], and not indices.
template <class Agent>
constexpr bool kHasNumbers =
    std::is_same_v<typename std::remove_cvref_t<Agent>::Action, BareAgent::Action>;

/// Copies numbers or indices, converted to the type of `to`, which has the size.
void assign(auto from, auto& to) {
  for (std::size_t d = 0; d < to.size(); ++d) {
    to[d] = static_cast<std::remove_cvref_t<decltype(to[d])>>(from[d]);
  }
}

}  // namespace

BareAgent::BareAgent(const agents::AnyApproximatorConfig& approximator,
                     const agents::AnyLearningConfig& learning,
                     const std::vector<std::size_t>& n_actions, std::uint64_t seed)
    : agent_(agents::make_agent(approximator, learning, n_actions, seed)),
      action_(n_actions.size()) {}
BareAgent::BareAgent(const agents::AnyApproximatorConfig& approximator,
                     const agents::AnyLearningConfig& learning, std::uint64_t seed)
    : BareAgent(approximator, learning, {agents::n_actions_in_box(approximator)}, seed) {}
BareAgent::BareAgent(BareAgent&&) noexcept = default;
BareAgent& BareAgent::operator=(BareAgent&&) noexcept = default;
BareAgent::~BareAgent() = default;

std::size_t BareAgent::n_inputs() const {
  return std::visit([](const auto& agent) { return agent.n_inputs(); }, agent_);
}

void BareAgent::begin_episode() {
  std::visit([](auto& agent) { agent.begin_episode(); }, agent_);
}

void BareAgent::set_progress(double progress) {
  const auto set = [progress](auto& agent) {
    if constexpr (requires { agent.set_progress(progress); }) agent.set_progress(progress);
  };
  std::visit(set, agent_);
}

void BareAgent::warm_caches() {
  const auto warm = [](auto& agent) {
    if constexpr (requires { agent.warm_caches(); }) agent.warm_caches();
  };
  std::visit(warm, agent_);
}

BareAgent::Action BareAgent::act(std::span<const double> state, bool explore) {
  std::visit([&](auto& agent) { assign(agent.act(state, explore), action_); }, agent_);
  return action_;
}

double BareAgent::normalized_action(Action action) const {
  const auto normalized = [action](const auto& agent) {
    if constexpr (kHasNumbers<decltype(agent)>) {
      return agent.normalized_action(action);
    } else {
      const std::size_t index[] = {static_cast<std::size_t>(action.front())};
      return agent.normalized_action(index);
    }
  };
  return std::visit(normalized, agent_);
}

void BareAgent::learn(std::span<const double> state, Action action, double reward,
                      std::span<const double> next_state, bool terminated, double dt) {
  indices_.resize(action.size());
  const auto learn = [&](auto& agent) {
    if constexpr (kHasNumbers<decltype(agent)>) {
      agent.learn(state, action, reward, next_state, terminated, 0, {}, dt);
    } else {
      assign(action, indices_);
      agent.learn(state, indices_, reward, next_state, terminated, 0, {}, dt);
    }
  };
  std::visit(learn, agent_);
}

}  // namespace sdnn::tools
