/* Gymnasium's Pendulum-v1 in fixed point, which has to be swung up. The agent reads the angle
 * itself, as an encoder does, where Gymnasium has its cosine and sine. The score is the sum of
 * rewards. */
#include "pole.h"

#define ONE (INT32_C(1) << 24) /* of the physics */
#define HALF_TURN INT32_C(52707179)
#define QUARTER_TURN INT32_C(26353589)
#define MOST_SPEED (8 * ONE)
#define MOST_STEPS 200
#define MOST_SCORE 0
#define SCORE(reward) (reward)
#define ONE_POINT ONE

typedef struct {
  int32_t angle, speed; /* in [-pi, pi), from upright, and in [-8, 8] */
} Plant;

#include "balancing.h"

static int32_t times(int32_t a, int32_t b) { return (int32_t)((int64_t)a * b / ONE); }

static Plant any_state(void) {
  Plant it;
  it.angle = times(any() * 2, HALF_TURN);
  it.speed = times(any() * 2, ONE);
  return it;
}

/* Of an angle in [-pi, pi]: its Taylor polynomial of degree 9 within a quarter turn. */
static int32_t sine(int32_t angle) {
  int32_t a = angle, square;
  if (a > QUARTER_TURN) a = HALF_TURN - a;
  if (a < -QUARTER_TURN) a = -HALF_TURN - a;
  square = times(a, a);
  return times(
      a,
      ONE -
          times(square, ONE - times(square, ONE - times(square, ONE - square / 72) / 42) / 20) / 6);
}

static int32_t torque_of(enum mode mode, const int32_t* observation, uint32_t action) {
#ifdef POLE_IS_ACTOR_CRITIC
#ifdef KEEP_EPISODES
  if (mode == BEST) return pole_action_at(0, pole_best_place(&agent, &keeper, observation));
#endif
  if (mode != LEARNING) return pole_action_at(0, pole_place(&agent, observation));
#endif
  return pole_action_fixed[action];
}

/* Turns for a twentieth of a second. */
static int64_t push(Plant* it, enum mode mode, const int32_t* observation, uint32_t action) {
  const int32_t torque = torque_of(mode, observation, action) * (1 << (24 - POLE_FRACTION_BITS));
  const int32_t reward = -times(it->angle, it->angle) - times(it->speed, it->speed) / 10 -
                         times(torque, torque) / 1000;
  it->speed += (15 * sine(it->angle) + 3 * torque) / 20;
  it->speed = it->speed > MOST_SPEED    ? MOST_SPEED
              : it->speed < -MOST_SPEED ? -MOST_SPEED
                                        : it->speed;
  it->angle += it->speed / 20;
  if (it->angle >= HALF_TURN) it->angle -= 2 * HALF_TURN;
  if (it->angle < -HALF_TURN) it->angle += 2 * HALF_TURN;
  return reward;
}

static int has_fallen(const Plant* it) { return 0; }

static void observe(const Plant* it, int32_t* observation) {
  observation[0] = reading(it->angle);
  observation[1] = reading(it->speed);
}
