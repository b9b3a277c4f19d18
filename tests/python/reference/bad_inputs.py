"""Cells of bad inputs of agents, made from signatures and fields.

See bad_values.py for what a cell checks. A new parameter gets cells by itself; a required one needs
a good value in `good_arguments`. A refused value must not change the agent.
"""

import dataclasses
import inspect
import tempfile
from functools import partial
from pathlib import Path

import gymnasium as gym
import numpy as np

import sdnn.agents as agents
from bad_values import BAD, EnoughError, bad_cells, judged, parameters_of
from sdnn.agents import (
    FuzzyQLearning,
    FuzzyQLearningConfig,
    QLambdaConfig,
    QLearningConfig,
    RBFQLearning,
    SDNNQLambda,
    SDNNQLearning,
    Training,
    Transition,
    load_agent,
)
from sdnn.approximators import FuzzyRulesConfig, LinearSDNNConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.support.files import read_file, write_file

SPACES = {
    "Text": lambda: gym.spaces.Text(3),
    "Sequence": lambda: gym.spaces.Sequence(gym.spaces.Discrete(2)),
    "Graph": lambda: gym.spaces.Graph(gym.spaces.Box(0, 1, (2,)), None),
    "empty Dict": lambda: gym.spaces.Dict({}),
    "empty Tuple": lambda: gym.spaces.Tuple(()),
    "Dict of Text": lambda: gym.spaces.Dict({"a": gym.spaces.Text(3)}),
    "Box without variables": lambda: gym.spaces.Box(0, 1, (0,)),
    "Box of one value": lambda: gym.spaces.Box(1, 1, (2,)),
    "Box without bounds": lambda: gym.spaces.Box(-np.inf, np.inf, (2,)),
    "Box with one bound": lambda: gym.spaces.Box(0, np.inf, (2,)),
    "Box to 1e308": lambda: gym.spaces.Box(-1e308, 1e308, (1,), np.float64),
    "Box of half 1e308": lambda: gym.spaces.Box(-8e307, 8e307, (1,), np.float64),
    "Box of a tiny range": lambda: gym.spaces.Box(0.0, 5e-324, (1,), np.float64),
    "Box of float16": lambda: gym.spaces.Box(-6e4, 6e4, (1,), np.float16),
    "Box of float32": lambda: gym.spaces.Box(-3.4e38, 3.4e38, (1,), np.float32),
    "Box of int64": lambda: gym.spaces.Box(-(2**63), 2**63 - 1, (1,), np.int64),
    "Box of uint64": lambda: gym.spaces.Box(0, 2**64 - 1, (1,), np.uint64),
    "Box of uint8": lambda: gym.spaces.Box(0, 255, (2,), np.uint8),
    "Box of bool": lambda: gym.spaces.Box(0, 1, (2,), np.bool_),
    "Box of no dimension": lambda: gym.spaces.Box(0, 1, ()),
    "Box of 2**20 variables": lambda: gym.spaces.Box(0, 1, (2**20,)),
    "Box of 64 variables": lambda: gym.spaces.Box(0, 1, (64,)),
    "Box of 1000 variables": lambda: gym.spaces.Box(0, 1, (1000,)),
    "Discrete(1)": lambda: gym.spaces.Discrete(1),
    "Discrete(2**40)": lambda: gym.spaces.Discrete(2**40),
    "Discrete from 2**62": lambda: gym.spaces.Discrete(3, start=2**62),
    "Discrete to 2**63": lambda: gym.spaces.Discrete(3, start=2**63 - 3),
    "MultiDiscrete of 2**40": lambda: gym.spaces.MultiDiscrete([3, 2**40]),
    "MultiDiscrete from 2**62": lambda: gym.spaces.MultiDiscrete([3, 2], start=[2**62, 0]),
    "MultiBinary(2**20)": lambda: gym.spaces.MultiBinary(2**20),
    "MultiBinary(2, 3)": lambda: gym.spaces.MultiBinary((2, 3)),
}  # fmt: skip

JSON = {
    "NaN": np.nan, "-1": -1, "2**40": 2**40, "2**70": 2**70, "1e308": 1e308, "text": "abc",
    "null": None, "true": True, "lists": [[]],
}  # fmt: skip

PLANE = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
UNBOUNDED = gym.spaces.Box(-np.inf, np.inf, (2,), np.float64)
TORQUE = gym.spaces.Box(-2.0, 2.0, (1,), np.float64)
TORQUES = gym.spaces.Box(-2.0, 2.0, (2,), np.float64)

SETTINGS = {
    SDNNQLearning: (
        SDNNCConfig(
            n_pattern_units=20,
            n_anchor_patterns=4,
            n_interpolated=6,
            n_hidden_units=60,
            n_active_units=20,
            n_actions=5,
        ),
        QLearningConfig(n_steps=2, value_range="adaptive", n_greedy_steps=0),
    ),
    SDNNQLambda: (
        LinearSDNNConfig(n_pattern_units=20, n_anchor_patterns=4, n_interpolated=6),
        QLambdaConfig(schedule_steps=20),
    ),
    RBFQLearning: (RBFNetworkConfig(n_actions=5), QLearningConfig(n_greedy_steps=0)),
    FuzzyQLearning: (
        FuzzyRulesConfig(n_sets=4, n_actions=5),
        FuzzyQLearningConfig(trace_decay=0.5, n_greedy_steps=0),
    ),
}
"""Small approximators and rules of learning, by the class of agents."""

CASES = {
    "": {},
    ", vector": {"action_space": TORQUES},
    ", warm-up": {"observation_space": UNBOUNDED, "warm_up_steps": 30},
}
"""Arguments of agents beside the usual ones, by the end of the name of an agent."""
AGENT_CASES = [agent_class.__name__ + case for agent_class in SETTINGS for case in CASES]
"""Names of agents of all classes and cases, such as "SDNNQLambda, vector"."""

HERE = [0.1, 0.2]
"""A good observation."""

MOST_STEPS = 40
"""Steps of an environment after which a training that a bad value makes long is ended."""


class Slope(gym.Env):
    """Task of holding a position; raises `EnoughError` after a number of steps."""

    observation_space = PLANE

    def __init__(self, action_space, most_steps=10**9):
        self.action_space = action_space
        self._n_left = most_steps

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._n = 0
        return np.array(HERE), {}

    def step(self, action):
        self._n_left -= 1
        if self._n_left < 0:
            raise EnoughError
        self._n += 1
        at = np.clip(np.array(HERE) + 0.1 * np.asarray(action).sum(), -1.0, 1.0)
        return at, float(-abs(at[0])), False, self._n >= 7, {}


def make_agent(agent_case, **options):
    """Return a small agent with a name of `AGENT_CASES`; ``options`` are further arguments."""
    name, comma, case = agent_case.partition(",")
    agent_class = getattr(agents, name)
    approximator, learning = SETTINGS[agent_class]
    settings = {"observation_space": PLANE, "action_space": TORQUE, "seed": 3}
    settings |= {"approximator": approximator, "learning": learning}
    if (
        agent_class is SDNNQLambda and "warm_up_steps" not in CASES[comma + case]
    ):  # no warm-up by default
        settings |= {"inputs": "all", "angle_pairs": "none"}
    return agent_class(**settings | CASES[comma + case] | options)


def trained(agent, n_steps=7):
    """Train the agent for some steps, and keep its next action as ``agent.last``."""
    generator = np.random.default_rng(1)
    for _ in range(n_steps):
        action = agent.act(HERE)
        next_observation = generator.uniform(-1, 1, 2)
        agent.learn(Transition(HERE, action, float(generator.normal()), next_observation, False))
    agent.last = agent.act(HERE)
    return agent


def memory(agent):
    """Return the description of an agent and the bytes of its state, to compare them."""
    arrays = {name: (a.dtype.str, a.shape, a.tobytes()) for name, a in agent.state().items()}
    return repr(agent.description()), arrays


def agent_fault(agent):
    """Return what is wrong with an agent that was made or has learned, or ""."""
    observations = [sampled(agent.observation_space) for _ in range(36)]
    observation = observations[0]
    n_steps = 35 if agent.is_warming_up else 6
    for step in range(n_steps):
        action = agent.act(observation)
        if fault := action_fault(agent, action):
            return fault
        next_observation = observations[step + 1]
        agent.learn(
            Transition(observation, action, -0.5 * (step % 3), next_observation, step % 4 == 3)
        )
        observation = next_observation
    if fault := action_fault(agent, agent.act(observation, explore=False)):
        return fault
    return state_fault(agent)


def sampled(space):
    """Return a random element of a space."""
    try:
        with np.errstate(over="ignore"):
            return space.sample()
    except OverflowError:  # Gymnasium cannot sample the widest boxes
        return np.zeros(space.shape, space.dtype)


def action_fault(agent, action):
    """Return what is wrong with an action: NaN or infinite, or outside its space; or ""."""
    values = np.asarray(action, np.float64)
    is_in = agent.action_space.contains(action) or np.isscalar(action)
    return "" if np.isfinite(values).all() and is_in else f"chose {action!r}"


def state_fault(agent):
    """Return which array of an agent's state is not finite, or ""."""
    for name, array in agent.state().items():
        if name.startswith("warm_up."):  # observations, which may be infinite
            continue
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            return f"{name} is not finite"
    return ""


class ReusedAgent:
    """A trained agent that cells share until one of them is accepted, which may change it."""

    def __init__(self, agent_case):
        self._agent_case = agent_case
        self.forget()

    def forget(self):
        self._agent = None

    @property
    def agent(self):
        if self._agent is None:
            self._agent = trained(make_agent(self._agent_case))
            self._before = memory(self._agent)
        return self._agent

    @property
    def is_unchanged(self):
        return memory(self._agent) == self._before


# The rows of the matrix: functions that yield cells, each after functions that make their run().


def constructor_cells(name):
    cell = partial(_constructor_cell, name)
    for parameter in parameters_of(getattr(agents, name).__init__):
        values = BAD | SPACES if parameter.endswith("_space") else BAD
        yield from bad_cells(f"{name}({{}})", [parameter], cell, values)


def _constructor_cell(name, parameter, value):
    def call():
        return agent_fault(make_agent(name, **{parameter: value()}))

    return lambda: judged(parameter, call, value=value)


def setting_cells(name):
    """Yield cells of the settings of approximator and learning, for one action and for two."""
    for case in ("", ", vector"):
        for part, settings in zip(
            ("approximator", "learning"), SETTINGS[getattr(agents, name)], strict=True
        ):
            fields = [field.name for field in dataclasses.fields(settings)]
            cell = partial(_setting_cell, name + case, part, settings)
            yield from bad_cells(f"{name}{case}: {part}.{{}}", fields, cell)


def _setting_cell(agent_case, part, settings, field, value):
    def call():
        changed = dataclasses.replace(settings, **{field: value()})
        return agent_fault(make_agent(agent_case, **{part: changed}))

    return lambda: judged(field, call, value=value)


def transition_cells(agent_case):
    cell = partial(_transition_cell, ReusedAgent(agent_case))
    return bad_cells(f"{agent_case}.learn: {{}}", Transition._fields, cell)


def _transition_cell(reused, parameter, value):
    def run():
        agent = reused.agent
        good = Transition(HERE, agent.last, 1.0, [0.3, 0.4], False)

        def call():
            agent.learn(good._replace(**{parameter: value()}))
            return state_fault(agent) or agent_fault(agent)

        return judged(parameter, call, reused, value)

    return run


def method_cells(agent_case):
    """Yield cells of every public method and settable property of an agent."""
    reused = ReusedAgent(agent_case)
    for name, method in inspect.getmembers(type(reused.agent)):
        if name.startswith("_") or name == "rebuild":  # rebuild: see the cells of files
            continue
        if agent_case != AGENT_CASES[0] and name in (
            "train",
            "save",
            "load",
        ):  # equal for all kinds
            continue
        if isinstance(method, property) and method.fset is not None:
            parameters = [name]
        elif inspect.isfunction(method) or inspect.ismethod(method):
            parameters = parameters_of(method)
        else:
            continue
        cell = partial(_method_cell, reused, agent_case, name, parameters)
        yield from bad_cells(f"{agent_case}.{name}: {{}}", parameters, cell)


READERS = ("q_values", "value", "rule_values")


def _method_cell(reused, agent_case, name, parameters, parameter, value):
    def run():
        agent = reused.agent
        if ", warm-up" in agent_case and (name in READERS or name.startswith("plot_")):
            return ""  # an agent that is warming up has no values
        arguments = good_arguments(agent, parameters) | {parameter: value()}

        def call():
            if isinstance(getattr(type(agent), name), property):
                setattr(agent, name, arguments[parameter])
                return agent_fault(agent)
            return result_fault(agent, getattr(agent, name)(**arguments), arguments)

        return judged(parameter, call, reused, value)

    return run


def good_arguments(agent, parameters):
    """Return good arguments for these parameters; a new required parameter needs one here."""
    env = Slope(agent.action_space, MOST_STEPS)
    path = Path("agent").absolute()
    if "path" in parameters:
        agent.save(path)
    good = {
        "agent": agent,
        "env": env,
        "observation": HERE,
        "explore": False,
        "environment": 0,
        "mask": None,
        "action_masks": None,
        "n_environments": 1,
        "learning_rate": None,
        "scaling": None,
        "epsilon": None,
        "observation_space": agent.observation_space,
        "state": None,
        "episode_start": None,
        "deterministic": True,
        "transition": Transition(HERE, agent.last, 1.0, [0.3, 0.4], False),
        "dimension": 0,
        "rule": 0,
        "path": path,
        "folder": Path("events").absolute(),
        "steps": 5,
        "episodes": None,
        "seed": 3,
        "first_episode": 0,
        "callbacks": (),
        "progress": False,
        "evaluate_every": None,
        "evaluate_every_episodes": None,
        "limit_bootstraps": True,
        "options": None,
        "reset_options": None,
        "evaluation_env": Slope(agent.action_space, MOST_STEPS),
        "evaluation_episodes": 1,
        "every": 3,
        "mean_return": 5.0,
        "patience": 1,
        "repeat_episodes": True,
        "source": env,
        "inputs": None,
    }
    return {name: good[name] for name in parameters}


def result_fault(agent, result, arguments):
    """Return what is wrong with the result of an agent's method, or ""."""
    if isinstance(result, agents.Agent):
        return agent_fault(result)
    if "observation" in arguments and "explore" in arguments:  # act
        return action_fault(agent, result)
    if isinstance(result, agents.TrainingResult):
        return state_fault(agent) or ("" if np.isfinite(result.returns).all() else "returns")
    is_observation = np.array_equal(result, arguments.get("observation"))  # which may be NaN
    if isinstance(result, float | np.ndarray) and not is_observation:
        return "" if np.isfinite(result).all() else f"gave {result}"
    return state_fault(agent)


def loop_cells():
    """Yield cells of Training, its loading and saving, evaluate, load_agent and callbacks."""
    agent_case = "SDNNQLearning"
    callables = {
        "evaluate": agents.evaluate,
        "load_agent": agents.load_agent,
        "Training": Training,
        "Training.load": Training.load,
        "Training.save": Training.save,
        "CheckpointCallback": agents.CheckpointCallback,
        "StopTrainingOnRewardThreshold": agents.StopTrainingOnRewardThreshold,
        "JSONLines": agents.JSONLines,
    }
    for name, function in callables.items():
        parameters = parameters_of(function)
        cell = partial(_loop_cell, agent_case, name, function, parameters)
        yield from bad_cells(f"{name}({{}})", parameters, cell)


def _loop_cell(agent_case, name, function, parameters, parameter, value):
    def run():
        reused = ReusedAgent(agent_case)
        agent = reused.agent
        good = good_arguments(agent, parameters)
        env = Slope(agent.action_space)
        evaluations = {}
        if name == "StopTrainingOnRewardThreshold":  # compares evaluations
            evaluation_env = Slope(agent.action_space)
            evaluations = {"evaluate_every": 5, "evaluation_env": evaluation_env}
            evaluations["evaluation_episodes"] = 1
        training = Training(agent, env, steps=5, seed=3, **evaluations)
        if name == "evaluate":
            good["episodes"] = 2
        if name in ("Training.load", "Training.save"):
            training.run()
        if name == "Training.load":
            training.save(good["path"])
            good["steps"] = 9
        arguments = good | {parameter: value()}

        def call():
            if name == "Training.save":
                training.save(**arguments)
                return ""
            result = function(**arguments)
            if isinstance(result, Training):
                return "" if result.run().n_steps > 0 else "learned nothing"
            if isinstance(result, agents.Evaluation):
                return "" if np.isfinite(result.returns).all() else "returns"
            if isinstance(result, agents.Callback):
                training.callbacks = (result,)
                training.run()
            return ""

        return judged(parameter, call, reused if name == "evaluate" else None, value)

    return run


def file_cells(agent_case):
    """Yield cells of a training's file with a damaged value of its description or array."""
    agent = trained(make_agent(agent_case))
    env = Slope(agent.action_space)
    training = Training(agent, env, steps=45, seed=3)
    training.run()
    training.steps = 90
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "checkpoint"
        training.save(path)
        description, arrays = read_file(path, "training")
    for keys in leaves(description):
        for value_name, value in {"nothing": ..., **JSON}.items():
            name = ".".join(map(str, keys))
            cell = _file_cell(replaced(description, keys, value), arrays, agent_case)
            yield f"{agent_case}'s file: {name}={value_name}", cell
    for name, array in arrays.items():
        # No array of that name, bytes instead of numbers, another length, and other values.
        damages = {"nothing": None, "texts": np.zeros(3, np.uint8), "longer": np.zeros(7)}
        damages["-1"] = np.full_like(array, -1 if array.dtype.kind != "u" else 255)
        if array.dtype.kind == "f":
            damages |= {"NaN": np.full_like(array, np.nan), "inf": np.full_like(array, np.inf)}
        for damage_name, damage in damages.items():
            changed = arrays | {name: damage}
            if damage is None:
                del changed[name]
            cell = _file_cell(description, changed, agent_case)
            yield f"{agent_case}'s file: {name} of {damage_name}", cell


def leaves(data, keys=()):
    """Yield the keys, as tuples, of all tables, lists and values of a file's description.

    Items of lists of more than four items, which are numbers, are left out.
    """
    if keys:
        yield keys
    items = data.items() if isinstance(data, dict) else ()
    if isinstance(data, list) and len(data) <= 4:
        items = enumerate(data)
    for key, item in items:
        yield from leaves(item, (*keys, key))


def replaced(data, keys, value):
    """Return a copy of the data with another value at a tuple of keys; ``...`` removes it."""
    key, *rest = keys
    changed = dict(data) if isinstance(data, dict) else list(data)
    if rest:
        changed[key] = replaced(data[key], rest, value)
    elif value is ...:
        del changed[key]
    else:
        changed[key] = value
    return changed


def _file_cell(description, arrays, agent_case):
    def run():
        path = Path("damaged").absolute()
        write_file(path, "training", arrays, description)
        for load in (load_agent, partial(_load_and_train, agent_case=agent_case)):
            try:
                fault = agent_fault(load(path))
            except (EnoughError, OverflowError):  # the file had the largest possible values
                continue
            except ValueError as error:
                subjects = (str(path), "env must", "repeat_episodes must")
                is_clear = any(subject in str(error) for subject in subjects)
                fault = "" if is_clear else str(error)
            if fault:
                return fault
        return ""

    return run


def _load_and_train(path, agent_case):
    training = Training.load(path, Slope(make_agent(agent_case).action_space, 2 * MOST_STEPS))
    training.run()
    return training.agent
