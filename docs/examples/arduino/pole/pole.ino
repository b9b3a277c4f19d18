/* A pendulum learns to swing up and balance, on the board alone. An Arduino sketch; beside it goes
 * the header that this writes:
 *
 *   sdnn export --new --range angle --range -8:8 --actions -2:2 --c-header pole.h
 *
 * Its sensors are an encoder with an analog output, a turn from 0 V to the supply with the middle
 * upright, and the speed that follows from it. A driver takes a direction and a duty cycle.
 */
#include <Arduino.h>

#include "pole.h"

const int kEncoder = A0, kDirection = 4, kMotor = 5;
const unsigned long kPeriod = 50; /* ms of a step */
const int kSteps = 200;           /* of an episode */

pole_learner learner;
int32_t now[POLE_N_OBSERVED], next[POLE_N_OBSERVED];
int32_t angle_before = 0;

/* Angle in radians and speed in radians a second, times 2^POLE_FRACTION_BITS, which is 16 here. */
void read_sensors(int32_t *observation) {
  const int32_t turn = 411775; /* 2 pi, times 2^16 */
  const int32_t angle = ((int32_t)analogRead(kEncoder) - 512) * (turn / 1024);
  int32_t moved = angle - angle_before;
  if (moved > turn / 2) moved -= turn;
  if (moved < -turn / 2) moved += turn;
  angle_before = angle;
  observation[0] = angle;
  observation[1] = moved * (int32_t)(1000 / kPeriod);
}

void drive(int32_t torque) { /* -2, 0 or 2, times 2^16 */
  digitalWrite(kDirection, torque > 0 ? HIGH : LOW);
  analogWrite(kMotor, torque == 0 ? 0 : 255);
}

/* -(angle^2 + speed^2 / 10), times 2^16: the product of two numbers times 2^8. */
int32_t reward_of(const int32_t *observation) {
  const int32_t angle = observation[0] / 256, speed = observation[1] / 256;
  return -(angle * angle + speed * (speed / 10));
}

void setup() {
  Serial.begin(115200);
  pinMode(kDirection, OUTPUT);
  pinMode(kMotor, OUTPUT);
}

void loop() {
  int32_t total = 0; /* rewards, times 2^8: their sum fits */
  learner.begin_episode();
  read_sensors(now);
  for (int step = 0; step < kSteps; ++step) {
    const uint32_t action = learner.act(now);
    drive(pole_action_fixed[action]);
    delay(kPeriod); /* a timer keeps the time better */
    read_sensors(next);
    const int32_t reward = reward_of(next);
    learner.learn(now, action, reward, next, false); /* true: it fell, say, and nothing follows */
    total += reward / 256;
    for (int i = 0; i < POLE_N_OBSERVED; ++i) now[i] = next[i];
  }
  drive(0);
  Serial.println(total / 256); /* the return, which grows */
}
