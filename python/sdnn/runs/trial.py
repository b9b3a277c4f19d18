"""One trial: what the engine asks of it, its loop over Gymnasium environments, and the acrobot's.

The trials of the core's agents are computed in C++ (``_core.AcrobotTrial`` and its siblings), by
the same protocol, bit for bit.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents import Transition
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
    """One trial that can be advanced in pieces; the pieces' sizes do not change its outcome."""

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


class LearningAgent(Protocol):
    """What a trial asks of an agent in Python; actions are elements of its action space."""

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def act(self, observation: NDArray[np.float64], explore: bool = True) -> Any:
        """Choose the action to take; without `explore` nothing may be learned or remembered."""

    def learn(self, transition: Transition) -> None:
        """Learn one step."""


class EpisodeLoop:
    """A trial over Gymnasium environments: learning episodes, and test episodes between them.

    It holds the GIL, so trials of this kind do not run faster on several threads. At the end of the
    last episode, and by `close`, both environments are closed.

    Parameters
    ----------
    agent
        Acts in both environments and learns in the first.
    env, test_env
        The task of the learning and of the test episodes; with own random streams, so that tests
        change nothing that is learned later.
    protocol
        Learning and test episodes.
    """

    def __init__(
        self,
        agent: LearningAgent,
        env: gym.Env[NDArray[np.float64], Any],
        test_env: gym.Env[NDArray[np.float64], Any],
        protocol: ProtocolConfig,
    ) -> None:
        self._agent = agent
        self._env = env
        self._test_env = test_env
        self._protocol = protocol
        self._open: tuple[gym.Env[Any, Any], ...] = (env, test_env)
        self._rows: list[tuple[int, int, float, bool]] = []
        self._episode = 0
        self._n_decisions = 0

    @property
    def episode(self) -> int:
        """Learning episodes done."""
        return self._episode

    @property
    def finished(self) -> bool:
        """Whether all learning episodes are done."""
        return self._episode == self._protocol.n_learning_episodes

    @property
    def n_decisions(self) -> int:
        """Decisions made so far, in learning and test episodes."""
        return self._n_decisions

    def advance(self, n_episodes: int, /) -> None:
        """Run up to `n_episodes` more learning episodes, with the test episodes that fall due.

        Raises
        ------
        ValueError
            If `n_episodes` is negative, or the return of a test episode is not finite.
        """
        if n_episodes < 0:
            raise ValueError(f"n_episodes must be at least 0, got {n_episodes}")
        last = min(self._episode + n_episodes, self._protocol.n_learning_episodes)
        while self._episode < last:
            if hasattr(self._agent, "progress"):
                self._agent.progress = self._episode / self._protocol.n_learning_episodes
            self._episode += 1
            self._run_episode(self._env, learning=True)
            if self._episode % self._protocol.test_interval == 0:
                self._rows.append(self._run_episode(self._test_env, learning=False))
        if self.finished:
            self.close()

    def close(self) -> None:
        """Close both environments, if they are open still."""
        environments, self._open = self._open, ()
        with ExitStack() as stack:
            for env in environments:
                stack.callback(env.close)

    def test_rows(self) -> dict[str, NDArray[Any]]:
        """Test episodes so far: arrays `episode`, `steps`, `episode_return`, `solved`, (n,)."""
        types = {
            "episode": np.int32,
            "steps": np.int32,
            "episode_return": np.float64,
            "solved": np.bool_,
        }
        return {
            name: np.array([row[column] for row in self._rows], kind)
            for column, (name, kind) in enumerate(types.items())
        }

    def _reset(self, env: gym.Env[NDArray[np.float64], Any]) -> NDArray[np.float64]:
        """Begin an episode of an environment."""
        return env.reset()[0]

    def _run_episode(
        self, env: gym.Env[NDArray[np.float64], Any], *, learning: bool
    ) -> tuple[int, int, float, bool]:
        observation = self._reset(env)
        self._agent.begin_episode()
        steps, episode_return = 0, 0.0
        terminated = truncated = False
        while not (terminated or truncated):
            action = self._agent.act(observation, explore=learning)
            # A copy: an environment may change the action, which is to be learned.
            following, reward, terminated, truncated, _ = env.step(copy.copy(action))
            if learning:
                ends = terminated or (truncated and not self._protocol.limit_bootstraps)
                self._agent.learn(Transition(observation, action, float(reward), following, ends))
            observation = following
            steps += 1
            episode_return += float(reward)
        self._n_decisions += steps
        if not (learning or math.isfinite(episode_return)):
            raise ValueError(
                "rewards of env must add up to a finite number, got"
                f" {episode_return} in the test after learning episode {self._episode}"
            )
        return self._episode, steps, episode_return, terminated


class PythonTrial(EpisodeLoop):
    """The protocol of the core's `AcrobotTrial` for an agent in Python, on Gymnasium environments.

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

    def __init__(
        self,
        make_agent: Callable[..., LearningAgent],
        *,
        approximator: Any,
        learning: Any,
        acrobot: AcrobotConfig,
        goal: GoalScheduleConfig,
        sensors: SensorConfig,
        protocol: ProtocolConfig,
        seed: int,
    ) -> None:
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
        super().__init__(agent, env, test_env, protocol)

    def _reset(self, env: gym.Env[NDArray[np.float64], Any]) -> NDArray[np.float64]:
        return env.reset(options={"episode": self._episode})[0]


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
