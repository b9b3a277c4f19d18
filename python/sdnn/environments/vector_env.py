"""Many acrobot swing-ups at once as a Gymnasium vector environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.config import AcrobotConfig
from sdnn.environments.acrobot import AcrobotSwingUpEnv
from sdnn.environments.picture import AcrobotPicture
from sdnn.environments.types import Array, Data
from sdnn.support.arguments import array_of, one_of, require, whole


class AcrobotSwingUpVectorEnv(gym.vector.VectorEnv[Array, ArrayLike, Array]):
    """A vector environment with the bits of N `AcrobotSwingUpEnv`, in vector registers.

    ``gymnasium.make_vec("sdnn.environments:sdnn/AcrobotSwingUp-v0", num_envs=N)`` makes one.
    Observations, rewards, ends and infos are those of a ``SyncVectorEnv``. The next step resets
    an environment whose episode has ended (``AutoresetMode.NEXT_STEP``).

    Parameters
    ----------
    num_envs : int
        N, from 1 to 2**20.
    config : AcrobotConfig, optional
        For all environments.
    goal_tolerance : float or array_like, shape (num_envs,)
        Factor of the goal's speed limits, >= 0; may be set later, to tighten the goal.
    render_mode : {"rgb_array"}, optional
        Needs pygame-ce.
    dtype : {"float32", "float64"}
        Of actions and observations.

    Examples
    --------
    >>> import numpy as np
    >>> from sdnn.environments import AcrobotSwingUpVectorEnv
    >>> envs = AcrobotSwingUpVectorEnv(num_envs=3, goal_tolerance=[1.0, 0.5, 0.1])
    >>> observations, infos = envs.reset(seed=1)
    >>> observations.shape, infos["goal_tolerance"].tolist()
    ((3, 4), [1.0, 0.5, 0.1])
    >>> observations, rewards, *_, infos = envs.step(np.array([[1.0], [0.0], [-1.0]]))
    >>> rewards.tolist(), infos["tip_height"].round(3).tolist()
    ([0.0, -5.0, 0.0], [0.496, -2.0, 0.496])
    """

    metadata: Data = {  # noqa: RUF012
        "render_modes": ["rgb_array"],
        "render_fps": AcrobotSwingUpEnv.metadata["render_fps"],
        "autoreset_mode": gym.vector.AutoresetMode.NEXT_STEP,
        "reset_mask": True,  # an option of reset: see sdnn.agents.Training
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        config: AcrobotConfig | None = None,
        goal_tolerance: ArrayLike = 1.0,
        render_mode: str | None = None,
        dtype: Literal["float32", "float64"] = "float32",
    ) -> None:
        super().__init__()
        self.num_envs = whole("num_envs", num_envs, 1, 2**20)
        if render_mode is not None:
            one_of("render_mode", render_mode, tuple(self.metadata["render_modes"]))
        single = AcrobotSwingUpEnv(config=config, dtype=dtype)
        self.config = single.config
        self.goal_tolerance = goal_tolerance
        self.render_mode = render_mode
        self.single_action_space = single.action_space
        self.single_observation_space = single.observation_space
        self.action_space = batch_space(single.action_space, self.num_envs)
        self.observation_space = batch_space(single.observation_space, self.num_envs)
        self._dtype = single.observation_space.dtype
        self._batch = _core.AcrobotBatch(self.config, self.num_envs)
        self._tolerances = self._goal_tolerance.copy()  # those of the present episodes
        self._torques = np.zeros(self.num_envs)  # N m, the last ones held
        # Since the last reset of each: whether there was any, the goal is reached, it has ended.
        self._was_reset, self._success, self._ended = np.zeros((3, self.num_envs), np.bool_)
        self._picture: AcrobotPicture | None = None

    @property
    def goal_tolerance(self) -> NDArray[np.float64]:
        """Factors of the speed limits, shape (num_envs,), from each environment's next reset on."""
        return self._goal_tolerance.copy()

    @goal_tolerance.setter
    def goal_tolerance(self, values: ArrayLike) -> None:
        self._goal_tolerance = self._tolerances_of(values)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Data | None = None,
    ) -> tuple[Array, Data]:
        """Begin an episode in every environment, or in those of the option ``"reset_mask"``.

        The option ``"goal_tolerance"``, a number or shape (num_envs,), holds for the environments
        reset, from this episode on. Seeds change nothing.
        """
        options = dict(options or {})
        mask = self._reset_mask(options.pop("reset_mask", None))
        tolerances = self._tolerances_of(options.pop("goal_tolerance", self._goal_tolerance))
        if options:
            raise ValueError(
                "options may hold 'goal_tolerance' and 'reset_mask', "
                f"got {', '.join(map(repr, sorted(options)))}"
            )
        n_seeds = self.num_envs if seed is None or isinstance(seed, int | np.integer) else len(seed)
        if n_seeds != self.num_envs:
            raise ValueError(f"seed must have num_envs={self.num_envs} items, got {n_seeds}")
        super().reset(seed=seed if isinstance(seed, int) else None)
        self._goal_tolerance[mask] = tolerances[mask]
        self._begin(mask)
        return self._observations(), self._infos(mask)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Array, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Data]:
        """Hold torques, shape (num_envs, 1), for one decision interval; reset ended environments.

        Raises ValueError, and moves nothing, unless each action is in [-1, 1].
        """
        if not self._was_reset.all():
            raise gym.error.ResetNeeded("call reset before step")
        shares = array_of("actions", actions, "fiu").astype(np.float64, copy=False)
        if shares.shape not in ((self.num_envs, 1), (self.num_envs,)):
            raise ValueError(
                f"actions must have shape ({self.num_envs}, 1), got shape {shares.shape}"
            )
        shares = shares.reshape(self.num_envs)
        moving = ~self._ended
        wrong = np.flatnonzero(moving & ~(np.abs(shares) <= 1.0))
        if wrong.size:
            raise ValueError(
                f"actions[{wrong[0]}] must be one number in [-1, 1], got {shares[wrong[0]]}"
            )
        if self._ended.any():
            self._begin(self._ended)
        np.multiply(self.config.max_torque, shares, out=self._torques, where=moving)
        rewards, terminated, truncated = self._batch.step(self._torques, self._tolerances, moving)
        self._success = terminated.copy()
        self._ended = terminated | truncated
        infos = self._infos(np.ones(self.num_envs, np.bool_))
        return self._observations(), rewards, terminated, truncated, infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Draw the present states: one picture (500, 500, 3) for each environment."""
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: 'rgb_array'")
            return None
        picture = self._picture = self._picture or AcrobotPicture(self.config, None)
        torques, successes = self._torques.tolist(), self._success.tolist()
        pictures = (
            picture.draw(state, torques[i], self._batch.decisions(i), successes[i])
            for i, state in enumerate(self._batch.states())
        )
        return tuple(pixels for pixels in pictures if pixels is not None)

    def close_extras(self, **kwargs: Any) -> None:
        """Release the pictures."""
        self._picture = None

    def _reset_mask(self, mask: ArrayLike | None) -> NDArray[np.bool_]:
        """Return which environments to reset: all of them unless the option selects some."""
        if mask is None:
            return np.ones(self.num_envs, np.bool_)
        chosen = array_of("options['reset_mask']", mask, "b")
        fits = chosen.shape == (self.num_envs,) and chosen.any()
        expected = f"be a bool array of shape ({self.num_envs},) with at least one True"
        require(fits, "options['reset_mask']", expected, mask)
        return chosen

    def _tolerances_of(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return a goal tolerance for each environment, from a single one or from all."""
        tolerances = array_of("goal_tolerance", values, "fiu")
        if tolerances.shape not in ((), (self.num_envs,)):
            raise ValueError(
                f"goal_tolerance must be a number or of shape ({self.num_envs},), "
                f"got shape {tolerances.shape}"
            )
        require((tolerances >= 0.0).all(), "goal_tolerance", "be at least 0", values)
        return np.full(self.num_envs, tolerances, np.float64)

    def _begin(self, mask: NDArray[np.bool_]) -> None:
        """Begin the episodes of the environments in a mask."""
        self._tolerances[mask] = self._goal_tolerance[mask]
        self._was_reset |= mask
        self._torques[mask] = 0.0
        self._success[mask] = False
        self._ended = self._ended & ~mask
        self._batch.reset(mask)

    def _observations(self) -> Array:
        return self._batch.observations().astype(self._dtype)

    def _infos(self, mask: NDArray[np.bool_]) -> Data:
        """Return infos as arrays over environments, 0 outside the mask, and Gymnasium's masks."""
        infos: Data = {
            "state": self._batch.states(),
            "tip_height": self._batch.tip_heights(),
            "goal_tolerance": self._tolerances.copy(),
            "is_success": self._success.copy(),
        }
        for key, value in list(infos.items()):
            value[~mask] = 0
            infos[f"_{key}"] = mask.copy()
        return infos
