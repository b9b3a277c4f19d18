/* Missing readings in floating point, with SDNN_USE_FLOAT defined before the include. */
#ifndef SDNN_FLOAT_READINGS_H
#define SDNN_FLOAT_READINGS_H

#include "sdnn_missing.h"

#ifdef SDNN_USE_FLOAT
/* Whether one of n readings is NaN or infinite. */
static inline int sdnn_lacks_double(const double* readings, uint32_t n) {
  const double largest = 1.7976931348623157e308;
  for (; n > 0; --n, ++readings) {
    if (!(*readings >= -largest && *readings <= largest)) return 1;
  }
  return 0;
}
/* Whether one of n readings is missing. */
static inline int sdnn_lacks_float(const float* readings, uint32_t n) {
  for (; n > 0; --n, ++readings) {
    const double reading = (double)*readings;
    if (sdnn_lacks_double(&reading, 1)) return 1;
  }
  return 0;
}

#ifdef SDNN_HOLDS
/* Like sdnn_hold_readings and sdnn_forget_held, with NaN for readings that are not known yet. */
static inline void sdnn_hold_doubles(double* held, const double* observation) {
  uint32_t part, i, at = 0;
  for (part = 0; part < SDNN_N_PARTS; ++part) {
    const uint32_t n = sdnn_part_sizes[part];
    const int lacks = sdnn_lacks_double(observation + at, n);
    for (i = 0; i < n && !lacks; ++i) held[at + i] = observation[at + i];
    at += n;
  }
}
/* Makes all held readings NaN, which stands for none. */
static inline void sdnn_forget_held_doubles(double* held) {
  union {
    uint64_t bits;
    double number;
  } nothing;
  uint32_t i;
  nothing.bits = UINT64_C(0x7ff8) << 48;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) held[i] = nothing.number;
}
#endif
#endif

#endif /* SDNN_FLOAT_READINGS_H */
