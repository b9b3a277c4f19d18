/// What an agent needs of a function Q(s, a): the concept every approximator models.
#pragma once

#include <concepts>
#include <cstddef>
#include <span>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::approximators {

/// A learnable table of action values over continuous states in [0, 1]^l.
///
/// - q.n_actions(): number of actions
/// - q.n_inputs(): l, the size of a state
/// - q.values(state, out): writes Q(state, a) for every action a; out: (n_actions,)
/// - q.value(state, action): Q(state, action)
/// - q.update(state, action, target, rate): moves Q = Q(state, action) towards
///   (1 - rate) Q + rate target, as near as it can go; rate in (0, 1]
///
/// values may remember what it computed, but never changes what it returns.
template <class Q>
concept ActionValue =
    requires(Q q, const Q& const_q, std::span<const double> state, std::span<double> out,
             std::size_t action, double target, double rate) {
      { const_q.n_actions() } -> std::convertible_to<std::size_t>;
      { const_q.n_inputs() } -> std::convertible_to<std::size_t>;
      q.values(state, out);
      { q.value(state, action) } -> std::convertible_to<double>;
      q.update(state, action, target, rate);
    };

}  // namespace sdnn::approximators
