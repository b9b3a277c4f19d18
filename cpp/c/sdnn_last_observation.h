/* The states of an actor-critic, where they are those of single observations. */
#ifndef SDNN_LAST_OBSERVATION_H
#define SDNN_LAST_OBSERVATION_H

#include "sdnn_observation.h"

typedef struct {
  int32_t next[SDNN_N_OBSERVED]; /* where the last transition ended */
} sdnn_states;

#include "sdnn_single_observations.h"

/* Stores the observation in which a transition ends, clipped to the ranges. Returns whether it is
 * the observation that was stored before. */
static inline uint32_t sdnn_keep_next(sdnn_states* states, const int32_t* observation) {
  uint32_t i, is_same = 1;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) {
    const int32_t low = sdnn_limits[i][0], high = sdnn_limits[i][1];
    const int32_t reading = observation[i];
    const int32_t limited = reading < low ? low : reading > high ? high : reading;
    is_same &= states->next[i] == limited;
    states->next[i] = limited;
  }
  return is_same;
}

/* The bins of the state in which a transition starts. Returns whether the last one ended there. */
static inline uint32_t sdnn_read_first(sdnn_states* states, const int32_t* observation,
                                       uint32_t* bins) {
  sdnn_bins_of_fixed(observation, bins);
  return sdnn_keep_next(states, observation);
}

#endif /* SDNN_LAST_OBSERVATION_H */
