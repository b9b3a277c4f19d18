"""SAC, TD3 and PPO of Stable-Baselines3, with the settings published for each task (zoo.toml)."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sdnn.agents import Training
from sdnn.agents.registry import AgentEntry, register
from sdnn.runs.config_file import ConfigFile

SETTINGS = ConfigFile.read(Path(__file__).with_name("zoo.toml")).values


@dataclass(frozen=True, kw_only=True)
class PolicyConfig:
    """Settings of the networks: those of ``MlpPolicy``."""

    n_inputs: int = 1


@dataclass(frozen=True, kw_only=True)
class PublishedConfig:
    """Settings of the learning.

    Parameters
    ----------
    task
        The task whose published settings are used.
    """

    task: str = "Pendulum"


class StableBaselines:
    """A model of Stable-Baselines3, which `StableBaselinesTraining` makes."""

    model: Any = None
    normalize: Callable[[Any], Any] = staticmethod(lambda observation: observation)

    def __init__(self, *_spaces, approximator, learning, seed, algorithm) -> None:
        self.algorithm, self.seed = algorithm, seed % 2**32  # all that Stable-Baselines3 takes
        self.settings = dict(SETTINGS[algorithm][learning.task])

    def begin_episode(self) -> None:
        """Do nothing."""

    def act(self, observation, explore=False):
        """Return the policy's action."""
        observation = self.normalize(observation)
        return self.model.predict(observation, deterministic=not explore)[0]

    def learn(self, transition) -> None:
        """Refuse: its own training learns."""
        raise NotImplementedError

    @property
    def n_bytes(self) -> int:
        """Bytes of the policy and of what is kept to learn from."""
        model = self.model
        tensors = sum(p.numel() * p.element_size() for p in model.policy.state_dict().values())
        buffer = getattr(model, "replay_buffer", None) or getattr(model, "rollout_buffer", None)
        arrays = [a for a in vars(buffer).values() if isinstance(a, np.ndarray)]
        return tensors + sum(array.nbytes for array in arrays)


class StableBaselinesTraining(Training):
    """Learns as the library does, on one thread, in its vector of the environments."""

    def pieces(self, seconds: float) -> Generator[None, None, None]:
        """Learn all in one piece."""
        import stable_baselines3 as sb3
        import torch
        from stable_baselines3.common.callbacks import BaseCallback
        from stable_baselines3.common.noise import NormalActionNoise
        from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

        torch.set_num_threads(1)
        agent, training, settings = self.agent, self, dict(self.agent.settings)
        envs = getattr(self.env, "envs", [self.env])
        # A default argument, since a lambda would see the last environment of the loop only.
        env = DummyVecEnv([lambda env=env: env for env in envs])
        if settings.pop("normalize", False):
            env = VecNormalize(env, gamma=settings["gamma"])
            agent.normalize = env.normalize_obs
        for key, value in settings.items():
            if isinstance(value, dict) and "falling" in value:
                settings[key] = partial(_falling, value["falling"])
        if noise := settings.pop("noise", None):
            n_actions = env.action_space.shape[0]
            settings["action_noise"] = NormalActionNoise(
                np.zeros(n_actions), np.full(n_actions, noise)
            )
        make = getattr(sb3, agent.algorithm)
        agent.model = make("MlpPolicy", env, seed=agent.seed, device="cpu", **settings)

        class Report(BaseCallback):
            def _on_step(self) -> bool:
                return training.after_step(self.num_timesteps)

        with ExitStack() as stack:
            for callback in self.callbacks:
                callback.on_start(self)
                stack.callback(callback.on_end, self)
            agent.model.learn(self.steps, callback=Report())
        yield

    def after_step(self, n_steps: int) -> bool:
        """Evaluate where it is due, call the callbacks, and return whether to continue."""
        self.n_steps = n_steps
        if self._lacks_evaluation:
            self._tell([self._evaluation()])
        for callback in self.callbacks:
            callback.on_step(self)
        return not self._stops


def _falling(first: float, left: float) -> float:
    return left * first


for name in SETTINGS:
    register(
        AgentEntry(
            id=name.lower(),
            title=f"{name}, Stable-Baselines3",
            approximator=PolicyConfig,
            learning=PublishedConfig,
            agent=partial(StableBaselines, algorithm=name),
            training=StableBaselinesTraining,
        )
    )
