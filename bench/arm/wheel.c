/* A pendulum that is driven by a wheel, in fixed point, and an agent that learns to balance it from
 * nothing, with no floating point: learning.py compiles and runs it. The wheel must not become fast:
 * its motor has less torque then, and the reward is less.
 *
 * usage: wheel STEPS EPISODES: prints the mean steps of so many greedy episodes, of the best policy
 * if KEEP_EPISODES is defined, the greedy episodes by which policies are compared.
 */
#include <stdio.h>
#include <stdlib.h>

#include "pole.h"

#define ONE (INT64_C(1) << 24) /* of the physics */

static pole_agent agent;
#ifdef KEEP_EPISODES
static uint8_t memory[POLE_KEPT_BYTES];
static pole_keeper keeper;
#endif

typedef struct {
  int64_t angle, turn, wheel; /* radians, radians a second, and the wheel's part of its top speed */
} Pendulum;

static int64_t times(int64_t a, int64_t b) { return (a * b) >> 24; }

static uint32_t noise = 1;

/* In [-most, most) / 128 of 2^23. */
static int64_t any_start(int64_t scale) {
  noise = noise * UINT32_C(1664525) + UINT32_C(1013904223);
  return (((int64_t)(noise >> 8) - (1 << 23)) * 13) >> scale;
}

/* Accelerates the wheel for a fiftieth of a second. */
static void push(Pendulum *it, uint32_t action) {
  static const int64_t accelerations[5] = {-4, -1, 0, 1, 4}; /* radians / s^2 */
  int64_t force = accelerations[action] * ONE;
  const int64_t lost = times(force, it->wheel), cube = times(times(it->angle, it->angle), it->angle);
  if (lost > 0) force -= lost;
  it->turn += ((20 * (it->angle - ((cube * 10923) >> 16)) - force) * 1311) >> 16;
  it->angle += (it->turn * 1311) >> 16;
  it->wheel += ((force - (it->wheel >> 2)) * 1311) >> 16;
  it->wheel = it->wheel > ONE ? ONE : it->wheel < -ONE ? -ONE : it->wheel;
}

static int has_fallen(const Pendulum *it) { return llabs(it->angle) > 3 * ONE / 10; }

static void observe(const Pendulum *it, int32_t *observation) {
  observation[0] = (int32_t)(it->angle >> (24 - POLE_FRACTION_BITS));
  observation[1] = (int32_t)(it->turn >> (24 - POLE_FRACTION_BITS));
  observation[2] = (int32_t)(it->wheel >> (24 - POLE_FRACTION_BITS));
}

/* 1 - wheel^2 / 4, and 0 after a fall. */
static int32_t reward_of(const Pendulum *it) {
  if (has_fallen(it)) return 0;
  return (int32_t)((ONE - (times(it->wheel, it->wheel) >> 2)) >> (24 - POLE_FRACTION_BITS));
}

enum mode { LEARNING, GREEDY, BEST };

static uint32_t act(enum mode mode, const int32_t *observation) {
  if (mode == LEARNING) return pole_act(&agent, observation);
#ifdef KEEP_EPISODES
  if (mode == BEST) return pole_best(&agent, &keeper, observation);
#endif
  return pole_greedy(&agent, observation);
}

/* An episode of at most 500 steps; returns its steps. */
static uint32_t episode(enum mode mode, uint32_t most) {
  Pendulum it;
  int32_t now[POLE_N_OBSERVED], next[POLE_N_OBSERVED];
  uint32_t step;
  it.angle = any_start(7);
  it.turn = any_start(7);
  it.wheel = any_start(5);
  pole_begin_episode(&agent);
  for (step = 0; step < most && !has_fallen(&it); ++step) {
    uint32_t action;
    observe(&it, now);
    action = act(mode, now);
    push(&it, action);
    observe(&it, next);
    if (mode == LEARNING) pole_learn(&agent, now, action, reward_of(&it), next, has_fallen(&it));
  }
  return step;
}

#ifdef KEEP_EPISODES
/* Measures the present policy, and keeps it if it is the best so far. */
static void keep_best(void) {
  int64_t total = 0;
  uint32_t k;
  pole_begin_episode(&agent); /* so that the last transition is learned */
  for (k = 0; k < KEEP_EPISODES; ++k) {
    if (keeper.is_kept && total + (KEEP_EPISODES - k) * 500 <= keeper.best) return;
    total += episode(GREEDY, 500);
  }
  pole_keep(&agent, &keeper, total);
}
#endif

int main(int argc, char **argv) {
  const uint32_t n_steps = (uint32_t)atol(argv[1]), n_episodes = (uint32_t)atol(argv[2]);
  uint32_t step, k, total = 0;
  pole_begin(&agent);
#ifdef KEEP_EPISODES
  pole_begin_keeping(&keeper, memory, pole_read_memory, pole_write_memory, 1);
#endif
  for (step = 0; step < n_steps;) {
#ifdef FOLLOWS_PROGRESS
    pole_set_progress(&agent, (uint32_t)((uint64_t)step * 65536 / n_steps));
#endif
    const uint32_t n = episode(LEARNING, n_steps - step < 500 ? n_steps - step : 500);
#ifdef KEEP_EPISODES
    if ((step + n) / 2000 > step / 2000) keep_best();
#endif
    step += n;
  }
  noise = 12345;
  for (k = 0; k < n_episodes; ++k) total += episode(BEST, 500);
  if (n_episodes > 0) printf("%.1f\n", (double)total / n_episodes);
  return argc > 3;
}
