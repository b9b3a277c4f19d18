"""Agents of any class in files: which class rebuilds one, and what C++ leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sdnn.files import Arrays, Description, read_file

__all__ = ["completed", "read_agent", "register"]

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


def completed(description: Mapping[str, Any]) -> Mapping[str, Any]:
    """Add to a description that was begun in C++ what C++ does not ask for: spaces, mostly.

    Observations are of real numbers, and an action is a Box or a button or several.
    """
    if "observation_space" in description:
        return description
    observation, action = description["observation"], description["action"]
    ends = [observation["low"], observation["high"]]
    space = {"box": ends, "shape": [len(ends[0])], "dtype": "<f8"}
    if action["kind"] == "box":
        box = [action["low"], action["high"]]
        shape = action.get("shape", [len(box[0])])
        actions = {"box": box, "shape": shape, "dtype": "<i8" if action.get("whole") else "<f8"}
    elif len(action["start"]) == 1:
        actions = {"discrete": description["n_actions"][0], "start": int(action["start"][0])}
    else:
        start = [int(first) for first in action["start"]]
        actions = {"multi_discrete": description["n_actions"], "start": start, "dtype": "<i8"}
    inputs = observation["inputs"]
    asked = {
        "angles": [one["circular"] for one in inputs if "circular" in one],
        "angle_pairs": [one["angle"] for one in inputs if "angle" in one],
        "symbols": False,
        "low": observation["low"],
        "high": observation["high"],
    }
    return {
        "progress": 0.0,
        "warm_up_steps": 1000,
        "n_tables": 0,
        **description,
        "observation_space": space,
        "action_space": actions,
        "asked": asked,
    }
