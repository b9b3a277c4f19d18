/* The code of a state with thermometers of single inputs: see
 * cpp/include/sdnn/approximators/detail/thermometers.hpp. */
#ifndef SDNN_THERMOMETERS_H
#define SDNN_THERMOMETERS_H

#include "sdnn_integers.h"
#include "sdnn_readout.h"

/* The number of units of an input's thermometer that are 1, in a bin. */
static inline uint32_t sdnn_n_units_above(uint32_t bin) {
  const uint32_t last = SDNN_LAST_THERMOMETER_BIN;
  uint64_t rest;
  return (uint32_t)sdnn_quotient((uint64_t)bin * 2 * SDNN_N_THERMOMETER_UNITS + last, 2 * last,
                                 &rest);
}

/* The code of pairs of inputs, and after its columns those of thermometers. */
static inline void sdnn_encode_state(const uint32_t* bins, sdnn_code* code) {
  const uint32_t n = SDNN_N_THERMOMETERS, n_units = SDNN_N_THERMOMETER_UNITS;
  uint32_t column = UINT32_C(1) * SDNN_N_GROUPS * SDNN_N_PATTERN_UNITS, i, k;
  sdnn_encode(&sdnn_the_coding, bins, code);
  for (i = 0; i < n; ++i) {
    const uint32_t bin = code->bins[sdnn_thermometers[i]], n_above = sdnn_n_units_above(bin);
    for (k = 0; k < n_units; ++k, ++column) {
      if (SDNN_CODED(bin + 1 == sdnn_n_bins[sdnn_thermometers[i]], 1, 0)) continue;
      if (k < n_above) {
        code->columns[code->n_positive++] = (sdnn_column)column;
      } else {
        code->columns[SDNN_MOST_COLUMNS - ++code->n_negative] = (sdnn_column)column;
      }
    }
  }
}

#endif /* SDNN_THERMOMETERS_H */
