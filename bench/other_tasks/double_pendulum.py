"""Linear feedback on InvertedDoublePendulum: how exact a policy has to be, and what ours can be.

    python bench/other_tasks/double_pendulum.py

Prints two tables: returns of the feedback when it is disturbed, and of SDNNActorCritic when it has
imitated the feedback and learned on from there. Needs `gymnasium[mujoco]`; takes a few minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import gymnasium as gym
import numpy as np
from page import markdown

from sdnn.agents import SDNNActorCritic, Transition, imitate
from sdnn.config import LinearSDNNConfig

TASK = "InvertedDoublePendulum-v5"
ACTION_COST = 10.0
N_EPISODES, FIRST_SEED = 20, 5000
N_LOGGED, LOG_NOISE, PUSH_CHANCE, PUSH_STEPS = 20_000, 0.1, 0.02, 2


def state_of(observation):
    """Return position, angles and velocities, shape (6,)."""
    x, *sines_cosines = observation[:5]
    return np.array([x, *np.arctan2(sines_cosines[:2], sines_cosines[2:]), *observation[5:8]])


def optimal_gains():
    """Return the gains of the linear-quadratic regulator of the linearized task, shape (6,)."""
    env = gym.make(TASK).unwrapped
    env.reset(seed=0)

    def after(state, action):
        env.set_state(state[:3], state[3:])
        env.do_simulation(np.array([action]), env.frame_skip)
        return np.concatenate([env.data.qpos, env.data.qvel])

    h, still = 1e-5, np.zeros(6)
    a = np.stack([(after(d, 0) - after(-d, 0)) / (2 * h) for d in h * np.eye(6)], axis=1)
    b = ((after(still, h) - after(still, -h)) / (2 * h))[:, None]
    cost = np.eye(6)
    for _ in range(5000):
        gains = np.linalg.solve(ACTION_COST + b.T @ cost @ b, b.T @ cost @ a)
        cost = np.eye(6) + a.T @ cost @ (a - b @ gains)
    return gains[0]


def mean_return(policy):
    """Return the mean return of a policy over N_EPISODES episodes."""
    env, total = gym.make(TASK), 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + N_EPISODES):
        observation, _ = env.reset(seed=seed)
        is_over = False
        while not is_over:
            action = np.clip(policy(observation), -1, 1).astype(np.float32)
            observation, reward, terminated, truncated, _ = env.step(action)
            total += reward
            is_over = terminated or truncated
    return total / N_EPISODES


def disturbed(gains, random):
    """Yield what is done to the feedback, and its mean return."""

    def feedback(observation, gains=gains):
        return np.clip(-gains @ state_of(observation), -1, 1)[None]

    def nearest(n):
        return lambda o: np.round((feedback(o) + 1) * (n - 1) / 2) * 2 / (n - 1) - 1

    def drawn(n):
        return lambda o: (
            np.floor((feedback(o) + 1) * (n - 1) / 2 + random.random()) * 2 / (n - 1) - 1
        )

    yield "nothing", mean_return(feedback)
    for n in (5, 9):
        yield f"nearest of {n} actions", mean_return(nearest(n))
    for n in (5, 9):
        yield f"drawn from the two nearest of {n}", mean_return(drawn(n))
    for sigma in (0.1, 0.2, 0.3, 0.5):
        policy = lambda o, s=sigma: feedback(o) + s * random.standard_normal(1)  # noqa: E731
        yield f"noise of {sigma}", mean_return(policy)
    for share in (0.1, 0.2, 0.3):
        off = [gains * (1 + share * random.choice([-1, 1], 6)) for _ in range(10)]
        returns = [mean_return(lambda o, g=g: feedback(o, g)) for g in off]
        yield f"gains off by {100 * share:.0f} %, median of ten", float(np.median(returns))


def teacher_log(gains, random):
    """Return (transitions, actions of the feedback), with random pushes to recover from."""
    env, transitions, n_pushes = gym.make(TASK), [], 0
    observation, _ = env.reset(seed=1)
    for _ in range(N_LOGGED):
        action = np.clip(-gains @ state_of(observation), -1, 1)
        applied = np.clip(action + LOG_NOISE * random.standard_normal(), -1, 1)
        if n_pushes:
            n_pushes, applied = n_pushes - 1, random.uniform(-1, 1)
        elif random.random() < PUSH_CHANCE:
            n_pushes = PUSH_STEPS
        following, reward, terminated, truncated, _ = env.step(np.array([applied], np.float32))
        action = np.array([action], np.float32)
        transitions.append(Transition(observation, action, reward, following, terminated))
        observation = env.reset()[0] if terminated or truncated else following
    return transitions


def imitated(gains, n_actions, epochs):
    """Return the error of an agent that imitates the feedback, and its returns."""
    log = teacher_log(gains, np.random.default_rng(1))
    test = teacher_log(gains, np.random.default_rng(2))[:3000]
    env = gym.make(TASK)
    network = LinearSDNNConfig(n_actions=n_actions)
    agent = SDNNActorCritic(env, seed=1000, approximator=network)
    imitate(agent, log, epochs=epochs)
    errors = [agent.act(t.observation, explore=False) - t.action for t in test]
    returns = [mean_return(lambda o: agent.act(o, explore=False))]
    agent.train(env, steps=30_000, seed=1)
    returns.append(mean_return(lambda o: agent.act(o, explore=False)))
    return float(np.sqrt(np.mean(np.square(errors)))), *returns


def main() -> None:
    """Print the tables."""
    gains, random = optimal_gains(), np.random.default_rng(0)
    rows = ((what, f"{value:,.0f}") for what, value in disturbed(gains, random))
    print(markdown(("done to the feedback", "return"), rows))
    rows = []
    for n_actions, epochs in ((5, 20), (9, 5), (9, 20)):
        error, first, last = imitated(gains, n_actions, epochs)
        rows.append((str(n_actions), str(epochs), f"{error:.3f}", f"{first:,.0f}", f"{last:,.0f}"))
    print(markdown(("actions", "epochs", "error", "return", "after 30,000 steps"), rows))


if __name__ == "__main__":
    main()
