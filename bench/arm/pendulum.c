/* Gymnasium's Pendulum-v1 in fixed point, and an agent that learns to swing it up and balance it from
 * nothing, with no floating point: learning.py compiles and runs it. It reads the angle itself, as an
 * encoder does, where Gymnasium has its cosine and sine.
 *
 * usage: pendulum STEPS EPISODES: prints the mean return of so many greedy episodes.
 */
#include <stdio.h>
#include <stdlib.h>

#include "pole.h"

#define ONE (INT32_C(1) << 24) /* of the physics */
#define HALF_TURN INT32_C(52707179)
#define QUARTER_TURN INT32_C(26353589)
#define MOST_SPEED (8 * ONE)
#define EPISODE 200

static pole_agent agent;

typedef struct {
  int32_t angle, speed; /* in [-pi, pi), from upright, and in [-8, 8] */
} Pendulum;

static int32_t times(int32_t a, int32_t b) { return (int32_t)((int64_t)a * b / ONE); }

static uint32_t noise = 1;

/* In [-most, most). */
static int32_t any_start(int32_t most) {
  noise = noise * UINT32_C(1664525) + UINT32_C(1013904223);
  return times(((int32_t)(noise >> 8) - (1 << 23)) * 2, most);
}

/* Of an angle in [-pi, pi]: its Taylor polynomial of degree 9 within a quarter turn. */
static int32_t sine(int32_t angle) {
  int32_t a = angle, square;
  if (a > QUARTER_TURN) a = HALF_TURN - a;
  if (a < -QUARTER_TURN) a = -HALF_TURN - a;
  square = times(a, a);
  return times(a, ONE - times(square, ONE - times(square, ONE - times(square, ONE - square / 72) / 42) / 20) / 6);
}

/* Turns for a twentieth of a second; returns the reward. */
static int32_t push(Pendulum *it, int32_t torque) {
  const int32_t reward = -times(it->angle, it->angle) - times(it->speed, it->speed) / 10 -
                         times(torque, torque) / 1000;
  it->speed += (15 * sine(it->angle) + 3 * torque) / 20;
  it->speed = it->speed > MOST_SPEED ? MOST_SPEED : it->speed < -MOST_SPEED ? -MOST_SPEED : it->speed;
  it->angle += it->speed / 20;
  if (it->angle >= HALF_TURN) it->angle -= 2 * HALF_TURN;
  if (it->angle < -HALF_TURN) it->angle += 2 * HALF_TURN;
  return reward;
}

static int32_t reading(int32_t value) { return value / (1 << (24 - POLE_FRACTION_BITS)); }

static void observe(const Pendulum *it, int32_t *observation) {
  observation[0] = reading(it->angle);
  observation[1] = reading(it->speed);
}

/* An episode; returns the sum of its rewards. */
static int64_t episode(int learns, uint32_t most) {
  Pendulum it = {any_start(HALF_TURN), any_start(ONE)};
  int32_t now[POLE_N_OBSERVED], next[POLE_N_OBSERVED];
  int64_t total = 0;
  uint32_t step;
  pole_begin_episode(&agent);
  for (step = 0; step < most; ++step) {
    uint32_t action;
    int32_t torque, reward;
    observe(&it, now);
    action = learns ? pole_act(&agent, now) : pole_greedy(&agent, now);
    torque = pole_action_fixed[action];
#ifdef POLE_IS_ACTOR_CRITIC
    if (!learns) torque = pole_action_at(0, pole_place(&agent, now));
#endif
    reward = push(&it, torque * (1 << (24 - POLE_FRACTION_BITS)));
    observe(&it, next);
    total += reward;
    if (learns) pole_learn(&agent, now, action, reading(reward), next, 0);
  }
  return total;
}

int main(int argc, char **argv) {
  const uint32_t n_steps = (uint32_t)atol(argv[1]), n_episodes = (uint32_t)atol(argv[2]);
  uint32_t step, k;
  int64_t total = 0;
  pole_begin(&agent);
  for (step = 0; step < n_steps; step += EPISODE) {
#ifdef FOLLOWS_PROGRESS
    pole_set_progress(&agent, (uint32_t)((uint64_t)step * 65536 / n_steps));
#endif
    episode(1, EPISODE);
  }
  noise = 12345;
  for (k = 0; k < n_episodes; ++k) total += episode(0, EPISODE);
  if (n_episodes > 0) printf("%.1f\n", (double)total / ONE / n_episodes);
  return argc > 3;
}
