"""Stream AC(lambda): actor-critic that learns one step at a time without replay, as ours does.

The package `streaming-deep-rl`, with the settings of Elsayed, M., Vasan, G., Mahmood, A. (2024).
Streaming deep reinforcement learning finally works: discount 0.99, lambda 0.8, kappa 3 and 2,
entropy 0.01, two layers of 128 units, no target network.
"""

from __future__ import annotations

import gymnasium as gym
import numpy as np

TASKS = ("CartPole", "Pendulum")


def learn(env, steps, seed, after_step) -> None:
    """Learn a task, on one thread."""
    import torch
    from streaming_deep_rl import StreamingACLambda
    from x_mlps_pytorch.normed_mlp import MLP

    torch.set_num_threads(1)
    torch.manual_seed(seed)
    n_inputs = env.observation_space.shape[0]
    space = env.action_space
    is_box = isinstance(space, gym.spaces.Box)
    sizes = n_inputs, 128, 128
    agent = StreamingACLambda(
        actor=MLP(*sizes, norm_elementwise_affine=False, activate_last=True),
        critic=MLP(*sizes, norm_elementwise_affine=False, activate_last=True),
        dim_state=n_inputs,
        dim_actor=128,
        dim_critic=128,
        num_discrete_actions=0 if is_box else int(space.n),
        num_continuous_actions=space.shape[0] if is_box else 0,
        discount_factor=0.99,
        adaptive=False,
        use_critic_ema=False,
    )

    def of_space(action):
        if not is_box:
            return int(action)
        middle, half = (space.high + space.low) / 2, (space.high - space.low) / 2
        return np.clip(middle + half * action.numpy(), space.low, space.high)

    def tensor(observation):
        return torch.as_tensor(np.asarray(observation), dtype=torch.float32)

    def policy(observation):
        parameters = agent.forward_action(tensor(observation))
        if is_box:  # the mean
            return of_space(parameters[..., 0].reshape(space.shape))
        return int(parameters.argmax())

    def memory():
        return sum(t.numel() * t.element_size() for t in agent.state_dict().values())

    is_over = True
    for step in range(steps):
        if is_over:
            observation, _ = env.reset(seed=seed if step == 0 else None)
            agent.reset_trace_()
        state = tensor(observation)
        action, _ = agent.forward_action(state, sample=True)
        observation, reward, terminated, truncated, _ = env.step(of_space(action))
        agent.update(state, action, tensor(observation), float(reward), terminated)
        is_over = terminated or truncated
        after_step(step + 1, policy, memory)
