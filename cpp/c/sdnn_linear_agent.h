/* A learning agent with a linear readout, after its way to learn: acting greedily, by the present
 * or the kept policy, functions for one dimension of actions or several, beginning, saving. */
#ifndef SDNN_LINEAR_AGENT_H
#define SDNN_LINEAR_AGENT_H

#include "sdnn_keeper.h"

/* Moves the weights that are in a part of an image. */
static inline void sdnn_carry_arrays(sdnn_agent* agent, const sdnn_part* part, int reads) {
  sdnn_carry_words(part, agent->weights, SDNN_IMAGE_HEAD, SDNN_N_ALL_WEIGHTS, reads);
}

/* Writes the weights of the agent's policy that are in a part of a keeper's memory. */
static inline void sdnn_carry_kept(sdnn_agent* agent, const sdnn_part* part) {
  sdnn_carry_words(part, (int32_t*)sdnn_policy_of(agent), 0, SDNN_N_KEPT, 0);
}

/* Makes the agent as it was exported. */
static inline void sdnn_begin(sdnn_agent* agent) {
  sdnn_begin_as(agent, sdnn_first_head);
  sdnn_copy_32(agent->weights, sdnn_first_weights, SDNN_N_FIRST_WEIGHTS);
}

/* Adds `sign` times the kept weights of a row in n columns to a sum. Returns whether it could read
 * them. */
static inline int sdnn_add_kept(const sdnn_keeper* keeper, uint32_t row, const sdnn_column* column,
                                uint32_t n, int32_t sign, int64_t* sum) {
  for (; n > 0; --n, ++column) {
    const uint32_t weight = row * SDNN_N_COLUMNS + *column;
    uint8_t bytes[4];
    if (!keeper->read(keeper->context, 4 * weight, bytes, 4)) return 0;
    *sum += sign * (int64_t)sdnn_get_32(bytes);
  }
  return 1;
}

/* The kept values of the actions of dimension d. Returns whether it could read them. */
static inline int sdnn_kept_sums(const sdnn_keeper* keeper, const sdnn_code* code, uint32_t d,
                                 int64_t* sums) {
  const sdnn_column* const negative = code->columns + SDNN_MOST_COLUMNS - code->n_negative;
  const uint32_t n = sdnn_n_actions[d];
  uint32_t i;
  for (i = 0; i < n + SDNN_ACTION_WINDOW - 1; ++i) {
    const uint32_t row = sdnn_first_rows[d] + i;
    sums[i] = 0;
    if (!sdnn_add_kept(keeper, row, code->columns, code->n_positive, 1, &sums[i]) ||
        !sdnn_add_kept(keeper, row, negative, code->n_negative, -1, &sums[i])) {
      return 0;
    }
  }
  sdnn_add_windows(sums, n);
  return 1;
}

/* The greedy action in each dimension: by the kept policy if there is a keeper that has one. Unless
 * `place` is null, fractional indices of greedy actions are written to it. */
static inline void sdnn_choose(const sdnn_agent* agent, const sdnn_keeper* keeper,
                               SDNN_EPISODE_PARAMETER const int32_t* observation, uint32_t* action,
                               uint32_t* place) {
  uint32_t bins[SDNN_N_INPUTS], d;
  int64_t sums[SDNN_MOST_ROWS];
  sdnn_code code;
  if (SDNN_IS_REFUSED(int32_t, observation)) {
    sdnn_refuse(place ? place : action);
    return;
  }
  sdnn_read_greedily(&agent->states, SDNN_EPISODE observation, bins);
  sdnn_encode_state(bins, &code);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    int32_t scale = sdnn_scale_of_policy(agent);
    if (keeper && keeper->is_kept && sdnn_kept_sums(keeper, &code, d, sums)) {
      scale = keeper->scale;
    } else {
      sdnn_sums(sdnn_policy_of(agent), &code, d, sums);
    }
    action[d] = sdnn_greedy_of(sums, d, scale, place ? &place[d] : 0);
  }
  sdnn_note_greedy(SDNN_EPISODE action, place);
}

/* Defines a function that chooses a number for each dimension: `call` writes them to `numbers`.
 * With one dimension the function returns the number, with more its last parameter is the array. */
#if SDNN_N_DIMENSIONS == 1
#define SDNN_CHOICE(name, call, ...)         \
  static inline uint32_t name(__VA_ARGS__) { \
    uint32_t numbers[1];                     \
    call;                                    \
    return numbers[0];                       \
  }
#else
#define SDNN_CHOICE(name, call, ...) \
  static inline void name(__VA_ARGS__, uint32_t* numbers) { call; }
#endif

/* The action to take, at times not a greedy one. */
SDNN_CHOICE(sdnn_act, sdnn_act_in_each(agent, observation, numbers), sdnn_agent* agent,
            const int32_t* observation)
/* A greedy action. */
SDNN_CHOICE(sdnn_greedy, sdnn_choose(agent, 0, SDNN_EPISODE observation, numbers, 0),
            const sdnn_agent* agent, SDNN_EPISODE_PARAMETER const int32_t* observation)
/* A greedy action of the kept policy, or of the present one where none is kept. */
SDNN_CHOICE(sdnn_best, sdnn_choose(agent, keeper, SDNN_EPISODE observation, numbers, 0),
            const sdnn_agent* agent, const sdnn_keeper* keeper,
            SDNN_EPISODE_PARAMETER const int32_t* observation)

#if SDNN_IS_BOX
/* Writes the fractional index of the greedy action in each dimension, times 2^16; sdnn_action_at
 * converts it to the action. */
static inline void sdnn_place_in_each(const sdnn_agent* agent, const sdnn_keeper* keeper,
                                      SDNN_EPISODE_PARAMETER const int32_t* observation,
                                      uint32_t* place) {
  uint32_t action[SDNN_N_DIMENSIONS];
  sdnn_choose(agent, keeper, SDNN_EPISODE observation, action, place);
}
/* Like sdnn_greedy and sdnn_best, but fractional indices, times 2^16. */
SDNN_CHOICE(sdnn_place, sdnn_place_in_each(agent, 0, SDNN_EPISODE observation, numbers),
            const sdnn_agent* agent, SDNN_EPISODE_PARAMETER const int32_t* observation)
SDNN_CHOICE(sdnn_best_place, sdnn_place_in_each(agent, keeper, SDNN_EPISODE observation, numbers),
            const sdnn_agent* agent, const sdnn_keeper* keeper,
            SDNN_EPISODE_PARAMETER const int32_t* observation)
#endif

#if SDNN_N_DIMENSIONS == 1
static inline void sdnn_learn(sdnn_agent* agent, const int32_t* observation, uint32_t action,
                              int32_t reward, const int32_t* next_observation, int terminated) {
  sdnn_learn_in_each(agent, observation, &action, reward, next_observation, terminated);
}
#else
#define sdnn_learn sdnn_learn_in_each
#endif

#include "sdnn_learn_over.h"
#ifdef SDNN_HAS_EPISODES
/* Begins an episode of greedy steps, apart from the one of which the agent learns. */
static inline void sdnn_begin_greedy_episode(const sdnn_agent* agent,
                                             sdnn_greedy_episode* episode) {
  sdnn_begin_greedy(&agent->states, episode);
}
#endif

#include "sdnn_learner_class.h"

#endif /* SDNN_LINEAR_AGENT_H */
