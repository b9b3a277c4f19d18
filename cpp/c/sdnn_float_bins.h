/* The bins of observations in floating point, with SDNN_USE_FLOAT defined before the include. */
#ifndef SDNN_FLOAT_BINS_H
#define SDNN_FLOAT_BINS_H

#include "sdnn_float_readings.h"
#include "sdnn_observation.h"

#ifdef SDNN_USE_FLOAT
/* Floating point gives the bins of the agent where doubles are IEEE 754 and not reordered (no
 * -ffast-math, no x87). NaN counts as the lowest reading. A cosine and sine of which one is NaN or
 * infinite count as the angle 0. */

/* The bin of a number in [0, 1]; numbers beyond are clipped, and NaN counts as 0. */
static inline uint32_t sdnn_bin_of_unit(double unit, uint32_t n_bins) {
  uint32_t bin;
  if (!(unit > 0.0)) return 0;
  if (unit >= 1.0) return n_bins - 1;
  bin = (uint32_t)(unit * (double)n_bins);
  return bin < n_bins ? bin : n_bins - 1;
}

/* The fraction of a number of turns, in [0, 1]; tiny negative numbers give 1. From 2^52 on, a
 * double has no fraction. */
static inline double sdnn_part_of_turn(double turns) {
  double whole;
  if (!(turns > -4503599627370496.0 && turns < 4503599627370496.0)) return 0.0;
  whole = (double)(int64_t)turns;
  if (whole > turns) whole -= 1.0;
  return turns - whole;
}

/* The bin of an angle by its cosine and sine, scaled to integers of up to 2^30. Without a
 * direction, the bin of angle 0. */
static inline uint32_t sdnn_bin_of_doubles(const int32_t (*bounds)[2], uint32_t n_bins,
                                           double cosine, double sine) {
  const double x = cosine < 0.0 ? -cosine : cosine;
  const double y = sine < 0.0 ? -sine : sine;
  const double largest = x > y ? x : y;
  if (!(largest > 0.0 && x <= 1.7976931348623157e308 && y <= 1.7976931348623157e308)) {
    return sdnn_bin_of_direction(bounds, n_bins, 1, 0);
  }
  return sdnn_bin_of_direction(bounds, n_bins, (int32_t)(cosine / largest * 1073741824.0),
                               (int32_t)(sine / largest * 1073741824.0));
}

/* The symbol of a one-hot code: the number of the largest reading, the first of equals. */
static inline uint32_t sdnn_symbol_of_double(const double* readings, uint32_t n) {
  uint32_t k, symbol = 0;
  for (k = 1; k < n; ++k) {
    if (readings[k] > readings[symbol] || !(readings[symbol] == readings[symbol])) symbol = k;
  }
  return symbol;
}

/* The bins of all inputs, from an observation in its own units. */
static inline void sdnn_bins_of_double(const double* observation, uint32_t* bins) {
#undef SDNN_VARIABLE
#undef SDNN_CIRCULAR
#undef SDNN_ANGLE
#undef SDNN_SYMBOL
#define SDNN_VARIABLE(i, at, n_bins, low, width, bounds) \
  bins[i] = SDNN_NUMBER(SDNN_LACKS(at), n_bins,          \
                        sdnn_bin_of_unit((observation[at] - (low)) / (width), n_bins));
#define SDNN_CIRCULAR(i, at, n_bins, low, width, rate, offset) \
  bins[i] = SDNN_NUMBER(                                       \
      SDNN_LACKS(at), n_bins,                                  \
      sdnn_bin_of_unit(sdnn_part_of_turn((observation[at] - (low)) / (width)), n_bins));
#define SDNN_ANGLE(i, cosine, sine, n_bins, bounds)                                                \
  bins[i] = SDNN_CODED(                                                                            \
      SDNN_LACKS(cosine) || SDNN_LACKS(sine), n_bins,                                              \
      sdnn_bin_of_doubles(bounds, n_bins, SDNN_HELD(SDNN_LACKS(cosine), 0.0, observation[cosine]), \
                          SDNN_HELD(SDNN_LACKS(sine), 0.0, observation[sine])));
#define SDNN_SYMBOL(i, at, n)                                               \
  bins[i] = SDNN_CODED(sdnn_lacks_double(&observation[at], n), n,           \
                       SDNN_HELD(sdnn_lacks_double(&observation[at], n), 0, \
                                 sdnn_symbol_of_double(&observation[at], n)));
#define SDNN_LACKS(i) sdnn_lacks_double(&observation[i], 1)
  SDNN_INPUTS
#undef SDNN_LACKS
}

/* Like sdnn_bins_of_double, for an observation of floats. */
static inline void sdnn_bins_of_float(const float* observation, uint32_t* bins) {
  double doubles[SDNN_N_OBSERVED];
  uint32_t i;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) doubles[i] = (double)observation[i];
  sdnn_bins_of_double(doubles, bins);
}
#endif /* SDNN_USE_FLOAT */

#endif /* SDNN_FLOAT_BINS_H */
