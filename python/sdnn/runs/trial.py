"""One trial: what the engine needs of it, and trials in Python, which are trainings.

The trials of the core's agents on the acrobot are computed in C++ (``_core.AcrobotTrial`` and its
siblings), by the same protocol, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents import Training
from sdnn.agents.transition import Learner
from sdnn.arguments import whole
from sdnn.config import to_core
from sdnn.environments import (
    AcrobotConfig,
    AcrobotSensors,
    AcrobotSwingUpEnv,
    GoalSchedule,
    GoalScheduleConfig,
    SensorConfig,
    TighteningGoal,
)
from sdnn.runs.records import TrialRows


@dataclass(frozen=True, kw_only=True)
class ProtocolConfig:
    """Learning protocol of a trial; the defaults are the paper's values (method.md, section 5.2).

    Parameters
    ----------
    n_learning_episodes
        Learning episodes in a trial, at least 1.
    test_interval
        One test episode follows every so many learning episodes, at least 1.
    limit_bootstraps
        Whether the last transition before the time limit bootstraps, as one that goes on; else it
        counts as terminated. A reading.
    noisy_tests
        Whether the sensors are as noisy in test episodes as in learning ones. A reading.
    """

    n_learning_episodes: int = 15_000
    test_interval: int = 10
    limit_bootstraps: bool = True
    noisy_tests: bool = True

    def to_core(self) -> _core.ProtocolConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.ProtocolConfig)


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


class TrainingTrial:
    """A `sdnn.agents.Training` as a trial; its evaluations are the test episodes.

    Parameters
    ----------
    training
        Learns for a number of episodes, or of steps.
    environments
        Closed at the end.
    """

    def __init__(self, training: Training, environments: Iterable[gym.Env[Any, Any]]) -> None:
        self.training = training
        self._open = tuple(environments)

    @property
    def episode(self) -> int:
        """Learning episodes done."""
        return self.training.n_episodes

    @property
    def finished(self) -> bool:
        """Whether all that was asked for is learned."""
        return self.training.is_finished

    @property
    def n_decisions(self) -> int:
        """Decisions made so far, in learning and test episodes."""
        return self.training.n_steps + sum(map(int, self._evaluated("lengths")))

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
        evaluations = [row for row in self.training.rows if row["kind"] == "evaluation"]
        episodes = [row["episode"] for row in evaluations for _ in row["returns"]]
        return {
            "episode": np.array(episodes, np.int32),
            "steps": np.array(self._evaluated("lengths"), np.int32),
            "episode_return": np.array(self._evaluated("returns"), np.float64),
            "solved": np.array(self._evaluated("terminated"), np.bool_),
        }

    def rows(self) -> TrialRows:
        """Return all rows so far: learning episodes and evaluations."""
        return TrialRows.from_training(self.training.rows)

    def close(self) -> None:
        """Close the environments, if they are open still."""
        environments, self._open = self._open, ()
        with ExitStack() as stack:
            for env in environments:
                stack.callback(env.close)

    def _evaluated(self, name: str) -> list[Any]:
        rows = self.training.rows
        return [one for row in rows if row["kind"] == "evaluation" for one in row[name]]


def python_trial(
    make_agent: Callable[..., Learner],
    *,
    approximator: Any,
    learning: Any,
    acrobot: AcrobotConfig,
    goal: GoalScheduleConfig,
    sensors: SensorConfig,
    protocol: ProtocolConfig,
    seed: int,
) -> TrainingTrial:
    """Make the trial of an agent in Python, on Gymnasium environments.

    For the same agent and seed it gives the rows of the compiled trial, bit for bit.

    Parameters
    ----------
    make_agent
        Makes the agent from an observation space, an action space and ``approximator=``,
        ``learning=``, ``seed=``.
    approximator, learning
        The agent's settings. ``approximator.n_inputs`` must be the number of sensors.
    acrobot, goal, sensors, protocol
        The task's settings.
    seed
        The same seed gives every agent the same sensor noise, observation by observation.

    Raises
    ------
    ValueError
        If a value is out of its range, or agent and sensors do not fit.
    """
    check_protocol(protocol)
    if approximator.n_inputs != sensors.n_inputs:
        raise ValueError(
            f"n_inputs must be the number of inputs of the sensors, {sensors.n_inputs},"
            f" got {approximator.n_inputs}"
        )
    tested = sensors if protocol.noisy_tests else replace(sensors, noise=0.0)
    env = _environment(acrobot, goal, sensors, seed, "sensor_noise")
    test_env = _environment(acrobot, goal, tested, seed, "evaluation_sensor_noise")
    agent = make_agent(
        env.observation_space,
        env.action_space,
        approximator=approximator,
        learning=learning,
        seed=seed,
    )
    return protocol_trial(agent, env, test_env, protocol, lambda episode: {"episode": episode})


def protocol_trial(
    agent: Learner,
    env: gym.Env[Any, Any],
    test_env: gym.Env[Any, Any],
    protocol: ProtocolConfig,
    reset_options: Callable[[int], dict[str, Any]] | None = None,
) -> TrainingTrial:
    """Make a trial by the paper's protocol; the environments' random streams run on.

    Parameters
    ----------
    agent
        Acts in both environments and learns in the first.
    env, test_env
        The task of the learning and of the test episodes; with own random streams, so that tests
        change nothing that is learned later.
    protocol
        Learning and test episodes.
    reset_options
        See `sdnn.agents.Training`.
    """
    training = Training(
        agent,
        env,
        episodes=protocol.n_learning_episodes,
        seed=None,
        evaluate_every_episodes=protocol.test_interval,
        evaluation_env=test_env,
        evaluation_episodes=1,
        limit_bootstraps=protocol.limit_bootstraps,
        reset_options=reset_options,
    )
    return TrainingTrial(training, (env, test_env))


def check_protocol(protocol: ProtocolConfig) -> None:
    """Check what the core checks of a trial in C++.

    Raises
    ------
    ValueError
        If a number of the protocol is less than 1.
    """
    for name in ("n_learning_episodes", "test_interval"):
        if getattr(protocol, name) < 1:
            raise ValueError(f"{name} must be at least 1, got {getattr(protocol, name)}")


def _environment(
    acrobot: AcrobotConfig, goal: GoalScheduleConfig, sensors: SensorConfig, seed: int, stream: Any
) -> gym.Env[NDArray[np.float64], Any]:
    """Stack the task as the core does."""
    env = TighteningGoal(AcrobotSwingUpEnv(config=acrobot, dtype="float64"), GoalSchedule(goal))
    return AcrobotSensors(env, sensors, seed=seed, stream=stream)
