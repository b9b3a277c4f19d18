"""An agent's file: one safetensors file of arrays, with a description as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn._core import __version__
from sdnn.whole_files import write_whole

__all__ = [
    "Arrays",
    "Description",
    "completed",
    "from_file",
    "read",
    "rebuilt",
    "register",
    "write",
]

FORMAT = "sdnn-agent"
FORMAT_VERSION = 1
KEY = "sdnn"
"""Of the description in the file's metadata."""

Arrays = dict[str, NDArray[Any]]
Description = dict[str, Any]

_KINDS: dict[str, type[Any]] = {}


def register(kind: type[Any]) -> None:
    """Make a class of agents known by its name; its ``rebuild`` makes one of a file.

    A class that is defined again, as in a notebook or by a script that is imported too, takes the
    place of the one before.

    Raises
    ------
    TypeError
        If the name is that of a class of this package: a file could not tell them apart.
    """
    known = _KINDS.get(kind.__name__, kind)
    is_ours = known.__module__.partition(".")[0] == "sdnn"
    if is_ours and known.__module__ != kind.__module__:
        raise TypeError(
            f"an agent's class needs a name of its own, for its files: {kind.__name__} is that of"
            f" {known.__module__}.{known.__qualname__}"
        )
    _KINDS[kind.__name__] = kind


def rebuilt(description: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Any:
    """Make an agent of its description and arrays; older pickles name this function."""
    return _KINDS[description["class"]].rebuild(description, arrays)


def write(path: Path, description: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write an agent's file, as a whole or not at all.

    Parameters
    ----------
    path
        Of the file.
    description
        Data that JSON can hold; format and version are added.
    arrays
        By name.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    from safetensors.numpy import save as to_bytes

    contiguous = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    told = {"format": f"{FORMAT}-{FORMAT_VERSION}", "version": __version__, **description}
    write_whole(path, to_bytes(contiguous, metadata={KEY: json.dumps(told, allow_nan=False)}))


def read(path: Path) -> tuple[Description, Arrays]:
    """Read an agent's file: its description and its arrays.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is damaged, no agent's, or of a newer format.
    """
    from safetensors import SafetensorError, safe_open

    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder, not a file")
    if not path.exists():
        raise FileNotFoundError(f"{path} is not there")
    try:
        with safe_open(path, framework="numpy") as file:
            description = _description(path, (file.metadata() or {}).get(KEY, ""))
            arrays = {name: file.get_tensor(name) for name in list(file.keys())}
    except SafetensorError as error:
        raise ValueError(f"{path} is no agent's file, or damaged: {error}") from None
    return description, arrays


def _description(path: Path, text: str) -> Description:
    try:
        description = json.loads(text)
    except (RecursionError, ValueError):
        description = None
    name = description.get("format") if isinstance(description, dict) else None
    family, _, number = str(name).rpartition("-")
    if description is None or family != FORMAT or not number.isdigit():
        raise ValueError(f"{path} does not hold an agent of this package")
    if int(number) > FORMAT_VERSION:
        raise ValueError(
            f"{path} was written by a newer version of sdnn"
            f" ({description.get('version')}, this is {__version__}): update sdnn to read it"
        )
    if str(description.get("class")) not in _KINDS:
        raise ValueError(f"{path} holds an unknown kind of agent, {description.get('class')!r}")
    checked: Description = description
    return checked


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


def from_file(
    path: Path, description: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> Any:
    """Make the agent of a file that has been read; ValueError that names the file."""
    try:
        return rebuilt(description, arrays)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
