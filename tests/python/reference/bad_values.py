"""Bad values, the cells that give them to parameters, and how a cell judges a refusal.

A cell is a name and a function that returns a fault, or "". It gives one bad value to one
parameter. The call must work, or refuse the value by a typed error that names the parameter and
shows the value.
"""

import contextlib
import inspect
import re

import gymnasium as gym
import numpy as np

from sdnn.support.arguments import shown

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
    "a list in itself": lambda: list_in_itself(),
    "lists 100,000 deep": lambda: nested(list, 100_000),
    "tuples 100,000 deep": lambda: nested(tuple, 100_000),
}
"""Functions that make bad values, by the words for them in the names of cells."""


def list_in_itself():
    items = []
    items.append(items)
    return items


def nested(sequence_type, n_levels):
    """Return lists or tuples within each other: 100,000 exceed Python's limit of recursion."""
    outer = sequence_type()
    for _ in range(n_levels):
        outer = sequence_type([outer])
    return outer


class EnoughError(Exception):
    """Ends a training that a bad value makes too long."""


def judged(parameter, call, reused=None, value=None):
    """Run ``call``, which returns the fault of an accepted value or ""; return the cell's fault.

    A refusal must name the parameter (a regular expression), show ``value()`` unless ``value`` is
    None, and leave the agent of ``reused``, a `ReusedAgent` or None, unchanged.
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
    """Return what is wrong with the message of a refusal, or ""."""
    message = str(error)
    summary = f"{type(error).__name__}: {message[:200]}"
    if "incompatible" in message or "not supported" in message:  # pybind11's or Python's message
        return f"said {summary}"
    if isinstance(error, OSError):
        return ""
    if not re.search(rf"\b{parameter}\b", message):
        return f"did not name {parameter}: {summary}"
    is_clear = value is None or is_shown(value(), message)
    return "" if is_clear else f"did not show the value: {summary}"


def is_shown(value, message):
    """Return whether a message shows a value: itself, or after "got" its type, shape or size."""
    if shown(value) in message:
        return True
    try:
        repr(value)
    except (RecursionError, ValueError):  # lists 100,000 deep; a number of 5,000 digits
        got = message.partition("got ")[2]
        return type(value).__name__ in got or "more" in got
    message = _without_addresses(message)
    if isinstance(value, gym.Space) or "bytes" in message:  # names the consequence instead
        return True
    if message.endswith("must be given"):  # a missing part has no value
        return True
    if any(_without_addresses(text) in message for text in _texts_of(value) if text):
        return True
    got = message.partition("got ")[2]
    descriptions = (*_descriptions_of(value), "more", "others", "a table")
    return "too large" in message or any(description in got for description in descriptions)


def _without_addresses(text):
    """Return a text in lower case without the addresses of objects, as in <object at 0x7f4a>."""
    return re.sub(r"0x[0-9a-f]+", "0x", text.lower())


def _with_items(value):
    return [value, *(value if isinstance(value, str | bytes | list | np.ndarray) else ())]


def _texts_of(value):
    """Return the texts that messages may have for a value, or for an item of it."""
    texts = [text for item in _with_items(value) for text in (repr(item), str(item))]
    for item in _with_items(value):
        if isinstance(item, int | float) and item < 10**300:  # as a double
            texts.append(f"{item:g}")
    if isinstance(value, list | dict):
        texts.append(str(tuple(value)))
    with contextlib.suppress(TypeError, ValueError, OverflowError, RuntimeWarning):
        texts.append(str(np.asarray(value, float).tolist()))
    return texts


def _descriptions_of(value):
    """Return the names of types, shapes and sizes of a value and its items."""
    descriptions = [type(item).__name__ for item in _with_items(value)]
    for item in _with_items(value):
        with contextlib.suppress(ValueError):  # of ragged lists
            descriptions += [str(np.shape(item)), str(np.size(item))]
    return descriptions


def parameters_of(function):
    """Return the names of the parameters of a function, without self, cls and **options."""
    parameters = inspect.signature(function).parameters.values()
    listed = [
        parameter.name for parameter in parameters if parameter.kind is not parameter.VAR_KEYWORD
    ]
    return [name for name in listed if name not in ("self", "cls")]


def bad_cells(label, parameters, cell, values=BAD):
    """Yield a cell for each parameter and each of the values, which are functions.

    ``label`` has a place {} for both names. ``cell(parameter, value)`` returns the function of a
    cell, which gives ``value()`` to the parameter.
    """
    for parameter in parameters:
        for value_name, value in values.items():
            yield label.format(f"{parameter}={value_name}"), cell(parameter, value)
