"""The colors of the curves in all figures."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["COLORS", "colors_of"]

COLORS = (
    "#1f5a96", "#c2542d", "#3c7d4b", "#7a5195", "#8a6d1d", "#4a4a4a",
    "#2a9d9d", "#c65b8e", "#7fa328", "#9b3d3d",
)  # fmt: skip


def colors_of(places: Sequence[int]) -> list[str]:
    """Give things their colors by their places in a list of which they are a part.

    A thing has the same color whatever else is shown. Only where two would have the same, the later
    one takes the next that is free, while there is any.
    """
    taken: list[int] = []
    for place in places:
        turns = [(place + turn) % len(COLORS) for turn in range(len(COLORS))]
        taken.append(next((color for color in turns if color not in taken), turns[0]))
    return [COLORS[number] for number in taken]
