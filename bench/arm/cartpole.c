/* Cart and pole of Gymnasium's CartPole-v1 in fixed point; its score is the number of steps. */
#include "pole.h"

#define ONE (INT64_C(1) << 24) /* of the physics */
#define MOST_STEPS 500
#define MOST_SCORE 500
#define SCORE(reward) 1
#define ONE_POINT 1

typedef struct {
  int64_t x, v, a, w; /* position, speed, angle, turn */
} Plant;

#include "balancing.h"

static int64_t times(int64_t a, int64_t b) { return a * b / ONE; }
static int64_t over(int64_t a, int64_t b) { return a * ONE / b; }

/* All numbers are in [-.05, .05]. */
static Plant any_state(void) {
  Plant cart;
  cart.x = any() / 10;
  cart.v = any() / 10;
  cart.a = any() / 10;
  cart.w = any() / 10;
  return cart;
}

static int64_t push(Plant* cart, enum mode mode, const int32_t* observation,
                    uint32_t to_the_right) {
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
  return ONE;
}

static int has_fallen(const Plant* cart) {
  return llabs(cart->x) > 24 * ONE / 10 || llabs(cart->a) > 2094395 * ONE / 10000000;
}

static void observe(const Plant* cart, int32_t* observation) {
  observation[0] = reading(cart->x);
  observation[1] = reading(cart->v);
  observation[2] = reading(cart->a);
  observation[3] = reading(cart->w);
}
