/* The range of values, estimated from recent returns. The class ReturnRange of
 * cpp/include/sdnn/agents/return_range.hpp says why, and has the same numbers. */
#ifndef SDNN_RETURN_RANGE_H
#define SDNN_RETURN_RANGE_H

#include "sdnn_real.h"

#define SDNN_MOST UINT64_C(0x7e37e43c8800759c) /* 1e300 */

static inline sdnn_real sdnn_clipped(sdnn_real x) {
  return sdnn_between(x, SDNN_MOST | SDNN_MINUS, SDNN_MOST);
}

/* A quarter of a - b. */
static inline sdnn_real sdnn_quarter(sdnn_real a, sdnn_real b) {
  return sdnn_times(UINT64_C(1021) << 52, sdnn_minus(a, b));
}

/* Copies n numbers, as sdnn_copy_32 does. */
static inline void sdnn_copy_returns(sdnn_real* to, const sdnn_real* from, uint32_t n) {
  volatile sdnn_real* target = to;
  for (; n > 0; --n) *target++ = *from++;
}

/* Extends the range to a sum outside of it, and by a quarter of its new width more. Returns whether
 * it did. */
static inline int sdnn_extend_range(sdnn_agent* agent, sdnn_real sum) {
  if (sdnn_less(agent->high, sum)) {
    agent->high = sdnn_plus(sum, sdnn_quarter(sum, agent->low));
  } else if (sdnn_less(sum, agent->low)) {
    agent->low = sdnn_minus(sum, sdnn_quarter(agent->high, sum));
  } else {
    return 0;
  }
  return 1;
}

/* Computes the returns of the first `n_known` rewards, backwards from the last reward, and
 * remembers those that are due. Unless `are_all`, because the episode has terminated, the rest that
 * is missing of a return is assumed to be like its known part. */
static inline void sdnn_note_returns(sdnn_agent* agent, uint32_t n_known, int are_all) {
  const sdnn_real width = agent->n_returns < 32 ? SDNN_MOST : sdnn_minus(agent->high, agent->low);
  const sdnn_real low = sdnn_clipped(sdnn_minus(agent->low, width));
  const sdnn_real high = sdnn_clipped(sdnn_plus(agent->high, width));
  sdnn_real sum = 0, missing = SDNN_ONE;
  uint32_t i = agent->n_rewards;
  while (i-- > 0) {
    const sdnn_real reward = sdnn_real_of(agent->rewards[i], -SDNN_FRACTION_BITS);
    sdnn_real value;
    sum = sdnn_between(sdnn_plus(reward, sdnn_times(SDNN_DISCOUNT, sum)), low, high);
    missing = sdnn_times(missing, SDNN_DISCOUNT);
    if (i >= n_known || ++agent->n_returns < agent->due) continue;
    agent->due = agent->n_returns + (agent->n_returns < 1024 ? 1 : agent->n_returns >> 9);
    value = are_all || missing == SDNN_ONE ? sum : sdnn_over(sum, sdnn_minus(SDNN_ONE, missing));
    if (agent->n_kept_returns < 256) {
      agent->returns[agent->n_kept_returns++] = sdnn_clipped(value);
    } else {
      agent->returns[agent->oldest] = sdnn_clipped(value);
      agent->oldest = (agent->oldest + 1) & 255;
    }
  }
}

/* The return that n remembered ones are below or, if `sign` is SDNN_MINUS, above. */
static inline sdnn_real sdnn_return_above(const sdnn_agent* agent, uint32_t n, uint64_t sign) {
  sdnn_real least[14]; /* n is at most 256 / 20 */
  uint32_t i, j;
  for (j = 0; j <= n; ++j) least[j] = SDNN_MOST;
  for (i = 0; i < agent->n_kept_returns; ++i) {
    const sdnn_real number = agent->returns[i] ^ sign;
    if (!sdnn_less(number, least[n])) continue;
    for (j = n; j > 0 && sdnn_less(number, least[j - 1]); --j) least[j] = least[j - 1];
    least[j] = number;
  }
  return least[n] ^ sign;
}

/* Moves the range if it no longer contains the returns, or is much too wide; returns whether it
 * has moved. The lowest twentieth and the highest fiftieth of the returns are left out. */
static inline int sdnn_follow(sdnn_agent* agent) {
  const uint32_t n = agent->n_kept_returns;
  sdnn_real low, high, most;
  uint32_t n_below = 0, n_above = 0;
  if (agent->n_returns < 32) return 0;
  while (20 * (n_below + 1) <= n) ++n_below;
  while (50 * (n_above + 1) <= n) ++n_above;
  low = sdnn_return_above(agent, n_below, 0);
  high = sdnn_return_above(agent, n_above, SDNN_MINUS);
  if (sdnn_less(0, low)) low = 0;
  if (sdnn_less(high, 0)) high = 0;
  if (!sdnn_less(low, high)) return 0;
  most = sdnn_less(0, high) ? sdnn_plus(high, sdnn_quarter(high, low)) : 0;
  if (!sdnn_less(low, agent->low) && !sdnn_less(agent->high, high) &&
      !sdnn_less(sdnn_times(UINT64_C(1024) << 52, sdnn_minus(most, low)),
                 sdnn_minus(agent->high, agent->low))) {
    return 0;
  }
  agent->low = low;
  agent->high = most;
  return 1;
}

/* Notes a reward; returns whether the range has moved. */
static inline int sdnn_note_reward(sdnn_agent* agent, int32_t reward, int terminated) {
  int grows;
  uint32_t n_known;
  agent->sum = sdnn_clipped(
      sdnn_plus(sdnn_real_of(reward, -SDNN_FRACTION_BITS), sdnn_times(SDNN_DISCOUNT, agent->sum)));
  grows = (agent->n_returns < 32 || !sdnn_less(agent->low, agent->high)) &&
          sdnn_extend_range(agent, agent->sum);
  if (terminated) agent->sum = 0;
  agent->rewards[agent->n_rewards++] = reward;
  if (!terminated && agent->n_rewards < 2 * SDNN_HORIZON) return grows;
  n_known = terminated ? agent->n_rewards : agent->n_rewards - SDNN_HORIZON;
  sdnn_note_returns(agent, n_known, terminated);
  agent->n_rewards -= n_known;
  sdnn_copy_32(agent->rewards, agent->rewards + n_known, agent->n_rewards);
  return sdnn_follow(agent) || grows;
}

#endif /* SDNN_RETURN_RANGE_H */
