/// A model and a workspace in one object, for tests in which one user does everything.
#pragma once

#include <cstddef>
#include <span>
#include <utility>

namespace sdnn::testing {

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
    return Q::value(state, workspace_, action);
  }
  template <class Action>
  void update(std::span<const double> state, const Action& action, double target,
              double rate = 1.0) {
    Q::update(state, workspace_, action, target, rate);
  }
  void warm_caches() { Q::warm_caches(workspace_); }

  const typename Q::Workspace& own_workspace() const { return workspace_; }

 private:
  typename Q::Workspace workspace_ = Q::workspace();
};

}  // namespace sdnn::testing
