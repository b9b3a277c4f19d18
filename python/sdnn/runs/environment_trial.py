"""A trial of an agent in any Gymnasium environment, by the same protocol as on the acrobot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents import QLearningConfig, Training
from sdnn.approximators import SDNNCConfig
from sdnn.arguments import real, whole
from sdnn.config import ProtocolConfig
from sdnn.environments import NoisySensors, UnitSensors
from sdnn.runs.registry import agent_entry
from sdnn.runs.trial import TrainingTrial
from sdnn.runs.trial_config import TrialSettings

_LEARNING, _TEST = 0, 1
_MAX_SEED = 2**31
"""Environments may hand their seed on to generators that take no larger ones."""


def _listed(name: str, values: Any) -> tuple[Any, ...]:
    """Return the values of a range, none if there is no range; TypeError if they are no list."""
    if values is None:
        return ()
    if isinstance(values, str | bytes) or not isinstance(values, Sequence | np.ndarray):
        raise TypeError(f"{name} must be a tuple of numbers, got {values!r}")
    return tuple(values)


@dataclass(frozen=True, kw_only=True)
class EnvironmentConfig:
    """A Gymnasium environment as agents observe it.

    Every observed variable is scaled to [0, 1]; values outside its range saturate.

    Parameters
    ----------
    id
        What `gymnasium.make` is given: ``"Pendulum-v1"``, or ``"module:namespace/Name-v0"``, for
        which the module is imported first.
    kwargs
        Further arguments of `gymnasium.make`, such as ``max_episode_steps``, and of the
        environment.
    observation_low, observation_high
        Range of each observed variable; by default the bounds of the observation space. Needed
        where these are infinite.
    noise
        Standard deviation of the noise on every variable, in parts of its range, >= 0.

    Raises
    ------
    TypeError, ValueError
        If a value is of another kind, or no number where one must be.
    """

    id: str
    kwargs: Mapping[str, Any] = field(default_factory=dict, hash=False)
    observation_low: tuple[float, ...] | None = None
    observation_high: tuple[float, ...] | None = None
    noise: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.id, str):
            raise TypeError(f"id must be the name of a Gymnasium environment, got {self.id!r}")
        if not isinstance(self.kwargs, Mapping):
            raise TypeError(f"kwargs must be a mapping from names to values, got {self.kwargs!r}")
        for name in ("observation_low", "observation_high"):
            for value in _listed(name, getattr(self, name)):
                real(name, value)
        if not 0 <= real("noise", self.noise) < math.inf:
            raise ValueError(f"noise must be finite and not negative, got {self.noise!r}")

    def make(
        self,
        seed: int = 0,
        stream: Literal["sensor_noise", "evaluation_sensor_noise"] = "sensor_noise",
    ) -> gym.Env[NDArray[np.float64], Any]:
        """Make the environment with its ranges and noise.

        Parameters
        ----------
        seed
            Where the noise starts.
        stream
            Which of the noise's streams.

        Raises
        ------
        gymnasium.error.Error
            If there is no such environment.
        ValueError
            If its observations are no one-dimensional Box, or their ranges do not fit.
        """
        env = gym.make(self.id, **{"disable_env_checker": True, **self.kwargs})
        unit = UnitSensors(env, self.observation_low, self.observation_high)
        return NoisySensors(unit, self.noise, edge="saturate", seed=seed, stream=stream)


def environment_trial(config: EnvironmentTrialConfig, seed: int) -> TrainingTrial:
    """Make a trial in a Gymnasium environment.

    Learning and test episodes have an environment each, with own seeds that follow from the
    trial's: all agents meet the same ones. ``solved`` says whether a test episode terminated.

    Parameters
    ----------
    config
        Everything but the seed.
    seed
        The trial's.

    Raises
    ------
    gymnasium.error.Error
        If there is no such environment.
    TypeError
        If the agent cannot work with its spaces.
    ValueError
        If a value is out of its range, or agent and environment do not fit.
    """
    protocol = config.protocol
    for name in ("n_learning_episodes", "test_interval"):
        whole(name, getattr(protocol, name), 1, 2**53)
    with ExitStack() as stack:
        env = config.environment.make(seed, "sensor_noise")
        stack.callback(env.close)
        tested = config.environment
        if not config.protocol.noisy_tests:
            tested = replace(tested, noise=0.0)
        test_env = tested.make(seed, "evaluation_sensor_noise")
        stack.callback(test_env.close)
        n_observed = env.observation_space.shape[0] if env.observation_space.shape else 0
        if config.approximator.n_inputs != n_observed:
            raise ValueError(
                f"n_inputs must be the number of observed variables ({n_observed}),"
                f" got {config.approximator.n_inputs}"
            )
        for number, one in ((_LEARNING, env), (_TEST, test_env)):
            # Later resets go on from here.
            one.reset(seed=_environment_seed(seed, number))
        agent = agent_entry(config.agent).make_agent(
            env.observation_space,
            env.action_space,
            approximator=config.approximator,
            learning=config.learning,
            seed=seed,
        )
        training = Training(
            agent,
            env,
            episodes=protocol.n_learning_episodes,
            seed=None,
            evaluate_every_episodes=protocol.test_interval,
            evaluation_env=test_env,
            evaluation_episodes=1,
            limit_bootstraps=protocol.limit_bootstraps,
        )
        stack.pop_all()
    return TrainingTrial(training, (env, test_env))


def _environment_seed(seed: int, number: int) -> int:
    word = np.random.SeedSequence(seed, spawn_key=(number,)).generate_state(1, np.uint32)[0]
    return int(word) % _MAX_SEED


@dataclass(frozen=True, kw_only=True)
class EnvironmentTrialConfig(TrialSettings):
    """A trial of an agent in a Gymnasium environment.

    Parameters
    ----------
    agent
        Id of the agent, as in `sdnn.runs.registry`.
    approximator
        The dataclass of its entry; ``n_inputs`` must be the number of observed variables.
    learning
        The dataclass of its entry.
    environment
        The task.
    protocol
        Learning and test episodes.

    Raises
    ------
    ValueError
        If no agent has that id.
    TypeError
        If approximator or learning are those of another agent.

    Examples
    --------
    >>> config = EnvironmentTrialConfig(
    ...     environment=EnvironmentConfig(id="Pendulum-v1"),
    ...     approximator=SDNNCConfig(n_inputs=3),
    ...     protocol=ProtocolConfig(n_learning_episodes=2, test_interval=2),
    ... )
    >>> trial = config.make_trial(seed=1)
    >>> trial.advance(2)
    >>> trial.test_rows()["steps"]
    array([200], dtype=int32)
    """

    environment: EnvironmentConfig
    agent: str = "sdnn-c"
    approximator: Any = field(default_factory=SDNNCConfig)
    learning: Any = field(default_factory=QLearningConfig)
    protocol: ProtocolConfig = field(default_factory=ProtocolConfig)

    def __post_init__(self) -> None:
        self.check_agent()
        self.check_parts(environment=EnvironmentConfig, protocol=ProtocolConfig)

    @property
    def is_compiled(self) -> bool:
        """Whether it runs in C++: never."""
        return False

    def make_trial(self, seed: int) -> TrainingTrial:
        """Make the trial; see `environment_trial` for the errors it raises."""
        return environment_trial(self, seed)
