/* An actor-critic that learns a softmax policy and the values of states, both linear in the SDNN
 * code. See cpp/include/sdnn/agents/actor_critic.hpp. */
#ifndef SDNN_ACTOR_CRITIC_H
#define SDNN_ACTOR_CRITIC_H

#define SDNN_IS_ACTOR_CRITIC
#define SDNN_IMAGE_MAGIC UINT32_C(0x414e4453) /* "SDNA" */
#define SDNN_N_RANDOMS 2
#include "sdnn_durations.h"
#include "sdnn_learner.h"
#include "sdnn_softmax.h"
#include "sdnn_thermometers.h"
#ifdef SDNN_HISTORY
#include "sdnn_history_learner.h"
#include "sdnn_running_ranges.h"
#elif defined(SDNN_HOLDS)
#include "sdnn_held_observations.h"
#elif defined(SDNN_CODES)
#include "sdnn_last_bins.h"
#else
#include "sdnn_last_observation.h"
#endif

typedef uint32_t sdnn_score;
#include "sdnn_ties.h"

#define SDNN_IS_DUTCH 1
#define SDNN_CRITIC_ROW 0 /* those of the actor come after it */
#define SDNN_N_WEIGHTS (UINT32_C(1) * SDNN_N_COLUMNS)
#define SDNN_N_AVERAGED 0
#define SDNN_MOST_LEARNED (UINT64_C(1) << 45)
#define SDNN_N_ALL_WEIGHTS (UINT32_C(1) * SDNN_N_ROWS * SDNN_N_COLUMNS)
#define SDNN_N_KEPT SDNN_N_ALL_WEIGHTS

/* The running mean square of TD errors. */
typedef struct {
  int64_t mean_square; /* with 10 fractional bits */
  uint32_t n_errors;   /* up to 1,024 */
  int32_t exponent;    /* of the unit of errors */
} sdnn_error_scale;

/* The state of the agent. All functions take its address. */
typedef struct {
  int64_t n_learned;
  int64_t old_value; /* of the present state, before the last step of learning */
  sdnn_error_scale error_scale;
  sdnn_scale scale;
  sdnn_random randoms[SDNN_N_RANDOMS];
  int32_t weights[SDNN_N_ALL_WEIGHTS]; /* of the critic, and after them those of the actor */
  int32_t traces[SDNN_N_ALL_WEIGHTS];
  int32_t exponent;          /* values and the critic's weights count units of 2 to this power */
  uint32_t rate, actor_rate; /* times 2^16 */
  sdnn_states states;
#ifdef SDNN_DURATIONS_H
  sdnn_durations durations;
#endif
  sdnn_code codes[2]; /* of the state that was learned last, and of another one */
  uint8_t pending;    /* the code of the state that was learned last */
  uint8_t has_next;   /* whether the last transition did not terminate */
  uint8_t has_exponent;
  uint8_t is_live[SDNN_N_ROWS]; /* rows of traces that are not all 0 */
} sdnn_agent;

/* The number of weights that have a part in V(s). */
static inline uint32_t sdnn_n_active_weights(const sdnn_code* code) {
  return code->n_positive + code->n_negative;
}

/* V(s) in units, or the same sum of traces. The critic has no actions. */
static inline int64_t sdnn_sum(const int32_t* rows, const sdnn_code* code, const uint32_t* action) {
  (void)action;
  return sdnn_sum_of_row(rows, code);
}
static inline int64_t sdnn_best_sum(const sdnn_agent* agent, const sdnn_code* code) {
  return sdnn_sum(agent->weights, code, 0);
}

#include "sdnn_linear_td.h"

/* Corrects the critic's only row; see sdnn_linear_td.h. */
static inline uint32_t sdnn_move_rows(sdnn_agent* agent, const sdnn_code* code,
                                      const uint32_t* action, int32_t gain, int32_t step,
                                      uint32_t shift, int32_t correction) {
  (void)action;
  return sdnn_move_row(agent, SDNN_CRITIC_ROW, code, gain, step, shift, correction);
}

/* Sets both learning rates by the schedule, to at least one unit. */
static inline void sdnn_apply_rates(sdnn_agent* agent) {
  agent->rate = sdnn_scheduled(agent, SDNN_RATE_FIRST, SDNN_RATE_LAST);
  if (agent->rate == 0) agent->rate = 1;
  agent->actor_rate = sdnn_scheduled(agent, SDNN_ACTOR_RATE_FIRST, SDNN_ACTOR_RATE_LAST);
  if (agent->actor_rate == 0) agent->actor_rate = 1;
}

/* The integer part of the square root. */
static inline uint64_t sdnn_square_root(uint64_t x) {
  uint64_t root = 0, bit = UINT64_C(1) << 62;
  for (; bit != 0; bit >>= 2) {
    if (x >= root + bit) {
      x -= root + bit;
      root = (root >> 1) + bit;
    } else {
      root >>= 1;
    }
  }
  return root;
}

/* a / b, rounded towards 0. */
static inline int64_t sdnn_signed_quotient(int64_t a, uint64_t b) {
  uint64_t rest;
  const int64_t quotient = (int64_t)sdnn_quotient((uint64_t)sdnn_size(a), b, &rest);
  return a < 0 ? -quotient : quotient;
}

/* An error over the root mean square of the errors so far, this one included, with 12 fractional
 * bits, clipped to [-3, 3]: see cpp/include/sdnn/agents/detail/error_scale.hpp. */
static inline int32_t sdnn_normalized(sdnn_error_scale* scale, int64_t error, int32_t exponent) {
  const int64_t largest_mean = INT64_C(1) << 60, largest_size = 33554431; /* 2^25 - 1 */
  int64_t size = sdnn_size(error) >> 8, change, quotient;
  uint64_t root;
  for (; scale->exponent < exponent && scale->mean_square > 0; ++scale->exponent) {
    scale->mean_square >>= 2;
  }
  for (; scale->exponent > exponent && scale->mean_square > 0; --scale->exponent) {
    scale->mean_square =
        scale->mean_square > largest_mean >> 2 ? largest_mean : scale->mean_square * 4;
  }
  scale->exponent = exponent;
  if (size > largest_size) size = largest_size;
  if (scale->n_errors < 1024) ++scale->n_errors;
  change = size * size * 1024 - scale->mean_square;
  scale->mean_square += sdnn_signed_quotient(change, scale->n_errors);
  root = sdnn_square_root((uint64_t)(scale->mean_square >> 10));
  quotient = sdnn_signed_quotient(size * 4096, root > 0 ? root : 1);
  if (quotient > 12288) quotient = 12288;
  return (int32_t)(error < 0 ? -quotient : quotient);
}

/* log2(x / 2^30) with 20 fractional bits, by a polynomial of degree 4; x is at least 1. */
static inline int64_t sdnn_log2_of(uint64_t x) {
  static const int32_t coefficients[5] = {-86117, 336784, -710703, 1508612, 0};
  int32_t exponent = 30;
  int64_t fraction, logarithm = 0;
  uint32_t i;
  for (; x >> 31 != 0; x >>= 1) ++exponent;
  for (; x >> 30 == 0; x <<= 1) --exponent;
  fraction = (int64_t)((x & 1073741823) >> 10); /* the 20 bits after the leading one, at 2^30 */
  for (i = 0; i < 5; ++i) logarithm = coefficients[i] + sdnn_scaled(logarithm, fraction, 20);
  return (exponent - 30) * INT64_C(1048576) + logarithm;
}

/* The weights of the actions of dimension d, as sdnn_weigh has them; returns their sum. */
static inline uint64_t sdnn_weights_of(const sdnn_agent* agent, const sdnn_code* code, uint32_t d,
                                       int64_t* bits, uint32_t* weights) {
  sdnn_sums(agent->weights, code, d, bits);
  return sdnn_weigh(bits, sdnn_n_actions[d], weights);
}

/* Replaces `weights` by the probabilities p, and `bits` by minus the slope of the entropy H by each
 * preference, p (log p + H), both in units of 2^-16. */
static inline void sdnn_differentiate(int64_t* bits, uint32_t* weights, uint32_t n, uint64_t sum) {
  const int64_t ln_of_2 = 45426, log2_sum = sdnn_log2_of(sum); /* 2^16 for 1 */
  int64_t entropy = 0;
  uint64_t rest;
  uint32_t a;
  for (a = 0; a < n; ++a) {
    const uint64_t weight = weights[a];
    const uint64_t probability = sdnn_quotient((weight << 16) + sum / 2, sum, &rest);
    bits[a] += log2_sum;
    weights[a] = (uint32_t)probability;
    entropy += (int64_t)probability * bits[a];
  }
  entropy = sdnn_scaled(entropy, 1, 16);
  for (a = 0; a < n; ++a) {
    const int64_t in_nats = sdnn_scaled(entropy - bits[a], ln_of_2, 16);
    bits[a] = sdnn_scaled(weights[a] * in_nats, 1, 20);
  }
}

/* Moves the preferences along their traces by a normalized error, and along the gradient of the
 * entropy: see cpp/include/sdnn/agents/softmax_policy.hpp. */
static inline void sdnn_move_actor(sdnn_agent* agent, const sdnn_code* code, const uint32_t* action,
                                   int32_t error) {
  const uint32_t n = sdnn_n_active_weights(code);
  uint64_t rest;
  const int64_t rate =
      (int64_t)sdnn_quotient((uint64_t)agent->actor_rate << 12, n > 0 ? n : 1, &rest);
  const int64_t along_trace = sdnn_scaled(error, rate, 40 - SDNN_N_UNIT_BITS);
  uint32_t n_bits = 0, d, a, j;
  int32_t step;
  while (sdnn_size(along_trace) >> n_bits >= 8191) ++n_bits;
  step = (int32_t)sdnn_scaled(along_trace, 1, n_bits);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    int64_t slopes[SDNN_MOST_ROWS];
    uint32_t probabilities[SDNN_MOST_ROWS];
    const uint64_t sum = sdnn_weights_of(agent, code, d, slopes, probabilities);
    sdnn_differentiate(slopes, probabilities, sdnn_n_actions[d], sum);
    for (a = 0; a < sdnn_n_actions[d]; ++a) {
      const uint32_t row = sdnn_first_rows[d] + a;
      const int32_t gain = (a == action[d] ? SDNN_TRACE_ONE : 0) -
                           (int32_t)sdnn_scaled((int64_t)probabilities[a], 1, 4);
      const uint32_t used = sdnn_move_row(
          agent, row, code, gain, step, n_bits < 11 ? 12 - n_bits : 1,
          (int32_t)sdnn_scaled(slopes[a] * SDNN_ENTROPY, rate, 60 - SDNN_N_UNIT_BITS));
      int32_t* const weights = &agent->weights[row * SDNN_N_COLUMNS];
      if (used < SDNN_LARGEST_WEIGHT - 1) continue;
      for (j = 0; j < SDNN_N_COLUMNS; ++j) {
        weights[j] = (int32_t)sdnn_clipped(weights[j], SDNN_LARGEST_WEIGHT - 1);
      }
    }
  }
}

/* Ends an episode for learning: traces begin anew. */
static inline void sdnn_end(sdnn_agent* agent) {
  sdnn_end_traces(agent);
  agent->has_next = 0;
}

/* Begins an episode. Call it before the first action, and whenever the task starts anew. */
static inline void sdnn_begin_episode(sdnn_agent* agent) {
  sdnn_forget(&agent->states);
  sdnn_end(agent);
}

/* An action that is drawn by its probability. */
static inline uint32_t sdnn_drawn(const uint32_t* weights, uint64_t sum, sdnn_random* random) {
  uint64_t drawn = sdnn_below(random, sum);
  uint32_t action = 0;
  while (drawn >= weights[action]) drawn -= weights[action++];
  return action;
}

/* The action to take in each dimension, drawn by the policy. */
static inline void sdnn_act_in_each(sdnn_agent* agent, const int32_t* observation,
                                    uint32_t* action) {
  const sdnn_code* code;
  uint32_t bins[SDNN_N_INPUTS], d;
  if (SDNN_IS_REFUSED(int32_t, observation)) {
    sdnn_refuse(action);
    return;
  }
  sdnn_read_to_act(&agent->states, observation, bins);
  code = sdnn_other(agent, bins);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    int64_t bits[SDNN_MOST_ROWS];
    uint32_t weights[SDNN_MOST_ROWS];
    const uint64_t sum = sdnn_weights_of(agent, code, d, bits, weights);
    action[d] = sdnn_drawn(weights, sum, &agent->randoms[0]);
  }
  sdnn_note_act(&agent->states, action);
}

/* The weights by which the agent acts: those of the actor follow the critic's. */
static inline const int32_t* sdnn_policy_of(const sdnn_agent* agent) { return agent->weights; }

static inline int32_t sdnn_scale_of_policy(const sdnn_agent* agent) {
  (void)agent;
  return 0;
}

/* A most probable action of dimension d, by the preferences of its actions. Unless `place` is null,
 * the fractional index of the greedy action is written to it. */
static inline uint32_t sdnn_greedy_of(int64_t* preferences, uint32_t d, int32_t scale,
                                      uint32_t* place) {
  const uint32_t n = sdnn_n_actions[d];
  uint32_t weights[SDNN_MOST_ROWS], action;
  (void)scale;
  sdnn_weigh(preferences, n, weights);
  action = sdnn_tied(weights, n, SDNN_LARGEST_PART);
  if (place) *place = sdnn_mean_place(weights, n, action);
  return action;
}

/* V(observation) in units of 2 to the power of agent->exponent. */
static inline int64_t sdnn_state_value(const sdnn_agent* agent, const int32_t* observation) {
  uint32_t bins[SDNN_N_INPUTS];
  sdnn_code code;
  if (SDNN_IS_REFUSED(int32_t, observation)) return 0;
  sdnn_read_only(&agent->states, observation, bins);
  sdnn_encode_state(bins, &code);
  return sdnn_best_sum(agent, &code);
}

/* Learns a transition. Its reward is a number times 2^SDNN_FRACTION_BITS; `terminated` means that
 * the episode ended in a terminal state, not by a time limit. Traces are reset if the transition
 * does not begin where the last one ended. */
static inline void sdnn_learn_in_each(sdnn_agent* agent, const int32_t* observation,
                                      const uint32_t* action, int32_t reward,
                                      const int32_t* next_observation, int terminated) {
  uint32_t limited[SDNN_N_DIMENSIONS], bins[SDNN_N_INPUTS], is_next;
  const sdnn_code *code, *next_code;
  int64_t next = 0, error, drift;
  int32_t size;
  int is_accepted;
  if (SDNN_IS_REFUSED(int32_t, observation) || SDNN_IS_REFUSED(int32_t, next_observation)) return;
  is_accepted = sdnn_accepts(&agent->scale, reward);
  if (!is_accepted && !SDNN_REMEMBERS) return;
  sdnn_limit_action(action, limited);
  is_next = sdnn_read_first(&agent->states, observation, bins);
  if (!is_accepted) {
    sdnn_read_next(&agent->states, limited, next_observation, bins);
    return;
  }
  if (!is_next || !agent->has_next) sdnn_end(agent);
#ifdef SDNN_DURATIONS_H
  agent->durations.pending = agent->durations.given;
#endif
  code = sdnn_other(agent, bins);
  agent->pending = (uint8_t)(1 - agent->pending);
  sdnn_read_next(&agent->states, limited, next_observation, bins);
  next_code = sdnn_other(agent, bins);
  if ((uint64_t)agent->n_learned < SDNN_MOST_LEARNED) ++agent->n_learned;
  sdnn_apply_rates(agent);
  sdnn_fit_unit(agent, reward);
  if (!terminated) next = sdnn_value(agent, next_code, 0, 0);
  error = sdnn_error(agent, code, 0, reward, next, &drift);
  sdnn_move_actor(agent, code, limited,
                  sdnn_normalized(&agent->error_scale, error, agent->exponent));
  sdnn_move(agent, code, 0, error + drift, drift);
  sdnn_keep_next(&agent->states, next_observation);
  agent->has_next = 1;
  if (terminated) sdnn_end(agent);
  size = sdnn_end_window(&agent->scale);
  if (size != INT32_MIN) sdnn_refine_unit(agent, size);
}

/* The head of an image has magic number and fingerprint, and from these bytes on: 8 exponent, scale
 * of errors with 12 exponent, 16 n_errors and 20 mean_square, 28 n_learned, 36 scale of rewards, 56
 * random generators, 120 moments of running ranges. */
#define SDNN_IMAGE_HEAD 120
#ifdef SDNN_RUNNING_RANGES_H
#undef SDNN_IMAGE_HEAD
#define SDNN_IMAGE_HEAD (120 + SDNN_RANGES_BYTES)
#endif
#define SDNN_IMAGE_BYTES (SDNN_IMAGE_HEAD + 4 * SDNN_N_ALL_WEIGHTS + 4)

/* Reads the head of an image, or writes it. */
static inline void sdnn_carry_head(sdnn_agent* agent, uint8_t* image, int reads) {
  int32_t exponent = agent->has_exponent ? agent->exponent : INT32_MIN;
  uint8_t* at = sdnn_carry_32(image + 8, &exponent, 1, reads);
  if (reads && exponent != INT32_MIN) {
    agent->has_exponent = 1;
    agent->exponent = exponent;
  }
  at = sdnn_carry_32(at, &agent->error_scale.exponent, 1, reads);
  at = sdnn_carry_32(at, &agent->error_scale.n_errors, 1, reads);
  at = sdnn_carry_64(at, &agent->error_scale.mean_square, 1, reads);
  at = sdnn_carry_64(at, &agent->n_learned, 1, reads);
  at = sdnn_carry_scale(at, &agent->scale, reads);
  sdnn_carry_64(at, agent->randoms, 4 * SDNN_N_RANDOMS, reads);
#ifdef SDNN_RUNNING_RANGES_H
  sdnn_carry_ranges(image + 120, &agent->states.ranges, reads);
#endif
}

/* Makes an agent with the head of an image, without weights. */
static inline void sdnn_begin_as(sdnn_agent* agent, const uint8_t* head) {
  sdnn_clear(agent, sizeof *agent);
  sdnn_carry_head(agent, (uint8_t*)head, 1);
#ifdef SDNN_HOLDS
  sdnn_forget(&agent->states);
#endif
  sdnn_apply_rates(agent);
}

/* Whether an image may have this exponent of a unit. */
static inline int sdnn_is_exponent(int32_t exponent) {
  return exponent >= -1100 && exponent <= 1100;
}

/* Whether a head, which may be damaged, has possible numbers at the offsets of sdnn_carry_head. */
static inline int sdnn_is_head(const uint8_t* head) {
  const int32_t exponent = sdnn_get_32(head + 8);
#ifdef SDNN_RUNNING_RANGES_H
  if (!sdnn_are_ranges(head + 120)) return 0;
#endif
  return sdnn_are_generators(head + 56) && (exponent == INT32_MIN || sdnn_is_exponent(exponent)) &&
         sdnn_is_exponent(sdnn_get_32(head + 12)) && sdnn_get(head + 16, 4) <= 1024 &&
         sdnn_get(head + 20, 8) <= UINT64_C(1) << 60 &&
         sdnn_get(head + 28, 8) <= SDNN_MOST_LEARNED && sdnn_is_scale(head + 36);
}

/* Whether the weights in a part of an image are in range. -2^23 is one of the critic alone. */
static inline int sdnn_is_possible(const sdnn_part* part) {
  uint32_t i;
  for (i = 0; i < part->n; i += 4) {
    const uint32_t at = part->offset + i;
    const int64_t weight = sdnn_get_32(part->bytes + i);
    const int64_t is_of_actor = at >= SDNN_IMAGE_HEAD + 4 * SDNN_N_WEIGHTS;
    if (at < SDNN_IMAGE_HEAD || at >= SDNN_IMAGE_BYTES - 4) continue;
    if (weight >= SDNN_LARGEST_WEIGHT || weight < is_of_actor - SDNN_LARGEST_WEIGHT) return 0;
  }
  return 1;
}

#include "sdnn_linear_agent.h"
#endif /* SDNN_ACTOR_CRITIC_H */
