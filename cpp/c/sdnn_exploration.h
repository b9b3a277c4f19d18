/* When actions are random, and for how many steps. */
#ifndef SDNN_EXPLORATION_H
#define SDNN_EXPLORATION_H

#include "sdnn_learner.h"

/* Whether an action may be random in this step of an episode. */
static inline int sdnn_may_explore(uint32_t step) {
#if SDNN_N_GREEDY_STEPS > 0
  return step >= SDNN_N_GREEDY_STEPS;
#else
  (void)step;
  return 1;
#endif
}

/* The number of steps that a random action lasts: n with probability 1 / (n (n + 1)), at most
 * `longest`. */
static inline uint32_t sdnn_repetitions(sdnn_random* random, uint32_t longest) {
  const uint64_t whole = UINT64_C(1) << 53;
  uint64_t rest;
  const uint64_t n = sdnn_quotient(whole, whole - (sdnn_bits(random) >> 11), &rest);
  return (uint32_t)(n < longest ? n : longest);
}

#endif /* SDNN_EXPLORATION_H */
