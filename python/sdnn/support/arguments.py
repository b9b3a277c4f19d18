"""Checks of arguments; each message names the argument, the expected and the given value."""

from __future__ import annotations

import functools
import inspect
import os
import reprlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

from sdnn.support.habits import advice

if TYPE_CHECKING:
    from numpy.typing import NDArray

Member = TypeVar("Member")
Called = TypeVar("Called", bound=Callable[..., Any])

_REPR = reprlib.Repr()  # its limits, in characters and items, are chosen
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
    """Convert a reward, a number, bool or array with a single number; ValueError for others.

    Numbers of other libraries, such as tensors, are accepted, too: they convert themselves.
    """
    if isinstance(reward, float):  # includes np.float64
        return float(reward)
    import numpy as np

    reward = single_number(reward)
    is_of_numpy = isinstance(reward, np.ndarray | np.generic)  # of several numbers, or none
    if isinstance(reward, SupportsFloat) and not is_of_numpy:
        with suppress(OverflowError, TypeError, ValueError):
            return float(reward)
    return _small_enough("reward", reward)


def duration_of(dt: object) -> float:
    """Convert a duration, a number or an array with a single one; ValueError for others."""
    return dt if type(dt) is float else _small_enough("dt", single_number(dt))


def _small_enough(name: str, value: object) -> float:
    """Return a number as a float; ValueError for other values and numbers beyond all floats.

    `real` has an OverflowError for the latter, which callers of `Agent.learn` would take for that
    of a weight.
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


def path_of(name: str, value: object, *, is_folder: bool = False) -> Path:
    """Check that an argument can name a file, or a folder; TypeError or ValueError if not."""
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if isinstance(text, str) and text and "\0" not in text and (Path(text).name or is_folder):
        return Path(text)
    error_class = TypeError if text is None else ValueError
    expected = "must be the name of a " + ("folder" if is_folder else "file")
    raise argument_error(name, f"{expected}, got {shown(value)}", error_class)


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
        """Wrap a function, or the constructor of a class."""
        if isinstance(called, type):
            called.__init__ = decorate(called.__init__)  # type: ignore[misc]
            return called

        @functools.wraps(called)
        def call(*arguments: Any, **options: Any) -> object:
            """Call the function; explain a TypeError of the call itself, not of its body."""
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
    is_constructor = called.__name__ == "__init__"
    title = type(arguments[0]).__name__ if is_constructor else called.__name__
    try:
        signature = inspect.signature(called)
    except ValueError:  # in the core, a class has the signature, not its `__init__`
        signature = inspect.signature(type(arguments[0]))
        arguments = arguments[1:]
    parameters = signature.parameters.values()
    names = [p.name for p in parameters if p.kind is not inspect.Parameter.VAR_KEYWORD]
    possible = [name for name in names if name not in ("self", "cls")]
    accepts_any_name = len(names) < len(parameters)  # it has **kwargs
    if not accepts_any_name:
        for name in options:
            if name not in names:
                problem = f"is no argument of {title}: {advice(name, possible, elsewhere)}"
                return argument_error(name, problem, TypeError)
    try:
        signature.bind(*arguments, **options)
    except TypeError as error:
        return TypeError(f"{title}: {error}; possible: {', '.join(possible)}")
    return None
