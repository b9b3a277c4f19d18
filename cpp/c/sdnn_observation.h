/* Converts readings to the code of a state. All exported agents share it.
 *
 * The exporter writes the sizes (SDNN_N_INPUTS, ...) and tables before this file, and replaces the
 * prefixes sdnn_ and SDNN_ by the name of the header. SDNN_INPUTS lists the inputs. */
#ifndef SDNN_OBSERVATION_H
#define SDNN_OBSERVATION_H

#include <stdint.h>

#ifndef SDNN_N_COLUMNS
#define SDNN_N_COLUMNS (UINT32_C(1) * SDNN_N_GROUPS * SDNN_N_PATTERN_UNITS)
#endif
#if SDNN_N_COLUMNS <= 65536
typedef uint16_t sdnn_column;
#else
typedef uint32_t sdnn_column;
#endif
#if SDNN_N_PATTERN_UNITS <= 256
typedef uint8_t sdnn_unit;
#else
typedef uint16_t sdnn_unit;
#endif
#define SDNN_PATTERN_BYTES ((SDNN_N_PATTERN_UNITS + UINT32_C(7)) / 8)

/* The constants of a code. */
typedef struct {
  const uint8_t* patterns;   /* of every bin of every input, from the lowest bit on */
  const uint16_t* modified;  /* the input that each group of columns has the pattern of */
  const uint16_t* modifiers; /* the input that switches units of the group off */
  const sdnn_unit* units;    /* of each group: units of the modified pattern, one a column */
} sdnn_coding;

/* A state: its bins, and the columns of its code that are not 0. Columns that are 1 are listed from
 * the beginning, columns that are -1 from the end. */
typedef struct {
  uint32_t n_positive, n_negative;
  uint32_t bins[SDNN_N_INPUTS];
  sdnn_column columns[SDNN_MOST_COLUMNS];
} sdnn_code;

/* A constant in fixed point, rounded to the nearest: the compiler computes it. */
#define SDNN_FIXED(x) \
  ((int32_t)((x) * (double)(INT32_C(1) << SDNN_FRACTION_BITS) + ((x) < 0.0 ? -0.5 : 0.5)))

static inline uint32_t sdnn_bit(const uint8_t* bits, uint32_t k) {
  return ((uint32_t)bits[k >> 3] >> (k & 7)) & 1;
}

/* Whether a group and the next one are stored as half their sum and half their difference. */
static inline uint32_t sdnn_is_double(uint32_t group) {
#if SDNN_N_DOUBLE_GROUPS > 0 && SDNN_N_DOUBLE_GROUPS < SDNN_N_GROUPS
  return group < SDNN_N_DOUBLE_GROUPS;
#else
  (void)group;
  return SDNN_N_DOUBLE_GROUPS > 0;
#endif
}

/* Computes the selectively desensitized code: for each pair of inputs the pattern of one, neutral
 * (0) where the pattern of the other is -1. Two patterns with the same modifier are stored as half
 * their sum and half their difference, one of which is 0. */
static inline void sdnn_encode(const sdnn_coding* coding, const uint32_t* bins, sdnn_code* code) {
  const uint8_t* patterns[SDNN_N_INPUTS];
  const uint8_t* first = coding->patterns;
  const sdnn_unit* unit = coding->units;
  sdnn_column *positive = &code->columns[0], *negative = positive + SDNN_MOST_COLUMNS;
  uint32_t i, group, byte;
  for (i = 0; i < SDNN_N_INPUTS; ++i) {
    const uint32_t last = sdnn_n_bins[i] - 1;
    code->bins[i] = bins[i] < last ? bins[i] : last;
    patterns[i] = first + code->bins[i] * SDNN_PATTERN_BYTES;
    first += (last + 1) * SDNN_PATTERN_BYTES;
  }
  for (group = 0; group < SDNN_N_GROUPS; ++group) {
    const uint32_t is_double = sdnn_is_double(group);
    const uint8_t* const modifier = patterns[coding->modifiers[group]];
    const uint8_t* const modified = patterns[coding->modified[group]];
    const uint8_t* const second = is_double ? patterns[coding->modified[group + 1]] : modified;
    for (byte = 0; byte < SDNN_PATTERN_BYTES; ++byte) {
      uint32_t bits = modifier[byte], k = 8 * byte;
      for (; bits != 0; bits >>= 1, ++k) {
        if (bits & 1) {
          const uint32_t sign = sdnn_bit(modified, unit[k]);
          uint32_t column = group * SDNN_N_PATTERN_UNITS + k;
          if (is_double && sdnn_bit(second, unit[SDNN_N_PATTERN_UNITS + k]) != sign) {
            column += SDNN_N_PATTERN_UNITS;
          }
          *(sign ? positive++ : --negative) = (sdnn_column)column;
        }
      }
    }
    group += is_double;
    unit += (1 + is_double) * SDNN_N_PATTERN_UNITS;
  }
  code->n_positive = (uint32_t)(positive - code->columns);
  code->n_negative = (uint32_t)(code->columns + SDNN_MOST_COLUMNS - negative);
}

/* The bin of a reading. `bounds` has the least reading in each bin, from bin 1 on. */
static inline uint32_t sdnn_bin_between(const int32_t* bounds, uint32_t n_bins, int32_t reading) {
  uint32_t low = 0, high = n_bins; /* the bin is in [low, high) */
  while (high - low > 1) {
    const uint32_t middle = low + (high - low) / 2;
    if (reading >= bounds[middle - 1]) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

/* The bin of an angle, which is a part of a turn, times 2^64. Whole turns overflow and vanish. */
static inline uint32_t sdnn_bin_of_turn(uint64_t turn, uint32_t n_bins) {
  return (uint32_t)(((turn >> 32) * n_bins) >> 32);
}

/* The bin of the angle of a point at any distance. `bounds` has cosine and sine of the angles where
 * bins begin, from bin 1 on. */
static inline uint32_t sdnn_bin_of_direction(const int32_t (*bounds)[2], uint32_t n_bins,
                                             int32_t cosine, int32_t sine) {
  uint32_t low = sine < 0 ? 0 : n_bins / 2;
  uint32_t high = sine < 0 ? (n_bins + 1) / 2 : n_bins;
  if (sine == 0 && cosine == 0) cosine = 1; /* as atan2 does */
  while (high - low > 1) {
    const uint32_t middle = low + (high - low) / 2;
    const int32_t* const bound = bounds[middle - 1];
    if ((int64_t)bound[0] * sine >= (int64_t)bound[1] * cosine) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

/* The number of the reading that is 1, where the others are 0. */
static inline uint32_t sdnn_symbol_of_fixed(const int32_t* readings, uint32_t n) {
  uint32_t k, symbol = 0;
  for (k = 1; k < n; ++k) {
    if (readings[k] > readings[symbol]) symbol = k;
  }
  return symbol;
}

#include "sdnn_missing.h"

#ifndef SDNN_HISTORY
/* The bins of all inputs, from readings in fixed point. */
static inline void sdnn_bins_of_fixed(const int32_t* observation, uint32_t* bins) {
#define SDNN_VARIABLE(i, at, n_bins, low, width, bounds) \
  bins[i] = SDNN_NUMBER(SDNN_LACKS(at), n_bins, sdnn_bin_between(bounds, n_bins, observation[at]));
#define SDNN_CIRCULAR(i, at, n_bins, low, width, rate, offset) \
  bins[i] = SDNN_NUMBER(                                       \
      SDNN_LACKS(at), n_bins,                                  \
      sdnn_bin_of_turn((rate) * (uint64_t)(int64_t)observation[at] + (offset), n_bins));
#define SDNN_ANGLE(i, cosine, sine, n_bins, bounds)                                                \
  bins[i] = SDNN_CODED(                                                                            \
      SDNN_LACKS(cosine) || SDNN_LACKS(sine), n_bins,                                              \
      sdnn_bin_of_direction(bounds, n_bins, SDNN_HELD(SDNN_LACKS(cosine), 0, observation[cosine]), \
                            SDNN_HELD(SDNN_LACKS(sine), 0, observation[sine])));
#define SDNN_SYMBOL(i, at, n)                                      \
  bins[i] = SDNN_CODED(sdnn_lacks_int32_t(&observation[at], n), n, \
                       sdnn_symbol_of_fixed(&observation[at], n));
#define SDNN_LACKS(i) (observation[i] == SDNN_MISSING)
  SDNN_INPUTS
#undef SDNN_LACKS
}
#endif

#endif /* SDNN_OBSERVATION_H */
