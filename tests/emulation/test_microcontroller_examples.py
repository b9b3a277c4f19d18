"""Sketches for microcontrollers compile for them, and one learns with a simulated pole.

Stubs have what the sketches use of Arduino's and Zephyr's headers.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from c_policies import run
from sdnn.cli import main

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
SKETCH = EXAMPLES / "arduino" / "pole" / "pole.ino"
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-Os")

ARDUINO = """
#include <stdint.h>
enum { A0 = 14, LOW = 0, HIGH = 1, OUTPUT = 1 };
int analogRead(int pin);
void analogWrite(int pin, int value);
void digitalWrite(int pin, int value);
void pinMode(int pin, int mode);
void delay(unsigned long milliseconds);
struct Port { void begin(unsigned long rate); void println(long value); };
extern Port Serial;
"""

ZEPHYR = """
#pragma once
#include <stdint.h>
struct device { int unused; };
struct gpio_dt_spec { int pin; };
struct pwm_dt_spec { uint32_t period; };
struct sensor_value { int32_t val1, val2; };
extern const struct device some_device;
enum sensor_channel { SENSOR_CHAN_ROTATION };
#define GPIO_OUTPUT_INACTIVE 1u
#define DT_ALIAS(name) name
#define DT_NODELABEL(name) name
#define DEVICE_DT_GET(node) &some_device
#define GPIO_DT_SPEC_GET(node, property) {0}
#define PWM_DT_SPEC_GET(node) {0}
int device_is_ready(const struct device *device);
int gpio_is_ready_dt(const struct gpio_dt_spec *spec);
int pwm_is_ready_dt(const struct pwm_dt_spec *spec);
int gpio_pin_configure_dt(const struct gpio_dt_spec *spec, uint32_t flags);
int gpio_pin_set_dt(const struct gpio_dt_spec *spec, int value);
int pwm_set_pulse_dt(const struct pwm_dt_spec *spec, uint32_t pulse);
int sensor_sample_fetch(const struct device *device);
int sensor_channel_get(const struct device *device, enum sensor_channel channel,
                       struct sensor_value *value);
int32_t k_msleep(int32_t milliseconds);
void printk(const char *format, ...);
"""
HEADERS = ("drivers/gpio", "drivers/pwm", "drivers/sensor", "kernel", "sys/printk")

POLE = """
#include <math.h>
#include <stdio.h>
#include "sketch.cpp"
static double angle = 3, speed, torque;
static int sign;
Port Serial;
void Port::begin(unsigned long) {}
void Port::println(long value) { printf("%ld\\n", value); }
void pinMode(int, int) {}
void digitalWrite(int, int value) { sign = value ? 1 : -1; }
void analogWrite(int, int value) { torque = sign * 2.0 * value / 255; }
int analogRead(int) {
  return (int)floor((remainder(angle, 6.283185307179586) / 6.283185307179586 + 0.5) * 1023);
}
void delay(unsigned long milliseconds) {
  for (unsigned long i = 0; i < milliseconds; ++i) {
    speed = fmax(-8, fmin(8, speed + (15 * sin(angle) + 3 * torque) / 1000));
    angle += speed / 1000;
  }
}
int main() {
  setup();
  for (int i = 0; i < 400; ++i) {
    angle = fmod(i * 2.39996, 6.28318);
    speed = 0;
    loop();
  }
}
"""


@pytest.fixture
def folder(tmp_path):
    """The header that the sketches ask for, made by their command, and the stubs."""
    for path in (SKETCH, EXAMPLES / "zephyr" / "src" / "main.c"):
        (command,) = re.findall(r"^ \*   sdnn (export .*)$", path.read_text(), re.MULTILINE)
        words = [str(tmp_path / word) if word == "pole.h" else word for word in command.split()]
        assert CliRunner().invoke(main, words).exit_code == 0
    (tmp_path / "Arduino.h").write_text(ARDUINO)
    for name in HEADERS:
        path = tmp_path / "zephyr" / f"{name}.h"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(ZEPHYR if name == "kernel" else "#include <zephyr/kernel.h>\n")
    return tmp_path


@pytest.mark.parametrize("target", ["thumbv6m-none-eabi", "thumbv7em-none-eabi"])
def test_the_sketches_compile_for_small_processors(target, needs, folder):
    needs("clang", "clang++")
    options = (*WARNINGS, f"--target={target}", "-ffreestanding", f"-I{folder}", "-c")
    done = ("-o", folder / "done.o")
    run("clang++", *options, "-std=gnu++11", "-fno-exceptions", "-x", "c++", SKETCH, *done)
    run("clang", *options, "-std=gnu11", EXAMPLES / "zephyr" / "src" / "main.c", *done)


def test_the_arduino_sketch_learns_with_a_simulated_pole(needs, folder):
    needs("g++")
    (folder / "sketch.cpp").write_bytes(SKETCH.read_bytes())
    (folder / "pole.cpp").write_text(POLE)
    run("g++", *WARNINGS, "-O2", f"-I{folder}", folder / "pole.cpp", "-o", folder / "pole")
    returns = np.array(run(folder / "pole").split(), int)
    assert returns[:20].mean() < -900
    assert returns[-100:].mean() > -600
