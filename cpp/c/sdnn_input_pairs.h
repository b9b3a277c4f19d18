/* The code of a sample: for each pair of inputs the pattern of one, where the other is +1. */
#ifndef SDNN_INPUT_PAIRS_H
#define SDNN_INPUT_PAIRS_H

#include "sdnn_coded_inputs.h"

#if SDNN_N_COLUMNS <= 65536
typedef uint16_t sdnn_column;
#else
typedef uint32_t sdnn_column;
#endif

#define SDNN_NONE UINT32_MAX

/* Numbers of two inputs, the places of their tables among the patterns, and the place of the order
 * in which the modifier's units are read. SDNN_NONE: a plain pattern; the order of the table. */
typedef struct {
  uint16_t modified;
  uint16_t modifier;
  uint32_t table;
  uint32_t modifier_table;
  uint32_t order;
} sdnn_pair;

static const sdnn_pair sdnn_pairs[SDNN_N_PAIRS] = {SDNN_PAIRS};

#define SDNN_PATTERN_BYTES ((SDNN_N_PATTERN_UNITS + UINT32_C(7)) / 8)

/* The columns that are not 0: positive ones from the first on, negative ones at the end. */
typedef struct {
  sdnn_column columns[SDNN_MOST_COLUMNS];
  uint32_t n_positive, n_negative;
} sdnn_code;

static inline uint32_t sdnn_unit_of(const uint8_t* pattern, uint32_t unit) {
  return (uint32_t)pattern[unit >> 3] >> (unit & 7) & 1;
}

#if SDNN_HAS_EXCESSES
/* The sign of a column, the unit of a pair, in the code of a sample: 1, 0 or -1. */
static inline int32_t sdnn_sign_of(const uint32_t* bins, const sdnn_pair* pair, uint32_t unit) {
  const uint8_t* const pattern =
      sdnn_patterns + pair->table + bins[pair->modified] * SDNN_PATTERN_BYTES;
  if (pair->modifier_table != SDNN_NONE) {
    const uint32_t by = pair->order == SDNN_NONE ? unit : sdnn_orders[pair->order + unit];
    const uint32_t place = pair->modifier_table + bins[pair->modifier] * SDNN_PATTERN_BYTES;
    if (!sdnn_unit_of(sdnn_patterns + place, by)) return 0;
  }
  return sdnn_unit_of(pattern, unit) ? 1 : -1;
}
#endif

/* Lists the columns of a sample's code that are not 0: those of +1 from the beginning of
 * `columns`, those of -1 from its end. A unit is 0 where its modifier's unit is off. */
static inline void sdnn_encode(const uint32_t* bins, sdnn_code* code) {
  sdnn_column* positive = &code->columns[0];
  sdnn_column* negative = code->columns + SDNN_MOST_COLUMNS;
  uint32_t p, unit, column = 0;
  for (p = 0; p < SDNN_N_PAIRS; ++p) {
    const sdnn_pair* const pair = &sdnn_pairs[p];
    const uint8_t* const pattern =
        sdnn_patterns + pair->table + bins[pair->modified] * SDNN_PATTERN_BYTES;
    const uint32_t is_plain = pair->modifier_table == SDNN_NONE;
    const uint8_t* const modifier =
        is_plain ? pattern
                 : sdnn_patterns + pair->modifier_table + bins[pair->modifier] * SDNN_PATTERN_BYTES;
    for (unit = 0; unit < SDNN_N_PATTERN_UNITS; ++unit, ++column) {
      const uint32_t by = pair->order == SDNN_NONE ? unit : sdnn_orders[pair->order + unit];
      if (!is_plain && !sdnn_unit_of(modifier, by)) continue;
      if (sdnn_unit_of(pattern, unit)) {
        *positive++ = (sdnn_column)column;
      } else {
        *--negative = (sdnn_column)column;
      }
    }
  }
  code->n_positive = (uint32_t)(positive - code->columns);
  code->n_negative = (uint32_t)(code->columns + SDNN_MOST_COLUMNS - negative);
}

#endif /* SDNN_INPUT_PAIRS_H */
