/* The states of an agent that compares their bins, where they are those of single observations. */
#ifndef SDNN_LAST_BINS_H
#define SDNN_LAST_BINS_H

#include "sdnn_observation.h"

typedef struct {
  uint32_t next_bins[SDNN_N_INPUTS]; /* where the last transition ended */
} sdnn_states;

#include "sdnn_single_observations.h"

/* The bins of the state in which a transition starts. Returns whether the last one ended there. */
static inline uint32_t sdnn_read_first(sdnn_states* states, const int32_t* observation,
                                       uint32_t* bins) {
  uint32_t i, is_next = 1;
  sdnn_read_to_act(states, observation, bins);
  for (i = 0; i < SDNN_N_INPUTS; ++i) is_next &= states->next_bins[i] == bins[i];
  return is_next;
}

/* Notes where a transition ends: next_bins has it already, but for an actor-critic. */
static inline void sdnn_keep_next(sdnn_states* states, const int32_t* next_observation) {
#ifdef SDNN_IS_ACTOR_CRITIC
  sdnn_bins_of_fixed(next_observation, states->next_bins);
#else
  (void)states;
  (void)next_observation;
#endif
}

#endif /* SDNN_LAST_BINS_H */
