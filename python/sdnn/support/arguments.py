"""Checks of arguments; each message names the argument, the expected and the given value."""

from __future__ import annotations

import difflib
import functools
import inspect
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from numbers import Integral, Real
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

if TYPE_CHECKING:
    from numpy.typing import NDArray

Member = TypeVar("Member")
Called = TypeVar("Called", bound=Callable[..., Any])

_REPR = reprlib.Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 200
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = 12


def shown(value: object) -> str:
    """Return the `repr` of any value for a message, shortened; lists may contain themselves.

    >>> shown(list(range(1000)))
    '[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, ...]'
    """
    try:
        return _REPR.repr(value)
    except Exception:  # such as an int of 5,000 digits, or a user's class
        return object.__repr__(value)


def array_of(name: str, value: object, types: str = "fiub", what: str = "numbers") -> NDArray[Any]:
    """Convert arrays of any library, numbers, or lists of them to NumPy; ValueError for others.

    ``types`` are letters of the possible types, as in ``numpy.dtype.kind``, and ``what`` their word
    in messages. Masked arrays are refused: their mask would be lost.

    >>> array_of("levels", [0.5, "a"])
    Traceback (most recent call last):
    ValueError: levels must be numbers, got [0.5, 'a']
    """
    import numpy as np  # slow to import: not at the start of `import sdnn`

    is_plain = type(value) is np.ndarray or isinstance(value, np.generic)
    if is_plain and (array := np.asarray(value)).dtype.kind in types:
        return array
    rows = value if isinstance(value, list | tuple) else [value]
    has_mask = any(isinstance(row, np.ma.MaskedArray) for row in rows)
    require(not has_mask, name, f"be {what} without a mask", value)
    try:
        array = np.asarray(value)
    except Exception:  # such as lists of different lengths, or another library's error
        array = np.empty(0, object)
    require(array.dtype.kind in types, name, f"be {what}", value)
    return array


def argument_error(name: str, problem: str, error_class: type[Exception] = ValueError) -> Exception:
    """Make an error about an argument; its attribute ``argument`` is the argument's name.

    Errors of the core have this attribute, too.

    >>> argument_error("n_bins", "must be at least 2, got 1")
    ValueError('n_bins must be at least 2, got 1')
    """
    is_named = problem.startswith(f"{name},")  # the core names several arguments
    error = error_class(problem if is_named else f"{name} {problem}")
    error.argument = name  # type: ignore[attr-defined]
    return error


def require(
    condition: object,
    name: str,
    expected: str,
    value: object,
    error_class: type[Exception] = ValueError,
) -> None:
    """Raise an error about an argument unless a condition holds; ``expected`` follows "must".

    >>> require(False, "period", "be positive", -1)
    Traceback (most recent call last):
    ValueError: period must be positive, got -1
    """
    if not condition:
        raise argument_error(name, f"must {expected}, got {shown(value)}", error_class)


def blamed(error: BaseException) -> tuple[str, str]:
    """Return the argument that an error is about, and its message without the name.

    >>> blamed(argument_error("n_bins", "must be at least 2, got 1"))
    ('n_bins', 'must be at least 2, got 1')
    >>> blamed(KeyError())
    ('', 'KeyError')
    """
    name: str = getattr(error, "argument", "")
    return name, (str(error) or type(error).__name__).removeprefix(f"{name} ")


def choice(name: str, word: object, members: Mapping[str, Member]) -> Member:
    """Return the member called ``word``; ValueError that lists the members if there is none.

    >>> choice("direction", "left", {"up": 1, "down": -1})
    Traceback (most recent call last):
    ValueError: direction must be one of 'up', 'down', got 'left'
    """
    if isinstance(word, str) and word in members:
        return members[word]
    names = ", ".join(map(repr, members))
    raise argument_error(name, f"must be one of {names}, got {shown(word)}")


def one_of(name: str, word: object, choices: tuple[str, ...]) -> str:
    """Check that an argument is one of several words; ValueError if not."""
    return choice(name, word, {member: member for member in choices})


def _is_of_numpy(value: object, *names: str) -> bool:
    """Return whether a value is a NumPy scalar of one of these types, without importing NumPy."""
    return type(value).__module__ == "numpy" and type(value).__name__ in names


def _is_no_number(value: object) -> bool:
    """Return whether a value is a bool or a duration, which Python and NumPy count as numbers."""
    return isinstance(value, bool) or _is_of_numpy(value, "timedelta64")


def whole(name: str, value: object, low: int, high: int) -> int:
    """Check that an argument is a whole number within bounds; ValueError if not.

    >>> whole("n_bins", 1, 2, 65535)
    Traceback (most recent call last):
    ValueError: n_bins must be a whole number in [2, 65535], got 1
    """
    if isinstance(value, Integral) and not _is_no_number(value):
        number = int(value)
        if low <= number <= high:
            return number
    raise argument_error(name, f"must be a whole number in [{low}, {high}], got {shown(value)}")


def seed_of(value: object) -> int:
    """Check that a seed is a whole number in [0, 2**64), as the core needs; ValueError if not."""
    return whole("seed", value, 0, 2**64 - 1)


def real(name: str, value: object) -> float:
    """Check that an argument is a number, perhaps NaN or infinite; ValueError if not."""
    if type(value) is float:
        return value
    if not isinstance(value, Real) or _is_no_number(value):
        raise argument_error(name, f"must be a number, got {shown(value)}")
    try:
        return float(value)
    except OverflowError:
        problem = "must be a number of less than 1.8e308, got more"
        raise argument_error(name, problem, OverflowError) from None


def single_number(value: object) -> object:
    """Return the number in an array that has a single one; other values unchanged."""
    import numpy as np

    is_array = isinstance(value, np.ndarray | np.generic)
    if is_array and not isinstance(value, np.ma.MaskedArray):
        array = np.asarray(value)
        if array.size == 1 and array.dtype.kind in "fiub":
            return array.item()
    return value


def reward_of(reward: object) -> float:
    """Convert a reward, a number, bool or array with a single number; ValueError for others."""
    if isinstance(reward, float):  # includes np.float64
        return float(reward)
    import numpy as np

    reward = single_number(reward)
    is_of_numpy = isinstance(reward, np.ndarray | np.generic)
    if isinstance(reward, SupportsFloat) and not is_of_numpy:
        with suppress(OverflowError, TypeError, ValueError):
            return float(reward)
    return _small_enough("reward", reward)


def duration_of(dt: object) -> float:
    """Convert a duration, a number or an array with a single one; ValueError for others."""
    return dt if type(dt) is float else _small_enough("dt", single_number(dt))


def _small_enough(name: str, value: object) -> float:
    """Check a number; ValueError if not, also for one beyond all floats.

    Callers of `Agent.learn` would take an OverflowError for that of a weight.
    """
    try:
        return real(name, value)
    except OverflowError as error:
        raise ValueError(str(error)) from None


def flag(name: str, value: object) -> bool:
    """Check that an argument is a bool, Python's or NumPy's; TypeError if not."""
    if not isinstance(value, bool) and not _is_of_numpy(value, "bool", "bool_"):
        raise argument_error(name, f"must be True or False, got {shown(value)}", TypeError)
    return bool(value)


def path_of(name: str, value: object) -> Path:
    """Check that an argument can name a file; TypeError or ValueError if not."""
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if isinstance(text, str) and text and "\0" not in text:
        return Path(text)
    error_class = TypeError if text is None else ValueError
    raise argument_error(name, f"must be the name of a file, got {shown(value)}", error_class)


def is_of_class(value: object, expected: type) -> bool:
    """Return whether a value is of a class, or of an equal class with the same name and fields.

    A cell of a notebook that runs again defines its classes again.
    """
    if isinstance(value, expected):
        return True
    actual = type(value)
    if (actual.__module__, actual.__qualname__) != (expected.__module__, expected.__qualname__):
        return False
    return getattr(actual, "__annotations__", {}) == getattr(expected, "__annotations__", {})


def has_methods(name: str, value: object, what: str, *methods: str) -> None:
    """Check that an argument has methods; TypeError that calls it ``what`` if not."""
    has_all = all(callable(getattr(value, method, None)) for method in methods)
    require(has_all and not isinstance(value, type), name, f"be {what}", value, TypeError)


_NO_BATCHES = "each transition or sample is learned by itself: omit it"
_NO_GRADIENT = "there is no gradient descent: omit it"
_NO_POLICY = "there is no policy network: approximator and learning hold the settings"
_FIRST = "the environment is first: SDNNQLambda(env), train(env, steps=...), evaluate(agent, env)"

_MEANINGS: Mapping[tuple[str, ...], tuple[str, ...]] = {
    ("gamma", "discount_factor", "discount_rate"): ("discount",),
    ("alpha", "lr", "eta", "eta0", "step_size", "learning_rate_init"): (
        "learning_rate", "learning_coefficient", "correction_share"),
    ("learning_rate",): ("learning_coefficient", "correction_share"),
    ("gae_lambda", "lam", "lambda_", "lamda", "trace_lambda"): ("trace_decay",),
    ("eps", "start_e", "epsilon_start", "initial_epsilon", "exploration_initial_eps",
     "exploration_rate"): ("epsilon",),
    ("end_e", "epsilon_end", "epsilon_min", "min_epsilon", "exploration_final_eps"): (
        "final_epsilon",),
    ("epsilon_decay", "exploration_decay", "exploration_steps"): ("exploration_fraction",),
    ("learning_starts", "random_steps", "burn_in"): ("warm_up_steps", "start_steps"),
    ("n_step", "multi_step"): ("n_steps",),
    ("total_timesteps", "timesteps", "n_timesteps", "num_timesteps", "total_steps", "max_steps",
     "n_steps"): ("steps",),
    ("n_episodes", "num_episodes", "max_episodes", "total_episodes"): ("episodes",),
    ("n_eval_episodes", "eval_episodes", "num_eval_episodes"): ("evaluation_episodes", "episodes"),
    ("eval_freq", "eval_every", "evaluation_frequency"): ("evaluate_every",),
    ("eval_env",): ("evaluation_env",),
    ("callback", "eval_callback", "log_interval"): ("callbacks",),
    ("verbose", "progress_bar", "show_progress", "use_tqdm"): (
        "progress", "a bar shows by itself in a terminal: omit it"),
    ("tensorboard_log", "tb_log_name", "track"): (
        "tensorboard", "train(env, callbacks=[TensorBoard(folder)])"),
    ("save_freq", "checkpoint_freq", "save_every"): (
        "checkpoint_every", "train(env, callbacks=[CheckpointCallback(...)])"),
    ("random_seed", "rng", "seed", "random_state"): ("seed", "random_state"),
    ("n_envs", "num_envs"): (
        "n_envs", "train takes a vector environment: gymnasium.make_vec(id, num_envs=...)"),
    ("env", "env_id", "gym_id", "environment"): ("environment", _FIRST),
    ("algo", "algorithm", "model"): ("agent", "name"),
    ("obs",): ("observation",),
    ("deterministic",): ("act(observation, explore=False) acts greedily",),
    ("reset_num_timesteps",): ("Training.load resumes a training that Training.save wrote",),
    ("normalize", "norm_obs", "normalize_observations"): ("observation_range",),
    ("save_path", "log_dir", "logdir", "save_dir", "output_dir"): ("out", "path"),
    ("epochs", "n_epochs", "num_epochs", "nb_epoch", "n_iter"): ("max_iter", "epochs"),
    ("patience", "max_no_improvement_evals"): ("n_iter_no_change", "max_evaluations"),
    ("validation_split",): ("validation_fraction",),
    ("bins", "num_bins", "n_tilings"): ("n_bins", "approximator"),
    ("hidden_layer_sizes", "hidden_size", "hidden_units", "units"): (
        "n_hidden_units", "n_pattern_units"),
    ("policy", "policy_kwargs", "net_arch", "q_network", "features_extractor_class"): (_NO_POLICY,),
    ("batch_size", "buffer_size", "train_freq", "train_frequency", "gradient_steps", "tau",
     "target_update_interval", "target_network_frequency", "replay_buffer_class",
     "replay_buffer_kwargs", "optimize_memory_usage"): (_NO_BATCHES,),
    ("optimizer", "optimizer_class", "loss", "activation", "dropout", "ent_coef", "vf_coef",
     "clip_range", "max_grad_norm", "normalize_advantage", "metrics", "solver"): (_NO_GRADIENT,),
    ("device", "cuda", "gpu"): ("everything runs on the CPU: omit it",),
}  # fmt: skip
"""Names in other libraries, and the corresponding names or advice here, the best first.

Stable-Baselines3, CleanRL, scikit-learn and Keras have them.
"""
HABITS = {habit: meaning for habits, meaning in _MEANINGS.items() for habit in habits}


def advice(
    name: str, possible: Iterable[str], elsewhere: Mapping[str, str] = MappingProxyType({})
) -> str:
    """Return a hint for an unknown name: a suggestion, and all possible names by similarity.

    ``elsewhere`` has names that are possible in other places, and how they are written there.

    >>> advice("gamma", ("epsilon", "discount"))
    'did you mean discount? possible: discount, epsilon'
    >>> advice("steps", ("seed",), {"steps": "budget.steps"})
    'did you mean budget.steps? possible: seed'
    """
    known = tuple(possible)
    word = name.strip("-").replace("-", "_").lower()
    meanings = (word, *HABITS.get(word, ()))
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    near = [meaning for meaning in meanings if meaning in known] + near
    hints = [meaning for meaning in meanings if meaning in known]
    hints += [elsewhere[meaning] for meaning in meanings if meaning in elsewhere]
    hints += difflib.get_close_matches(name, known, n=1, cutoff=0.7)
    hints += map(elsewhere.__getitem__, difflib.get_close_matches(name, elsewhere, 1, 0.8))
    sentence = next((meaning for meaning in meanings if " " in meaning), "")
    hint = f"did you mean {hints[0]}? " if hints else f"{sentence}; " if sentence else ""
    listed = ", ".join(dict.fromkeys([*near, *known]))
    return f"{hint}possible: {listed}" if known else hint.strip("; ")


def explains_names(
    elsewhere: Callable[[Any], Mapping[str, str]] = lambda _: {},
) -> Callable[[Called], Called]:
    """Make a decorator that adds hints to the errors of calls with unknown arguments.

    ``elsewhere`` maps the first argument of a call to names in other places, as in `advice`.

    >>> @explains_names()
    ... def wait(seconds):
    ...     pass
    >>> wait(second=1)
    Traceback (most recent call last):
    TypeError: second is no argument of wait: did you mean seconds? possible: seconds
    """

    def decorate(called: Called) -> Called:
        if isinstance(called, type):
            called.__init__ = decorate(called.__init__)  # type: ignore[misc]
            return called

        @functools.wraps(called)
        def call(*arguments: Any, **options: Any) -> object:
            try:
                return called(*arguments, **options)
            except TypeError as error:
                if error.__traceback__ is None or error.__traceback__.tb_next is not None:
                    raise  # the function itself raised the TypeError
                first = arguments[0] if arguments else None
                problem = _error_of_call(called, arguments, options, elsewhere(first))
                if problem is None:
                    raise
                raise problem from None

        return call  # type: ignore[return-value]

    return decorate


def _error_of_call(
    called: Callable[..., object], arguments: tuple[object, ...], options: Mapping[str, object],
    elsewhere: Mapping[str, str],
) -> Exception | None:  # fmt: skip
    """Return the error that explains why arguments do not fit a function; None if they fit."""
    is_made = called.__name__ == "__init__"
    who = type(arguments[0]).__name__ if is_made else called.__name__
    try:
        signature = inspect.signature(called)
    except ValueError:  # in the core, a class has the signature, not its `__init__`
        signature = inspect.signature(type(arguments[0]))
        arguments = arguments[1:]
    parameters = signature.parameters.values()
    names = [p.name for p in parameters if p.kind is not inspect.Parameter.VAR_KEYWORD]
    possible = [name for name in names if name not in ("self", "cls")]
    if len(names) == len(parameters):
        for name in options:
            if name not in names:
                problem = f"is no argument of {who}: {advice(name, possible, elsewhere)}"
                return argument_error(name, problem, TypeError)
    try:
        signature.bind(*arguments, **options)
    except TypeError as error:
        return TypeError(f"{who}: {error}; possible: {', '.join(possible)}")
    return None
