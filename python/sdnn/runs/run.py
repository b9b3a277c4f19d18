"""A run in its folder: begun, stopped anywhere, and gone on with exactly."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import gymnasium as gym

from sdnn.agents import (
    Agent,
    Callback,
    Checkpoints,
    EarlyStop,
    Evaluation,
    JSONLines,
    SDNNQLearning,
    TensorBoard,
    Training,
    UnrepeatedEpisodeError,
    UnusableStepError,
    evaluate,
    load_agent,
)
from sdnn.agents.callbacks import Row
from sdnn.agents.scaling import Scaling
from sdnn.agents.spaces import require_same_kind
from sdnn.arguments import whole
from sdnn.interrupts import Interrupts
from sdnn.runs.config import RunConfig, read_json
from sdnn.runs.environment import render_modes
from sdnn.runs.errors import ConfigError, RunError, RunTerminatedError, command_line, problem_of
from sdnn.whole_files import lock, remove_abandoned_files, write_whole

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Goal", "Run", "RunEvaluation", "RunOutcome"]

CONFIG = "config.json"
ROWS = "rows.jsonl"
CHECKPOINT = "checkpoint.safetensors"
AGENT = "agent.safetensors"
TENSORBOARD = "tensorboard"
LOCK = ".lock"

TrainingEnv: TypeAlias = gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]

Reason: TypeAlias = Literal["done", "target", "stopped"]


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


class _Target(EarlyStop):
    """Stops where the target was reached, also if that was just before the run was killed."""

    def on_start(self, training: Training) -> None:
        """Look at the evaluation made at the present step."""
        if self.is_reached(training) and training.evaluations[-1][0] == training.n_steps:
            training.stop()


class Run:
    """A run in its folder.

    `create` and `open` make one.

    Attributes
    ----------
    folder : Path
    config : RunConfig
        As it was begun.
    goals : tuple of Goal
        Goals it was given later, in order.
    """

    def __init__(self, folder: Path, config: RunConfig, goals: Iterable[Goal] = ()) -> None:
        self.folder = folder
        self.config = config
        self.goals = tuple(goals)

    @classmethod
    def create(cls, folder: str | Path, config: RunConfig) -> Self:
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
        cls(place, config).check()
        place.mkdir(parents=True, exist_ok=True)
        run = cls(place, config)
        run._write_config()
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
        goals = read_json(path).pop("goals", [])
        try:
            read = [Goal(**goal) for goal in goals]
        except (TypeError, ValueError) as error:
            raise ConfigError("goals", f"must be a list of goals: {error}", str(path)) from error
        return cls(place, RunConfig.read(path), read)

    def check(self) -> None:
        """Make all that is needed once, to see that it works; ConfigError if not."""
        with closing(self.config.environment.make()) as env, self._evaluation_env():
            self.config.make_agent(env)
        if self.config.tensorboard:
            self._tensorboard()

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
            environment = self.config.environment
            env = stack.enter_context(closing(self.config.make_training_env()))
            evaluation_env = stack.enter_context(self._evaluation_env())
            has_goal = steps is not None or episodes is not None
            target = None
            if self.config.target_return is not None and not (self.goals or has_goal):
                target = _Target(self.config.target_return)
            # Rows are written before the checkpoint that counts them.
            checkpoints = Checkpoints(self.folder / CHECKPOINT, self.config.checkpoint_every)
            own = [JSONLines(self.folder / ROWS), target, checkpoints, *callbacks]
            if self.config.tensorboard:
                own.append(self._tensorboard())
            told = [one for one in own if one is not None]
            training = self._training(env, evaluation_env, told, repeat_episodes)
            if has_goal:
                self._set_goal(training, steps, episodes)
            began_at = training.n_steps
            try:
                with Interrupts(training.stop, (signal.SIGTERM,)) as terminations:
                    result = training.run()
            except UnusableStepError as error:
                saved = self._saved(checkpoints.n_saved or began_at)
                raise RunError(f"{environment.id}: {error}; {saved}") from error
            if terminations.received is not None:
                raise RunTerminatedError(f"terminated after {training.n_steps} steps")
            agent = training.agent
            assert isinstance(agent, Agent)  # what make_agent and load give
            agent.save(self.folder / AGENT)
        is_target = target is not None and target.is_reached(training)
        reason: Reason = "target" if is_target else "done" if result.is_finished else "stopped"
        return RunOutcome(
            n_steps=result.n_steps,
            n_episodes=result.n_episodes,
            reason=reason,
            last_evaluation=_last_row(self.rows(), "evaluation"),
            learning_report=_report(agent),
            is_warming_up=agent.is_warming_up,
            has_pictures="rgb_array" in render_modes(_one_of(env)),
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
        with closing(self.config.environment.make("evaluation_sensor_noise")) as env:
            self.check_spaces(agent, env)
            try:
                found = evaluate(agent, env, episodes, seed=root)
            except UnusableStepError as error:
                raise RunError(f"{self.config.environment.id}: {error}") from error
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
            raise RunError(f"{self.config.environment.id} has changed: {error}") from error

    @property
    def fresh_seed(self) -> int:
        """A root of episodes that the run itself does not have."""
        return (self.config.seed + 2**63) % 2**64

    def rows(self) -> list[Row]:
        """Read the rows: episodes and evaluations, in order.

        Raises
        ------
        RunError
            If a line cannot be read; file and line are named.
        """
        return _read_rows(self.folder / ROWS)

    # Parts.

    @contextmanager
    def _evaluation_env(self) -> Iterator[gym.Env[Any, Any] | None]:
        """Make an environment for evaluations where there are any; there may be one robot only."""
        if not self.config.evaluate_every:
            yield None
            return
        try:
            env = self.config.environment.make("evaluation_sensor_noise")
        except ConfigError as error:
            problem = f"needs a second environment, or must be 0: {error.problem}"
            raise ConfigError("evaluate_every", problem) from error
        with closing(env):
            yield env

    def _training(
        self,
        env: TrainingEnv,
        evaluation_env: gym.Env[Any, Any] | None,
        callbacks: list[Callback],
        repeat_episodes: bool,
    ) -> Training:
        path = self.folder / CHECKPOINT
        if not path.exists():
            if (self.folder / AGENT).exists():
                raise RunError(
                    f"{self.folder} was trained, but has no {CHECKPOINT} to go on from: a new run"
                    f" needs another folder, {AGENT} would be written over"
                )
            goal = self.goals[-1] if self.goals else self.config
            return Training(
                self.config.make_agent(_one_of(env)),
                env,
                steps=goal.steps,
                episodes=goal.episodes,
                seed=self.config.seed,
                callbacks=callbacks,
                evaluate_every=self.config.evaluate_every or None,
                evaluation_env=evaluation_env,
                evaluation_episodes=self.config.evaluation_episodes,
            )
        try:
            training = Training.load(
                path, env, callbacks=callbacks, evaluation_env=evaluation_env,
                repeat_episodes=repeat_episodes,
            )  # fmt: skip
        except UnrepeatedEpisodeError as error:
            begins = command_line("sdnn", "resume", self.folder, "--new-episode")
            raise RunError(f"{error}; {begins} begins a new one") from error
        except ValueError as error:
            raise RunError(str(error)) from error
        assert isinstance(training.agent, Agent)  # what load gives
        rows = _read_rows(self.folder / ROWS)
        if len(rows) < training.n_rows:
            raise RunError(
                f"{self.folder / ROWS} must have the {training.n_rows} rows that were written"
                f" before {path.name}: it was changed"
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
        if (self.folder / CHECKPOINT).exists():
            training.save(self.folder / CHECKPOINT)
        self.goals += (Goal(at_step=training.n_steps, steps=steps, episodes=episodes),)
        self._write_config()

    def _write_config(self) -> None:
        values = self.config.values()
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

    def _saved(self, n_steps: int) -> str:
        """Say what is left of a training that failed."""
        goes_on = command_line("sdnn", "resume", self.folder)
        if n_steps == 0:
            return f"nothing is learned yet: {goes_on} begins again once the environment is mended"
        return f"the first {n_steps} steps are saved: {goes_on} goes on there with a new episode"

    def _tensorboard(self) -> TensorBoard:
        try:
            return TensorBoard(self.folder / TENSORBOARD)
        except ImportError as error:
            raise ConfigError("tensorboard", str(error)) from error

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


def _one_of(env: TrainingEnv) -> gym.Env[Any, Any]:
    """Give a single environment of those that the agent learns in."""
    if isinstance(env, gym.vector.VectorEnv):
        assert isinstance(env, gym.vector.SyncVectorEnv)  # what the configuration makes
        return env.envs[0]
    return env


def _report(agent: object) -> Mapping[str, Any] | None:
    if not isinstance(agent, SDNNQLearning) or agent.is_warming_up:
        return None
    return agent.learning_report()


def _is_row(row: Any) -> bool:
    """Whether it has what rows of its kind have."""
    if not isinstance(row, dict) or type(row.get("step")) is not int:
        return False
    if not 0 <= row["step"] <= 2**53:
        return False
    if row.get("kind") == "episode":
        return _is_number(row.get("return"))
    if row.get("kind") == "evaluation":
        returns = row.get("returns")
        are_numbers = isinstance(returns, list) and returns and all(map(_is_number, returns))
        return bool(are_numbers) and _is_number(row.get("mean_return"))
    return "kind" in row


def _is_number(value: Any) -> bool:
    return type(value) in (int, float)


def _read_rows(path: Path) -> list[Row]:
    if not path.exists():
        return []
    rows: list[Row] = []
    lines = path.read_bytes().split(b"\n")
    for number, line in enumerate(lines[:-1], 1):  # what follows the last line end is not whole
        try:
            row = json.loads(line)
        except ValueError:
            row = None
        if not _is_row(row):
            raise RunError(f"{path}:{number}: must be a row of a training, got {line[:80]!r}")
        rows.append(row)
    return rows


def _last_row(rows: Iterable[Row], kind: str) -> Row | None:
    return next((row for row in reversed(list(rows)) if row["kind"] == kind), None)
