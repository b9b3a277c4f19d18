/* Calls of a learning agent with a linear readout: acting and learning with actions of one
 * dimension or of several, beginning, saving. */
#ifndef SDNN_LINEAR_AGENT_H
#define SDNN_LINEAR_AGENT_H

#if SDNN_N_DIMENSIONS == 1
static inline uint32_t sdnn_act(sdnn_agent* agent, const int32_t* observation) {
  uint32_t action;
  sdnn_act_in_each(agent, observation, &action);
  return action;
}
static inline uint32_t sdnn_greedy(const sdnn_agent* agent,
                                   SDNN_EPISODE_PARAMETER const int32_t* observation) {
  uint32_t action;
  sdnn_greedy_in_each(agent, SDNN_EPISODE observation, &action);
  return action;
}
static inline void sdnn_learn(sdnn_agent* agent, const int32_t* observation, uint32_t action,
                              int32_t reward, const int32_t* next_observation, int terminated) {
  sdnn_learn_in_each(agent, observation, &action, reward, next_observation, terminated);
}
#else
#define sdnn_act sdnn_act_in_each
#define sdnn_greedy sdnn_greedy_in_each
#define sdnn_learn sdnn_learn_in_each
#endif

#ifdef SDNN_HISTORY
/* Begins an episode of greedy steps, apart from the one of which the agent learns. */
static inline void sdnn_begin_greedy_episode(const sdnn_agent* agent,
                                             sdnn_greedy_episode* episode) {
  sdnn_forget_state(&episode->last);
  episode->n_reads = agent->states.n_reads;
}
#endif

/* Makes the agent as it was exported. */
static inline void sdnn_begin(sdnn_agent* agent) {
  sdnn_begin_as(agent, sdnn_first_head);
  sdnn_copy_32(agent->weights, sdnn_first_weights, SDNN_N_FIRST_WEIGHTS);
}

/* Moves the weights that are in a part of an image. */
static inline void sdnn_carry_arrays(sdnn_agent* agent, const sdnn_part* part, int reads) {
  sdnn_carry_words(part, agent->weights, SDNN_IMAGE_HEAD, SDNN_N_ALL_WEIGHTS, reads);
}

#endif /* SDNN_LINEAR_AGENT_H */
