/* The image of an SDNN-C agent, and its kept policy. */
#ifndef SDNN_C_IMAGE_H
#define SDNN_C_IMAGE_H

/* Where the parts of an image begin: the head, rewards, returns, thresholds and weights. The head
 * has magic number and fingerprint, and from these bytes on: 8 fraction bits, 12 n_random_left, 16
 * random generators, 176 scale of rewards, 196 progress, 204 q_low, 212 q_high; with an adaptive
 * range also 220 low, 228 high, 236 sum, 244 n_returns, 252 due, 260 n_rewards, 264 n_kept_returns,
 * 268 oldest. */
#if SDNN_ADAPTS
#define SDNN_IMAGE_HEAD 272
#define SDNN_RETURNS_AT (SDNN_IMAGE_HEAD + UINT32_C(8) * SDNN_HORIZON)
#define SDNN_THRESHOLDS_AT (SDNN_RETURNS_AT + 8 * 256)
#else
#define SDNN_IMAGE_HEAD 220
#define SDNN_THRESHOLDS_AT UINT32_C(220)
#endif
#define SDNN_WEIGHTS_AT (SDNN_THRESHOLDS_AT + UINT32_C(4) * SDNN_N_UNITS)
#define SDNN_IMAGE_BYTES (SDNN_WEIGHTS_AT + 4 * SDNN_N_WORDS + 4)

/* Reads or writes the head of an image: all numbers except rewards, returns, thresholds and
 * weights. */
static inline void sdnn_carry_head(sdnn_agent* agent, uint8_t* head, int reads) {
  uint8_t* at = sdnn_carry_32(head + 12, &agent->n_random_left, 1, reads);
  if (!reads) sdnn_put(head + 8, SDNN_FRACTION_BITS, 4);
  at = sdnn_carry_64(at, agent->randoms, 4 * SDNN_N_RANDOMS, reads);
  at = sdnn_carry_scale(at, &agent->scale, reads);
  at = sdnn_carry_64(at, &agent->progress, 1, reads);
  at = sdnn_carry_64(at, &agent->q_low, 1, reads);
  at = sdnn_carry_64(at, &agent->q_high, 1, reads);
#if SDNN_ADAPTS
  at = sdnn_carry_64(at, &agent->low, 1, reads);
  at = sdnn_carry_64(at, &agent->high, 1, reads);
  at = sdnn_carry_64(at, &agent->sum, 1, reads);
  at = sdnn_carry_64(at, &agent->n_returns, 1, reads);
  at = sdnn_carry_64(at, &agent->due, 1, reads);
  at = sdnn_carry_32(at, &agent->n_rewards, 1, reads);
  at = sdnn_carry_32(at, &agent->n_kept_returns, 1, reads);
  at = sdnn_carry_32(at, &agent->oldest, 1, reads);
#endif
  (void)at;
}

/* Makes an agent with the head of an image, and nothing learned. */
static inline void sdnn_begin_as(sdnn_agent* agent, const uint8_t* head) {
  sdnn_clear(agent, sizeof *agent);
  sdnn_carry_head(agent, (uint8_t*)head, 1);
  sdnn_follow_progress(agent, agent->progress);
  sdnn_set_range(agent, agent->q_low, agent->q_high);
#ifdef SDNN_HOLDS
  sdnn_forget_readings(&agent->readings);
#endif
}

/* Makes the agent as it was exported. */
static inline void sdnn_begin(sdnn_agent* agent) {
  sdnn_begin_as(agent, sdnn_first_head);
#if SDNN_ADAPTS
  sdnn_copy_32(agent->rewards, sdnn_first_rewards, agent->n_rewards);
  sdnn_copy_returns(agent->returns, sdnn_first_returns, agent->n_kept_returns);
#endif
#if SDNN_IS_NEW
  sdnn_draw_weights(agent);
#else
  sdnn_copy_32((int32_t*)agent->weights, (const int32_t*)sdnn_first_weights, SDNN_N_WORDS);
  sdnn_copy_32(agent->thresholds, sdnn_first_thresholds, SDNN_N_UNITS);
#endif
}

#if SDNN_ADAPTS
/* Moves those rewards and returns that are in a part of an image. Rewards behind the last one are 0
 * there. */
static inline void sdnn_carry_range(sdnn_agent* agent, const sdnn_part* part, int reads) {
  const uint32_t n_rewards = reads ? 2 * SDNN_HORIZON : agent->n_rewards;
  uint32_t i;
  for (i = 0; i < part->n; ++i) {
    const uint32_t at = part->offset + i, k = at - SDNN_RETURNS_AT, shift = 8 * (k & 7);
    if (!reads && at >= SDNN_IMAGE_HEAD && at < SDNN_RETURNS_AT) part->bytes[i] = 0;
    if (k >= 8 * 256) continue;
    if (reads) {
      const sdnn_real others = agent->returns[k >> 3] & ~(UINT64_C(255) << shift);
      agent->returns[k >> 3] = others | (sdnn_real)part->bytes[i] << shift;
    } else {
      part->bytes[i] = (uint8_t)(agent->returns[k >> 3] >> shift & 255);
    }
  }
  sdnn_carry_words(part, agent->rewards, SDNN_IMAGE_HEAD, n_rewards, reads);
}
#endif

/* Reads the numbers of arrays in a part of an image, or writes them to it. */
static inline void sdnn_carry_arrays(sdnn_agent* agent, const sdnn_part* part, int reads) {
#if SDNN_ADAPTS
  sdnn_carry_range(agent, part, reads);
#endif
  sdnn_carry_words(part, agent->thresholds, SDNN_THRESHOLDS_AT, SDNN_N_UNITS, reads);
  sdnn_carry_words(part, agent->weights, SDNN_WEIGHTS_AT, SDNN_N_WORDS, reads);
}

/* Whether bits that were read are a number, and at most 2^100 in size. */
static inline int sdnn_is_real(sdnn_real x) { return x << 1 >> 1 <= UINT64_C(1123) << 52; }

#if SDNN_ADAPTS
/* Whether a head has a possible range, and possible numbers of rewards and returns, at the offsets
 * where sdnn_carry_head puts them. */
static inline int sdnn_is_range(const uint8_t* head) {
  const uint64_t n_returns = sdnn_get(head + 244, 8), due = sdnn_get(head + 252, 8);
  const uint32_t n_kept = (uint32_t)sdnn_get(head + 264, 4);
  const uint32_t oldest = (uint32_t)sdnn_get(head + 268, 4);
  uint32_t i;
  for (i = 220; i < 244; i += 8) {
    if (!sdnn_is_real(sdnn_get(head + i, 8))) return 0;
  }
  return !sdnn_less(0, sdnn_get(head + 220, 8)) && !sdnn_less(sdnn_get(head + 228, 8), 0) &&
         n_returns >> 62 == 0 && due <= n_returns + (n_returns < 512 ? 1 : n_returns >> 9) &&
         sdnn_get(head + 260, 4) < 2 * SDNN_HORIZON && n_kept <= 256 && oldest <= 255 &&
         (n_kept == 256 || oldest == 0) && (n_returns < 32 || n_kept >= 32);
}
#endif

/* Whether a head, which may be damaged, has possible numbers at the offsets of sdnn_carry_head. */
static inline int sdnn_is_head(const uint8_t* head) {
  const sdnn_real q_low = sdnn_get(head + 204, 8), q_high = sdnn_get(head + 212, 8);
#if SDNN_ADAPTS
  if (!sdnn_is_range(head)) return 0;
#endif
  return sdnn_are_generators(head + 16) && sdnn_get(head + 8, 4) == SDNN_FRACTION_BITS &&
         sdnn_get(head + 12, 4) < UINT64_C(1) + SDNN_START_STEPS &&
         sdnn_get(head + 196, 8) <= SDNN_ONE && sdnn_is_real(q_low) && sdnn_is_real(q_high) &&
         sdnn_less(q_low, q_high) && sdnn_is_scale(head + 176);
}

/* Whether the returns, thresholds and weights in a part of an image are in range. */
static inline int sdnn_is_possible(const sdnn_part* part) {
  uint32_t i, j;
  for (i = 0; i < part->n; i += 4) {
    const uint32_t at = part->offset + i;
    const uint8_t* const bytes = part->bytes + i;
    const int32_t number = sdnn_get_32(bytes);
    if (at >= SDNN_IMAGE_BYTES - 4) break;
    if (at >= SDNN_WEIGHTS_AT) {
      for (j = 0; j < 4; ++j) {
        if (bytes[j] == 0) return 0;
      }
    } else if (at >= SDNN_THRESHOLDS_AT) {
      if (number <= -1073741824 || number >= 1073741824) return 0;
#if SDNN_ADAPTS
    } else if (at >= SDNN_RETURNS_AT && (at & 7) == 0) {
      if (!sdnn_is_real(sdnn_get(bytes, 8))) return 0;
#endif
    }
  }
  return 1;
}

#include "sdnn_keeper.h"

/* Writes the weights and thresholds that are in a part of a keeper's memory. */
static inline void sdnn_carry_kept(sdnn_agent* agent, const sdnn_part* part) {
  sdnn_carry_words(part, agent->weights, 0, SDNN_N_WORDS, 0);
  sdnn_carry_words(part, agent->thresholds, 4 * SDNN_N_WORDS, SDNN_N_UNITS, 0);
}

/* The ranks of counts below and above the line, from those at its ends. */
static inline int32_t sdnn_scale_of_policy(const sdnn_agent* agent) {
  const uint32_t below = agent->below - UINT32_C(2) * SDNN_U_LOW;
  return (int32_t)(below << 2 | (agent->above - UINT32_C(2) * SDNN_U_HIGH));
}

/* Computes the potentials of four units by the kept weights. Returns whether it could read them. */
static inline int sdnn_evaluate_kept(const sdnn_keeper* keeper, sdnn_state* state, uint32_t unit) {
  const sdnn_code* const code = &state->code;
  const uint32_t n = code->n_positive + code->n_negative;
  uint32_t j, i;
  uint8_t bytes[16];
  if (!keeper->read(keeper->context, 4 * (SDNN_N_WORDS + unit), bytes, 16)) return 0;
  for (i = 0; i < 4; ++i) state->potentials[unit + i] = -sdnn_get_32(bytes + 4 * i);
  for (j = 0; j < n; ++j) {
    const int is_positive = j < code->n_positive;
    const uint32_t at = is_positive ? j : SDNN_MOST_COLUMNS - (n - j);
    const uint32_t word = (unit >> 2) * SDNN_N_COLUMNS + code->columns[at];
    if (!keeper->read(keeper->context, 4 * word, bytes, 4)) return 0;
    for (i = 0; i < 4; ++i) {
      const int32_t weight = bytes[i] - 128;
      state->potentials[unit + i] += is_positive ? weight : -weight;
    }
  }
  return 1;
}

/* A greedy action of the kept policy, or of the present one where none is kept. */
static inline uint32_t sdnn_best(const sdnn_agent* agent, const sdnn_keeper* keeper,
                                 SDNN_EPISODE_PARAMETER const int32_t* observation) {
  const uint32_t below = UINT32_C(2) * SDNN_U_LOW + ((uint32_t)keeper->scale >> 2);
  const uint32_t above = UINT32_C(2) * SDNN_U_HIGH + ((uint32_t)keeper->scale & 3);
  uint32_t bins[SDNN_N_INPUTS], ranks[SDNN_N_ACTIONS], unit;
  sdnn_state state;
  if (SDNN_IS_REFUSED(int32_t, observation)) return SDNN_REFUSED;
  if (!keeper->is_kept) return sdnn_greedy(agent, SDNN_EPISODE observation);
#ifdef SDNN_HOLDS
  observation = sdnn_readings_of(&agent->readings, episode, observation);
#endif
  sdnn_bins_of_fixed(observation, bins);
  sdnn_encode(&sdnn_the_coding, bins, &state.code);
  for (unit = 0; unit < SDNN_N_UNITS; unit += 4) {
    if (!sdnn_evaluate_kept(keeper, &state, unit))
      return sdnn_greedy(agent, SDNN_EPISODE observation);
  }
  sdnn_rank(&state, below, above, ranks);
  return sdnn_tied(ranks, SDNN_N_ACTIONS, sdnn_highest(ranks));
}

#define SDNN_HAS_PROGRESS
#include "sdnn_learner_class.h"

#endif /* SDNN_C_IMAGE_H */
