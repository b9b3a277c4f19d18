"""How a header finds the bins of a sample's values: the codings of an estimator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdnn.coding import Anchor, Circular, Coding, RandomInverse, WithMissing
from sdnn.coding.symbols import Categorical, Category, present
from sdnn.export.text import Tables, bits_of
from sdnn.support.arguments import shown

INPUT_BYTES = 16  # of a struct of sdnn_coded_inputs.h
_LARGEST = 2.0**400  # of the origin and the period of a circle, whose quotients must not overflow
_MOST_VALUES = 2**16


@dataclass(frozen=True)
class CodedInput:
    """An input of a header: the column of samples, and how its values are divided into bins."""

    column: int
    coding: Coding
    type: str
    values: NDArray[np.float64]

    @property
    def n_bins(self) -> int:
        """Number of bins but for that of missing values."""
        return present(self.coding).size

    @property
    def categories(self) -> tuple[Category, ...]:
        """The categories; none for numbers."""
        base = present(self.coding)
        return (base.categories or ()) if isinstance(base, Categorical) else ()

    def row(self, macro: str, first_value: int) -> str:
        """Return the fields of the input's struct in C."""
        unknown = self.coding.unknown if isinstance(self.coding, WithMissing) else ""
        fields = [
            self.column, self.n_bins, f"{macro}_{self.type}", int(unknown != ""),
            int(unknown == "missing"), len(self.values), first_value,
        ]  # fmt: skip
        return f"{{{', '.join(map(str, fields))}}},"

    def usage(self, name: str) -> str:
        """Describe the value of the input to a reader of the header."""
        base = present(self.coding)
        about = f"x[{self.column}], {name}" if name else f"x[{self.column}]"
        ends = base.ends()
        if isinstance(base, Circular):
            about += f": a number on a circle of {base.period!r}"
        elif self.type == "WORDS":
            about += f": the number of a category in CATEGORIES_{self.column}"
        elif ends is None:
            about += f": one of {self.n_bins} categories, which are numbers"
        else:
            about += f": a number from {ends[0]!r} to {ends[1]!r}"
        return about + (", or missing" if isinstance(self.coding, WithMissing) else "")


def coded_input(column: int, coding: Coding) -> CodedInput:
    """Return the input of a fitted coding; ValueError if C has none like it."""
    base = present(coding)
    if isinstance(base, Categorical):
        return _of_categories(column, coding, base)
    if isinstance(base, Circular):
        numbers = np.array([base.origin, base.period])
        if not (1 / _LARGEST < base.period < _LARGEST and abs(base.origin) < _LARGEST):
            problem = f"must have a period and an origin within 2^400, got {shown(base)}"
            raise ValueError(f"the coding of column {column} {problem}")
        return CodedInput(column, coding, "CIRCULAR", numbers)
    if not isinstance(base, RandomInverse | Anchor):
        problem = f"must be one of sdnn.coding for a C header, got {shown(base)}"
        raise ValueError(f"the coding of column {column} {problem}")
    low, high = base.ends()
    half_width = high / 2 - low / 2
    if base.knots is None or half_width == 0:
        return CodedInput(column, coding, "EVEN", np.array([low, high, low / 2, half_width]))
    knots = np.array(base.knots, dtype=np.float64)
    with np.errstate(over="ignore"):
        slopes = np.diff(knots[:, 1]) / np.diff(knots[:, 0])
    if not np.isfinite(slopes).all():
        raise ValueError(
            f"column {column} must have values that are not so close together for a C header with"
            " spacing='quantile': scale it, or use spacing='even'"
        )
    return CodedInput(column, coding, "KNOTS", knots.reshape(-1))


def _of_categories(column: int, coding: Coding, base: Categorical) -> CodedInput:
    """Return the input of a categorical column: words, or numbers that doubles hold exactly."""
    categories = base.categories or ()
    if len(categories) >= _MOST_VALUES:
        raise ValueError(
            f"column {column} must have fewer than {_MOST_VALUES} categories for a C header, got"
            f" {len(categories)}"
        )
    if not all(isinstance(category, bool | int | float) for category in categories):
        return CodedInput(column, coding, "WORDS", np.empty(0))
    numbers = np.array([float(category) for category in categories])
    if numbers.tolist() != list(categories):
        raise ValueError(
            f"column {column} must have categories that are words, or numbers that are exact as"
            f" floats, for a C header, got {shown(categories)}"
        )
    return CodedInput(column, coding, "NUMBERS", numbers + 0.0)  # minus 0 is 0


def add_inputs(tables: Tables, inputs: Sequence[CodedInput]) -> dict[str, object]:
    """Add the numbers of inputs to the tables; return the macros of the inputs."""
    n_before = np.cumsum([0, *(len(source.values) for source in inputs)]).tolist()
    values = np.concatenate([source.values for source in inputs])
    about = "Ranges and categories of the inputs: bits of doubles."
    tables.add("uint64_t", "values", bits_of(values), about)
    tables.n_bytes += INPUT_BYTES * len(inputs)
    macro = tables.prefix.upper()
    types = {source.type for source in inputs}
    return {
        "N_INPUTS": len(inputs),
        "HAS_KNOTS": int("KNOTS" in types),
        "HAS_CIRCLES": int("CIRCULAR" in types),
        "INPUTS": [
            source.row(macro, first) for source, first in zip(inputs, n_before, strict=False)
        ],
    }
