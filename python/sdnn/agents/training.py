"""The loop: an agent learns in an environment, can be stopped anywhere and goes on exactly."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.evaluation import episode_seed, evaluate
from sdnn.agents.files import Arrays, Description, from_file, read, write
from sdnn.agents.interrupts import Interrupts
from sdnn.agents.transition import Transition
from sdnn.arguments import has_methods, path_of, real, whole

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Callback", "Row", "Training", "TrainingResult"]

Row: TypeAlias = Mapping[str, Any]
"""What is known of an episode or an evaluation: numbers and words by name."""

_LEARNING = 0
_ARRAYS = "training."


class Callback:
    """Is told what happens in a training; every method does nothing unless overridden.

    A callback stops the training by ``training.stop()``.
    """

    def on_start(self, training: Training) -> None:
        """Before the first step, also of a training that goes on."""

    def on_step(self, training: Training) -> None:
        """After every learned step."""

    def on_row(self, training: Training, row: Row) -> None:
        """After an episode (``row["kind"] == "episode"``) and an evaluation (``"evaluation"``)."""

    def on_end(self, training: Training) -> None:
        """After the last step, also of a training that was interrupted."""


class Learner(Protocol):
    """What is trained: every `sdnn.agents.Agent`."""

    action_space: gym.Space[Any]
    progress: float

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def act(self, observation: Any, explore: bool = True) -> Any:
        """Choose an action."""

    def learn(self, transition: Transition) -> None:
        """Learn a step."""

    def flat_observation(self, observation: Any) -> NDArray[np.float64]:
        """Give the observed variables as a vector."""

    def description(self) -> Description:
        """Say what it is."""

    def state(self) -> Arrays:
        """Give what it remembers."""

    def save(self, path: str | Path) -> None:
        """Write it to a file."""


@dataclass(frozen=True, kw_only=True)
class TrainingResult:
    """What came of a training.

    Parameters
    ----------
    n_steps, n_episodes
        Learned in all, and whole episodes among them.
    rows
        Of the episodes and evaluations since it was begun, or last loaded.
    is_finished
        Whether all that was asked for is done: False if a callback stopped it.
    """

    n_steps: int
    n_episodes: int
    rows: tuple[Row, ...]
    is_finished: bool

    @property
    def returns(self) -> NDArray[np.float64]:
        """Undiscounted returns of the episodes, in order, shape (n,)."""
        return np.array([row["return"] for row in self.rows if row["kind"] == "episode"])

    @property
    def evaluations(self) -> NDArray[np.float64]:
        """Steps and mean returns of the evaluations, shape (n, 2)."""
        found = [(r["step"], r["mean_return"]) for r in self.rows if r["kind"] == "evaluation"]
        return np.array(found, np.float64).reshape(-1, 2)


class Training:
    """An agent that learns in an environment for a number of steps or episodes.

    Every episode resets the environment with a seed that follows from ``seed`` and the episode's
    number. A training can therefore go on exactly after `load`, from within an episode too: the
    episode is repeated from its reset with the actions that were taken, which gives the environment
    the state it had, whatever environment it is, as long as equal seeds and actions give equal
    episodes.

    Parameters
    ----------
    agent
        Learns every transition; its `progress` follows the training.
    env
        With the agent's spaces.
    steps, episodes
        How long: one of them.
    seed
        Root of the episodes' seeds.
    callbacks
        Are told what happens; see `sdnn.agents.callbacks`.
    evaluate_every
        Steps between two evaluations; None: none.
    evaluation_env
        For evaluations; needed if there are any, because an environment has one episode at a time.
    evaluation_episodes
        Greedy episodes in each, always with the same seeds.

    Raises
    ------
    ValueError
        If not one of steps and episodes is given, or something is out of range.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLearning, Training
    >>> env = gym.make("MountainCarContinuous-v0")
    >>> agent = SDNNQLearning(env.observation_space, env.action_space, seed=1)
    >>> training = Training(agent, env, steps=500)
    >>> training.run().n_steps
    500
    """

    def __init__(
        self,
        agent: Learner,
        env: gym.Env[Any, Any],
        *,
        steps: int | None = None,
        episodes: int | None = None,
        seed: int = 0,
        callbacks: Iterable[Callback] = (),
        evaluate_every: int | None = None,
        evaluation_env: gym.Env[Any, Any] | None = None,
        evaluation_episodes: int = 10,
    ) -> None:
        has_methods("agent", agent, "an agent", "act", "learn", "begin_episode")
        has_methods("env", env, "a Gymnasium environment", "reset", "step")
        if evaluation_env is not None:
            has_methods(
                "evaluation_env", evaluation_env, "a Gymnasium environment", "reset", "step"
            )
        if (steps is None) == (episodes is None):
            raise ValueError(
                f"one of steps and episodes must be given, got steps={steps}, episodes={episodes}"
            )
        self.agent = agent
        self.env = env
        self.steps = None if steps is None else whole("steps", steps, 1, 2**53)
        self.episodes = None if episodes is None else whole("episodes", episodes, 1, 2**53)
        self.seed = whole("seed", seed, 0, 2**64 - 1)
        self.callbacks = _listed(callbacks)
        self.evaluate_every = (
            None if evaluate_every is None else whole("evaluate_every", evaluate_every, 1, 2**53)
        )
        if evaluate_every is not None and evaluation_env is None:
            raise ValueError("evaluation_env must be given where evaluate_every is")
        self.evaluation_env = evaluation_env
        self.evaluation_episodes = whole("evaluation_episodes", evaluation_episodes, 1, 10**9)
        self.n_steps = 0
        """Steps learned."""
        self.n_episodes = 0
        """Whole episodes."""
        self.n_rows = 0
        """Rows that the callbacks were given, since the training was begun."""
        self._actions: list[Any] | None = None  # of the present episode; None: none has begun
        self._observation: Any = None
        self._return = 0.0
        self._stops = False
        self._is_within_step = False

    @property
    def is_within_step(self) -> bool:
        """Whether an error or a second interrupt left a step half done: it cannot be saved then."""
        return self._is_within_step

    @property
    def is_finished(self) -> bool:
        """Whether all that was asked for is done."""
        if self.steps is not None:
            return self.n_steps >= self.steps
        assert self.episodes is not None
        return self.n_episodes >= self.episodes

    def stop(self) -> None:
        """Stop after the present step; `run` goes on from there."""
        self._stops = True

    def run(self) -> TrainingResult:
        """Learn until all is done, a callback stops, or the user interrupts.

        Raises
        ------
        KeyboardInterrupt
            After the end of the step in which it came and the callbacks' ``on_end``; a second one
            at once.
        RuntimeError
            If an error left a step of this training half done before.
        """
        if self._is_within_step:
            raise RuntimeError("a training that was left within a step cannot go on: load it")
        rows: list[Row] = []
        self._stops = False
        with Interrupts(self.stop) as interrupts, ExitStack() as stack:
            for callback in self.callbacks:
                callback.on_start(self)
                stack.callback(callback.on_end, self)
            while not (self.is_finished or self._stops):
                self._is_within_step = True
                if self._actions is None:
                    self._begin_episode()
                rows += self._step()
                self._is_within_step = False
        if interrupts.received is not None:
            raise KeyboardInterrupt
        return TrainingResult(
            n_steps=self.n_steps,
            n_episodes=self.n_episodes,
            rows=tuple(rows),
            is_finished=self.is_finished,
        )

    def save(self, path: str | Path) -> None:
        """Write agent and training in one file, from which `load` goes on.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        arrays = self.agent.state()
        if self._actions is not None:
            shape = (-1, *(self.agent.action_space.shape or ()))
            arrays[_ARRAYS + "actions"] = np.array(self._actions).reshape(shape)
            arrays[_ARRAYS + "observation"] = np.asarray(self._flat_observation())
        counts = {
            "steps": self.steps,
            "episodes": self.episodes,
            "seed": self.seed,
            "n_steps": self.n_steps,
            "n_episodes": self.n_episodes,
            "n_rows": self.n_rows,
            "return": self._return,
            "evaluate_every": self.evaluate_every,
            "evaluation_episodes": self.evaluation_episodes,
        }
        write(path_of("path", path), {**self.agent.description(), "training": counts}, arrays)

    @classmethod
    def load(
        cls,
        path: str | Path,
        env: gym.Env[Any, Any],
        *,
        callbacks: Iterable[Callback] = (),
        evaluation_env: gym.Env[Any, Any] | None = None,
        steps: int | None = None,
        episodes: int | None = None,
    ) -> Self:
        """Read a training that `save` wrote, to go on exactly where it was.

        Parameters
        ----------
        path
            The file.
        env, evaluation_env
            As the training had them.
        callbacks
            As in the constructor.
        steps, episodes
            Another goal; by default as it was.

        Raises
        ------
        OSError
            If the file cannot be read.
        ValueError
            If it is damaged, holds no training, or the environment does not repeat the episode.
        """
        place = path_of("path", path)
        description, arrays = read(place)
        if "training" not in description:
            raise ValueError(f"{path} holds an agent and no training: Agent.load reads it")
        agent = from_file(place, description, arrays)
        counts = _checked_counts(place, description["training"])
        has_goal = steps is not None or episodes is not None
        training = cls(
            agent,
            env,
            steps=steps if has_goal else counts["steps"],
            episodes=episodes if has_goal else counts["episodes"],
            seed=counts["seed"],
            callbacks=callbacks,
            evaluate_every=counts["evaluate_every"],
            evaluation_env=evaluation_env,
            evaluation_episodes=counts["evaluation_episodes"],
        )
        training.n_steps, training.n_episodes = counts["n_steps"], counts["n_episodes"]
        training.n_rows, training._return = counts["n_rows"], counts["return"]
        if _ARRAYS + "actions" in arrays:
            actions = arrays[_ARRAYS + "actions"]
            if _ARRAYS + "observation" not in arrays or not np.isfinite(actions).all():
                raise ValueError(f"{place} is damaged: training has no actions and observation")
            training._repeat_episode(
                list(arrays[_ARRAYS + "actions"]), arrays[_ARRAYS + "observation"]
            )
        return training

    def _begin_episode(self) -> None:
        self._observation, _ = self.env.reset(
            seed=episode_seed(self.seed, _LEARNING, self.n_episodes)
        )
        self._actions, self._return = [], 0.0
        self.agent.begin_episode()

    def _repeat_episode(self, actions: list[Any], observation: NDArray[np.float64]) -> None:
        self._observation, _ = self.env.reset(
            seed=episode_seed(self.seed, _LEARNING, self.n_episodes)
        )
        for action in actions:
            self._observation, *_ = self.env.step(action)
        if not np.array_equal(self._flat_observation(), observation):
            raise ValueError(
                "env must repeat the episode in which the training was saved: the same seed and"
                f" actions led to {self._flat_observation()}, not to {observation}"
            )
        self._actions = actions

    def _flat_observation(self) -> NDArray[np.float64]:
        return self.agent.flat_observation(self._observation)

    def _step(self) -> list[Row]:
        """Act and learn once; give the rows that follow from it."""
        agent = self.agent
        assert self._actions is not None
        action = agent.act(self._observation)
        following, reward, terminated, truncated, _ = self.env.step(action)
        agent.learn(Transition(self._observation, action, float(reward), following, terminated))
        self._actions.append(action)
        self._observation = following
        self._return += float(reward)
        self.n_steps += 1
        rows: list[Row] = []
        if terminated or truncated:
            rows.append(
                self._row(
                    "episode",
                    episode=self.n_episodes,
                    **{"return": self._return},
                    length=len(self._actions),
                    terminated=bool(terminated),
                )
            )
            self.n_episodes += 1
            self._actions = None
        if self.steps is not None:
            agent.progress = self.n_steps / max(self.steps, self.n_steps)
        elif self._actions is None and self.episodes is not None:
            agent.progress = self.n_episodes / max(self.episodes, self.n_episodes)
        if self.evaluate_every is not None and self.n_steps % self.evaluate_every == 0:
            rows.append(self._evaluation())
        for callback in self.callbacks:
            for row in rows:
                callback.on_row(self, row)
            callback.on_step(self)
        return rows

    def _evaluation(self) -> Row:
        assert self.evaluation_env is not None
        began = time.perf_counter()
        found = evaluate(self.agent, self.evaluation_env, self.evaluation_episodes, seed=self.seed)
        return self._row(
            "evaluation",
            mean_return=found.mean_return,
            returns=found.returns.tolist(),
            mean_length=float(found.lengths.mean()),
            share_terminated=float(found.terminated.mean()),
            seconds=round(time.perf_counter() - began, 3),
        )

    def _row(self, kind: str, **values: Any) -> Row:
        self.n_rows += 1
        return {"kind": kind, "step": self.n_steps, **values}


_WHOLE = {
    "steps": (1, 2**53),
    "episodes": (1, 2**53),
    "seed": (0, 2**64 - 1),
    "n_steps": (0, 2**53),
    "n_episodes": (0, 2**53),
    "n_rows": (0, 2**53),
    "evaluate_every": (1, 2**53),
    "evaluation_episodes": (1, 10**9),
}
"""Least and largest of what `Training.save` writes down."""


def _checked_counts(path: Path, counts: Any) -> Mapping[str, Any]:
    """Read what `Training.save` wrote down; ValueError that names the file."""
    try:
        if not isinstance(counts, dict):
            raise TypeError(f"training must be a table, got {counts!r}")
        for name, (low, high) in _WHOLE.items():
            if counts[name] is not None or name not in ("steps", "episodes", "evaluate_every"):
                whole(name, counts[name], low, high)
        if (counts["steps"] is None) == (counts["episodes"] is None):
            raise ValueError("one of steps and episodes must be given")
        real("return", counts["return"])
    except KeyError as error:
        raise ValueError(f"{path} is damaged: training has no {error}") from None
    except (OverflowError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
    return counts


def _listed(callbacks: Iterable[Callback]) -> tuple[Callback, ...]:
    try:
        listed = tuple(callbacks)
    except TypeError:
        raise TypeError(f"callbacks must be a list of callbacks, got {callbacks!r}") from None
    for callback in listed:
        has_methods("callbacks", callback, "callbacks", "on_start", "on_step", "on_row", "on_end")
    return listed
