"""Progress bars on a terminal: one for each running trial, one for the whole run."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from sdnn.runs.engine import Observer
from sdnn.runs.records import TrialKey
from sdnn.runs.registry import agent_entry
from sdnn.runs.trial_config import PlannedTrial

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

SPEED_SECONDS = 60.0
"""Time over which the speed is averaged for the time left."""


def describe(key: TrialKey) -> str:
    """Name a trial for a reader; trials count from 1.

    Examples
    --------
    >>> describe(TrialKey("s4", "sdnn-c", 0, 1, ""))
    'SDNN-C s4, trial 1'
    """
    return f"{agent_entry(key.agent).title} {key.case_id}, trial {key.trial + 1}"


class ProgressObserver(Observer):
    """Shows progress bars on a terminal and nothing elsewhere; a context manager.

    Parameters
    ----------
    console
        Where to draw.
    """

    def __init__(self, console: Console) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeRemainingColumn(compact=True),
            console=console,
            transient=True,
            disable=not console.is_terminal,
            speed_estimate_period=SPEED_SECONDS,
        )
        self._tasks: dict[TrialKey, TaskID] = {}
        self._done: dict[TrialKey, int] = {}
        self._total: TaskID | None = None
        self._costs: TaskID | None = None
        self._n_open = 0

    def __enter__(self) -> ProgressObserver:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def begun(self, n_planned: int, n_reused: int, n_episodes: int) -> None:
        """Open the bar of the whole run."""
        self._n_open = n_planned - n_reused
        self._total = self._progress.add_task(self._title(), total=n_episodes)

    def started(self, planned: PlannedTrial) -> None:
        """Open a trial's bar."""
        self._tasks[planned.key] = self._progress.add_task(
            describe(planned.key), total=planned.config.protocol.n_learning_episodes
        )

    def advanced(self, planned: PlannedTrial, episode: int) -> None:
        """Move a trial's bar and the whole one."""
        step = episode - self._done.get(planned.key, 0)
        self._done[planned.key] = episode
        self._progress.update(self._tasks[planned.key], completed=episode)
        if self._total is not None:
            self._progress.advance(self._total, step)

    def lost(self, planned: PlannedTrial) -> None:
        """Take a trial's bar away, and its episodes off the whole one."""
        self.advanced(planned, 0)
        self._progress.remove_task(self._tasks.pop(planned.key))

    def finished(self, planned: PlannedTrial) -> None:
        """Close a trial's bar."""
        self._close(planned)

    def failed(self, planned: PlannedTrial, error: Exception) -> None:
        """Close a trial's bar and count its episodes as passed."""
        self.advanced(planned, planned.config.protocol.n_learning_episodes)
        self._close(planned)

    def noted(self, text: str) -> None:
        """Print a line above the bars, on a terminal or not."""
        self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def costs_begun(self, n_missing: int) -> None:
        """Open the bar of the costs."""
        if n_missing:
            self._costs = self._progress.add_task("cost of a step", total=n_missing)

    def cost_measured(self, description: str) -> None:
        """Move the bar of the costs."""
        if self._costs is not None:
            self._progress.update(self._costs, advance=1, description=f"cost: {description}")

    def _close(self, planned: PlannedTrial) -> None:
        self._progress.remove_task(self._tasks.pop(planned.key))
        self._n_open -= 1
        if self._total is not None:
            self._progress.update(self._total, description=self._title())

    def _title(self) -> str:
        return f"[bold]all ({self._n_open} to go)"
