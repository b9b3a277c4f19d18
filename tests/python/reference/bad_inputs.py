"""A matrix of bad inputs, made from signatures and fields: a new parameter is covered by itself.

A cell (a name, and a function that returns a fault) gives one bad value to one parameter. The call
must refuse it by a typed error that names the parameter, and not change the agent; or work.
"""

import contextlib
import dataclasses
import inspect
import re
import tempfile
from functools import partial
from pathlib import Path

import gymnasium as gym
import numpy as np

import sdnn.agents as agents
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
from sdnn.support.arguments import shown
from sdnn.support.files import read_file, write_file

TYPED = (TypeError, ValueError, OverflowError, OSError)

BAD = {
    "NaN": lambda: np.nan,
    "inf": lambda: np.inf,
    "-inf": lambda: -np.inf,
    "-1": lambda: -1,
    "0": lambda: 0,
    "0.5": lambda: 0.5,
    "2**20": lambda: 2**20,
    "2**31": lambda: 2**31,
    "2**63": lambda: 2**63,
    "-2**63": lambda: -(2**63),
    "10**400": lambda: 10**400,
    "1e308": lambda: 1e308,
    "-1e308": lambda: -1e308,
    "a text": lambda: "abc",
    "a number as text": lambda: "1",
    "an empty text": lambda: "",
    "a zero byte": lambda: "a\0b",
    "bytes": lambda: b"1",
    "None": lambda: None,
    "True": lambda: True,
    "complex": lambda: 1 + 2j,
    "object": object,
    "empty list": lambda: [],
    "empty tuple": lambda: (),
    "empty dict": lambda: {},
    "ragged list": lambda: [[1.0], [2.0, 3.0]],
    "list of None": lambda: [None, None],
    "list of texts": lambda: ["a", "b"],
    "list of huge": lambda: [10**400, 10**400],
    "generator": lambda: (number for number in (0.1, 0.2)),
    "wrong shape": lambda: np.zeros((2, 3, 4)),
    "wrong dtype": lambda: np.array([1j, 2j]),
    "array of NaN": lambda: np.full(2, np.nan),
    "array of inf": lambda: np.full(2, np.inf),
    "array of 1e308": lambda: np.full(2, 1e308),
    "array of objects": lambda: np.array([object(), object()]),
    "a class": lambda: int,
    "10**5000": lambda: 10**5000,
    "a number as NumPy text": lambda: np.str_("1"),
    "masked array": lambda: np.ma.masked_array([0.1, 0.2], [False, True]),
    "datetime64": lambda: np.datetime64("2020-01-01", "D"),
    "array of datetime64": lambda: np.array(["2020-01-01", "2020-01-02"], "M8[D]"),
    "a column": lambda: np.zeros((2, 1)),
    "a list in itself": lambda: endless(),
    "lists 100,000 deep": lambda: deep(list),
    "tuples 100,000 deep": lambda: deep(tuple),
}


def endless():
    """Return a list that contains itself."""
    items = []
    items.append(items)
    return items


def deep(kind, levels=100_000):
    """Return nested lists or tuples, deeper than Python's limit of recursion."""
    nested = kind()
    for _ in range(levels):
        nested = kind([nested])
    return nested


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
CASES = {
    "": {},
    ", vector": {"action_space": TORQUES},
    ", warm-up": {"observation_space": UNBOUNDED, "warm_up_steps": 30},
}
KINDS = [kind.__name__ + case for kind in SETTINGS for case in CASES]

HERE = [0.1, 0.2]
ENOUGH = 40


class EnoughError(Exception):
    """Ends a training that a bad value makes too long."""


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


def make_agent(kind, **options):
    """Return a small agent of one of `KINDS`, a class and a case such as "SDNNQLambda, vector"."""
    name, comma, case = kind.partition(",")
    cls = getattr(agents, name)
    approximator, learning = SETTINGS[cls]
    settings = {"observation_space": PLANE, "action_space": TORQUE, "seed": 3}
    settings |= {"approximator": approximator, "learning": learning}
    if cls is SDNNQLambda and "warm_up_steps" not in CASES[comma + case]:  # no warm-up by default
        settings |= {"inputs": "all", "angle_pairs": "none"}
    agent = cls(**{**settings, **CASES[comma + case], **options})
    return agent


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
    try:
        with np.errstate(over="ignore"):
            return space.sample()
    except OverflowError:  # Gymnasium cannot sample the widest boxes
        return np.zeros(space.shape, space.dtype)


def action_fault(agent, action):
    values = np.asarray(action, np.float64)
    is_in = agent.action_space.contains(action) or np.isscalar(action)
    return "" if np.isfinite(values).all() and is_in else f"chose {action!r}"


def state_fault(agent):
    for name, array in agent.state().items():
        if name.startswith("warm_up."):  # observations, which may be infinite
            continue
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            return f"{name} is not finite"
    return ""


class ReusedAgent:
    """A trained agent that cells share until one of them is accepted, which may change it."""

    def __init__(self, kind):
        self._kind = kind
        self.forget()

    def forget(self):
        self._agent = None

    @property
    def agent(self):
        if self._agent is None:
            self._agent = trained(make_agent(self._kind))
            self._before = memory(self._agent)
        return self._agent

    @property
    def is_unchanged(self):
        return memory(self._agent) == self._before


def judged(parameter, call, reused=None, value=None):
    """Run ``call``, which returns the fault of an accepted value or ""; return the cell's fault.

    A refusal must name the parameter, show ``value()``, and leave the agent ``reused`` unchanged.
    """
    try:
        fault = call() or ""
    except EnoughError:
        fault = ""
    except TYPED as error:
        if fault := message_fault(error, parameter, value):
            return fault
        if reused is None or reused.is_unchanged:
            return ""
        fault = f"refused, but changed the agent: {str(error)[:100]}"
    except Exception as error:
        return f"raised {type(error).__name__}: {str(error)[:200]}"
    if reused is not None:
        reused.forget()
    return fault


def message_fault(error, parameter, value):
    """Return what is wrong with the words of a refusal, or ""."""
    message = str(error)
    told = f"{type(error).__name__}: {message[:200]}"
    if "incompatible" in message or "not supported" in message:
        return f"said {told}"
    if isinstance(error, OSError):
        return ""
    if not re.search(rf"\b{parameter}\b", message):
        return f"did not name {parameter}: {told}"
    is_told = value is None or is_shown(value(), message)
    return "" if is_told else f"did not show the value: {told}"


def is_shown(value, message):
    """Return whether a message has a value, or after "got" its type, its shape or its size."""
    if shown(value) in message:
        return True
    try:
        repr(value)
    except (RecursionError, ValueError):  # of lists 100,000 deep, of 5,000 digits
        got = message.partition("got ")[2]
        return any(word in got for word in (type(value).__name__, "more"))
    message = re.sub(r"0x[0-9a-f]+", "0x", message.lower())
    if isinstance(value, gym.Space) or "bytes" in message:  # its consequence is named instead
        return True
    if message.endswith("must be given"):  # the missing part of it has no value
        return True
    items = [value, *(value if isinstance(value, str | bytes | list | np.ndarray) else ())]
    forms = {form for item in items for form in (repr(item), str(item))}
    forms |= {f"{item:g}" for item in items if isinstance(item, int | float) and item < 10**300}
    forms |= {str(tuple(value))} if isinstance(value, list | dict) else set()
    with contextlib.suppress(TypeError, ValueError, OverflowError, RuntimeWarning):
        forms |= {str(np.asarray(value, float).tolist())}
    if any(re.sub(r"0x[0-9a-f]+", "0x", form.lower()) in message for form in forms if form):
        return True
    kinds = [name for item in items for name in (type(item).__name__, *_shape_and_size(item))]
    got = message.partition("got ")[2]
    words = [*kinds, "more", "others", "a table"]
    return "too large" in message or any(word in got for word in words)


def _shape_and_size(value):
    try:
        return str(np.shape(value)), str(np.size(value))
    except ValueError:  # ragged
        return ()


def parameters_of(function):
    parameters = inspect.signature(function).parameters.values()
    listed = [
        parameter.name for parameter in parameters if parameter.kind is not parameter.VAR_KEYWORD
    ]
    return [name for name in listed if name not in ("self", "cls")]


def bad_cells(label, parameters, cell, values=BAD):
    """Yield cells for all bad values ``value()``; ``cell(parameter, value)`` is their function."""
    for parameter in parameters:
        for word, value in values.items():
            yield label.format(f"{parameter}={word}"), cell(parameter, value)


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


def _setting_cell(kind, part, settings, field, value):
    def call():
        changed = dataclasses.replace(settings, **{field: value()})
        return agent_fault(make_agent(kind, **{part: changed}))

    return lambda: judged(field, call, value=value)


def transition_cells(kind):
    cell = partial(_transition_cell, ReusedAgent(kind))
    return bad_cells(f"{kind}.learn: {{}}", Transition._fields, cell)


def _transition_cell(reused, parameter, value):
    def run():
        agent = reused.agent
        good = Transition(HERE, agent.last, 1.0, [0.3, 0.4], False)

        def call():
            agent.learn(good._replace(**{parameter: value()}))
            return state_fault(agent) or agent_fault(agent)

        return judged(parameter, call, reused, value)

    return run


def method_cells(kind):
    """Every public method and settable property of an agent."""
    reused = ReusedAgent(kind)
    for name, method in inspect.getmembers(type(reused.agent)):
        if name.startswith("_") or name == "rebuild":  # rebuild: see the cells of files
            continue
        if kind != KINDS[0] and name in ("train", "save", "load"):  # equal for all kinds
            continue
        if isinstance(method, property) and method.fset is not None:
            parameters = [name]
        elif inspect.isfunction(method) or inspect.ismethod(method):
            parameters = parameters_of(method)
        else:
            continue
        cell = partial(_method_cell, reused, kind, name, parameters)
        yield from bad_cells(f"{kind}.{name}: {{}}", parameters, cell)


READERS = ("q_values", "value", "rule_values")


def _method_cell(reused, kind, name, parameters, parameter, value):
    def run():
        agent = reused.agent
        if ", warm-up" in kind and (name in READERS or name.startswith("plot_")):
            return ""  # an agent that is warming up has no values
        given = arguments(agent, parameters) | {parameter: value()}

        def call():
            if isinstance(getattr(type(agent), name), property):
                setattr(agent, name, given[parameter])
                return agent_fault(agent)
            return result_fault(agent, getattr(agent, name)(**given), given)

        return judged(parameter, call, reused, value)

    return run


def arguments(agent, parameters):
    """Return good arguments for these parameters; a new required parameter needs one here."""
    env = Slope(agent.action_space, ENOUGH)
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
        "evaluation_env": Slope(agent.action_space, ENOUGH),
        "evaluation_episodes": 1,
        "every": 3,
        "mean_return": 5.0,
        "patience": 1,
        "repeat_episodes": True,
        "source": env,
        "inputs": None,
    }
    return {name: good[name] for name in parameters}


def result_fault(agent, result, given):
    """Return what is wrong with the result of a method, or ""."""
    if isinstance(result, agents.Agent):
        return agent_fault(result)
    if "observation" in given and "explore" in given:
        return action_fault(agent, result)
    if isinstance(result, agents.TrainingResult):
        return state_fault(agent) or ("" if np.isfinite(result.returns).all() else "returns")
    is_observation = np.array_equal(result, given.get("observation"))  # which may be NaN
    if isinstance(result, float | np.ndarray) and not is_observation:
        return "" if np.isfinite(result).all() else f"gave {result}"
    return state_fault(agent)


def loop_cells():
    """Training, its loading, evaluate, load_agent and the callbacks."""
    kind = "SDNNQLearning"
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
        cell = partial(_loop_cell, kind, name, function, parameters)
        yield from bad_cells(f"{name}({{}})", parameters, cell)


def _loop_cell(kind, name, function, parameters, parameter, value):
    def run():
        reused = ReusedAgent(kind)
        agent = reused.agent
        good = arguments(agent, parameters)
        env, other_env = (Slope(agent.action_space) for _ in range(2))
        evaluations = {"evaluate_every": 5, "evaluation_env": other_env, "evaluation_episodes": 1}
        if name != "StopTrainingOnRewardThreshold":  # which compares evaluations
            evaluations = {}
        training = Training(agent, env, steps=5, seed=3, **evaluations)
        if name == "evaluate":
            good["episodes"] = 2
        if name.startswith("Training."):
            training.run()
        if name == "Training.load":
            training.save(good["path"])
            good["steps"] = 9
        given = good | {parameter: value()}

        def call():
            if name == "Training.save":
                training.save(**given)
                return ""
            made = function(**given)
            if isinstance(made, Training):
                return "" if made.run().n_steps > 0 else "learned nothing"
            if isinstance(made, agents.Evaluation):
                return "" if np.isfinite(made.returns).all() else "returns"
            if isinstance(made, agents.Callback):
                training.callbacks = (made,)
                training.run()
            return ""

        return judged(parameter, call, reused if name == "evaluate" else None, value)

    return run


def file_cells(kind):
    """Every value of a file's description and every array, damaged."""
    agent = trained(make_agent(kind))
    env = Slope(agent.action_space)
    training = Training(agent, env, steps=45, seed=3)
    training.run()
    training.steps = 90
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "checkpoint"
        training.save(path)
        description, arrays = read_file(path, "training")
    for place in leaves(description):
        for word, value in {"nothing": ..., **JSON}.items():
            changed = replaced(description, place, value)
            name = ".".join(map(str, place))
            yield f"{kind}'s file: {name}={word}", _file_cell(changed, arrays, kind)
    for name, array in arrays.items():
        damages = {"nothing": None, "texts": np.zeros(3, np.uint8), "longer": np.zeros(7)}
        damages["-1"] = np.full_like(array, -1 if array.dtype.kind != "u" else 255)
        if array.dtype.kind == "f":
            damages |= {"NaN": np.full_like(array, np.nan), "inf": np.full_like(array, np.inf)}
        for word, damage in damages.items():
            changed = {n: a for n, a in arrays.items() if n != name}
            if damage is not None:
                changed[name] = damage
            yield f"{kind}'s file: {name} of {word}", _file_cell(description, changed, kind)


def leaves(data, place=()):
    """Yield the keys, as tuples, of all tables, lists and values of a file's description."""
    if place:
        yield place
    items = data.items() if isinstance(data, dict) else ()
    if isinstance(data, list) and len(data) <= 4:
        items = enumerate(data)
    for key, item in items:
        yield from leaves(item, (*place, key))


def replaced(data, place, value):
    """Return a copy of the data with another value at a tuple of keys; without it if it is ... ."""
    key, *rest = place
    changed = dict(data) if isinstance(data, dict) else list(data)
    if rest:
        changed[key] = replaced(data[key], rest, value)
    elif value is ...:
        del changed[key]
    else:
        changed[key] = value
    return changed


def _file_cell(description, arrays, kind):
    def run():
        path = Path("damaged").absolute()
        write_file(path, "training", arrays, description)
        for load in (load_agent, lambda path: _trained(path, kind)):
            try:
                fault = agent_fault(load(path))
            except EnoughError:
                continue
            except OverflowError:
                continue  # values as large as can be were in the file
            except ValueError as error:
                named = (str(path), "env must", "repeat_episodes must")
                fault = "" if any(name in str(error) for name in named) else str(error)
            if fault:
                return fault
        return ""

    return run


def _trained(path, kind):
    training = Training.load(path, Slope(make_agent(kind).action_space, 2 * ENOUGH))
    training.run()
    return training.agent
