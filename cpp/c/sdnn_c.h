/* An agent that learns with SDNN-C, by n-step Q-learning: see
 * cpp/include/sdnn/agents/q_learning.hpp. */
#ifndef SDNN_C_H
#define SDNN_C_H

#include "sdnn_weight_bytes.h"

#define SDNN_IMAGE_MAGIC UINT32_C(0x434e4453) /* "SDNC" */
#define SDNN_N_RANDOMS 5
#include "sdnn_exploration.h"
#include "sdnn_real.h"
#ifdef SDNN_HOLDS
#include "sdnn_readings.h"
#else
#define SDNN_EPISODE_PARAMETER
#define SDNN_EPISODE
#endif

typedef uint32_t sdnn_score;
#include "sdnn_ties.h"

#define SDNN_AWAY 0      /* rounded away from the present count */
#define SDNN_HALF_UP 1   /* rounded to the nearest count */
#define SDNN_AT_RANDOM 2 /* rounded up with the probability of the fraction */

#define SDNN_N_STATES (SDNN_N_STEPS + 1)
#define SDNN_N_WORDS (UINT32_C(1) * SDNN_N_UNITS / 4 * SDNN_N_COLUMNS)
#define SDNN_N_KEPT (SDNN_N_WORDS + SDNN_N_UNITS)
#define SDNN_MOST_CHANGES (UINT32_C(2) * SDNN_MOST_COLUMNS)

static const sdnn_coding sdnn_the_coding = {sdnn_patterns, sdnn_modified, sdnn_modifiers,
                                            sdnn_units};

/* A random number in [0, 1), of 53 bits. */
static inline sdnn_real sdnn_uniform(sdnn_random* random) {
  return sdnn_real_of((int64_t)(sdnn_bits(random) >> 11), -53);
}

/* The change of a weight for a change of x_SD. The paired code has half the sum and half the
 * difference of two columns, for which it is twice as large. */
static inline int32_t sdnn_change(uint32_t column, int32_t change) {
#if SDNN_N_DOUBLE_GROUPS > 0 && SDNN_N_DOUBLE_GROUPS < SDNN_N_GROUPS
  return column < UINT32_C(1) * SDNN_N_DOUBLE_GROUPS * SDNN_N_PATTERN_UNITS ? 2 * change : change;
#else
  (void)column;
  return SDNN_N_DOUBLE_GROUPS > 0 ? 2 * change : change;
#endif
}

/* A state, and the potentials of all hidden units in it, which learning keeps up to date. */
typedef struct {
  sdnn_code code;
  uint32_t last_use; /* 0: there is no state */
  int32_t potentials[SDNN_N_UNITS];
} sdnn_state;

/* A transition that will be learned when SDNN_N_STEPS rewards are known, or at the end. */
typedef struct {
  uint32_t state, action;
  int32_t reward;
} sdnn_transition;

/* The state of the agent. It may be in any memory: all functions take its address. */
typedef struct {
  sdnn_random randoms[SDNN_N_RANDOMS];
  sdnn_scale scale;
  sdnn_real progress, rate, epsilon, q_low, q_high;
#if SDNN_ADAPTS
  sdnn_real low, high;     /* the range of returns */
  sdnn_real sum;           /* of the episode's rewards, each step times the discount */
  uint64_t n_returns, due; /* all so far, and the number of the next one that is remembered */
  sdnn_real returns[256];
#endif
  sdnn_state states[SDNN_N_STATES];
  sdnn_transition pending[SDNN_N_STEPS];
  uint32_t weights[SDNN_N_WORDS]; /* of four units a word, 128 more than they are */
  int32_t thresholds[SDNN_N_UNITS];
#if SDNN_ADAPTS
  int32_t rewards[2 * SDNN_HORIZON]; /* whose returns are not known yet */
  uint32_t n_rewards, n_kept_returns, oldest;
#endif
  uint32_t latest;           /* which state was used last */
  uint32_t n_pending, first; /* pending transitions, and the place of the oldest */
  uint32_t next_bins[SDNN_N_INPUTS];
  int32_t next_observation[SDNN_N_OBSERVED];
  uint32_t clock;         /* of uses of states */
  uint32_t below, above;  /* ranks of values below and above the range of counts */
  uint32_t n_random_left; /* random steps at the beginning that are still to come */
  uint32_t n_repeats;     /* steps in which the last random action will still be taken */
  uint32_t repeated;      /* that action */
  uint32_t step;          /* of the episode */
#ifdef SDNN_HOLDS
  sdnn_greedy_episode readings;
#endif
} sdnn_agent;

#if SDNN_ADAPTS
#include "sdnn_return_range.h"
#endif

/* Lists the columns in which the codes of two states differ: those to add from the beginning of
 * `columns`, which has SDNN_MOST_CHANGES places, and those to subtract from its end. A column that
 * changes by 2, from -1 to 1 or back, is listed twice. */
static inline void sdnn_changes(const sdnn_code* from, const sdnn_code* to, sdnn_column* columns,
                                uint32_t* n_positive, uint32_t* n_negative) {
  const sdnn_code* const codes[2] = {from, to};
  int8_t changes[SDNN_N_COLUMNS];
  uint32_t i, j;
  sdnn_clear(changes, SDNN_N_COLUMNS);
  for (i = 0; i < 2; ++i) {
    const int8_t sign = i == 0 ? -1 : 1;
    const sdnn_column* const negative =
        codes[i]->columns + SDNN_MOST_COLUMNS - codes[i]->n_negative;
    for (j = 0; j < codes[i]->n_positive; ++j) {
      changes[codes[i]->columns[j]] = (int8_t)(changes[codes[i]->columns[j]] + sign);
    }
    for (j = 0; j < codes[i]->n_negative; ++j) {
      changes[negative[j]] = (int8_t)(changes[negative[j]] - sign);
    }
  }
  *n_positive = *n_negative = 0;
  for (j = 0; j < SDNN_N_COLUMNS; ++j) {
    for (; changes[j] > 0; --changes[j]) columns[(*n_positive)++] = (sdnn_column)j;
    for (; changes[j] < 0; ++changes[j])
      columns[SDNN_MOST_CHANGES - ++*n_negative] = (sdnn_column)j;
  }
}

/* Computes the potentials of a state from its code: by the columns that differ from those of the
 * state `from`, or by all columns if these are fewer or `from` is null. */
static inline void sdnn_evaluate(const sdnn_agent* agent, sdnn_state* state,
                                 const sdnn_state* from) {
  sdnn_column changes[SDNN_MOST_CHANGES];
  uint32_t n_positive = 0, n_negative = 0, unit, i;
  const sdnn_column *positive = changes, *negative;
  if (from) sdnn_changes(&from->code, &state->code, changes, &n_positive, &n_negative);
  negative = changes + SDNN_MOST_CHANGES - n_negative;
  if (!from || n_positive + n_negative > state->code.n_positive + state->code.n_negative) {
    from = 0;
    positive = state->code.columns;
    n_positive = state->code.n_positive;
    n_negative = state->code.n_negative;
    negative = positive + SDNN_MOST_COLUMNS - n_negative;
  }
  for (unit = 0; unit < SDNN_N_UNITS; unit += 4) {
    uint32_t sums[4];
    for (i = 0; i < 4; ++i) {
      sums[i] =
          from ? (uint32_t)from->potentials[unit + i] : 0 - (uint32_t)agent->thresholds[unit + i];
    }
    sdnn_add_signed(agent->weights + (unit >> 2) * SDNN_N_COLUMNS, positive, n_positive, negative,
                    n_negative, sums);
    for (i = 0; i < 4; ++i) {
      state->potentials[unit + i] = sums[i] >> 31 ? -(int32_t)~sums[i] - 1 : (int32_t)sums[i];
    }
  }
}

/* A pending transition; number 0 is the oldest. */
static inline sdnn_transition* sdnn_pending(sdnn_agent* agent, uint32_t i) {
  i += agent->first;
  return &agent->pending[i < SDNN_N_STEPS ? i : i - SDNN_N_STEPS];
}

/* The cached state with these bins. A new one replaces the least recently used state that no
 * pending transition needs; there is one, since pending transitions are fewer than states. */
static inline sdnn_state* sdnn_state_of(sdnn_agent* agent, const uint32_t* bins) {
  const sdnn_state* const from = &agent->states[agent->latest];
  sdnn_state* chosen = 0;
  uint32_t i, j;
  for (i = 0; i < SDNN_N_STATES; ++i) {
    sdnn_state* const state = &agent->states[i];
    uint32_t is_free = 1, is_same = state->last_use > 0;
    for (j = 0; j < SDNN_N_INPUTS; ++j) is_same &= state->code.bins[j] == bins[j];
    if (is_same) {
      chosen = state;
      break;
    }
    for (j = 0; j < agent->n_pending; ++j) is_free &= sdnn_pending(agent, j)->state != i;
    if (is_free && (!chosen || state->last_use < chosen->last_use)) chosen = state;
  }
  if (i == SDNN_N_STATES) {
    sdnn_encode(&sdnn_the_coding, bins, &chosen->code);
    sdnn_evaluate(agent, chosen, from == chosen || from->last_use == 0 ? 0 : from);
  }
  if (++agent->clock == 0) agent->clock = 1;
  chosen->last_use = agent->clock;
  agent->latest = (uint32_t)(chosen - agent->states);
  return chosen;
}

/* Whether a potential is above 0: only then the highest bit of potential - 1 is 0, as potentials
 * are far above -2^31. */
static inline uint32_t sdnn_fires(int32_t potential) {
  return 1 - (((uint32_t)potential - 1) >> 31);
}

/* The number of firing units in an action's window, which stands for its value. */
static inline uint32_t sdnn_count(const sdnn_state* state, uint32_t action) {
  const int32_t* const potentials = state->potentials + sdnn_first_units[action];
  uint32_t unit, n_firing = 0;
  for (unit = 0; unit < SDNN_N_ACTIVE_UNITS; ++unit) n_firing += sdnn_fires(potentials[unit]);
  return n_firing;
}

/* The value of a number of firing units: on the line from q_low at U_LOW units to q_high at U_HIGH
 * units, and constant beyond its ends. */
static inline sdnn_real sdnn_value(const sdnn_agent* agent, uint32_t n_firing) {
  const sdnn_real above = sdnn_real_of((int64_t)SDNN_U_HIGH - n_firing, 0);
  const sdnn_real below = sdnn_real_of((int64_t)n_firing - SDNN_U_LOW, 0);
  const uint32_t u_low = SDNN_U_LOW;
  if (n_firing > SDNN_U_HIGH) return agent->q_high;
  if (n_firing < u_low) return agent->q_low;
  return sdnn_over(sdnn_plus(sdnn_times(agent->q_low, above), sdnn_times(agent->q_high, below)),
                   sdnn_real_of(SDNN_U_HIGH - SDNN_U_LOW, 0));
}

/* Sets the range of values, and the ranks by which values are compared. The value of n firing units
 * has the rank 2 n + 1; for counts outside of the line's ends rounding decides the rank. */
static inline void sdnn_set_range(sdnn_agent* agent, sdnn_real low, sdnn_real high) {
  sdnn_real end;
  agent->q_low = low;
  agent->q_high = high;
  end = sdnn_value(agent, SDNN_U_LOW);
  agent->below =
      UINT32_C(2) * SDNN_U_LOW + 1 - (uint32_t)sdnn_less(low, end) + (uint32_t)sdnn_less(end, low);
  end = sdnn_value(agent, SDNN_U_HIGH);
  agent->above = UINT32_C(2) * SDNN_U_HIGH + 1 + (uint32_t)sdnn_less(end, high) -
                 (uint32_t)sdnn_less(high, end);
}

/* Writes the rank of each action's value: `below` and `above` for counts beyond the ends of the
 * line. Returns the number of units that fire for a best action. */
static inline uint32_t sdnn_rank(const sdnn_state* state, uint32_t below, uint32_t above,
                                 uint32_t* ranks) {
  const int32_t* const potentials = state->potentials;
  const uint32_t u_low = SDNN_U_LOW;
  uint32_t action, unit = 0, n_firing = sdnn_count(state, 0), best = 0, n_best = n_firing;
  for (action = 0; action < SDNN_N_ACTIONS; ++action) {
    for (; unit < sdnn_first_units[action]; ++unit) {
      n_firing += sdnn_fires(potentials[unit + SDNN_N_ACTIVE_UNITS]);
      n_firing -= sdnn_fires(potentials[unit]);
    }
    ranks[action] = 2 * n_firing + 1;
    if (n_firing > SDNN_U_HIGH) ranks[action] = above;
    if (n_firing < u_low) ranks[action] = below;
    if (ranks[action] > best) {
      best = ranks[action];
      n_best = n_firing;
    }
  }
  return n_best;
}

/* The value of the best action in a state. */
static inline sdnn_real sdnn_state_value(sdnn_agent* agent, const uint32_t* bins) {
  uint32_t ranks[SDNN_N_ACTIONS];
  const sdnn_state* const state = sdnn_state_of(agent, bins);
  return sdnn_value(agent, sdnn_rank(state, agent->below, agent->above, ranks));
}

/* The number of units that must fire for a value, rounded by SDNN_ROUNDING_RULE; `n_firing` fire
 * now. Rounded away from `n_firing`, a count that is whole but for 1e-9, by rounding errors, stays.
 */
static inline uint32_t sdnn_target_count(sdnn_agent* agent, sdnn_real value, uint32_t n_firing) {
  const sdnn_real clipped = sdnn_between(value, agent->q_low, agent->q_high);
  const sdnn_real part =
      sdnn_times(sdnn_minus(clipped, agent->q_low), sdnn_real_of(SDNN_U_HIGH - SDNN_U_LOW, 0));
  const sdnn_real exact = sdnn_plus(sdnn_real_of(SDNN_U_LOW, 0),
                                    sdnn_over(part, sdnn_minus(agent->q_high, agent->q_low)));
  const sdnn_real nothing = UINT64_C(0x3e112e0be826d695); /* 1e-9 */
  if (SDNN_ROUNDING_RULE == SDNN_HALF_UP) {
    return (uint32_t)sdnn_whole(sdnn_plus(exact, UINT64_C(1022) << 52));
  }
  if (SDNN_ROUNDING_RULE == SDNN_AT_RANDOM) {
    return (uint32_t)sdnn_whole(sdnn_plus(exact, sdnn_uniform(&agent->randoms[SDNN_ROUNDING])));
  }
  if (sdnn_less(sdnn_real_of(n_firing, 0), exact)) {
    const sdnn_real least = sdnn_minus(exact, nothing);
    const uint32_t whole = least >> 63 ? 0 : (uint32_t)sdnn_whole(least);
    return whole + (uint32_t)sdnn_less(sdnn_real_of(whole, 0), least);
  }
  return (uint32_t)sdnn_whole(sdnn_plus(exact, nothing));
}

/* Moves the weights of a unit by `step` times the code, or twice that for half sums and half
 * differences, and its threshold by -step. Returns whether it did: not if a weight would exceed the
 * limit. The first of two passes only checks, so that nothing changes then. */
static inline int sdnn_correct_unit(sdnn_agent* agent, const sdnn_code* code, uint32_t unit,
                                    int32_t step) {
  uint32_t* const row = agent->weights + (unit >> 2) * SDNN_N_COLUMNS;
  const uint32_t shift = 8 * (unit & 3);
  uint32_t part, j, is_second;
  for (is_second = 0; is_second < 2; ++is_second) {
    for (part = 0; part < 2; ++part) {
      const uint32_t n = part == 0 ? code->n_positive : code->n_negative;
      const sdnn_column* const columns = code->columns + (part == 0 ? 0 : SDNN_MOST_COLUMNS - n);
      const int32_t change = part == 0 ? step : -step;
      for (j = 0; j < n; ++j) {
        const uint32_t column = columns[j];
        const int32_t weight_change = sdnn_change(column, change);
        if (is_second) {
          row[column] += (uint32_t)weight_change << shift;
        } else if ((uint32_t)((int32_t)(row[column] >> shift & 255) + weight_change -
                              (128 - SDNN_WEIGHT_LIMIT)) > 2 * SDNN_WEIGHT_LIMIT) {
          return 0;
        }
      }
    }
  }
  agent->thresholds[unit] -= step;
  return 1;
}

/* The changes of the potentials of all cached states, when a unit's weights move by a code and its
 * threshold by -1: the product of the two codes, and 1 for the threshold. */
static inline void sdnn_products(const sdnn_agent* agent, const sdnn_code* code,
                                 int32_t* products) {
  int8_t signs[SDNN_N_COLUMNS];
  uint32_t i, j;
  sdnn_clear(signs, SDNN_N_COLUMNS);
  for (j = 0; j < code->n_positive; ++j) signs[code->columns[j]] = 1;
  for (j = 1; j <= code->n_negative; ++j) signs[code->columns[SDNN_MOST_COLUMNS - j]] = -1;
  for (i = 0; i < SDNN_N_STATES; ++i) {
    const sdnn_code* const other = &agent->states[i].code;
    products[i] = 1;
    if (agent->states[i].last_use == 0) continue;
    for (j = 0; j < other->n_positive; ++j) {
      const uint32_t column = other->columns[j];
      const int32_t change = signs[column];
      products[i] += sdnn_change(column, change);
    }
    for (j = 1; j <= other->n_negative; ++j) {
      const uint32_t column = other->columns[SDNN_MOST_COLUMNS - j];
      const int32_t change = signs[column];
      products[i] -= sdnn_change(column, change);
    }
  }
}

/* Makes `n` more or fewer units of an action's window fire: in each of n parts of the window, the
 * unit that is nearest to its threshold is corrected. */
static inline void sdnn_move_count(sdnn_agent* agent, sdnn_state* state, uint32_t action,
                                   uint32_t n, int is_more) {
  const uint32_t first = sdnn_first_units[action];
  const int32_t step = is_more ? SDNN_LATTICE : -SDNN_LATTICE;
  int32_t products[SDNN_N_STATES];
  uint64_t rest;
  const uint32_t width = (uint32_t)sdnn_quotient(SDNN_N_ACTIVE_UNITS, n, &rest);
  uint32_t i, j, unit = first, over = 0;
  sdnn_products(agent, &state->code, products);
  for (i = 0; i < n; ++i) {
    uint32_t end = unit + width, nearest = UINT32_C(1) << 31, best = 0;
    over += (uint32_t)rest;
    if (over >= n) {
      over -= n;
      ++end;
    }
    for (; unit < end; ++unit) {
      const uint32_t potential = (uint32_t)state->potentials[unit];
      const uint32_t distance = is_more ? 0 - potential : potential - 1;
      if (distance < nearest) {
        nearest = distance;
        best = unit;
      }
    }
    if (nearest >> 31) continue;
    if (!sdnn_correct_unit(agent, &state->code, best, step)) continue;
    for (j = 0; j < SDNN_N_STATES; ++j) agent->states[j].potentials[best] += step * products[j];
  }
}

/* Learns the oldest pending transition, with the discounted sum of all pending rewards and `value`,
 * that of the state after the newest transition, as the target. */
static inline void sdnn_learn_oldest(sdnn_agent* agent, sdnn_real value) {
  const sdnn_transition* const oldest = sdnn_pending(agent, 0);
  sdnn_state* const state = &agent->states[oldest->state];
  const uint32_t action = oldest->action, n_firing = sdnn_count(state, action);
  sdnn_real target;
  uint32_t i, n_target;
  for (i = agent->n_pending; i-- > 0;) {
    value = sdnn_plus(sdnn_real_of(sdnn_pending(agent, i)->reward, -SDNN_FRACTION_BITS),
                      sdnn_times(SDNN_DISCOUNT, value));
  }
  --agent->n_pending;
  agent->first = agent->first + 1 < SDNN_N_STEPS ? agent->first + 1 : 0;
  target = sdnn_plus(sdnn_times(sdnn_minus(SDNN_ONE, agent->rate), sdnn_value(agent, n_firing)),
                     sdnn_times(agent->rate, value));
  n_target = sdnn_target_count(agent, target, n_firing);
  if (n_target > n_firing) sdnn_move_count(agent, state, action, n_target - n_firing, 1);
  if (n_target < n_firing) sdnn_move_count(agent, state, action, n_firing - n_target, 0);
}

/* Learns all pending transitions; `value` is that of the state after the newest one. */
static inline void sdnn_learn_all(sdnn_agent* agent, sdnn_real value) {
  while (agent->n_pending > 0) sdnn_learn_oldest(agent, value);
}

/* Begins an episode. Call it before the first action, and whenever the task starts anew. */
static inline void sdnn_begin_episode(sdnn_agent* agent) {
  agent->step = 0;
  agent->n_repeats = 0;
#ifdef SDNN_HOLDS
  sdnn_forget_readings(&agent->readings);
#endif
  if (agent->n_pending > 0) sdnn_learn_all(agent, sdnn_state_value(agent, agent->next_bins));
}

/* A rate that moves from `first` to `last` while the progress moves from 0 to `fraction`; it is
 * constant if `fraction` is 0. */
static inline sdnn_real sdnn_scheduled(sdnn_real progress, sdnn_real fraction, sdnn_real first,
                                       sdnn_real last) {
  sdnn_real part = progress;
  if (fraction == 0) return first;
  if (fraction != SDNN_ONE) part = sdnn_over(progress, fraction);
  if (sdnn_less(SDNN_ONE, part)) part = SDNN_ONE;
  return sdnn_plus(sdnn_times(sdnn_minus(SDNN_ONE, part), first), sdnn_times(part, last));
}

/* Sets the learning rate and epsilon by the schedule, for a progress in [0, 1]. */
static inline void sdnn_follow_progress(sdnn_agent* agent, sdnn_real progress) {
  agent->progress = progress;
  agent->rate = sdnn_scheduled(progress, SDNN_RATE_FRACTION, SDNN_RATE_FIRST, SDNN_RATE_LAST);
  agent->epsilon =
      sdnn_scheduled(progress, SDNN_EPSILON_FRACTION, SDNN_EPSILON_FIRST, SDNN_EPSILON_LAST);
}

/* Sets the share of the training that is done, 0 to 65536, which alpha and epsilon follow. */
static inline void sdnn_set_progress(sdnn_agent* agent, uint32_t progress) {
  sdnn_follow_progress(agent, sdnn_real_of(progress < 65536 ? (int64_t)progress : 65536, -16));
}

#if SDNN_IS_NEW
/* Draws weights and sets thresholds as the library does: weights column by column, with two bits
 * for each hidden unit, of which the first adds 1 and the second subtracts 1. Units that no action
 * uses are drawn too, but not stored. */
static inline void sdnn_draw_weights(sdnn_agent* agent) {
  sdnn_random random;
  uint32_t unit, group, at, i, j, k;
  for (i = 0; i < 4; ++i) random.words[i] = sdnn_seed_of_weights[i];
  for (i = 0; i < SDNN_N_WORDS; ++i) {
    volatile uint32_t* const word = &agent->weights[i]; /* else: memset */
    *word = UINT32_C(0x80808080);
  }
  for (group = 0; group < SDNN_N_GROUPS; ++group) {
    const uint32_t pair = sdnn_groups[group], is_double = sdnn_is_double(pair);
    const sdnn_unit* const units = sdnn_units + pair * SDNN_N_PATTERN_UNITS;
    for (k = 0; k < SDNN_N_PATTERN_UNITS; ++k) {
      uint64_t bits = 0;
      for (at = 0; units[at] != k; ++at) {
      }
      unit = j = 0;
      for (i = 0; i < SDNN_N_HIDDEN_UNITS; ++i, bits >>= 2) {
        uint32_t weight, lane;
        if ((i & 31) == 0) bits = sdnn_bits(&random);
        while (j < SDNN_N_RANGES && i >= sdnn_used[j][1]) ++j;
        if (j == SDNN_N_RANGES || i < sdnn_used[j][0]) continue;
        agent->thresholds[unit] = (i & 1) == 0 ? -SDNN_FIRST_THRESHOLD : SDNN_FIRST_THRESHOLD;
        weight = (uint32_t)(bits & 1) - (uint32_t)(bits >> 1 & 1);
        lane =
            (unit >> 2) * SDNN_N_COLUMNS + (pair - (is_double & pair)) * SDNN_N_PATTERN_UNITS + at;
        /* Paired groups have half sums and half differences of two weights: the weight of the
         * second group counts negatively in the difference. */
        agent->weights[lane] += weight << 8 * (unit & 3);
        if (is_double & pair) weight = 0 - weight;
        if (is_double) agent->weights[lane + SDNN_N_PATTERN_UNITS] += weight << 8 * (unit & 3);
        ++unit;
      }
    }
  }
}
#endif

/* Whether the next step takes a random action, agent->repeated: that of the last step while repeats
 * are left, else one that is drawn. */
static inline int sdnn_explores(sdnn_agent* agent) {
  const uint32_t step = agent->step++;
  const int at_random = agent->n_random_left > 0;
  if (at_random) --agent->n_random_left;
  if (agent->n_repeats > 0) {
    --agent->n_repeats;
    return 1;
  }
  if (!at_random && !(sdnn_may_explore(step) && agent->epsilon > 0 &&
                      sdnn_less(sdnn_uniform(&agent->randoms[SDNN_EXPLORATION]), agent->epsilon))) {
    return 0;
  }
  agent->repeated = (uint32_t)sdnn_below(&agent->randoms[SDNN_EXPLORATION], SDNN_N_ACTIONS);
  if (SDNN_MAX_ACTION_REPEAT > 1) {
    agent->n_repeats =
        sdnn_repetitions(&agent->randoms[SDNN_REPETITIONS], SDNN_MAX_ACTION_REPEAT) - 1;
  }
  return 1;
}

/* The highest of the ranks of the actions. */
static inline uint32_t sdnn_highest(const uint32_t* ranks) {
  uint32_t action, best = 0;
  for (action = 0; action < SDNN_N_ACTIONS; ++action) {
    if (ranks[action] > best) best = ranks[action];
  }
  return best;
}

/* The number of the action to take, at times a random one. */
static inline uint32_t sdnn_act(sdnn_agent* agent, const int32_t* observation) {
  uint32_t bins[SDNN_N_INPUTS], ranks[SDNN_N_ACTIONS];
  if (SDNN_IS_REFUSED(int32_t, observation)) return SDNN_REFUSED;
#ifdef SDNN_HOLDS
  observation = sdnn_note_readings(&agent->readings, observation);
#endif
  if (sdnn_explores(agent)) return agent->repeated;
  sdnn_bins_of_fixed(observation, bins);
  sdnn_rank(sdnn_state_of(agent, bins), agent->below, agent->above, ranks);
  return sdnn_draw_tied(ranks, SDNN_N_ACTIONS, sdnn_highest(ranks), &agent->randoms[SDNN_ACTING]);
}

/* Computes the state of an observation outside of the agent. */
static inline void sdnn_read_state(const sdnn_agent* agent, const int32_t* observation,
                                   sdnn_state* state) {
  const sdnn_state* const latest = &agent->states[agent->latest];
  uint32_t bins[SDNN_N_INPUTS];
  sdnn_bins_of_fixed(observation, bins);
  sdnn_encode(&sdnn_the_coding, bins, &state->code);
  sdnn_evaluate(agent, state, latest->last_use > 0 ? latest : 0);
}

#ifdef SDNN_HOLDS
/* Begins an episode of greedy steps, apart from the one of which the agent learns. */
static inline void sdnn_begin_greedy_episode(const sdnn_agent* agent,
                                             sdnn_greedy_episode* episode) {
  sdnn_forget_held(episode->held);
  episode->n_reads = agent->readings.n_reads;
}
#endif

/* The number of a best action. */
static inline uint32_t sdnn_greedy(const sdnn_agent* agent,
                                   SDNN_EPISODE_PARAMETER const int32_t* observation) {
  uint32_t ranks[SDNN_N_ACTIONS];
  sdnn_state state;
  if (SDNN_IS_REFUSED(int32_t, observation)) return SDNN_REFUSED;
#ifdef SDNN_HOLDS
  observation = sdnn_readings_of(&agent->readings, episode, observation);
#endif
  sdnn_read_state(agent, observation, &state);
  sdnn_rank(&state, agent->below, agent->above, ranks);
  return sdnn_tied(ranks, SDNN_N_ACTIONS, sdnn_highest(ranks));
}

/* Q(observation, action), times 2^SDNN_FRACTION_BITS, rounded to the nearest. Values of 2^62 and
 * more in this unit become 2^62. */
static inline int64_t sdnn_q(const sdnn_agent* agent, const int32_t* observation, uint32_t action) {
  int32_t exponent;
  uint64_t fraction;
  sdnn_real value;
  sdnn_state state;
#ifdef SDNN_HOLDS
  int32_t held[SDNN_N_OBSERVED];
  sdnn_read_held(&agent->readings, observation, held);
  observation = held;
#endif
  if (SDNN_IS_REFUSED(int32_t, observation)) return 0;
  sdnn_read_state(agent, observation, &state);
  value =
      sdnn_value(agent, sdnn_count(&state, action < SDNN_N_ACTIONS ? action : SDNN_N_ACTIONS - 1));
  if (value << 1 == 0) return 0;
  fraction = sdnn_fraction(value, &exponent); /* below 2^53: it can be shifted by up to 9 bits */
  exponent += SDNN_FRACTION_BITS;
  if (exponent < -63) return 0;
  fraction = exponent > 9    ? UINT64_C(1) << 62
             : exponent >= 0 ? fraction << exponent
                             : ((fraction >> (-exponent - 1)) + 1) >> 1;
  return value >> 63 ? -(int64_t)fraction : (int64_t)fraction;
}

/* Whether the last transition ended in the state of an observation. */
static inline uint32_t sdnn_is_next(const sdnn_agent* agent, const int32_t* observation) {
#ifdef SDNN_HOLDS
  return sdnn_is_same_state(agent->next_observation, observation);
#else
  uint32_t i, is_next = 1;
#ifdef SDNN_CODES
  uint32_t bins[SDNN_N_INPUTS];
  sdnn_bins_of_fixed(observation, bins);
  for (i = 0; i < SDNN_N_INPUTS; ++i) is_next &= agent->next_bins[i] == bins[i];
#else
  for (i = 0; i < SDNN_N_OBSERVED; ++i) is_next &= agent->next_observation[i] == observation[i];
#endif
  return is_next;
#endif
}

/* Learns a transition. Its reward is a number times 2^SDNN_FRACTION_BITS; `terminated` means that
 * the episode ended in a terminal state, not by a time limit. If the next transition does not begin
 * with the same readings, this one was the last of its episode. */
static inline void sdnn_learn(sdnn_agent* agent, const int32_t* observation, uint32_t action,
                              int32_t reward, const int32_t* next_observation, int terminated) {
  uint32_t bins[SDNN_N_INPUTS], next_bins[SDNN_N_INPUTS];
  sdnn_transition* newest;
  sdnn_real next_value;
#ifdef SDNN_HOLDS
  int32_t first[SDNN_N_OBSERVED];
  sdnn_copy_32(first, sdnn_note_readings(&agent->readings, observation), SDNN_N_OBSERVED);
  observation = first;
  next_observation = sdnn_note_readings(&agent->readings, next_observation);
#endif
  if (SDNN_IS_REFUSED(int32_t, observation) || SDNN_IS_REFUSED(int32_t, next_observation)) return;
  if (!sdnn_accepts(&agent->scale, reward)) return;
#if SDNN_ADAPTS
  if (sdnn_note_reward(agent, reward, terminated)) {
    sdnn_set_range(agent, agent->low, agent->high);
  }
#endif
  sdnn_bins_of_fixed(next_observation, next_bins);
  next_value = terminated ? 0 : sdnn_state_value(agent, next_bins);
  if (agent->n_pending > 0 && !sdnn_is_next(agent, observation)) {
    sdnn_learn_all(agent, sdnn_state_value(agent, agent->next_bins));
  }
  sdnn_bins_of_fixed(observation, bins);
  newest = sdnn_pending(agent, agent->n_pending);
  newest->state = (uint32_t)(sdnn_state_of(agent, bins) - agent->states);
  newest->action = action < SDNN_N_ACTIONS ? action : SDNN_N_ACTIONS - 1;
  newest->reward = reward;
  ++agent->n_pending;
  sdnn_copy_32((int32_t*)agent->next_bins, (const int32_t*)next_bins, SDNN_N_INPUTS);
  sdnn_copy_32(agent->next_observation, next_observation, SDNN_N_OBSERVED);
  if (terminated) {
    sdnn_learn_all(agent, 0);
  } else if (agent->n_pending == SDNN_N_STEPS) {
    sdnn_learn_oldest(agent, next_value);
  }
  sdnn_end_window(&agent->scale);
}

#include "sdnn_c_image.h"

#endif /* SDNN_C_H */
