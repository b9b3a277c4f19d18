"""Cells (a name, and a function that returns a fault) about lives of agents in random spaces.

In a life, an agent is trained, saved and loaded; the agent and its loaded copy continue alike.
"""

import re
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np

from sdnn.agents import (
    ActorCriticConfig,
    FuzzyQLearning,
    FuzzyQLearningConfig,
    QLambdaConfig,
    QLearningConfig,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
    evaluate,
    learn_from,
    load_agent,
)
from sdnn.approximators import FuzzyRulesConfig, LinearSDNNConfig, RBFNetworkConfig, SDNNCConfig

AGENTS = (SDNNQLambda, SDNNActorCritic, SDNNQLearning, RBFQLearning, FuzzyQLearning)
INF = np.inf
SINGLE_INPUTS = {
    "bounded": gym.spaces.Box(-1.0, 1.0, (1,)),
    "unbounded": gym.spaces.Box(-INF, INF, (1,)),
    "half bounded": gym.spaces.Box(0.0, INF, (1,)),
    "angle": gym.spaces.Box(-1.0, 1.0, (2,)),
    "symbol": gym.spaces.Discrete(3),
    "one symbol": gym.spaces.Discrete(1),
    "binary": gym.spaces.MultiBinary(1),
    "Dict": gym.spaces.Dict({"x": gym.spaces.Box(-INF, INF, (1,), np.float64)}),
}
REWARDS = (0.0, 1.0, -1.0, 1e-3, 1e12, 1e30, -1e300, 1e300, 5e-324, -5e-324)


class Walk(gym.Env):
    """Random walks in any space; a share ``lost`` of the numbers that it observes is missing."""

    def __init__(
        self, space, actions, seed, *, has_angle=False, has_glitches=False, lost=0.0, durations=()
    ):
        self.observation_space, self.action_space = space, actions
        self.random, self.n, self.has_angle = np.random.default_rng(seed), 0, has_angle
        self.has_glitches, self.lost, self.x = has_glitches, lost, 0.0
        self.durations, self.metadata = durations, {"durations": bool(durations)}

    def _observe(self, space):
        if isinstance(space, gym.spaces.Dict):
            return {name: self._observe(part) for name, part in space.spaces.items()}
        if isinstance(space, gym.spaces.Tuple):
            return tuple(self._observe(part) for part in space)
        return self._with_lost(self._values(space))

    def _with_lost(self, values):
        """Mark some numbers as missing, by a mask or by values that are not finite."""
        if self.lost == 0.0:
            return values
        is_lost = self.random.random(np.shape(values)) < self.lost
        if self.random.random() < 0.5:
            return np.ma.array(values, mask=is_lost)
        marked = np.where(is_lost, self.random.choice([np.nan, INF, -INF]), values)
        return marked if is_lost.any() else values

    def _values(self, space):
        if not isinstance(space, gym.spaces.Box):
            space.seed(int(self.random.integers(2**31)))
            return space.sample()
        values = self.random.normal(size=space.shape) * self.random.choice([0.01, 1.0, 100.0])
        values[:1] = self.x
        if self.has_angle:
            values[:2] = np.cos(self.x), np.sin(self.x)
        values[2:4] = 0.5  # constants
        return np.clip(values, space.low, space.high).astype(space.dtype)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        if seed is not None:
            self.random = np.random.default_rng(seed)
        self.n, self.x = 0, self.random.uniform(-1, 1)
        return self._observe(self.observation_space), {}

    def step(self, action):
        self.n += 1
        self.x += 0.1 * (float(np.ravel(action)[0]) - 0.5)
        reward = -abs(self.x)
        if self.has_glitches and self.random.random() < 0.05:
            reward = self.random.choice(REWARDS)
        is_over = self.random.random() < 0.05
        info = {"dt": self.durations[self.n % len(self.durations)]} if self.durations else {}
        return self._observe(self.observation_space), float(reward), is_over, self.n >= 30, info


def random_space(random):
    """Return a space of 1 to 40 variables, and whether it begins with an angle."""
    name = random.choice(["Box", "Box", "Box", "Discrete", "MultiBinary", "Dict", "Tuple"])
    n = int(random.choice([1, 2, 3, 4, 6, 10, 40]))
    low = np.where(random.random(n) < 0.5, -INF, -random.uniform(0.1, 3.0, n))
    high = np.where(random.random(n) < 0.5, INF, random.uniform(0.1, 3.0, n))
    has_angle = bool(n > 1 and random.random() < 0.4)
    if has_angle:
        low[:2], high[:2] = -1.0, 1.0
    dtype = random.choice([np.float32, np.float64])
    box = gym.spaces.Box(low.astype(dtype), high.astype(dtype), dtype=dtype)
    others = {
        "Discrete": gym.spaces.Discrete(n, start=int(random.integers(-2, 3))),
        "MultiBinary": gym.spaces.MultiBinary(n),
        "Dict": gym.spaces.Dict({"a": gym.spaces.Discrete(3), "b": box}),
        "Tuple": gym.spaces.Tuple([box, gym.spaces.MultiDiscrete([2, 3])]),
    }
    return others.get(name, box), has_angle and name == "Box"


def random_actions(random, agent_class):
    box = gym.spaces.Box(-1.0, 1.0, (int(random.integers(1, 3)),))
    several = gym.spaces.MultiDiscrete([2, 3])
    spaces = [box] if agent_class is FuzzyQLearning else [box, gym.spaces.Discrete(3), several]
    return spaces[random.integers(len(spaces))]


def random_settings(random, agent_class):
    """Return small networks and settings that matter for the kinds of inputs."""
    averaging_interval = int(random.choice([0, 5, 100]))
    common = {
        "observation_range": random.choice([None, "adaptive"]),
        "warm_up_steps": int(random.choice([2, 50, 120, 200])),
    }
    if agent_class is SDNNQLambda:
        learning = QLambdaConfig(
            discount=float(random.choice([0.0, 0.9, 0.99, 1.0])),
            bootstrap=str(random.choice(["sarsa", "q_learning"])),
            traces=str(random.choice(["dutch", "replacing"])),
            tie_tolerance=float(random.choice([0.0, 0.5])),
        )
        config = LinearSDNNConfig(
            n_pattern_units=int(random.choice([16, 40])), averaging_interval=averaging_interval,
            max_pairs=int(random.choice([0, 0, 6])), n_actions=int(random.choice([3, 5])),
        )  # fmt: skip
    elif agent_class is SDNNActorCritic:
        common["observation_range"] = random.choice([None, "adaptive", "running"])
        learning = ActorCriticConfig(
            discount=float(random.choice([0.0, 0.9, 1.0])),
            entropy=float(random.choice([0.0, 1.0])),
            thermometers=bool(random.choice([False, True])),
        )
        config = LinearSDNNConfig(n_pattern_units=16, n_actions=int(random.choice([1, 5])))
    elif agent_class is SDNNQLearning:
        learning = QLearningConfig(n_steps=int(random.choice([1, 4])))
        config = SDNNCConfig(
            n_pattern_units=16, n_hidden_units=40, n_active_units=10, n_actions=4,
            averaging_interval=averaging_interval, max_pairs=int(random.choice([0, 6])),
        )  # fmt: skip
    elif agent_class is RBFQLearning:
        return common | {
            "approximator": RBFNetworkConfig(n_bases=3, n_actions=3),
            "learning": QLearningConfig(),
        }
    else:
        return common | {
            "approximator": FuzzyRulesConfig(n_sets=3, n_actions=3),
            "learning": FuzzyQLearningConfig(),
        }
    return common | {
        "approximator": config, "learning": learning,
        "angle_pairs": str(random.choice(["find", "none"])),
        "inputs": str(random.choice(["relevant", "relevant", "all"])),
    }  # fmt: skip


def live(agent, env, warm_up_steps, n_steps):
    """Train an agent in three parts and its loaded copy likewise; return a fault, or ""."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of rewards, ranges and long episodes
        for n in (warm_up_steps // 2 + 1, warm_up_steps, n_steps):
            agent.save("agent.safetensors")
            loaded = load_agent("agent.safetensors")
            for learner in (agent, loaded):
                learner.train(env, steps=n, seed=n)
            agent.save("agent.safetensors")
            loaded.save("loaded.safetensors")
            if Path("agent.safetensors").read_bytes() != Path("loaded.safetensors").read_bytes():
                return "files of an agent and of the loaded one differ"
    if agent._controller.is_warming_up:
        return "the warm-up does not end"
    state = agent._controller.state().items()
    learned = (values for name, values in state if not re.search("^readings|observations?$", name))
    numbers = [values for values in learned if values.dtype.kind == "f"]
    return "" if all(np.isfinite(values).all() for values in numbers) else "values are not finite"


def single_input_cells():
    """Yield cells: every agent learns from a single variable, angle or symbol."""
    for agent_class in AGENTS:
        for name, space in SINGLE_INPUTS.items():
            yield f"{agent_class.__name__} of {name}", _single_cell(agent_class, name, space)


def _single_cell(agent_class, name, space):
    def run():
        random = np.random.default_rng(0)
        actions = random_actions(random, agent_class)
        env = Walk(space, actions, 1, has_angle=name == "angle")
        settings = random_settings(random, agent_class)
        agent = agent_class(space, actions, seed=1, **settings)
        return live(agent, env, settings["warm_up_steps"], 500)

    return run


ENTRIES = {
    "act": lambda agent, x, y, env: agent.act(x),
    "greedy act": lambda agent, x, y, env: agent.act(x, explore=False),
    "predict": lambda agent, x, y, env: agent.predict(x),
    "values": lambda agent, x, y, env: (
        agent.q_values if hasattr(agent, "q_values") else agent.value
    )(x),
    "learn": lambda agent, x, y, env: agent.learn(Transition(x, agent.act(x), 1.0, y, False)),
    "learn next": lambda agent, x, y, env: agent.learn(Transition(y, agent.act(y), 1.0, x, False)),
    "evaluate": lambda agent, x, y, env: evaluate(agent, env, 1),
    "train": lambda agent, x, y, env: agent.train(env, 300),
    "vector": lambda agent, x, y, env: agent.train(
        gym.vector.SyncVectorEnv(
            [lambda: env, lambda: Walk(env.observation_space, env.action_space, 2, lost=0.3)]
        ),
        300,
    ),
    "log": lambda agent, x, y, env: learn_from(agent, [Transition(y, agent.act(y), 1.0, x, True)]),
}


def missing_reading_cells():
    """Yield cells: wherever observations enter, missing numbers are refused, held or coded."""
    for agent_class in AGENTS:
        coded = agent_class in (SDNNQLambda, SDNNActorCritic, SDNNQLearning)
        for missing in ("error", "hold", "code") if coded else ("error", "hold"):
            for name in ("bounded", "unbounded", "angle", "symbol", "Dict"):
                for entry in ENTRIES if agent_class is not FuzzyQLearning else [*ENTRIES][:-1]:
                    label = f"{agent_class.__name__} {missing} {name} {entry}"
                    yield label, _missing_cell(agent_class, missing, SINGLE_INPUTS[name], entry)


def _missing_cell(agent_class, missing, space, entry):
    def run():
        random = np.random.default_rng(0)
        actions = random_actions(random, agent_class)
        env, all_lost = (Walk(space, actions, 1, lost=share) for share in (0.3, 1.0))
        settings = random_settings(random, agent_class) | {"warm_up_steps": 2, "missing": missing}
        agent = agent_class(space, actions, seed=1, **settings)
        if entry in ("values", "log"):
            agent.train(Walk(space, actions, 1), 50)
        missing_observation, _ = all_lost.reset(seed=1)
        observation, _ = Walk(space, actions, 1).reset()
        try:
            ENTRIES[entry](agent, missing_observation, observation, env)
        except ValueError as error:
            return "" if missing == "error" and "missing='hold'" in str(error) else str(error)
        return "not refused" if missing == "error" else ""

    return run


HISTORIES = ["none", "none", "auto", "auto", "differences", "averages", "observer"]


def soak_cells(first, n):
    """Yield cells of the random lives with the numbers ``first`` to ``first + n - 1``."""
    for number in range(first, first + n):
        yield f"life {number}", _soak_cell(number)


def _soak_cell(number):
    def run():
        random = np.random.default_rng(number)
        agent_class = AGENTS[random.choice(5, p=[0.5, 0.15, 0.15, 0.1, 0.1])]
        space, has_angle = random_space(random)
        if agent_class in (RBFQLearning, FuzzyQLearning) and gym.spaces.flatdim(space) > 4:
            agent_class = SDNNQLambda
        actions = random_actions(random, agent_class)
        options = {"has_angle": has_angle, "has_glitches": bool(random.random() < 0.3)}
        if number % 3 == 0:
            options["durations"] = (1, 0.3, 1, 7.5, 1e6, 0.001)
        n_environments = int(random.choice([1, 1, 1, 3]))
        envs = [Walk(space, actions, number + i, **options) for i in range(n_environments)]
        settings = random_settings(random, agent_class)
        modes = ["error", "hold"] + ["code"] * (agent_class in (SDNNQLambda, SDNNQLearning))
        settings["missing"] = str(random.choice(modes))
        for env in envs:
            env.lost = 0.0 if settings["missing"] == "error" else float(random.choice([0.1, 0.6]))
        env = envs[0]
        if n_environments > 1:
            env = gym.vector.SyncVectorEnv([lambda single=single: single for single in envs])
        n_steps = int(random.choice([300, 900, 3000], p=[0.5, 0.45, 0.05]))
        if settings["missing"] != "code":
            is_grid = agent_class in (RBFQLearning, FuzzyQLearning)  # with few inputs
            histories = ["none", "observer"] if is_grid else HISTORIES
            settings["history"] = str(random.choice(histories))
        try:
            agent = agent_class(space, actions, seed=number, **settings)
        except ValueError as error:  # such as an observer after too short a warm-up
            if not str(error).startswith("history must be"):
                raise
            settings["history"] = "none"
            agent = agent_class(space, actions, seed=number, **settings)
        return live(agent, env, settings["warm_up_steps"], n_steps)

    return run
