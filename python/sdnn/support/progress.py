"""Progress bars of trainings, studies and measurements."""

from __future__ import annotations

import time
from collections.abc import Hashable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

_SPEED_SECONDS = 60.0  # time over which the speed is averaged for the time left; chosen
_NOTEBOOK_SECONDS = 0.25  # least time between two changes of a notebook's output; chosen


class ProgressBars:
    """Bars of tasks on a terminal or in a notebook, shown within a ``with`` block.

    By default they are on standard error, and vanish from a terminal at the end. With ``remain``
    they stay there, and a file or pipe receives their last state, which it does not by default.
    """

    def __init__(self, console: Console | None = None, *, remain: bool = False) -> None:
        from rich import progress
        from rich.console import Console

        console = Console(stderr=True) if console is None else console
        self._is_notebook = console.is_jupyter
        self._output: Any = None  # a notebook's output: rich itself would need ipywidgets there
        self._due = 0.0  # monotonic time before which a notebook's output stays as it is
        self._progress = progress.Progress(
            progress.TextColumn("{task.description}"),
            progress.BarColumn(),
            progress.TaskProgressColumn(),
            progress.TextColumn("{task.fields[news]}"),
            progress.TimeRemainingColumn(compact=True),
            console=console,
            transient=not remain,
            disable=self._is_notebook or not (remain or console.is_terminal),
            speed_estimate_period=_SPEED_SECONDS,
        )
        self._tasks: dict[Hashable, TaskID] = {}

    def __enter__(self) -> Self:
        if not self._progress.disable:
            self._progress.start()
        self._draw()
        return self

    def __exit__(self, *_error: object) -> None:
        if not self._progress.disable:  # rich 14.2 and older would print an empty line
            self._progress.stop()
        self._due = 0.0  # draw at once, even if the last picture is recent
        self._draw()

    def _draw(self) -> None:
        """Update the output of a notebook, unless the last change is too recent."""
        now = time.monotonic()
        if not self._is_notebook or now < self._due:
            return
        self._due = now + _NOTEBOOK_SECONDS
        if self._output is None:
            self._output = import_module("IPython.display").DisplayHandle()
            self._output.display(self._progress, include=["text/html"])
        else:
            self._output.update(self._progress, include=["text/html"])

    def add(self, key: Hashable, title: str, total: int | None) -> None:
        """Open the bar of a task, unless it is open; ``total`` None: its length is not known."""
        if key not in self._tasks:
            self._tasks[key] = self._progress.add_task(title, total=total, news="")

    def update(self, key: Hashable, done: int, **fields: Any) -> None:
        """Move a task's bar to ``done`` of its total; without a bar nothing happens.

        ``description`` changes its title, ``news`` the text after it.
        """
        if key in self._tasks:
            self._progress.update(self._tasks[key], completed=done, **fields)
            self._draw()

    def remove(self, key: Hashable) -> None:
        """Remove a bar."""
        self._progress.remove_task(self._tasks.pop(key))

    def print(self, text: str) -> None:
        """Print a line above the bars, on a terminal or not."""
        self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)
