/// A network of radial basis functions over state and action: Q(s, a) linear in its weights.
#pragma once

#include <algorithm>
#include <array>
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
#include "sdnn/core/elementary.hpp"

namespace sdnn::approximators {

/// The sizes of an RBF network (spec section 4).
struct RBFNetworkConfig {
  int n_inputs = 4;            ///< d
  int n_bases = 4;             ///< per dimension, of the state and of the action
  int n_actions = 601;         ///< evenly spaced over the action's range
  double width = 0.5;          ///< of a Gaussian, in units of the spacing of the centres
  double gradient_rate = 3.0;  ///< of the gradient step in correct; stable below 2 / |phi|^2
  std::uint64_t max_table_bytes = core::kDefaultMaxTableBytes;  ///< more weights are refused

  static constexpr auto fields() noexcept {
    return std::tuple(core::field("n_inputs", &RBFNetworkConfig::n_inputs),
                      core::field("n_bases", &RBFNetworkConfig::n_bases),
                      core::field("n_actions", &RBFNetworkConfig::n_actions),
                      core::field("width", &RBFNetworkConfig::width),
                      core::field("gradient_rate", &RBFNetworkConfig::gradient_rate),
                      core::field("max_table_bytes", &RBFNetworkConfig::max_table_bytes));
  }
  bool operator==(const RBFNetworkConfig&) const = default;
};

/// Normalized Gaussian bases on an even grid over [0, 1]^d and the action's range.
///
/// A joint basis is the product of one Gaussian per dimension, divided by the sum of all joint
/// bases: n_bases^(d+1) in number. That sum is a product too, so a normalized joint basis is the
/// product of Gaussians normalized in their own dimension. `values` uses this: it builds the
/// normalized bases phi(s) of the state as an outer product, multiplies them once into the weights,
/// u = phi(s)^T W, and gives every action psi(a)^T u. `values_plainly` computes every joint basis
/// of every action as it is written. Both sum in a fixed order and are the same everywhere; they
/// agree to 1e-12 of the largest |weight|.
///
/// Source: spec section 4. Cost at d = 6: 16,384 multiply-adds for all actions, plainly 601 x
/// 16,384 exponentials. An object must not be used by two threads at once: it holds its workspace.
class RBFNetwork {
 public:
  /// All weights 0. Throws std::invalid_argument naming the field that is impossible;
  /// std::length_error naming bases, bytes and limit before any memory is asked for.
  explicit RBFNetwork(const RBFNetworkConfig& config)
      : config_(checked(config)),
        n_joint_bases_(core::grid_cells("joint bases", n_bases(), n_inputs() + 1, sizeof(double),
                                        config.max_table_bytes)),
        weights_(n_joint_bases_),
        state_bases_(n_joint_bases_ / n_bases()),
        action_bases_(n_actions() * n_bases()),
        one_dimension_(n_bases()),
        mixed_(n_bases()),
        mixed_state_(n_inputs()) {
    for (std::size_t action = 0; action < n_actions(); ++action) {
      normalized_bases(position(action), bases_of(action));
    }
  }

  const RBFNetworkConfig& config() const noexcept { return config_; }
  std::size_t n_inputs() const noexcept { return static_cast<std::size_t>(config_.n_inputs); }
  std::size_t n_bases() const noexcept { return static_cast<std::size_t>(config_.n_bases); }
  std::size_t n_actions() const noexcept { return static_cast<std::size_t>(config_.n_actions); }
  std::size_t n_joint_bases() const noexcept { return n_joint_bases_; }

  /// Row-major over (input 1, ..., input d, action). Shape: (n_bases^(d+1),).
  std::span<const double> weights() const noexcept { return weights_.span(); }

  /// Replaces the weights. Throws std::invalid_argument for another number of them.
  void set_weights(std::span<const double> weights) {
    core::require(weights.size() == n_joint_bases_, "weights",
                  std::to_string(n_joint_bases_) + " values", weights.size());
    std::copy(weights.begin(), weights.end(), weights_.data());
    is_mixed_ = false;
  }

  /// Q(state, a) for every action. Shapes: state (d,) in [0, 1], out (n_actions,).
  ///
  /// Throws std::invalid_argument for a state of wrong size or outside [0, 1].
  void values(std::span<const double> state, std::span<double> out) {
    require_room(out);
    mix(state);
    for (std::size_t action = 0; action < out.size(); ++action) out[action] = mixed(action);
  }

  /// Q(state, action). Throws like values, and std::invalid_argument for an action out of range.
  double value(std::span<const double> state, std::size_t action) {
    require_action(action);
    mix(state);
    return mixed(action);
  }

  /// The same as values, without use of the product structure: every joint basis of every action.
  void values_plainly(std::span<const double> state, std::span<double> out) {
    require_room(out);
    core::require_unit_values("state", state, n_inputs());
    is_mixed_ = false;
    const auto exponents = [this](double x, std::span<double> own) {
      for (std::size_t k = 0; k < own.size(); ++k) own[k] = exponent(x, k);
    };
    outer(state, exponents, 0.0, [](double joint, double own) { return joint + own; });
    for (std::size_t action = 0; action < out.size(); ++action) {
      for (std::size_t k = 0; k < n_bases(); ++k) mixed_[k] = exponent(position(action), k);
      out[action] = plain_value();
    }
  }

  /// One gradient step: W += gradient_rate (target - Q(state, action)) phi(state, action).
  ///
  /// Throws std::invalid_argument like value and for a NaN target; std::overflow_error if the error
  /// is not finite (the network has diverged, or target is infinite). Nothing has changed then.
  void correct(std::span<const double> state, std::size_t action, double target) {
    core::require(!std::isnan(target), "target", "a number", target);
    const double step = config_.gradient_rate * (target - value(state, action));
    if (!std::isfinite(step)) throw std::overflow_error("the RBF network's weights diverge");
    is_mixed_ = false;
    for (std::size_t b = 0; b < n_bases(); ++b) mixed_[b] = step * bases_of(action)[b];
    double* weight = weights_.data();
    for (std::size_t j = 0; j < state_bases_.size(); ++j) {
      for (std::size_t b = 0; b < mixed_.size(); ++b) *weight++ += state_bases_[j] * mixed_[b];
    }
  }

 private:
  static const RBFNetworkConfig& checked(const RBFNetworkConfig& config) {
    core::require_in_range("n_inputs", config.n_inputs, 1, 62);
    core::require_in_range("n_bases", config.n_bases, 2, 1 << 20);
    core::require_in_range("n_actions", config.n_actions, 1, 1 << 20);
    core::require_in_range("width", config.width, 0.1, 100.0);  // narrower ones leave gaps of 0
    core::require_positive("gradient_rate", config.gradient_rate);
    return config;
  }

  void require_room(std::span<const double> out) const {
    core::require(out.size() == n_actions(), "out", std::to_string(n_actions()) + " values",
                  out.size());
  }

  void require_action(std::size_t action) const {
    core::require(action < n_actions(), "action", "less than " + std::to_string(n_actions()),
                  action);
  }

  double position(std::size_t action) const noexcept {
    return coding::action_value(action, n_actions(), 0.0, 1.0);
  }

  std::span<double> bases_of(std::size_t action) noexcept {
    return action_bases_.span().subspan(action * n_bases(), n_bases());
  }

  // The logarithm of Gaussian k at x: -((x - centre) / width)^2 / 2, in units of the spacing.
  double exponent(double x, std::size_t k) const noexcept {
    const double distance =
        (x * static_cast<double>(n_bases() - 1) - static_cast<double>(k)) / config_.width;
    return -0.5 * distance * distance;
  }

  void normalized_bases(double x, std::span<double> out) const noexcept {
    double total = 0.0;
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] = core::exp(exponent(x, k));
      total += out[k];
    }
    for (double& basis : out) basis /= total;
  }

  // Fills state_bases_ with own(x_1)[k_1] o own(x_2)[k_2] o ..., row-major, from the left.
  template <class Own, class Join>
  void outer(std::span<const double> state, const Own& own, double neutral, const Join& join) {
    state_bases_[0] = neutral;
    std::size_t size = 1;
    for (const double x : state) {
      own(x, std::span<double>(one_dimension_));
      // From the back, so that one array is enough: entry i becomes entries i n .. i n + n - 1.
      for (std::size_t i = size; i-- > 0;) {
        const double joint = state_bases_[i];
        for (std::size_t k = 0; k < n_bases(); ++k) {
          state_bases_[i * n_bases() + k] = join(joint, one_dimension_[k]);
        }
      }
      size *= n_bases();
    }
  }

  // state_bases_ = phi(state), mixed_ = phi(state)^T W; nothing to do if they are those already.
  void mix(std::span<const double> state) {
    core::require_unit_values("state", state, n_inputs());
    if (is_mixed_ && std::equal(state.begin(), state.end(), mixed_state_.begin())) return;
    std::copy(state.begin(), state.end(), mixed_state_.begin());
    is_mixed_ = true;
    const auto bases = [this](double x, std::span<double> own) { normalized_bases(x, own); };
    outer(state, bases, 1.0, [](double joint, double own) { return joint * own; });
    if (n_bases() == kUnrolled) return mix_unrolled();
    mixed_.assign(n_bases(), 0.0);
    const double* weight = weights_.data();
    for (std::size_t j = 0; j < state_bases_.size(); ++j) {
      for (double& sum : mixed_) sum += state_bases_[j] * *weight++;
    }
  }

  // The same sums in the same order with their number known to the compiler.
  void mix_unrolled() noexcept {
    std::array<double, kUnrolled> sums{};
    const double* weight = weights_.data();
    for (std::size_t j = 0; j < state_bases_.size(); ++j, weight += kUnrolled) {
      for (std::size_t b = 0; b < kUnrolled; ++b) sums[b] += state_bases_[j] * weight[b];
    }
    for (std::size_t b = 0; b < kUnrolled; ++b) mixed_[b] = sums[b];
  }

  double mixed(std::size_t action) noexcept {
    double sum = 0.0;
    const auto bases = bases_of(action);
    for (std::size_t b = 0; b < bases.size(); ++b) sum += bases[b] * mixed_[b];
    return sum;
  }

  // sum W G / sum G over all joint bases, with exponents state_bases_[j] + mixed_[b]. A few
  // exponentials at a time, so that the compiler can use vectors; the sums stay in order.
  double plain_value() noexcept {
    std::array<double, 64> bases;
    double weighted = 0.0, total = 0.0;
    for (std::size_t begin = 0; begin < n_joint_bases_; begin += bases.size()) {
      const std::size_t n = std::min(bases.size(), n_joint_bases_ - begin);
      std::size_t j = begin / n_bases(), b = begin % n_bases();
      for (std::size_t i = 0; i < n; ++i) {
        bases[i] = state_bases_[j] + mixed_[b];
        if (++b < n_bases()) continue;
        b = 0;
        ++j;
      }
      for (std::size_t i = 0; i < n; ++i) bases[i] = core::exp(bases[i]);
      for (std::size_t i = 0; i < n; ++i) {
        weighted += bases[i] * weights_[begin + i];
        total += bases[i];
      }
    }
    return weighted / total;
  }

  static constexpr std::size_t kUnrolled = 4;  // the paper's n_bases

  RBFNetworkConfig config_;
  std::size_t n_joint_bases_;
  core::AlignedBuffer<double> weights_;
  core::AlignedBuffer<double> state_bases_;   // phi(s), or the exponents of its Gaussians
  core::AlignedBuffer<double> action_bases_;  // psi(a), row by row
  std::vector<double> one_dimension_;
  std::vector<double> mixed_;        // phi(s)^T W, or what goes with an action
  std::vector<double> mixed_state_;  // the state of both, if is_mixed_
  bool is_mixed_ = false;
};

}  // namespace sdnn::approximators
