"""Text in C: plain C files with the names of one agent, tables, and the bins of observations."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn._core import __version__
from sdnn.environments.types import Array
from sdnn.support.arguments import argument_error, path_of, require, shown

_DIRECTION_BITS = 30
_BYTES = {
    "int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint16_t": 2,
    "int32_t": 4, "uint32_t": 4, "uint64_t": 8,
}  # fmt: skip
_LONGEST_NAME = 40

_INSTALLED = Path(__file__).parent / "c"
_FOLDER = _INSTALLED if _INSTALLED.is_dir() else Path(__file__).parents[3] / "cpp" / "c"
_INCLUDE = re.compile(r'#include "(\w+\.h)"\n')


@dataclass(frozen=True, kw_only=True)
class Header:
    """A C header: its file and its sizes."""

    name: str
    text: str
    flash_bytes: int
    weight_bytes: int
    ram_bytes: int


def require_c_name(name: object) -> str:
    """Return ``name``; ValueError if it cannot be the prefix of names in C."""
    fits = isinstance(name, str) and re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name)
    if not isinstance(name, str) or not fits or len(name) > _LONGEST_NAME:
        raise argument_error(
            "name",
            "must be a C identifier of letters, digits and single underscores between them,"
            f" at most {_LONGEST_NAME} long, got {shown(name)}",
        )
    return name


def header_file(path: str | Path, name: str | None) -> tuple[Path, str]:
    """Return the file to write a header to, and the prefix of its names.

    The prefix is ``name`` or, if that is None, the file's name without its ending.
    """
    file = path_of("path", path)
    require(not file.is_dir(), "path", f"be a file, such as {file / 'model.h'}", path)
    return file, file.stem if name is None else name


def header_text(
    name: str,
    *,
    title: str,
    made: Sequence[str],
    needs: Iterable[str],
    arithmetic: Iterable[str],
    usage: Iterable[str],
    constants: Iterable[str],
    code: str,
) -> str:
    """Return the text of a header; ``made`` are the lines about how it was made."""
    guard = f"SDNN_{name.upper()}_H"
    return joined([
        *comment(
            f"{name}.h: {title}, in C99 for small processors.",
            "",
            f"Made by sdnn {__version__} of an {made[0]}",
            *made[1:],
            "",
            *needs,
            "",
            "Needs <stdint.h> and nothing else of a C library; it is C++ too. It calculates in",
            *arithmetic,
            "",
            f'  #include "{name}.h"',
            *usage,
        ),
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "#include <stdint.h>",
        "",
        *constants,
        "",
        code,
        f"#endif /* {guard} */",
    ])  # fmt: skip


def c_source(file: str, name: str, unused: Sequence[str] = ()) -> str:
    """Return a C file with its includes inserted, and the prefix sdnn replaced by ``name``.

    Left out are includes of ``unused`` files, and what is only there with these: between ``#ifdef``
    with the macro that guards such a file and ``#endif``.
    """
    guards = [Path(part).stem.upper() + "_H" for part in unused]
    text = _with_includes(file, set(unused))
    if guards:
        text = re.sub(rf"#ifdef ({'|'.join(guards)})\n.*?#endif\n", "", text, flags=re.DOTALL)
    text = re.sub(r"\bsdnn_", f"{name}_", text)
    return re.sub(r"\bSDNN_", f"{name.upper()}_", text)


def _with_includes(file: str, included: set[str]) -> str:
    """Return the text of a C file, each of its includes replaced by that file once."""
    included.add(file)
    text = (_FOLDER / file).read_text("utf-8")
    return _INCLUDE.sub(
        lambda line: "" if line[1] in included else f"{_with_includes(line[1], included)}\n", text
    )


def comment(*lines: str) -> list[str]:
    """Return the lines of a comment in C."""
    body = [f" * {line}".rstrip() for line in lines]
    return [f"/*{body[0][2:]}", *body[1:], " */"]


def scaling_comment(lines: Iterable[str]) -> list[str]:
    """Return comment lines about the scaling of a run's noisy or redundant observations."""
    return comment(
        "What this policy observes is scaled, since its run had noise or redundant variables:",
        "each variable from its range to [0, 1], (value - low) / (high - low), and what lies",
        "beyond the range to 0 or 1. Wherever an observation has units below, it is these.",
        "",
        *(f"  {line}" for line in lines),
    )


def normalization_comment(wrapper: str, lines: Iterable[str]) -> list[str]:
    """Return comment lines about a wrapper that normalized an agent's observations."""
    name = re.sub(r"\W", "", wrapper, flags=re.ASCII)
    return comment(
        f"What this policy observes is normalized, as the wrapper {name} gave it:",
        "each variable is (value - mean) / sqrt(variance), with these at the end of training.",
        "Wherever an observation has units below, it is these.",
        "",
        *(f"  {line}" for line in lines),
    )


def define_lines(macro: str, values: Mapping[str, object]) -> list[str]:
    """Define macros, whose names begin with ``macro``; a list has a line for each element."""
    lines = []
    for name, value in values.items():
        rows = ["", *(f"  {row}" for row in value)] if isinstance(value, list) else [value]
        lines += " \\\n".join([f"#define {macro}_{name} {rows[0]}".rstrip(), *rows[1:]]).split("\n")
    return lines


@dataclass
class Tables:
    """Constants in C, whose names begin with ``prefix``, and their bytes."""

    prefix: str
    n_bytes: int = 0
    lines: list[str] = field(default_factory=list)

    def add(self, kind: str, name: str, values: Array, comment: str = "") -> None:
        """Add a table of one or two dimensions of a C type; ``name`` comes after the prefix."""
        self.n_bytes += _BYTES[kind] * values.size
        if comment:
            self.lines.append(f"/* {comment} */")
        form = {"uint64_t": "0x{:x}u"}.get(kind, "{}")
        if kind == "uint32_t" and "weights" in name:
            form = "0x{:x}"
        stored = values if values.size else np.zeros(1, np.int64)  # C has no empty arrays
        self.lines += table_lines(f"static const {kind} {self.prefix}_{name}", stored, form)


def table_lines(declaration: str, values: Array, form: str) -> list[str]:
    """Write a table of one or two dimensions in C."""
    sizes = "".join(f"[{n}]" for n in values.shape)
    rows = [wrapped(map(form.format, row)) for row in values.reshape(-1, values.shape[-1]).tolist()]
    if values.ndim > 1:
        for row in rows:
            row[0] = f"  {{{row[0].lstrip()}"
            row[-1] = f"{row[-1].rstrip(',')}}},"
    return [f"{declaration}{sizes} = {{", *(line for row in rows for line in row), "};"]


def wrapped(words: Iterable[str], width: int = 98) -> list[str]:
    """Join words with commas in lines, without spaces: large tables are most of a file."""
    lines, line = [], "  "
    for word in words:
        if len(line) + len(word) + 1 > width:
            lines.append(line)
            line = "  "
        line += f"{word},"
    return [*lines, line]


def c_strings(name: str, words: Iterable[str]) -> list[str]:
    r"""Write a table of words in C, as UTF-8.

    >>> print("\n".join(c_strings("sizes", ["no", "hm?"])))
    static const char* const sizes[] = {
      "no",
      "hm\077",
    };
    """
    quoted = [
        "".join(  # printable ASCII stays except ", ? and \\; other bytes are octal escapes
            chr(byte) if 31 < byte < 127 and chr(byte) not in '"?\\' else f"\\{byte:03o}"
            for byte in word.encode("utf-8", "backslashreplace")
        )
        for word in words
    ]
    return [f"static const char* const {name}[] = {{", *(f'  "{word}",' for word in quoted), "};"]


def bits_of(values: ArrayLike) -> NDArray[np.uint64]:
    """Return the bits of doubles, row by row."""
    return np.ascontiguousarray(values, np.float64).reshape(-1).view(np.uint64)


def real_number(value: ArrayLike) -> str:
    """Return a real number as a literal of the C headers, its bits.

    >>> real_number(1.0)
    'UINT64_C(0x3ff0000000000000)'
    """
    return f"UINT64_C(0x{bits_of(value)[0]:016x})"


def joined(lines: Iterable[str]) -> str:
    """Join lines, each with its end."""
    return "".join(f"{line}\n" for line in lines)


def rounded_up(n: int, size: int) -> int:
    """Return the least multiple of ``size`` that is not below ``n``."""
    return -(-n // size) * size


def by_dimension(actions: Array) -> Array:
    """Arrange actions as (n_actions,), or as (n_dimensions, n_actions)."""
    return actions[:, 0] if actions.shape[1] == 1 else actions.T


def weight_words(weights: NDArray[np.int32]) -> tuple[Array, Array]:
    """Pack weights (n, D) as bytes plus 128, those of four units in a word.

    Each four units have a row of D words with the low bytes of their weights, after a row with the
    high bytes if one is not 0. Returns all words in a row, and the number of rows, 1 or 2, of each
    four units. Missing units of the last four have the weight 0.
    """
    padded = np.pad(weights, ((0, -len(weights) % 4), (0, 0)))
    low = (padded + 128) % 256 - 128
    both = np.stack([(padded - low) // 256, low], axis=1) + 128
    fours = both.reshape(len(padded) // 4, 4, 2, -1).transpose(0, 2, 3, 1).astype(np.uint8)
    words = np.ascontiguousarray(fours).view("<u4")[..., 0]
    is_high = (words[:, 0] != 0x80808080).any(axis=1)  # four bytes of 0 plus 128
    is_needed = np.stack([is_high, np.ones_like(is_high)], axis=1)
    return words[is_needed].reshape(-1), 1 + is_high


@dataclass(frozen=True)
class Input:
    """An input of the network, and the observed variables from which it is computed."""

    kind: str  # "variable", "circular", "angle" or "symbol"
    at: Sequence[int]  # indices of observed variables
    low: float  # lower limit of the range, if it has one
    high: float
    n_bins: int

    def usage(self, number: int, *, is_running: bool) -> Iterator[str]:
        """Describe the input to a reader of the header, whose ranges may be running ones."""
        first = self.at[0]
        if self.kind == "angle":
            yield f"  input {number}: the angle of cosine observation[{first}] and sine"
            yield f"    observation[{self.at[1]}], from -pi to pi in {self.n_bins} bins"
        elif self.kind == "symbol":
            last = first + self.n_bins - 1
            yield f"  input {number}: which of observation[{first}] to observation[{last}] is 1"
        elif is_running and self.kind == "variable":
            yield f"  input {number}: observation[{first}] in {self.n_bins} bins of a range that"
            yield "    follows its readings"
        else:
            turn = ", an angle," if self.kind == "circular" else ""
            bounds = f"from {self.low:.6g} to {self.high:.6g} in {self.n_bins} bins"
            yield f"  input {number}: observation[{first}]{turn} {bounds}"


def conversions(inputs: Sequence[Input], name: str, fraction_bits: int) -> tuple[Tables, list[str]]:
    """Return tables and macro calls, one per input, that compute the bins of observations in C.

    Inputs of the same type and range share a table. The macros are those of sdnn_observation.h.
    """
    tables, names = Tables(name), dict[tuple[str | int, int], str]()

    def table(key: tuple[str | int, int], word: str, values: Array, comment: str) -> str:
        """Return the name of a C table; tables with the same key are written once."""
        if key not in names:
            names[key] = f"{name}_{word}_{len(names)}"
            tables.add("int32_t", f"{word}_{len(names) - 1}", values, comment)
        return names[key]

    calls = []
    for i, source in enumerate(inputs):
        n_bins, at, low = source.n_bins, source.at[0], source.low
        width = source.high - low
        if source.kind == "angle":
            about = "Cosine and sine of the angles where bins begin, from bin 1 on."
            bounds = table(("angle", n_bins), "directions", _directions(n_bins), about)
            calls.append(f"ANGLE({i}, {at}, {source.at[1]}, {n_bins}, {bounds})")
        elif source.kind == "symbol":
            calls.append(f"SYMBOL({i}, {at}, {n_bins})")
        elif source.kind == "circular":
            turns = ", ".join(f"UINT64_C({n})" for n in _turns(low, source.high, fraction_bits))
            calls.append(f"CIRCULAR({i}, {at}, {n_bins}, {low!r}, {width!r}, {turns})")
        else:
            about = f"The least reading in each bin of observation[{at}], from bin 1 on."
            values = _fixed_bounds(low, source.high, n_bins, fraction_bits)
            bounds = table((at, n_bins), "bounds", values, about)
            calls.append(f"VARIABLE({i}, {at}, {n_bins}, {low!r}, {width!r}, {bounds})")
    return tables, calls


def _fixed_bounds(low: float, high: float, n_bins: int, fraction_bits: int) -> Array:
    """Return the smallest fixed-point observations in bins 1, 2, ... n_bins - 1.

    They are found by bisection with the agent's own bins, so that rounding is the same.
    """
    wanted = np.arange(1, n_bins)
    below = np.full(wanted.shape, -(2**31) - 1)  # lower limits of the bisection, not in the bin
    least = np.full(wanted.shape, 2**31 - 1)  # upper limits, in the bin or a later one
    while (least - below > 1).any():
        middle = (below + least) // 2
        unit = np.clip((middle / 2.0**fraction_bits - low) / (high - low), 0.0, 1.0)
        is_in = (unit * n_bins).astype(np.int64) >= wanted
        least, below = np.where(is_in, middle, least), np.where(is_in, below, middle)
    return least


def _turns(low: float, high: float, fraction_bits: int) -> tuple[int, int]:
    """Return the unit and the offset of a circular observation in turns, times 2^64.

    The offset has 2^31 added, so that rounding never moves the start of a bin into the one before.
    """
    width = Fraction(high) - Fraction(low)
    rate = round(2**64 / (width * 2**fraction_bits)) % 2**64
    return rate, (round(-Fraction(low) / width * 2**64) + 2**31) % 2**64


def _directions(n_bins: int) -> Array:
    """Return cosine and sine of the angles at which bins 1, 2, ... begin, (n_bins - 1, 2)."""
    angles = [math.pi * (2 * b - n_bins) / n_bins for b in range(1, n_bins)]
    ends = np.array([(math.cos(angle), math.sin(angle)) for angle in angles])
    rounded: Array = np.round(ends.reshape(-1, 2) * 2**_DIRECTION_BITS).astype(np.int64)
    return rounded
