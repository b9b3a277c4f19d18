"""Cells (a name, and a function that returns a fault) about public classes and functions."""

import contextlib
import importlib
import inspect
import re
from functools import partial

import gymnasium as gym
import numpy as np

import core_cells
from bad_values import BAD, bad_cells, judged, parameters_of
from sdnn.agents import SDNNQLambda
from sdnn.coding import (
    Anchor,
    Circular,
    CorrelationMatrix,
    RandomInverse,
    Symbolic,
    WithMissing,
    kernel,
)
from sdnn.environments import (
    AcrobotConfig,
    AcrobotSwingUpEnv,
    AcrobotSwingUpVectorEnv,
    GoalSchedule,
    PaperAcrobotEnv,
    SensorConfig,
)
from sdnn.estimators import SDNNClassifier, SDNNKernelClassifier, SDNNKernelRidge, SDNNRegressor
from sdnn.export import save_image
from sdnn.reproduction.cases import EXPERIMENTS, PAPER_CASES
from sdnn.runs import BudgetSpec, ConfigError, EnvironmentSpec, ProtocolSpec, RunSpec, agent_entry

PACKAGES = (
    "agents",
    "approximators",
    "coding",
    "environments",
    "estimators",
    "reproduction",
    "runs",
)

SAMPLES = np.random.default_rng(1).uniform(0, 1, (12, 2))
NUMBERS, LABELS = SAMPLES.sum(axis=1), np.arange(12) % 3
NETWORK = {"n_pattern_units": 20, "max_iter": 2, "random_state": 0}
ESTIMATORS = {
    SDNNRegressor: (NUMBERS, NETWORK),
    SDNNClassifier: (LABELS, NETWORK),
    SDNNKernelRidge: (NUMBERS, {"degree": 1}),
    SDNNKernelClassifier: (LABELS, {"degree": 1}),
}
"""Targets, and parameters with which a fit is quick, by the class of estimator."""


LONG_WORK = {
    (parameter, value_name)
    for parameter in ("max_iter", "n_pattern_units", "n_output_units")
    for value_name in ("2**20", "2**31", "2**63")
}
"""Values that are accepted, but take too long."""

NOT_NAMED = {("random_state", "list of huge")}
"""Values that NumPy refuses by a message that does not name the parameter."""


def estimator_cells():
    """Yield cells of the parameters of estimators, and of their data."""
    for cls in ESTIMATORS:
        for parameter in parameters_of(cls.__init__):
            values = {
                value_name: value
                for value_name, value in BAD.items()
                if (parameter, value_name) not in LONG_WORK | NOT_NAMED
            }
            cell = partial(_estimator_cell, cls)
            yield from bad_cells(f"{cls.__name__}({{}})", [parameter], cell, values)
        yield from bad_cells(f"{cls.__name__}.fit({{}})", ["X", "y"], partial(_data_cell, cls))
        yield from bad_cells(f"{cls.__name__}.predict({{}})", ["X"], _predict_cell(cls))


def _estimator_cell(cls, parameter, value):
    def call():
        targets, small = ESTIMATORS[cls]
        model = cls(**{**small, parameter: value()}).fit(SAMPLES, targets)
        return _prediction_fault(model)

    return lambda: _named_loosely(parameter, call, value)


def _data_cell(cls, parameter, value):
    def call():
        targets, small = ESTIMATORS[cls]
        arguments = {"X": SAMPLES, "y": targets, parameter: value()}
        return _prediction_fault(cls(**small).fit(**arguments))

    return lambda: _without_name(call)


def _predict_cell(cls):
    targets, small = ESTIMATORS[cls]
    model = cls(**small).fit(SAMPLES, targets)
    return lambda _, value: lambda: _without_name(lambda: model.predict(value()) is None)


def _without_name(call):
    """Return the fault of a call, which may refuse its data in scikit-learn's words."""
    fault = judged("", call)
    is_typed = fault.startswith(("did not name", "said ValueError: Complex"))
    return "" if is_typed else fault


def _named_loosely(parameter, call, value):
    """Return the fault of a call, which may name a parameter by its content or as NumPy does."""
    fault = judged(parameter, call, value=value)
    if "while getting the repr" in fault or "Exceeds the limit" in fault:
        return ""  # scikit-learn's message has the value
    names = {"coding": "coding|columns|feature", "pairs": "pair|feature", "random_state": "[Ss]eed"}
    is_named = re.search(names.get(parameter, parameter), fault.partition(":")[2])
    return "" if fault.startswith("did not name") and is_named else fault


def _prediction_fault(model):
    predicted = model.predict(np.zeros((2, model.n_features_in_)))
    return "" if np.isfinite(np.asarray(predicted, np.float64)).all() else f"predicts {predicted}"


def coding_cells():
    """Yield cells of codings: a fitted one has a bin for every value, and patterns of +1 and -1."""
    numbers, letters = np.linspace(0.0, 1.0, 12), np.array(["a", "b", "c"] * 4)
    for cls, column, arguments in (
        (RandomInverse, numbers, {}),
        (Anchor, numbers, {}),
        (Circular, numbers, {}),
        (Symbolic, letters, {}),
        (CorrelationMatrix, letters, {"matrix": np.eye(3)}),
        (WithMissing, numbers, {}),
    ):
        name, parameters = cls.__name__, parameters_of(cls.__init__)
        yield from bad_cells(
            f"{name}({{}})", parameters, partial(_coding_cell, cls, column, arguments)
        )
        for value_name, value in BAD.items():
            yield f"{name}.fit({value_name})", _column_cell(cls, arguments, value)
        cell = partial(_patterns_cell, cls, column, arguments)
        yield from bad_cells(f"{name}.patterns({{}})", ["n_units", "seed"], cell)


def _coding_cell(cls, column, arguments, parameter, value):
    def call():
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            coding = cls(**{**arguments, parameter: value()}).fit(column, 40)
            return _coding_fault(coding, coding.bins(column))

    shown = None if parameter == "categories" else value  # whose error may show missing ones
    return lambda: judged(parameter, call, value=shown)


def _patterns_cell(cls, column, arguments, parameter, value):
    """Return a function that accepts an error of any type, as callers have checked both values."""

    def run():
        fitted = cls(**arguments).fit(column, 40)
        with contextlib.suppress(Exception):
            patterns = fitted.patterns(**{"n_units": 40, "seed": 1, parameter: value()})
            return "" if set(np.unique(patterns)) == {-1, 1} else f"gave {patterns}"
        return ""

    return run


def _column_cell(cls, arguments, value):
    def call():
        column = np.atleast_1d(np.asarray(value()))
        coding = cls(**arguments).fit(column, 40)
        return _coding_fault(coding, coding.bins(column))

    return lambda: _without_name(call)


def _coding_fault(coding, bins):
    patterns = coding.patterns(40, 1)
    if patterns.shape != (coding.size, 40) or set(np.unique(patterns)) != {-1, 1}:
        return f"has patterns {patterns}"
    is_bin = (bins >= 0) & (bins < coding.size)
    return "" if is_bin.all() else f"has bins {bins} of {coding.size}"


GOOD = {
    "action_space": lambda: gym.spaces.Discrete(2),
    "agent": lambda: tiny_agent(),
    "approximator": lambda: core_cells.linear_config(),
    "case": lambda: PAPER_CASES["s4"],
    "cases": lambda: [PAPER_CASES["s4"]],
    "case_id": lambda: "s4",
    "coding": lambda: "anchor",
    "costs": lambda: (),
    "data": lambda: {"coding": "anchor"},
    "dataset": lambda: (),
    "entry": lambda: agent_entry("rbf"),
    "env": lambda: AcrobotSwingUpEnv(),
    "episodes": lambda: 1,
    "epochs": lambda: 1,
    "executor": lambda: None,
    "experiment": lambda: EXPERIMENTS[0],
    "flash_bytes": lambda: None,
    "durations": lambda: False,
    "fraction_bits": lambda: None,
    "image": lambda: save_image(tiny_agent()),
    "jobs": lambda: 1,
    "label": lambda: "sdnn-c",
    "learning": lambda: True,
    "library": lambda: "msvc",
    "measured": lambda: (),
    "memory_limit": lambda: 2**20,
    "model": lambda: SDNNRegressor(**NETWORK).fit(SAMPLES, NUMBERS),
    "n_classes": lambda: None,
    "n_episodes": lambda: 20,
    "n_inputs": lambda: 4,
    "n_most": lambda: 3,
    "n_outputs": lambda: None,
    "n_trials": lambda: 1,
    "n_units": lambda: 200,
    "name": lambda: "portable",
    "names": lambda: ("early_steps",),
    "observer": lambda: None,
    "observation_space": lambda: gym.spaces.Box(0.0, 1.0, (2,)),
    "options": lambda: None,
    "path": lambda: "agent",
    "plan": lambda: (),
    "narrow": lambda: False,
    "quick": lambda: True,
    "kind": lambda: "q-lambda",
    "ram_bytes": lambda: 20_000,
    "records": lambda: (),
    "reference": lambda: (),
    "results": lambda: (),
    "root_seed": lambda: 1,
    "seed": lambda: 1,
    "stop": lambda: None,
    "store": lambda: None,
    "title": lambda: "a title",
    "trial": lambda: 0,
    "word": lambda: "a",
}
"""Good arguments of public functions; a new parameter needs a line."""

OBJECTS = {
    "case", "cases", "costs", "data", "entry", "executor", "experiment", "measured", "narrow",
    "names", "observer", "plan", "quick", "records", "reference", "results", "stop",
    "store", "title",
}  # fmt: skip
"""Parameters of parts of this package: a wrong one gives an error of any type."""


ELSEWHERE = {"evaluate", "load_agent"}
"""Functions whose cells are in bad_inputs.py."""

NAMED = {"word": "experiment", "label": "agent", "n_episodes": "episodes", "name": "(name|set)"}
"""Names or regular expressions that messages have for a parameter, where it is not its own."""


def tiny_agent():
    spaces = gym.spaces.Box(0.0, 1.0, (2,)), gym.spaces.Discrete(2)
    config = core_cells.linear_config()
    return SDNNQLambda(*spaces, approximator=config, angle_pairs="none", inputs="all")


def public_functions():
    """Yield the full names of public functions, and the functions, but those of `ELSEWHERE`."""
    packages = [f"sdnn.{package}" for package in PACKAGES]
    for module_name in (*packages, "sdnn", "sdnn.coding.kernel", "sdnn.export"):
        module = importlib.import_module(module_name)
        for name in module.__all__:
            value = getattr(module, name)
            if inspect.isfunction(value) and name not in ELSEWHERE:
                yield f"{module_name}.{name}", value


def function_cells():
    """Yield cells of every public function: a bad value is refused or accepted, without a crash."""
    for name, function in public_functions():
        cell = partial(_function_cell, function)
        yield from bad_cells(f"{name}({{}})", parameters_of(function), cell)
    parameters = parameters_of(kernel.AnalyticKernel.__init__)
    yield from bad_cells("AnalyticKernel({})", parameters, _kernel_cell)
    yield from bad_cells("AnalyticKernel()({})", ["X", "Y"], _call_cell)


def _kernel_cell(parameter, value):
    def call():
        arguments = {"coding": "anchor", "n_inputs": 2, "n_units": 100, parameter: value()}
        analytic = kernel.AnalyticKernel(**arguments)
        return "" if np.isfinite(analytic(np.zeros((2, 2)))).all() else "gave NaN"

    return lambda: judged(parameter, call)


def _call_cell(parameter, value):
    def call():
        arguments = {"X": np.zeros((2, 2)), parameter: value()}
        analytic = kernel.AnalyticKernel("anchor", n_inputs=2, n_units=100)
        return "" if np.isfinite(analytic(**arguments)).all() else "gave NaN"

    return lambda: judged(parameter, call)


def _function_cell(function, parameter, value):
    def run():
        parameters = parameters_of(function)
        arguments = {name: GOOD[name]() for name in parameters} | {parameter: value()}
        if "case" in parameters and parameter != "agent":
            arguments["agent"] = "sdnn-c"

        def call():
            function(**arguments)
            return ""

        if parameter not in OBJECTS:
            return _with_config_error(NAMED.get(parameter, parameter), call)
        with contextlib.suppress(Exception):
            call()
        return ""

    return run


def experiment_cells():
    """Yield cells of the settings of trials: they are refused when they are made, or work."""
    uses = {
        ProtocolSpec: _use_protocol,
        BudgetSpec: _use_budget,
        EnvironmentSpec: _use_environment,
        RunSpec: _use_spec,
    }
    for config, use in uses.items():
        cell = partial(_experiment_cell, use)
        yield from bad_cells(f"{config.__name__}({{}})", parameters_of(config), cell)


def _experiment_cell(use, parameter, value):
    return lambda: _with_config_error(parameter, lambda: use({parameter: value()}), value)


def _with_config_error(parameter, call, value=None):
    """Return the fault of a call that may raise a ConfigError, which counts as a ValueError."""

    def converted():
        try:
            return call()
        except ConfigError as error:
            raise ValueError(str(error)) from error

    return judged(parameter, converted, value=value)


def _use_protocol(arguments):
    return _use_spec({"protocol": ProtocolSpec(**arguments), "budget": BudgetSpec(episodes=20)})


def _use_budget(arguments):
    return _use_spec({"budget": BudgetSpec(**arguments)})


def _use_environment(arguments):
    environment = EnvironmentSpec(**{"id": "Pendulum-v1", **arguments})
    with contextlib.suppress(ConfigError):  # of an id that nobody has registered
        observation, _ = environment.make().reset(seed=1)
        return "" if np.isfinite(observation).all() else f"gave {observation}"
    return ""


def _use_spec(arguments):
    RunSpec(**{"environment": "Pendulum-v1", "agent": "fuzzy"} | arguments).make_trial(1).advance(1)
    return ""


def environment_cells():
    """Yield cells of environments, their configurations and the schedule of the goal."""
    for maker in (AcrobotSwingUpEnv, AcrobotSwingUpVectorEnv, PaperAcrobotEnv):
        parameters = parameters_of(maker.__init__)
        yield from bad_cells(f"{maker.__name__}({{}})", parameters, partial(_env_cell, maker))
    for config in (AcrobotConfig, SensorConfig):
        cell = partial(_config_cell, config)
        yield from bad_cells(f"{config.__name__}({{}})", parameters_of(config), cell)
    parameters = parameters_of(GoalSchedule.__call__)
    yield from bad_cells("GoalSchedule()({})", parameters, _schedule_cell)


def _env_cell(maker, parameter, value):
    def call():
        env = maker(**{parameter: value()})
        first, _ = env.reset(seed=1)
        n = getattr(env, "num_envs", None)
        actions = np.zeros(1) if n is None else np.zeros((n, 1))
        observation, reward, *_ = env.step(actions)
        numbers = [np.asarray(item, np.float64) for item in (first, observation, reward)]
        return "" if all(np.isfinite(item).all() for item in numbers) else "is not finite"

    return lambda: judged(parameter, call, value=value)


def _config_cell(config, parameter, value):
    def call():
        made = config(**{parameter: value()})
        if isinstance(made, AcrobotConfig):
            env = AcrobotSwingUpEnv(config=made)
            env.reset(seed=1)
            for _ in range(3):
                observation, reward, terminated, truncated, _ = env.step(np.ones(1))
                if not np.isfinite([*observation, reward]).all():
                    return f"gave {observation}, {reward}"
                if terminated or truncated:
                    break
        return ""

    def run():
        fault = judged(parameter, call, value=value)
        return "" if "integration_step" in fault else fault  # forces may be too strong for a step

    return run


def _schedule_cell(parameter, value):
    return lambda: judged(
        parameter,
        lambda: "" if np.isfinite(GoalSchedule()(**{parameter: value()})) else "gave NaN",
        value=value,
    )
