/* The greedy policy of an agent with a linear readout. */
#ifndef SDNN_GREEDY_Q_LAMBDA_H
#define SDNN_GREEDY_Q_LAMBDA_H

#include "sdnn_readout.h"

typedef int64_t sdnn_score;
#include "sdnn_ties.h"

/* The best action of dimension d. */
static inline uint32_t sdnn_best_action(const sdnn_code* code, uint32_t d) {
  int64_t sums[SDNN_MOST_ROWS];
  sdnn_sums(sdnn_weights, code, d, sums);
  return sdnn_tied(sums, sdnn_n_actions[d],
                   sdnn_largest(sums, sdnn_n_actions[d]) - SDNN_TIE_TOLERANCE);
}

/* Writes the action with the highest value in each dimension. */
static inline void sdnn_greedy_in_each(const uint32_t* bins, uint32_t* action) {
  sdnn_code code;
  uint32_t d;
  sdnn_encode(&sdnn_the_coding, bins, &code);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) action[d] = sdnn_best_action(&code, d);
}

#ifdef SDNN_HAS_EPISODES
#include "sdnn_episode_policy.h"
#else
#include "sdnn_policy.h"
#endif

#endif /* SDNN_GREEDY_Q_LAMBDA_H */
