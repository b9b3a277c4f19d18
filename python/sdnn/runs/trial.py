"""One trial: what the engine needs of it, and trials in Python, which are trainings.

The trials of the core's agents on the acrobot are computed in C++ (``_core.AcrobotTrial`` and its
siblings), by the same protocol, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias, TypeVar

import gymnasium as gym
from numpy.typing import NDArray

from sdnn.agents import Callback, StopTrainingOnRewardThreshold, Training
from sdnn.arguments import whole
from sdnn.runs.records import TrialRows
from sdnn.runs.registry import agent_entry

if TYPE_CHECKING:
    from sdnn.runs.spec import RunSpec


class Trial(Protocol):
    """One trial, as those in C++: advanced in pieces, whose sizes do not change its outcome."""

    @property
    def episode(self) -> int:
        """Learning episodes done."""

    @property
    def finished(self) -> bool:
        """Whether all learning episodes are done."""

    @property
    def n_decisions(self) -> int:
        """Decisions made so far, in learning and test episodes."""

    def advance(self, n_episodes: int, /) -> None:
        """Run up to so many more learning episodes and the test episodes due among them."""

    def test_rows(self) -> dict[str, NDArray[Any]]:
        """Test episodes so far: arrays `episode`, `steps`, `episode_return`, `solved`, (n,)."""


_AnyTrial = TypeVar("_AnyTrial")


@contextmanager
def opened(trial: _AnyTrial) -> Iterator[_AnyTrial]:
    """Close at the end what a trial has open; those in C++ have nothing to close."""
    try:
        yield trial
    finally:
        if hasattr(trial, "close"):
            trial.close()


Reason: TypeAlias = Literal["done", "target", "stopped"]


class TrainingTrial:
    """A `sdnn.agents.Training` as a trial; its evaluations are the test episodes.

    Parameters
    ----------
    training
        Learns for a number of episodes, or of steps.
    environments
        Closed at the end.
    target
        One of its callbacks, with which it is finished before that number.
    """

    def __init__(
        self,
        training: Training,
        environments: Iterable[gym.Env[Any, Any]],
        target: StopTrainingOnRewardThreshold | None = None,
    ) -> None:
        self.training = training
        self._open = tuple(environments)
        self._target = target

    @property
    def episode(self) -> int:
        """Learning episodes done."""
        return self.training.n_episodes

    @property
    def done(self) -> int:
        """Learning episodes or steps done, whichever its length is told in."""
        training = self.training
        return training.n_episodes if training.steps is None else training.n_steps

    @property
    def reason(self) -> Reason:
        """Why it ended."""
        if self._target is not None and self._target.is_reached(self.training):
            return "target"
        return "done" if self.training.is_finished else "stopped"

    @property
    def finished(self) -> bool:
        """Whether all is learned, or the target is reached."""
        return self.reason != "stopped"

    @property
    def n_decisions(self) -> int:
        """Decisions made so far, in learning and test episodes."""
        return self.training.n_steps + self.rows().n_evaluated

    def advance(self, n_episodes: int, /) -> None:
        """Run up to so many more learning episodes and the evaluations due among them."""
        last = self.episode + whole("n_episodes", n_episodes, 0, 2**53)
        if n_episodes:
            for _ in self.training.pieces(0.0):
                if self.episode >= last:
                    break

    def pieces(self, seconds: float) -> Generator[None, None, None]:
        """Learn to the end, in pieces of about so many seconds."""
        return self.training.pieces(seconds)

    def test_rows(self) -> dict[str, NDArray[Any]]:
        """Test episodes so far: arrays `episode`, `steps`, `episode_return`, `solved`, (n,)."""
        rows = self.rows()
        names = ("episode", "steps", "episode_return", "solved")
        return {name: getattr(rows, name) for name in names}

    def rows(self) -> TrialRows:
        """Return all rows so far: learning episodes and evaluations."""
        return TrialRows.from_training(self.training.rows)

    def close(self) -> None:
        """Close the environments, if they are open still."""
        environments, self._open = self._open, ()
        with ExitStack() as stack:
            for env in environments:
                stack.callback(env.close)


def training_trial(spec: RunSpec) -> TrainingTrial:
    """Make the trial of a specification in Python: the rows of a compiled one, bit for bit.

    Raises
    ------
    ConfigError
        If environment or agent cannot be made.
    """
    target = None
    if spec.budget.target_return is not None:
        target = StopTrainingOnRewardThreshold(spec.budget.target_return)
    with ExitStack() as stack:
        env: Any = spec.make_training_env()
        stack.callback(env.close)
        evaluation_env = None
        if spec.is_evaluated:
            evaluation_env = spec.make_env("evaluation_sensor_noise")
            stack.callback(evaluation_env.close)
        training = training_of(spec, env, evaluation_env, () if target is None else (target,))
        stack.pop_all()
    environments = [one for one in (env, evaluation_env) if one is not None]
    return TrainingTrial(training, environments, target)


def training_of(
    spec: RunSpec, env: Any, evaluation_env: gym.Env[Any, Any] | None, callbacks: Iterable[Callback]
) -> Training:
    """Make the training of a specification in environments that it has made.

    On the paper's acrobot the streams of the sensors' noise run on over all episodes, and resets
    are told the number of the episode, for the goal that tightens. Elsewhere each episode has a
    seed of its own.
    """
    is_acrobot = spec.environment is None
    return agent_entry(spec.agent.name).training(
        spec.make_agent(env.envs[0] if isinstance(env, gym.vector.SyncVectorEnv) else env),
        env,
        steps=spec.budget.steps,
        episodes=spec.budget.episodes,
        seed=None if is_acrobot else spec.seed,
        callbacks=callbacks,
        evaluate_every=spec.protocol.evaluate_every or None,
        evaluate_every_episodes=spec.protocol.evaluate_every_episodes,
        evaluation_env=evaluation_env,
        evaluation_episodes=spec.protocol.evaluation_episodes or 1,
        limit_bootstraps=spec.protocol.limit_bootstraps,
        reset_options=reset_options(spec),
    )


def reset_options(spec: RunSpec) -> Callable[[int], dict[str, Any]] | None:
    """Return what resets are told on the paper's acrobot: the number of the episode."""
    return _episode_number if spec.environment is None else None


def _episode_number(episode: int) -> dict[str, Any]:
    return {"episode": episode}
