/// An RBF network computed by its definition, without the product structure of RBFNetwork.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::tools {

/// An RBF network whose `values` are computed by the definition, from every joint basis of every
/// action. It is a reference for tests and timings of RBFNetwork, whose values differ by at most
/// 1e-12 of the largest |weight|.
///
/// `value` and `update`, for a single action, call RBFNetwork and are much cheaper. The functions
/// throw what those of RBFNetwork throw. Cost of `values` at d = 6: 601 x 16,384 exponentials.
class PlainRBFNetwork {
 public:
  explicit PlainRBFNetwork(approximators::RBFNetwork network) : network_(std::move(network)) {}
  explicit PlainRBFNetwork(const approximators::RBFNetworkConfig& config)
      : PlainRBFNetwork(approximators::RBFNetwork(config)) {}

  const approximators::RBFNetwork& network() const noexcept { return network_; }
  std::size_t n_inputs() const noexcept { return network_.n_inputs(); }
  std::size_t n_actions() const noexcept { return network_.n_actions(); }

  struct Workspace {
    approximators::RBFNetwork::Workspace network;
    std::vector<double> state_exponents, exponents;
  };
  Workspace workspace() const {
    return {network_.workspace(),
            std::vector<double>(network_.n_joint_bases() / network_.n_bases()),
            std::vector<double>(network_.n_bases())};
  }

  void values(std::span<const double> state, Workspace& workspace, std::span<double> out) const {
    core::require_size("out", out.size(), n_actions());
    core::require_unit_values("state", state, n_inputs());
    add_up_exponents(state, workspace);
    for (std::size_t action = 0; action < out.size(); ++action) {
      set_exponents(coding::action_value(action, n_actions(), 0.0, 1.0), workspace.exponents);
      out[action] = weighted_mean(workspace);
    }
  }
  double value(std::span<const double> state, Workspace& workspace, std::size_t action) const {
    return network_.value(state, workspace.network, action);
  }
  void update(std::span<const double> state, Workspace& workspace, std::size_t action,
              double target, double rate = 1.0) {
    network_.update(state, workspace.network, action, target, rate);
  }

 private:
  // Writes the exponents of one dimension's Gaussians at x, -((x - centre) / width)^2 / 2; lengths
  // are in units of the distance between centres.
  void set_exponents(double x, std::vector<double>& exponents) const noexcept {
    const double n_gaps = static_cast<double>(exponents.size() - 1);
    for (std::size_t k = 0; k < exponents.size(); ++k) {
      const double distance = (x * n_gaps - static_cast<double>(k)) / network_.config().width;
      exponents[k] = -0.5 * distance * distance;
    }
  }

  // Computes state_exponents, the exponents of the state's joint bases, row-major over the inputs.
  void add_up_exponents(std::span<const double> state, Workspace& workspace) const noexcept {
    auto& [network, sums, exponents] = workspace;
    sums[0] = 0.0;
    std::size_t size = 1;
    for (const double x : state) {
      set_exponents(x, exponents);
      const std::size_t n = exponents.size();
      // Entry i becomes the n entries from i n on. Backwards, no entry is overwritten before it is
      // read, so that one array is enough.
      for (std::size_t i = size; i-- > 0;) {
        const double before = sums[i];
        for (std::size_t k = 0; k < n; ++k) sums[i * n + k] = before + exponents[k];
      }
      size *= n;
    }
  }

  // Returns the mean of the weights of all joint bases, weighted by their Gaussians, whose
  // exponents are state_exponents[j] + exponents[b]. Some exponentials are computed at a time, so
  // that the compiler can use vectors; sums are in the order of the bases.
  double weighted_mean(const Workspace& workspace) const noexcept {
    const auto& [network, state_exponents, exponents] = workspace;
    const std::span<const double> weights = network_.weights();
    std::array<double, 64> bases;
    double weighted = 0.0, total = 0.0;
    for (std::size_t begin = 0; begin < weights.size(); begin += bases.size()) {
      const std::size_t n = std::min(bases.size(), weights.size() - begin);
      std::size_t j = begin / exponents.size(), b = begin % exponents.size();
      for (std::size_t i = 0; i < n; ++i) {
        bases[i] = state_exponents[j] + exponents[b];
        if (++b < exponents.size()) continue;
        b = 0;
        ++j;
      }
      for (std::size_t i = 0; i < n; ++i) bases[i] = core::exp(bases[i]);
      for (std::size_t i = 0; i < n; ++i) {
        weighted += bases[i] * weights[begin + i];
        total += bases[i];
      }
    }
    return weighted / total;
  }

  approximators::RBFNetwork network_;
};

}  // namespace sdnn::tools
