"""Agents of any class in files: which class rebuilds one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sdnn.files import Arrays, Description, read_file

__all__ = ["read_agent", "register"]

_CLASSES: dict[str, type[Any]] = {}


def register(kind: type[Any]) -> None:
    """Make a class of agents known by its name; its ``rebuild`` makes one of a file.

    A class that is defined again, as in a notebook or by a script that is imported too, takes the
    place of the one before.

    Raises
    ------
    TypeError
        If the name is that of a class of this package: a file could not tell them apart.
    """
    known = _CLASSES.get(kind.__name__, kind)
    is_ours = known.__module__.partition(".")[0] == "sdnn"
    if is_ours and known.__module__ != kind.__module__:
        raise TypeError(
            f"an agent's class needs a name of its own, for its files: {kind.__name__} is that of"
            f" {known.__module__}.{known.__qualname__}"
        )
    _CLASSES[kind.__name__] = kind


def read_agent(path: Path, *kinds: str) -> tuple[Any, Description, Arrays]:
    """Read a file of one of these kinds: its agent, its description and its arrays.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is damaged, of another kind or format, or does not fit together.
    """
    description, arrays = read_file(path, *kinds)
    name = description.get("class")
    if str(name) not in _CLASSES:
        raise ValueError(f"{path} holds an agent of an unknown class, {name!r}")
    try:
        return _CLASSES[str(name)].rebuild(description, arrays), description, arrays
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
