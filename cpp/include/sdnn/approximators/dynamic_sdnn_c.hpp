/// SDNN-C with every size chosen at run time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <variant>

#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/core/detail/capacity.hpp"

namespace sdnn::approximators {

/// An SDNN-C on the smallest capacity that holds its patterns; one dispatch per call.
///
/// See SDNNC for what the members do and throw.
class DynamicSDNNC {
 public:
  /// Throws std::length_error naming the largest capacity if n_pattern_units exceeds it, and as
  /// SDNNC does.
  DynamicSDNNC(const SDNNCConfig& config, std::uint64_t seed) : network_(make(config, seed)) {}

  /// Calls `visitor` with the SDNNC<Capacity> inside.
  template <class Visitor>
  decltype(auto) visit(Visitor&& visitor) const {
    return std::visit(std::forward<Visitor>(visitor), network_);
  }
  template <class Visitor>
  decltype(auto) visit(Visitor&& visitor) {
    return std::visit(std::forward<Visitor>(visitor), network_);
  }

  const SDNNCConfig& config() const {
    return visit([](const auto& net) -> const SDNNCConfig& { return net.config(); });
  }
  const coding::ActionCode& action_code() const {
    return visit([](const auto& net) -> const coding::ActionCode& { return net.action_code(); });
  }
  const OutputScale& output_scale() const {
    return visit([](const auto& net) -> const OutputScale& { return net.output_scale(); });
  }
  const HiddenLayer& hidden_layer() const {
    return visit([](const auto& net) -> const HiddenLayer& { return net.hidden_layer(); });
  }
  std::size_t n_inputs() const {
    return visit([](const auto& net) { return net.n_inputs(); });
  }
  std::size_t n_actions() const {
    return visit([](const auto& net) { return net.n_actions(); });
  }
  void values(std::span<const double> state, std::span<double> out) {
    visit([&](auto& net) { net.values(state, out); });
  }
  double value(std::span<const double> state, std::size_t action) {
    return visit([&](auto& net) { return net.value(state, action); });
  }
  void correct(std::span<const double> state, std::size_t action, double target,
               double rate = 1.0) {
    visit([&](auto& net) { net.correct(state, action, target, rate); });
  }
  void potentials(std::span<const double> state, std::span<std::int32_t> out) const {
    visit([&](const auto& net) { net.potentials(state, out); });
  }
  void set_parameters(std::span<const std::int32_t> weights,
                      std::span<const std::int32_t> thresholds) {
    visit([&](auto& net) { net.set_parameters(weights, thresholds); });
  }

 private:
  using Network =
      std::variant<SDNNC<core::kPatternCapacities[0]>, SDNNC<core::kPatternCapacities[1]>,
                   SDNNC<core::kPatternCapacities[2]>>;

  static Network make(const SDNNCConfig& config, std::uint64_t seed) {
    core::require_in_range("n_pattern_units", config.n_pattern_units, 2, 1 << 20);
    switch (core::smallest_fit(static_cast<std::size_t>(config.n_pattern_units))) {
      case 0:
        return Network(std::in_place_index<0>, config, seed);
      case 1:
        return Network(std::in_place_index<1>, config, seed);
      default:
        return Network(std::in_place_index<2>, config, seed);
    }
  }

  Network network_;
};

}  // namespace sdnn::approximators
