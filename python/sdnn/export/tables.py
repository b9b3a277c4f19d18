"""Tables of numbers in C."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Tables", "bit_planes", "by_dimension", "joined", "table_lines", "wrapped"]

_BYTES = {"uint8_t": 1, "uint16_t": 2, "int32_t": 4, "uint32_t": 4}


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
        stored = values if values.size else np.zeros(1, np.int64)  # C has no empty tables
        self.lines += table_lines(f"static const {kind} {name}", stored, form)

    def text(self) -> str:
        """Return all tables."""
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
    """Join lines, each with its end."""
    return "".join(f"{line}\n" for line in lines)


def by_dimension(actions: NDArray[Any]) -> NDArray[Any]:
    """Arrange actions as a table in C, (n_actions,) or (n_dimensions, n_actions)."""
    return actions[:, 0] if actions.shape[1] == 1 else actions.T


def bit_planes(weights: NDArray[np.int32]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Pack weights (n, D) as bit planes: words, unit by unit; planes and lowest weight of each.

    A weight minus the lowest one of its unit has as many bits as the unit's range needs.
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
