/* The states of a learning agent, where they include earlier observations. The episode from which
 * it learns and greedy episodes have separate memories; the caller provides the latter. See
 * cpp/include/sdnn/agents/detail/last_states.hpp. */
#ifndef SDNN_HISTORY_LEARNER_H
#define SDNN_HISTORY_LEARNER_H

#include "sdnn_history.h"

#define SDNN_REMEMBERS 1

/* A state of an episode, and what it depends on. */
typedef struct {
  sdnn_episode episode;
  sdnn_real state[SDNN_N_INPUTS];
  int32_t observation[SDNN_N_OBSERVED];
  uint8_t has_acted; /* whether the next observation belongs to the next step */
} sdnn_last_state;

typedef struct {
  sdnn_last_state learned;
  sdnn_real next[SDNN_N_INPUTS]; /* where the last transition ended */
#ifndef SDNN_IS_ACTOR_CRITIC
  uint32_t next_bins[SDNN_N_INPUTS];
#endif
  uint32_t n_reads; /* observations that were read since the agent began, modulo 2^32 */
} sdnn_states;

/* The memory of greedy steps. Unless they begin an episode, they continue that of which the agent
 * learns. */
typedef struct {
  sdnn_last_state last;
  uint32_t n_reads; /* of the agent, when it had this memory */
} sdnn_greedy_episode;

#define SDNN_EPISODE_PARAMETER sdnn_greedy_episode *episode,
#define SDNN_EPISODE episode,

/* An observation, of which the last readings replace those that are missing. */
static inline const int32_t* sdnn_filled(sdnn_last_state* last, const int32_t* observation) {
#ifdef SDNN_HOLDS
  sdnn_hold_readings(last->episode.held, observation);
  return last->episode.held;
#else
  (void)last;
  return observation;
#endif
}

/* Continues an episode, or begins it, with an observation. */
static inline void sdnn_advance(sdnn_last_state* last, const int32_t* observation) {
  sdnn_real inputs[SDNN_N_OBSERVED_INPUTS];
  sdnn_inputs_of_fixed(observation, inputs);
  sdnn_continue(&last->episode, inputs, last->state);
  sdnn_copy_32(last->observation, observation, SDNN_N_OBSERVED);
  last->has_acted = 0;
}

/* Whether it is the state of an observation. */
static inline uint32_t sdnn_is_state_of(const sdnn_last_state* last, const int32_t* observation) {
  uint32_t i, is_same = last->episode.has_begun;
  for (i = 0; i < SDNN_N_OBSERVED; ++i) is_same &= last->observation[i] == observation[i];
  return is_same;
}

/* Makes it the state of an observation, unless it is that already. */
static inline void sdnn_restart(sdnn_last_state* last, const int32_t* observation) {
  if (sdnn_is_state_of(last, observation)) return;
  last->episode.has_begun = 0;
  sdnn_advance(last, observation);
}

/* Makes `last` the state of an observation in which the agent acts. After an action this is the
 * next step. Otherwise an equal observation is the same state, and any other begins an episode. */
static inline void sdnn_find_state(sdnn_last_state* last, const int32_t* observation) {
  observation = sdnn_filled(last, observation);
  if (last->has_acted) {
    sdnn_advance(last, observation);
  } else {
    sdnn_restart(last, observation);
  }
}

/* Copies bytes. The compiler makes no call of memcpy of a volatile store. */
static inline void sdnn_copy_bytes(void* to, const void* from, uint32_t n) {
  volatile uint8_t* target = (volatile uint8_t*)to;
  const uint8_t* source = (const uint8_t*)from;
  for (; n > 0; --n) *target++ = *source++;
}

/* Forgets a state and its history, before an episode begins. */
static inline void sdnn_forget_state(sdnn_last_state* last) {
#ifdef SDNN_HOLDS
  sdnn_forget_held(last->episode.held);
#endif
  last->episode.has_begun = 0;
  last->has_acted = 0;
}

static inline void sdnn_forget(sdnn_states* states) {
  sdnn_forget_state(&states->learned);
  ++states->n_reads;
}

/* The bins of the state in which the agent acts. */
static inline void sdnn_read_to_act(sdnn_states* states, const int32_t* observation,
                                    uint32_t* bins) {
  ++states->n_reads;
  sdnn_find_state(&states->learned, observation);
  sdnn_bins_of_state(states->learned.state, bins);
}

/* Begins a greedy episode, apart from the one of which the agent learns. */
static inline void sdnn_begin_greedy(const sdnn_states* states, sdnn_greedy_episode* episode) {
  sdnn_forget_state(&episode->last);
  episode->n_reads = states->n_reads;
}

/* Notes the action that follows, as indices. */
static inline void sdnn_note_act(sdnn_states* states, const uint32_t* action) {
  sdnn_note_action(&states->learned.episode, action);
  states->learned.has_acted = 1;
}

/* The bins of the state in which the agent acts greedily. */
static inline void sdnn_read_greedily(const sdnn_states* states, sdnn_greedy_episode* episode,
                                      const int32_t* observation, uint32_t* bins) {
  if (episode->n_reads != states->n_reads) {
    sdnn_copy_bytes(&episode->last, &states->learned, sizeof episode->last);
    episode->n_reads = states->n_reads;
  }
  sdnn_find_state(&episode->last, observation);
  sdnn_bins_of_state(episode->last.state, bins);
}

/* Notes the greedy action that follows, as indices or, unless it is null, at fractional ones. */
static inline void sdnn_note_greedy(sdnn_greedy_episode* episode, const uint32_t* action,
                                    const uint32_t* place) {
  if (place) {
    sdnn_note_places(&episode->last.episode, place);
  } else {
    sdnn_note_action(&episode->last.episode, action);
  }
  episode->last.has_acted = 1;
}

/* The bins of the state of an observation, of the episode from which the agent learns; no step is
 * taken. */
static inline void sdnn_read_only(const sdnn_states* states, const int32_t* observation,
                                  uint32_t* bins) {
  const sdnn_last_state* const last = &states->learned;
  sdnn_last_state next;
  sdnn_copy_bytes(&next, last, sizeof next);
  observation = sdnn_filled(&next, observation);
  if (!sdnn_is_state_of(last, observation)) sdnn_find_state(&next, observation);
  sdnn_bins_of_state(next.state, bins);
}

/* The bins of the state in which a transition starts. Returns whether the last one ended there. */
static inline uint32_t sdnn_read_first(sdnn_states* states, const int32_t* observation,
                                       uint32_t* bins) {
  uint32_t i, is_next = 1;
  sdnn_restart(&states->learned, sdnn_filled(&states->learned, observation));
  sdnn_bins_of_state(states->learned.state, bins);
  for (i = 0; i < SDNN_N_INPUTS; ++i) is_next &= states->next[i] == states->learned.state[i];
  return is_next;
}

/* The bins of the state in which a transition ends, whose start was read before. */
static inline void sdnn_read_next(sdnn_states* states, const uint32_t* action,
                                  const int32_t* next_observation, uint32_t* bins) {
  sdnn_note_action(&states->learned.episode, action);
  sdnn_advance(&states->learned, sdnn_filled(&states->learned, next_observation));
  sdnn_bins_of_state(states->learned.state, bins);
  ++states->n_reads;
}

/* Notes that the agent has learned the transition that was read. */
static inline void sdnn_keep_next(sdnn_states* states, const int32_t* next_observation) {
  (void)next_observation;
  sdnn_copy_bytes(states->next, states->learned.state, sizeof states->next);
}

#endif /* SDNN_HISTORY_LEARNER_H */
