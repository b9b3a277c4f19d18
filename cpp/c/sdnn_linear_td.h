/* True-online TD(lambda) with a linear readout, whose unit follows the rewards: see
 * cpp/include/sdnn/agents/detail/linear_td.hpp.
 *
 * The file that includes this one defines before: sdnn_agent, the constants SDNN_N_WEIGHTS of the
 * readout and SDNN_N_AVERAGED of its average, which lies after it, and
 *
 *   sdnn_n_active_weights(code)      the number of weights that have a part in a value
 *   sdnn_sum(rows, code, action)     a value in units, or the same sum of traces
 *   sdnn_best_sum(agent, code)       the value of the best action
 *   sdnn_encode_state(bins, code)    the code of a state
 *
 * and after it sdnn_move_rows, which calls sdnn_move_row for each row and returns all bits. */
#ifndef SDNN_LINEAR_TD_H
#define SDNN_LINEAR_TD_H

#include "sdnn_readout.h"

#define SDNN_LARGEST_WEIGHT INT64_C(8388608)    /* 2^23 */
#define SDNN_LARGEST_VALUE INT64_C(8589934592)  /* 2^33 */
#define SDNN_LARGEST_ERROR INT64_C(17179869183) /* 2^34 - 1 */
#define SDNN_LARGEST_TRACE 131071
#define SDNN_TRACE_ONE 4096

/* The absolute value. */
static inline int64_t sdnn_size(int64_t x) { return x < 0 ? -x : x; }
static inline int64_t sdnn_clipped(int64_t x, int64_t most) {
  return x > most ? most : x < -most ? -most : x;
}

/* A rate, times 2^16, that moves from `first` to `last`: after n learned steps of
 * SDNN_SCHEDULE_STEPS, S, it is first + (last - first) n / (n + S), rounded to the nearest. */
static inline uint32_t sdnn_scheduled(const sdnn_agent* agent, int32_t first, int32_t last) {
  const int64_t all = (int64_t)last - first;
  const uint64_t twice = 2 * ((uint64_t)agent->n_learned + SDNN_SCHEDULE_STEPS);
  const int64_t product = 2 * all * agent->n_learned + (int64_t)(twice / 2);
  uint64_t rest;
  if (first == last) return (uint32_t)first;
  if (product >= 0) {
    return (uint32_t)(first + (int64_t)sdnn_quotient((uint64_t)product, twice, &rest));
  }
  return (uint32_t)(first - 1 - (int64_t)sdnn_quotient((uint64_t)-product - 1, twice, &rest));
}

/* Makes the unit of values twice as large; numbers in it become half as large, halves rounded up.
 */
static inline void sdnn_double_unit(sdnn_agent* agent) {
  uint32_t j;
  ++agent->exponent;
  agent->old_value = (agent->old_value + 1) >> 1;
  for (j = 0; j < SDNN_N_WEIGHTS + SDNN_N_AVERAGED; ++j) {
    agent->weights[j] = (agent->weights[j] + 1) >> 1;
  }
}

/* The floor of the logarithm to base 2 of a number above 0. */
static inline int32_t sdnn_log2(uint32_t x) {
  int32_t log = -1;
  for (; x > 0; x >>= 1) ++log;
  return log;
}

/* Makes units smaller if they are larger than necessary for rewards of 2^size, the size of the last
 * window: see refine_unit in cpp/include/sdnn/agents/q_lambda.hpp. */
static inline void sdnn_refine_unit(sdnn_agent* agent, int32_t size) {
  const sdnn_code* const code = &agent->codes[agent->pending];
  const uint32_t n = sdnn_n_active_weights(code);
  int32_t least_bits = 23 + sdnn_log2(n > 0 ? n : 1), spare_bits = 23;
  int32_t n_halvings = 0, n_free = 30 - (size - agent->exponent);
  uint32_t used = 0, j;
  if (!agent->has_exponent) return;
  least_bits = (least_bits < 33 ? least_bits : 33) - SDNN_HORIZON_BITS - 10;
  for (j = 0; j < SDNN_N_WEIGHTS + SDNN_N_AVERAGED; ++j) {
    used |= (uint32_t)(agent->weights[j] ^ -(agent->weights[j] < 0));
  }
  spare_bits -= sdnn_log2(used) + 1;
  if (n_free > spare_bits) n_free = spare_bits;
  if (n_free - 8 > n_halvings) n_halvings = n_free - 8;
  if (least_bits - (agent->scale.size - agent->exponent) > n_halvings) {
    n_halvings = least_bits - (agent->scale.size - agent->exponent);
  }
  agent->exponent -= n_halvings;
  for (; n_halvings > 0; --n_halvings) {
    agent->old_value = sdnn_clipped(2 * agent->old_value, SDNN_LARGEST_VALUE - 1);
    for (j = 0; j < SDNN_N_WEIGHTS + SDNN_N_AVERAGED; ++j) {
      agent->weights[j] = (int32_t)sdnn_clipped(2 * agent->weights[j], SDNN_LARGEST_WEIGHT - 1);
    }
  }
}

/* Makes units large enough for a reward. The first reward that is not 0 gets 31 bits. */
static inline void sdnn_fit_unit(sdnn_agent* agent, int32_t reward) {
  const uint64_t size = (uint64_t)sdnn_size(reward);
  if (reward == 0) return;
  if (!agent->has_exponent) {
    agent->has_exponent = 1;
    agent->exponent = -30 - SDNN_FRACTION_BITS;
    while (size >> (agent->exponent + 31 + SDNN_FRACTION_BITS)) ++agent->exponent;
  }
  for (;;) {
    const int32_t shift = -SDNN_FRACTION_BITS - agent->exponent;
    if (shift < 32 && (shift <= 0 || (size << shift) >> 32 == 0)) return;
    sdnn_double_unit(agent);
  }
}

/* A reward in the unit of values, 2^exponent; 0 until a reward has determined the exponent. */
static inline int64_t sdnn_units_of(const sdnn_agent* agent, int32_t reward) {
  const int32_t shift = -SDNN_FRACTION_BITS - agent->exponent;
  if (!agent->has_exponent || reward == 0 || shift < -62) return 0;
  if (shift >= 0) return reward * (INT64_C(1) << shift);
  return sdnn_scaled(reward, 1, (uint32_t)-shift);
}

/* Returns the value of `action`, or of the best action where it is null, and makes units large
 * enough for it. `other` is null or a number in units. */
static inline int64_t sdnn_value(sdnn_agent* agent, const sdnn_code* code, const uint32_t* action,
                                 int64_t* other) {
  for (;;) {
    const int64_t value =
        action ? sdnn_sum(agent->weights, code, action) : sdnn_best_sum(agent, code);
    if (sdnn_size(value) < SDNN_LARGEST_VALUE) return value;
    sdnn_double_unit(agent);
    if (other) *other = (*other + 1) >> 1;
  }
}

/* The code of a state other than the pending one. */
static inline sdnn_code* sdnn_other(sdnn_agent* agent, const uint32_t* bins) {
  sdnn_code* const code = &agent->codes[1 - agent->pending];
  uint32_t i, is_same = code->n_positive + code->n_negative > 0;
  for (i = 0; i < SDNN_N_INPUTS; ++i) is_same &= code->bins[i] == bins[i];
  if (!is_same) sdnn_encode_state(bins, code);
  return code;
}

/* Adds columns of a code to the traces of a row, or replaces them, and corrects the weights. */
static inline void sdnn_add_to_trace(int32_t* weights, int32_t* traces, const sdnn_column* column,
                                     uint32_t n, int32_t gain, int32_t correction) {
  for (; n > 0; --n, ++column) {
    int32_t trace = SDNN_IS_DUTCH ? traces[*column] + gain : gain;
    if (trace > SDNN_LARGEST_TRACE) trace = SDNN_LARGEST_TRACE;
    if (trace < -SDNN_LARGEST_TRACE) trace = -SDNN_LARGEST_TRACE;
    traces[*column] = trace;
    weights[*column] -= correction;
  }
}

/* Decays the trace of a row, adds the code to it unless `code` is null, and moves the weights along
 * it. Returns the bits that any weight uses: x for x from 0 on, and -x - 1 for x below 0, all ORed.
 */
static inline uint32_t sdnn_move_row(sdnn_agent* agent, uint32_t row, const sdnn_code* code,
                                     int32_t gain, int32_t step, uint32_t shift,
                                     int32_t correction) {
  int32_t* const weights = &agent->weights[row * SDNN_N_COLUMNS];
  int32_t* const traces = &agent->traces[row * SDNN_N_COLUMNS];
  const int32_t half = (int32_t)(UINT32_C(1) << (shift - 1));
  int32_t used = 0, live = 0;
  uint32_t j;
  for (j = 0; j < SDNN_N_COLUMNS; ++j) {
    const int32_t product = traces[j] * SDNN_TRACE_DECAY;
    /* product / 8192, rounded towards 0: to a number below 0 the shift needs 8191 added. */
    traces[j] = (product + (int32_t)((uint32_t)-(product < 0) >> 19)) >> 13;
  }
  if (code) {
    const uint32_t n = code->n_negative;
    sdnn_add_to_trace(weights, traces, code->columns, code->n_positive, gain, correction);
    sdnn_add_to_trace(weights, traces, code->columns + SDNN_MOST_COLUMNS - n, n, -gain,
                      -correction);
  }
  for (j = 0; j < SDNN_N_COLUMNS; ++j) {
    const int32_t trace = traces[j], weight = weights[j] + ((step * trace + half) >> shift);
    weights[j] = weight;
    used |= weight ^ -(weight < 0);
    live |= trace;
  }
  agent->is_live[row] = live != 0;
  return (uint32_t)used;
}

static inline uint32_t sdnn_move_rows(sdnn_agent* agent, const sdnn_code* code,
                                      const uint32_t* action, int32_t gain, int32_t step,
                                      uint32_t shift, int32_t correction);

/* Moves the weights by rate / n times the error along the trace, minus rate / n times the drift
 * along the code, where n is the number of weights that have a part in Q(s, a). */
static inline void sdnn_move(sdnn_agent* agent, const sdnn_code* code, const uint32_t* action,
                             int64_t error, int64_t drift) {
  const uint32_t n = sdnn_n_active_weights(code);
  uint64_t rest;
  const int64_t rate = (int64_t)sdnn_quotient((uint64_t)agent->rate << 12, n > 0 ? n : 1, &rest);
  int64_t along_trace;
  int32_t gain = SDNN_TRACE_ONE;
  uint32_t n_bits = 0, used, j;
  if (SDNN_IS_DUTCH) {
    const int64_t before = sdnn_scaled(sdnn_sum(agent->traces, code, action), rate, 28);
    gain -= (int32_t)sdnn_clipped(sdnn_scaled(before, SDNN_TRACE_DECAY, 13), SDNN_LARGEST_TRACE);
  }
  error = sdnn_clipped(error, SDNN_LARGEST_ERROR);
  drift = sdnn_clipped(drift, SDNN_LARGEST_ERROR);
  while (sdnn_size(sdnn_scaled(error, rate, 28)) >= SDNN_LARGEST_WEIGHT ||
         sdnn_size(sdnn_scaled(drift, rate, 28)) >= SDNN_LARGEST_WEIGHT) {
    sdnn_double_unit(agent);
    error = (error + 1) >> 1;
    drift = (drift + 1) >> 1;
  }
  along_trace = sdnn_scaled(error, rate, 28);
  while (sdnn_size(along_trace) >> n_bits >= 8191) ++n_bits;
  used = sdnn_move_rows(agent, code, action, gain, (int32_t)sdnn_scaled(along_trace, 1, n_bits),
                        12 - n_bits, (int32_t)sdnn_scaled(drift, rate, 28));
  while (used >= SDNN_LARGEST_WEIGHT) {
    sdnn_double_unit(agent);
    used >>= 1;
    for (j = 0; j < SDNN_N_WEIGHTS; ++j) { /* halves are rounded up */
      if (agent->weights[j] == SDNN_LARGEST_WEIGHT) used |= (uint32_t)SDNN_LARGEST_WEIGHT;
    }
  }
#ifdef SDNN_DURATIONS_H
  sdnn_set_durations(&agent->durations, agent->durations.pending.decay);
#endif
}

/* Computes the error r + gamma Q' - Q of a transition from the state of a code, and the drift
 * Q - Q_old of its value. Stores `next`, the value Q' of the next state, as the next Q_old. */
static inline int64_t sdnn_error(sdnn_agent* agent, const sdnn_code* code, const uint32_t* action,
                                 int32_t reward, int64_t next, int64_t* drift) {
  const int64_t value = sdnn_value(agent, code, action, &next);
  const int64_t target = sdnn_units_of(agent, reward) + sdnn_scaled(next, SDNN_DISCOUNT, 15);
  *drift = SDNN_IS_DUTCH ? value - agent->old_value : 0;
  agent->old_value = next;
  return target - value;
}

/* An action, of which numbers beyond the last count as the last. */
static inline void sdnn_limit_action(const uint32_t* action, uint32_t* limited) {
  uint32_t d;
  for (d = 0; d < SDNN_N_DIMENSIONS; ++d) {
    const uint32_t last = sdnn_n_actions[d] - 1;
    limited[d] = action[d] < last ? action[d] : last;
  }
}

/* Begins new traces. */
static inline void sdnn_end_traces(sdnn_agent* agent) {
  uint32_t row;
  for (row = 0; row < SDNN_N_ROWS; ++row) {
    if (agent->is_live[row]) {
      sdnn_clear(&agent->traces[row * SDNN_N_COLUMNS], UINT32_C(4) * SDNN_N_COLUMNS);
    }
    agent->is_live[row] = 0;
  }
#ifdef SDNN_DURATIONS_H
  sdnn_set_durations(&agent->durations, 0);
#endif
  agent->old_value = 0;
}

#endif /* SDNN_LINEAR_TD_H */
