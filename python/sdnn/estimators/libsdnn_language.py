"""The language of LIBSDNN's parameter files: tags, entries, formulas and lists.

It knows nothing of what the entries mean. Every reader raises ValueError with what it expected.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

__all__ = ["entries_of", "items_of", "number_of", "whole_of"]

_OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}


def entries_of(text: str, path: Path) -> dict[str, str]:
    """Return the entries by their full names, such as ``SDNN/PC/n``."""
    tags: list[str] = []
    found: dict[str, str] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = re.sub(r"[\s{\0]", "", line.partition("%")[0])
        if "<" in stripped:
            tags.append(stripped.strip("<>"))
        elif "}" in stripped:
            if not tags:
                raise ValueError(f"{path}, line {number}: }} without a tag")
            tags.pop()
        elif "=" in stripped:
            name, _, value = stripped.partition("=")
            found["/".join([*tags, name])] = value
        elif stripped:
            raise ValueError(
                f"{path}, line {number}: must be a tag or name = value, got {line[:80]!r}"
            )
    return found


def number_of(text: str, what: str) -> float:
    """Return the value of a formula of numbers, ``+ - * / ^`` and parentheses."""

    def value(node: ast.expr) -> float:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return float(node.value)
        if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](value(node.operand))
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            left, right = float(value(node.left)), float(value(node.right))
            return _OPERATORS[type(node.op)](left, right)
        raise ValueError

    try:
        if len(text) > 1000:
            raise ValueError
        result = float(value(ast.parse(text.replace("^", "**"), mode="eval").body))
        if not np.isfinite(result):
            raise ValueError
    except (ValueError, SyntaxError, ArithmeticError, TypeError, RecursionError, MemoryError):
        raise ValueError(f"{what} must be a number, got {text[:80]!r}") from None
    return result


def items_of(text: str, what: str) -> list[str]:
    """Return the items of ``[a, b:3]``, that is ``[a, b, b, b]``; not cut in parentheses."""
    if not (text.startswith("[") and text.endswith("]")):
        raise ValueError(f"{what} must be a list in brackets, got {text[:80]!r}")
    found: list[str] = []
    for item in re.split(r",(?![^(]*\))", text[1:-1]):
        content, colon, times = item.partition(":")
        repeats = whole_of(times, f"repeats of {what}", 1, 100000) if colon else 1
        found += [content] * repeats
    return found


def whole_of(text: str, what: str, low: int, high: int = 2**31 - 1) -> int:
    """Return the value of a formula that must be a whole number within bounds."""
    value = number_of(text, what)
    if value != int(value) or not low <= value <= high:
        raise ValueError(f"{what} must be a whole number in [{low}, {high}], got {text[:80]}")
    return int(value)
