"""Trainings: their arguments, results and files, around the loop."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.environments.space_kinds import require_same_kind, require_single
from sdnn.environments.types import AnyEnv, Data, Env, Info, VectorEnv
from sdnn.support.arguments import flag, has_methods, path_of, require, shown, whole
from sdnn.support.display import Displayed
from sdnn.training.episodes import Episodes, SingleEnvironment
from sdnn.training.files import (
    SavedTraining,
    read_training,
    share_statistics,
    take_statistics,
    write_training,
)
from sdnn.training.interfaces import EnvironmentAdapter, Learner, explained
from sdnn.training.loop import Row, TrainingLoop, learner_adapter

_SETTINGS = (
    "seed", "evaluate_every", "evaluate_every_episodes", "evaluation_episodes", "limit_bootstraps"
)  # fmt: skip
"""Arguments that are saved, besides the goal."""
_STATE = ("n_steps", "n_episodes", "n_rows", "evaluations")
"""Attributes that are saved as they are."""


@dataclass(frozen=True, kw_only=True, repr=False)
class TrainingResult(Displayed):
    """The result of a training.

    ``rows`` are those of the episodes and evaluations since it was begun, or last loaded;
    ``is_finished`` is False if a callback stopped it.
    """

    n_steps: int
    n_episodes: int
    rows: tuple[Row, ...]
    is_finished: bool

    @property
    def returns(self) -> NDArray[np.float64]:
        """Undiscounted returns of the episodes, in order, shape (n,)."""
        return np.array(returns_of(self.rows))

    @property
    def evaluations(self) -> NDArray[np.float64]:
        """Steps and mean returns of the evaluations, shape (n, 2)."""
        pairs = [(r["step"], r["mean_return"]) for r in self.rows if r["kind"] == "evaluation"]
        return np.array(pairs, np.float64).reshape(-1, 2)

    def _facts(self) -> dict[str, object]:
        """Return the facts that ``repr`` and notebooks display, by their labels."""
        last = [f"{mean:.5g}" for _, mean in self.evaluations[-1:]] or ["none"]
        facts: dict[str, object] = {"steps": self.n_steps, "episodes": self.n_episodes}
        if self.returns.size:
            facts["last return"] = f"{self.returns[-1]:.5g}"
        return {**facts, "last evaluation": last[0]}

    def _curve(self) -> Sequence[float]:
        return returns_of(self.rows)


def returns_of(rows: Iterable[Row]) -> list[float]:
    """Return the returns of the episodes among the rows of a training."""
    return [row["return"] for row in rows if row["kind"] == "episode"]


class Callback:
    """The base of callbacks: every method does nothing unless overridden.

    A callback stops the training by ``training.stop()``.
    """

    step_interval: int = 1
    """``on_step`` is called where the number of steps is a multiple of it."""

    def on_start(self, training: Training) -> None:
        """Before the first step, also of a training that is resumed."""

    def on_step(self, training: Training) -> None:
        """After every learned step, or every ``step_interval`` of them."""

    def on_row(self, training: Training, row: Row) -> None:
        """After an episode (``row["kind"] == "episode"``) and an evaluation (``"evaluation"``)."""

    def on_end(self, training: Training) -> None:
        """After the last step, also of a training that was interrupted."""


def checked_callbacks(callbacks: Iterable[Callback]) -> tuple[Callback, ...]:
    """Return callbacks as a tuple; TypeError for an object without the methods of `Callback`."""
    try:
        checked = tuple(callbacks)
    except TypeError:
        raise TypeError(f"callbacks must be a list of callbacks, got {shown(callbacks)}") from None
    for callback in checked:
        has_methods("callbacks", callback, "callbacks", "on_start", "on_step", "on_row", "on_end")
        for name in ("_on_step", "_on_rollout_end", "_on_training_start", "_on_training_end"):
            if hasattr(callback, name):  # of Stable-Baselines3; it would never be called
                raise TypeError(
                    f"callbacks must not have {name}, got {shown(callback)}: Callback has"
                    " on_start, on_step, on_row and on_end; training.stop() ends a training"
                )
    return checked


def shows_bar() -> bool:
    """Return whether trainings show a bar: in a notebook, or a terminal that can move its cursor.

    A log, a pipe and a captured standard error show none.
    """
    if sys.stderr is not None and sys.stderr.isatty():
        return os.environ.get("TERM", "") not in ("dumb", "unknown")
    if "IPython" not in sys.modules:
        return False
    from rich.console import Console

    return Console(stderr=True).is_jupyter


class Training(TrainingLoop):
    """An agent that learns in an environment for a number of steps or episodes.

    Every episode resets the environment with a seed of its own. A training is therefore resumed
    exactly after `load`, from within an episode too: the episode is repeated from its reset with
    the actions that were taken. That needs an environment in which equal seeds and actions give
    equal episodes; elsewhere new episodes can be begun instead.

    In a *vector environment* one agent learns in several environments. In each round it chooses an
    action for each, all step together, and it learns the outcomes, all in the environments' order:
    a vector of one gives the bits of the single environment. ``SyncVectorEnv``, ``AsyncVectorEnv``
    and all autoreset modes give the same bits. Episodes of a vector that cannot be reset one by one
    with seeds cannot be repeated: any other than these two, unless its autoreset mode is
    ``DISABLED`` or its metadata have ``"reset_mask": True``.

    Parameters
    ----------
    agent
        Learns every transition; its `progress` and its number of environments follow the training.
    env
        An environment with the agent's spaces, or a vector of such.
    steps, episodes
        How long: one of them. Steps are transitions learned, over all environments.
    seed
        Root of the episodes' seeds. None: resets have no seeds, so that the environments' random
        streams run on; episodes cannot be repeated then.
    first_episode
        The number of the first episode: the ``next_episode`` of an earlier training with the same
        seed, so as not to meet the same episodes again.
    callbacks
        See `sdnn.training.callbacks`.
    evaluate_every, evaluate_every_episodes
        Steps, or learned episodes, between two evaluations; both None: none.
    evaluation_env
        For evaluations; needed if there are any, because an environment has one episode at a time.
    evaluation_episodes
        Greedy episodes in each, always with the same seeds.
    limit_bootstraps
        Whether the last step of an episode that a time limit ends is learned like any other; else
        as one that terminates.
    reset_options
        Returns the options of a reset of a single environment: of a learning episode from its
        number, from 1, of an evaluation from the number of learned episodes.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of its range, the environments' spaces are not the agent's, or
        arguments do not go together.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLearning, Training
    >>> env = gym.make("MountainCarContinuous-v0")
    >>> agent = SDNNQLearning(env, seed=1)
    >>> training = Training(agent, env, steps=500)
    >>> training.run().n_steps
    500
    >>> envs = gym.make_vec("Pendulum-v1", num_envs=4, vectorization_mode="sync")
    >>> agent = SDNNQLearning(envs, seed=1)
    >>> agent.train(envs, steps=500).n_steps
    500
    """

    @explained
    def __init__(
        self,
        agent: Learner,
        env: Env | VectorEnv,
        steps: int | None = None,
        *,
        episodes: int | None = None,
        seed: int | None = 0,
        first_episode: int = 0,
        callbacks: Iterable[Callback] = (),
        evaluate_every: int | None = None,
        evaluate_every_episodes: int | None = None,
        evaluation_env: Env | None = None,
        evaluation_episodes: int = 10,
        limit_bootstraps: bool = True,
        reset_options: Callable[[int], Info] | None = None,
    ) -> None:
        has_methods("agent", agent, "an agent", "act", "learn", "begin_episode")
        has_methods("env", env, "an environment, as of gymnasium.make(id)", "reset", "step")
        if evaluation_env is not None:
            require_single("evaluation_env", evaluation_env)
            if evaluation_env is env:
                raise ValueError(
                    "evaluation_env must be another environment than env: an evaluation would end"
                    " the episode that is learned from"
                )
            require_same_kind(agent, evaluation_env, "evaluation_env")
            share_statistics(env, evaluation_env)
        require_same_kind(agent, env)
        if (steps is None) == (episodes is None):
            raise ValueError(
                "one of steps and episodes must be given,"
                f" got steps={shown(steps)}, episodes={shown(episodes)}"
            )
        if evaluate_every is not None and evaluate_every_episodes is not None:
            raise ValueError("evaluate_every must not be given with evaluate_every_episodes")
        self.agent: Any = agent
        self.env = env
        self.steps = _optional("steps", steps)
        self.episodes = _optional("episodes", episodes)
        self.seed = None if seed is None else whole("seed", seed, 0, 2**64 - 1)
        first = whole("first_episode", first_episode, 0, 2**53)
        self.callbacks = checked_callbacks(callbacks)
        self.evaluate_every = _optional("evaluate_every", evaluate_every)
        self.evaluate_every_episodes = _optional("evaluate_every_episodes", evaluate_every_episodes)
        if evaluation_env is None and not (evaluate_every is evaluate_every_episodes is None):
            raise ValueError("evaluation_env must be given where evaluations are")
        self.evaluation_env = evaluation_env
        self.evaluation_episodes = whole("evaluation_episodes", evaluation_episodes, 1, 10**9)
        self.limit_bootstraps = flag("limit_bootstraps", limit_bootstraps)
        is_function = reset_options is None or callable(reset_options)
        expected = "be a function or None"
        require(is_function, "reset_options", expected, reset_options, TypeError)
        self.reset_options = reset_options
        self._stops = False
        self.evaluations = []
        self.rows = []
        self.blocks = {}
        adapter = _adapter_for(env)
        self._learner = learner_adapter(agent, adapter.n_environments)
        self._episodes = Episodes(
            env,
            adapter,
            self._learner,
            self.seed,
            first,
            self._options,
            self._unusable,
        )
        if reset_options is not None and not isinstance(adapter, SingleEnvironment):
            raise ValueError("reset_options must be None for a vector environment")

    @property
    def n_environments(self) -> int:
        """Number of environments in which the agent learns at once."""
        return self._episodes.n_environments

    @property
    def next_episode(self) -> int:
        """The number of the first episode that has not begun."""
        return self._episodes.next_number

    def run(self) -> TrainingResult:
        """Learn until all is done, a callback stops, or the user interrupts.

        Errors of the environment are raised after the callbacks' ``on_end``; what is learned
        stays. The next ``run`` begins new episodes, or first evaluates where that failed.

        Raises
        ------
        KeyboardInterrupt
            After the step in which it came and the callbacks' ``on_end``; a second one at once.
        UnusableStepError
            If a step or reset cannot be used: a `ValueError` that names step and episode.
        RuntimeError
            If an error of a callback left a step of this training half done before.
        """
        for _ in self.pieces(math.inf):
            pass
        return TrainingResult(
            n_steps=self.n_steps,
            n_episodes=self.n_episodes,
            rows=tuple(self.rows),
            is_finished=self.is_finished,
        )

    def save(self, path: str | Path) -> None:
        """Write agent and training in one file for `load`; OSError if it cannot be written."""
        names = ("steps", "episodes", "next_episode", *_SETTINGS, *_STATE)
        self._keep_statistics()
        saved = SavedTraining(
            **{name: getattr(self, name) for name in names},
            blocks=list(self.blocks.values()),
            wrappers=self._episodes.learned_before,
            present=self._episodes.saved(self.agent.action_space.shape or ()),
        )
        write_training(path_of("path", path), self.agent, saved)

    @classmethod
    @explained
    def load(
        cls,
        path: str | Path,
        env: Env | VectorEnv,
        *,
        callbacks: Iterable[Callback] = (),
        evaluation_env: Env | None = None,
        steps: int | None = None,
        episodes: int | None = None,
        repeat_episodes: bool = True,
        reset_options: Callable[[int], Info] | None = None,
    ) -> Self:
        """Read a training that `save` wrote, to resume exactly where it was.

        ``steps`` or ``episodes`` are another goal. Without ``repeat_episodes`` new episodes begin,
        in any number of environments: for robots, which should not repeat what they did, and where
        equal seeds and actions do not give equal episodes. The rest is as in the constructor.

        Raises
        ------
        OSError
            If the file cannot be read.
        UnrepeatedEpisodeError
            If the environment does not repeat the episode: a `ValueError`.
        ValueError
            If it is damaged or holds no training; if episodes are to be repeated, and the
            environment is a vector of another size, or cannot be reset one by one.
        """
        does_repeat = flag("repeat_episodes", repeat_episodes)
        agent, saved = read_training(path_of("path", path))
        has_goal = steps is not None or episodes is not None
        training = cls(
            agent,
            env,
            steps=steps if has_goal else saved.steps,
            episodes=episodes if has_goal else saved.episodes,
            first_episode=saved.next_episode,
            callbacks=callbacks,
            evaluation_env=evaluation_env,
            reset_options=reset_options,
            **{name: getattr(saved, name) for name in _SETTINGS},
        )
        for name in _STATE:
            setattr(training, name, getattr(saved, name))
        training.blocks = {block.length: block for block in saved.blocks}
        # A repeated episode begins with the statistics that wrappers had before it.
        learned = saved.wrappers if does_repeat else agent.wrappers
        is_same = take_statistics(training._episodes.wrappers, learned)
        if does_repeat:
            if learned and not is_same:
                raise ValueError(f"env must have the training's {learned[0].wrapper}, got {env}")
            training._episodes.learned = learned
            training._episodes.repeat(saved.present)
        return training

    def _options(self, episode: int) -> Data | None:
        """Return the options of the reset for a number of episodes; None without a function."""
        if self.reset_options is None:
            return None
        made = self.reset_options(episode)
        require(isinstance(made, Mapping), "reset_options", "return a mapping", made, TypeError)
        return dict(made)

    def _find_listeners(self) -> list[tuple[int, Callback]]:
        """Return the callbacks that are called after steps, each with its interval; ValueError."""
        return [
            (whole("step_interval", getattr(callback, "step_interval", 1), 1, 2**53), callback)
            for callback in self.callbacks
            if getattr(callback.on_step, "__func__", None) is not Callback.on_step
        ]


@explained
class CheckpointCallback(Callback):
    """Saves agent and training at regular steps; `Training.load` resumes from there exactly.

    ``n_saved`` is the number of steps at the last save; None before the first.
    """

    def __init__(self, path: str | Path, every: int = 10_000) -> None:
        self.path = path_of("path", path)
        self.every = self.step_interval = whole("every", every, 1, 2**53)
        self.n_saved: int | None = None

    def on_step(self, training: Training) -> None:
        """Save, as ``step_interval`` steps have passed."""
        self._save(training)

    def on_end(self, training: Training) -> None:
        """Save at the end of the training, also after an error unless it left a step half done."""
        if not training.is_within_step:
            self._save(training)

    def _save(self, training: Training) -> None:
        training.save(self.path)
        self.n_saved = training.n_steps


def _optional(name: str, value: float | None) -> int | None:
    """Return a number of steps or episodes as an int; it may be None, or a float that is whole."""
    if isinstance(value, float) and value.is_integer():  # such as 1e5
        value = int(value)
    return None if value is None else whole(name, value, 1, 2**53)


def _adapter_for(env: AnyEnv) -> EnvironmentAdapter:
    """Return the adapter for an environment, or for a vector of them."""
    if not isinstance(env, gym.vector.VectorEnv):
        return SingleEnvironment(env)
    from sdnn.training.vectors import vector_adapter

    return vector_adapter(env)
