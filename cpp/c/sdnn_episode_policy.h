/* The functions of a greedy policy whose actions depend on earlier observations. The file that
 * includes this one defines sdnn_greedy_in_each.
 *
 *   static sdnn_episode episode;    // the memory of an episode
 *   sdnn_begin_episode(&episode);   // whenever the task starts anew
 *   uint32_t action = sdnn_greedy(&episode, observation);
 *
 * Each call is a step: it remembers the observation, and the action as the one that is taken.
 * Everything else is as in sdnn_policy.h. */
#ifndef SDNN_EPISODE_POLICY_H
#define SDNN_EPISODE_POLICY_H

#include "sdnn_float_readings.h"
#ifdef SDNN_HISTORY
#include "sdnn_history.h"
#else
#include "sdnn_float_bins.h"
#include "sdnn_observation.h"

/* The memory of an episode: the last readings. */
typedef struct {
  int32_t held[SDNN_N_OBSERVED];
#ifdef SDNN_USE_FLOAT
  double held_doubles[SDNN_N_OBSERVED];
#endif
} sdnn_episode;
#endif

/* Begins an episode. */
static inline void sdnn_begin_episode(sdnn_episode* episode) {
#ifdef SDNN_HISTORY
  episode->has_begun = 0;
#endif
#ifdef SDNN_HOLDS
  sdnn_forget_held(episode->held);
#ifdef SDNN_USE_FLOAT
  sdnn_forget_held_doubles(episode->held_doubles);
#endif
#endif
}

/* The readings of a step, of which the last ones replace those that are missing. */
static inline const int32_t* sdnn_filled_int32_t(sdnn_episode* episode,
                                                 const int32_t* observation) {
#ifdef SDNN_HOLDS
  sdnn_hold_readings(episode->held, observation);
  return episode->held;
#else
  (void)episode;
  return observation;
#endif
}
#ifdef SDNN_USE_FLOAT
/* The observation, with missing readings replaced by the last ones if the agent holds them. */
static inline const double* sdnn_filled_double(sdnn_episode* episode, const double* observation) {
#ifdef SDNN_HOLDS
  sdnn_hold_doubles(episode->held_doubles, observation);
  return episode->held_doubles;
#else
  (void)episode;
  return observation;
#endif
}
#endif

#ifdef SDNN_HISTORY
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
#define SDNN_LACKS(i) sdnn_lacks_double(&observation[i], 1)
  SDNN_INPUTS
#undef SDNN_LACKS
#undef SDNN_READING
}
#endif

#define SDNN_STEP(reading, inputs_of)                                                          \
  static inline void sdnn_step_of_##reading(sdnn_episode* episode, const reading* observation, \
                                            uint32_t* bins) {                                  \
    sdnn_real inputs[SDNN_N_OBSERVED_INPUTS], state[SDNN_N_INPUTS];                            \
    inputs_of(sdnn_filled_##reading(episode, observation), inputs);                            \
    sdnn_continue(episode, inputs, state);                                                     \
    sdnn_bins_of_state(state, bins);                                                           \
  }
#else
static inline void sdnn_note_action(sdnn_episode* episode, const uint32_t* action) {
  (void)episode;
  (void)action;
}
#define sdnn_note_places sdnn_note_action
#define SDNN_STEP(reading, bins_of)                                                            \
  static inline void sdnn_step_of_##reading(sdnn_episode* episode, const reading* observation, \
                                            uint32_t* bins) {                                  \
    bins_of(sdnn_filled_##reading(episode, observation), bins);                                \
  }
#define sdnn_inputs_of_fixed sdnn_bins_of_fixed
#define sdnn_inputs_of_double sdnn_bins_of_double
#endif

#if SDNN_N_DIMENSIONS == 1
#define SDNN_POLICY(name, reading, choose, note)                                   \
  static inline uint32_t name(sdnn_episode* episode, const reading* observation) { \
    uint32_t bins[SDNN_N_INPUTS], action;                                          \
    if (SDNN_IS_REFUSED(reading, observation)) return SDNN_REFUSED;                \
    sdnn_step_of_##reading(episode, observation, bins);                            \
    choose(bins, &action);                                                         \
    note(episode, &action);                                                        \
    return action;                                                                 \
  }
#else
#define SDNN_POLICY(name, reading, choose, note)                                                 \
  static inline void name(sdnn_episode* episode, const reading* observation, uint32_t* action) { \
    uint32_t bins[SDNN_N_INPUTS];                                                                \
    if (SDNN_IS_REFUSED(reading, observation)) {                                                 \
      sdnn_refuse(action);                                                                       \
      return;                                                                                    \
    }                                                                                            \
    sdnn_step_of_##reading(episode, observation, bins);                                          \
    choose(bins, action);                                                                        \
    note(episode, action);                                                                       \
  }
#endif

SDNN_STEP(int32_t, sdnn_inputs_of_fixed)
SDNN_POLICY(sdnn_greedy, int32_t, sdnn_greedy_in_each, sdnn_note_action)
#ifdef SDNN_USE_FLOAT
SDNN_STEP(double, sdnn_inputs_of_double)
/* Like sdnn_step_of_double, for an observation of floats. */
static inline void sdnn_step_of_float(sdnn_episode* episode, const float* observation,
                                      uint32_t* bins) {
  double doubles[SDNN_N_OBSERVED];
  uint32_t i;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) doubles[i] = (double)observation[i];
  sdnn_step_of_double(episode, doubles, bins);
}
SDNN_POLICY(sdnn_greedy_double, double, sdnn_greedy_in_each, sdnn_note_action)
SDNN_POLICY(sdnn_greedy_float, float, sdnn_greedy_in_each, sdnn_note_action)
#endif

#endif /* SDNN_EPISODE_POLICY_H */
