"""Callbacks of a training: rows to files, checkpoints, early stops, schedules, progress."""

from __future__ import annotations

import json
import math
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from sdnn.support.arguments import path_of, real, require, whole
from sdnn.support.files import naming, open_to_append, read_bytes, write_whole
from sdnn.support.progress import ProgressBars
from sdnn.training.files import MOST_IN_BLOCK, EpisodeBlock
from sdnn.training.interfaces import explained
from sdnn.training.loop import Row
from sdnn.training.training import Callback, Training

if TYPE_CHECKING:
    from rich.console import Console

MOST_BYTES_OF_ROWS = 2**32
SHOWN_AFTER = 5.0  # seconds of a training after which its bar appears


@explained
class JSONLines(Callback):
    """Writes each row as a line of JSON in a file; a resumed training removes later lines first."""

    def __init__(self, path: str | Path) -> None:
        self.path = path_of("path", path)

    def on_start(self, training: Training) -> None:
        """Begin the file, or keep as many lines as the training had rows."""
        lines: list[bytes] = []
        if training.n_rows and self.path.exists():
            content = read_bytes(self.path, MOST_BYTES_OF_ROWS)
            lines = content.splitlines(keepends=True)[: training.n_rows]
        write_whole(self.path, lines)
        self._file = open_to_append(self.path)

    def on_row(self, training: Training, row: Row) -> None:
        """Write a line."""
        with naming(self.path):
            self._file.write(json.dumps(row) + "\n")

    def on_end(self, training: Training) -> None:
        """Close the file."""
        with naming(self.path):
            self._file.close()


@explained
class StopTrainingOnRewardThreshold(Callback):
    """Stops when ``patience`` evaluations in a row reach a mean return."""

    def __init__(self, mean_return: float, patience: int = 1) -> None:
        self.mean_return = real("mean_return", mean_return)
        if math.isnan(self.mean_return):
            raise ValueError("mean_return must be a number, got NaN")
        self.patience = whole("patience", patience, 1, 2**53)

    def on_start(self, training: Training) -> None:
        """Refuse a training without evaluations."""
        _require_evaluations(self, training)

    def on_row(self, training: Training, row: Row) -> None:
        """Stop the training once the threshold is reached."""
        if row["kind"] == "evaluation" and self.is_reached(training):
            training.stop()

    def is_reached(self, training: Training) -> bool:
        """Return whether the last evaluations are good enough."""
        last = [mean_return for _, mean_return in training.evaluations[-self.patience :]]
        return len(last) == self.patience and all(mean >= self.mean_return for mean in last)


@explained
class SaveBestAgent(Callback):
    """Saves the agent whenever it was better than ever before in this training.

    Without ``episodes`` after an evaluation with the highest mean return so far. With ``episodes``
    after a block of that many learned episodes whose mean return is the highest: that costs no
    steps, but the returns are those of the agent that still learned and explored. The training
    remembers the best block, and a resumed one continues its block.

    Parameters
    ----------
    path : str or Path
        Of the file, which is written over.
    episodes : int, optional
        Learned episodes in a block.
    """

    def __init__(self, path: str | Path, episodes: int | None = None) -> None:
        self.path = path_of("path", path)
        self.episodes = None if episodes is None else whole("episodes", episodes, 1, MOST_IN_BLOCK)

    def on_start(self, training: Training) -> None:
        """Let the training compare blocks of ``episodes`` episodes, or require evaluations."""
        if self.episodes is None:
            _require_evaluations(self, training, ", or episodes=20 of SaveBestAgent")
        else:
            training.blocks.setdefault(self.episodes, EpisodeBlock(self.episodes))

    def on_row(self, training: Training, row: Row) -> None:
        """Save the agent after the best evaluation or block of episodes so far."""
        if row["kind"] == "evaluation":
            is_best = self.episodes is None and n_since_best(training) == 0
        else:
            is_best = self.episodes in training.best_blocks
        if is_best:
            training.agent.save(self.path)


@explained
class StopTrainingOnNoImprovement(Callback):
    """Stops after ``max_evaluations`` evaluations in a row without a new best mean return."""

    def __init__(self, max_evaluations: int) -> None:
        self.max_evaluations = whole("max_evaluations", max_evaluations, 1, 2**53)

    def on_start(self, training: Training) -> None:
        """Refuse a training without evaluations."""
        _require_evaluations(self, training)

    def on_row(self, training: Training, row: Row) -> None:
        """Count the evaluations since the best one."""
        if row["kind"] == "evaluation" and n_since_best(training) >= self.max_evaluations:
            training.stop()


def _require_evaluations(callback: Callback, training: Training, remedy: str = "") -> None:
    """Raise ValueError for a training without evaluations, in which a callback does nothing."""
    if training.evaluate_every is None and training.evaluate_every_episodes is None:
        raise ValueError(
            f"evaluate_every must be given for {type(callback).__name__}, which compares"
            f" evaluations, got None: give evaluate_every and evaluation_env{remedy}"
        )


def n_since_best(training: Training) -> int:
    """Count the evaluations after the best one, which has the highest mean return."""
    means = [mean_return for _, mean_return in training.evaluations]
    return len(means) - 1 - means.index(max(means))


class Schedule(Callback):
    """Sets learning rate and epsilon to functions of the progress, before every step.

    That overrides ``final_learning_rate`` and ``final_epsilon``; a saved agent keeps the last
    values. A training that is loaded must be given its schedule again.

    Parameters
    ----------
    learning_rate, epsilon : callable, optional
        From the progress, 0 at the beginning and 1 at the end, to a value in (0, 1] and [0, 1].
        (In Stable-Baselines3 such functions are given what remains, from 1 to 0.)

    Raises
    ------
    TypeError, ValueError
        For something else, an agent without such a rate, or a function with another value.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import Schedule, SDNNQLearning
    >>> env = gym.make("MountainCarContinuous-v0")
    >>> agent = SDNNQLearning(env)
    >>> halves = Schedule(epsilon=lambda progress: 0.2 if progress < 0.5 else 0.0)
    >>> agent.train(env, steps=100, callbacks=[halves]).n_steps
    100
    >>> agent.epsilon
    0.0
    """

    def __init__(
        self,
        *,
        learning_rate: Callable[[float], float] | None = None,
        epsilon: Callable[[float], float] | None = None,
    ) -> None:
        functions = {"learning_rate": learning_rate, "epsilon": epsilon}
        for name, function in functions.items():
            is_function = function is None or callable(function)
            require(is_function, name, "be a function of the progress", function, TypeError)
        self._functions = {name: f for name, f in functions.items() if f is not None}

    def on_start(self, training: Training) -> None:
        """Set the rates of the first step."""
        for name in self._functions:
            if not hasattr(training.agent, name):
                raise TypeError(f"agent must have a {name}, got {type(training.agent).__name__}")
        self.on_step(training)

    def on_step(self, training: Training) -> None:
        """Set the rates of the next step."""
        for name, function in self._functions.items():
            setattr(training.agent, name, function(training.agent.progress))


class ProgressBarCallback(Callback):
    """Shows a progress bar, with the median of the last returns and the last evaluation.

    It appears after ``seconds`` of a training, by default `SHOWN_AFTER`.
    """

    step_interval = 64  # an update costs more than a step

    def __init__(
        self, title: str, *, seconds: float | None = None, console: Console | None = None
    ) -> None:
        self._title, self._console = title, console
        self._seconds = SHOWN_AFTER if seconds is None else seconds
        self._bars: ProgressBars | None = None
        self._returns: deque[float] = deque(maxlen=20)
        self._evaluation = ""

    def on_start(self, training: Training) -> None:
        """Open the bar, unless it appears only after some seconds."""
        self._due = time.monotonic() + self._seconds
        self._open(training)

    def _open(self, training: Training) -> ProgressBars | None:
        """Return the bar, which opens after ``seconds``; None before."""
        if self._bars is None and time.monotonic() >= self._due:
            self._bars = ProgressBars(self._console)
            total = training.steps if training.steps is not None else training.episodes
            self._bars.add(self, self._title, total)
            self._bars.update(self, _done(training))
            self._bars.__enter__()
        return self._bars

    def on_row(self, training: Training, row: Row) -> None:
        """Keep the last returns or evaluation, to be shown with the bar."""
        if row["kind"] == "evaluation":
            self._evaluation = f", evaluation {row['mean_return']:.4g}"
        else:
            self._returns.append(row["return"])

    def on_step(self, training: Training) -> None:
        """Move the bar."""
        if (bars := self._open(training)) is not None:
            news = f"return {median(self._returns):.4g}" if self._returns else ""
            bars.update(self, _done(training), news=news + self._evaluation)

    def on_end(self, training: Training) -> None:
        """Remove the bar."""
        if self._bars is not None:
            self._bars.update(self, _done(training))
            self._bars.__exit__()
            self._bars = None


@explained
class TensorBoard(Callback):
    """Writes the numbers of each row for TensorBoard; needs ``tensorboardX`` or ``torch``."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = path_of("folder", folder, is_folder=True)
        self._make = _summary_writer()

    def on_start(self, training: Training) -> None:
        """Open the event file."""
        self._writer = self._make(str(self.folder))

    def on_row(self, training: Training, row: Row) -> None:
        """Write the row's numbers under its kind."""
        for name, value in row.items():
            if isinstance(value, int | float) and name not in ("step", "environment"):
                self._writer.add_scalar(f"{row['kind']}/{name}", value, row["step"])

    def on_end(self, training: Training) -> None:
        """Close the event file."""
        self._writer.close()


def _summary_writer() -> Callable[[str], Any]:
    """Return the class that writes TensorBoard files, of the first package that has it."""
    for module in ("tensorboardX", "torch.utils.tensorboard"):
        with suppress(ImportError):
            make: Callable[[str], Any] = import_module(module).SummaryWriter
            return make
    raise ImportError("TensorBoard rows need tensorboardX: pip install tensorboardX")


def _done(training: Training) -> int:
    """Return the number of steps learned, or of episodes where these are the goal."""
    return training.n_steps if training.steps is not None else training.n_episodes
