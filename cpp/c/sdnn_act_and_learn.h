/* Acting and learning with actions of one dimension, or of several. */
#ifndef SDNN_ACT_AND_LEARN_H
#define SDNN_ACT_AND_LEARN_H

#if SDNN_N_DIMENSIONS == 1
static inline uint32_t sdnn_act(sdnn_agent* agent, const int32_t* observation, int explore) {
  uint32_t action;
  sdnn_act_in_each(agent, observation, explore, &action);
  return action;
}
static inline void sdnn_learn(sdnn_agent* agent, const int32_t* observation, uint32_t action,
                              int32_t reward, const int32_t* next_observation, int terminated) {
  sdnn_learn_in_each(agent, observation, &action, reward, next_observation, terminated);
}
#else
#define sdnn_act sdnn_act_in_each
#define sdnn_learn sdnn_learn_in_each
#endif

#endif /* SDNN_ACT_AND_LEARN_H */
