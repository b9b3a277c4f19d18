"""Bars on a terminal: of trainings, studies and measurements."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID
    from typing_extensions import Self

_SPEED_SECONDS = 60.0
"""Time over which the speed is averaged for the time left."""


class ProgressBars:
    """Shows a bar for each task on a terminal, and nothing elsewhere; a context manager."""

    def __init__(self, console: Console) -> None:
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeRemainingColumn,
        )

        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[news]}"),
            TimeRemainingColumn(compact=True),
            console=console,
            transient=True,
            disable=not console.is_terminal,
            speed_estimate_period=_SPEED_SECONDS,
        )
        self._tasks: dict[Hashable, TaskID] = {}

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._progress.stop()

    def add(self, key: Hashable, title: str, total: int | None) -> None:
        """Open the bar of a task, if it is not there."""
        if key not in self._tasks:
            self._tasks[key] = self._progress.add_task(title, total=total, news="")

    def update(self, key: Hashable, done: int, **fields: Any) -> None:
        """Move a bar; ``description`` is another title, ``news`` the text behind it."""
        if key in self._tasks:
            self._progress.update(self._tasks[key], completed=done, **fields)

    def remove(self, key: Hashable) -> None:
        """Remove a bar."""
        self._progress.remove_task(self._tasks.pop(key))

    def print(self, text: str) -> None:
        """Print a line above the bars, on a terminal or not."""
        self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)
