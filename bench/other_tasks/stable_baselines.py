"""SAC, TD3 and PPO of Stable-Baselines3, with the settings published for each task.

Source of the settings: RL Baselines3 Zoo, hyperparams/{sac,td3,ppo}.yml. TD3 has published ones for
an older Pendulum only, which are used.
"""

from __future__ import annotations

from typing import Any

import numpy as np

STEPS = "n_timesteps"

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
            "n_envs": 4,
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
            "n_envs": 8,
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
            "n_envs": 16,
            "n_steps": 16,
            "gae_lambda": 0.98,
            "gamma": 0.99,
            "n_epochs": 4,
            "ent_coef": 0.0,
        },
        "Acrobot": {
            STEPS: 1_000_000,
            "normalize": True,
            "n_envs": 16,
            "n_steps": 256,
            "gae_lambda": 0.94,
            "gamma": 0.99,
            "n_epochs": 4,
            "ent_coef": 0.0,
        },
    },
}


def steps_of(algorithm: str) -> dict[str, int]:
    """Steps of the published training, by task."""
    return {task: settings[STEPS] for task, settings in SETTINGS[algorithm].items()}


def learn(algorithm, name, make_env, steps, seed, after_step) -> None:
    """Learn a task, on one thread.

    Parameters
    ----------
    algorithm, name
        Of `SETTINGS`.
    make_env
        Makes the environment.
    steps, seed, after_step
        As of every contender.
    """
    import stable_baselines3 as sb3
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.noise import NormalActionNoise
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

    torch.set_num_threads(1)
    settings = {key: value for key, value in SETTINGS[algorithm][name].items() if key != STEPS}
    env = DummyVecEnv([make_env] * settings.pop("n_envs", 1))
    if settings.pop("normalize", False):
        env = VecNormalize(env, gamma=settings["gamma"])
    for key, value in settings.items():
        if isinstance(value, tuple) and value[0] == "falling":
            settings[key] = _falling(value[1])
    if noise := settings.pop("noise", None):
        n_actions = env.action_space.shape[0]
        settings["action_noise"] = NormalActionNoise(
            np.zeros(n_actions), np.full(n_actions, noise[1])
        )
    model = getattr(sb3, algorithm)("MlpPolicy", env, seed=seed, device="cpu", **settings)

    def policy(observation):
        if isinstance(env, VecNormalize):
            observation = env.normalize_obs(observation)
        return model.predict(observation, deterministic=True)[0]

    def memory():
        tensors = sum(p.numel() * p.element_size() for p in model.policy.state_dict().values())
        buffer = getattr(model, "replay_buffer", None) or getattr(model, "rollout_buffer", None)
        arrays = [a for a in vars(buffer).values() if isinstance(a, np.ndarray)]
        return tensors + sum(array.nbytes for array in arrays)

    class Report(BaseCallback):
        def _on_step(self) -> bool:
            after_step(self.num_timesteps, policy, memory)
            return True

    model.learn(steps, callback=Report())


def _falling(first):
    return lambda left: left * first
