/* An agent that learns Q(s, a) linear in the SDNN code, by true-online Q(lambda) or Sarsa(lambda).
 * See cpp/include/sdnn/agents/q_lambda.hpp. */
#ifndef SDNN_Q_LAMBDA_H
#define SDNN_Q_LAMBDA_H

#define SDNN_IMAGE_MAGIC UINT32_C(0x4c4e4453) /* "SDNL" */
#define SDNN_N_RANDOMS 4
#include "sdnn_durations.h"
#include "sdnn_exploration.h"
#include "sdnn_readout.h"
#ifdef SDNN_HISTORY
#include "sdnn_history_learner.h"
#elif defined(SDNN_HOLDS)
#include "sdnn_held_observations.h"
#else
#include "sdnn_last_bins.h"
#endif

typedef int64_t sdnn_score;
#include "sdnn_ties.h"

#define SDNN_MOST_SNAPSHOTS 3072
#define SDNN_MOST_ENDED 20
#define SDNN_MOST_RANDOM (UINT32_C(1) << 30)
#define SDNN_AVERAGES (SDNN_AVERAGING_INTERVAL > 0)
#define SDNN_N_WEIGHTS (UINT32_C(1) * SDNN_N_ROWS * SDNN_N_COLUMNS)
#define SDNN_N_AVERAGED (SDNN_AVERAGES * SDNN_N_WEIGHTS)
#define SDNN_N_ALL_WEIGHTS (SDNN_N_WEIGHTS + SDNN_N_AVERAGED)
#define SDNN_N_KEPT SDNN_N_WEIGHTS

/* Everything that the agent remembers. All functions take its address. */
typedef struct {
  int64_t n_learned;
  int64_t n_steps;   /* steps that moved the weights */
  int64_t old_value; /* of the pending state, before the last step of learning */
  sdnn_scale scale;
  sdnn_random randoms[SDNN_N_RANDOMS];
  int32_t weights[SDNN_N_ALL_WEIGHTS]; /* and after them their averages, if any */
  int32_t traces[SDNN_N_WEIGHTS];
  int32_t exponent; /* values and weights count units of 2 to this power */
  int32_t reward;
  uint32_t rate, epsilon;      /* times 2^16 */
  uint32_t n_snapshots, phase; /* of the average, and steps since the last one */
  uint32_t n_random_left;      /* random steps left, at first or in the search for rewards */
  uint32_t n_ended;            /* episodes that terminated, up to 20 */
  uint32_t n_repeats;          /* steps that the random action, or the excursion, still lasts */
  uint32_t step;               /* of the episode */
  uint32_t repeated[SDNN_N_DIMENSIONS]; /* the last random action, or that of an excursion */
  uint32_t action[SDNN_N_DIMENSIONS];   /* of the pending transition */
  sdnn_states states;
#ifdef SDNN_DURATIONS_H
  sdnn_durations durations;
#endif
  sdnn_code codes[2]; /* of the pending state, and of another one */
  uint8_t pending;    /* the code of the state of the pending transition */
  uint8_t is_pending; /* whether a transition is to be learned */
  uint8_t has_exponent;
  uint8_t is_excursion;         /* whether n_repeats counts steps of an excursion */
  uint8_t skips_learning;       /* whether the next step to learn is one of an excursion */
  uint8_t is_live[SDNN_N_ROWS]; /* rows of traces that are not all 0 */
} sdnn_agent;

/* The number of weights that have a part in Q(s, a). */
static inline uint32_t sdnn_n_active_weights(const sdnn_code* code) {
  return (code->n_positive + code->n_negative) * SDNN_ACTION_WINDOW * SDNN_N_DIMENSIONS;
}

/* Q(s, a) in units, or the same sum of traces. */
static inline int64_t sdnn_sum(const int32_t* rows, const sdnn_code* code, const uint32_t* action) {
  int64_t total = 0;
  uint32_t d, i;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    for (i = 0; i < SDNN_ACTION_WINDOW; ++i) {
      const uint32_t row = sdnn_first_rows[d] + action[d] + i;
      total += sdnn_sum_of_row(rows + row * SDNN_N_COLUMNS, code);
    }
  }
  return total;
}

/* The sum over dimensions of the best action's value, in units. */
static inline int64_t sdnn_best_sum(const sdnn_agent* agent, const sdnn_code* code) {
  int64_t sums[SDNN_MOST_ROWS], total = 0;
  uint32_t d;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    sdnn_sums(agent->weights, code, d, sums);
    total += sdnn_largest(sums, sdnn_n_actions[d]);
  }
  return total;
}

static inline void sdnn_encode_state(const uint32_t* bins, sdnn_code* code) {
  sdnn_encode(&sdnn_the_coding, bins, code);
}

#include "sdnn_linear_td.h"

/* Sets the learning rate, to at least one unit, and epsilon by the schedule. */
static inline void sdnn_apply_rates(sdnn_agent* agent) {
  agent->rate = sdnn_scheduled(agent, SDNN_RATE_FIRST, SDNN_RATE_LAST);
  if (agent->rate == 0) agent->rate = 1;
  agent->epsilon = sdnn_scheduled(agent, SDNN_EPSILON_FIRST, SDNN_EPSILON_LAST);
}

/* Moves the rows of an action, which are active, and the others that have traces. */
static inline uint32_t sdnn_move_rows(sdnn_agent* agent, const sdnn_code* code,
                                      const uint32_t* action, int32_t gain, int32_t step,
                                      uint32_t shift, int32_t correction) {
  uint32_t used = 0, d, row = 0;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    const uint32_t first = sdnn_first_rows[d] + action[d];
    const uint32_t end = sdnn_first_rows[d] + sdnn_n_actions[d] + SDNN_ACTION_WINDOW - 1;
    for (; row < end; ++row) {
      const int is_active = row >= first && row < first + SDNN_ACTION_WINDOW;
      if (!is_active && !agent->is_live[row]) continue;
      used |= sdnn_move_row(agent, row, is_active ? code : 0, gain, step, shift, correction);
    }
  }
  return used;
}

#if SDNN_AVERAGES
/* Counts a step. At each SDNN_AVERAGING_INTERVAL steps, moves the average to the weights by 1 / 2^k
 * of the way: k grows with the number n of such snapshots, to the largest with 3 (2^k - 1) <= n. */
static inline void sdnn_note_step(sdnn_agent* agent) {
  const uint32_t interval = SDNN_AVERAGING_INTERVAL;
  int32_t* const averaged = agent->weights + SDNN_N_WEIGHTS;
  int32_t half;
  uint32_t k = 0, j;
  ++agent->n_steps;
  if (++agent->phase < interval) return;
  agent->phase = 0;
  while (3 * ((UINT32_C(2) << k) - 1) <= agent->n_snapshots) ++k;
  half = k > 0 ? (int32_t)(UINT32_C(1) << (k - 1)) : 0;
  for (j = 0; j < SDNN_N_WEIGHTS; ++j) {
    averaged[j] += (agent->weights[j] - averaged[j] + half) >> k;
  }
  if (agent->n_snapshots < SDNN_MOST_SNAPSHOTS) ++agent->n_snapshots;
}
#endif

/* Takes a step of learning from the pending transition; `next` is the value of the next state. */
static inline void sdnn_correct(sdnn_agent* agent, int64_t next) {
  const sdnn_code* const code = &agent->codes[agent->pending];
  int64_t drift;
  const int64_t error = sdnn_error(agent, code, agent->action, agent->reward, next, &drift);
  sdnn_move(agent, code, agent->action, error + drift, drift);
#if SDNN_AVERAGES
  sdnn_note_step(agent);
#endif
}

/* Takes a step of learning, with the value of the best action in the next state. */
static inline void sdnn_correct_by_best(sdnn_agent* agent) {
  const sdnn_code* const next = sdnn_other(agent, agent->states.next_bins);
  sdnn_correct(agent, sdnn_value(agent, next, 0, 0));
}

/* Ends an episode for learning: nothing is pending, and traces begin anew. */
static inline void sdnn_end(sdnn_agent* agent) {
  sdnn_end_traces(agent);
  agent->is_pending = 0;
}

/* Learns the pending transition of an episode that did not terminate. */
static inline void sdnn_finish_at_end(sdnn_agent* agent) {
  if (SDNN_IS_SARSA) sdnn_correct_by_best(agent);
  sdnn_end(agent);
}

/* Begins an episode. Call it before the first action, and whenever the task starts anew. */
static inline void sdnn_begin_episode(sdnn_agent* agent) {
  agent->step = 0;
  agent->n_repeats = 0;
  agent->is_excursion = agent->skips_learning = 0;
  sdnn_forget(&agent->states);
  if (agent->is_pending) sdnn_finish_at_end(agent);
}

/* Whether the agent has learned, but all rewards were 0. Then it searches by random actions that
 * last, which reach further than ties that are drawn at each step. */
static inline int sdnn_lacks_rewards(const sdnn_agent* agent) {
  return SDNN_SEARCHES && agent->n_learned > 0 && !agent->has_exponent && agent->epsilon > 0;
}

static inline uint32_t sdnn_larger(uint32_t a, uint32_t b) { return a > b ? a : b; }

#define SDNN_BEST 0
#define SDNN_RANDOM 1 /* the action is in agent->repeated */
#define SDNN_WORST 2  /* on an excursion from good states, which long episodes have */
#define SDNN_MAKES_EXCURSIONS (SDNN_SEARCHES && !SDNN_IS_SARSA)
#define SDNN_LONG_EPISODE 2000
#define SDNN_MOST_STEPS (UINT32_C(1) << 30) /* then they are no longer counted */
#define SDNN_DRAWS_FOR_EXCURSION 4

/* Which action the next step takes. */
static inline int sdnn_kind_of_action(sdnn_agent* agent) {
  const uint32_t most = (uint32_t)SDNN_MAX_ACTION_REPEAT >> agent->n_ended;
  const uint32_t least = SDNN_MAX_ACTION_REPEAT < 5 ? SDNN_MAX_ACTION_REPEAT : 5;
  const uint32_t longest = sdnn_larger(most, least);
  const uint32_t step = agent->step;
  const int may_explore = sdnn_may_explore(step) && agent->epsilon > 0;
  const int is_left = agent->n_random_left > 0 && (SDNN_START_STEPS > 0 || may_explore);
  const int at_random = is_left || (sdnn_lacks_rewards(agent) && may_explore);
  uint32_t d;
  if (step < SDNN_MOST_STEPS) ++agent->step;
  agent->skips_learning = 0;
  if (agent->is_excursion && !may_explore) agent->n_repeats = 0;
  if (agent->n_repeats == 0) agent->is_excursion = 0;
  if (is_left) --agent->n_random_left;
  if (agent->n_repeats > 0) {
    --agent->n_repeats;
    agent->skips_learning = agent->is_excursion;
    return agent->is_excursion ? SDNN_WORST : SDNN_RANDOM;
  }
  if (!at_random && !(may_explore && sdnn_bits(&agent->randoms[SDNN_EXPLORATION]) >> 11 <
                                         (uint64_t)agent->epsilon << 37)) {
    return SDNN_BEST;
  }
  if (SDNN_MAKES_EXCURSIONS) {
    sdnn_random* const repetitions = &agent->randoms[SDNN_REPETITIONS];
    agent->is_excursion = !at_random && step >= SDNN_LONG_EPISODE &&
                          sdnn_below(repetitions, SDNN_DRAWS_FOR_EXCURSION) == 0;
    if (agent->is_excursion) {
      agent->skips_learning = 1;
      agent->n_repeats = (uint32_t)sdnn_below(repetitions, longest);
      return SDNN_WORST;
    }
  }
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    agent->repeated[d] = (uint32_t)sdnn_below(&agent->randoms[SDNN_EXPLORATION], sdnn_n_actions[d]);
  }
  if (SDNN_SEARCHES && at_random && SDNN_START_STEPS == 0) {
    agent->n_repeats = (uint32_t)sdnn_below(&agent->randoms[SDNN_REPETITIONS],
                                            (uint64_t)SDNN_MAX_ACTION_REPEAT / 2);
  } else if (SDNN_MAX_ACTION_REPEAT > 1) {
    agent->n_repeats = sdnn_repetitions(&agent->randoms[SDNN_REPETITIONS], longest) - 1;
  }
  return SDNN_RANDOM;
}

/* The first action of the lowest value. */
static inline uint32_t sdnn_smallest_of(const int64_t* sums, uint32_t n_actions) {
  uint32_t worst = 0, i;
  for (i = 1; i < n_actions; ++i) {
    if (sums[i] < sums[worst]) worst = i;
  }
  return worst;
}

/* The tolerance of ties in units of 2^exponent. */
static inline int64_t sdnn_tie_tolerance(int32_t exponent) {
  const int32_t shift = exponent - (SDNN_TIE_TOLERANCE_EXPONENT);
  if (SDNN_TIE_TOLERANCE == 0) return 0;
  return shift < 0 ? INT64_C(1) << 62 : shift < 63 ? SDNN_TIE_TOLERANCE >> shift : 0;
}

/* The action to take in each dimension, at times a random one. */
static inline void sdnn_act_in_each(sdnn_agent* agent, const int32_t* observation,
                                    uint32_t* action) {
  uint32_t bins[SDNN_N_INPUTS], d;
  int64_t sums[SDNN_MOST_ROWS], least;
  const sdnn_code* code;
  int choice;
  if (SDNN_IS_REFUSED(int32_t, observation)) {
    sdnn_refuse(action);
    return;
  }
  choice = sdnn_kind_of_action(agent);
  if (choice == SDNN_RANDOM) {
    for (d = 0; d < SDNN_N_DIMENSIONS; ++d) action[d] = agent->repeated[d];
    if (SDNN_REMEMBERS) {
      sdnn_read_to_act(&agent->states, observation, bins);
      sdnn_note_act(&agent->states, action);
    }
    return;
  }
  sdnn_read_to_act(&agent->states, observation, bins);
  code = sdnn_other(agent, bins);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    sdnn_sums(agent->weights, code, d, sums);
    if (choice == SDNN_WORST) {
      action[d] = agent->repeated[d] = sdnn_smallest_of(sums, sdnn_n_actions[d]);
      continue;
    }
    least = sdnn_largest(sums, sdnn_n_actions[d]) - sdnn_tie_tolerance(agent->exponent);
    action[d] = sdnn_draw_tied(sums, sdnn_n_actions[d], least, &agent->randoms[SDNN_ACTING]);
  }
  sdnn_note_act(&agent->states, action);
}

/* The weights by which the agent acts greedily: their average where there is one. */
static inline const int32_t* sdnn_policy_of(const sdnn_agent* agent) {
  return agent->weights + (SDNN_AVERAGES && agent->n_snapshots > 0 ? SDNN_N_WEIGHTS : 0);
}

/* The exponent of the unit of its values. */
static inline int32_t sdnn_scale_of_policy(const sdnn_agent* agent) { return agent->exponent; }

/* A best action of dimension d, by the values of its actions. Between actions there are none. */
static inline uint32_t sdnn_greedy_of(int64_t* sums, uint32_t d, int32_t scale, uint32_t* place) {
  const int64_t least = sdnn_largest(sums, sdnn_n_actions[d]) - sdnn_tie_tolerance(scale);
  (void)place;
  return sdnn_tied(sums, sdnn_n_actions[d], least);
}

/* Q(observation, action) in units of 2 to the power of agent->exponent. */
static inline int64_t sdnn_q_of_each(const sdnn_agent* agent, const int32_t* observation,
                                     const uint32_t* action) {
  uint32_t bins[SDNN_N_INPUTS], limited[SDNN_N_DIMENSIONS];
  sdnn_code code;
  if (SDNN_IS_REFUSED(int32_t, observation)) return 0;
  sdnn_limit_action(action, limited);
  sdnn_read_only(&agent->states, observation, bins);
  sdnn_encode_state(bins, &code);
  return sdnn_sum(agent->weights, &code, limited);
}

/* Whether the last step, of this action, was one of an excursion and is not learned. */
static inline int sdnn_skips(sdnn_agent* agent, const uint32_t* action) {
  const int skips = SDNN_MAKES_EXCURSIONS && agent->skips_learning;
  uint32_t d;
  agent->skips_learning = 0;
  for (d = 0; skips && d < SDNN_N_DIMENSIONS; ++d) {
    if (action[d] != agent->repeated[d]) return 0;
  }
  return skips;
}

/* Makes the unit of values smaller at the end of a window of rewards, if it may be. */
static inline void sdnn_end_step(sdnn_agent* agent) {
  const int32_t size = sdnn_end_window(&agent->scale);
  if (size != INT32_MIN) sdnn_refine_unit(agent, size);
}

/* Learns a transition, whose reward is times 2^SDNN_FRACTION_BITS. `terminated` says that nothing
 * follows it; running out of time is no such end. Other steps of excursions are not learned. If the
 * next transition begins elsewhere, this one was the last of its episode. */
static inline void sdnn_learn_in_each(sdnn_agent* agent, const int32_t* observation,
                                      const uint32_t* action, int32_t reward,
                                      const int32_t* next_observation, int terminated) {
  uint32_t bins[SDNN_N_INPUTS], limited[SDNN_N_DIMENSIONS], d, is_next;
  const sdnn_code* code;
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
  if (sdnn_skips(agent, limited) && !terminated) {
    sdnn_end(agent);
    sdnn_read_next(&agent->states, limited, next_observation, agent->states.next_bins);
    sdnn_keep_next(&agent->states, next_observation);
    sdnn_end_step(agent);
    return;
  }
  if (agent->is_pending && !is_next) sdnn_finish_at_end(agent);
  code = sdnn_other(agent, bins);
  if (agent->is_pending) {
    if (SDNN_IS_SARSA) {
      sdnn_correct(agent, sdnn_value(agent, code, limited, 0));
    } else if (sdnn_sum(agent->weights, code, limited) < sdnn_best_sum(agent, code)) {
      sdnn_end(agent);
    }
    agent->is_pending = 0;
  }
  agent->pending = (uint8_t)(1 - agent->pending);
  sdnn_read_next(&agent->states, limited, next_observation, agent->states.next_bins);
  sdnn_keep_next(&agent->states, next_observation);
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) agent->action[d] = limited[d];
  agent->reward = reward;
#ifdef SDNN_DURATIONS_H
  agent->durations.pending = agent->durations.given;
#endif
  agent->is_pending = 1;
  if (SDNN_START_STEPS == 0 && reward != 0 &&
      sdnn_lacks_rewards(agent)) { /* search for more in twice as many steps */
    agent->n_random_left =
        agent->n_learned < SDNN_MOST_RANDOM / 2 ? 2 * (uint32_t)agent->n_learned : SDNN_MOST_RANDOM;
  }
  sdnn_fit_unit(agent, reward);
  ++agent->n_learned;
  sdnn_apply_rates(agent);
  if (terminated) {
    sdnn_correct(agent, 0);
    sdnn_end(agent);
    if ((SDNN_START_STEPS > 0 || agent->n_random_left == 0) && agent->n_ended < SDNN_MOST_ENDED) {
      ++agent->n_ended;
    }
  } else if (!SDNN_IS_SARSA) {
    sdnn_correct_by_best(agent);
  }
  sdnn_end_step(agent);
}

#if SDNN_N_DIMENSIONS == 1
static inline int64_t sdnn_q(const sdnn_agent* agent, const int32_t* observation, uint32_t action) {
  return sdnn_q_of_each(agent, observation, &action);
}
#else
#define sdnn_q sdnn_q_of_each
#endif

/* The head of an image has magic number and fingerprint, and from these bytes on: 8 exponent,
 * 12 n_snapshots, 16 n_random_left, 20 n_ended, 24 n_learned, 32 n_steps, 40 scale of rewards,
 * 60 random generators. */
#define SDNN_IMAGE_HEAD 188
#define SDNN_IMAGE_BYTES (SDNN_IMAGE_HEAD + 4 * SDNN_N_ALL_WEIGHTS + 4)

/* Reads the head of an image, or writes it. */
static inline void sdnn_carry_head(sdnn_agent* agent, uint8_t* image, int reads) {
  int32_t exponent = agent->has_exponent ? agent->exponent : INT32_MIN;
  uint8_t* at = sdnn_carry_32(image + 8, &exponent, 1, reads);
  if (reads && exponent != INT32_MIN) {
    agent->has_exponent = 1;
    agent->exponent = exponent;
  }
  at = sdnn_carry_32(at, &agent->n_snapshots, 1, reads);
  at = sdnn_carry_32(at, &agent->n_random_left, 1, reads);
  at = sdnn_carry_32(at, &agent->n_ended, 1, reads);
  at = sdnn_carry_64(at, &agent->n_learned, 1, reads);
  at = sdnn_carry_64(at, &agent->n_steps, 1, reads);
  at = sdnn_carry_scale(at, &agent->scale, reads);
  sdnn_carry_64(at, agent->randoms, 4 * SDNN_N_RANDOMS, reads);
}

/* Makes an agent with the head of an image, without weights. */
static inline void sdnn_begin_as(sdnn_agent* agent, const uint8_t* head) {
  uint64_t rest;
  sdnn_clear(agent, sizeof *agent);
  sdnn_carry_head(agent, (uint8_t*)head, 1);
  sdnn_quotient((uint64_t)agent->n_steps, SDNN_AVERAGES ? SDNN_AVERAGING_INTERVAL : 1, &rest);
  agent->phase = (uint32_t)rest;
#ifdef SDNN_HOLDS
  sdnn_forget(&agent->states);
#endif
  sdnn_apply_rates(agent);
}

/* Whether a head, which may be damaged, has possible numbers at the offsets of sdnn_carry_head. */
static inline int sdnn_is_head(const uint8_t* head) {
  const int32_t exponent = sdnn_get_32(head + 8);
  return sdnn_are_generators(head + 60) &&
         (exponent == INT32_MIN || (exponent >= -1100 && exponent <= 1100)) &&
         sdnn_get(head + 12, 4) <= SDNN_MOST_SNAPSHOTS &&
         sdnn_get(head + 16, 4) <= SDNN_MOST_RANDOM && sdnn_get(head + 20, 4) <= SDNN_MOST_ENDED &&
         sdnn_get(head + 24, 8) <= UINT64_C(1) << 45 && sdnn_get(head + 32, 8) >> 62 == 0 &&
         sdnn_is_scale(head + 40);
}

/* Whether the weights in a part of an image are in range. */
static inline int sdnn_is_possible(const sdnn_part* part) {
  uint32_t i;
  for (i = 0; i < part->n; i += 4) {
    const uint32_t at = part->offset + i;
    const int is_weight = at >= SDNN_IMAGE_HEAD && at < SDNN_IMAGE_BYTES - 4;
    if (is_weight && sdnn_size(sdnn_get_32(part->bytes + i)) >= SDNN_LARGEST_WEIGHT) return 0;
  }
  return 1;
}

#include "sdnn_linear_agent.h"
#endif /* SDNN_Q_LAMBDA_H */
