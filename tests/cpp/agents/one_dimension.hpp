/// Agents with actions of one dimension, which tests call by numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "sdnn/core/random.hpp"

namespace sdnn::testing {

/// An agent whose actions are numbers: indices, or of fuzzy rules in [-1, 1].
template <class Agent>
class OneDimension : public Agent {
 public:
  using Agent::Agent;
  using Number = std::remove_const_t<typename Agent::Action::element_type>;
  using Mask = std::span<const std::uint8_t>;

  Number act(std::span<const double> state, bool explore = true, std::size_t environment = 0,
             Mask mask = {}) {
    return Agent::act(state, explore, environment, mask).front();
  }
  Number best_action(std::span<const double> state, typename Agent::Workspace& workspace,
                     core::Random& ties, Mask mask = {}) const {
    return Agent::best_action(state, workspace, ties, mask).front();
  }
  Number best_of(typename Agent::Workspace& workspace, Mask mask = {}) {
    return Agent::best_of(workspace, mask).front();
  }
  double normalized_action(Number action) const {
    return Agent::normalized_action(typename Agent::Action(&action, 1));
  }
  void learn(std::span<const double> state, Number action, double reward,
             std::span<const double> next_state, bool terminated, std::size_t environment = 0,
             Mask next_mask = {}) {
    Agent::learn(state, typename Agent::Action(&action, 1), reward, next_state, terminated,
                 environment, next_mask);
  }

  const auto& network() const { return Agent::networks().front(); }
  auto& dimension() { return Agent::dimensions().front(); }
  const auto& dimension() const { return Agent::dimensions().front(); }
  const auto& rules() const { return dimension().rules(); }
  Number last_action(std::size_t environment = 0) const {
    return dimension().last_action(environment);
  }
};

}  // namespace sdnn::testing
