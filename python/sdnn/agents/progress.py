"""A line on a terminal that says how far a training is."""

from __future__ import annotations

from collections import deque
from statistics import median
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from sdnn.agents.callbacks import Callback, Row
from sdnn.agents.training import Training

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["ProgressLine"]

_STEPS_BETWEEN = 64
"""Between two looks at the clock of the line, which costs more than a step."""

_RETURNS = 20


class ProgressLine(Callback):
    """Shows a line of progress on a terminal, and nothing elsewhere.

    Parameters
    ----------
    console
        Where to draw.
    title
        What is learned.
    """

    def __init__(self, console: Console, title: str) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[news]}"),
            TimeRemainingColumn(compact=True),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._progress.add_task(title, total=None, news="")
        self._returns: deque[float] = deque(maxlen=_RETURNS)
        self._evaluation = ""

    def on_start(self, training: Training) -> None:
        """Begin the line."""
        total = training.steps if training.steps is not None else training.episodes
        self._progress.update(self._task, total=total, completed=_done(training))
        self._progress.start()

    def on_row(self, training: Training, row: Row) -> None:
        """Remember what is new."""
        if row["kind"] == "evaluation":
            self._evaluation = f", evaluation {row['mean_return']:.4g}"
        else:
            self._returns.append(row["return"])

    def on_step(self, training: Training) -> None:
        """Move on now and then."""
        if training.n_steps % _STEPS_BETWEEN == 0:
            news = f"return {median(self._returns):.4g}" if self._returns else ""
            self._progress.update(
                self._task, completed=_done(training), news=news + self._evaluation
            )

    def on_end(self, training: Training) -> None:
        """Take the line away."""
        self._progress.stop()


def _done(training: Training) -> int:
    return training.n_steps if training.steps is not None else training.n_episodes
