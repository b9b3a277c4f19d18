/* Cart and pole of Gymnasium's CartPole-v1 in fixed point, and an agent that learns to balance from
 * nothing, with no floating point: learning.py compiles and runs it.
 *
 * usage: cartpole STEPS EPISODES: prints the mean return of so many greedy episodes, of the best
 * policy if KEEP_EPISODES is defined, the greedy episodes by which policies are compared.
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
  int64_t x, v, a, w; /* position, speed, angle, turn */
} Cart;

static int64_t times(int64_t a, int64_t b) { return a * b / ONE; }
static int64_t over(int64_t a, int64_t b) { return a * ONE / b; }

static uint32_t noise = 1;

/* In [-.05, .05]. */
static int64_t any_start(void) {
  noise = noise * UINT32_C(1664525) + UINT32_C(1013904223);
  return ((int64_t)(noise >> 8) - (1 << 23)) / 10;
}

static void push(Cart *cart, uint32_t to_the_right) {
  const int64_t a = cart->a, square = times(a, a);
  const int64_t sine = times(a, ONE - times(square, ONE - square / 20) / 6);
  const int64_t cosine = ONE - times(square, ONE - square / 12) / 2;
  const int64_t force = to_the_right ? 10 * ONE : -10 * ONE;
  const int64_t pull = (force + times(times(cart->w, cart->w), sine) / 20) * 10 / 11;
  const int64_t bend = over(times(98 * ONE / 10, sine) - times(cosine, pull),
                            (4 * ONE / 3 - times(cosine, cosine) / 11) / 2);
  const int64_t thrust = pull - times(bend, cosine) / 22;
  cart->x += cart->v / 50;
  cart->v += thrust / 50;
  cart->a += cart->w / 50;
  cart->w += bend / 50;
}

static int has_fallen(const Cart *cart) {
  return llabs(cart->x) > 24 * ONE / 10 || llabs(cart->a) > 2094395 * ONE / 10000000;
}

static int32_t reading(int64_t value) {
  return (int32_t)(value / (INT64_C(1) << (24 - POLE_FRACTION_BITS)));
}

static void observe(const Cart *cart, int32_t *observation) {
  observation[0] = reading(cart->x);
  observation[1] = reading(cart->v);
  observation[2] = reading(cart->a);
  observation[3] = reading(cart->w);
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
  Cart cart = {any_start(), any_start(), any_start(), any_start()};
  int32_t now[4], next[4];
  uint32_t step;
  pole_begin_episode(&agent);
  for (step = 0; step < most && !has_fallen(&cart); ++step) {
    uint32_t action;
    observe(&cart, now);
    action = act(mode, now);
    push(&cart, action);
    observe(&cart, next);
    if (mode == LEARNING) pole_learn(&agent, now, action, 1 << POLE_FRACTION_BITS, next, has_fallen(&cart));
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
