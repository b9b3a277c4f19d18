"""Advice on columns of words that look like numbers in another notation."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable

import numpy as np

WORDS_HINT = "words need a coding of their own, such as coding=[('symbolic', columns)]"


def first_column_of_words(X: object) -> tuple[str | int | None, list[object]]:
    """Return the first column that cannot be read as numbers: its name or number, and values."""
    names = list(X.columns) if hasattr(X, "columns") else itertools.count()
    for name, column in zip(names, np.asarray(X).T, strict=False):
        try:
            column.astype(np.float64)
        except (TypeError, ValueError):
            return name, column.tolist()
    return None, []


def hint_about(values: Iterable[object]) -> str:
    """Return advice on a column of words that may be numbers in another notation.

    >>> hint_about(["19,1", "20,5"])
    "these are numbers with a decimal comma: pandas.read_csv(..., decimal=',') reads them"
    >>> hint_about(["1", "?"])
    "'?' marks missing values: replace it by NaN, as pandas.read_csv(..., na_values='?') does"
    """
    texts = sorted({value.strip() for value in values if isinstance(value, str)})
    marks = [text for text in texts if text.lower() in _MARKS]
    others = [text for text in texts if text not in marks and not _PLAIN.fullmatch(text)]
    hints = []
    units = {match[1] or match[2] for text in others if (match := _UNIT.fullmatch(text))}
    separators = {match[1] for text in others if (match := _THOUSANDS.fullmatch(text))}
    if len(separators) == 1 and all(map(_THOUSANDS.fullmatch, others)):
        thousands = f"pandas.read_csv(..., thousands={separators.pop()!r}) reads them"
        hints.append(f"these are numbers with thousands separators: {thousands}")
    elif others and all(map(_COMMA.fullmatch, others)):
        comma = "pandas.read_csv(..., decimal=',') reads them"
        hints.append(f"these are numbers with a decimal comma: {comma}")
    elif len(units) == 1 and all(map(_UNIT.fullmatch, others)):
        hints.append(
            f"these are numbers with the unit {units.pop()!r}: remove it, and give numbers"
        )
    elif others:
        return WORDS_HINT
    for mark in marks:
        is_mark = f"pandas.read_csv(..., na_values={mark!r}) does"
        hints.append(f"{mark!r} marks missing values: replace it by NaN, as {is_mark}")
    return "; ".join(hints) or WORDS_HINT


_PLAIN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}([,' \xa0\u202f])\d{3}(\1\d{3})*(\.\d*)?")
_COMMA = re.compile(r"[+-]?\d{1,3}(\.?\d{3})*,\d+|[+-]?\d*,\d+")
_UNIT = re.compile(r"[+-]?\d+(?:[.,]\d+)?\s*([^\d\s.,+-]{1,8})|([$€£¥])\s*\d+(?:[.,]\d+)?")
_MARKS = {"", "?", "-", "--", ".", "na", "n/a", "#n/a", "nan", "null", "none", "missing", "unknown"}
