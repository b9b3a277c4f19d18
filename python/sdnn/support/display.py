"""Representations of agents, runs and results in a terminal and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from itertools import pairwise

_WIDTH, _HEIGHT = 240, 48  # of a small curve, in pixels


class Displayed:
    """An object that is displayed as the facts that `_facts` returns.

    >>> class Room(Displayed):
    ...     def _facts(self):
    ...         return {"area": "20 m2", "doors": 1}
    >>> Room()
    <Room: area 20 m2, doors 1>
    """

    def _facts(self) -> Mapping[str, object]:
        """Return the facts by name."""
        raise NotImplementedError

    def _curve(self) -> Sequence[float]:
        """Return numbers that a notebook draws as a small curve; by default none."""
        return ()

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {fact}" for name, fact in self._facts().items())
        return f"<{type(self).__name__}: {facts}>"

    def _repr_html_(self) -> str:
        """Return the facts as an HTML table and the curve as SVG, for notebooks."""
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td>{escape(str(fact))}</td></tr>"
            for name, fact in self._facts().items()
        )
        table = f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"
        return table + curve_svg(self._curve())


def curve_svg(values: Sequence[float], *, n_points: int = 80) -> str:
    """Return a small curve as SVG, for notebooks.

    Its points are means: values are cut into at most ``n_points`` parts of nearly equal length. The
    text is empty for fewer than two values, and if a mean is not finite.

    >>> curve_svg([5.0])
    ''
    """
    n = min(len(values), n_points)
    if n < 2:
        return ""
    limits = [len(values) * i // n for i in range(n + 1)]
    means = [sum(values[i:j]) / (j - i) for i, j in pairwise(limits)]
    if not all(map(math.isfinite, means)):
        return ""
    low, high = min(means), max(means)
    extent = (high - low) or 1.0  # a constant curve is a line at the bottom
    points = " ".join(
        f"{2 + _WIDTH * i / (n - 1):.1f},{2 + _HEIGHT * (1 - (mean - low) / extent):.1f}"
        for i, mean in enumerate(means)
    )
    label = f"{len(values):,} returns, {low:.4g} to {high:.4g} in the curve"
    return (
        f'<svg width="{_WIDTH + 4}" height="{_HEIGHT + 4}" role="img"><title>{label}</title>'
        f'<polyline fill="none" stroke="#1f5a96" stroke-width="1.5" points="{points}"/></svg>'
    )
