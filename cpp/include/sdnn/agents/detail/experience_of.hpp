/// Transitions in the states of an agent, for the test of relevance.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "sdnn/agents/last_readings.hpp"
#include "sdnn/agents/observations.hpp"
#include "sdnn/agents/relevance.hpp"
#include "sdnn/agents/reward_scale.hpp"
#include "sdnn/agents/warm_up.hpp"

namespace sdnn::agents::detail {

/// Transitions, one environment after the other. A reward that is not learned counts as 0.
inline RandomExperience experience_of(const Observations& fitted, const WarmUp& transitions,
                                      std::size_t n_dimensions) {
  std::vector<std::size_t> order(transitions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](auto t) { return transitions.step(t).environment; });
  RandomExperience experience{.n_inputs = fitted.n_inputs(), .circular = fitted.circular()};
  experience.actions.resize(n_dimensions);
  RewardScale scale(transitions.rewards());
  LastReadings readings = fitted.last_readings();
  std::vector<double> state(fitted.n_inputs());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const WarmUp::Step step = transitions.step(order[k]);
    if (step.begins) readings.forget(step.environment);
    const auto [observation, next_observation] =
        readings.filled(step.observation, step.next_observation, step.environment);
    readings.note_step(step.environment);
    fitted.scale(observation, state);
    experience.states.insert(experience.states.end(), state.begin(), state.end());
    fitted.scale(next_observation, state, "next_observation");
    experience.next_states.insert(experience.next_states.end(), state.begin(), state.end());
    for (std::size_t d = 0; d < n_dimensions; ++d) {
      experience.actions[d].push_back(step.action[d]);
    }
    experience.rewards.push_back(scale.accepts(step.reward) ? step.reward : 0.0);
    if (k > 0 && step.begins) experience.ends.back() = true;
    experience.ends.push_back(step.terminated);
  }
  return experience;
}

}  // namespace sdnn::agents::detail
