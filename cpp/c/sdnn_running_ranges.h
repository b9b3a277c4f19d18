/* The states of an actor-critic whose ranges follow what is observed: see
 * cpp/include/sdnn/agents/running_ranges.hpp and detail/last_states.hpp. */
#ifndef SDNN_RUNNING_RANGES_H
#define SDNN_RUNNING_RANGES_H

#include "sdnn_elementary.h"
#include "sdnn_missing.h"
#include "sdnn_real_inputs.h"

#undef SDNN_HAS_EPISODES /* greedy actions have no memory */
#define SDNN_REMEMBERS 1
#define SDNN_EPISODE_PARAMETER
#define SDNN_EPISODE
#define SDNN_MOST_NOTED (UINT64_C(1) << 40)
#define SDNN_RANGES_BYTES (UINT32_C(24) * SDNN_N_OBSERVED)

/* The moments of each observed number, and the ranges that follow from them. */
typedef struct {
  uint64_t counts[SDNN_N_OBSERVED];
  sdnn_real means[SDNN_N_OBSERVED];
  sdnn_real squares[SDNN_N_OBSERVED]; /* sums of squared differences from the mean */
  sdnn_real low[SDNN_N_OBSERVED], width[SDNN_N_OBSERVED];
} sdnn_ranges;

/* The last state. It is kept and not computed again: changed ranges would make it another one. */
typedef struct {
  sdnn_ranges ranges;
  sdnn_real state[SDNN_N_INPUTS];
  sdnn_real next[SDNN_N_INPUTS]; /* where the last transition ended */
  int32_t observation[SDNN_N_OBSERVED];
  uint8_t has_begun;
  uint8_t is_noted; /* whether the ranges have followed the observation */
} sdnn_states;

/* The square root, rounded like IEEE 754, of a number that is not negative. */
static inline sdnn_real sdnn_root(sdnn_real x) {
  int32_t exponent, i;
  uint64_t radicand, root = 0, rest = 0;
  if (x << 1 == 0) return x;
  radicand = sdnn_fraction(x, &exponent) << 10;
  if (exponent & 1) {
    radicand <<= 1;
    --exponent;
  }
  for (i = 0; i < 55; ++i, radicand <<= 2) { /* 27 pairs of digits, then zeros */
    const uint64_t trial = root << 2 | 1;
    rest = rest << 2 | radicand >> 62;
    root <<= 1;
    if (rest >= trial) {
      rest -= trial;
      root |= 1;
    }
  }
  return sdnn_rounded(0, root << 1 | (rest != 0), exponent / 2 - 29);
}

/* Sets a range to the mean plus and minus 2.5 standard deviations. */
static inline void sdnn_set_range(sdnn_ranges* ranges, uint32_t i) {
  const sdnn_real deviations = UINT64_C(0x4004000000000000); /* 2.5 */
  const sdnn_real rounding = UINT64_C(0x3eb0c6f7a0b5ed8d);   /* 1e-6 */
  const sdnn_real smallest = UINT64_C(0x22de7c5f127bd87e);   /* 1e-140 */
  const sdnn_real mean = ranges->means[i];
  sdnn_real least = sdnn_times(rounding, mean & ~SDNN_MINUS), deviation = SDNN_ONE;
  if (sdnn_less(least, smallest)) least = smallest;
  if (ranges->counts[i] > 1) {
    deviation =
        sdnn_root(sdnn_over(ranges->squares[i], sdnn_real_of((int64_t)ranges->counts[i] - 1, 0)));
  }
  if (sdnn_less(deviation, least)) deviation = least;
  deviation = sdnn_times(deviations, deviation);
  ranges->low[i] = sdnn_minus(mean, deviation);
  ranges->width[i] = sdnn_minus(sdnn_plus(mean, deviation), ranges->low[i]);
}

/* Lets ranges follow an observation. */
static inline void sdnn_note_observation(sdnn_ranges* ranges, const int32_t* observation) {
  uint32_t i;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) {
    const sdnn_real x = sdnn_real_of(observation[i], -SDNN_FRACTION_BITS);
    const sdnn_real difference = sdnn_minus(x, ranges->means[i]);
    if (ranges->counts[i] < SDNN_MOST_NOTED) ++ranges->counts[i];
    ranges->means[i] = sdnn_plus(
        ranges->means[i], sdnn_over(difference, sdnn_real_of((int64_t)ranges->counts[i], 0)));
    ranges->squares[i] =
        sdnn_plus(ranges->squares[i], sdnn_times(difference, sdnn_minus(x, ranges->means[i])));
    sdnn_set_range(ranges, i);
  }
}

/* Reads moments from an image or writes them; returns where it continues. */
static inline uint8_t* sdnn_carry_ranges(uint8_t* at, sdnn_ranges* ranges, int reads) {
  uint32_t i;
  at = sdnn_carry_64(at, ranges->counts, SDNN_N_OBSERVED, reads);
  at = sdnn_carry_64(at, ranges->means, SDNN_N_OBSERVED, reads);
  at = sdnn_carry_64(at, ranges->squares, SDNN_N_OBSERVED, reads);
  for (i = 0; i < SDNN_N_OBSERVED && reads; ++i) sdnn_set_range(ranges, i);
  return at;
}

/* Whether an image has possible moments at this place, of readings of 32 bits. */
static inline int sdnn_are_ranges(const uint8_t* at) {
  const sdnn_real most_mean = UINT64_C(0x41f0000000000000);   /* 2^32 */
  const sdnn_real most_square = UINT64_C(0x4680000000000000); /* 2^105 */
  uint32_t i;
  for (i = 0; i < SDNN_N_OBSERVED; ++i, at += 8) {
    if (sdnn_get(at, 8) > SDNN_MOST_NOTED ||
        (sdnn_get(at + UINT32_C(8) * SDNN_N_OBSERVED, 8) & ~SDNN_MINUS) > most_mean ||
        sdnn_get(at + UINT32_C(16) * SDNN_N_OBSERVED, 8) > most_square) {
      return 0;
    }
  }
  return 1;
}

#include "sdnn_bins_of_state.h"

/* The state of an observation by the present ranges. */
static inline void sdnn_scale_observation(const sdnn_ranges* ranges, const int32_t* observation,
                                          sdnn_real* inputs) {
  uint32_t i;
#define SDNN_READING(i) sdnn_real_of(observation[i], -SDNN_FRACTION_BITS)
  SDNN_INPUTS
#undef SDNN_READING
  for (i = 0; i < SDNN_N_INPUTS; ++i) inputs[i] = sdnn_in_unit(inputs[i]);
}

/* Whether it is the observation of the last state. */
static inline uint32_t sdnn_is_last(const sdnn_states* states, const int32_t* observation) {
  uint32_t i, is_same = states->has_begun;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) is_same &= states->observation[i] == observation[i];
  return is_same;
}

/* Makes an observation that of the last state. */
static inline void sdnn_set_state(sdnn_states* states, const int32_t* observation,
                                  uint8_t is_noted) {
  sdnn_scale_observation(&states->ranges, observation, states->state);
  sdnn_copy_32(states->observation, observation, SDNN_N_OBSERVED);
  states->has_begun = 1;
  states->is_noted = is_noted;
}

static inline void sdnn_forget(sdnn_states* states) { states->has_begun = 0; }

/* The bins of the state in which the agent acts. */
static inline void sdnn_read_to_act(sdnn_states* states, const int32_t* observation,
                                    uint32_t* bins) {
  if (!sdnn_is_last(states, observation)) sdnn_set_state(states, observation, 0);
  sdnn_bins_of_state(states->state, bins);
}
static inline void sdnn_note_act(sdnn_states* states, const uint32_t* action) {
  (void)states;
  (void)action;
}

/* The bins of the state of an observation; no step is taken. */
static inline void sdnn_read_only(const sdnn_states* states, const int32_t* observation,
                                  uint32_t* bins) {
  sdnn_real state[SDNN_N_INPUTS];
  sdnn_scale_observation(&states->ranges, observation, state);
  sdnn_bins_of_state(state, bins);
}

/* The bins of the state in which the agent acts greedily. */
static inline void sdnn_read_greedily(const sdnn_states* states, const int32_t* observation,
                                      uint32_t* bins) {
  if (sdnn_is_last(states, observation)) {
    sdnn_bins_of_state(states->state, bins);
  } else {
    sdnn_read_only(states, observation, bins);
  }
}
static inline void sdnn_note_greedy(const uint32_t* action, const uint32_t* place) {
  (void)action;
  (void)place;
}

/* The bins of the state in which a transition starts. Returns whether the last one ended there. */
static inline uint32_t sdnn_read_first(sdnn_states* states, const int32_t* observation,
                                       uint32_t* bins) {
  uint32_t i, is_next = 1;
  sdnn_read_to_act(states, observation, bins);
  for (i = 0; i < SDNN_N_INPUTS; ++i) is_next &= states->next[i] == states->state[i];
  return is_next;
}

/* The bins of the state in which a transition ends, whose start was read before. Ranges follow each
 * observation once. */
static inline void sdnn_read_next(sdnn_states* states, const uint32_t* action,
                                  const int32_t* next_observation, uint32_t* bins) {
  (void)action;
  if (!states->is_noted) sdnn_note_observation(&states->ranges, states->observation);
  sdnn_note_observation(&states->ranges, next_observation);
  sdnn_set_state(states, next_observation, 1);
  sdnn_bins_of_state(states->state, bins);
}

/* Notes that the agent has learned the transition that was read. */
static inline void sdnn_keep_next(sdnn_states* states, const int32_t* next_observation) {
  uint32_t i;
  (void)next_observation;
  for (i = 0; i < SDNN_N_INPUTS; ++i) states->next[i] = states->state[i];
}

#endif /* SDNN_RUNNING_RANGES_H */
