"""Sensors for any environment: scaled, redundant or noisy; and all sensors of the acrobot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, cast

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.config import SensorConfig
from sdnn.environments.space_kinds import with_infinities
from sdnn.environments.types import Array, Data, Element
from sdnn.support.arguments import array_of, choice, one_of, require, seed_of

Observation = Array
Env = gym.Env[Observation, Element]
SensorFunction = Callable[[Observation], float]
Edge = Literal["wrap", "saturate"]
NoiseStream = Literal["sensor_noise", "evaluation_sensor_noise"]
STREAMS: dict[str, _core.Stream] = {
    "sensor_noise": _core.Stream.sensor_noise,
    "evaluation_sensor_noise": _core.Stream.evaluation_sensor_noise,
}
"""The core's random streams of noise, by name."""

_NAMED_FUNCTIONS: dict[str, SensorFunction] = {
    "energy": lambda s: _core.energy_sensor(s[2], s[3]),
    "height": lambda s: _core.height_sensor(s[0], s[1]),
}


class _Sensors(
    gym.ObservationWrapper[Observation, Element, Observation], gym.utils.RecordConstructorArgs
):
    """Wrapper of an environment whose observations are a one-dimensional ``Box``."""

    def __init__(self, env: Env, **arguments: Any) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, **arguments)
        super().__init__(env)
        space = env.observation_space
        if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
            raise ValueError(f"env must have a one-dimensional Box of observations, got {space}")
        self._space = space
        self._float: Any = np.float64 if space.dtype == np.float64 else np.float32

    def _read(self, observation: Observation) -> Observation:
        """Return an observation as an array; ValueError if it has another shape than the space."""
        values = array_of("observation", observation)
        if values.shape != self._space.shape:
            raise ValueError(f"observation must have shape {self._space.shape}, got {values.shape}")
        return values


class UnitSensors(_Sensors):
    """Scales every observed variable to [0, 1]; values outside its range are clipped.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations, shape (l,).
    observation_low, observation_high : array_like, shape (l,), optional
        The ranges; by default the bounds of the observation space, which must then be finite.

    Examples
    --------
    >>> import gymnasium as gym
    >>> env = UnitSensors(gym.make("Pendulum-v1"))
    >>> env.observation_space
    Box(0.0, 1.0, (3,), float64)
    """

    def __init__(
        self,
        env: Env,
        observation_low: ArrayLike | None = None,
        observation_high: ArrayLike | None = None,
    ) -> None:
        super().__init__(env, observation_low=observation_low, observation_high=observation_high)
        self.observation_low = _limits("observation_low", observation_low, self._space.low)
        self.observation_high = _limits("observation_high", observation_high, self._space.high)
        if not (self.observation_low < self.observation_high).all():
            raise ValueError(
                "observation_low must be below observation_high,"
                f" got {self.observation_low} and {self.observation_high}"
            )
        self.observation_space = gym.spaces.Box(0.0, 1.0, self._space.shape, np.float64)

    def observation(self, observation: Observation) -> NDArray[np.float64]:
        """Scale an observation, shape (l,)."""
        low, high = self.observation_low, self.observation_high
        values = self._read(observation).astype(np.float64, copy=False)
        return np.clip((values - low) / (high - low), 0.0, 1.0)


class RedundantSensors(_Sensors):
    """Appends functions of the observation to it.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations, shape (l,).
    functions : sequence of {"energy", "height"} or callable
        ``"energy"`` is the paper's s5 = 2 ((s3 - 1/2)^2 + (s4 - 1/2)^2), ``"height"`` its s6 =
        (2 + cos 2 pi s1 - cos 2 pi (s1 + s2)) / 4. A callable maps the observation to a number.
    bounds : sequence of (low, high), optional
        Bounds of each function's values, by default (0, 1).

    Examples
    --------
    >>> from sdnn.environments import AcrobotSwingUpEnv, RedundantSensors
    >>> env = RedundantSensors(AcrobotSwingUpEnv(), ("energy", "height"))
    >>> env.reset()[0].tolist()
    [0.5, 0.5, 0.5, 0.5, 0.0, 0.0]
    """

    def __init__(
        self,
        env: Env,
        functions: Sequence[str | SensorFunction] = ("energy", "height"),
        bounds: Sequence[tuple[float, float]] | None = None,
    ) -> None:
        super().__init__(env, functions=functions, bounds=bounds)
        self.functions = tuple(functions)
        self._functions = tuple(
            function if callable(function) else choice("functions", function, _NAMED_FUNCTIONS)
            for function in functions
        )
        n = len(self._functions)
        ranges = [(0.0, 1.0)] * n if bounds is None else bounds
        if len(ranges) != n:
            raise ValueError(f"bounds must have {n} entries, one per function, got {len(ranges)}")
        low: Array = np.append(self._space.low, [low for low, _ in ranges])
        high: Array = np.append(self._space.high, [high for _, high in ranges])
        self.observation_space = gym.spaces.Box(
            low.astype(self._float), high.astype(self._float), dtype=self._float
        )

    def observation(self, observation: Observation) -> Observation:
        """Append the functions' values, shape (l + n_functions,)."""
        observation = self._read(observation)
        extra = [function(observation) for function in self._functions]
        return np.append(observation, extra).astype(_float_of(observation))


class _RandomSensors(_Sensors):
    """Sensors with a dedicated random stream, which ``_restart(seed)`` starts."""

    def __init__(self, env: Env, *, seed: int, stream: str, **arguments: Any) -> None:
        super().__init__(env, seed=seed, stream=stream, **arguments)
        self._stream = choice("stream", stream, STREAMS)

    def reset(
        self, *, seed: int | None = None, options: Data | None = None
    ) -> tuple[Observation, Data]:
        """Reset the environment; a ``seed`` also restarts the random stream."""
        if seed is not None:
            self._restart(seed)
        return super().reset(seed=seed, options=options)

    def _restart(self, seed: int) -> None:
        raise NotImplementedError


class NoisySensors(_RandomSensors):
    """Adds independent Gaussian noise to every channel of every observation.

    Over ``AcrobotSwingUpEnv(dtype="float64")`` the observations are those of a compiled trial with
    the same seed, bit for bit.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations within [0, 1], shape (l,).
    sigma : float
        Standard deviation, >= 0; 0 changes nothing and draws nothing.
    edge : {"wrap", "saturate"} or sequence of them, shape (l,), optional
        Treatment of values outside [0, 1]. By default the first two channels (the acrobot's angles)
        wrap and the others saturate.
    seed : int
        Seed of the noise; ``reset(seed=...)`` restarts it.
    stream : {"sensor_noise", "evaluation_sensor_noise"}
        The core's random stream, of learning or of test episodes.

    Examples
    --------
    >>> from sdnn.environments import AcrobotSwingUpEnv, NoisySensors, RedundantSensors
    >>> env = NoisySensors(RedundantSensors(AcrobotSwingUpEnv()), sigma=0.02, seed=1)
    >>> env.reset()[0].shape
    (6,)
    """

    def __init__(
        self,
        env: Env,
        sigma: float = 0.02,
        edge: Edge | Sequence[Edge] | None = None,
        seed: int = 0,
        stream: NoiseStream = "sensor_noise",
    ) -> None:
        super().__init__(env, sigma=sigma, edge=edge, seed=seed, stream=stream)
        (n_channels,) = self._space.shape
        if not (np.all(self._space.low >= 0.0) and np.all(self._space.high <= 1.0)):
            raise ValueError("the observation space must lie within [0, 1] in every channel")
        if edge is None:  # as for the acrobot, whose first two readings are angles
            edges: list[str] = ["wrap" if i < 2 else "saturate" for i in range(n_channels)]
        else:
            edges = [edge] * n_channels if isinstance(edge, str) else list(edge)
        if len(edges) != n_channels:
            raise ValueError(f"edge must have {n_channels} entries, got {len(edges)}")
        self.sigma = sigma
        self._edges = [one_of("edge", word, ("wrap", "saturate")) for word in edges]
        self._restart(seed)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (n_channels,), self._float)

    def observation(self, observation: Observation) -> Observation:
        """Add the noise, shape (l,)."""
        observation = self._read(observation)
        noisy: Observation = self._noise.apply(observation)
        return noisy.astype(_float_of(observation))

    def _restart(self, seed: int) -> None:
        self._noise = _core.SensorNoise(self.sigma, self._edges, seed_of(seed), self._stream)


class AcrobotSensors(_RandomSensors):
    """The sensors of a `SensorConfig` on the acrobot, as a compiled trial observes them.

    They include constant and random inputs; observations have the order s1..s6, constant, random.

    Parameters
    ----------
    env : gymnasium.Env
        An `AcrobotSwingUpEnv`, possibly wrapped; the state is read from it.
    config : SensorConfig
    seed, stream
        As for `NoisySensors`, for the noise and the random inputs.

    Examples
    --------
    >>> from sdnn.environments import AcrobotSensors, AcrobotSwingUpEnv, SensorConfig
    >>> env = AcrobotSensors(AcrobotSwingUpEnv(), SensorConfig(n_sensors=5, n_constant=1))
    >>> env.reset()[0].tolist()
    [0.5, 0.5, 0.5, 0.5, 0.0, 0.5]
    """

    def __init__(
        self, env: Env, config: SensorConfig, seed: int = 0, stream: NoiseStream = "sensor_noise"
    ) -> None:
        super().__init__(env, config=config, seed=seed, stream=stream)
        self._config = config
        self._restart(seed)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (config.n_inputs,), self._float)

    def observation(self, observation: Observation) -> Observation:
        """Observe the environment's state, shape (n_inputs,)."""
        observed: Observation = self._sensors.observe(cast(Any, self.unwrapped).state)
        return observed.astype(self._float)

    def _restart(self, seed: int) -> None:
        self._sensors = _core.AcrobotSensors(self._config, seed_of(seed), self._stream)


def _float_of(observation: Observation) -> np.dtype[Any]:
    """Return the dtype of an observation if it is floating-point, else float32."""
    dtype = observation.dtype
    return dtype if dtype.kind == "f" else np.dtype(np.float32)


def _limits(name: str, argument: ArrayLike | None, bounds: Array) -> NDArray[np.float64]:
    """Return the lower or upper limits of all ranges: the argument, or the space's, shape (l,).

    ValueError unless all are finite.
    """
    numbers = bounds if argument is None else array_of(name, argument)
    limits = with_infinities(numbers.astype(np.float64))
    expected = f"have {bounds.size} numbers, one per observed variable"
    require(limits.shape == bounds.shape, name, expected, argument)
    unbounded = np.flatnonzero(~np.isfinite(limits))
    if unbounded.size:
        raise ValueError(
            f"{name} must be given where observations are unbounded (variables"
            f" {', '.join(map(str, unbounded))} of {bounds.size}, from 0): one finite number per"
            " variable; values outside saturate"
        )
    return limits


def in_own_units(env: Env, low: NDArray[np.float64], high: NDArray[np.float64]) -> Env:
    """Wrap an environment with `UnitSensors` so that observations have their original units again.

    The ranges ``low`` to ``high``, (l,), are those of `UnitSensors`; variables that other sensors
    have appended are scaled to [-1, 1].
    """
    n_redundant = env.observation_space.shape[0] - low.size  # type: ignore[index]
    low = np.append(low, np.full(n_redundant, -1.0))
    high = np.append(high, np.full(n_redundant, 1.0))
    space = gym.spaces.Box(low.astype(np.float32), high.astype(np.float32))
    return gym.wrappers.TransformObservation(
        env, lambda unit: (low + unit * (high - low)).astype(np.float32), space
    )
