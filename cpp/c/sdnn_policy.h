/* The functions of a greedy policy. The file that includes this one defines sdnn_greedy_in_each.
 *
 *   int32_t observation[SDNN_N_OBSERVED]; // in its units, times 2^SDNN_FRACTION_BITS
 *   uint32_t action = sdnn_greedy(observation); // the number of the best action
 *
 * With several dimensions of actions: sdnn_greedy(observation, action), with an array of
 * SDNN_N_DIMENSIONS numbers. sdnn_action_fixed has the actions of a box, times
 * 2^SDNN_FRACTION_BITS; other actions begin at sdnn_first_action. With SDNN_USE_FLOAT defined
 * before the include, sdnn_greedy_float and sdnn_greedy_double take observations in floating point,
 * and sdnn_action_float has the actions of a box. sdnn_greedy_bins takes the bins of all inputs. */
#ifndef SDNN_POLICY_H
#define SDNN_POLICY_H

#include "sdnn_observation.h"

#ifdef SDNN_USE_FLOAT
/* Floating point gives the bins of the agent where doubles are IEEE 754 and not reordered (no
 * -ffast-math, no x87). NaN counts as the lowest reading. A cosine and sine of which one is NaN or
 * infinite count as the angle 0. */

static inline uint32_t sdnn_bin_of_unit(double unit, uint32_t n_bins) {
  uint32_t bin;
  if (!(unit > 0.0)) return 0;
  if (unit >= 1.0) return n_bins - 1;
  bin = (uint32_t)(unit * (double)n_bins);
  return bin < n_bins ? bin : n_bins - 1;
}

static inline double sdnn_part_of_turn(double turns) {
  double whole;
  if (!(turns > -4503599627370496.0 && turns < 4503599627370496.0)) return 0.0;
  whole = (double)(int64_t)turns;
  if (whole > turns) whole -= 1.0;
  return turns - whole;
}

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
  bins[i] = sdnn_bin_of_unit((observation[at] - (low)) / (width), n_bins);
#define SDNN_CIRCULAR(i, at, n_bins, low, width, rate, offset) \
  bins[i] = sdnn_bin_of_unit(sdnn_part_of_turn((observation[at] - (low)) / (width)), n_bins);
#define SDNN_ANGLE(i, cosine, sine, n_bins, bounds) \
  bins[i] = sdnn_bin_of_doubles(bounds, n_bins, observation[cosine], observation[sine]);
#define SDNN_SYMBOL(i, at, n) bins[i] = sdnn_symbol_of_double(&observation[at], n);
  SDNN_INPUTS
}

static inline void sdnn_bins_of_float(const float* observation, uint32_t* bins) {
  double doubles[SDNN_N_OBSERVED];
  uint32_t i;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) doubles[i] = (double)observation[i];
  sdnn_bins_of_double(doubles, bins);
}
#endif /* SDNN_USE_FLOAT */

#if SDNN_N_DIMENSIONS == 1
static inline uint32_t sdnn_greedy_bins(const uint32_t* bins) {
  uint32_t action;
  sdnn_greedy_in_each(bins, &action);
  return action;
}
#define SDNN_POLICY(name, reading, bins_of, choose)         \
  static inline uint32_t name(const reading* observation) { \
    uint32_t bins[SDNN_N_INPUTS], action;                   \
    bins_of(observation, bins);                             \
    choose(bins, &action);                                  \
    return action;                                          \
  }
#else
static inline void sdnn_greedy_bins(const uint32_t* bins, uint32_t* action) {
  sdnn_greedy_in_each(bins, action);
}
#define SDNN_POLICY(name, reading, bins_of, choose)                       \
  static inline void name(const reading* observation, uint32_t* action) { \
    uint32_t bins[SDNN_N_INPUTS];                                         \
    bins_of(observation, bins);                                           \
    choose(bins, action);                                                 \
  }
#endif

SDNN_POLICY(sdnn_greedy, int32_t, sdnn_bins_of_fixed, sdnn_greedy_in_each)
#ifdef SDNN_USE_FLOAT
SDNN_POLICY(sdnn_greedy_double, double, sdnn_bins_of_double, sdnn_greedy_in_each)
SDNN_POLICY(sdnn_greedy_float, float, sdnn_bins_of_float, sdnn_greedy_in_each)
#endif

#endif /* SDNN_POLICY_H */
