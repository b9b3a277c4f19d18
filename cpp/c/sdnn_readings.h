/* The states of a learning agent that holds the last readings, where they are those of single
 * observations: of the episode from which it learns, and of greedy steps beside it, whose memory
 * the caller places. See cpp/include/sdnn/agents/last_readings.hpp. */
#ifndef SDNN_READINGS_H
#define SDNN_READINGS_H

#include "sdnn_observation.h"

#define SDNN_REMEMBERS 1
#define SDNN_EPISODE_PARAMETER sdnn_greedy_episode *episode,
#define SDNN_EPISODE episode,

/* The last readings. Unless greedy steps begin an episode, they continue that of which the agent
 * learns. */
typedef struct {
  int32_t held[SDNN_N_OBSERVED];
  uint32_t n_reads; /* observations that were read since the agent began, modulo 2^32 */
} sdnn_greedy_episode;

static inline void sdnn_forget_readings(sdnn_greedy_episode* readings) {
  sdnn_forget_held(readings->held);
  ++readings->n_reads;
}

static inline const int32_t* sdnn_note_readings(sdnn_greedy_episode* readings,
                                                const int32_t* observation) {
  sdnn_hold(readings->held, observation);
  ++readings->n_reads;
  return readings->held;
}

/* The readings of a greedy step: those that the agent holds, or those of a greedy episode. */
static inline const int32_t* sdnn_readings_of(const sdnn_greedy_episode* readings,
                                              sdnn_greedy_episode* episode,
                                              const int32_t* observation) {
  if (episode->n_reads != readings->n_reads) {
    sdnn_copy_32(episode->held, readings->held, SDNN_N_OBSERVED);
    episode->n_reads = readings->n_reads;
  }
  sdnn_hold(episode->held, observation);
  return episode->held;
}

/* Those of an observation of the episode from which the agent learns; nothing is noted. */
static inline void sdnn_read_held(const sdnn_greedy_episode* readings, const int32_t* observation,
                                  int32_t* held) {
  sdnn_copy_32(held, readings->held, SDNN_N_OBSERVED);
  sdnn_hold(held, observation);
}

#endif /* SDNN_READINGS_H */
