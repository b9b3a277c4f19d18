/* Reads the states of a learning agent, where they are those of single observations. The file that
 * includes this one defines sdnn_states. */
#ifndef SDNN_SINGLE_OBSERVATIONS_H
#define SDNN_SINGLE_OBSERVATIONS_H

#include "sdnn_observation.h"

#define SDNN_REMEMBERS 0

static inline void sdnn_forget(sdnn_states* states) { (void)states; }

/* Greedy functions have no memory of an episode. */
#define SDNN_EPISODE_PARAMETER
#define SDNN_EPISODE

/* The bins of the state in which the agent acts. */
static inline void sdnn_read_to_act(sdnn_states* states, const int32_t* observation,
                                    uint32_t* bins) {
  (void)states;
  sdnn_bins_of_fixed(observation, bins);
}
static inline void sdnn_note_act(sdnn_states* states, const uint32_t* action) {
  (void)states;
  (void)action;
}

/* The bins of the state in which the agent acts greedily. */
static inline void sdnn_read_greedily(const sdnn_states* states, const int32_t* observation,
                                      uint32_t* bins) {
  (void)states;
  sdnn_bins_of_fixed(observation, bins);
}
static inline void sdnn_note_greedy(const uint32_t* action, const uint32_t* place) {
  (void)action;
  (void)place;
}

/* The bins of the state of an observation; no step is taken. */
static inline void sdnn_read_only(const sdnn_states* states, const int32_t* observation,
                                  uint32_t* bins) {
  (void)states;
  sdnn_bins_of_fixed(observation, bins);
}

/* The bins of the state in which a transition ends. */
static inline void sdnn_read_next(sdnn_states* states, const uint32_t* action,
                                  const int32_t* next_observation, uint32_t* bins) {
  (void)states;
  (void)action;
  sdnn_bins_of_fixed(next_observation, bins);
}

#endif /* SDNN_SINGLE_OBSERVATIONS_H */
