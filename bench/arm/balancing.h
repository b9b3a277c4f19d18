/* The loop in which an agent in C learns to balance from nothing, with no floating point:
 * learning.py compiles it with a task, and runs it.
 *
 * usage: TASK STEPS EPISODES: prints the mean score of so many greedy episodes, of the best policy
 * if KEEP_EPISODES is defined: the greedy episodes by which policies are compared, or 0 if the last
 * KEEP_BLOCK learned ones compare them. START seeds the states in which episodes begin.
 *
 * Before its include a task defines the type Plant, MOST_STEPS and MOST_SCORE of an episode, SCORE
 * of a reward and the score ONE_POINT that counts 1; after it, the functions that are declared
 * here.
 */
#include <stdio.h>
#include <stdlib.h>

#ifndef START
#define START 1
#endif
#ifndef KEEP_BLOCK
#define KEEP_BLOCK 1
#endif

static pole_agent agent;
#ifdef KEEP_EPISODES
static pole_keeper keeper;
#endif
static uint32_t noise = START;

enum mode { LEARNING, GREEDY, BEST };

static Plant any_state(void);
static void observe(const Plant* plant, int32_t* observation);
/* Returns the reward, times 2^24. */
static int64_t push(Plant* plant, enum mode mode, const int32_t* observation, uint32_t action);
static int has_fallen(const Plant* plant);

/* In [-2^23, 2^23). */
static int32_t any(void) {
  noise = noise * UINT32_C(1664525) + UINT32_C(1013904223);
  return (int32_t)(noise >> 8) - (1 << 23);
}

static int32_t reading(int64_t value) {
  return (int32_t)(value / (INT64_C(1) << (24 - POLE_FRACTION_BITS)));
}

static uint32_t act(enum mode mode, const int32_t* observation) {
  if (mode == LEARNING) return pole_act(&agent, observation);
#ifdef KEEP_EPISODES
  if (mode == BEST) return pole_best(&agent, &keeper, observation);
#endif
  return pole_greedy(&agent, observation);
}

/* An episode of at most `most` steps; counts them, and returns its score. */
static int64_t episode(enum mode mode, uint32_t most, uint32_t* n_steps) {
  Plant plant = any_state();
  int32_t now[POLE_N_OBSERVED], next[POLE_N_OBSERVED];
  int64_t score = 0;
  uint32_t step;
  pole_begin_episode(&agent);
  for (step = 0; step < most && !has_fallen(&plant); ++step) {
    uint32_t action;
    int64_t reward;
    observe(&plant, now);
    action = act(mode, now);
    reward = push(&plant, mode, now, action);
    observe(&plant, next);
    score += SCORE(reward);
    if (mode == LEARNING)
      pole_learn(&agent, now, action, reading(reward), next, has_fallen(&plant));
  }
  *n_steps += step;
  return score;
}

#ifdef KEEP_EPISODES
/* Measures the present policy, and keeps it if it is the best so far. */
static void keep_best(void) {
  int64_t score = 0;
  uint32_t n_steps = 0;
  int k;
  pole_begin_episode(&agent); /* so that the last transition is learned */
  for (k = 0; k < KEEP_EPISODES; ++k) {
    if (keeper.is_kept && score + (KEEP_EPISODES - k) * (int64_t)MOST_SCORE <= keeper.best) return;
    score += episode(GREEDY, MOST_STEPS, &n_steps);
  }
  pole_keep(&agent, &keeper, score);
}
#endif

#ifndef WITHOUT_MAIN
#ifdef KEEP_EPISODES
static uint8_t memory[POLE_KEPT_BYTES];
#endif

int main(int argc, char** argv) {
  const uint32_t n_steps = (uint32_t)atol(argv[1]), n_episodes = (uint32_t)atol(argv[2]);
  uint32_t step, k;
  int64_t score = 0;
  pole_begin(&agent);
#ifdef KEEP_EPISODES
  pole_begin_keeping(&keeper, memory, pole_read_memory, pole_write_memory, KEEP_BLOCK);
#endif
  for (step = 0; step < n_steps;) {
    const uint32_t before = step;
#ifdef FOLLOWS_PROGRESS
    pole_set_progress(&agent, (uint32_t)((uint64_t)step * 65536 / n_steps));
#endif
    score = episode(LEARNING, n_steps - step < MOST_STEPS ? n_steps - step : MOST_STEPS, &step);
#ifdef KEEP_EPISODES
    if (KEEP_EPISODES == 0) pole_keep(&agent, &keeper, score);
    if (KEEP_EPISODES > 0 && step / 2000 > before / 2000) keep_best();
#endif
    (void)before;
  }
  noise = 12345;
  score = 0;
  for (k = 0; k < n_episodes; ++k) score += episode(BEST, MOST_STEPS, &step);
  if (n_episodes > 0) printf("%.1f\n", (double)score / ONE_POINT / n_episodes);
  return argc > 3;
}
#endif
