"""A run in its folder: begun, stopped anywhere, and resumed exactly."""

from __future__ import annotations

import json
import shlex
import signal
import time
import weakref
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Annotated, Self

import gymnasium as gym
import msgspec
from msgspec import Meta

from sdnn._core import __version__
from sdnn.agents import (
    Callback,
    CheckpointCallback,
    SaveBestAgent,
    TensorBoard,
    Training,
    UnrepeatedEpisodeError,
    UnusableStepError,
    load_agent,
)
from sdnn.agents.agent import AnyAgent
from sdnn.agents.q_learning import ValueAgent
from sdnn.environments.space_kinds import require_same_kind
from sdnn.environments.types import Data, Env
from sdnn.runs.config_file import FORMAT, ConfigFile, read_spec
from sdnn.runs.environment import episode_option, has_episode_option, render_modes
from sdnn.runs.errors import ConfigError, RunError, RunTerminatedError
from sdnn.runs.settings import BudgetSpec, read_table
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.trial import (
    RunEvaluation,
    RunOutcome,
    TrainingTrial,
    TrialKey,
    TrialRecord,
    TrialRows,
)
from sdnn.support.display import Displayed
from sdnn.support.files import lock, open_to_append, remove_abandoned_files, write_whole
from sdnn.support.interrupts import Interrupts
from sdnn.support.machine import instruction_set
from sdnn.training.evaluation import greedy_episodes
from sdnn.training.loop import Row
from sdnn.training.training import checked_callbacks

CONFIG = "config.json"
LOCK = ".lock"
CHECKPOINT = "checkpoint.safetensors"
AGENT, BEST = "agent.safetensors", "best.safetensors"
STORE_SECONDS = 5.0  # between commits of rows
TENSORBOARD = "tensorboard"


class Goal(BudgetSpec, frozen=True, kw_only=True):
    """A new goal of a run that was resumed at a step: ``steps`` or ``episodes`` in all."""

    at_step: Annotated[int, Meta(ge=0)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.steps is None and self.episodes is None:
            raise ConfigError("steps", "or episodes must be given")


class Run(Displayed):
    """A run in its folder; made by `create` or `open`.

    ``spec`` is the specification it was begun with, ``goals`` are those it was given later.
    """

    def __init__(self, folder: Path, spec: RunSpec, goals: Iterable[Goal] = ()) -> None:
        self.folder = folder
        self.spec = spec
        self.goals = tuple(goals)
        self._checked: TrainingTrial | None = None  # made by `check`, used by the first `train`

    @classmethod
    def create(cls, folder: str | Path, spec: RunSpec) -> Self:
        """Make the folder of a new run with its configuration, after checking that it can run.

        ConfigError, RunError or OSError if it cannot be made (no folder is made then), is there
        already, or cannot be written.
        """
        place = Path(folder)
        if (place / CONFIG).exists():
            raise RunError(f"{place} holds a run already: {resume_command(place)} continues it")
        remove_abandoned_files(place)
        if place.exists() and (not place.is_dir() or any(place.iterdir())):
            raise RunError(f"{place} is there already, and no run: take another folder")
        run = cls(place, spec)
        run._checked = run._check()
        weakref.finalize(run, run._checked.close)  # closes environments if `train` is never called
        place.mkdir(parents=True, exist_ok=True)
        run.write_config()
        return run

    @classmethod
    def open(cls, folder: str | Path) -> Self:
        """Read a run's configuration; RunError that names file and key if it is damaged."""
        place = Path(folder)
        path = place / CONFIG
        if not path.exists():
            raise RunError(f"{place} holds no run: there is no {path}")
        goals = ConfigFile.read(path).values.get("goals", [])
        try:
            checked_goals = [read_table(Goal, goal) for goal in goals]
        except (ConfigError, TypeError) as error:
            raise ConfigError("goals", f"must be a list of goals: {error}", str(path)) from error
        return cls(place, read_spec(path), checked_goals)

    def _facts(self) -> dict[str, object]:
        """Return the facts that ``repr`` and notebooks display, by their labels."""
        spec = self.spec
        return {"folder": self.folder, "task": spec.task, "agent": spec.label, "seed": spec.seed}

    def check(self) -> None:
        """Make environment, agent and training as a check; ConfigError for a wrong setting."""
        self._check().close()

    def _check(self) -> TrainingTrial:
        """Make the trial, which raises for wrong settings, before the folder is made."""
        instruction_set()  # raises if the environment variable is wrong
        if not self.spec.protocol.seeded_episodes:
            raise ConfigError(
                "protocol.seeded_episodes",
                "must be true for a run in a folder: without seeds no episode can be repeated,"
                " which resuming needs. Studies and `sdnn reproduce` run such specifications",
            )
        if self.spec.output.tensorboard:
            tensorboard_in(self.folder)
        return self.spec.make_training()

    def train(
        self,
        *,
        steps: int | None = None,
        episodes: int | None = None,
        callbacks: Iterable[Callback] = (),
        repeat_episodes: bool = True,
    ) -> RunOutcome:
        """Learn until the goal is reached, from the beginning or where the run stopped.

        ``steps`` or ``episodes`` are a new goal, counted from the beginning of the run; a target is
        dropped with it. ``repeat_episodes``: see `sdnn.agents.Training.load`.

        KeyboardInterrupt or RunTerminatedError for SIGINT and SIGTERM, once the present step is
        done and a checkpoint is written. RunError if a file is damaged, the run is trained
        elsewhere, or the environment has changed or gives what cannot be learned.
        """
        goal = {"steps": steps, "episodes": episodes}
        BudgetSpec(**goal)  # raises for an invalid goal
        with ExitStack() as stack:
            stack.enter_context(self._locked())
            remove_abandoned_files(self.folder)
            self._require_checkpoint_of_agent()
            store = stack.enter_context(ResultStore(self.folder))
            self._require_key_in(store)
            checkpoints = _StoredCheckpoints(self, store)
            all_callbacks = [checkpoints, *callbacks]
            if self.spec.output.keep_best:
                all_callbacks.append(SaveBestAgent(self.folder / BEST))
            if self.spec.output.tensorboard:
                all_callbacks.append(tensorboard_in(self.folder))
            has_goal = steps is not None or episodes is not None
            trial = self._trial(all_callbacks, has_goal=has_goal, repeat_episodes=repeat_episodes)
            stack.enter_context(closing(trial))
            training = trial.training
            if training.n_rows > len(store.rows(self.key).to_training()):
                raise RunError(
                    f"{self.folder / STORE_NAME} must have the {training.n_rows} rows that were"
                    f" written before {CHECKPOINT}: it was changed"
                )
            if has_goal:
                self._set_goal(training, goal)
            began_at = training.n_steps
            try:
                with Interrupts(training.stop, (signal.SIGINT, signal.SIGTERM)) as signals:
                    if trial.reason != "target":  # "target": reached just before the run was killed
                        training.run()
            except UnusableStepError as error:
                remedy = self._how_to_continue(checkpoints.n_saved or began_at)
                raise RunError(f"{self.spec.task}: {error}; {remedy}") from error
            if trial.finished:
                checkpoints.finish(training)
            if signals.received == signal.SIGTERM:
                raise RunTerminatedError(f"terminated after {training.n_steps} steps")
            if signals.received is not None:
                raise KeyboardInterrupt
            training.agent.save(self.folder / AGENT)
        return self._outcome(trial)

    def _require_checkpoint_of_agent(self) -> None:
        """Raise RunError where training would overwrite an agent from which it cannot resume."""
        if (self.folder / AGENT).exists() and not (self.folder / CHECKPOINT).exists():
            missing = f"{self.folder} was trained, but has no {CHECKPOINT} to resume from"
            remedy = f"a new run needs another folder, {AGENT} would be written over"
            raise RunError(f"{missing}: {remedy}")

    def _require_key_in(self, store: ResultStore) -> None:
        """Raise RunError if the stored rows are those of another specification or seed."""
        stored = store.keys(unfinished=True)
        if stored and self.key not in stored:
            raise RunError(
                f"{self.folder / CONFIG} differs from the specification in {STORE_NAME}: undo"
                " the edit, or begin a new run with --config and another --out"
            )

    def _how_to_continue(self, n_saved: int) -> str:
        """Return the end of a message about an unusable step, after ``n_saved`` saved steps."""
        resume = resume_command(self.folder)
        if n_saved == 0:
            return f"nothing is learned yet: {resume} begins again once the environment is fixed"
        return f"the first {n_saved} steps are saved: {resume} continues there with a new episode"

    def _outcome(self, trial: TrainingTrial) -> RunOutcome:
        """Return the result of a trial that has ended: reached its goal, or was stopped."""
        training, agent, env = trial.training, trial.training.agent, trial.training.env
        evaluations = (row for row in reversed(self.rows()) if row["kind"] == "evaluation")
        last = next(evaluations, None)
        has_report = isinstance(agent, ValueAgent) and not agent.is_warming_up
        single = env.envs[0] if isinstance(env, gym.vector.SyncVectorEnv) else env
        assert isinstance(single, gym.Env)
        threshold = single.spec.reward_threshold if single.spec else None
        return RunOutcome(
            n_steps=training.n_steps,
            n_episodes=training.n_episodes,
            reason=trial.reason,
            last_evaluation=last,
            learning_report=agent.learning_report() if has_report else None,
            is_warming_up=agent.is_warming_up,
            is_solved=bool(last and threshold is not None and last["mean_return"] >= threshold),
            has_pictures="rgb_array" in render_modes(single),
            scaling=agent.scaling,
            history=agent.history,
            finds_history=agent.finds_history,
        )

    def agent(self) -> AnyAgent:
        """Load the agent of the last checkpoint; RunError if there is none or it is damaged."""
        return agent_of(self.folder)

    def evaluate(
        self, episodes: int = 10, seed: int | None = None, *, best: bool = False
    ) -> RunEvaluation:
        """Run greedy episodes; by default with other seeds than the run's own evaluations.

        With `best` the agent is that of the best evaluation, which `output.keep_best` kept.

        RunError if there is no checkpoint yet, its file is damaged, or the environment differs or
        gives what cannot be evaluated.
        """
        root = self.fresh_seed if seed is None else seed
        agent = agent_of(self.folder, best=best)
        with closing(self.spec.make_env("evaluation_sensor_noise")) as env:
            self.check_spaces(agent, env)
            try:
                options = self.reset_options(env)
                evaluation = greedy_episodes(agent, env, episodes, seed=root, options=options)
            except UnusableStepError as error:
                raise RunError(f"{self.spec.task}: {error}") from error
        assert evaluation is not None  # nothing stops it
        return RunEvaluation(**vars(evaluation), is_warming_up=agent.is_warming_up)

    def check_spaces(self, agent: AnyAgent, env: Env) -> None:
        """Check that the environment has the agent's spaces; RunError if it has changed."""
        try:
            require_same_kind(agent, env)
        except ValueError as error:
            raise RunError(f"{self.spec.task} has changed: {error}") from error

    def reset_options(self, env: Env) -> Data | None:
        """Return the options of resets in an evaluation at this point of the training, or None."""
        if not has_episode_option(env):
            return None
        return episode_option(sum(row["kind"] == "episode" for row in self.rows()))

    @property
    def fresh_seed(self) -> int:
        """A seed for evaluations whose episodes differ from all episodes of the run."""
        # Half of all seeds away: users choose small ones, so it is hardly that of another run.
        return (self.spec.seed + 2**63) % 2**64

    @property
    def key(self) -> TrialKey:
        """Key of the run's rows in the store."""
        spec = self.spec
        return TrialKey(spec.task, spec.label, 0, spec.seed, spec.config_hash)

    def rows(self) -> list[Row]:
        """Read the rows: episodes and evaluations, in order; StoreError if that fails."""
        with ResultStore(self.folder, read_only=True) as store:
            return store.rows(self.key).to_training()

    @property
    def goal(self) -> Goal | BudgetSpec:
        """Number of steps or episodes to learn in all."""
        return self.goals[-1] if self.goals else self.spec.budget

    def write_config(self) -> None:
        """Write the configuration and the goals."""
        values: dict[str, object] = {"format": FORMAT, "version": __version__, **self.spec.values()}
        if self.goals:
            goals = map(msgspec.structs.asdict, self.goals)
            values["goals"] = [
                {key: v for key, v in goal.items() if v is not None} for goal in goals
            ]
        write_whole(self.folder / CONFIG, (json.dumps(values, indent=2) + "\n").encode())

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Lock the run against training in other processes; a killed process loses its lock."""
        with open_to_append(self.folder / LOCK) as file:
            if lock(file.fileno()) is False:
                raise RunError(f"{self.folder} is being trained by another process")
            yield

    def _trial(
        self, callbacks: list[Callback], *, has_goal: bool, repeat_episodes: bool
    ) -> TrainingTrial:
        """Make the training, resumed at a checkpoint; a new goal drops the target (`has_goal`)."""
        spec = self.spec
        if self.goals or has_goal:
            spec = spec.replace(budget=spec.budget.replace(target_return=None))
        if not (self.folder / CHECKPOINT).exists():
            trial, self._checked = self._checked, None
            if trial is None or spec != self.spec:
                trial = spec.make_training()
            trial.training.callbacks = checked_callbacks((*trial.training.callbacks, *callbacks))
            trial.training.steps, trial.training.episodes = self.goal.steps, self.goal.episodes
            return trial
        try:
            return spec.make_training(
                callbacks, self.folder / CHECKPOINT, repeat_episodes=repeat_episodes
            )
        except UnrepeatedEpisodeError as error:
            begins = resume_command(self.folder, "--new-episode")
            raise RunError(f"{error}; {begins} begins a new one") from error
        except ValueError as error:
            raise RunError(str(error)) from error

    def _set_goal(self, training: Training, goal: dict[str, int | None]) -> None:
        """Save a new goal in the checkpoint, with which a training resumes, then in the file."""
        for name, value in goal.items():
            done: int = getattr(training, f"n_{name}")
            if value is not None and value < done:
                raise ConfigError(name, f"must be at least the {done} that are done, got {value}")
        training.steps, training.episodes = goal["steps"], goal["episodes"]
        if (self.folder / CHECKPOINT).exists():
            training.save(self.folder / CHECKPOINT)
        self.goals += (Goal(at_step=training.n_steps, **goal),)
        self.write_config()


class _StoredCheckpoints(CheckpointCallback):
    """Stores rows every few seconds and before each checkpoint."""

    def __init__(self, run: Run, store: ResultStore) -> None:
        super().__init__(run.folder / CHECKPOINT, run.spec.output.checkpoint_every)
        self._key, self._config = run.key, run.spec.canonical_json()
        self._results = store
        self._rows: list[Row] = []
        self._stored_at = time.monotonic()
        self._clock = time.thread_time()

    def on_start(self, training: Training) -> None:
        """Remove the rows that were stored after the checkpoint."""
        self._store_rows(training)

    def on_row(self, training: Training, row: Row) -> None:
        """Collect a row; store the collected rows if `STORE_SECONDS` have passed."""
        self._rows.append(row)
        if time.monotonic() - self._stored_at > STORE_SECONDS:
            self._store_rows(training)

    def finish(self, training: Training) -> None:
        """Mark the run as finished in the store."""
        record = TrialRecord(
            key=self._key,
            config=self._config,
            n_decisions=training.n_steps + self._results.rows(self._key).n_evaluated,
            seconds=self._seconds(),
            rows=TrialRows.from_training([]),
        )
        self._results.add(record, is_exact=False)

    def _save(self, training: Training) -> None:
        self._store_rows(training)
        super()._save(training)

    def _store_rows(self, training: Training) -> None:
        """Store the rows since the last call, and clear them."""
        first = training.n_rows - len(self._rows)
        rows = TrialRows.from_training(self._rows, first)
        self._results.extend(
            self._key, rows, first, config=self._config, version=__version__,
            seconds=self._seconds(),
        )  # fmt: skip
        self._rows, self._stored_at = [], time.monotonic()

    def _seconds(self) -> float:
        """Return the processor time of this thread since the last call."""
        before, self._clock = self._clock, time.thread_time()
        return self._clock - before


def agent_of(folder: Path, *, best: bool = False) -> AnyAgent:
    """Load the last or best agent of a run, even if the configuration is damaged."""
    if not (folder / CONFIG).exists():
        raise RunError(f"{folder} holds no run: there is no {folder / CONFIG}")
    names = (BEST,) if best else (CHECKPOINT, AGENT)
    path = next((p for p in (folder / name for name in names) if p.exists()), None)
    if path is None:
        missing = f"{BEST}: train with --keep-best"
        if not best:
            missing = f"checkpoint yet: {resume_command(folder)} begins it"
        raise RunError(f"{folder} has no {missing}")
    try:
        return load_agent(path)
    except ValueError as error:
        raise RunError(str(error)) from error


def resume_command(folder: Path, *options: str) -> str:
    """Return the command that continues a run, quoted for a shell."""
    return shlex.join(["sdnn", "resume", str(folder), *options])


def tensorboard_in(folder: Path) -> TensorBoard:
    """Make the callback that writes for TensorBoard.

    ConfigError if its package is missing, or its folder is a link to another one.
    """
    if (folder / TENSORBOARD).is_symlink():
        raise ConfigError("output.tensorboard", f"{folder / TENSORBOARD} must not be a link")
    try:
        return TensorBoard(folder / TENSORBOARD)
    except ImportError as error:
        raise ConfigError("output.tensorboard", str(error)) from error
