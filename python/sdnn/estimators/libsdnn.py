"""LIBSDNN's parameter and model files: what they say, and the same network from it."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from sdnn import _core
from sdnn.estimators.libsdnn_language import entries_of, items_of, number_of, whole_of

Library = Literal["msvc", "libstdc++"]

MOST_DRAWN = 2**27
"""Flips, and words of 64 units, of the code tables that are drawn: some seconds of them."""


@dataclass(frozen=True, kw_only=True)
class LibsdnnInput:
    """How LIBSDNN codes one input: numbers in [0, 1], or symbols that are whole numbers from 0."""

    symbolic: bool
    n_bins: int
    n_flipped: int


@dataclass(frozen=True, kw_only=True)
class LibsdnnParameters:
    """What a parameter file says. Seeds are None where it asks for hardware entropy.

    ``output_range`` and ``step_size`` mean something for regression only, ``n_classes`` and
    ``scheme`` for classification only.
    """

    task: Literal["regression", "classification"]
    n_units: int
    inputs: tuple[LibsdnnInput, ...]
    pairs: tuple[tuple[int, int], ...]
    pattern_seed: tuple[int, ...] | None
    weight_seed: tuple[int, ...] | None
    initial_range: tuple[int, int] = (-5, 5)
    output_range: tuple[float, float] = (0.0, 1.0)
    step_size: float = 0.01
    n_classes: int = 2
    scheme: Literal["one_vs_one", "one_vs_rest"] = "one_vs_one"

    @property
    def n_output_units(self) -> int:
        """Perceptrons: one per output step, per class or per pair of classes."""
        if self.task == "regression":
            low, high = self.output_range
            return int((high - low) / self.step_size)
        return _core.n_units_for(self.scheme, self.n_classes)

    def bins(self, inputs: npt.ArrayLike) -> npt.NDArray[np.int32]:
        """Return the bins of samples: ``int(n_bins * x)``, or ``int(x)`` of a symbol, clipped.

        Parameters
        ----------
        inputs : array of shape (n_samples, n_inputs)

        Returns
        -------
        array of int32, shape (n_samples, n_inputs)
        """
        values = np.asarray(inputs, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != len(self.inputs):
            raise ValueError(
                f"inputs must have shape (n_samples, {len(self.inputs)}), got {values.shape}"
            )
        if not np.isfinite(values).all():
            raise ValueError("inputs must be finite, got NaN or infinity")
        factors = np.array([1 if one.symbolic else one.n_bins for one in self.inputs])
        highest = np.array([one.n_bins - 1 for one in self.inputs])
        bins: npt.NDArray[np.int32] = np.clip(np.trunc(values * factors), 0, highest).astype(
            np.int32
        )
        return bins

    def make_code(self, library: Library = "msvc") -> _core.SelectiveDesensitization:
        """Return the code with LIBSDNN's own tables; needs a seed in the file."""
        if self.pattern_seed is None:
            raise ValueError("random_seed of PC must be a list of numbers, got hardware_entropy")
        for one in {self.inputs[index] for pair in self.pairs for index in pair}:
            n_drawn = 2 * len(self.pairs) * one.n_bins * max(one.n_flipped, self.n_units // 64)
            if n_drawn > MOST_DRAWN:
                raise ValueError(
                    f"q of RANDOM_INVERSE is too large: {one.n_bins} patterns of {self.n_units} "
                    f"units, {one.n_flipped} flipped, in {2 * len(self.pairs)} tables"
                )
        sizes = [(one.n_bins, one.n_flipped) for one in self.inputs]
        pairs = np.array(self.pairs, dtype=np.int32)
        modified, modifiers = _core.libsdnn_tables(
            self.n_units, sizes, pairs, self.pattern_seed, library
        )
        return _core.SelectiveDesensitization(modified, modifiers, pairs)

    def make_layer(self, library: Library = "msvc") -> _core.ParallelPerceptron:
        """Return the untrained network, bit for bit; needs seeds in the file."""
        if self.weight_seed is None:
            raise ValueError("random_seed of NN must be a list of numbers, got hardware_entropy")
        code = self.make_code(library)
        # LIBSDNN's classifiers always start from [-5, 5].
        low, high = self.initial_range if self.task == "regression" else (-5, 5)
        weights, thresholds = _core.libsdnn_weights(
            self.n_output_units, code.n_columns, low, high, self.weight_seed, library
        )
        return _core.ParallelPerceptron(
            code, self.n_output_units, weights=weights, thresholds=thresholds
        )

    def make_trainer(
        self, layer: _core.ParallelPerceptron, inputs: npt.ArrayLike, targets: npt.ArrayLike
    ) -> _core.PDeltaTrainer | _core.PerceptronTrainer:
        """Return a trainer whose ``present(np.arange(n_samples))`` is one iteration of LIBSDNN."""
        bins = self.bins(inputs)
        if self.task == "regression":
            low = self.output_range[0]
            counts = (np.asarray(targets, dtype=np.float64).reshape(-1, 1) - low) / self.step_size
            return _core.PDeltaTrainer(layer, bins, counts)
        labels = np.asarray(targets, dtype=np.int32)
        return _core.PerceptronTrainer(layer, bins, labels, self.n_classes, self.scheme)


@dataclass(frozen=True, kw_only=True)
class LibsdnnModel:
    """A trained network from a model file."""

    parameters: LibsdnnParameters
    layer: _core.ParallelPerceptron

    def predict(self, inputs: npt.ArrayLike, n_threads: int = 1) -> npt.NDArray[Any]:
        """LIBSDNN's outputs: numbers, or classes from 0.

        Parameters
        ----------
        inputs : array of shape (n_samples, n_inputs)
        n_threads : int

        Returns
        -------
        array of shape (n_samples,)
        """
        given = self.parameters
        bins = given.bins(inputs)
        if given.task == "regression":
            counts = self.layer.counts(bins, n_threads=n_threads)[:, 0]
            outputs: npt.NDArray[Any] = given.step_size * counts + given.output_range[0]
            return outputs
        potentials = self.layer.potentials(bins, n_threads=n_threads)
        if given.scheme == "one_vs_rest":  # class 0 if no unit fires
            classes: npt.NDArray[Any] = np.maximum(potentials, 0).argmax(axis=1)
            return classes
        votes = np.zeros((len(bins), given.n_classes), dtype=np.int64)
        first, second = np.triu_indices(given.n_classes, 1)
        for unit, (i, j) in enumerate(zip(first, second, strict=True)):
            firing = potentials[:, unit] > 0
            votes[:, i] += firing
            votes[:, j] += ~firing
        winners: npt.NDArray[Any] = votes.argmax(axis=1)
        return winners


def read_parameter_file(path: str | Path) -> LibsdnnParameters:
    """Read a parameter file.

    Raises
    ------
    ValueError
        If it is not one, lacks an entry, or asks for codes by correlation matrix, which cannot be
        reproduced.
    """
    path = Path(path)
    return _parameters(entries_of(path.read_text("latin-1"), path), path)


def read_model_file(path: str | Path, library: Library = "msvc") -> LibsdnnModel:
    """Read a model file: the parameters as text, then thresholds and weights.

    Parameters
    ----------
    path : path
    library : {"msvc", "libstdc++"}
        The C++ library of the program that wrote it. A model file holds seeds instead of code
        tables, and the two make different tables of the same seed: LIBSDNN's own programs are
        "msvc"; built with GCC it is "libstdc++".

    Raises
    ------
    ValueError
        If it is not a model file, is cut off, its size does not fit its parameters, or its weights
        are too large for exact sums.
    """
    path = Path(path)
    content = path.read_bytes()
    length = struct.unpack_from("<i", content)[0] if len(content) >= 4 else -1
    if not 0 < length <= len(content) - 4:
        raise ValueError(f"{path} must begin with the length of its parameters, got {length}")
    parameters = _parameters(entries_of(content[4 : 4 + length].decode("latin-1"), path), path)
    n_units = parameters.n_output_units
    n_columns = len(parameters.pairs) * parameters.n_units
    expected = 4 * n_units * (n_columns + 1)
    if len(content) - 4 - length != expected:
        raise ValueError(
            f"{path} must have {expected} bytes of weights for {n_units} units of {n_columns} "
            f"columns, got {len(content) - 4 - length}"
        )
    rows = np.frombuffer(content, "<i4", offset=4 + length).reshape(n_units, n_columns + 1)
    try:
        layer = _core.ParallelPerceptron(
            parameters.make_code(library),
            n_units,
            weights=np.ascontiguousarray(rows[:, 1:], dtype=np.int32),
            thresholds=np.ascontiguousarray(rows[:, 0], dtype=np.int32),
        )
    except OverflowError as error:
        raise ValueError(f"{path} cannot be used: {error}") from None
    return LibsdnnModel(parameters=parameters, layer=layer)


def _seed(text: str, what: str) -> tuple[int, ...] | None:
    if text == "hardware_entropy":
        return None
    return tuple(whole_of(item, what, 0, 2**32 - 1) for item in items_of(text, what))


def _input(text: str, n_units: int) -> LibsdnnInput:
    found = re.fullmatch(r"(NUMERICAL|SYMBOLIC)\((\w+)\((.*)\)\)", text)
    if found is None:
        raise ValueError(f"input_type_and_creation_method must name a method, got {text[:80]!r}")
    kind, method, arguments = found.groups()
    if method != "RANDOM_INVERSE":
        raise ValueError(
            f"input_type_and_creation_method must be RANDOM_INVERSE to be reproduced, got {method}"
        )
    sizes = arguments.split(",")
    if len(sizes) != 2:
        raise ValueError(f"RANDOM_INVERSE must have two arguments, got {arguments[:80]!r}")
    return LibsdnnInput(
        symbolic=kind == "SYMBOLIC",
        n_bins=whole_of(sizes[0], "q of RANDOM_INVERSE", 1, 2**24),
        n_flipped=whole_of(sizes[1], "r of RANDOM_INVERSE", 1, n_units // 2 - 1),
    )


def _pairs(entries: dict[str, str], n_inputs: int, path: Path) -> tuple[tuple[int, int], ...]:
    method = entries.get("SDNN/SD/combination_setting", "mutual")
    if method == "mutual":
        return tuple((i, j) for i in range(n_inputs) for j in range(n_inputs) if i != j)
    if method == "saved":
        line = entries.get("SDNN/SD/line", "[(0,1),(1,0)]")
        lines = [item.strip("()") for item in items_of(line, "SDNN/SD/line")]
    elif method == "file":
        file = path.parent / entries.get("SDNN/SD/filename", "")
        if not file.is_file():
            raise ValueError(f"SDNN/SD/filename must be a file beside {path}, got {file}")
        lines = [line for line in file.read_text("latin-1").split() if line]
    else:
        raise ValueError(f"combination_setting must be mutual, saved or file, got {method!r}")
    pairs = []
    for one in lines:
        inputs = one.split(",")
        if len(inputs) != 2:
            raise ValueError(f"a combination must be two inputs, got {one[:80]!r}")
        mu, nu = (whole_of(item, "an input of a combination", 0, n_inputs - 1) for item in inputs)
        pairs.append((mu, nu))
    if not pairs:
        raise ValueError(f"{path} must combine at least one pair of inputs")
    return tuple(pairs)


def _parameters(entries: dict[str, str], path: Path) -> LibsdnnParameters:
    def entry(name: str, default: str | None = None) -> str:
        if name in entries:
            return entries[name]
        if default is None:
            raise ValueError(f"{path} must have the entry {name.replace('/', ' / ')}")
        return default

    task = entry("ISSUE/type", "function_approximation")
    if task not in ("function_approximation", "pattern_recognition"):
        raise ValueError(
            f"ISSUE / type must be function_approximation or pattern_recognition, got {task!r}"
        )
    n_inputs = whole_of(entry("ISSUE/input_number"), "input_number", 1, 10000)
    n_units = whole_of(entry("SDNN/PC/n"), "n", 2, 2**24)
    if n_units % 2 != 0:
        raise ValueError(f"n must be even, got {n_units}")
    name = "SDNN/PC/input_type_and_creation_method"
    inputs = tuple(_input(item, n_units) for item in items_of(entry(name), name))
    if len(inputs) != n_inputs:
        raise ValueError(f"{name} must have input_number = {n_inputs} items, got {len(inputs)}")
    limits = items_of(entry("SDNN/NN/initial_value_range", "[-5,5]"), "initial_value_range")
    if len(limits) != 2:
        raise ValueError(f"initial_value_range must be two numbers, got {len(limits)}")
    low, high = (whole_of(item, "initial_value_range", -(10**6), 10**6) for item in limits)
    if low > high:
        raise ValueError(f"initial_value_range must rise, got [{low}, {high}]")
    given: dict[str, Any] = {}
    if task == "function_approximation":
        span = items_of(entry("ISSUE/FA/output_range"), "output_range")
        step = number_of(entry("ISSUE/FA/required_step_size"), "required_step_size")
        bounds = tuple(number_of(item, "output_range") for item in span)
        if len(bounds) != 2 or not 1e-6 <= step <= bounds[1] - bounds[0]:
            raise ValueError("output_range must be two numbers, a step size at least apart")
        given |= {"task": "regression", "output_range": bounds, "step_size": step}
    else:
        schemes = {"1v1": "one_vs_one", "1vR": "one_vs_rest"}
        scheme = entry("ISSUE/PR/multi_class_recognition", "1v1")
        if scheme not in schemes:
            raise ValueError(f"multi_class_recognition must be 1v1 or 1vR, got {scheme!r}")
        n_classes = whole_of(entry("ISSUE/PR/class_number"), "class_number", 2, 1024)
        given |= {"task": "classification", "n_classes": n_classes, "scheme": schemes[scheme]}
    return LibsdnnParameters(
        n_units=n_units,
        inputs=inputs,
        pairs=_pairs(entries, n_inputs, path),
        pattern_seed=_seed(entry("SDNN/PC/random_seed", "hardware_entropy"), "seed of PC"),
        weight_seed=_seed(entry("SDNN/NN/random_seed", "hardware_entropy"), "seed of NN"),
        initial_range=(low, high),
        **given,
    )
