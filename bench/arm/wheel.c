/* A pendulum that is driven by a wheel, in fixed point. The wheel must not become fast: its motor
 * has less torque then, and the reward is less. The score is the number of steps. */
#include "pole.h"

#define ONE (INT64_C(1) << 24) /* of the physics */
#define MOST_STEPS 500
#define MOST_SCORE 500
#define SCORE(reward) 1
#define ONE_POINT 1

typedef struct {
  int64_t angle, turn, wheel; /* radians, radians a second, and the wheel's part of its top speed */
} Plant;

#include "balancing.h"

static int64_t times(int64_t a, int64_t b) { return (a * b) >> 24; }

static Plant any_state(void) {
  Plant it;
  it.angle = ((int64_t)any() * 13) >> 7;
  it.turn = ((int64_t)any() * 13) >> 7;
  it.wheel = ((int64_t)any() * 13) >> 5;
  return it;
}

static int has_fallen(const Plant* it) { return llabs(it->angle) > 3 * ONE / 10; }

/* Accelerates the wheel for a fiftieth of a second; the reward is 1 - wheel^2 / 4, and 0 after a
 * fall. */
static int64_t push(Plant* it, enum mode mode, const int32_t* observation, uint32_t action) {
  static const int64_t accelerations[5] = {-4, -1, 0, 1, 4}; /* radians / s^2 */
  int64_t force = accelerations[action] * ONE;
  const int64_t lost = times(force, it->wheel),
                cube = times(times(it->angle, it->angle), it->angle);
  (void)mode, (void)observation;
  if (lost > 0) force -= lost;
  it->turn += ((20 * (it->angle - ((cube * 10923) >> 16)) - force) * 1311) >> 16;
  it->angle += (it->turn * 1311) >> 16;
  it->wheel += ((force - (it->wheel >> 2)) * 1311) >> 16;
  it->wheel = it->wheel > ONE ? ONE : it->wheel < -ONE ? -ONE : it->wheel;
  return has_fallen(it) ? 0 : ONE - (times(it->wheel, it->wheel) >> 2);
}

static void observe(const Plant* it, int32_t* observation) {
  observation[0] = (int32_t)(it->angle >> (24 - POLE_FRACTION_BITS));
  observation[1] = (int32_t)(it->turn >> (24 - POLE_FRACTION_BITS));
  observation[2] = (int32_t)(it->wheel >> (24 - POLE_FRACTION_BITS));
}
