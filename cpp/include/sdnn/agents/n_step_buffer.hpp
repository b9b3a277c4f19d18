/// Transitions whose targets are not known yet: a ring of the last n steps.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sdnn/agents/duration.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::agents {

/// A queue of up to n steps (state, action, reward, duration) of an episode, the oldest first. Only
/// the constructor allocates. An action has `n_dimensions` numbers.
class NStepBuffer {
 public:
  struct Step {
    std::vector<double> state;
    std::vector<std::size_t> action;
    double reward = 0.0, dt = 1.0;
  };

  /// Allocates all steps, so that adding one allocates nothing.
  NStepBuffer(std::size_t n_steps, std::size_t n_inputs, std::size_t n_dimensions)
      : steps_(n_steps), next_state_(n_inputs) {
    for (Step& step : steps_) {
      step.state.resize(n_inputs);
      step.action.resize(n_dimensions);
    }
  }

  std::size_t size() const noexcept { return n_steps_; }
  bool is_full() const noexcept { return n_steps_ == steps_.size(); }
  /// The state after the newest step.
  std::span<const double> next_state() const noexcept { return next_state_; }
  /// Whether `state` is the state after the newest step, or the buffer is empty.
  bool is_continued_by(std::span<const double> state) const noexcept {
    return n_steps_ == 0 || std::ranges::equal(state, next_state_);
  }

  /// Adds the newest step. Requires that the buffer is not full, and shapes as in the constructor.
  void add(std::span<const double> state, std::span<const std::size_t> action, double reward,
           std::span<const double> next_state, double dt = 1.0) noexcept {
    assert(!is_full());
    Step& newest = steps_[(first_ + n_steps_) % steps_.size()];
    std::ranges::copy(state, newest.state.begin());
    std::ranges::copy(action, newest.action.begin());
    newest.reward = reward;
    newest.dt = dt;
    std::ranges::copy(next_state, next_state_.begin());
    ++n_steps_;
  }

  /// Returns r_1 + gamma r_2 + ... + gamma^n value for the rewards of all n steps, where gamma is
  /// `discount`, raised to the duration of each step.
  double return_of_oldest(double value, double discount) const noexcept {
    for (std::size_t i = n_steps_; i-- > 0;) {
      const Step& step = steps_[(first_ + i) % steps_.size()];
      value = step.reward + discount_over(discount, step.dt) * value;
    }
    return value;
  }

  /// Removes and returns the oldest step, valid until the next add. Requires that there is a step.
  const Step& take_oldest() noexcept {
    assert(n_steps_ > 0);
    const Step& oldest = steps_[first_];
    first_ = (first_ + 1) % steps_.size();
    --n_steps_;
    return oldest;
  }

  /// Whether all steps, the oldest first, satisfy a condition.
  template <class Condition>
  bool each_is(const Condition& condition) const {
    for (std::size_t i = 0; i < n_steps_; ++i) {
      if (!condition(steps_[(first_ + i) % steps_.size()])) return false;
    }
    return true;
  }

  /// Lists the members that are saved and restored; see core/state.hpp.
  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    std::vector<double> states;
    std::vector<std::int64_t> actions;
    std::vector<double> rewards, dts;
    for (std::size_t i = 0; i < self.n_steps_; ++i) {
      const Step& step = self.steps_[(self.first_ + i) % self.steps_.size()];
      states.insert(states.end(), step.state.begin(), step.state.end());
      for (const std::size_t a : step.action) actions.push_back(static_cast<std::int64_t>(a));
      rewards.push_back(step.reward);
      dts.push_back(step.dt);
    }
    archive.numbers("states", states);
    archive.numbers("actions", actions);
    archive.numbers("rewards", rewards);
    serialize_durations(dts, rewards.size(), archive);
    archive.fixed("next_state", {self.next_state_.size()}, self.next_state_);
    if constexpr (Archive::kReads) {
      const std::size_t n_inputs = self.next_state_.size();
      const std::size_t n_dimensions = self.steps_.front().action.size();
      const std::size_t n = rewards.size();
      archive.expect(n <= self.steps_.size(), "rewards", "no more than n_steps");
      archive.expect(states.size() == n * n_inputs, "states", "n_inputs per reward");
      archive.expect(actions.size() == n * n_dimensions, "actions", "those of every reward");
      const auto is_index = [](std::int64_t a) { return std::in_range<std::size_t>(a); };
      archive.expect(std::ranges::all_of(actions, is_index), "actions", "of actions");
      archive.expect(core::are_finite(rewards), "rewards", "finite");
      archive.expect(core::are_unit_values(states), "states", "in [0, 1]");
      archive.expect(core::are_unit_values(self.next_state_), "next_state", "in [0, 1]");
      self.first_ = 0;
      self.n_steps_ = n;
      for (std::size_t i = 0; i < n; ++i) {
        std::copy_n(states.begin() + static_cast<std::ptrdiff_t>(i * n_inputs), n_inputs,
                    self.steps_[i].state.begin());
        for (std::size_t d = 0; d < n_dimensions; ++d) {
          self.steps_[i].action[d] = static_cast<std::size_t>(actions[i * n_dimensions + d]);
        }
        self.steps_[i].reward = rewards[i];
        self.steps_[i].dt = dts[i];
      }
    }
  }

 private:
  std::vector<Step> steps_;  ///< a ring: step i, from the oldest, is at (first_ + i) % size
  std::size_t first_ = 0;
  std::size_t n_steps_ = 0;
  std::vector<double> next_state_;  ///< after the newest step
};

}  // namespace sdnn::agents
