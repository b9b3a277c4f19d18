/* Readings that are missing: SDNN_MISSING in fixed point, NaN or infinity in floating point.
 *
 * An agent with missing="hold" (SDNN_HOLDS) replaces them by the last readings of the episode, one
 * with missing="code" (SDNN_CODES) has a pattern for them. In other agents SDNN_MISSING is the
 * lowest reading, unless SDNN_REFUSES is defined before the include: then actions for an
 * observation that lacks readings are SDNN_REFUSED, values are 0, and nothing is remembered or
 * learned of it. */
#ifndef SDNN_MISSING_H
#define SDNN_MISSING_H

#include <stdint.h>

#define SDNN_MISSING INT32_MIN
#define SDNN_REFUSED UINT32_MAX

/* Whether one of n readings is missing. */
static inline int sdnn_lacks_int32_t(const int32_t* readings, uint32_t n) {
  for (; n > 0; --n) {
    if (*readings++ == SDNN_MISSING) return 1;
  }
  return 0;
}

/* The bin of an input that lacks a reading is that of its pattern, or the middle one of a number
 * before its first reading; the middle of a cosine or sine is 0. */
#ifdef SDNN_CODES
#define SDNN_CODED(lacks, n_bins, bin) ((lacks) ? (n_bins) : (bin))
#else
#define SDNN_CODED(lacks, n_bins, bin) (bin)
#endif
#ifdef SDNN_HOLDS
#define SDNN_HELD(lacks, middle, reading) ((lacks) ? (middle) : (reading))
#else
#define SDNN_HELD(lacks, middle, reading) (reading)
#endif
#define SDNN_NUMBER(lacks, n_bins, bin) \
  SDNN_CODED(lacks, n_bins, SDNN_HELD(lacks, (n_bins) / 2, bin))

/* Whether an action depends on earlier observations, which an episode remembers. */
#if defined(SDNN_HISTORY) || defined(SDNN_HOLDS)
#define SDNN_HAS_EPISODES
#endif

#if defined(SDNN_REFUSES) && !defined(SDNN_HOLDS) && !defined(SDNN_CODES)
#define SDNN_IS_REFUSED(type, observation) sdnn_lacks_##type(observation, SDNN_N_OBSERVED)
#else
#define SDNN_IS_REFUSED(type, observation) 0
#endif

/* Answers an observation that is refused. */
static inline void sdnn_refuse(uint32_t* action) {
  uint32_t d;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) action[d] = SDNN_REFUSED;
}

#ifdef SDNN_HOLDS
/* Replaces the last readings by those of an observation that are not missing. The variables of a
 * symbol are missing if one is. */
static inline void sdnn_hold_readings(int32_t* held, const int32_t* observation) {
  uint32_t part, i, at = 0;
  for (part = 0; part < SDNN_N_PARTS; ++part) {
    const uint32_t n = sdnn_part_sizes[part];
    const int lacks = sdnn_lacks_int32_t(observation + at, n);
    for (i = 0; i < n && !lacks; ++i) held[at + i] = observation[at + i];
    at += n;
  }
}

/* Forgets the last readings. */
static inline void sdnn_forget_held(int32_t* held) {
  uint32_t i;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) held[i] = SDNN_MISSING;
}
#endif

#endif /* SDNN_MISSING_H */
