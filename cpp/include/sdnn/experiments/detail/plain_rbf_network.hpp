/// The RBF network without its product structure, for what that costs.
#pragma once

#include <cstddef>
#include <span>

#include "sdnn/approximators/rbf_network.hpp"

namespace sdnn::experiments {

/// An RBF network whose `values` are evaluated as the definition says: every joint basis of every
/// action (RBFNetwork::values_plainly). It learns what RBFNetwork learns, up to rounding.
///
/// `value` and `correct` concern a single action; they stay as they are, and cost less than the
/// n_actions-th part of `values`. Throws as RBFNetwork does.
class PlainRBFNetwork {
 public:
  explicit PlainRBFNetwork(const approximators::RBFNetworkConfig& config) : network_(config) {}

  const approximators::RBFNetwork& network() const noexcept { return network_; }
  std::size_t n_inputs() const noexcept { return network_.n_inputs(); }
  std::size_t n_actions() const noexcept { return network_.n_actions(); }

  void values(std::span<const double> state, std::span<double> out) {
    network_.values_plainly(state, out);
  }
  double value(std::span<const double> state, std::size_t action) {
    return network_.value(state, action);
  }
  void correct(std::span<const double> state, std::size_t action, double target) {
    network_.correct(state, action, target);
  }

 private:
  approximators::RBFNetwork network_;
};

}  // namespace sdnn::experiments
