/* The states of a learning agent that replaces missing readings by the last ones. The episode from
 * which it learns and greedy episodes have separate readings; the caller provides the latter. See
 * cpp/include/sdnn/agents/last_readings.hpp. */
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

/* Holds the readings that are not missing, and returns all held ones. */
static inline const int32_t* sdnn_note_readings(sdnn_greedy_episode* readings,
                                                const int32_t* observation) {
  sdnn_hold_readings(readings->held, observation);
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
  sdnn_hold_readings(episode->held, observation);
  return episode->held;
}

/* Those of an observation of the episode from which the agent learns; nothing is noted. */
static inline void sdnn_read_held(const sdnn_greedy_episode* readings, const int32_t* observation,
                                  int32_t* held) {
  sdnn_copy_32(held, readings->held, SDNN_N_OBSERVED);
  sdnn_hold_readings(held, observation);
}

/* A reading clipped to its range; one that is missing stays so. */
static inline int32_t sdnn_limited(uint32_t i, int32_t reading) {
  const int32_t low = sdnn_limits[i][0], high = sdnn_limits[i][1];
  if (reading == SDNN_MISSING) return reading;
  return reading < low ? low : reading > high ? high : reading;
}

/* Whether two cosines and sines, 0 where they are missing, are those of one angle. */
static inline uint32_t sdnn_is_same_angle(const int32_t* a, const int32_t* b, uint32_t cosine,
                                          uint32_t sine) {
  int64_t x = SDNN_HELD(a[cosine] == SDNN_MISSING, 0, a[cosine]);
  int64_t u = SDNN_HELD(b[cosine] == SDNN_MISSING, 0, b[cosine]);
  const int64_t y = SDNN_HELD(a[sine] == SDNN_MISSING, 0, a[sine]);
  const int64_t v = SDNN_HELD(b[sine] == SDNN_MISSING, 0, b[sine]);
  if (x == 0 && y == 0) x = 1;
  if (u == 0 && v == 0) u = 1;
  return x * v == y * u && (x < 0) == (u < 0) && (y < 0) == (v < 0) && (x == 0) == (u == 0);
}

/* Whether two observations have the same state. */
static inline uint32_t sdnn_is_same_state(const int32_t* a, const int32_t* b) {
  uint32_t is_same = 1;
#undef SDNN_VARIABLE
#undef SDNN_CIRCULAR
#undef SDNN_ANGLE
#undef SDNN_SYMBOL
#define SDNN_VARIABLE(i, at, n_bins, low, width, bounds) \
  is_same &= sdnn_limited(at, a[at]) == sdnn_limited(at, b[at]);
#define SDNN_CIRCULAR(i, at, n_bins, low, width, rate, offset) is_same &= a[at] == b[at];
#define SDNN_ANGLE(i, cosine, sine, n_bins, bounds) \
  is_same &= sdnn_is_same_angle(a, b, cosine, sine);
#define SDNN_SYMBOL(i, at, n) \
  is_same &= sdnn_symbol_of_fixed(&a[at], n) == sdnn_symbol_of_fixed(&b[at], n);
  SDNN_INPUTS
  return is_same;
}

#endif /* SDNN_READINGS_H */
