"""A run in its folder: begun, stopped anywhere, and resumed exactly."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import gymnasium as gym

from sdnn._core import __version__
from sdnn.agents import (
    Agent,
    Callback,
    Evaluation,
    SDNNQLearning,
    UnusableStepError,
    evaluate,
    load_agent,
)
from sdnn.agents.callbacks import Row
from sdnn.agents.spaces import require_same_kind
from sdnn.interrupts import Interrupts
from sdnn.runs.config_file import ConfigFile
from sdnn.runs.engine import run_trials
from sdnn.runs.environment import render_modes
from sdnn.runs.errors import ConfigError, RunError, RunTerminatedError, command_line
from sdnn.runs.executor import SerialExecutor
from sdnn.runs.planned_trial import PlannedTrial
from sdnn.runs.records import TrialKey
from sdnn.runs.run_training import (
    AGENT,
    CHECKPOINT,
    Goal,
    RunOutcome,
    RunTask,
    one_of,
    tensorboard_in,
)
from sdnn.runs.spec import BudgetSpec, RunSpec
from sdnn.runs.spec_file import FORMAT, read_spec
from sdnn.runs.store import ResultStore
from sdnn.whole_files import lock, remove_abandoned_files, write_whole

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Goal", "Run", "RunEvaluation", "RunOutcome"]

CONFIG = "config.json"
LOCK = ".lock"


@dataclass(frozen=True, kw_only=True)
class RunEvaluation(Evaluation):
    """The outcome of some greedy episodes of a run's agent.

    Parameters
    ----------
    returns, lengths, terminated
        See `sdnn.agents.Evaluation`.
    is_warming_up
        Whether the agent has learned nothing yet: all its actions are random.
    """

    is_warming_up: bool


class Run:
    """A run in its folder.

    `create` and `open` make one.

    Attributes
    ----------
    folder : Path
    spec : RunSpec
        As it was begun.
    goals : tuple of Goal
        Goals it was given later, in order.
    """

    def __init__(self, folder: Path, spec: RunSpec, goals: Iterable[Goal] = ()) -> None:
        self.folder = folder
        self.spec = spec
        self.goals = tuple(goals)

    @classmethod
    def create(cls, folder: str | Path, spec: RunSpec) -> Self:
        """Begin a run: make its folder with its configuration, once all is known to work.

        Raises
        ------
        ConfigError
            If environment or agent cannot be made; no folder is made then.
        RunError
            If something is there already.
        OSError
            If the folder cannot be written.
        """
        place = Path(folder)
        if (place / CONFIG).exists():
            goes_on = command_line("sdnn", "resume", place)
            raise RunError(f"{place} holds a run already: {goes_on} goes on with it")
        if place.exists() and (not place.is_dir() or any(place.iterdir())):
            raise RunError(f"{place} is there already, and no run: take another folder")
        cls(place, spec).check()
        place.mkdir(parents=True, exist_ok=True)
        run = cls(place, spec)
        run.write_config()
        return run

    @classmethod
    def open(cls, folder: str | Path) -> Self:
        """Read a run's configuration.

        Raises
        ------
        RunError
            If the folder holds no run, or its configuration is damaged: file and key are named.
        """
        place = Path(folder)
        path = place / CONFIG
        if not path.exists():
            raise RunError(f"{place} holds no run: there is no {path}")
        goals = ConfigFile.read(path).values.get("goals", [])
        try:
            read = [Goal(**goal) for goal in goals]
        except (TypeError, ValueError) as error:
            raise ConfigError("goals", f"must be a list of goals: {error}", str(path)) from error
        return cls(place, read_spec(path), read)

    def check(self) -> None:
        """Make all that is needed once, to see that it works; ConfigError if not."""
        with closing(self.spec.make_env()) as env, self.evaluation_env():
            self.spec.make_agent(env)
        if self.spec.output.tensorboard:
            tensorboard_in(self.folder)

    def train(
        self,
        *,
        steps: int | None = None,
        episodes: int | None = None,
        callbacks: Iterable[Callback] = (),
        repeat_episodes: bool = True,
    ) -> RunOutcome:
        """Learn until the goal is reached, from the beginning or where the run stopped.

        Parameters
        ----------
        steps, episodes
            A new goal, counted from the beginning of the run; a target is dropped with it. By
            default the goal is as it was.
        callbacks
            More of them.
        repeat_episodes
            See `sdnn.agents.Training.load`.

        Raises
        ------
        KeyboardInterrupt, RunTerminatedError
            For SIGINT and SIGTERM, once the present step is done and a checkpoint is written.
        RunError
            If a file is damaged, another process trains the run, or the environment differs or
            gives what cannot be learned: the message then says in which step, and what is saved.
        OSError
            If a file cannot be read or written.
        """
        with ExitStack() as stack:
            stack.enter_context(self._locked())
            remove_abandoned_files(self.folder)
            if (self.folder / AGENT).exists() and not (self.folder / CHECKPOINT).exists():
                raise RunError(
                    f"{self.folder} was trained, but has no {CHECKPOINT} to go on from: a new run"
                    f" needs another folder, {AGENT} would be written over"
                )
            store = stack.enter_context(ResultStore(self.folder))
            store.reopen(self.key)
            stop = threading.Event()
            task = RunTask(
                self, store, callbacks, repeat_episodes=repeat_episodes, steps=steps,
                episodes=episodes, stop=stop,
            )  # fmt: skip
            planned = PlannedTrial(self.key, cast("RunSpec", task))
            with Interrupts(stop.set, (signal.SIGTERM,)) as terminations:
                done = run_trials([planned], store, executor=SerialExecutor(), stop=stop)
            for failure in done.failures:
                raise task.told(failure.error)
            training = task.trial.training
            if terminations.received is not None:
                raise RunTerminatedError(f"terminated after {training.n_steps} steps")
            if done.interrupted:
                raise KeyboardInterrupt
            agent = training.agent
            agent.save(self.folder / AGENT)
        return RunOutcome(
            n_steps=training.n_steps,
            n_episodes=training.n_episodes,
            reason=task.trial.reason,
            last_evaluation=_last_row(self.rows(), "evaluation"),
            learning_report=_report(agent),
            is_warming_up=agent.is_warming_up,
            has_pictures="rgb_array" in render_modes(one_of(training.env)),
            scaling=agent.scaling,
        )

    def agent(self) -> Agent[Any, Any]:
        """Load the agent as it is now: that of the last checkpoint.

        Raises
        ------
        RunError
            If there is none yet, or its file is damaged.
        """
        path = next((p for p in map(self.folder.joinpath, (CHECKPOINT, AGENT)) if p.exists()), None)
        if path is None:
            begins = command_line("sdnn", "resume", self.folder)
            raise RunError(f"{self.folder} has no checkpoint yet: {begins} begins it")
        try:
            return load_agent(path)
        except ValueError as error:
            raise RunError(str(error)) from error

    def evaluate(self, episodes: int = 10, seed: int | None = None) -> RunEvaluation:
        """Run greedy episodes with the agent as it is now.

        Parameters
        ----------
        episodes
            How many.
        seed
            Root of the episodes' seeds; by default others than those of the run's evaluations.

        Raises
        ------
        RunError
            If there is no checkpoint yet, its file is damaged, or the environment differs or gives
            what cannot be evaluated.
        """
        root = self.fresh_seed if seed is None else seed
        agent = self.agent()
        with closing(self.spec.make_env("evaluation_sensor_noise")) as env:
            self.check_spaces(agent, env)
            try:
                found = evaluate(agent, env, episodes, seed=root)
            except UnusableStepError as error:
                raise RunError(f"{self.spec.task}: {error}") from error
        return RunEvaluation(
            returns=found.returns,
            lengths=found.lengths,
            terminated=found.terminated,
            is_warming_up=agent.is_warming_up,
        )

    def check_spaces(self, agent: Agent[Any, Any], env: gym.Env[Any, Any]) -> None:
        """Check that the environment still is what the agent learned in; RunError if not."""
        try:
            require_same_kind(agent, env)
        except ValueError as error:
            raise RunError(f"{self.spec.task} has changed: {error}") from error

    @property
    def fresh_seed(self) -> int:
        """A root of episodes that the run itself does not have."""
        return (self.spec.seed + 2**63) % 2**64

    @property
    def key(self) -> TrialKey:
        """Where its rows are stored."""
        spec = self.spec
        return TrialKey(spec.task, spec.label, 0, spec.seed, spec.config_hash)

    def rows(self) -> list[Row]:
        """Read the rows: episodes and evaluations, in order.

        Raises
        ------
        StoreError
            If they cannot be read.
        """
        with ResultStore(self.folder, read_only=True) as store:
            return store.rows(self.key).to_training()

    # Parts.

    @contextmanager
    def evaluation_env(self) -> Iterator[gym.Env[Any, Any] | None]:
        """Make an environment for evaluations where there are any; there may be one robot only."""
        if not self.spec.is_evaluated:
            yield None
            return
        try:
            env = self.spec.make_env("evaluation_sensor_noise")
        except ConfigError as error:
            problem = f"needs a second environment, or must be 0: {error.problem}"
            raise ConfigError("protocol.evaluate_every", problem) from error
        with closing(env):
            yield env

    @property
    def goal(self) -> Goal | BudgetSpec:
        """How many steps or episodes it is to learn in all."""
        return self.goals[-1] if self.goals else self.spec.budget

    def add_goal(self, at_step: int, steps: int | None, episodes: int | None) -> None:
        """Note a new goal in the configuration."""
        self.goals += (Goal(at_step=at_step, steps=steps, episodes=episodes),)
        self.write_config()

    def write_config(self) -> None:
        """Write the configuration and the goals."""
        values: dict[str, Any] = {"format": FORMAT, "version": __version__, **self.spec.values()}
        if self.goals:
            values["goals"] = [
                {
                    name: value
                    for name, value in dataclasses.asdict(goal).items()
                    if value is not None
                }
                for goal in self.goals
            ]
        write_whole(self.folder / CONFIG, (json.dumps(values, indent=2) + "\n").encode())

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Keep other processes from training the same run; a killed one's lock is gone with it."""
        file = os.open(self.folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if lock(file) is False:
                raise RunError(f"{self.folder} is being trained by another process")
            yield
        finally:
            os.close(file)


def _report(agent: object) -> Mapping[str, Any] | None:
    if not isinstance(agent, SDNNQLearning) or agent.is_warming_up:
        return None
    return agent.learning_report()


def _last_row(rows: Iterable[Row], kind: str) -> Row | None:
    return next((row for row in reversed(list(rows)) if row["kind"] == kind), None)
