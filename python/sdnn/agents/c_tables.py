"""What a C header is made of: tables in C, and numbers as integers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Tables",
    "bit_planes",
    "by_dimension",
    "directions",
    "fixed_bounds",
    "joined",
    "table_lines",
    "turns",
    "used_units",
    "wrapped",
]

_BYTES = {"uint8_t": 1, "uint16_t": 2, "int32_t": 4, "uint32_t": 4}
_DIRECTION_BITS = 30


@dataclass
class Tables:
    """Constants in C, and their bytes."""

    n_bytes: int = 0
    lines: list[str] = field(default_factory=list)

    def add(self, kind: str, name: str, values: NDArray[Any], comment: str = "") -> None:
        """Add a table of one or two dimensions of a type of C."""
        self.n_bytes += _BYTES[kind] * values.size
        if comment:
            self.lines.append(f"/* {comment} */")
        form = "UINT32_C(0x{:08x})" if "weights" in name else "{}"
        told = values if values.size else np.zeros(1, np.int64)  # C has no empty tables
        self.lines += table_lines(f"static const {kind} {name}", told, form)

    def text(self) -> str:
        """Give all that was added."""
        return joined(self.lines)


def table_lines(declaration: str, values: NDArray[Any], form: str) -> list[str]:
    """Write a table of one or two dimensions in C."""
    sizes = "".join(f"[{n}]" for n in values.shape)
    rows = [wrapped(map(form.format, row)) for row in values.reshape(-1, values.shape[-1]).tolist()]
    if values.ndim > 1:
        for row in rows:
            row[0] = f"  {{{row[0].lstrip()}"
            row[-1] = f"{row[-1].rstrip(',')}}},"
    return [f"{declaration}{sizes} = {{", *(line for row in rows for line in row), "};"]


def wrapped(words: Iterable[str], width: int = 98) -> list[str]:
    """Write words with commas in lines."""
    lines, line = [], " "
    for word in words:
        if len(line) + len(word) + 2 > width:
            lines.append(line)
            line = " "
        line += f" {word},"
    return [*lines, line]


def joined(lines: Iterable[str]) -> str:
    """Give lines as a text that ends with the last one."""
    return "".join(f"{line}\n" for line in lines)


def by_dimension(actions: NDArray[Any]) -> NDArray[Any]:
    """Arrange actions as a table in C, (n_actions,) or (n_dimensions, n_actions)."""
    return actions[:, 0] if actions.shape[1] == 1 else actions.T


def used_units(network: Any, n_active_units: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Find the hidden units that are in a window, and where among them the windows begin."""
    first = network.first_units().astype(np.intp)
    used = np.unique(first[:, None] + np.arange(n_active_units))
    return used, np.searchsorted(used, first)


def bit_planes(weights: NDArray[np.int32]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Pack weights (n, D) as bit planes: words, unit by unit; planes and lowest weight of each.

    A weight less the lowest one of its unit has as many bits as the unit's range needs.
    """
    lowest = weights.min(axis=1)
    above = weights - lowest[:, None]
    n_bits = np.array([int(most).bit_length() for most in above.max(axis=1)])
    padded = np.pad(above, ((0, 0), (0, -above.shape[1] % 32)))
    planes = [
        np.packbits((padded >> bit & 1).astype(np.uint8), axis=1, bitorder="little").view("<u4")
        for bit in range(n_bits.max())
    ]
    if not planes:
        return np.zeros(0, np.uint32), n_bits, lowest
    is_needed = np.arange(len(planes)) < n_bits[:, None]
    return np.stack(planes, axis=1)[is_needed].reshape(-1), n_bits, lowest


def fixed_bounds(low: float, high: float, n_bins: int, fraction_bits: int) -> NDArray[Any]:
    """Find the least readings in bins 1, 2, ... n_bins - 1, integers times 2^-fraction_bits.

    Bins are calculated as those of observations are, rounding included, so that the table gives
    every integer the same bin.
    """
    wanted = np.arange(1, n_bins)
    below = np.full(wanted.shape, -(2**31) - 1)  # not in the bin, or not among the readings
    least = np.full(wanted.shape, 2**31 - 1)  # in the bin: ranges end before
    while (least - below > 1).any():
        middle = (below + least) // 2
        unit = np.clip((middle / 2.0**fraction_bits - low) / (high - low), 0.0, 1.0)
        is_in = (unit * n_bins).astype(np.int64) >= wanted
        least, below = np.where(is_in, middle, least), np.where(is_in, below, middle)
    return least


def turns(low: float, high: float, fraction_bits: int) -> tuple[int, int]:
    """Give a reading's unit as a part of a turn, and where reading 0 is in it; times 2^64.

    Rounding must not lead from the beginning of a bin into the one before: 2^31 are added.
    """
    width = Fraction(high) - Fraction(low)
    rate = round(2**64 / (width * 2**fraction_bits)) % 2**64
    return rate, (round(-Fraction(low) / width * 2**64) + 2**31) % 2**64


def directions(n_bins: int) -> NDArray[Any]:
    """Give cosine and sine of the angles where bins begin, from bin 1 on: (n_bins - 1, 2)."""
    angles = [math.pi * (2 * b - n_bins) / n_bins for b in range(1, n_bins)]
    ends = np.array([(math.cos(angle), math.sin(angle)) for angle in angles])
    rounded: NDArray[Any] = np.round(ends.reshape(-1, 2) * 2**_DIRECTION_BITS).astype(np.int64)
    return rounded
