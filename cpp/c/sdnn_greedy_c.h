/* The greedy policy of an agent with SDNN-C: a network for each dimension of actions. */
#ifndef SDNN_GREEDY_C_H
#define SDNN_GREEDY_C_H

#include "sdnn_weight_bytes.h"

typedef uint16_t sdnn_score;
#include "sdnn_ties.h"

/* The network of a dimension. */
typedef struct {
  sdnn_coding coding;
  const uint32_t* weights; /* of four units each: high bytes if there are any, then low bytes */
  const int32_t* thresholds;
  const uint8_t* n_bytes;      /* of a weight, for four units each */
  const uint16_t* first_units; /* of the window of each action */
  uint32_t n_units;
  uint32_t n_actions;
} sdnn_network;

static const sdnn_network sdnn_networks[SDNN_N_DIMENSIONS] = {SDNN_NETWORKS};

/* 1 if a hidden unit fires, by the bits that sdnn_fire sets, else 0. */
static inline uint32_t sdnn_fires(const uint32_t* fires, uint32_t unit) {
  return (fires[unit >> 5] >> (unit & 31)) & 1;
}

/* Sets the bits of the hidden units that fire. */
static inline void sdnn_fire(const sdnn_network* network, const sdnn_code* code, uint32_t* fires) {
  const sdnn_column* const negative = code->columns + SDNN_MOST_COLUMNS - code->n_negative;
  const uint32_t* weights = network->weights;
  uint32_t unit, byte, i;
  for (unit = 0; unit < network->n_units; unit += 4) {
    uint32_t potentials[4] = {0, 0, 0, 0};
    for (byte = network->n_bytes[unit >> 2]; byte-- > 0; weights += SDNN_N_COLUMNS) {
      for (i = 0; i < 4; ++i) potentials[i] <<= 8;
      sdnn_add_signed(weights, code->columns, code->n_positive, negative, code->n_negative,
                      potentials);
    }
    if ((unit & 31) == 0) fires[unit >> 5] = 0;
    for (i = 0; i < 4; ++i) {
      potentials[i] -= (uint32_t)network->thresholds[unit + i];
      /* Above zero, as a number with a sign. */
      fires[unit >> 5] |= (uint32_t)(potentials[i] - 1 < UINT32_C(0x7fffffff)) << ((unit + i) & 31);
    }
  }
}

/* The best action of a network: counts of firing units in windows, ranked, and ties broken. */
static inline uint32_t sdnn_best_action(const sdnn_network* network, const uint32_t* bins) {
  sdnn_code code;
  uint32_t fires[(SDNN_MOST_UNITS + UINT32_C(31)) / 32];
  uint16_t ranks[SDNN_MOST_ACTIONS];
  uint32_t unit, action, first = 0, n_firing = 0, best = 0;
  sdnn_encode(&network->coding, bins, &code);
  sdnn_fire(network, &code, fires);
  for (unit = 0; unit < SDNN_N_ACTIVE_UNITS; ++unit) n_firing += sdnn_fires(fires, unit);
  for (action = 0; action < network->n_actions; ++action) {
    for (; first < network->first_units[action]; ++first) {
      n_firing += sdnn_fires(fires, first + SDNN_N_ACTIVE_UNITS);
      n_firing -= sdnn_fires(fires, first);
    }
    ranks[action] = sdnn_ranks[n_firing];
    if (ranks[action] > best) best = ranks[action];
  }
#if SDNN_HAS_TIE_TOLERANCE
  best = sdnn_ties[best];
#endif
  return sdnn_tied(ranks, network->n_actions, (sdnn_score)best);
}

/* Writes the best action in each dimension. */
static inline void sdnn_greedy_in_each(const uint32_t* bins, uint32_t* action) {
  uint32_t d;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) action[d] = sdnn_best_action(&sdnn_networks[d], bins);
}

#ifdef SDNN_HAS_EPISODES
#include "sdnn_episode_policy.h"
#else
#include "sdnn_policy.h"
#endif

#endif /* SDNN_GREEDY_C_H */
