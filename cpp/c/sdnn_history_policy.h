/* The functions of a greedy policy whose states include earlier observations. The file that
 * includes this one defines sdnn_greedy_in_each.
 *
 *   static sdnn_episode episode;    // the memory of an episode
 *   sdnn_begin_episode(&episode);   // whenever the task starts anew
 *   uint32_t action = sdnn_greedy(&episode, observation);
 *
 * Each call is a step: it remembers the observation, and the action as the one that is taken.
 * Everything else is as in sdnn_policy.h. */
#ifndef SDNN_HISTORY_POLICY_H
#define SDNN_HISTORY_POLICY_H

#include "sdnn_history.h"
#include "sdnn_observation.h"

/* Begins an episode. */
static inline void sdnn_begin_episode(sdnn_episode* episode) { episode->has_begun = 0; }

#ifdef SDNN_USE_FLOAT
/* A reading within 2^300 in size; NaN counts as the lowest one. */
static inline sdnn_real sdnn_real_of_double(double reading) {
  const sdnn_real largest = UINT64_C(0x52b0000000000000);
  union {
    double number;
    sdnn_real bits;
  } both;
  both.number = reading;
  if (!(reading == reading)) return largest | SDNN_MINUS;
  return sdnn_between(both.bits, largest | SDNN_MINUS, largest);
}

/* The inputs of an observation in floating point. */
static inline void sdnn_inputs_of_double(const double* observation, sdnn_real* inputs) {
#define SDNN_READING(i) sdnn_real_of_double(observation[i])
  SDNN_INPUTS
#undef SDNN_READING
}

static inline void sdnn_inputs_of_float(const float* observation, sdnn_real* inputs) {
#define SDNN_READING(i) sdnn_real_of_double((double)observation[i])
  SDNN_INPUTS
#undef SDNN_READING
}
#endif

#define SDNN_STEP(reading, inputs_of)                                                          \
  static inline void sdnn_step_of_##reading(sdnn_episode* episode, const reading* observation, \
                                            uint32_t* bins) {                                  \
    sdnn_real inputs[SDNN_N_OBSERVED_INPUTS], state[SDNN_N_INPUTS];                            \
    inputs_of(observation, inputs);                                                            \
    sdnn_continue(episode, inputs, state);                                                     \
    sdnn_bins_of_state(state, bins);                                                           \
  }

#if SDNN_N_DIMENSIONS == 1
#define SDNN_POLICY(name, reading, choose, note)                                   \
  static inline uint32_t name(sdnn_episode* episode, const reading* observation) { \
    uint32_t bins[SDNN_N_INPUTS], action;                                          \
    sdnn_step_of_##reading(episode, observation, bins);                            \
    choose(bins, &action);                                                         \
    note(episode, &action);                                                        \
    return action;                                                                 \
  }
#else
#define SDNN_POLICY(name, reading, choose, note)                                                 \
  static inline void name(sdnn_episode* episode, const reading* observation, uint32_t* action) { \
    uint32_t bins[SDNN_N_INPUTS];                                                                \
    sdnn_step_of_##reading(episode, observation, bins);                                          \
    choose(bins, action);                                                                        \
    note(episode, action);                                                                       \
  }
#endif

SDNN_STEP(int32_t, sdnn_inputs_of_fixed)
SDNN_POLICY(sdnn_greedy, int32_t, sdnn_greedy_in_each, sdnn_note_action)
#ifdef SDNN_USE_FLOAT
SDNN_STEP(double, sdnn_inputs_of_double)
SDNN_STEP(float, sdnn_inputs_of_float)
SDNN_POLICY(sdnn_greedy_double, double, sdnn_greedy_in_each, sdnn_note_action)
SDNN_POLICY(sdnn_greedy_float, float, sdnn_greedy_in_each, sdnn_note_action)
#endif

#endif /* SDNN_HISTORY_POLICY_H */
