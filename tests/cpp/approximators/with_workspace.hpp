/// A model and a workspace in one object, for tests in which one user does everything.
#pragma once

#include <cstddef>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdnn/core/random.hpp"

namespace sdnn::testing {

inline std::vector<double> random_state(std::size_t n_inputs, core::Random& random) {
  std::vector<double> state(n_inputs);
  for (double& x : state) x = random.uniform();
  return state;
}

template <class Q>
class WithWorkspace : public Q {
 public:
  using Q::Q;
  explicit WithWorkspace(Q model) : Q(std::move(model)) {}

  void values(std::span<const double> state, std::span<double> out) {
    Q::values(state, workspace_, out);
  }
  void averaged_values(std::span<const double> state, std::span<double> out) {
    Q::averaged_values(state, workspace_, out);
  }
  template <class Action>
  double value(std::span<const double> state, const Action& action) {
    return Q::value(state, workspace_, index_of(action));
  }
  template <class Action>
  void update(std::span<const double> state, const Action& action, double target,
              double rate = 1.0) {
    Q::update(state, workspace_, index_of(action), target, rate);
  }
  void warm_caches() { Q::warm_caches(workspace_); }

  const typename Q::Workspace& own_workspace() const { return workspace_; }

 private:
  template <class Action>
  static decltype(auto) index_of(const Action& action) {
    if constexpr (std::is_integral_v<Action>) {
      return static_cast<std::size_t>(action);
    } else {
      return (action);
    }
  }

  typename Q::Workspace workspace_ = Q::workspace();
};

/// A network that has learned random targets in [-10, 10], so that its weights differ.
template <class Network, class Config>
Network trained_at_random(const Config& config, int n_corrections) {
  Network network(config);
  core::Random random(7, core::Stream::weights);
  for (int i = 0; i < n_corrections; ++i) {
    const auto state = random_state(network.n_inputs(), random);
    const auto action = static_cast<std::size_t>(random.below(network.n_actions()));
    network.update(state, action, 20.0 * random.uniform() - 10.0);
  }
  return network;
}

}  // namespace sdnn::testing
