"""The training of a run as a trial of the engine: made anew, or from its checkpoint."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym

from sdnn._core import __version__
from sdnn.agents import (
    Callback,
    CheckpointCallback,
    StopTrainingOnRewardThreshold,
    TensorBoard,
    Training,
    UnrepeatedEpisodeError,
    UnusableStepError,
)
from sdnn.agents.callbacks import Row
from sdnn.agents.scaling import Scaling
from sdnn.arguments import whole
from sdnn.runs.errors import ConfigError, RunError, command_line, problem_of
from sdnn.runs.records import TrialRows
from sdnn.runs.spec import BudgetSpec
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.trial import Reason, TrainingTrial, reset_options, training_of

if TYPE_CHECKING:
    from sdnn.runs.run import Run

__all__ = ["AGENT", "CHECKPOINT", "Goal", "RunOutcome", "RunTask", "one_of", "tensorboard_in"]

CHECKPOINT = "checkpoint.safetensors"
AGENT = "agent.safetensors"
TENSORBOARD = "tensorboard"


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A new goal that a run was given when it was resumed.

    Parameters
    ----------
    at_step
        Steps it had learned then.
    steps, episodes
        How many it is to learn in all: one of them.

    Raises
    ------
    ValueError
        If a number is out of its range, or not one of ``steps`` and ``episodes`` is given.
    """

    at_step: int
    steps: int | None = None
    episodes: int | None = None

    def __post_init__(self) -> None:
        whole("at_step", self.at_step, 0, 2**53)
        if (self.steps is None) == (self.episodes is None):
            raise ValueError("steps or episodes must be given")
        name = "episodes" if self.steps is None else "steps"
        whole(name, getattr(self, name), 1, 2**53)


@dataclass(frozen=True, kw_only=True)
class RunOutcome:
    """What came of training a run.

    Parameters
    ----------
    n_steps, n_episodes
        Learned in all, and whole episodes among them.
    reason
        Why it ended: all was done, an evaluation reached the target, or a callback stopped it.
    last_evaluation
        Its row; None if there was none.
    learning_report
        See `sdnn.agents.SDNNQLearning.learning_report`; None for other agents and while it is
        warming up.
    is_warming_up
        Whether the agent has only acted at random so far, to see ranges, and learned nothing.
    has_pictures
        Whether the environment says that it can be rendered as pictures, as `record` needs it.
    scaling
        How what the agent observes is scaled; None: not at all.
    """

    n_steps: int
    n_episodes: int
    reason: Reason
    last_evaluation: Row | None
    learning_report: Mapping[str, Any] | None
    is_warming_up: bool
    has_pictures: bool
    scaling: Scaling | None


class _Target(StopTrainingOnRewardThreshold):
    """Stops where the target was reached, also if that was just before the run was killed."""

    def on_start(self, training: Training) -> None:
        """Look at the evaluation made at the present step."""
        if self.is_reached(training) and training.evaluations[-1][0] == training.n_steps:
            training.stop()


class _StopAsked(Callback):
    """Stops after the step in which somebody sets an event."""

    def __init__(self, asked: threading.Event) -> None:
        self._asked = asked

    def on_step(self, training: Training) -> None:
        """Stop where it is set."""
        if self._asked.is_set():
            training.stop()


class _StoredCheckpoints(CheckpointCallback):
    """Stores the rows of a run before each checkpoint that counts them."""

    def __init__(self, run: Run, store: ResultStore) -> None:
        super().__init__(run.folder / CHECKPOINT, run.spec.output.checkpoint_every)
        self._run, self._results = run, store
        self._rows: list[Row] = []

    def on_start(self, training: Training) -> None:
        """Remove the rows that were stored after the checkpoint."""
        self._store(training)

    def on_row(self, training: Training, row: Row) -> None:
        """Keep a row for the next checkpoint."""
        self._rows.append(row)

    def _save(self, training: Training) -> None:
        self._store(training)
        super()._save(training)

    def _store(self, training: Training) -> None:
        first = training.n_rows - len(self._rows)
        config = self._run.spec.canonical_json()
        rows = TrialRows.from_training(self._rows, first)
        self._results.extend(self._run.key, rows, first, config=config, version=__version__)
        self._rows = []


class RunTrial(TrainingTrial):
    """The training of a run, whose rows are stored with its checkpoints already."""

    def __init__(
        self, training: Training, environments: Iterable[gym.Env[Any, Any]], target: _Target | None,
        stored: Callable[[], TrialRows],
    ) -> None:  # fmt: skip
        super().__init__(training, environments, target)
        self._stored = stored

    @property
    def n_decisions(self) -> int:
        """Decisions of the whole run, in learning and evaluations."""
        return self.training.n_steps + self._stored().n_evaluated

    def rows(self) -> TrialRows:
        """Return the rows that are not yet stored: none."""
        return TrialRows.from_training([])


class RunTask:
    """What the engine needs of a run.

    Parameters
    ----------
    run
        The run.
    store
        Where its rows go.
    callbacks, repeat_episodes, steps, episodes
        See `sdnn.runs.Run.train`.
    stop
        Ends the run after a step.

    Attributes
    ----------
    trial : RunTrial
        Once it is made.
    """

    trial: RunTrial
    is_compiled = False

    def __init__(
        self, run: Run, store: ResultStore, callbacks: Iterable[Callback], *,
        repeat_episodes: bool, steps: int | None, episodes: int | None,
        stop: threading.Event,
    ) -> None:  # fmt: skip
        self._run, self._store, self._stop = run, store, _StopAsked(stop)
        self._given = tuple(callbacks)
        self._repeats, self._goal = repeat_episodes, (steps, episodes)
        self._checkpoints = _StoredCheckpoints(run, store)
        self._began_at = 0

    @property
    def length(self) -> int:
        """Steps or episodes of the whole run."""
        goal = self._run.goal
        return goal.steps or goal.episodes or 0

    def canonical_json(self) -> str:
        """Return what defines the run."""
        return self._run.spec.canonical_json()

    def make_trial(self, seed: int) -> RunTrial:
        """Make the training, from the checkpoint if there is one; the run has a seed already."""
        run, spec = self._run, self._run.spec
        has_goal = self._goal != (None, None)
        with ExitStack() as stack:
            env: Any = stack.enter_context(closing(spec.make_training_env()))
            evaluation_env = stack.enter_context(run.evaluation_env())
            target = None
            if spec.budget.target_return is not None and not (run.goals or has_goal):
                target = _Target(spec.budget.target_return)
            told = [self._stop, target, self._checkpoints, *self._given]
            if spec.output.tensorboard:
                told.append(tensorboard_in(run.folder))
            callbacks = [one for one in told if one is not None]
            if (run.folder / CHECKPOINT).exists():
                training = self._loaded(env, evaluation_env, callbacks)
            else:
                training = self._begun(env, evaluation_env, callbacks)
            if has_goal:
                self._set_goal(training, *self._goal)
            self._began_at = training.n_steps
            stack.pop_all()
        environments = [one for one in (env, evaluation_env) if one is not None]
        self.trial = RunTrial(training, environments, target, lambda: self._store.rows(run.key))
        return self.trial

    def told(self, error: Exception) -> Exception:
        """Tell what is saved where a step could not be learned."""
        if not isinstance(error, UnusableStepError):
            return error
        n_steps = self._checkpoints.n_saved or self._began_at
        goes_on = command_line("sdnn", "resume", self._run.folder)
        saved = f"the first {n_steps} steps are saved: {goes_on} goes on there with a new episode"
        if n_steps == 0:
            saved = f"nothing is learned yet: {goes_on} begins again once the environment is mended"
        told = RunError(f"{self._run.spec.task}: {error}; {saved}")
        told.__cause__ = error
        return told

    def _begun(
        self, env: Any, evaluation_env: gym.Env[Any, Any] | None, callbacks: list[Callback]
    ) -> Training:
        goal = self._run.goal
        budget = BudgetSpec(steps=goal.steps, episodes=goal.episodes)
        return training_of(self._run.spec.replace(budget=budget), env, evaluation_env, callbacks)

    def _loaded(
        self, env: Any, evaluation_env: gym.Env[Any, Any] | None, callbacks: list[Callback]
    ) -> Training:
        folder = self._run.folder
        try:
            training = Training.load(
                folder / CHECKPOINT,
                env,
                callbacks=callbacks,
                evaluation_env=evaluation_env,
                repeat_episodes=self._repeats,
                reset_options=reset_options(self._run.spec),
            )
        except UnrepeatedEpisodeError as error:
            begins = command_line("sdnn", "resume", folder, "--new-episode")
            raise RunError(f"{error}; {begins} begins a new one") from error
        except ValueError as error:
            raise RunError(str(error)) from error
        numbers = self._store.rows(self._run.key).table["number"]
        if len(set(numbers.tolist())) < training.n_rows:
            raise RunError(
                f"{folder / STORE_NAME} must have the {training.n_rows} rows that were written"
                f" before {CHECKPOINT}: it was changed"
            )
        return training

    def _set_goal(self, training: Training, steps: int | None, episodes: int | None) -> None:
        """Note a new goal: in the checkpoint, which is followed, then in the configuration."""
        if steps is not None and episodes is not None:
            raise ConfigError("episodes", "must not be given together with steps")
        name, goal, done = (
            ("steps", steps, training.n_steps)
            if steps is not None
            else ("episodes", episodes, training.n_episodes)
        )
        try:
            if whole(name, goal, 1, 2**53) < done:
                raise ConfigError(name, f"must be at least the {done} that are done, got {goal}")
        except ValueError as error:
            raise ConfigError(name, problem_of(error)) from None
        training.steps, training.episodes = steps, episodes
        if (self._run.folder / CHECKPOINT).exists():
            training.save(self._run.folder / CHECKPOINT)
        self._run.add_goal(training.n_steps, steps, episodes)


def tensorboard_in(folder: Path) -> TensorBoard:
    """Make the callback that writes for TensorBoard; ConfigError if its package is missing."""
    try:
        return TensorBoard(folder / TENSORBOARD)
    except ImportError as error:
        raise ConfigError("output.tensorboard", str(error)) from error


def one_of(env: Any) -> gym.Env[Any, Any]:
    """Give a single environment of those that the agent learns in."""
    if isinstance(env, gym.vector.VectorEnv):
        assert isinstance(env, gym.vector.SyncVectorEnv)  # what the configuration makes
        return env.envs[0]
    single: gym.Env[Any, Any] = env
    return single
