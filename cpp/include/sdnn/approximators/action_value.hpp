/// The concept of an approximator: a function Q(s, a) for agents.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::approximators {

/// A learnable function Q(s, a) of continuous states s in [0, 1]^l and discrete actions a: a model
/// that many threads may read at once, each through a separate workspace.
///
/// - q.n_actions(): number of actions
/// - q.n_inputs(): l, the size of a state
/// - q.workspace(): a Q::Workspace for one user: caches and buffers
/// - q.values(state, workspace, out): writes Q(state, a) for every action a; out: (n_actions,)
/// - q.value(state, workspace, action): Q(state, action)
/// - q.update(state, workspace, action, target, rate): moves Q = Q(state, action) towards
///   (1 - rate) Q + rate target, as near as it can go; rate in (0, 1]
///
/// A workspace may speed up later calls, but never changes results. It remains usable after changes
/// of the model, and for its copies. During update, no other thread may use the model.
template <class Q>
concept ActionValue =
    requires(Q q, const Q& const_q, typename Q::Workspace& workspace, std::span<const double> state,
             std::span<double> out, std::size_t action, double target, double rate) {
      { const_q.n_actions() } -> std::convertible_to<std::size_t>;
      { const_q.n_inputs() } -> std::convertible_to<std::size_t>;
      { const_q.workspace() } -> std::same_as<typename Q::Workspace>;
      const_q.values(state, workspace, out);
      { const_q.value(state, workspace, action) } -> std::convertible_to<double>;
      q.update(state, workspace, action, target, rate);
    };

/// An approximator whose values are functions of integers, of which the largest are found faster.
///
/// - q.count(state, workspace, averaged): computes the integer of every action; afterwards
///   workspace.counts(), a WindowCounts, has them; `averaged` selects the average of the weights
/// - q.value_of_count(count): Q(state, a) for the integer `count` of a
/// - q.values_rise(): whether no value is below that of a smaller integer
template <class Q>
concept CountedActionValue =
    ActionValue<Q> &&
    requires(const Q& q, typename Q::Workspace& workspace, std::span<const double> state,
             std::int32_t count, std::span<const std::uint8_t> mask) {
      q.count(state, workspace, true);
      { q.value_of_count(count) } -> std::convertible_to<double>;
      { q.values_rise() } -> std::convertible_to<bool>;
      { workspace.counts().largest() } -> std::convertible_to<std::int32_t>;
      workspace.counts().exclude(mask);
      { workspace.counts().of_actions() } -> std::convertible_to<std::span<const std::int32_t>>;
    };

}  // namespace sdnn::approximators
