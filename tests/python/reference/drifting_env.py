"""Environments of tests: a point with unbounded position and speed, and random drift."""

import builtins

import gymnasium as gym
import numpy as np


class DriftingEnv(gym.Env):
    """Keep a drifting point near 0; every number follows from the seed and the actions."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012
    observation_space = gym.spaces.Box(-np.inf, np.inf, (2,), np.float64)
    action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def __init__(self, drift=0.1, render_mode=None):
        self.drift = drift
        self.render_mode = render_mode

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.state = self.np_random.normal(0.0, 0.5, 2)
        return self.state.copy(), {}

    def step(self, action):
        position, speed = self.state
        speed += 0.2 * float(action[0]) + self.np_random.normal(0.0, self.drift)
        position += 0.2 * speed
        self.state = np.array([position, speed])
        return self.state.copy(), -abs(position), bool(abs(position) > 3.0), False, {}

    def render(self):
        picture = np.zeros((33, 65, 3), np.uint8)
        picture[:, int(np.clip(32 + 10 * self.state[0], 0, 64))] = 255
        return picture


class BrokenEnv(DriftingEnv):
    """At the step ``bad_step`` since it was made, give a reward of NaN, or raise the error."""

    def __init__(self, bad_step=250, error="", kind="RuntimeError", render_mode=None):
        super().__init__(render_mode=render_mode)
        self.bad_step, self.error, self.kind = bad_step, error, getattr(builtins, kind)
        self.n_steps = 0

    def step(self, action):
        self.n_steps += 1
        observation, reward, *rest = super().step(action)
        if self.n_steps == self.bad_step and self.error:
            raise self.kind(self.error)
        return observation, np.nan if self.n_steps == self.bad_step else reward, *rest


class RestlessEnv(DriftingEnv):
    """Drift by unseeded random numbers, as a robot would; end at the time limit only."""

    n_steps = 0  # of all objects

    def step(self, action):
        RestlessEnv.n_steps += 1
        self.state += np.random.default_rng().normal(0.0, 0.1, 2)
        observation, reward, _, truncated, info = super().step(action)
        return observation, reward, False, truncated, info


class OnlyEnv(DriftingEnv):
    """Refuse to be made while another one is open, as an environment of a robot."""

    n_open = 0  # objects

    def __init__(self, render_mode=None):
        if OnlyEnv.n_open:
            raise ConnectionError("the port is in use")
        OnlyEnv.n_open += 1
        super().__init__(render_mode=render_mode)

    def close(self):
        OnlyEnv.n_open -= 1


class UnseenEnv(gym.Env):
    """Environment without metadata of rendering, as in docs/how-to/agents.md."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
    action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.np_random.uniform(-1.0, 1.0, 2), {}

    def step(self, action):
        return self.np_random.uniform(-1.0, 1.0, 2), float(action[0]), False, False, {}


class CrowdedEnv(DriftingEnv):
    """Append four random numbers to the observation."""

    observation_space = gym.spaces.Box(-np.inf, np.inf, (6,), np.float64)

    def reset(self, *, seed=None, options=None):
        observation, info = super().reset(seed=seed)
        return self._crowded(observation), info

    def step(self, action):
        observation, *rest = super().step(action)
        return self._crowded(observation), *rest

    def _crowded(self, observation):
        return np.concatenate([observation, self.np_random.normal(size=4)])


gym.register("tests/Unseen-v0", entry_point=UnseenEnv, max_episode_steps=20)
gym.register("tests/Drifting-v0", entry_point=DriftingEnv, max_episode_steps=40)
gym.register("tests/Crowded-v0", entry_point=CrowdedEnv, max_episode_steps=40)
gym.register("tests/Only-v0", entry_point=OnlyEnv, max_episode_steps=40)
gym.register("tests/Restless-v0", entry_point=RestlessEnv, max_episode_steps=40)
gym.register("tests/Broken-v0", entry_point=BrokenEnv, max_episode_steps=40)
