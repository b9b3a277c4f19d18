"""How long a decision takes in Python: acting and learning, without the environment.

    python bench/other_tasks/decision_time.py [--tasks Pendulum,CartPole] [--steps 20000]

Both calls are timed alone, as a robot's own loop would make them, with default settings. A
plain loop over the clock is timed beside them and taken off. The environment's steps are timed
between them: they bound what a quicker agent could gain.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from sdnn.agents import Transition
from sdnn.runs.study import Study

NANOSECONDS_A_MICROSECOND = 1000.0


def decision_times(name: str, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Microseconds of each step's acting and learning, and of the environment: shapes (steps,)."""
    spec = Study(Path(__file__).with_name("study.toml")).combinations[name, "sdnn-c"].spec
    env = spec.make_env()
    agent = spec.make_agent(env)
    clock = time.perf_counter_ns
    decisions = np.empty(steps)
    environment_steps = np.empty(steps)
    observation, _ = env.reset(seed=0)
    agent.begin_episode()
    for step in range(steps):
        began = clock()
        action = agent.act(observation)
        acted = clock()
        next_observation, reward, terminated, truncated, _ = env.step(action)
        stepped = clock()
        agent.learn(Transition(observation, action, float(reward), next_observation, terminated))
        learned = clock()
        decisions[step] = (acted - began) + (learned - stepped)
        environment_steps[step] = stepped - acted
        observation = next_observation
        if terminated or truncated:
            observation, _ = env.reset()
            agent.begin_episode()
    between = np.median([-(clock() - clock()) for _ in range(10_000)])
    return (
        (decisions - 2 * between) / NANOSECONDS_A_MICROSECOND,
        (environment_steps - between) / NANOSECONDS_A_MICROSECOND,
    )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tasks", default="Pendulum,MountainCarContinuous,CartPole,Acrobot")
    parser.add_argument("--steps", type=int, default=20_000)
    options = parser.parse_args()
    print("| task | decisions | p25 | median | p75 | p99 | the environment's step, median |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in options.tasks.split(","):
        decisions, environment_steps = decision_times(name, options.steps)
        times = [*np.percentile(decisions, (25, 50, 75, 99)), np.median(environment_steps)]
        cells = " | ".join(f"{us:.1f} us" for us in times)
        print(f"| {name} | {decisions.size:,} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
