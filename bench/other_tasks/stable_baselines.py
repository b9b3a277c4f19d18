"""SAC, TD3 and PPO of Stable-Baselines3, with the settings published for each task.

Source of the settings: RL Baselines3 Zoo, hyperparams/{sac,td3,ppo}.yml. TD3 has published ones for
an older Pendulum only, which are used.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sdnn.agents import Training
from sdnn.runs.registry import AgentEntry, register

STEPS, N_ENVS = "n_timesteps", "n_envs"

SETTINGS: dict[str, dict[str, dict[str, Any]]] = {
    "SAC": {
        "Pendulum": {STEPS: 20_000, "learning_rate": 1e-3},
        "MountainCarContinuous": {
            STEPS: 50_000,
            "learning_rate": 3e-4,
            "buffer_size": 50_000,
            "batch_size": 512,
            "ent_coef": 0.1,
            "train_freq": 32,
            "gradient_steps": 32,
            "gamma": 0.9999,
            "tau": 0.01,
            "learning_starts": 0,
            "use_sde": True,
            "policy_kwargs": {"log_std_init": -3.67, "net_arch": [64, 64]},
        },
    },
    "TD3": {
        "Pendulum": {STEPS: 20_000, "noise": ("normal", 0.1), "learning_starts": 1000},
    },
    "PPO": {
        "Pendulum": {
            STEPS: 100_000,
            N_ENVS: 4,
            "n_steps": 1024,
            "gae_lambda": 0.95,
            "gamma": 0.9,
            "n_epochs": 10,
            "ent_coef": 0.0,
            "learning_rate": 1e-3,
            "clip_range": 0.2,
            "use_sde": True,
            "sde_sample_freq": 4,
        },
        "CartPole": {
            STEPS: 100_000,
            N_ENVS: 8,
            "n_steps": 32,
            "batch_size": 256,
            "gae_lambda": 0.8,
            "gamma": 0.98,
            "n_epochs": 20,
            "ent_coef": 0.0,
            "learning_rate": ("falling", 1e-3),
            "clip_range": ("falling", 0.2),
        },
        "MountainCarContinuous": {
            STEPS: 20_000,
            "normalize": True,
            "batch_size": 256,
            "n_steps": 8,
            "gamma": 0.9999,
            "learning_rate": 7.77e-5,
            "ent_coef": 0.00429,
            "clip_range": 0.1,
            "n_epochs": 10,
            "gae_lambda": 0.9,
            "max_grad_norm": 5,
            "vf_coef": 0.19,
            "use_sde": True,
            "policy_kwargs": {"log_std_init": -3.29, "ortho_init": False},
        },
        "MountainCar": {
            STEPS: 1_000_000,
            "normalize": True,
            N_ENVS: 16,
            "n_steps": 16,
            "gae_lambda": 0.98,
            "gamma": 0.99,
            "n_epochs": 4,
            "ent_coef": 0.0,
        },
        "Acrobot": {
            STEPS: 1_000_000,
            "normalize": True,
            N_ENVS: 16,
            "n_steps": 256,
            "gae_lambda": 0.94,
            "gamma": 0.99,
            "n_epochs": 4,
            "ent_coef": 0.0,
        },
    },
}


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
        Those that were published for this one.
    """

    task: str = "Pendulum"


class StableBaselines:
    """A model of Stable-Baselines3, which `StableBaselinesTraining` makes."""

    model: Any = None
    normalize: Callable[[Any], Any] = staticmethod(lambda observation: observation)

    def __init__(self, *_spaces, approximator, learning, seed, algorithm) -> None:
        self.algorithm, self.seed = algorithm, seed
        self.settings = dict(SETTINGS[algorithm][learning.task])

    def begin_episode(self) -> None:
        """Do nothing."""

    def act(self, observation, explore=False):
        """Give the policy's action."""
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
        agent, training = self.agent, self
        settings = {key: v for key, v in agent.settings.items() if key not in (STEPS, N_ENVS)}
        envs = getattr(self.env, "envs", [self.env])
        env = DummyVecEnv([lambda one=one: one for one in envs])
        if settings.pop("normalize", False):
            env = VecNormalize(env, gamma=settings["gamma"])
            agent.normalize = env.normalize_obs
        for key, value in settings.items():
            if isinstance(value, tuple) and value[0] == "falling":
                settings[key] = _falling(value[1])
        if noise := settings.pop("noise", None):
            n_actions = env.action_space.shape[0]
            settings["action_noise"] = NormalActionNoise(
                np.zeros(n_actions), np.full(n_actions, noise[1])
            )
        make = getattr(sb3, agent.algorithm)
        agent.model = make("MlpPolicy", env, seed=agent.seed, device="cpu", **settings)

        class Report(BaseCallback):
            def _on_step(self) -> bool:
                return training.after_step(self.num_timesteps)

        agent.model.learn(self.steps, callback=Report())
        yield

    def after_step(self, n_steps: int) -> bool:
        """Tell the callbacks; return whether to go on."""
        self.n_steps = n_steps
        for callback in self.callbacks:
            callback.on_step(self)
        return not self._stops


def _falling(first):
    return lambda left: left * first


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
