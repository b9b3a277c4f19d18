/* States that include earlier observations of an episode: differences, averages, or the estimates
 * of an observer. See cpp/include/sdnn/agents/history.hpp and detail/observer.hpp.
 *
 * The exporter writes SDNN_HISTORY and the tables before this file; SDNN_INPUTS lists the inputs of
 * an observation. All inputs and states are real numbers, calculated in integers. */
#ifndef SDNN_HISTORY_H
#define SDNN_HISTORY_H

#include "sdnn_elementary.h"
#include "sdnn_missing.h"

/* Values of SDNN_HISTORY. */
#define SDNN_HISTORY_DIFFERENCES 1
#define SDNN_HISTORY_AVERAGES 2
#define SDNN_HISTORY_OBSERVER 3

#define SDNN_IS_OBSERVER (SDNN_HISTORY == SDNN_HISTORY_OBSERVER)
#define SDNN_N_REMEMBERED \
  ((SDNN_HISTORY == SDNN_HISTORY_AVERAGES ? UINT32_C(2) : 1) * SDNN_N_NUMBERS)

/* The memory of an episode. */
typedef struct {
  sdnn_real memory[SDNN_N_REMEMBERED]; /* the last inputs, their averages, or estimates */
#if SDNN_IS_OBSERVER
  sdnn_real action[SDNN_N_DIMENSIONS]; /* the last one */
#endif
#ifdef SDNN_HOLDS
  int32_t held[SDNN_N_OBSERVED]; /* the last readings */
#ifdef SDNN_USE_FLOAT
  double held_doubles[SDNN_N_OBSERVED];
#endif
#endif
  uint8_t has_begun;
} sdnn_episode;

#include "sdnn_real_inputs.h"
/* The inputs of an observation in fixed point. */
static inline void sdnn_inputs_of_fixed(const int32_t* observation, sdnn_real* inputs) {
#define SDNN_READING(i) sdnn_real_of(observation[i], -SDNN_FRACTION_BITS)
#define SDNN_LACKS(i) (observation[i] == SDNN_MISSING)
  SDNN_INPUTS
#undef SDNN_LACKS
#undef SDNN_READING
}

#if SDNN_IS_OBSERVER

/* The coordinate of the number k, an input x, in which the observer estimates: an angle in radians,
 * or a distance from the mean in standard deviations. */
static inline sdnn_real sdnn_coordinate(sdnn_real x, uint32_t k) {
  if (sdnn_is_circular[k]) return sdnn_times(SDNN_TWO_PI, x);
  return sdnn_over(sdnn_minus(x, sdnn_means[k]), sdnn_deviations[k]);
}

/* An angle in radians, the shorter way. */
static inline sdnn_real sdnn_shorter(sdnn_real angle) {
  return sdnn_minus(angle, sdnn_times(SDNN_TWO_PI, sdnn_nearest(sdnn_over(angle, SDNN_TWO_PI))));
}

/* Adds a feature to the predicted changes; returns the weights of the next one. */
static inline const sdnn_real* sdnn_add_feature(sdnn_real* changes, const sdnn_real* weights,
                                                sdnn_real feature) {
  uint32_t k;
  for (k = 0; k < SDNN_N_NUMBERS; ++k, ++weights) {
    changes[k] = sdnn_plus(changes[k], sdnn_times(*weights, feature));
  }
  return weights;
}

/* Moves the estimates to those expected after the last action, by a model that is linear in 1, each
 * estimate or its cosine and sine, and the actions. Changes are limited to 3, and estimates that
 * are no angles to 6 standard deviations. */
static inline void sdnn_predict(sdnn_episode* episode) {
  const sdnn_real largest_change = UINT64_C(0x4008000000000000); /* 3 */
  const sdnn_real farthest = UINT64_C(0x4018000000000000);       /* 6 */
  const sdnn_real *weights = sdnn_observer_weights, *level = sdnn_levels;
  sdnn_real changes[SDNN_N_NUMBERS], *const estimates = episode->memory;
  uint32_t d, i, k;
  for (k = 0; k < SDNN_N_NUMBERS; ++k) changes[k] = 0;
  weights = sdnn_add_feature(changes, weights, SDNN_ONE);
  for (k = 0; k < SDNN_N_NUMBERS; ++k) {
    if (sdnn_is_circular[k]) {
      sdnn_real sine, cosine;
      sdnn_sin_cos(estimates[k], &sine, &cosine);
      weights = sdnn_add_feature(changes, weights, cosine);
      weights = sdnn_add_feature(changes, weights, sine);
    } else {
      weights = sdnn_add_feature(changes, weights, estimates[k]);
    }
  }
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    for (i = 0; i < sdnn_n_levels[d]; ++i, ++level) {
      const sdnn_real beyond = sdnn_minus(episode->action[d], *level);
      weights = sdnn_add_feature(changes, weights,
                                 sdnn_n_levels[d] == 1 ? beyond
                                 : beyond << 1 == 0    ? SDNN_ONE
                                                       : 0);
    }
  }
  for (k = 0; k < SDNN_N_NUMBERS; ++k) {
    const sdnn_real change = sdnn_between(changes[k], largest_change | SDNN_MINUS, largest_change);
    const sdnn_real estimate = sdnn_plus(estimates[k], change);
    estimates[k] = sdnn_is_circular[k] ? sdnn_shorter(estimate)
                                       : sdnn_between(estimate, farthest | SDNN_MINUS, farthest);
  }
}

/* Moves predicted estimates by the errors of the predictions, in standard deviations. Errors of
 * other inputs are limited, so that a wrong reading does not spread. */
static inline void sdnn_correct_estimates(sdnn_real* estimates, const sdnn_real* errors) {
  const sdnn_real farthest = UINT64_C(0x4018000000000000); /* 6 */
  const sdnn_real* gain = sdnn_gains;
  uint32_t k, j;
  for (k = 0; k < SDNN_N_NUMBERS; ++k) {
    sdnn_real change = 0;
    for (j = 0; j < SDNN_N_NUMBERS; ++j, ++gain) {
      const sdnn_real error =
          j == k ? errors[j] : sdnn_between(errors[j], farthest | SDNN_MINUS, farthest);
      change = sdnn_plus(change, sdnn_times(*gain, error));
    }
    estimates[k] = sdnn_plus(estimates[k], change);
  }
}

/* Predicts the inputs, corrects the estimates by the errors of the predictions, and writes the
 * estimates to the state. */
static inline void sdnn_remember(sdnn_episode* episode, const sdnn_real* inputs, sdnn_real* state) {
  sdnn_real *const estimates = episode->memory, errors[SDNN_N_NUMBERS];
  uint32_t k;
  if (episode->has_begun) sdnn_predict(episode);
  for (k = 0; k < SDNN_N_NUMBERS; ++k) {
    const sdnn_real x = sdnn_coordinate(inputs[sdnn_numbers[k]], k);
    if (!episode->has_begun) estimates[k] = x;
    errors[k] = sdnn_minus(x, estimates[k]);
    if (sdnn_is_circular[k]) errors[k] = sdnn_shorter(errors[k]);
  }
  if (episode->has_begun) sdnn_correct_estimates(estimates, errors);
  for (k = 0; k < SDNN_N_NUMBERS; ++k) {
    sdnn_real estimate = estimates[k];
    if (sdnn_is_circular[k]) {
      estimate = sdnn_part_of_turns(sdnn_over(estimate, SDNN_TWO_PI));
    } else {
      estimate = sdnn_over(sdnn_minus(estimate, sdnn_estimate_low[k]), sdnn_estimate_width[k]);
    }
    state[sdnn_numbers[k]] = sdnn_in_unit(estimate);
  }
}

#else

/* The first input minus the second; of angles the shorter way. */
static inline sdnn_real sdnn_difference(sdnn_real first, sdnn_real second, uint32_t k) {
  const sdnn_real change = sdnn_minus(first, second);
  return sdnn_is_circular[k] ? sdnn_minus(change, sdnn_nearest(change)) : change;
}

/* Writes the differences or the averages of inputs to the state, after the inputs themselves. */
static inline void sdnn_remember(sdnn_episode* episode, const sdnn_real* inputs, sdnn_real* state) {
  sdnn_real* const added = state + SDNN_N_OBSERVED_INPUTS;
  uint32_t k;
#if SDNN_HISTORY == SDNN_HISTORY_DIFFERENCES
  for (k = 0; k < SDNN_N_NUMBERS; ++k) {
    const sdnn_real x = inputs[sdnn_numbers[k]];
    const sdnn_real last = episode->has_begun ? episode->memory[k] : x;
    const sdnn_real part = sdnn_over(sdnn_difference(x, last, k), sdnn_largest_differences[k]);
    const sdnn_real within = sdnn_between(part, SDNN_ONE | SDNN_MINUS, SDNN_ONE);
    added[k] = sdnn_times(sdnn_plus(within, SDNN_ONE), SDNN_HALF);
    episode->memory[k] = x;
  }
#else
  const sdnn_real fast_rate = SDNN_HALF, slow_rate = UINT64_C(0x3fc999999999999a); /* 0.2 */
  uint32_t j;
  for (j = 0; j < SDNN_N_REMEMBERED; ++j) {
    sdnn_real average;
    k = j < SDNN_N_NUMBERS ? j : j - SDNN_N_NUMBERS;
    average = inputs[sdnn_numbers[k]];
    if (episode->has_begun) {
      const sdnn_real last = episode->memory[j];
      average = sdnn_plus(last, sdnn_times(j < SDNN_N_NUMBERS ? fast_rate : slow_rate,
                                           sdnn_difference(average, last, k)));
      if (sdnn_is_circular[k]) average = sdnn_part_of_turns(average);
    }
    episode->memory[j] = average;
    added[j] = sdnn_in_unit(average);
  }
#endif
}

#endif

/* Continues an episode, or begins it, with the inputs of an observation; writes the state. */
static inline void sdnn_continue(sdnn_episode* episode, const sdnn_real* inputs, sdnn_real* state) {
  uint32_t i;
  for (i = 0; i < SDNN_N_OBSERVED_INPUTS; ++i) state[i] = sdnn_in_unit(inputs[i]);
  sdnn_remember(episode, inputs, state);
  episode->has_begun = 1;
}

#include "sdnn_bins_of_state.h"
#if SDNN_IS_OBSERVER
/* Notes the action that is taken, as indices. */
static inline void sdnn_note_action(sdnn_episode* episode, const uint32_t* action) {
  uint32_t d;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
#ifdef SDNN_N_REAL_ACTIONS
    episode->action[d] = sdnn_real_actions[d * SDNN_N_REAL_ACTIONS + action[d]];
#else
    episode->action[d] = sdnn_real_of((int64_t)sdnn_first_action[d] + action[d], 0);
#endif
  }
}
#else
static inline void sdnn_note_action(sdnn_episode* episode, const uint32_t* action) {
  (void)episode;
  (void)action;
}
#endif

#ifdef SDNN_ACTION_DIGITS
/* Notes the greedy action at fractional indices, times 2^16, in the numbers of the task. */
static inline void sdnn_note_places(sdnn_episode* episode, const uint32_t* place) {
  const sdnn_real last = sdnn_real_of(SDNN_N_REAL_ACTIONS - 1, 0);
  uint32_t d;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    const sdnn_real low = sdnn_action_bounds[2 * d], high = sdnn_action_bounds[2 * d + 1];
    const sdnn_real part = sdnn_over(sdnn_real_of(place[d], -16), last);
    sdnn_real action = sdnn_plus(low, sdnn_times(sdnn_minus(high, low), part));
#if SDNN_ACTION_DIGITS == 0
    action = sdnn_floor(sdnn_plus(action, SDNN_HALF));
#else
    action = sdnn_with_digits(action, SDNN_ACTION_DIGITS, SDNN_LEAST_ACTION_BIT);
#endif
#if SDNN_ACTION_DIGITS < 53
    action = sdnn_between(action, low, high);
#endif
    episode->action[d] = action;
  }
}
#else
static inline void sdnn_note_places(sdnn_episode* episode, const uint32_t* place) {
  (void)episode;
  (void)place;
}
#endif

#endif /* SDNN_HISTORY_H */
