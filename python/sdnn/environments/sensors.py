"""Other sensors for any environment: scaled, redundant, noisy; and all sensors of the acrobot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, cast

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.arguments import choice, one_of, seed_of
from sdnn.bounds import with_infinities
from sdnn.config import SensorConfig

__all__ = ["AcrobotSensors", "NoisySensors", "RedundantSensors", "UnitSensors"]

Observation = NDArray[Any]
SensorFunction = Callable[[Observation], float]
Edge = Literal["wrap", "saturate"]
NoiseStream = Literal["sensor_noise", "evaluation_sensor_noise"]

_NAMED: dict[str, SensorFunction] = {
    "energy": lambda s: _core.energy_sensor(s[2], s[3]),
    "height": lambda s: _core.height_sensor(s[0], s[1]),
}


class _Sensors(
    gym.ObservationWrapper[Observation, Any, Observation], gym.utils.RecordConstructorArgs
):
    """A wrapper of an environment that observes a vector of numbers."""

    def __init__(self, env: gym.Env[Observation, Any], **arguments: Any) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, **arguments)
        super().__init__(env)
        space = env.observation_space
        if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
            raise ValueError(f"env must have a one-dimensional Box of observations, got {space}")
        self._space = space
        self._float: Any = np.float64 if space.dtype == np.float64 else np.float32


class UnitSensors(_Sensors):
    """Scales every observed variable to [0, 1]; values outside its range are clipped.

    With it, `NoisySensors` fits any environment: its sigma then is in parts of each range.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations, shape (l,).
    observation_low, observation_high : array_like, shape (l,), optional
        The ranges, also attributes; by default the bounds of the observation space.

    Raises
    ------
    ValueError
        For observations of another kind, ranges of another length or without an extent, and
        infinite bounds for which no range is given.

    Examples
    --------
    >>> import gymnasium as gym
    >>> env = UnitSensors(gym.make("Pendulum-v1"))
    >>> env.observation_space
    Box(0.0, 1.0, (3,), float64)
    """

    def __init__(
        self,
        env: gym.Env[Observation, Any],
        observation_low: ArrayLike | None = None,
        observation_high: ArrayLike | None = None,
    ) -> None:
        super().__init__(env, observation_low=observation_low, observation_high=observation_high)
        self.observation_low = _ends("observation_low", observation_low, self._space.low)
        self.observation_high = _ends("observation_high", observation_high, self._space.high)
        if not (self.observation_low < self.observation_high).all():
            raise ValueError(
                "observation_low must be below observation_high,"
                f" got {self.observation_low} and {self.observation_high}"
            )
        self.observation_space = gym.spaces.Box(0.0, 1.0, self._space.shape, np.float64)

    def observation(self, observation: Observation) -> NDArray[np.float64]:
        """Scale an observation, shape (l,)."""
        low, high = self.observation_low, self.observation_high
        return np.clip((np.asarray(observation, np.float64) - low) / (high - low), 0.0, 1.0)


class RedundantSensors(_Sensors):
    """Appends functions of the observation to it.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations, shape (l,).
    functions : sequence of {"energy", "height"} or callable
        ``"energy"`` is the paper's s5 = 2 ((s3 - 1/2)^2 + (s4 - 1/2)^2); ``"height"`` its s6 =
        (2 + cos 2 pi s1 - cos 2 pi (s1 + s2)) / 4. A callable receives the wrapped environment's
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
        super().__init__(env, functions=functions, bounds=bounds)
        self.functions = tuple(functions)
        self._functions = tuple(
            function if callable(function) else choice("functions", function, _NAMED)
            for function in functions
        )
        ends = [(0.0, 1.0)] * len(self._functions) if bounds is None else bounds
        if len(ends) != len(self._functions):
            raise ValueError(
                f"bounds must have {len(self._functions)} entries, one per function, "
                f"got {len(ends)}"
            )
        low: NDArray[Any] = np.append(self._space.low, [low for low, _ in ends])
        high: NDArray[Any] = np.append(self._space.high, [high for _, high in ends])
        low, high = low.astype(self._float), high.astype(self._float)
        self.observation_space = gym.spaces.Box(low, high, dtype=self._float)

    def observation(self, observation: Observation) -> Observation:
        """Append the functions' values, shape (l + n_functions,)."""
        extra = [function(observation) for function in self._functions]
        return np.append(observation, extra).astype(_float_of(observation))


class _RandomSensors(_Sensors):
    """Sensors with a random stream of their own, which `_restart` starts anew."""

    def __init__(
        self, env: gym.Env[Observation, Any], *, seed: int, stream: str, **arguments: Any
    ) -> None:
        super().__init__(env, seed=seed, stream=stream, **arguments)
        streams = ("sensor_noise", "evaluation_sensor_noise")
        known = {name: _core.Stream.__members__[name] for name in streams}
        self._stream = choice("stream", stream, known)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Reset the environment; a ``seed`` also restarts what the sensors draw at random."""
        if seed is not None:
            self._restart(seed)
        return super().reset(seed=seed, options=options)

    def _restart(self, seed: int) -> None:
        raise NotImplementedError


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
        stream: NoiseStream = "sensor_noise",
    ) -> None:
        super().__init__(env, sigma=sigma, edge=edge, seed=seed, stream=stream)
        (n_channels,) = self._space.shape
        if not (np.all(self._space.low >= 0.0) and np.all(self._space.high <= 1.0)):
            raise ValueError("the observation space must lie within [0, 1] in every channel")
        words: list[str] = ["wrap" if i < 2 else "saturate" for i in range(n_channels)]
        if edge is not None:
            words = [edge] * n_channels if isinstance(edge, str) else list(edge)
        if len(words) != n_channels:
            raise ValueError(f"edge must have {n_channels} entries, got {len(words)}")
        self.sigma = sigma
        self._edges = [one_of("edge", word, ("wrap", "saturate")) for word in words]
        self._restart(seed)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (n_channels,), self._float)

    def observation(self, observation: Observation) -> Observation:
        """Add the noise, shape (l,)."""
        noisy: Observation = self._noise.apply(observation)
        return noisy.astype(_float_of(observation))

    def _restart(self, seed: int) -> None:
        self._noise = _core.SensorNoise(self.sigma, self._edges, seed_of(seed), self._stream)


class AcrobotSensors(_RandomSensors):
    """The sensors of a `SensorConfig` on the acrobot: what a compiled trial observes.

    The same numbers as `NoisySensors` over `RedundantSensors`, and the inputs and the entry of
    noise that these do not know. Observations have the order s1..s6, constant, random.

    Parameters
    ----------
    env : gymnasium.Env
        An `AcrobotSwingUpEnv`, in wrappers or not: the state is read from it.
    config : SensorConfig
    seed, stream
        As those of `NoisySensors`, of noise and of random inputs.

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
        stream: NoiseStream = "sensor_noise",
    ) -> None:
        super().__init__(env, config=config, seed=seed, stream=stream)
        self._config = config
        self._restart(seed)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (config.n_inputs,), self._float)

    def observation(self, observation: Observation) -> Observation:
        """Observe the environment's state, shape (n_inputs,); the observation is not used."""
        seen: Observation = self._sensors.observe(cast(Any, self.unwrapped).state)
        return seen.astype(self._float)

    def _restart(self, seed: int) -> None:
        self._sensors = _core.AcrobotSensors(self._config, seed_of(seed), self._stream)


def _float_of(observation: Observation) -> np.dtype[Any]:
    """Return the type of an observation, or that of fractions if it has whole numbers."""
    dtype = np.asarray(observation).dtype
    return dtype if dtype.kind == "f" else np.dtype(np.float32)


def _ends(name: str, given: ArrayLike | None, bounds: NDArray[Any]) -> NDArray[np.float64]:
    """Return the lower or upper ends of all ranges, shape (l,)."""
    ends = with_infinities(np.asarray(bounds if given is None else given, np.float64))
    if ends.shape != bounds.shape:
        raise ValueError(
            f"{name} must have {bounds.size} numbers, one per observed variable, got {given!r}"
        )
    unbounded = np.flatnonzero(~np.isfinite(ends))
    if unbounded.size:
        raise ValueError(
            f"{name} must be given where observations are unbounded (variables"
            f" {', '.join(map(str, unbounded))} of {bounds.size}, from 0): one finite number per"
            " variable; values outside saturate"
        )
    return ends
