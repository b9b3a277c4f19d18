/// A network of radial basis functions over state and action, whose Q(s, a) is linear in its
/// weights.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "sdnn/coding/action_code.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/detail/identity.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/core/errors.hpp"

namespace sdnn::approximators {

/// The sizes of an RBF network (method.md, section 4).
struct RBFNetworkConfig {
  int n_inputs = 4;
  int n_bases = 4;
  int n_actions = 601;
  double width = 0.5;          // below 0.1, gaps between the bases would be 0
  double gradient_rate = 3.0;  // a step of 0.5 * 3 is stable, as |phi|^2 <= 1 and 1.5 < 2
  std::uint64_t max_table_bytes = core::kDefaultMaxTableBytes;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("n_inputs", &RBFNetworkConfig::n_inputs, "d, number of inputs.",
                    core::within(1, 62)),
        core::field("n_bases", &RBFNetworkConfig::n_bases,
                    "Bases per dimension, of the inputs and of the action. There are n_bases to "
                    "the power of n_inputs + 1 joint bases.",
                    core::within(2, 1 << 20)),
        core::field("n_actions", &RBFNetworkConfig::n_actions,
                    "Actions over which the maximum is taken, evenly spaced over the action's "
                    "range.",
                    core::within(1, 1 << 20)),
        core::field("width", &RBFNetworkConfig::width,
                    "Standard deviation of a Gaussian in units of the spacing of the centres.",
                    core::within(0.1, 100)),
        core::field("gradient_rate", &RBFNetworkConfig::gradient_rate,
                    "Rate of a gradient step. With Q-learning's learning_rate 0.5 the default is "
                    "stable whatever the sizes and the width.",
                    core::above_up_to(0, 1e6)),
        core::field("max_table_bytes", &RBFNetworkConfig::max_table_bytes,
                    "More weights are refused before memory is allocated; 1 GiB by default. For "
                    "all action dimensions together, where an agent has several."));
  }
  bool operator==(const RBFNetworkConfig&) const = default;
};

/// Normalized Gaussian bases on an even grid over [0, 1]^d and the action's range.
///
/// Each of the n_bases^(d+1) joint bases is the product of one Gaussian per dimension, divided by
/// the sum of these products. The sum is the product of the dimensions' sums, so a normalized joint
/// basis is the product of Gaussians normalized in each dimension. Let phi(s) be the normalized
/// bases of the state, the outer product of those of its inputs, and psi(a) those of the action.
/// Then Q(s, a) = phi(s)^T W psi(a): u = phi(s)^T W is computed once, and psi(a)^T u for each
/// action.
///
/// All sums start at 0 and add in the order of the bases. They use columns of Eigen's arrays, and
/// not its products, whose order depends on the instruction set.
///
/// Source: method.md, section 4. Cost at d = 6: 16,384 multiply-adds for all actions. Thread
/// safety: const functions may be called by many threads at once, with a workspace each.
class RBFNetwork {
 public:
  /// Sets all weights to 0. Throws std::invalid_argument naming the impossible field;
  /// std::length_error naming bases, bytes and limit before any allocation.
  explicit RBFNetwork(const RBFNetworkConfig& config)
      : config_(checked(config)),
        n_joint_bases_(core::grid_cells("n_bases or n_inputs", "joint bases", n_bases(),
                                        n_inputs() + 1, sizeof(double), config.max_table_bytes)),
        weights_(n_joint_bases_),
        action_bases_(index(n_actions()), index(n_bases())) {
    Eigen::ArrayXd bases(index(n_bases()));
    for (std::size_t action = 0; action < n_actions(); ++action) {
      to_one_dimension(coding::action_value(action, n_actions(), 0.0, 1.0), bases);
      action_bases_.row(index(action)) = bases.transpose();
    }
  }

  /// The workspace of a user: buffers, and the bases of the last state.
  class Workspace {
    friend class RBFNetwork;

    explicit Workspace(const RBFNetwork& network)
        : state_bases_(index(network.n_joint_bases_ / network.n_bases())),
          one_dimension_(index(network.n_bases())),
          mixed_(index(network.n_bases())),
          state_(network.n_inputs()) {}

    Eigen::ArrayXd state_bases_;  // phi(s)
    Eigen::ArrayXd one_dimension_;
    Eigen::ArrayXd mixed_;         // phi(s)^T W
    std::vector<double> state_;    // s
    std::uint64_t network_ = 0;    // the identity of the network of these values
    std::uint64_t n_updates_ = 0;  // the number of updates of that network
  };
  Workspace workspace() const { return Workspace(*this); }

  const RBFNetworkConfig& config() const noexcept { return config_; }
  std::size_t n_inputs() const noexcept { return static_cast<std::size_t>(config_.n_inputs); }
  std::size_t n_bases() const noexcept { return static_cast<std::size_t>(config_.n_bases); }
  std::size_t n_actions() const noexcept { return static_cast<std::size_t>(config_.n_actions); }
  std::size_t n_joint_bases() const noexcept { return n_joint_bases_; }
  /// A number that no other network of the process has.
  std::uint64_t identity() const noexcept { return identity_.number(); }

  /// Row-major over (input 1, ..., input d, action). Shape: (n_bases^(d+1),).
  std::span<const double> weights() const noexcept { return weights_.span(); }

  /// Replaces the weights. Throws std::invalid_argument for another number of them.
  void set_weights(std::span<const double> weights) {
    core::require_size("weights", weights.size(), n_joint_bases_);
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (std::abs(weights[i]) <= kLargestWeight) continue;
      core::require_in_range("weights[" + std::to_string(i) + "]", weights[i], -kLargestWeight,
                             kLargestWeight);
    }
    std::copy(weights.begin(), weights.end(), weights_.data());
    ++n_updates_;
  }

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.finite("weights", {self.n_joint_bases_}, self.weights_.span());
    if constexpr (Archive::kReads) ++self.n_updates_;
  }

  /// Writes Q(state, a) for every action. Shapes: state (d,) in [0, 1], out (n_actions,).
  ///
  /// Throws std::invalid_argument for a state of wrong size or outside [0, 1].
  void values(std::span<const double> state, Workspace& workspace, std::span<double> out) const {
    core::require_size("out", out.size(), n_actions());
    const Eigen::ArrayXd& mixed = mix(state, workspace);
    Eigen::Map<Eigen::ArrayXd> q(out.data(), action_bases_.rows());
    q.setZero();
    for (Eigen::Index b = 0; b < mixed.size(); ++b) q += mixed[b] * action_bases_.col(b);
  }

  /// Q(state, action). Throws std::invalid_argument for a bad state or action.
  double value(std::span<const double> state, Workspace& workspace, std::size_t action) const {
    core::require_below("action", action, n_actions());
    const Eigen::ArrayXd& mixed = mix(state, workspace);
    const auto bases = action_bases_.row(index(action));
    double q = 0.0;
    for (Eigen::Index b = 0; b < bases.size(); ++b) q += mixed[b] * bases[b];
    return q;
  }

  /// Takes a gradient step of Q = Q(state, action) towards q_hat = (1 - rate) Q + rate target: W +=
  /// gradient_rate (q_hat - Q) phi(state, action).
  ///
  /// Throws std::invalid_argument for a bad state or action, a NaN target or a rate outside (0, 1];
  /// std::overflow_error if the step exceeds 1e305 (the network has diverged, or target is
  /// infinite), so that weights and values stay finite. Nothing has changed then.
  void update(std::span<const double> state, Workspace& workspace, std::size_t action,
              double target, double rate = 1.0) {
    core::require(!std::isnan(target), "target", "a number", target);
    core::require(rate > 0.0 && rate <= 1.0, "rate", "in (0, 1]", rate);
    const double q = value(state, workspace, action);
    const double q_hat = (1.0 - rate) * q + rate * target;
    const double step = config_.gradient_rate * (q_hat - q);
    if (!(std::abs(step) <= kLargestStep)) {
      core::fail(
          std::overflow_error("the RBF network's weights diverge: reward, gradient_rate or "
                              "learning_rate is too large"));
    }
    ++n_updates_;
    workspace.one_dimension_ = step * action_bases_.row(index(action)).transpose();
    if (workspace.one_dimension_.size() == kUnrolled) {
      add_to_columns(workspace.state_bases_,
                     Eigen::Array<double, kUnrolled, 1>(workspace.one_dimension_));
    } else {
      add_to_columns(workspace.state_bases_, workspace.one_dimension_);
    }
  }

 private:
  static constexpr int kUnrolled = 4;  // the paper's n_bases, for which loops are compiled apart
  static constexpr double kLargestStep = 1e305;
  static constexpr double kLargestWeight = 1e300;  // limit of given weights, whose sums stay finite

  /// Returns the configuration if it is valid and its tables fit into memory; throws otherwise.
  static RBFNetworkConfig checked(const RBFNetworkConfig& config) {
    core::check_fields(config);
    core::require_table_bytes("n_actions or n_bases", "the bases of all actions",
                              8.0 * config.n_actions * config.n_bases, config.max_table_bytes);
    return config;
  }

  static Eigen::Index index(std::size_t i) noexcept { return static_cast<Eigen::Index>(i); }

  // Writes the Gaussians of one dimension at x, divided by their sum, to `bases`.
  void to_one_dimension(double x, Eigen::ArrayXd& bases) const noexcept {
    double total = 0.0;
    for (Eigen::Index k = 0; k < bases.size(); ++k) {
      const double distance =
          (x * static_cast<double>(n_bases() - 1) - static_cast<double>(k)) / config_.width;
      bases[k] = core::exp(-0.5 * distance * distance);
      total += bases[k];
    }
    bases /= total;
  }

  // Returns phi(state)^T W, with phi(state) in the workspace, and reuses them for the last state.
  const Eigen::ArrayXd& mix(std::span<const double> state, Workspace& workspace) const {
    core::require_unit_values("state", state, n_inputs());
    if (workspace.network_ == identity_.number() && workspace.n_updates_ == n_updates_ &&
        std::equal(state.begin(), state.end(), workspace.state_.begin())) {
      return workspace.mixed_;
    }
    std::copy(state.begin(), state.end(), workspace.state_.begin());
    workspace.network_ = identity_.number();
    workspace.n_updates_ = n_updates_;
    if (workspace.mixed_.size() == kUnrolled) {
      Eigen::Array<double, kUnrolled, 1> sums;  // in registers
      mix_into(sums, workspace);
      workspace.mixed_ = sums;
    } else {
      mix_into(workspace.mixed_, workspace);
    }
    return workspace.mixed_;
  }

  // Computes phi and sums = phi^T W for the workspace's state.
  template <class Sums>
  void mix_into(Sums& sums, Workspace& workspace) const {
    const auto n = Eigen::fix<Sums::RowsAtCompileTime>(config_.n_bases);
    Eigen::ArrayXd& state_bases = workspace.state_bases_;
    state_bases[0] = 1.0;
    Eigen::Index size = 1;
    for (const double x : workspace.state_) {
      to_one_dimension(x, workspace.one_dimension_);
      // Entry i becomes the n entries from i n on. Backwards, no entry is overwritten before it is
      // read, so that one array is enough.
      for (Eigen::Index i = size; i-- > 0;) {
        state_bases.segment(i * n, n) = state_bases[i] * workspace.one_dimension_.head(n);
      }
      size *= n;
    }
    // The weights, a row per basis of the action and a column per joint basis of the state.
    using Columns = const Eigen::Array<double, Sums::RowsAtCompileTime, Eigen::Dynamic>;
    const Eigen::Map<Columns, Eigen::Aligned64> columns(weights_.data(), index(n_bases()),
                                                        state_bases.size());
    sums.setZero();
    for (Eigen::Index j = 0; j < columns.cols(); ++j) sums += state_bases[j] * columns.col(j);
  }

  // Adds the product of each basis of the state and the step of the action's bases to the weights.
  template <class Step>
  void add_to_columns(const Eigen::ArrayXd& state_bases, const Step& step) {
    using Columns = Eigen::Array<double, Step::RowsAtCompileTime, Eigen::Dynamic>;
    Eigen::Map<Columns, Eigen::Aligned64> columns(weights_.data(), index(n_bases()),
                                                  state_bases.size());
    for (Eigen::Index j = 0; j < columns.cols(); ++j) columns.col(j) += state_bases[j] * step;
  }

  RBFNetworkConfig config_;
  std::size_t n_joint_bases_;
  core::AlignedBuffer<double> weights_;
  Eigen::ArrayXXd action_bases_;  // psi(a), a row per action
  core::Identity identity_;
  std::uint64_t n_updates_ = 0;
};

}  // namespace sdnn::approximators
