/* The states of an agent with a linear readout that holds the last readings. */
#ifndef SDNN_HELD_OBSERVATIONS_H
#define SDNN_HELD_OBSERVATIONS_H

#include "sdnn_readings.h"

typedef struct {
  sdnn_greedy_episode readings;
  int32_t next[SDNN_N_OBSERVED]; /* where the last transition ended */
#ifndef SDNN_IS_ACTOR_CRITIC
  uint32_t next_bins[SDNN_N_INPUTS];
#endif
} sdnn_states;

static inline void sdnn_forget(sdnn_states* states) { sdnn_forget_readings(&states->readings); }

/* The bins of an observation in which the agent acts; its readings are held for later gaps. */
static inline void sdnn_read_to_act(sdnn_states* states, const int32_t* observation,
                                    uint32_t* bins) {
  sdnn_bins_of_fixed(sdnn_note_readings(&states->readings, observation), bins);
}
static inline void sdnn_note_act(sdnn_states* states, const uint32_t* action) {
  (void)states;
  (void)action;
}

/* The bins of an observation in which the agent acts greedily, in an episode of greedy steps. */
static inline void sdnn_read_greedily(const sdnn_states* states, sdnn_greedy_episode* episode,
                                      const int32_t* observation, uint32_t* bins) {
  sdnn_bins_of_fixed(sdnn_readings_of(&states->readings, episode, observation), bins);
}
/* Nothing to note: only agents with a history need greedy actions. */
static inline void sdnn_note_greedy(const sdnn_greedy_episode* episode, const uint32_t* action,
                                    const uint32_t* place) {
  (void)episode;
  (void)action;
  (void)place;
}

/* Begins a greedy episode, apart from the one of which the agent learns. */
static inline void sdnn_begin_greedy(const sdnn_states* states, sdnn_greedy_episode* episode) {
  sdnn_forget_held(episode->held);
  episode->n_reads = states->readings.n_reads;
}

/* The bins of an observation, without holding its readings. */
static inline void sdnn_read_only(const sdnn_states* states, const int32_t* observation,
                                  uint32_t* bins) {
  int32_t held[SDNN_N_OBSERVED];
  sdnn_read_held(&states->readings, observation, held);
  sdnn_bins_of_fixed(held, bins);
}

/* The bins of the observation after an action. */
static inline void sdnn_read_next(sdnn_states* states, const uint32_t* action,
                                  const int32_t* next_observation, uint32_t* bins) {
  (void)action;
  sdnn_read_to_act(states, next_observation, bins);
}

/* Stores where a transition ends: at the readings that are held. */
static inline void sdnn_keep_next(sdnn_states* states, const int32_t* next_observation) {
  (void)next_observation;
  sdnn_copy_32(states->next, states->readings.held, SDNN_N_OBSERVED);
}

/* The bins of the state in which a transition starts. Returns whether the last one ended there. */
static inline uint32_t sdnn_read_first(sdnn_states* states, const int32_t* observation,
                                       uint32_t* bins) {
  sdnn_read_to_act(states, observation, bins);
  return sdnn_is_same_state(states->next, states->readings.held);
}

#endif /* SDNN_HELD_OBSERVATIONS_H */
