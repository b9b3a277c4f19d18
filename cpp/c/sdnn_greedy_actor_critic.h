/* The greedy policy of an actor-critic: a most probable action, or one between it and a neighbour.
 *
 * Where actions are a box, sdnn_place has the place of the greedy action among those of a
 * dimension, times 2^16, and sdnn_action_at the action there, times 2^SDNN_FRACTION_BITS:
 *
 *   int32_t action = sdnn_action_at(0, sdnn_place(observation));
 *
 * With several dimensions: sdnn_place(observation, place), with an array of
 * SDNN_N_DIMENSIONS numbers, and sdnn_action_at(d, place[d]). */
#ifndef SDNN_GREEDY_ACTOR_CRITIC_H
#define SDNN_GREEDY_ACTOR_CRITIC_H

#include "sdnn_softmax.h"
#include "sdnn_thermometers.h"

typedef uint32_t sdnn_score;
#include "sdnn_ties.h"

/* The greedy action of dimension d, and its place. */
static inline uint32_t sdnn_best_action(const sdnn_code* code, uint32_t d, uint32_t* place) {
  int64_t sums[SDNN_MOST_ROWS];
  uint32_t weights[SDNN_MOST_ROWS], action;
  sdnn_sums(sdnn_weights, code, d, sums);
  sdnn_weigh(sums, sdnn_n_actions[d], weights);
  action = sdnn_tied(weights, sdnn_n_actions[d], SDNN_LARGEST_PART);
  if (place) *place = sdnn_mean_place(weights, sdnn_n_actions[d], action);
  return action;
}

/* Writes the most probable action in each dimension. */
static inline void sdnn_greedy_in_each(const uint32_t* bins, uint32_t* action) {
  sdnn_code code;
  uint32_t d;
  sdnn_encode_state(bins, &code);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) action[d] = sdnn_best_action(&code, d, 0);
}

#ifdef SDNN_HAS_EPISODES
#include "sdnn_episode_policy.h"
#else
#include "sdnn_policy.h"
#endif

#if SDNN_IS_BOX
/* Writes the fractional index of the best action in each dimension, times 2^16: the mean of its
 * index and its neighbours' ones, weighted by their probabilities. */
static inline void sdnn_place_of_bins(const uint32_t* bins, uint32_t* place) {
  sdnn_code code;
  uint32_t d;
  sdnn_encode_state(bins, &code);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) sdnn_best_action(&code, d, &place[d]);
}
#ifdef SDNN_HAS_EPISODES
SDNN_POLICY(sdnn_place, int32_t, sdnn_place_of_bins, sdnn_note_places)
#else
SDNN_POLICY(sdnn_place, int32_t, sdnn_bins_of_fixed, sdnn_place_of_bins)
#endif
#endif

#endif /* SDNN_GREEDY_ACTOR_CRITIC_H */
