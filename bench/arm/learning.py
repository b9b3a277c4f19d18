"""Lets an agent learn a task from nothing, in C and fixed point, on an emulated Arm.

Prints the mean return of 100 greedy episodes after training, for each seed, and what a processor
needs: memory, flash and the Thumb-2 instructions of a step of acting, learning and physics. Seeds
are trained natively, or with --emulate in the emulator. Counts are exact; of time an emulator says
nothing. Needs Debian's compilers and an emulator: apt install gcc gcc-arm-linux-gnueabihf
qemu-user.

usage: python bench/arm/learning.py [cartpole|pendulum|wheel] [--agent sdnn-c] [--ram BYTES]
       [--keep EPISODES | --keep-block EPISODES] [--starts SEED] [--widen SENSOR] [--emulate]
"""

import argparse
import dataclasses
import math
import re
import subprocess
import tempfile
from pathlib import Path

import gymnasium as gym
import numpy as np

from sdnn.approximators import LinearSDNNConfig
from sdnn.export import export_c_header, new_agent

HERE = Path(__file__).parent
EPISODES = 100
COUNTED = (2000, 4000)
"""Steps of two runs whose instructions are compared."""
AGENTS = ("q-lambda", "actor-critic", "sdnn-c")
ARM = "arm-linux-gnueabihf-gcc"
CHIP = ("-mthumb", "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")


@dataclasses.dataclass(frozen=True)
class Task:
    """The ranges of a task's sensors, and its actions."""

    high: tuple[float, ...]
    actions: gym.Space
    approximator: LinearSDNNConfig
    n_steps: int
    solved: float
    angles: tuple[int, ...] = ()

    def agent(self, seed, kind, ram_bytes=None):
        """Make the agent, which has learned nothing."""
        high = np.array(self.high)
        config = (
            self.approximator
            if ram_bytes is None
            else dataclasses.replace(self.approximator, n_pattern_units=0)
        )
        arguments = {"approximator": config} if kind == "q-lambda" else {}
        space = gym.spaces.Box(-high, high, dtype=np.float64)
        return new_agent(
            space,
            self.actions,
            kind=kind,
            ram_bytes=ram_bytes,
            angles=self.angles,
            seed=seed,
            **arguments,
        )


TASKS = {
    "cartpole": Task(
        (2.4, 3.0, 0.21, 3.5),
        gym.spaces.Discrete(2),
        LinearSDNNConfig(n_pattern_units=64),
        50_000,
        475.0,
    ),
    "pendulum": Task(
        (math.pi, 8.0),
        gym.spaces.Box(-2.0, 2.0, (1,)),
        LinearSDNNConfig(n_pattern_units=256, n_actions=3),
        100_000,
        -200.0,
        angles=(0,),
    ),
    "wheel": Task(
        (0.3, 1.0, 1.0),
        gym.spaces.Discrete(5),
        LinearSDNNConfig(n_pattern_units=48),
        50_000,
        475.0,
    ),
}


def program(path, task, compiler, *options):
    """Compile the header beside the path with the physics."""
    folder = path.parent
    command = [compiler, "-std=c99", "-O2", *options, f"-I{folder}", HERE / f"{task}.c"]
    subprocess.run([*command, "-o", path], check=True)
    return path


def output(*command):
    """Return the output of a program, and that of its emulator."""
    command_words = [str(word) for word in command]
    done = subprocess.run(command_words, capture_output=True, text=True, check=True)
    return done.stdout.strip(), done.stderr


def sizes(folder, task, *more):
    """Return bytes of flash, of static memory and of all functions' stacks, with the physics."""
    options = ("-Os", "-fno-pie", "-fstack-usage", "-c", *CHIP, *more)
    path = program(folder / "chip.o", task, ARM, *options)
    text, data, bss = map(int, output("size", path)[0].splitlines()[1].split()[:3])
    usage = next(folder.glob("*.su")).read_text().splitlines()
    return text + data, data + bss, sum(int(line.split("\t")[1]) for line in usage)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("task", nargs="?", choices=TASKS, default="cartpole")
    parser.add_argument("--agent", choices=AGENTS, default="q-lambda")
    parser.add_argument("--ram", type=int, help="Bytes that the agent may take.")
    keeping = parser.add_mutually_exclusive_group()
    keeping.add_argument(
        "--keep",
        type=int,
        help="Keep the best policy, measured by this number of greedy episodes each 2,000 steps.",
    )
    keeping.add_argument(
        "--keep-block", type=int, help="Keep the best policy by blocks of learned episodes."
    )
    parser.add_argument(
        "--starts", type=int, default=1, help="Seed of the states in which episodes begin."
    )
    parser.add_argument("--widen", type=int, help="A sensor whose range is twice as wide.")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--emulate", action="store_true", help="Train in the emulator.")
    arguments = parser.parse_args()
    name, task, kind = arguments.task, TASKS[arguments.task], arguments.agent
    options = [f"-DSTART={arguments.starts}"]
    if kind == "sdnn-c":
        options.append("-DFOLLOWS_PROGRESS")
    if arguments.keep or arguments.keep_block:
        options.append(f"-DKEEP_EPISODES={arguments.keep or 0}")
        options.append(f"-DKEEP_BLOCK={arguments.keep_block or 1}")
    if arguments.widen is not None:
        high = [(1 + (i == arguments.widen)) * end for i, end in enumerate(task.high)]
        task = dataclasses.replace(task, high=tuple(high))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        plugin = folder / "instruction_count.so"
        source = HERE / "instruction_count.c"
        subprocess.run(["gcc", "-O2", "-shared", "-fPIC", source, "-o", plugin], check=True)
        returns = []
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            agent = task.agent(seed, kind, arguments.ram)
            header = export_c_header(agent, folder / "pole.h", learning=True)
            native = [program(folder / "native", name, "gcc", *options)]
            is_last = seed == arguments.first_seed + arguments.seeds - 1
            if arguments.emulate or is_last:
                emulated = program(folder / "emulated", name, ARM, "-mthumb", "-static", *options)
            runner = ["qemu-arm", emulated] if arguments.emulate else native
            returns.append(float(output(*runner, task.n_steps, EPISODES)[0]))
            print(f"seed {seed}: {returns[-1]:.1f}", flush=True)
        n_solved = sum(score >= task.solved for score in returns)
        print(f"{n_solved} of {arguments.seeds} reach {task.solved:g} after {task.n_steps:,} steps")
        print(f"{header.ram_bytes:,} bytes of memory, {header.flash_bytes:,} bytes of constants")
        flash, static, stacks = sizes(folder, name, *options)
        print(
            f"with the physics, -Os for Cortex-M4: {flash:,} bytes of flash, {static:,} bytes of"
            f" static memory; the stacks of all functions together are {stacks:,} bytes"
        )
        emulator = ("qemu-arm", "-plugin", plugin, emulated)
        counts = []
        for n_steps in COUNTED:
            emulated_return, _ = output(*emulator, n_steps, 3)
            if emulated_return != output(*native, n_steps, 3)[0]:
                raise SystemExit(
                    f"after {n_steps} steps the emulated chip differs: {emulated_return}"
                )
            _, plugin_report = output(*emulator, n_steps, 0)
            counts.append(int(re.search(r"instructions (\d+)", plugin_report)[1]))
        a_step = (counts[1] - counts[0]) / (COUNTED[1] - COUNTED[0])
        print(f"{a_step:,.0f} instructions a step")
        for megahertz in (48, 100, 600):
            seconds = a_step * task.n_steps / megahertz / 1e6
            print(f"at {megahertz} MHz and one instruction a cycle: {seconds:.0f} s in all")


if __name__ == "__main__":
    main()
