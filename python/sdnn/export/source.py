"""Plain C files with the names of one agent."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

_INSTALLED = Path(__file__).parent / "c"
_FOLDER = _INSTALLED if _INSTALLED.is_dir() else Path(__file__).parents[3] / "cpp" / "c"
_INCLUDE = re.compile(r'#include "(\w+\.h)"\n')


def c_source(file: str, name: str) -> str:
    """Return a C file and those that it includes, with ``name`` instead of the prefix sdnn."""
    text = re.sub(r"\bsdnn_", f"{name}_", _with_includes(file, set()))
    return re.sub(r"\bSDNN_", f"{name.upper()}_", text)


def _with_includes(file: str, included: set[str]) -> str:
    included.add(file)
    text = (_FOLDER / file).read_text("utf-8")
    return _INCLUDE.sub(
        lambda line: "" if line[1] in included else f"{_with_includes(line[1], included)}\n", text
    )


def comment(*lines: str) -> list[str]:
    """Return the lines of a comment in C."""
    body = [f" * {line}".rstrip() for line in lines]
    return [f"/*{body[0][2:]}", *body[1:], " */"]


def define_lines(macro: str, values: Mapping[str, object]) -> list[str]:
    """Define macros, whose names begin with ``macro``; a list has a line for each element."""
    lines = []
    for name, value in values.items():
        rows = ["", *(f"  {row}" for row in value)] if isinstance(value, list) else [value]
        lines += " \\\n".join([f"#define {macro}_{name} {rows[0]}".rstrip(), *rows[1:]]).split("\n")
    return lines
