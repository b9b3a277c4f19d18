/* An agent that learns as a class of C++. */
#ifndef SDNN_LEARNER_CLASS_H
#define SDNN_LEARNER_CLASS_H

#include "sdnn_keeper.h"
#include "sdnn_slots.h"

#ifndef SDNN_EPISODE /* where no agent has a history */
#define SDNN_EPISODE_PARAMETER
#define SDNN_EPISODE
#endif

#ifdef __cplusplus
class sdnn_learner {
 public:
  typedef const int32_t (&observation_type)[SDNN_N_OBSERVED];
  sdnn_learner() { sdnn_begin(&agent_); }
  void begin_episode() { sdnn_begin_episode(&agent_); }
#if SDNN_N_DIMENSIONS == 1
  typedef uint32_t action_type;
  uint32_t act(observation_type observation) { return sdnn_act(&agent_, observation); }
#else
  typedef const uint32_t (&action_type)[SDNN_N_DIMENSIONS];
  void act(observation_type observation, uint32_t (&action)[SDNN_N_DIMENSIONS]) {
    sdnn_act(&agent_, observation, action);
  }
#endif
#ifdef SDNN_HAS_EPISODES
  void begin_greedy_episode(sdnn_greedy_episode* episode) const {
    sdnn_begin_greedy_episode(&agent_, episode);
  }
#endif
#if SDNN_N_DIMENSIONS == 1
  uint32_t greedy(SDNN_EPISODE_PARAMETER observation_type observation) const {
    return sdnn_greedy(&agent_, SDNN_EPISODE observation);
  }
  uint32_t best(const sdnn_keeper& keeper,
                SDNN_EPISODE_PARAMETER observation_type observation) const {
    return sdnn_best(&agent_, &keeper, SDNN_EPISODE observation);
  }
#else
  void greedy(SDNN_EPISODE_PARAMETER observation_type observation,
              uint32_t (&action)[SDNN_N_DIMENSIONS]) const {
    sdnn_greedy(&agent_, SDNN_EPISODE observation, action);
  }
  void best(const sdnn_keeper& keeper, SDNN_EPISODE_PARAMETER observation_type observation,
            uint32_t (&action)[SDNN_N_DIMENSIONS]) const {
    sdnn_best(&agent_, &keeper, SDNN_EPISODE observation, action);
  }
#endif
  bool keep(sdnn_keeper& keeper, int64_t score) const {
    return sdnn_keep(&agent_, &keeper, score) != 0;
  }
  void learn(observation_type observation, action_type action, int32_t reward,
             observation_type next_observation, bool terminated) {
    sdnn_learn(&agent_, observation, action, reward, next_observation, terminated);
  }
#ifdef SDNN_DURATIONS_H
  void learn_over(observation_type observation, action_type action, int32_t reward,
                  observation_type next_observation, bool terminated, uint32_t dt) {
    sdnn_learn_over(&agent_, observation, action, reward, next_observation, terminated, dt);
  }
#endif
#ifdef SDNN_HAS_PROGRESS
  void set_progress(uint32_t progress) { sdnn_set_progress(&agent_, progress); }
#endif
#ifdef SDNN_IS_ACTOR_CRITIC
  int64_t state_value(observation_type observation) const {
    return sdnn_state_value(&agent_, observation);
  }
#else
  int64_t q(observation_type observation, action_type action) const {
    return sdnn_q(&agent_, observation, action);
  }
#endif
  void save(uint8_t (&image)[SDNN_IMAGE_BYTES]) const { sdnn_save(&agent_, image); }
  bool load(const uint8_t (&image)[SDNN_IMAGE_BYTES]) { return sdnn_load(&agent_, image) != 0; }
  void save_part(uint32_t offset, uint8_t* bytes, uint32_t n) const {
    sdnn_save_part(&agent_, offset, bytes, n);
  }
  bool load_from(sdnn_reader read, void* context) {
    return sdnn_load_from(&agent_, read, context) != 0;
  }
  bool store(const sdnn_flash& flash) const { return sdnn_store(&agent_, &flash) != 0; }
  bool restore(const sdnn_flash& flash) { return sdnn_restore(&agent_, &flash) != 0; }

 private:
  sdnn_agent agent_;
};
#endif

#endif /* SDNN_LEARNER_CLASS_H */
