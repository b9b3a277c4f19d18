/* The softmax of integer preferences: see cpp/include/sdnn/agents/detail/softmax.hpp. */
#ifndef SDNN_SOFTMAX_H
#define SDNN_SOFTMAX_H

#include "sdnn_integers.h"
#include "sdnn_missing.h"

#define SDNN_LARGEST_PART (UINT32_C(1) << 30) /* the weight of the most probable action */
#define SDNN_MOST_BITS (INT64_C(40) << 20)    /* below the most probable action */

/* 2^-x, 2^30 for 1, by a polynomial of degree 4; x is below 64 and has 20 fractional bits. */
static inline uint32_t sdnn_power_of_half(int64_t x) {
  static const int32_t coefficients[5] = {7356191, -57204762, 257158220, -744180561, 1073741824};
  const int64_t fraction = x & 1048575;
  int64_t power = 0;
  uint32_t i;
  for (i = 0; i < 5; ++i) power = coefficients[i] + sdnn_scaled(power, fraction, 20);
  return (uint32_t)(power >> (x >> 20));
}

/* Replaces the preferences of n actions, in units of 2^-SDNN_N_UNIT_BITS, by the bits that their
 * probabilities lie below the largest one, with 20 fractional bits, and computes their weights, the
 * probabilities over the largest one, 2^30 for 1. Returns the sum of the weights. */
static inline uint64_t sdnn_weigh(int64_t* preferences, uint32_t n, uint32_t* weights) {
  const int64_t log2_of_e = INT64_C(1549082005); /* 2^30 for 1 */
  int64_t best = preferences[0];
  uint64_t sum = 0;
  uint32_t a;
  for (a = 1; a < n; ++a) {
    if (preferences[a] > best) best = preferences[a];
  }
  for (a = 0; a < n; ++a) {
    int64_t bits = (best - preferences[a]) >> (SDNN_N_UNIT_BITS - 20);
    if (bits > SDNN_MOST_BITS) bits = SDNN_MOST_BITS;
    bits = sdnn_scaled(bits, log2_of_e, 30);
    if (bits > SDNN_MOST_BITS) bits = SDNN_MOST_BITS;
    preferences[a] = bits;
    weights[a] = sdnn_power_of_half(bits);
    sum += weights[a];
  }
  return sum;
}

/* The place of the mean of a most probable action and its neighbours among the actions, times 2^16:
 * 98304 is halfway between the actions 1 and 2. */
static inline uint32_t sdnn_mean_place(const uint32_t* weights, uint32_t n, uint32_t action) {
  const uint64_t below = action > 0 ? weights[action - 1] : 0;
  const uint64_t above = action + 1 < n ? weights[action + 1] : 0;
  const uint64_t sum = below + SDNN_LARGEST_PART + above;
  uint64_t rest;
  if (above >= below) {
    return (action << 16) + (uint32_t)sdnn_quotient((above - below) << 16, sum, &rest);
  }
  return (action << 16) - (uint32_t)sdnn_quotient((below - above) << 16, sum, &rest);
}

#if SDNN_IS_BOX
/* The action at a place of dimension d, in fixed point; SDNN_MISSING for SDNN_REFUSED. */
static inline int32_t sdnn_action_at(uint32_t d, uint32_t place) {
#ifdef SDNN_REFUSES
  if (place == SDNN_REFUSED) return SDNN_MISSING;
#endif
#if SDNN_N_DIMENSIONS == 1
  const int32_t* const action = &sdnn_action_fixed[place >> 16];
#else
  const int32_t* const action = &sdnn_action_fixed[d][place >> 16];
#endif
  const int64_t part = place & 65535;
  (void)d;
  if (part == 0) return *action;
  return (int32_t)(*action + sdnn_scaled((int64_t)action[1] - *action, part, 16));
}
#endif

#endif /* SDNN_SOFTMAX_H */
