"""Parameters of estimators, each declared once: its default and what it may be."""

from __future__ import annotations

import dataclasses
from numbers import Integral, Real
from typing import Any

from sklearn.utils._param_validation import Interval, StrOptions

SHARE = Interval(Real, 0, 1, closed="right")


def parameter(default: Any, *constraints: Any, kw_only: bool = True) -> Any:
    """Declare a parameter of an estimator: its default and scikit-learn's constraints."""
    metadata = {"constraints": list(constraints)}
    return dataclasses.field(default=default, kw_only=kw_only, metadata=metadata)


def words(*options: str) -> StrOptions:
    """Return the constraint of a parameter that is one of some words."""
    return StrOptions(set(options))


def wholes(low: int, high: int) -> Interval:
    """Return the constraint of a parameter that is a whole number, both ends included."""
    return Interval(Integral, low, high, closed="both")
