/// What an agent needs of a function Q(s, a): the concept every approximator models.
#pragma once

#include <concepts>
#include <cstddef>
#include <span>

namespace sdnn::approximators {

/// A learnable table of action values over continuous states in [0, 1]^l.
///
/// | expression                     | meaning                                                     |
/// |--------------------------------|-------------------------------------------------------------|
/// | q.n_actions()                  | number of actions                                           |
/// | q.n_inputs()                   | l, the size of a state                                      |
/// | q.values(state, out)           | writes Q(state, a) for every action a; out: (n_actions,)    |
/// | q.value(state, action)         | Q(state, action)                                            |
/// | q.correct(state, action, goal) | moves Q(state, action) towards `goal`, as near as it can go |
///
/// values and value may remember what they computed, but never change what they return.
template <class Q>
concept ActionValue = requires(Q q, const Q& const_q, std::span<const double> state,
                               std::span<double> out, std::size_t action, double goal) {
  { const_q.n_actions() } -> std::convertible_to<std::size_t>;
  { const_q.n_inputs() } -> std::convertible_to<std::size_t>;
  q.values(state, out);
  { q.value(state, action) } -> std::convertible_to<double>;
  q.correct(state, action, goal);
};

}  // namespace sdnn::approximators
