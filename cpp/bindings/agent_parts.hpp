/// The parts of agents that are bound as objects: networks and rules.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <span>
#include <utility>
#include <variant>

#include "objects.hpp"
#include "sdnn/agents/any_agent.hpp"

namespace sdnn::bindings {

inline auto parts_of(agents::FuzzyQLearning& agent) { return agent.dimensions(); }
auto parts_of(auto& agent) { return agent.networks(); }

inline approximators::FuzzyRules& bound_part(agents::detail::FuzzyDimension& part) {
  return part.rules();
}
auto& bound_part(auto& network) { return network; }

/// Returns the networks or rules of an agent, as references that keep `owner`.
inline pybind11::list networks_of(agents::AnyAgent& agent, pybind11::handle owner) {
  pybind11::list networks;
  const auto add = [&](auto& of_kind) {
    for (auto& part : parts_of(of_kind)) {
      networks.append(pybind11::cast(bound_part(part),
                                     pybind11::return_value_policy::reference_internal, owner));
    }
  };
  std::visit(add, agent);
  return networks;
}

/// Returns the memory of the networks or rules of an agent.
inline std::span<std::byte> memory_of_parts(agents::AnyAgent& agent) {
  return std::visit(
      [](auto& of_kind) { return std::as_writable_bytes(std::span(parts_of(of_kind))); }, agent);
}

}  // namespace sdnn::bindings
