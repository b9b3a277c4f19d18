/* A trained agent balances a pole: the loop of a small processor. Cart and pole are simulated here
 * (Gymnasium's CartPole-v1); a robot has sensors and a motor in their place.
 *
 *   sdnn train CartPole-v1 --agent sdnn-c --preset small --out runs/pole
 *   sdnn export runs/pole --c-header cartpole.h
 *   cc -O2 -I. main.c -o main -lm && ./main
 *
 * Prints for how many of 500 decisions the pole stayed up.
 */
#include <math.h>
#include <stdio.h>

#include "cartpole.h"

typedef struct {
  double position, speed, angle, turn;
} Cart;

/* A reading in fixed point: on a robot, what an ADC or an encoder says, shifted. */
static int32_t reading(double value) { return (int32_t)lround(ldexp(value, CARTPOLE_FRACTION_BITS)); }

static void read_sensors(const Cart *cart, int32_t *observation) {
  observation[0] = reading(cart->position);
  observation[1] = reading(cart->speed);
  observation[2] = reading(cart->angle);
  observation[3] = reading(cart->turn);
}

/* Pushes the cart for a fiftieth of a second, to the left (0) or to the right (1). */
static void push(Cart *cart, int32_t to_the_right) {
  const double force = to_the_right ? 10.0 : -10.0;
  const double sine = sin(cart->angle), cosine = cos(cart->angle);
  const double pull = (force + 0.05 * cart->turn * cart->turn * sine) / 1.1;
  const double bend =
      (9.8 * sine - cosine * pull) / (0.5 * (4.0 / 3.0 - 0.1 * cosine * cosine / 1.1));
  const double thrust = pull - 0.05 * bend * cosine / 1.1;
  cart->position += 0.02 * cart->speed;
  cart->speed += 0.02 * thrust;
  cart->angle += 0.02 * cart->turn;
  cart->turn += 0.02 * bend;
}

static int is_up(const Cart *cart) {
  return fabs(cart->position) <= 2.4 && fabs(cart->angle) <= 12.0 / 180.0 * 3.141592653589793;
}

int main(void) {
  Cart cart = {0.01, -0.02, 0.03, 0.0};
  int step;
  for (step = 0; step < 500 && is_up(&cart); ++step) {
    int32_t observation[CARTPOLE_N_OBSERVED];
    read_sensors(&cart, observation);
    push(&cart, cartpole_first_action[0] + (int32_t)cartpole_greedy(observation));
  }
  printf("%d\n", step);
  return 0;
}
