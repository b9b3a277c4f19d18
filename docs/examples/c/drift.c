/* A gas sensor drifts, and the processor corrects its calibration. The sensor is simulated here.
 *
 * docs/how-to/estimators-on-a-chip.md fits the calibration and exports it as sensor.h.
 *
 *   cc -O2 -I. drift.c -o drift -lm && ./drift
 *
 * Prints the mean errors over the last quarter of 20,000 readings, in ppm: of the first calibration,
 * and of the one that learned from a reference at each 20th reading.
 */
#include <math.h>
#include <stdio.h>

#include "sensor.h"

#define N_READINGS 20000

static uint32_t noise = 1;

static double uniform(double low, double high) {
  noise = noise * 1664525u + 1013904223u;
  return low + (high - low) * (double)(noise >> 8) / 16777216.0;
}

/* The voltage, temperature and humidity at a concentration of the gas. The sensor loses up to a
 * quarter of its sensitivity. */
static void read_sensor(double gas, int number, double* x) {
  const double sensitivity = 1.0 - 0.25 * number / N_READINGS;
  x[1] = uniform(-10.0, 50.0);
  x[2] = uniform(0.0, 100.0);
  x[0] = sensitivity * (0.5 + 2.5 * sqrt(gas / 1000.0)) * (1.0 + 0.006 * (x[1] - 20.0));
  x[0] += 0.002 * x[2] + uniform(-0.01, 0.01);
}

int main(void) {
  static sensor_model first, model; /* a processor needs one of them */
  double errors[2] = {0.0, 0.0};
  int number;
  sensor_begin(&first);
  sensor_begin(&model);
  for (number = 0; number < N_READINGS; ++number) {
    const double gas = uniform(0.0, 1000.0);
    double x[SENSOR_N_FEATURES], y[2];
    read_sensor(gas, number, x);
    if (!sensor_predict(&first, x, &y[0]) || !sensor_predict(&model, x, &y[1])) continue;
    if (4 * number >= 3 * N_READINGS) {
      errors[0] += fabs(y[0] - gas) / (0.25 * N_READINGS);
      errors[1] += fabs(y[1] - gas) / (0.25 * N_READINGS);
    }
    if (number % 20 == 0) sensor_learn(&model, x, &gas);
  }
  printf("%.0f %.0f\n", errors[0], errors[1]);
  return 0;
}
