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
    """Shows a bar for each task on a terminal, and nothing elsewhere; a context manager.

    It is an observer of the engine (`sdnn.runs.engine.Observer`), too.
    """

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
        self._done: dict[Hashable, int] = {}
        self._n_open = 0

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._progress.stop()

    def add(self, key: Hashable, title: str, total: int | None) -> None:
        """Open the bar of a task."""
        self._tasks[key] = self._progress.add_task(title, total=total, news="")

    def update(self, key: Hashable, done: int, **fields: Any) -> None:
        """Move a bar; ``description`` is another title, ``news`` the text behind it."""
        if key in self._tasks:
            self._progress.update(self._tasks[key], completed=done, **fields)

    def remove(self, key: Hashable) -> None:
        """Remove a bar."""
        self._progress.remove_task(self._tasks.pop(key))

    # As an observer: a bar for each trial, one for all, one for what else is counted.

    def begun(self, n_planned: int, n_reused: int, n_episodes: int) -> None:
        """Open the bar of the whole run."""
        self._n_open = n_planned - n_reused
        self.add("all", self._title(), n_episodes)

    def advanced(self, planned: Any, done: int) -> None:
        """Move a trial's bar, which is opened first, and the whole one."""
        if planned.key not in self._tasks:
            self.add(planned.key, planned.title, planned.spec.length)
        self._done[planned.key] = done
        self.update(planned.key, done)
        self.update("all", sum(self._done.values()))

    def finished(self, planned: Any) -> None:
        """Close a trial's bar and count its episodes as passed."""
        self.advanced(planned, planned.spec.length)
        self.remove(planned.key)
        self._n_open -= 1
        self.update("all", sum(self._done.values()), description=self._title())

    def failed(self, planned: Any, error: Exception) -> None:
        """Close a trial's bar and count its episodes as passed."""
        self.finished(planned)

    def noted(self, text: str) -> None:
        """Print a line above the bars, on a terminal or not."""
        self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def counted(self, title: str, done: int, total: int) -> None:
        """Move the bar of something else, which is opened first."""
        if "counted" not in self._tasks:
            self.add("counted", title, total)
        self.update("counted", done, description=title)

    def _title(self) -> str:
        return f"[bold]all ({self._n_open} to go)"
