/* Durations of transitions, and the discounts over them: see
 * cpp/include/sdnn/agents/detail/linear_td.hpp. */
#ifndef SDNN_DURATIONS_H
#define SDNN_DURATIONS_H

#include "sdnn_real.h"

/* A constant duration of up to 65,535 usual steps, times 2^16: the compiler computes it. */
#define SDNN_DURATION(dt) ((uint32_t)((dt) * 65536.0 + 0.5))
#define SDNN_USUAL_DURATION 65536
#define SDNN_SHORTEST_DURATION 66 /* 0.001 usual steps */

/* The discount of a transition, times 2^15, and the decay of traces after it, times 2^13: the bits
 * in which they differ from those of a usual step. */
typedef struct {
  uint16_t discount, decay;
} sdnn_factors;

typedef struct {
  sdnn_factors given, pending; /* of the transition that comes, and of the one to be learned */
  uint16_t trace_decay;        /* of the one before, by which traces have still to decay */
} sdnn_durations;

#define SDNN_DISCOUNT (agent->durations.pending.discount ^ SDNN_USUAL_DISCOUNT)
#define SDNN_TRACE_DECAY (agent->durations.trace_decay ^ SDNN_USUAL_TRACE_DECAY)

/* e^x for x from -64 to 0, with the bits of cpp/include/sdnn/core/elementary.hpp. */
static inline sdnn_real sdnn_exp(sdnn_real x) {
  static const sdnn_real c[10] = {UINT64_C(0x3fc5555555555556), UINT64_C(0x3fa5555555555555),
                                  UINT64_C(0x3f811111111109b3), UINT64_C(0x3f56c16c16c167e1),
                                  UINT64_C(0x3f2a01a01a7c41d5), UINT64_C(0x3efa01a01a47b054),
                                  UINT64_C(0x3ec71de0dae63bb3), UINT64_C(0x3e927e4e1f48534f),
                                  UINT64_C(0x3e5af38a9b0ec855), UINT64_C(0x3e21f66df7fca49f)};
  const sdnn_real log2_inverse = UINT64_C(0x3ff71547652b82fe);
  const sdnn_real rounder = UINT64_C(0x4338000000000000); /* 1.5 2^52 */
  const sdnn_real log2_high = UINT64_C(0x3fe62e42fefa3800), half = UINT64_C(1022) << 52;
  const sdnn_real log2_low = UINT64_C(0x3d2ef35793c76730);
  const sdnn_real shifted = sdnn_plus(sdnn_times(x, log2_inverse), rounder);
  const sdnn_real n = sdnn_minus(shifted, rounder);
  const sdnn_real coarse = sdnn_minus(x, sdnn_times(n, log2_high));
  const sdnn_real correction = sdnn_times(n, log2_low);
  const sdnn_real r = sdnn_minus(coarse, correction);
  const sdnn_real tail = sdnn_minus(sdnn_minus(coarse, r), correction);
  const sdnn_real z = sdnn_times(r, r), z2 = sdnn_times(z, z), one_plus = sdnn_plus(SDNN_ONE, r);
  sdnn_real pairs[5], sum;
  uint32_t i;
  for (i = 0; i < 5; ++i) pairs[i] = sdnn_plus(c[2 * i], sdnn_times(c[2 * i + 1], r));
  sum = sdnn_plus(pairs[0], sdnn_times(z, pairs[1]));
  sum = sdnn_plus(sum, sdnn_times(z2, sdnn_plus(pairs[2], sdnn_times(z, pairs[3]))));
  sum = sdnn_plus(sum, sdnn_times(sdnn_times(z2, z2), pairs[4]));
  sum = sdnn_plus(sdnn_times(half, z), sdnn_times(sdnn_times(r, z), sum));
  sum = sdnn_plus(sdnn_plus(sdnn_minus(SDNN_ONE, one_plus), r), sdnn_plus(tail, sum));
  return sdnn_plus(one_plus, sum) + ((shifted - rounder) << 52); /* times 2^n */
}

/* The integer next to 2^n_bits x, halves up, of x from 0 to 1. */
static inline uint32_t sdnn_nearest_whole(sdnn_real x, int32_t n_bits) {
  return ((uint32_t)sdnn_whole(sdnn_times(x, sdnn_real_of(1, n_bits + 1))) + 1) >> 1;
}

/* The factors of a transition of dt usual steps, times 2^16. */
static inline sdnn_factors sdnn_factors_of(uint32_t dt) {
  const sdnn_real least = UINT64_C(0xc050000000000000); /* -64, of which all factors are 0 */
  const sdnn_real exponent = sdnn_times(sdnn_real_of(dt, -16), SDNN_LOG_DISCOUNT);
  const sdnn_real discount = sdnn_exp(sdnn_less(exponent, least) ? least : exponent);
  sdnn_factors factors;
  factors.discount = (uint16_t)(sdnn_nearest_whole(discount, 15) ^ SDNN_USUAL_DISCOUNT);
  factors.decay = (uint16_t)(sdnn_nearest_whole(sdnn_times(discount, SDNN_LAMBDA), 13) ^
                             SDNN_USUAL_TRACE_DECAY);
  return factors;
}

/* Makes the present transition a usual one, and sets the decay of the transition before it. */
static inline void sdnn_set_durations(sdnn_durations* durations, uint16_t trace_decay) {
  durations->pending.discount = durations->pending.decay = 0;
  durations->trace_decay = trace_decay;
}

#endif /* SDNN_DURATIONS_H */
