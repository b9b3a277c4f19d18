/* A pendulum learns to swing up and balance, on the board alone. A Zephyr application; beside this
 * file goes the header that this writes:
 *
 *   sdnn export --new --range angle --range -8:8 --actions -2:2 --c-header pole.h
 *
 * The board's overlay has the aliases `encoder`, a sensor of rotation with the angle 0 upright, and
 * `direction`, and a node `motor` with `pwms`.
 */
#include <zephyr/drivers/gpio.h>
#include <zephyr/drivers/pwm.h>
#include <zephyr/drivers/sensor.h>
#include <zephyr/kernel.h>
#include <zephyr/sys/printk.h>

#include "pole.h"

#define PERIOD 50 /* ms of a step */
#define STEPS 200 /* of an episode */
#define HALF_TURN INT32_C(205887) /* pi, times 2^16, as all numbers are here */

static const struct device *const encoder = DEVICE_DT_GET(DT_ALIAS(encoder));
static const struct gpio_dt_spec direction = GPIO_DT_SPEC_GET(DT_ALIAS(direction), gpios);
static const struct pwm_dt_spec motor = PWM_DT_SPEC_GET(DT_NODELABEL(motor));

static pole_agent agent;
static int32_t angle_before;

/* Angle in radians, and speed in radians a second. */
static int read_sensors(int32_t *observation)
{
	struct sensor_value degrees;
	int32_t angle, moved;

	if (sensor_sample_fetch(encoder) < 0 ||
	    sensor_channel_get(encoder, SENSOR_CHAN_ROTATION, &degrees) < 0) {
		return -1;
	}
	/* A millionth of a degree is 1 / 874 of 2^-16 radians. */
	angle = (degrees.val1 % 360) * (HALF_TURN / 180) + degrees.val2 / 874;
	moved = angle - angle_before;
	if (moved > HALF_TURN) {
		moved -= 2 * HALF_TURN;
	} else if (moved < -HALF_TURN) {
		moved += 2 * HALF_TURN;
	}
	angle_before = angle;
	observation[0] = angle;
	observation[1] = moved * (1000 / PERIOD);
	return 0;
}

static void drive(int32_t torque)
{
	gpio_pin_set_dt(&direction, torque > 0);
	pwm_set_pulse_dt(&motor, torque == 0 ? 0 : motor.period);
}

/* -(angle^2 + speed^2 / 10), of the angle from upright, -pi to pi. */
static int32_t reward_of(const int32_t *observation)
{
	int32_t angle = observation[0], speed = observation[1] / 256;

	if (angle > HALF_TURN) {
		angle -= 2 * HALF_TURN;
	} else if (angle < -HALF_TURN) {
		angle += 2 * HALF_TURN;
	}
	angle /= 256;
	return -(angle * angle + speed * (speed / 10));
}

static int episode(void)
{
	int32_t now[POLE_N_OBSERVED], next[POLE_N_OBSERVED], total = 0;

	pole_begin_episode(&agent);
	if (read_sensors(now) < 0) {
		return -1;
	}
	for (int step = 0; step < STEPS; ++step) {
		const uint32_t action = pole_act(&agent, now);

		drive(pole_action_fixed[action]);
		k_msleep(PERIOD);
		if (read_sensors(next) < 0) {
			return -1;
		}
		const int32_t reward = reward_of(next);

		pole_learn(&agent, now, action, reward, next, 0);
		total += reward / 256;
		for (int i = 0; i < POLE_N_OBSERVED; ++i) {
			now[i] = next[i];
		}
	}
	printk("return %d\n", (int)(total / 256));
	return 0;
}

int main(void)
{
	if (!device_is_ready(encoder) || !gpio_is_ready_dt(&direction) || !pwm_is_ready_dt(&motor) ||
	    gpio_pin_configure_dt(&direction, GPIO_OUTPUT_INACTIVE) < 0) {
		return -1;
	}
	pole_begin(&agent);
	while (episode() == 0) {
		drive(0);
	}
	drive(0);
	return -1;
}
