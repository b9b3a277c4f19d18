/* Learning a transition of any duration, for agents that are exported with durations. */
#ifndef SDNN_LEARN_OVER_H
#define SDNN_LEARN_OVER_H

#if SDNN_N_DIMENSIONS == 1
#define SDNN_ACTION_PARAMETER uint32_t action
#else
#define SDNN_ACTION_PARAMETER const uint32_t* action
#endif

/* Learns a transition of dt usual steps, times 2^16: the next value counts by discount^dt. One of
 * less than 0.001 is not learned. */
static inline void sdnn_learn_over(sdnn_agent* agent, const int32_t* observation,
                                   SDNN_ACTION_PARAMETER, int32_t reward,
                                   const int32_t* next_observation, int terminated, uint32_t dt) {
  if (dt < SDNN_SHORTEST_DURATION) return;
  if (dt != SDNN_USUAL_DURATION) agent->durations.given = sdnn_factors_of(dt);
  sdnn_learn(agent, observation, action, reward, next_observation, terminated);
  agent->durations.given.discount = agent->durations.given.decay = 0;
}

#endif /* SDNN_LEARN_OVER_H */
