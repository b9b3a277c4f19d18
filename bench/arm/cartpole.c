/* Cart and pole of Gymnasium's CartPole-v1 in fixed point, and an agent that learns to balance from
 * nothing, with no floating point: learning.py compiles and runs it.
 *
 * usage: cartpole STEPS EPISODES: prints the mean return of so many greedy episodes.
 */
#include <stdio.h>
#include <stdlib.h>

#include "pole.h"

#define ONE (INT64_C(1) << 24) /* of the physics */

static pole_agent agent;

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

/* An episode of at most 500 steps; returns its steps. */
static uint32_t episode(int learns, uint32_t most) {
  Cart cart = {any_start(), any_start(), any_start(), any_start()};
  int32_t now[4], next[4];
  uint32_t step;
  pole_begin_episode(&agent);
  for (step = 0; step < most && !has_fallen(&cart); ++step) {
    uint32_t action;
    observe(&cart, now);
    action = learns ? pole_act(&agent, now) : pole_greedy(&agent, now);
    push(&cart, action);
    observe(&cart, next);
    if (learns) pole_learn(&agent, now, action, 1 << POLE_FRACTION_BITS, next, has_fallen(&cart));
  }
  return step;
}

int main(int argc, char **argv) {
  const uint32_t n_steps = (uint32_t)atol(argv[1]), n_episodes = (uint32_t)atol(argv[2]);
  uint32_t step, k, total = 0;
  pole_begin(&agent);
  for (step = 0; step < n_steps;) {
#ifdef FOLLOWS_PROGRESS
    pole_set_progress(&agent, (uint32_t)((uint64_t)step * 65536 / n_steps));
#endif
    step += episode(1, n_steps - step < 500 ? n_steps - step : 500);
  }
  noise = 12345;
  for (k = 0; k < n_episodes; ++k) total += episode(0, 500);
  if (n_episodes > 0) printf("%.1f\n", (double)total / n_episodes);
  return argc > 3;
}
