"""Lets an agent learn CartPole from nothing, in C and fixed point, natively and on an emulated Arm.

Prints the mean return of 100 greedy episodes after training, for each seed, and the Thumb-2
instructions of a step of acting, learning and physics. Counts are exact; of time an emulator says
nothing. Needs Debian's compilers and an emulator: apt install gcc gcc-arm-linux-gnueabihf
qemu-user.

usage: python bench/arm/learning.py [--seeds 10] [--steps 50000] [--units 64]
"""

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

import gymnasium as gym

from sdnn.agents import SDNNSarsa
from sdnn.approximators import LinearSDNNConfig
from sdnn.export import export_c_header

HERE = Path(__file__).parent
RANGES = ([-2.4, -3.0, -0.21, -3.5], [2.4, 3.0, 0.21, 3.5])
EPISODES = 100
COUNTED = (2000, 4000)
"""Steps of two runs whose instructions are compared."""


def new_agent(seed, n_units):
    """An agent that knows its sensors' ranges, and nothing else."""
    env = gym.make("CartPole-v1")
    return SDNNSarsa(
        env.observation_space,
        env.action_space,
        approximator=LinearSDNNConfig(n_pattern_units=n_units),
        observation_range=RANGES,
        inputs="all",
        angle_pairs=[],
        seed=seed,
    )


def program(folder, compiler, *options):
    """Compile the header in the folder with the physics."""
    path = folder / compiler
    command = [compiler, "-std=c99", "-O2", *options, f"-I{folder}", HERE / "cartpole.c"]
    subprocess.run([*command, "-o", path], check=True)
    return path


def output(*command):
    """What a program prints, and what its emulator counts."""
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return done.stdout.strip(), done.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--steps", type=int, default=50_000)
    parser.add_argument("--units", type=int, default=64, help="n_pattern_units")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        returns = []
        for seed in range(1, given.seeds + 1):
            header = export_c_header(new_agent(seed, given.units), folder / "pole.h", learning=True)
            native = program(folder, "gcc")
            returns.append(float(output(native, given.steps, EPISODES)[0]))
            print(f"seed {seed}: {returns[-1]:.1f}", flush=True)
        n_solved = sum(one >= 475 for one in returns)
        print(f"{n_solved} of {given.seeds} reach 475 after {given.steps:,} steps")
        print(f"{header.ram_bytes:,} bytes of RAM, {header.flash_bytes:,} bytes of constants")
        plugin = folder / "instruction_count.so"
        source = HERE / "instruction_count.c"
        subprocess.run(["gcc", "-O2", "-shared", "-fPIC", source, "-o", plugin], check=True)
        emulated = program(folder, "arm-linux-gnueabihf-gcc", "-mthumb", "-static")
        emulator = ("qemu-arm", "-plugin", plugin, emulated)
        counts = []
        for n_steps in COUNTED:
            said, counted = output(*emulator, n_steps, 3)
            if said != output(native, n_steps, 3)[0]:
                raise SystemExit(f"after {n_steps} steps the emulated chip differs: {said}")
            _, counted = output(*emulator, n_steps, 0)
            counts.append(int(re.search(r"instructions (\d+)", counted)[1]))
        a_step = (counts[1] - counts[0]) / (COUNTED[1] - COUNTED[0])
        print(f"{a_step:,.0f} instructions a step")
        for megahertz in (48, 100, 600):
            seconds = a_step * given.steps / megahertz / 1e6
            print(f"at {megahertz} MHz and one instruction a cycle: {seconds:.0f} s in all")


if __name__ == "__main__":
    main()
