"""The acrobot swing-up of the SDNN papers as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import gymnasium as gym
import numpy as np
from gymnasium.core import RenderFrame
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.config import AcrobotConfig
from sdnn.environments.picture import AcrobotMotion, AcrobotPicture
from sdnn.environments.types import Array, Data
from sdnn.support.arguments import array_of, choice, one_of, real, require

_DTYPES: dict[str, type[np.float32] | type[np.float64]] = {
    "float32": np.float32,
    "float64": np.float64,
}


class AcrobotSwingUpEnv(gym.Env[Array, ArrayLike]):
    r"""Swing up a two-link pendulum with a motor at its elbow.

    The tip must pass 1.5 m above the fixed joint, at speeds below limits times `goal_tolerance`.
    An episode starts at rest, hanging down, and has 50 decisions, one a second. Nothing is random.
    docs/explanation/method.md, section 2, has the dynamics.

    ## Action space

    `Box(-1, 1, (1,), float32)`: the torque divided by `max_torque` (10 N m), held until the next
    decision.

    ## Observation space

    `Box(0, 1, (4,), float32)`: the normalized state. `sat` clips to [0, 1].

    | Num | Observation                       | at 0         | at 1         | Unit  |
    |-----|-----------------------------------|--------------|--------------|-------|
    | 0   | s1 = theta1 / (2 pi) + 1/2        | -pi          | pi           | rad   |
    | 1   | s2 = theta2 / (2 pi) + 1/2        | -pi          | pi           | rad   |
    | 2   | s3 = sat(theta1' / (6 pi) + 1/2)  | -3 pi        | 3 pi         | rad/s |
    | 3   | s4 = sat(theta2' / (10 pi) + 1/2) | -5 pi        | 5 pi         | rad/s |

    `theta1` is the angle of link 1, 0 where it hangs down; `theta2` that of link 2 relative to it.
    For redundant and noisy sensors, wrap in `RedundantSensors`, then `NoisySensors`.

    ## Rewards and episode end

    +10 at the goal, which terminates the episode: the tip at least 1.5 m above joint 1, with
    \|theta1'\| < 3 pi `goal_tolerance` and \|theta2'\| < 5 pi `goal_tolerance`. Otherwise -5 if
    \|theta1\| < 5 degrees, \|theta1'\| > 3 pi or \|theta2'\| > 5 pi at the decision, else 0.
    The environment truncates after 50 decisions.

    ## Arguments

    - `config`: an `AcrobotConfig`, with all the numbers above;
    - `goal_tolerance`: factor of the goal's speed limits, >= 0. The reset option and the attribute
      of the same name change it; `TighteningGoal` follows the paper's schedule;
    - `render_mode`: `"human"`, a window in real time; `"rgb_array"`, a picture per decision;
      `"rgb_array_list"`, all pictures since the last `render()`, 25 a second. Needs pygame-ce;
    - `dtype`: of actions and observations; with `"float64"` they equal the compiled trial's.

    `info` holds the true `state` (theta1, theta2, theta1', theta2'), `tip_height` in m, the
    episode's `goal_tolerance`, and `is_success`.

    ```python
    >>> import gymnasium as gym
    >>> import sdnn.environments
    >>> env = gym.make("sdnn/AcrobotSwingUp-v0", goal_tolerance=0.5)
    >>> observation, info = env.reset(seed=1)
    >>> observation.tolist(), info["goal_tolerance"], info["tip_height"]
    ([0.5, 0.5, 0.5, 0.5], 0.5, -2.0)
    >>> observation, reward, terminated, truncated, info = env.step([1.0])
    >>> float(reward), terminated, truncated, round(info["tip_height"], 3)
    (0.0, False, False, 0.496)

    ```
    """

    metadata: Data = {  # noqa: RUF012
        "render_modes": ["human", "rgb_array", "rgb_array_list"],
        "render_fps": 4,
    }

    def __init__(
        self,
        *,
        config: AcrobotConfig | None = None,
        goal_tolerance: float = 1.0,
        render_mode: str | None = None,
        dtype: Literal["float32", "float64"] = "float32",
    ) -> None:
        self._dtype = choice("dtype", dtype, _DTYPES)
        if render_mode is not None:
            one_of("render_mode", render_mode, tuple(self.metadata["render_modes"]))
        is_config = isinstance(config, AcrobotConfig | None)
        require(is_config, "config", "be an AcrobotConfig", config, TypeError)
        self.config = AcrobotConfig() if config is None else config
        self.goal_tolerance = goal_tolerance
        self.render_mode = render_mode
        self._acrobot = _core.Acrobot(self.config)
        self._was_reset = self._success = False
        self._tolerance = self.goal_tolerance  # that of this episode; the attribute's is the next
        self._torque = 0.0  # N m, the last one held
        self._picture: AcrobotPicture | None = None
        self._pictures: list[RenderFrame] = []
        self._motion: AcrobotMotion | None = None
        if render_mode in ("human", "rgb_array_list"):
            self._motion = AcrobotMotion(self.config)
            self.metadata = {**self.metadata, "render_fps": round(1.0 / self._motion.interval)}
        self.action_space = gym.spaces.Box(-1.0, 1.0, (1,), self._dtype)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (4,), self._dtype)

    @property
    def goal_tolerance(self) -> float:
        """Factor of the goal's speed limits, from the next reset on."""
        return self._goal_tolerance

    @goal_tolerance.setter
    def goal_tolerance(self, value: float) -> None:
        tolerance = real("goal_tolerance", value)
        require(tolerance >= 0.0, "goal_tolerance", "be at least 0", value)
        self._goal_tolerance = tolerance

    def reset(self, *, seed: int | None = None, options: Data | None = None) -> tuple[Array, Data]:
        """Begin an episode; the option ``"goal_tolerance"`` holds for it and later ones."""
        super().reset(seed=seed)
        options = options or {}
        unknown = sorted(set(options) - {"goal_tolerance"})
        if unknown:
            raise ValueError(
                f"options may hold 'goal_tolerance', got {', '.join(map(repr, unknown))}"
            )
        self.goal_tolerance = options.get("goal_tolerance", self.goal_tolerance)
        self._tolerance = self.goal_tolerance
        self._was_reset = True
        self._torque = 0.0
        self._success = False
        self._acrobot.reset()
        self._pictures.clear()
        if self._motion is not None:
            self._show(())
        return self._observation(), self._info()

    def step(self, action: ArrayLike) -> tuple[Array, float, bool, bool, Data]:
        """Hold a torque for one decision interval.

        Raises ValueError unless the action is one number in [-1, 1], and RuntimeError if the
        episode is over.
        """
        if not self._was_reset:
            raise gym.error.ResetNeeded("call reset before step")
        share = array_of("action", action, "fiu")
        is_share = share.size == 1 and abs(share.item()) <= 1.0
        require(is_share, "action", "be one number in [-1, 1]", action)
        self._torque = self.config.max_torque * share.item()
        before = None if self._motion is None else self._acrobot.state()
        reward, terminated, truncated = self._acrobot.step(self._torque, self._tolerance)
        self._success = terminated
        if self._motion is not None and before is not None:
            self._show(self._motion.between(before, self._torque, self._tolerance))
        return self._observation(), reward, terminated, truncated, self._info()

    @property
    def state(self) -> NDArray[np.float64]:
        """The true state: theta1, theta2 in [-pi, pi), their speeds in rad/s, shape (4,)."""
        return self._acrobot.state()

    def render(self) -> RenderFrame | list[RenderFrame] | None:
        """Return a picture, shape (500, 500, 3), those since the last call, or None in a window."""
        if self.render_mode is None:
            gym.logger.warn("render() needs a render_mode: 'human', 'rgb_array', 'rgb_array_list'")
            return None
        if self.render_mode == "rgb_array_list":
            pictures, self._pictures = self._pictures, []
            return pictures
        return self._draw(self.state, self._success)

    def _show(self, states: Iterable[NDArray[np.float64]]) -> None:
        """Draw states between two decisions, then the current one; keep the pictures."""
        pictures = [self._draw(state, solved=False) for state in states]
        pictures.append(self._draw(self.state, self._success))
        self._pictures += [picture for picture in pictures if picture is not None]

    def _draw(self, state: NDArray[np.float64], solved: bool) -> NDArray[np.uint8] | None:
        """Draw a state, perhaps at the goal (`solved`), in the window, or return its picture."""
        if self._picture is None:
            fps = self.metadata["render_fps"] if self.render_mode == "human" else None
            self._picture = AcrobotPicture(self.config, fps)
        return self._picture.draw(state, self._torque, self._acrobot.decisions(), solved)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def _observation(self) -> Array:
        return _core.basic_observation(self._acrobot.state()).astype(self._dtype)

    def _info(self) -> Data:
        """Return the ``info`` of a step or reset."""
        return {
            "state": self._acrobot.state(),
            "tip_height": self._acrobot.tip_height(),
            "goal_tolerance": self._tolerance,
            "is_success": self._success,
        }
