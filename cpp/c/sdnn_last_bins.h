/* The states of a Q(lambda) agent, where they are those of single observations. */
#ifndef SDNN_LAST_BINS_H
#define SDNN_LAST_BINS_H

#include "sdnn_observation.h"

#define SDNN_REMEMBERS 0

typedef struct {
  uint32_t next_bins[SDNN_N_INPUTS]; /* where the last transition ended */
} sdnn_states;

static inline void sdnn_forget(sdnn_states* states) { (void)states; }

/* The bins of the state in which the agent acts. */
static inline void sdnn_read_to_act(sdnn_states* states, const int32_t* observation, int explore,
                                    uint32_t* bins) {
  (void)states;
  (void)explore;
  sdnn_bins_of_fixed(observation, bins);
}
static inline void sdnn_note_act(sdnn_states* states, int explore, const uint32_t* action,
                                 const uint32_t* place) {
  (void)states;
  (void)explore;
  (void)action;
  (void)place;
}

/* The bins of the state of an observation; no step is taken. */
static inline void sdnn_read_only(const sdnn_states* states, const int32_t* observation,
                                  uint32_t* bins) {
  (void)states;
  sdnn_bins_of_fixed(observation, bins);
}

/* The bins of the state in which a transition starts. Returns whether the last one ended there. */
static inline uint32_t sdnn_read_first(const sdnn_states* states, const int32_t* observation,
                                       uint32_t* bins) {
  uint32_t i, is_next = 1;
  sdnn_bins_of_fixed(observation, bins);
  for (i = 0; i < SDNN_N_INPUTS; ++i) is_next &= states->next_bins[i] == bins[i];
  return is_next;
}

/* The bins of the state in which a transition ends. */
static inline void sdnn_read_next(sdnn_states* states, const uint32_t* action,
                                  const int32_t* next_observation, uint32_t* bins) {
  (void)states;
  (void)action;
  sdnn_bins_of_fixed(next_observation, bins);
}
static inline void sdnn_keep_next(sdnn_states* states, const int32_t* next_observation) {
  (void)states;
  (void)next_observation;
}

#endif /* SDNN_LAST_BINS_H */
