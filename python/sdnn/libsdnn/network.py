"""The networks of LIBSDNN and its files of parameters and models, bit for bit."""

from __future__ import annotations

import ast
import operator
import re
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.support.arguments import one_of, path_of, require
from sdnn.support.files import read_bytes

Library = Literal["msvc", "libstdc++"]
# Chosen limits, so that a damaged or hostile file takes neither long nor much memory.
MOST_DRAWN = 2**27  # drawn flips and words of tables, which take some seconds
MOST_BYTES = 2**20  # size of a parameter file
MOST_BYTES_OF_MODEL = 2**31
MOST_ITEMS = 100_000  # length of a list
MOST_PAIRS = 1_000_000
MOST_CHARACTERS = 1000  # of a formula

OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}


@dataclass(frozen=True, kw_only=True)
class LibsdnnInput:
    """Coding of one input: numbers in [0, 1], or symbols (whole numbers from 0)."""

    symbolic: bool
    n_bins: int  # patterns; LIBSDNN's q
    n_flipped: int  # units by which consecutive patterns differ; LIBSDNN's r


@dataclass(frozen=True, kw_only=True)
class LibsdnnParameters:
    """The content of a parameter file; seeds are None for hardware entropy.

    ``n_units`` are those of a pattern. ``pairs`` are of inputs, (modified, modifier).
    ``output_range`` and ``step_size`` are for regression, ``n_classes`` and ``scheme`` for
    classification.
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

    def bins(self, inputs: ArrayLike) -> NDArray[np.int32]:
        """Return the bins of samples, shape (n_samples, n_inputs), values outside clipped."""
        values = np.asarray(inputs, dtype=np.float64)
        is_table = values.ndim == 2 and values.shape[1] == len(self.inputs)
        require(is_table, "inputs", f"have shape (n_samples, {len(self.inputs)})", values.shape)
        if not np.isfinite(values).all():
            raise ValueError("inputs must be finite, got NaN or infinity")
        factors = np.array([1 if coded.symbolic else coded.n_bins for coded in self.inputs])
        highest = np.array([coded.n_bins - 1 for coded in self.inputs])
        return np.asarray(np.clip(np.trunc(values * factors), 0, highest), dtype=np.int32)

    def make_code(self, library: Library = "msvc") -> _core.SelectiveDesensitization:
        """Return the code with LIBSDNN's own tables; needs a seed in the file."""
        if self.pattern_seed is None:
            raise ValueError("random_seed of PC must be a list of numbers, got hardware_entropy")
        n_tables = 2 * len(self.pairs)
        # Drawing a pattern takes as long as its flips, or as copying its units.
        for coded in {self.inputs[index] for pair in self.pairs for index in pair}:
            if n_tables * coded.n_bins * max(coded.n_flipped, self.n_units // 64) > MOST_DRAWN:
                raise ValueError(
                    f"q of RANDOM_INVERSE is too large: {coded.n_bins} patterns of {self.n_units} "
                    f"units, {coded.n_flipped} flipped, in {n_tables} tables"
                )
        sizes = [(coded.n_bins, coded.n_flipped) for coded in self.inputs]
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
        self, layer: _core.ParallelPerceptron, inputs: ArrayLike, targets: ArrayLike
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

    def predict(
        self, inputs: ArrayLike, n_threads: int = 1
    ) -> NDArray[np.float64] | NDArray[np.int64]:
        """Return LIBSDNN's outputs, numbers or classes from 0, shape (n_samples,)."""
        parameters = self.parameters
        bins = parameters.bins(inputs)
        if parameters.task == "regression":
            counts = self.layer.counts(bins, n_threads=n_threads)[:, 0]
            return np.asarray(parameters.step_size * counts + parameters.output_range[0])
        potentials = self.layer.potentials(bins, n_threads=n_threads)
        if parameters.scheme == "one_vs_rest":  # argmax gives class 0 if no unit fires
            return np.asarray(np.maximum(potentials, 0).argmax(axis=1))
        n_classes = parameters.n_classes
        votes = np.zeros((len(bins), n_classes), dtype=np.int64)
        for unit, (i, j) in enumerate(zip(*np.triu_indices(n_classes, 1), strict=True)):
            votes[:, i] += potentials[:, unit] > 0
            votes[:, j] += potentials[:, unit] <= 0
        return np.asarray(votes.argmax(axis=1))


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the name of the file to errors about its content."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def number_of(text: str, what: str) -> float:
    """Evaluate a formula of numbers, ``+ - * / ^`` and parentheses.

    ValueError that names ``what`` if it is none, or its value is not finite.
    """

    def value(node: ast.AST) -> float:
        """Evaluate a node of the parsed expression: numbers and arithmetic only."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return float(node.value)
        if isinstance(node, ast.UnaryOp):
            return OPERATORS[type(node.op)](value(node.operand))
        if isinstance(node, ast.BinOp):
            # A power of a negative number may be complex: float raises TypeError.
            return float(OPERATORS[type(node.op)](value(node.left), value(node.right)))
        raise ValueError

    if len(text) <= MOST_CHARACTERS:
        errors = ArithmeticError, LookupError, MemoryError, RecursionError, TypeError, ValueError
        with suppress(SyntaxError, *errors):  # of texts that are no formula, or very deep ones
            result = value(ast.parse(text.replace("^", "**"), mode="eval").body)
            if np.isfinite(result):
                return result
    raise ValueError(f"{what} must be a number, got {text[:80]!r}")


def whole_of(text: str, what: str, low: int, high: int = 2**31 - 1) -> int:
    """Evaluate a formula whose value must be a whole number within bounds."""
    value = number_of(text, what)
    if value != int(value) or not low <= value <= high:
        raise ValueError(f"{what} must be a whole number in [{low}, {high}], got {text[:80]}")
    return int(value)


def items_of(text: str, what: str) -> list[str]:
    """Return the items of ``[a, b:3]``, which is ``[a, b, b, b]``."""
    if not (text.startswith("[") and text.endswith("]")):
        raise ValueError(f"{what} must be a list in brackets, got {text[:80]!r}")
    items: list[str] = []
    for item in split_outside_brackets(text[1:-1]):
        content, colon, times = item.partition(":")
        items += [content] * (whole_of(times, f"repeats of {what}", 1, MOST_ITEMS) if colon else 1)
        if len(items) > MOST_ITEMS:
            raise ValueError(f"{what} must have at most {MOST_ITEMS} items")
    return items


def split_outside_brackets(text: str) -> list[str]:
    """Split at commas that are in no brackets.

    >>> split_outside_brackets("(0,1),b")
    ['(0,1)', 'b']
    """
    depth, begin, items = 0, 0, []
    for mark in re.finditer(r"[(),]", text):
        depth += {"(": 1, ")": -1, ",": 0}[mark[0]]
        if mark[0] == "," and depth == 0:
            items.append(text[begin : mark.start()])
            begin = mark.end()
    return [*items, text[begin:]]


class Entries(dict[str, str]):
    """The entries of a parameter file by full names, such as ``SDNN/PC/n``."""

    def __init__(self, text: str, path: Path) -> None:
        """Read lines ``name = value`` between ``<tag> {`` and ``}``; ``%`` begins a comment."""
        self.path = path
        tags: list[str] = []
        for number, line in enumerate(text.splitlines(), start=1):
            stripped = re.sub(r"[\s{\0]", "", line.partition("%")[0])
            if "<" in stripped:
                tags.append(stripped.strip("<>"))
                if len(tags) > 10:
                    raise ValueError(f"line {number}: more than 10 tags within each other")
            elif "}" in stripped:
                if not tags:
                    raise ValueError(f"line {number}: }} without a tag")
                tags.pop()
            elif "=" in stripped:
                name, _, value = stripped.partition("=")
                self["/".join([*tags, name])] = value
            elif stripped:
                raise ValueError(f"line {number}: must be a tag or name = value, got {line[:80]!r}")

    def __missing__(self, name: str) -> str:
        raise ValueError(f"it must have the entry {name.replace('/', ' / ')}")

    def one_of(self, name: str, default: str, *others: str) -> str:
        """Return an entry that is one of some words."""
        return one_of(name.replace("/", " / "), self.get(name, default), (default, *others))

    def whole(self, name: str, low: int, high: int) -> int:
        """Return an entry that is a whole number within bounds."""
        return whole_of(self[name], name.rpartition("/")[2], low, high)

    def list_of(self, name: str, default: str | None = None) -> list[str]:
        """Return the items of an entry that is a list."""
        text = self[name] if default is None else self.get(name, default)
        return items_of(text, name.rpartition("/")[2])

    def seed(self, name: str) -> tuple[int, ...] | None:
        """Return the numbers of a seed; None for hardware entropy."""
        if self.get(name, "hardware_entropy") == "hardware_entropy":
            return None
        return tuple(whole_of(item, name, 0, 2**32 - 1) for item in self.list_of(name))


def read_parameter_file(path: str | Path) -> LibsdnnParameters:
    """Read a parameter file.

    Raises ValueError if it is not one, lacks an entry, or uses codes by correlation matrix; OSError
    if it cannot be read or is not a regular file.
    """
    path = path_of("path", path)
    with naming(path):
        return _parse_parameters(read_bytes(path, MOST_BYTES).decode("latin-1"), path)


def read_model_file(
    path: str | Path, library: Library = "msvc", *, memory_limit: int = 2**27
) -> LibsdnnModel:
    """Read a model file: parameters as text, then thresholds and weights.

    Parameters
    ----------
    path : path
    library : {"msvc", "libstdc++"}
        The C++ library of the program that wrote it, which decides the tables of a seed. LIBSDNN's
        own programs are "msvc"; built with GCC they are "libstdc++".
    memory_limit : int
        Bytes that the patterns may take, which the file does not hold.

    Raises
    ------
    OSError
        If it cannot be read or is not a regular file.
    ValueError
        For another kind of file, a wrong size, or weights too large for exact sums.
    """
    path = path_of("path", path)
    with naming(path):
        content = read_bytes(path, MOST_BYTES_OF_MODEL)
        length = struct.unpack_from("<i", content)[0] if len(content) >= 4 else -1
        if not 0 < length <= len(content) - 4:
            raise ValueError(f"it must begin with the length of its parameters, got {length}")
        parameters = _parse_parameters(content[4 : 4 + length].decode("latin-1"), path)
        n_units = parameters.n_output_units
        n_columns = len(parameters.pairs) * parameters.n_units
        expected = 4 * n_units * (n_columns + 1)
        if len(content) - 4 - length != expected:
            raise ValueError(
                f"it must have {expected} bytes of weights for {n_units} units of {n_columns} "
                f"columns, got {len(content) - 4 - length}"
            )
        n_bins = sum(parameters.inputs[index].n_bins for pair in parameters.pairs for index in pair)
        if n_bins * parameters.n_units > memory_limit:
            raise ValueError(
                f"it needs {n_bins * parameters.n_units} bytes for {n_bins} patterns of"
                f" {parameters.n_units} units, more than memory_limit={memory_limit}"
            )
        # Each unit has a row of 32-bit numbers: its threshold, then its weights.
        rows = np.frombuffer(content, "<i4", offset=4 + length).reshape(n_units, n_columns + 1)
        try:
            layer = _core.ParallelPerceptron(
                parameters.make_code(library),
                n_units,
                weights=np.ascontiguousarray(rows[:, 1:], dtype=np.int32),
                thresholds=np.ascontiguousarray(rows[:, 0], dtype=np.int32),
            )
        except OverflowError as error:
            raise ValueError(f"it cannot be used: {error}") from None
        return LibsdnnModel(parameters=parameters, layer=layer)


def _parse_input(text: str, n_units: int) -> LibsdnnInput:
    """Return the coding of an input; patterns flip fewer than half of their units."""
    match = re.fullmatch(r"(NUMERICAL|SYMBOLIC)\(RANDOM_INVERSE\(([^,]*),([^,]*)\)\)", text)
    if match is None:
        raise ValueError(
            "input_type_and_creation_method must be NUMERICAL or SYMBOLIC, by RANDOM_INVERSE(q, r) "
            f"to be reproduced, got {text[:80]!r}"
        )
    input_type, n_bins, n_flipped = match.groups()
    return LibsdnnInput(
        symbolic=input_type == "SYMBOLIC",
        n_bins=whole_of(n_bins, "q of RANDOM_INVERSE", 1, 2**24),
        n_flipped=whole_of(n_flipped, "r of RANDOM_INVERSE", 1, n_units // 2 - 1),
    )


def _parse_pairs(entries: Entries, n_inputs: int) -> tuple[tuple[int, int], ...]:
    """Return the pairs (modified, modifier) of inputs: all, those listed, or those of a file."""
    method = entries.one_of("SDNN/SD/combination_setting", "mutual", "saved", "file")
    if method == "mutual":
        if n_inputs * (n_inputs - 1) > MOST_PAIRS:
            raise ValueError(f"mutual combinations of {n_inputs} inputs are more than {MOST_PAIRS}")
        return tuple((i, j) for i in range(n_inputs) for j in range(n_inputs) if i != j)
    if method == "saved":
        lines = [item.strip("()") for item in entries.list_of("SDNN/SD/line", "[(0,1),(1,0)]")]
    else:
        name = entries.get("SDNN/SD/filename", "")
        try:
            if Path(name).name != name:
                raise FileNotFoundError(f"not a name: {name!r}")
            content = read_bytes(entries.path.parent / name, MOST_BYTES)
        except OSError as error:
            raise ValueError(f"SDNN/SD/filename must be a file beside it: {error}") from error
        lines = content.decode("latin-1").split()
    pairs = []
    for line in lines:
        inputs = line.split(",")
        if len(inputs) != 2:
            raise ValueError(f"a combination must be two inputs, got {line[:80]!r}")
        modified, modifier = (
            whole_of(item, "an input of a combination", 0, n_inputs - 1) for item in inputs
        )
        pairs.append((modified, modifier))
    if not pairs:
        raise ValueError("it must combine at least one pair of inputs")
    return tuple(pairs)


def _parse_parameters(text: str, path: Path) -> LibsdnnParameters:
    """Read a parameter file; ValueError names the entry that is missing or out of range."""
    entries = Entries(text, path)
    task = entries.one_of("ISSUE/type", "function_approximation", "pattern_recognition")
    n_inputs = entries.whole("ISSUE/input_number", 1, 10000)
    n_units = entries.whole("SDNN/PC/n", 2, 2**24)
    if n_units % 2 != 0:
        raise ValueError(f"n must be even, got {n_units}")
    name = "SDNN/PC/input_type_and_creation_method"
    inputs = tuple(_parse_input(item, n_units) for item in entries.list_of(name))
    if len(inputs) != n_inputs:
        raise ValueError(f"{name} must have input_number = {n_inputs} items, got {len(inputs)}")
    name = "initial_value_range"
    limits = entries.list_of(f"SDNN/NN/{name}", "[-5,5]")
    bounds = [whole_of(item, name, -(10**6), 10**6) for item in limits[:2]]
    if len(limits) != 2 or bounds[0] > bounds[1]:
        raise ValueError(f"{name} must be two numbers that rise, got [{', '.join(limits)[:80]}]")
    parameters = LibsdnnParameters(
        task="regression" if task == "function_approximation" else "classification",
        n_units=n_units,
        inputs=inputs,
        pairs=_parse_pairs(entries, n_inputs),
        pattern_seed=entries.seed("SDNN/PC/random_seed"),
        weight_seed=entries.seed("SDNN/NN/random_seed"),
        initial_range=(bounds[0], bounds[1]),
    )
    if parameters.task == "classification":
        scheme = entries.one_of("ISSUE/PR/multi_class_recognition", "1v1", "1vR")
        return replace(
            parameters,
            n_classes=entries.whole("ISSUE/PR/class_number", 2, 1024),
            scheme="one_vs_one" if scheme == "1v1" else "one_vs_rest",
        )
    step = number_of(entries["ISSUE/FA/required_step_size"], "required_step_size")
    outputs = [number_of(item, "output_range") for item in entries.list_of("ISSUE/FA/output_range")]
    if len(outputs) != 2 or not 1e-6 <= step <= outputs[1] - outputs[0]:
        raise ValueError("output_range must be two numbers, a step size at least apart")
    return replace(parameters, output_range=(outputs[0], outputs[1]), step_size=step)
