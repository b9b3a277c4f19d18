"""Redundant and noisy sensors, in the paper's order: redundancy first, then noise on all."""

from __future__ import annotations

import abc
from collections.abc import Callable, Sequence
from typing import Any, Literal, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.arguments import choice, seed_of
from sdnn.environments.config import SensorConfig

__all__ = ["AcrobotSensors", "NoisySensors", "RedundantSensors"]

Observation = NDArray[Any]
SensorFunction = Callable[[Observation], float]
Edge = Literal["wrap", "saturate"]

_NAMED: dict[str, SensorFunction] = {
    "energy": lambda s: _core.energy_sensor(s[2], s[3]),
    "height": lambda s: _core.height_sensor(s[0], s[1]),
}


class RedundantSensors(
    gym.ObservationWrapper[Observation, Any, Observation], gym.utils.RecordConstructorArgs
):
    """Appends functions of the observation to it.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations, shape (l,).
    functions : sequence of {"energy", "height"} or callable
        ``"energy"`` is the paper's s5 = 2 ((s3 - 1/2)^2 + (s4 - 1/2)^2); ``"height"`` its s6 =
        (2 + cos 2 pi s1 - cos 2 pi (s1 + s2)) / 4. A callable is given the wrapped environment's
        observation, shape (l,), and returns a number.
    bounds : sequence of (low, high), optional
        Of each function's values; by default (0, 1).

    Raises
    ------
    ValueError
        For an unknown name, or bounds that do not match the functions.

    Examples
    --------
    >>> from sdnn.environments import AcrobotSwingUpEnv, RedundantSensors
    >>> env = RedundantSensors(AcrobotSwingUpEnv(), ("energy", "height"))
    >>> env.reset()[0].tolist()
    [0.5, 0.5, 0.5, 0.5, 0.0, 0.0]
    """

    def __init__(
        self,
        env: gym.Env[Observation, Any],
        functions: Sequence[str | SensorFunction] = ("energy", "height"),
        bounds: Sequence[tuple[float, float]] | None = None,
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, functions=functions, bounds=bounds)
        super().__init__(env)
        space = _vector_space(env)
        self.functions = tuple(functions)
        self._functions = tuple(
            function if callable(function) else choice("functions", function, _NAMED)
            for function in functions
        )
        if bounds is None:
            bounds = [(0.0, 1.0)] * len(self._functions)
        if len(bounds) != len(self._functions):
            raise ValueError(
                f"bounds must have {len(self._functions)} entries, one per function, "
                f"got {len(bounds)}"
            )
        low = np.append(space.low, [low for low, _ in bounds])
        high = np.append(space.high, [high for _, high in bounds])
        dtype = _float_type(space)
        self.observation_space = gym.spaces.Box(low.astype(dtype), high.astype(dtype), dtype=dtype)

    def observation(self, observation: Observation) -> Observation:
        """Append the functions' values, shape (l + n_functions,)."""
        extra = [function(observation) for function in self._functions]
        return np.append(observation, extra).astype(_float_of(observation))


class _RandomSensors(
    gym.ObservationWrapper[Observation, Any, Observation], gym.utils.RecordConstructorArgs, abc.ABC
):
    """Sensors with a random stream of their own."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Reset the environment; a ``seed`` starts what the sensors draw at random anew, too."""
        if seed is not None:
            self._restart(seed)
        return super().reset(seed=seed, options=options)

    @abc.abstractmethod
    def _restart(self, seed: int) -> None:
        """Start the stream anew."""


class NoisySensors(_RandomSensors):
    """Adds independent Gaussian noise to every channel of every observation.

    The numbers come from a stream of their own, the same as in a compiled trial with the same
    seed: over ``AcrobotSwingUpEnv(dtype="float64")`` the observations agree bit for bit.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations within [0, 1], shape (l,).
    sigma : float
        Standard deviation, >= 0; 0 changes nothing and draws nothing.
    edge : {"wrap", "saturate"} or sequence of them, shape (l,), optional
        What happens at the ends of [0, 1], for all channels or for each: an angle wraps to
        [0, 1), anything else saturates. By default right for the acrobot: two angles come first.
    seed : int
        Where the noise starts; ``reset(seed=...)`` with a number starts it anew from that number.
    stream : {"sensor_noise", "evaluation_sensor_noise"}
        Which of the core's streams: that of a trial's learning episodes or of its test episodes.

    Raises
    ------
    ValueError
        For an unknown word, a wrong number of edges, bounds beyond [0, 1] or a bad sigma.

    Examples
    --------
    >>> from sdnn.environments import AcrobotSwingUpEnv, NoisySensors, RedundantSensors
    >>> env = NoisySensors(RedundantSensors(AcrobotSwingUpEnv()), sigma=0.02, seed=1)
    >>> env.reset()[0].shape
    (6,)
    """

    def __init__(
        self,
        env: gym.Env[Observation, Any],
        sigma: float = 0.02,
        edge: Edge | Sequence[Edge] | None = None,
        seed: int = 0,
        stream: Literal["sensor_noise", "evaluation_sensor_noise"] = "sensor_noise",
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(
            self, sigma=sigma, edge=edge, seed=seed, stream=stream
        )
        super().__init__(env)
        space = _vector_space(env)
        n_channels = space.shape[0]
        if not (np.all(space.low >= 0.0) and np.all(space.high <= 1.0)):
            raise ValueError("the observation space must lie within [0, 1] in every channel")
        if edge is None:
            words: list[str] = ["wrap" if i < 2 else "saturate" for i in range(n_channels)]
        else:
            words = [edge] * n_channels if isinstance(edge, str) else list(edge)
        if len(words) != n_channels:
            raise ValueError(f"edge must have {n_channels} entries, got {len(words)}")
        self.sigma = sigma
        self._edges = [choice("edge", word, _core.SensorEdge.__members__) for word in words]
        self._stream = _stream(stream)
        self._restart(seed)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (n_channels,), _float_type(space))

    def observation(self, observation: Observation) -> Observation:
        """Add the noise, shape (l,)."""
        noisy: Observation = self._noise.apply(observation)
        return noisy.astype(_float_of(observation))

    def _restart(self, seed: int) -> None:
        self._noise = _core.SensorNoise(self.sigma, self._edges, seed_of(seed), self._stream)


class AcrobotSensors(_RandomSensors):
    """All that a `SensorConfig` can say, over the acrobot: what a compiled trial observes.

    The same numbers as `NoisySensors` over `RedundantSensors`, and the inputs and the entry of
    noise that these do not know. Observations have the order s1..s6, constant, random.

    Parameters
    ----------
    env : gymnasium.Env
        An `AcrobotSwingUpEnv`, in wrappers or not: the state is read from it.
    config : SensorConfig
    seed : int
        Where noise and random inputs start; ``reset(seed=...)`` with a number starts them anew.
    stream : {"sensor_noise", "evaluation_sensor_noise"}
        Which of the core's streams: that of a trial's learning episodes or of its test episodes.

    Raises
    ------
    ValueError
        For numbers out of range or an unknown word.

    Examples
    --------
    >>> from sdnn.environments import AcrobotSensors, AcrobotSwingUpEnv, SensorConfig
    >>> env = AcrobotSensors(AcrobotSwingUpEnv(), SensorConfig(n_sensors=5, n_constant=1))
    >>> env.reset()[0].tolist()
    [0.5, 0.5, 0.5, 0.5, 0.0, 0.5]
    """

    def __init__(
        self,
        env: gym.Env[Observation, Any],
        config: SensorConfig,
        seed: int = 0,
        stream: Literal["sensor_noise", "evaluation_sensor_noise"] = "sensor_noise",
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, config=config, seed=seed, stream=stream)
        super().__init__(env)
        self._float = _float_type(_vector_space(env))
        self._config = config.to_core()
        self._stream = _stream(stream)
        self._restart(seed)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (config.n_inputs,), self._float)

    def observation(self, observation: Observation) -> Observation:
        """Observe the environment's state, shape (n_inputs,); the observation is not used."""
        seen: Observation = self._sensors.observe(cast(Any, self.unwrapped).state)
        return seen.astype(self._float)

    def _restart(self, seed: int) -> None:
        self._sensors = _core.AcrobotSensors(self._config, seed_of(seed), self._stream)


_STREAMS = ("sensor_noise", "evaluation_sensor_noise")


def _stream(name: str) -> _core.Stream:
    known = {member: _core.Stream.__members__[member] for member in _STREAMS}
    return choice("stream", name, known)


def _vector_space(env: gym.Env[Observation, Any]) -> gym.spaces.Box:
    space = env.observation_space
    if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
        raise ValueError(f"env must have a one-dimensional Box of observations, got {space}")
    return space


def _float_of(observation: Observation) -> np.dtype[Any]:
    """Give the type of an observation with fractions: as it is told, unless in whole numbers."""
    dtype = np.asarray(observation).dtype
    return dtype if dtype.kind == "f" else np.dtype(np.float32)


def _float_type(space: gym.spaces.Box) -> type[np.floating[Any]]:
    return np.float64 if space.dtype == np.float64 else np.float32
