"""Cells (a name, and a function that returns a fault) about classes and functions of the core.

An object whose ``__init__`` was not called must be refused wherever it is used; a bad value of any
argument must be refused by a typed error, or accepted.
"""

import contextlib
import copy
import inspect
import operator
import pickle
import time
from functools import partial

import numpy as np

import sdnn._core as core
from bad_values import TYPED, bad_cells

CLASSES = [value for value in vars(core).values() if type(value).__name__ == "pybind11_type"]
"""All classes but enumerations, which are Python's own."""

NOT_MADE = "__init__() was not called"
"""A part of the message of an object that ``cls.__new__`` has made without ``__init__``."""


def patterns():
    """Return patterns of 20 units for 12 bins."""
    return core.random_inverse_patterns(n_units=20, n_bins=12, n_flipped=2, seed=1)


def code():
    """Return the code of two inputs, each desensitized by the other."""
    return core.SelectiveDesensitization([patterns()] * 2, [patterns()] * 2, [[0, 1], [1, 0]])


def network_config(**sizes):
    small = {"n_inputs": 2, "n_pattern_units": 20, "n_hidden_units": 60, "n_active_units": 20}
    return core.SDNNCConfig(**{**small, **sizes})


def linear_config(**sizes):
    small = {"n_inputs": 2, "n_pattern_units": 20, "averaging_interval": 2}
    return core.LinearSDNNConfig(**{**small, **sizes})


def trial_settings():
    return {
        "learning": core.QLearningConfig(),
        "acrobot": core.AcrobotConfig(),
        "goal": core.GoalScheduleConfig(),
        "sensors": core.SensorConfig(),
        "protocol": core.ProtocolConfig(episodes=20),
        "seed": 1,
    }


BINS = [[0, 1], [2, 3], [4, 5]]
"""The bins of three samples of two inputs."""

GOOD = {
    "SelectiveDesensitization": lambda: {
        "modified": [patterns()] * 2, "modifiers": [patterns()] * 2, "pairs": [[0, 1], [1, 0]]
    },
    "SDNNC": lambda: {"config": network_config(), "seed": 1},
    "FuzzyRules": lambda: {"config": core.FuzzyRulesConfig()},
    "RBFNetwork": lambda: {"config": core.RBFNetworkConfig()},
    "FixedRate": lambda: {
        "hz": 50.0, "clock": time.monotonic, "sleep": time.sleep,
    },
    "GoalSchedule": lambda: {"config": core.GoalScheduleConfig()},
    "Acrobot": lambda: {"config": core.AcrobotConfig()},
    "AcrobotBatch": lambda: {"config": core.AcrobotConfig(), "n_acrobots": 3},
    "SensorNoise": lambda: {
        "sigma": 0.1, "edges": ["wrap"], "seed": 1, "stream": core.Stream.sensor_noise
    },
    "AcrobotSensors": lambda: {
        "config": core.SensorConfig(), "seed": 1, "stream": core.Stream.sensor_noise
    },
    "ParallelPerceptron": lambda: {"code": code(), "n_units": 6, "seed": 1, "initial_range": 5},
    "OnlineLayer": lambda: {"layer": core.ParallelPerceptron(code(), 6)},
    "PDeltaTrainer": lambda: {
        "layer": core.ParallelPerceptron(code(), 6), "bins": BINS, "targets": [[1.0], [2.0], [3.0]],
        "form": "auto", "memory_limit": 2**20, "n_threads": 1,
    },
    "PerceptronTrainer": lambda: {
        "layer": core.ParallelPerceptron(code(), 3), "bins": BINS, "labels": [0, 1, 2],
        "n_classes": 3, "scheme": "one_vs_rest", "form": "auto", "memory_limit": 2**20,
        "n_threads": 1,
    },
    "RecursiveLeastSquares": lambda: {
        "low": [0.0, -1.0], "high": [1.0, 1.0], "n_outputs": 2, "forgetting": 0.99,
        "error_limit": 20.0,
    },
    "PredictionMixture": lambda: {"priors": [1.0, 2.0, 1.0]},
    "KernelWindow": lambda: {
        "low": [0.0, -1.0], "high": [1.0, 1.0], "n_outputs": 2, "capacity": 5, "length_scale": 1.0,
        "ridge": 0.1, "target_limit": 20.0,
    },
    "KernelSums": lambda: {
        "correlations": [[1.0, 0.5, 0.25], [[1.0, 0.5], [0.5, 1.0]]], "bins": [[0, 1], [2, 0]],
        "n_terms": 2, "degree": 2,
    },
    "ProbabilityMixture": lambda: {"n_scorers": 2},
    "LinearSDNN": lambda: {"config": linear_config(), "n_actions": [3, 4], "seed": 1},
    "BareAgent": lambda: {
        "approximator": linear_config(), "learning": core.QLambdaConfig(), "seed": 1,
        "n_actions": [3, 4],
    },
    "Controller": lambda: {
        "approximator": core.RBFNetworkConfig(),
        "learning": core.QLearningConfig(n_greedy_steps=0),
        "seed": 1,
        "observation": core.ObservationConfig(low=[0.0], high=[1.0]),
        "action": core.ActionConfig(low=[0.0], high=[1.0]),
    },
    "AcrobotTrial": lambda: {"approximator": network_config(n_inputs=4), **trial_settings()},
    "PlainRBFQLearning": lambda: {
        "approximator": core.RBFNetworkConfig(), "learning": core.QLearningConfig(n_greedy_steps=0),
        "seed": 1,
    },
    "DenseProduct": lambda: {"n_rows": 3, "n_columns": 4, "seed": 1},
    "NetworkParts": lambda: {"network": core.SDNNC(network_config(), 1), "seed": 1},
    "AcrobotDecisions": lambda: {"config": core.AcrobotConfig(), "seed": 1},
    "action_value": lambda: {"action": 1, "n_actions": 3, "low": -1.0, "high": 1.0},
    "random_inverse_patterns": lambda: {"n_units": 20, "n_bins": 5, "n_flipped": 2, "seed": 1},
    "anchor_patterns": lambda: {
        "n_units": 20, "n_anchor_patterns": 3, "n_interpolated": 4, "circular": False, "seed": 1
    },
    "correlation_matrix_patterns": lambda: {"n_units": 20, "correlations": np.eye(3), "seed": 1},
    "libsdnn_tables": lambda: {
        "n_units": 20, "inputs": [(5, 2), (6, 2)], "pairs": [[0, 1]], "seed": [1],
        "library": "libstdc++",
    },
    "libsdnn_weights": lambda: {
        "n_units": 3, "n_columns": 4, "low": -5, "high": 5, "seed": [1], "library": "libstdc++"
    },
    "n_units_for": lambda: {"scheme": "one_vs_one", "n_classes": 4},
}  # fmt: skip
"""Good arguments of each class and function of the core; a new one needs an entry."""

METHODS = {
    ("SelectiveDesensitization", "transform"): {"bins": BINS},
    ("SelectiveDesensitization", "gram"): {"bins": BINS, "other_bins": None},
    ("ParallelPerceptron", "potentials"): {"bins": BINS, "n_threads": 1},
    ("ParallelPerceptron", "counts"): {"bins": BINS, "n_groups": 1, "n_threads": 1},
    ("PDeltaTrainer", "present"): {"order": [0, 2, 1]},
    ("PerceptronTrainer", "present"): {"order": [0, 2, 1]},
    ("RecursiveLeastSquares", "predict"): {"inputs": [0.5, 0.5]},
    ("RecursiveLeastSquares", "learn"): {"inputs": [0.5, 0.5], "targets": [1.0, 2.0]},
    ("RecursiveLeastSquares", "add_inputs"): {"low": [0.0], "high": [1.0]},
    ("RecursiveLeastSquares", "add_outputs"): {"n": 1},
    ("RecursiveLeastSquares", "restore"): {"state": {}},
    ("KernelWindow", "predict"): {"inputs": [0.5, 0.5]},
    ("KernelWindow", "learn"): {"inputs": [0.5, 0.5], "targets": [1.0, 2.0]},
    ("KernelWindow", "add_inputs"): {"low": [0.0], "high": [1.0]},
    ("KernelWindow", "add_outputs"): {"n": 1},
    ("KernelWindow", "restore"): {"state": {}},
    ("KernelSums", "matrix"): {"bins": [[1, 1]]},
    ("KernelSums", "sums"): {"bins": [[1, 1]], "coefficients": [[0.5], [0.25]]},
    ("PredictionMixture", "mix"): {"predictions": [1.0, 2.0, 3.0]},
    ("PredictionMixture", "learn"): {"predictions": [1.0, 2.0, 3.0], "target": 1.0},
    ("PredictionMixture", "restore"): {"state": {}},
    ("ProbabilityMixture", "mix"): {"shares": [0.5, 0.5], "scores": [[0.1, 0.2]] * 2},
    ("ProbabilityMixture", "learn"): {
        "shares": [0.5, 0.5], "scores": [[0.1, 0.2]] * 2, "label": 1
    },
    ("ProbabilityMixture", "restore"): {"state": {}},
    ("SDNNC", "values"): {"state": [0.1, 0.2]},
    ("SDNNC", "value"): {"state": [0.1, 0.2], "action": 3},
    ("SDNNC", "update"): {"state": [0.1, 0.2], "action": 3, "target": 1.0, "rate": 1.0},
    ("SDNNC", "table"): {"input": 0},
    ("SDNNC", "permutation"): {"mu": 0, "nu": 1},
    ("FuzzyRules", "values"): {"rule": 0},
    ("RBFNetwork", "set_weights"): {"weights": None},
    ("Acrobot", "set_state"): {"state": [0.0, 0.0, 0.0, 0.0]},
    ("Acrobot", "step"): {"torque": 1.0, "goal_tolerance": 1.0},
    ("AcrobotBatch", "reset"): {"mask": [True, False, True]},
    ("AcrobotBatch", "set_state"): {"index": 1, "state": [0.0, 0.0, 0.0, 0.0]},
    ("AcrobotBatch", "step"): {
        "torques": [1.0, 2.0, 3.0], "goal_tolerances": [1.0] * 3, "moving": [True] * 3
    },
    ("AcrobotBatch", "decisions"): {"index": 1},
    ("LinearSDNN", "values"): {"state": [0.1, 0.2], "dimension": 1},
    ("BareAgent", "act"): {"state": [0.1, 0.2], "explore": True},
    ("BareAgent", "learn"): {
        "state": [0.1, 0.2], "action": [2, 3], "reward": 1.0, "next_state": [0.2, 0.2],
        "terminated": False,
    },
    ("Controller", "begin_episode"): {"environment": 0},
    ("Controller", "act"): {
        "observation": [0.1], "explore": True, "environment": 0, "mask": None
    },
    ("Controller", "values"): {"observation": [0.1], "dimension": 0},
    ("Controller", "restore"): {"state": {}},
    ("AcrobotTrial", "advance"): {"n_episodes": 1},
    ("AcrobotTrial", "advance_together"): {
        "trials": (core.AcrobotTrial(**GOOD["AcrobotTrial"]()),), "n_decisions": 1
    },
    ("NetworkParts", "time_values"): {"n_repetitions": 2},
    ("NetworkParts", "time_corrections"): {"n_repetitions": 2, "n_corrected": 3},
    ("NetworkParts", "time_selections"): {
        "n_repetitions": 2, "n_selections": 3, "n_selected": 2
    },
}  # fmt: skip
"""Good arguments of methods, by the names of class and method."""


def valid_object(name):
    return getattr(core, name)(**GOOD[name]())


def never_made_cells():
    """Yield cells that use objects without ``__init__``: as self, and as arguments of the core."""
    for cls in CLASSES:
        for name, member in inspect.getmembers(cls):
            if isinstance(member, property):
                yield f"{cls.__name__}.{name}", _refusal_cell(cls, operator.attrgetter(name))
            elif not name.startswith("_") and callable(member):
                yield f"{cls.__name__}.{name}()", _refusal_cell(cls, _calls(name))
        for other in GOOD:
            for parameter in GOOD[other]():
                yield (
                    f"{other}({parameter}={cls.__name__}.__new__)",
                    _argument_cell(other, parameter, lambda cls=cls: cls.__new__(cls)),
                )
        yield f"{cls.__name__} in general", _general_cell(cls)
        yield f"a subclass of {cls.__name__}", _subclass_cell(cls)


def _calls(name):
    """Return a function that calls a method with zeros, as many as it has arguments."""

    def call(instance):
        for count in range(7):
            try:
                return getattr(instance, name)(*[0] * count)
            except TypeError as error:
                if NOT_MADE in str(error):
                    raise
        return None  # the method has refused the types of these arguments

    return call


def _refusal_cell(cls, use):
    def run():
        try:
            result = use(cls.__new__(cls))
        except TypeError as error:
            return "" if NOT_MADE in str(error) else f"said {error}"
        return "" if result is None else f"gave {result!r}"

    return run


def _general_cell(cls):
    """Return a function that uses an object without ``__init__`` in ways that fit any object."""

    def run():
        instance = cls.__new__(cls)
        uses = [repr, str, hash, bool, len, copy.copy, copy.deepcopy, lambda x: x == x]
        uses += [lambda x, protocol=protocol: pickle.dumps(x, protocol) for protocol in range(6)]
        for use in uses:
            with contextlib.suppress(TypeError):
                use(instance)
        return ""

    return run


def _subclass_cell(cls):
    class Forgetful(cls):
        def __init__(self):
            pass

    def run():
        try:
            Forgetful()
        except TypeError as error:
            return "" if "__init__" in str(error) else str(error)
        return "was made"

    return run


def argument_cells():
    """Yield cells of bad values of all arguments of classes, functions and methods of the core."""
    for name in GOOD:
        yield from bad_cells(f"{name}({{}})", GOOD[name](), partial(_argument_cell, name))
    for (name, method), good in METHODS.items():
        cell = partial(_method_cell, name, method, good)
        yield from bad_cells(f"{name}.{method}({{}})", good, cell)


def _argument_cell(name, parameter, value):
    return lambda: _judged(lambda: getattr(core, name)(**{**GOOD[name](), parameter: value()}))


def _method_cell(name, method, good, parameter, value):
    return lambda: _judged(
        lambda: getattr(valid_object(name), method)(**{**good, parameter: value()})
    )


def _judged(call):
    """Return a fault if a result is not finite; a refusal need not name the argument."""
    try:
        result = call()
    except (*TYPED, IndexError, MemoryError):
        return ""
    is_number = isinstance(result, float | np.ndarray)
    numbers = [x for x in np.atleast_1d(result) if isinstance(x, float)] if is_number else []
    return "" if np.isfinite(numbers).all() else f"gave {result!r}"
