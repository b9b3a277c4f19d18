"""Declarations of the parameters of estimators: defaults, constraints, documentation."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np
from sklearn.utils._param_validation import Interval, StrOptions

RandomState = int | np.random.RandomState | None
Estimator = TypeVar("Estimator")
SHARE = Interval(Real, 0, 1, closed="right")


def parameter(default: object, *constraints: object, kw_only: bool = True) -> Any:
    """Declare a parameter of an estimator: its default and scikit-learn's constraints."""
    metadata = {"constraints": list(constraints)}
    return dataclasses.field(default=default, kw_only=kw_only, metadata=metadata)


def words(*options: str) -> StrOptions:
    """Return the constraint of a parameter that is one of some words."""
    return StrOptions(set(options))


def wholes(low: int, high: int) -> Interval:
    """Return the constraint of a parameter that is a whole number, both ends included."""
    return Interval(Integral, low, high, closed="both")


def documents(base: type) -> Callable[[type[Estimator]], type[Estimator]]:
    """Make a decorator that adds the documented parameters of a base class to a docstring.

    Its sections Parameters and Attributes begin with the entries of the base class. Its Notes, if
    any, precede the Examples.
    """

    def decorate(estimator: type[Estimator]) -> type[Estimator]:
        """Insert the base's sections into the docstring of `estimator`."""
        text, of_base = inspect.getdoc(estimator), inspect.getdoc(base)
        if text is None or of_base is None:  # python -OO removes docstrings
            return estimator
        for title in ("Parameters", "Attributes", "Notes"):
            heading = f"{title}\n{'-' * len(title)}\n"
            section = of_base.partition(heading)[2].partition("\n\n")[0]
            if heading in text:
                text = text.replace(heading, f"{heading}{section}\n")
            elif section:
                text = text.replace("Examples\n---", f"{heading}{section}\n\nExamples\n---")
        estimator.__doc__ = text
        return estimator

    return decorate
