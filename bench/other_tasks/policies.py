"""Which policy of a training to keep: the final one, the best block's, or an average.

    python bench/other_tasks/policies.py [--seeds 10] [--only Hopper ...] [--redraw]

Trains each agent once for a task and seed, then compares greedy returns of the policies that the
training went through, and of trainings with other settings. Seeds begin at 1000, so that what is
chosen here is reported by other seeds. The table is put into benchmarks.md. Needs
`gymnasium[mujoco]`.
"""

from __future__ import annotations

import copy
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import gymnasium as gym
import numpy as np
from measured import measure_missing, measured, options
from page import markdown, show
from report import number

from sdnn.agents import Callback, SDNNActorCritic, SDNNQLambda, evaluate
from sdnn.config import ActorCriticConfig
from sdnn.training.files import EpisodeBlock

KIND = "policies"
FIRST_SEED, STEPS, N_EPISODES = 1000, 200_000, 20
BLOCKS = (10, 30)
AVERAGED_EVERY = 1_000
TASKS = {
    "Reacher": ("Reacher-v5", SDNNActorCritic),
    "Hopper": ("Hopper-v5", SDNNActorCritic),
    "HalfCheetah": ("HalfCheetah-v5", SDNNActorCritic),
    "Pendulum": ("Pendulum-v1", SDNNActorCritic),
    "Pendulum, SDNNQLambda": ("Pendulum-v1", SDNNQLambda),
    "CartPole, SDNNQLambda": ("CartPole-v1", SDNNQLambda),
}
SETTINGS = {
    "default": {},
    "falling": {"final_learning_rate": 0.003, "final_actor_learning_rate": 0.002},
}
"""With "falling", both steps approach a tenth of the default's final ones, nearly as 1 / t."""
WAYS = {
    "final": "the final one",
    "kept 10": "kept, best block of 10 episodes",
    "kept 30": "kept, best block of 30 episodes",
    "average 20,000": "average of the weights, last 20,000 steps",
    "average 100,000": "average of the weights, last 100,000 steps",
    "mode": "final, greedy by the most probable bin",
    "mean": "final, greedy by the mean of all bins",
    "falling": "final, rates that approach a tenth of the final ones",
}


class Policies(Callback):
    """Keeps the state after the best blocks of episodes, and averages the actor's weights."""

    step_interval = AVERAGED_EVERY

    def __init__(self, agent) -> None:
        self._averages = isinstance(agent, SDNNActorCritic)
        self._blocks = {n: EpisodeBlock(n) for n in BLOCKS}
        self.kept, self._sums = {}, {}

    def on_row(self, training, row) -> None:
        """Keep the policy at the end of a block that is the best so far."""
        for n, block in self._blocks.items():
            if row["kind"] == "episode" and block.ends_best(row["return"]):
                self.kept[f"kept {n}"] = training.agent._state_of("agent")

    def on_step(self, training) -> None:
        """Add the weights to the averages over the last steps."""
        for n in (100_000, 20_000) if self._averages else ():
            if STEPS - n < training.n_steps:
                weights = training.agent._state_of("agent")["actor.weights"].astype(np.int64)
                total, count = self._sums.get(n, (0, 0))
                self._sums[n] = total + weights, count + 1

    def policies(self, agent):
        """Return the agents by name."""
        states = {"final": agent._state_of("agent"), **self.kept}
        for n, (total, count) in self._sums.items():
            weights = np.rint(total / count).astype(np.int32)
            states[f"average {n:,}"] = states["final"] | {"actor.weights": weights}
        for name, state in states.items():
            policy = copy.copy(agent)
            policy._restore(agent=state)
            yield name, policy


class OtherGreedy:
    """An actor-critic that acts by the mode or the mean of all bins."""

    def __init__(self, agent, way: str) -> None:
        self._agent, self._way = agent, way
        self._low, self._high = agent.action_space.low, agent.action_space.high

    def act(self, observation, explore=True):
        """Return an action."""
        parts = []
        for d in range(self._agent.n_dimensions):
            chances = self._agent.action_probabilities(observation, d)
            places = np.linspace(0, 1, len(chances))
            is_mode = self._way == "mode"
            parts.append(places[chances.argmax()] if is_mode else places @ chances)
        return (self._low + np.array(parts) * (self._high - self._low)).astype(np.float32)


def measure(task: str, settings: str, seed: int) -> dict[str, float]:
    """Train; return mean returns of the policies."""
    env_id, agent_class = TASKS[task]
    env = gym.make(env_id)
    learning = {}
    if agent_class is SDNNActorCritic:
        learning = {"learning": ActorCriticConfig(**SETTINGS[settings])}
    agent = agent_class(env, seed=seed, history="none", **learning)
    policies = Policies(agent)
    agent.train(env, steps=STEPS, seed=seed, callbacks=[policies], progress=False)
    results = {}
    for name, policy in policies.policies(agent):
        returns = evaluate(policy, env, N_EPISODES, seed=seed).returns
        results[name] = float(returns.mean())
    if agent_class is SDNNActorCritic and settings == "default":
        for way in ("mode", "mean"):
            returns = evaluate(OtherGreedy(agent, way), env, N_EPISODES, seed=seed).returns
            results[way] = float(returns.mean())
    return results


def table(results) -> str:
    """Return medians and ranges of each policy, and in how many seeds it beats the final one."""
    returns: dict[tuple[str, str], dict[int, float]] = {}
    for (task, settings, seed), policies in results.items():
        for name, value in policies.items():
            if name in WAYS and (settings == "default" or name == "final"):
                way = name if settings == "default" else settings
                returns.setdefault((task, way), {})[seed] = value
    tasks = [task for task in TASKS if (task, "final") in returns]
    rows = []
    for way, title in WAYS.items():
        cells = []
        for task in tasks:
            values, final = returns.get((task, way), {}), returns[task, "final"]
            cell = ""
            if values:
                median, low, high = (
                    number(f(list(values.values()))) for f in (np.median, min, max)
                )
                cell = f"{median} ({low} to {high})"
                if way != "final":
                    better = [value > final.get(seed, np.inf) for seed, value in values.items()]
                    cell += f", {sum(better)} of {len(better)}"
            cells.append(cell)
        rows.append((title, *cells))
    titles = (f"{task} ({len(returns[task, 'final'])} seeds)" for task in tasks)
    return markdown(("policy", *titles), rows)


def main() -> None:
    """Measure what is missing, then draw the table."""
    arguments = options(__doc__ or "", seeds=10).parse_args()
    seeds = range(FIRST_SEED, FIRST_SEED + arguments.seeds)
    keys = [
        (task, settings, seed)
        for seed in seeds
        for settings in SETTINGS
        for task, (_, agent_class) in TASKS.items()
        if settings == "default" or agent_class is SDNNActorCritic
    ]
    measure_missing(KIND, measure, keys, arguments, apart=True)
    results = measured(KIND, arguments.folder)
    show({"policies": table(results)}, arguments.folder / "benchmarks.md")


if __name__ == "__main__":
    main()
