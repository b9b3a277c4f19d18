"""Checks of arguments: each message names the argument, what was expected and what was given."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Mapping
from contextlib import suppress
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from numpy.typing import NDArray

Member = TypeVar("Member")

_REPR = reprlib.Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 200
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = 12


def shown(value: Any) -> str:
    """Return the `repr` of any value for a message, shortened; lists may contain themselves.

    >>> shown(list(range(1000)))
    '[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, ...]'
    """
    try:
        return _REPR.repr(value)
    except Exception:  # a whole number of 5,000 digits, a class of a user
        return object.__repr__(value)


def array_of(name: str, value: Any, kinds: str = "fiub", what: str = "numbers") -> NDArray[Any]:
    """Read an array of any library, a number, or lists of such; ValueError for others.

    ``kinds`` are letters of the possible types, as in ``numpy.dtype.kind``, and ``what`` their word
    in messages. Masked arrays are refused: their mask would be lost.

    >>> array_of("levels", [0.5, "a"])
    Traceback (most recent call last):
    ValueError: levels must be numbers, got [0.5, 'a']
    """
    import numpy as np  # takes longer than all else that `import sdnn` loads

    is_plain = type(value) is np.ndarray or isinstance(value, np.generic)
    if is_plain and value.dtype.kind in kinds:
        return np.asarray(value)
    rows = value if isinstance(value, list | tuple) else [value]
    has_mask = any(isinstance(row, np.ma.MaskedArray) for row in rows)
    require(not has_mask, name, f"be {what} without a mask", value)
    try:
        array = np.asarray(value)
    except Exception:  # lists of several lengths, and what arrays of other libraries raise
        array = np.empty(0, object)
    require(array.dtype.kind in kinds, name, f"be {what}", value)
    return array


def argument_error(name: str, problem: str, kind: type[Exception] = ValueError) -> Exception:
    """Make an error about an argument, whose name is its attribute ``argument``.

    Errors of the core have this attribute, too.

    >>> argument_error("n_bins", "must be at least 2, got 1")
    ValueError('n_bins must be at least 2, got 1')
    """
    is_named = problem.startswith(f"{name},")  # with others, as the core does
    error: Any = kind(problem if is_named else f"{name} {problem}")
    error.argument = name
    return error  # type: ignore[no-any-return]


def require(
    is_so: object, name: str, expected: str, given: Any, kind: type[Exception] = ValueError
) -> None:
    """Raise an error about an argument unless something is so; ``expected`` follows "must".

    >>> require(False, "period", "be positive", -1)
    Traceback (most recent call last):
    ValueError: period must be positive, got -1
    """
    if not is_so:
        raise argument_error(name, f"must {expected}, got {shown(given)}", kind)


def blamed(error: BaseException) -> tuple[str, str]:
    """Return the argument that an error is about, and its message without the name.

    >>> blamed(argument_error("n_bins", "must be at least 2, got 1"))
    ('n_bins', 'must be at least 2, got 1')
    >>> blamed(KeyError())
    ('', 'KeyError')
    """
    name: str = getattr(error, "argument", "")
    return name, (str(error) or type(error).__name__).removeprefix(f"{name} ")


def choice(name: str, word: Any, members: Mapping[str, Member]) -> Member:
    """Find the member called ``word``; ValueError if none is.

    >>> choice("direction", "left", {"up": 1, "down": -1})
    Traceback (most recent call last):
    ValueError: direction must be one of 'up', 'down', got 'left'
    """
    try:
        return members[word]
    except (KeyError, TypeError):
        words = ", ".join(repr(member) for member in members)
        raise argument_error(name, f"must be one of {words}, got {shown(word)}") from None


def one_of(name: str, word: Any, words: tuple[str, ...]) -> str:
    """Check that an argument is one of some words; ValueError if not.

    >>> one_of("direction", "up", ("up", "down"))
    'up'
    """
    return choice(name, word, {member: member for member in words})


def _is_of_numpy(value: Any, *names: str) -> bool:
    """Return whether a value is one of NumPy's scalars of these names, without NumPy."""
    kind = type(value)
    return kind.__module__ == "numpy" and kind.__name__ in names


def _is_no_number(value: Any) -> bool:
    """Return whether it is a truth value or a duration, which Python and NumPy count as numbers."""
    return isinstance(value, bool) or _is_of_numpy(value, "timedelta64")


def whole(name: str, value: Any, low: int, high: int) -> int:
    """Check that an argument is a whole number within bounds; ValueError if not.

    >>> whole("n_bins", 1, 2, 65535)
    Traceback (most recent call last):
    ValueError: n_bins must be a whole number in [2, 65535], got 1
    """
    is_whole = isinstance(value, Integral) and not _is_no_number(value)
    if not is_whole or not low <= value <= high:
        raise argument_error(name, f"must be a whole number in [{low}, {high}], got {shown(value)}")
    return int(value)


def seed_of(value: Any) -> int:
    """Check that a seed is one that the core takes, in [0, 2**64); ValueError if not."""
    return whole("seed", value, 0, 2**64 - 1)


def real(name: str, value: Any) -> float:
    """Check that an argument is a number, perhaps NaN or infinite; ValueError if not.

    >>> real("period", "a day")
    Traceback (most recent call last):
    ValueError: period must be a number, got 'a day'
    """
    if type(value) is float:
        return value
    if not isinstance(value, Real) or _is_no_number(value):
        raise argument_error(name, f"must be a number, got {shown(value)}")
    try:
        return float(value)
    except OverflowError:
        problem = "must be a number of less than 1.8e308, got more"
        raise argument_error(name, problem, OverflowError) from None


def reward_of(reward: Any) -> float:
    """Read a reward: a number of any library, an array of one or a bool; else ValueError."""
    if isinstance(reward, float):  # NumPy's, too
        return float(reward)
    import numpy as np

    is_numpy = isinstance(reward, np.ndarray | np.generic)
    is_masked = isinstance(reward, np.ma.MaskedArray)
    if is_numpy and not is_masked and reward.size == 1 and reward.dtype.kind in "fiub":
        reward, is_numpy = reward.item(), False
    if not is_numpy and hasattr(reward, "__float__"):
        with suppress(OverflowError, TypeError, ValueError):
            return float(reward)
    try:
        return real("reward", reward)  # for its message
    except OverflowError as error:  # which would say of `Agent.learn` that a weight left its range
        raise ValueError(str(error)) from None


def flag(name: str, value: Any) -> bool:
    """Check that an argument is a bool, Python's or NumPy's; TypeError if not.

    >>> flag("explore", "no")
    Traceback (most recent call last):
    TypeError: explore must be True or False, got 'no'
    """
    if not isinstance(value, bool) and not _is_of_numpy(value, "bool", "bool_"):
        raise argument_error(name, f"must be True or False, got {shown(value)}", TypeError)
    return bool(value)


def path_of(name: str, value: Any) -> Path:
    """Check that an argument can name a file; TypeError or ValueError if not.

    >>> path_of("path", None)
    Traceback (most recent call last):
    TypeError: path must be the name of a file, got None
    """
    require(isinstance(value, str | os.PathLike), name, "be the name of a file", value, TypeError)
    text = os.fspath(value)
    is_name = isinstance(text, str) and text and "\0" not in text
    require(is_name, name, "be the name of a file", value)
    return Path(text)


def is_of_class(value: Any, kind: type[Any]) -> bool:
    """Return whether a value is of a class, or of one with its name and fields.

    A cell of a notebook that runs again defines its classes again.
    """
    if isinstance(value, kind):
        return True
    own = type(value)
    if (own.__module__, own.__qualname__) != (kind.__module__, kind.__qualname__):
        return False
    return getattr(own, "__annotations__", {}) == getattr(kind, "__annotations__", {})


def has_methods(name: str, value: Any, what: str, *methods: str) -> None:
    """Check that an argument has some methods; TypeError if not.

    >>> has_methods("env", 5, "a Gymnasium environment", "reset", "step")
    Traceback (most recent call last):
    TypeError: env must be a Gymnasium environment, got 5
    """
    has_all = all(callable(getattr(value, method, None)) for method in methods)
    require(has_all and not isinstance(value, type), name, f"be {what}", value, TypeError)
