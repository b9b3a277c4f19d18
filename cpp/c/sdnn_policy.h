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

#include "sdnn_float_bins.h"
#include "sdnn_observation.h"

#if SDNN_N_DIMENSIONS == 1
/* The greedy action in a state, for actions of one dimension. */
static inline uint32_t sdnn_greedy_bins(const uint32_t* bins) {
  uint32_t action;
  sdnn_greedy_in_each(bins, &action);
  return action;
}
#define SDNN_POLICY(name, reading, bins_of, choose)                 \
  static inline uint32_t name(const reading* observation) {         \
    uint32_t bins[SDNN_N_INPUTS], action;                           \
    if (SDNN_IS_REFUSED(reading, observation)) return SDNN_REFUSED; \
    bins_of(observation, bins);                                     \
    choose(bins, &action);                                          \
    return action;                                                  \
  }
#else
/* Writes the greedy action in a state, a number for each dimension. */
static inline void sdnn_greedy_bins(const uint32_t* bins, uint32_t* action) {
  sdnn_greedy_in_each(bins, action);
}
#define SDNN_POLICY(name, reading, bins_of, choose)                       \
  static inline void name(const reading* observation, uint32_t* action) { \
    uint32_t bins[SDNN_N_INPUTS];                                         \
    if (SDNN_IS_REFUSED(reading, observation)) {                          \
      sdnn_refuse(action);                                                \
      return;                                                             \
    }                                                                     \
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
