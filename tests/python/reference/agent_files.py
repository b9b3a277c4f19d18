"""Writes the files of tests/data, which C++ and Python must read alike.

For each agent NAME of `AGENTS`: the file NAME.safetensors, the steps that the agent takes after the
file is loaded (NAME.json), and the file after these steps (NAME-after.safetensors). For trainings
and estimators: a small file.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np

from sdnn import SDNNRegressor
from sdnn.agents import (
    FuzzyQLearning,
    FuzzyQLearningConfig,
    QLambdaConfig,
    QLearningConfig,
    RBFQLearning,
    Scaling,
    SDNNQLambda,
    SDNNQLearning,
    Training,
    Transition,
)
from sdnn.approximators import FuzzyRulesConfig, LinearSDNNConfig, RBFNetworkConfig, SDNNCConfig

FOLDER = Path(__file__).parents[2] / "data"
COSINE_SINE_SPEED_OTHER = gym.spaces.Box(
    np.array([-1.0, -1.0, -8.0, -np.inf]), np.array([1.0, 1.0, 8.0, np.inf]), dtype=np.float64
)
GEAR_AND_MOTION = gym.spaces.Dict(
    {"gear": gym.spaces.Discrete(3, start=1), "motion": COSINE_SINE_SPEED_OTHER}
)
TORQUE = gym.spaces.Box(-2.0, 3.0, (1,), dtype=np.float64)
TWO_TORQUES = gym.spaces.Box(np.array([0.0, -1.0]), np.array([1.0, 1.0]), dtype=np.float64)
SMALL = SDNNCConfig(
    n_pattern_units=12,
    n_anchor_patterns=4,
    n_interpolated=6,
    n_hidden_units=24,
    n_active_units=8,
    n_actions=5,
    rounding="random",
)
LEARNING = QLearningConfig(
    n_steps=3,
    epsilon=0.3,
    final_epsilon=0.0,
    final_learning_rate=0.25,
    n_greedy_steps=0,
    max_action_repeat=6,
    value_range="adaptive",
)
N_STEPS = 40

COMMON = {
    "observation_space": COSINE_SINE_SPEED_OTHER,
    "action_space": TORQUE,
    "angle_pairs": [(0, 1)],
    "warm_up_steps": 50,
    "seed": 11,
}
SDNN = {"approximator": SMALL, "learning": LEARNING}
Q_LAMBDA = {
    "approximator": LinearSDNNConfig(
        n_pattern_units=20,
        n_anchor_patterns=4,
        n_interpolated=6,
        n_actions=5,
        averaging_interval=3,
    ),
    "learning": QLambdaConfig(epsilon=0.3, schedule_steps=50, max_action_repeat=6),
}
RBF = {"approximator": RBFNetworkConfig(n_bases=3, n_actions=7), "learning": LEARNING}
FUZZY = {
    "approximator": FuzzyRulesConfig(n_sets=3, n_actions=4),
    "learning": FuzzyQLearningConfig(trace_decay=0.7, n_greedy_steps=0, epsilon=0.3),
}
AGENTS = {
    "sdnn": (SDNNQLearning, SDNN),
    "sdnn-vector": (SDNNQLearning, SDNN | {"action_space": TWO_TORQUES}),
    "sdnn-discrete": (SDNNQLearning, SDNN | {"action_space": gym.spaces.Discrete(3, start=4)}),
    # The gear is flattened to three variables, before the cosine and the sine.
    "sdnn-symbols": (
        SDNNQLearning,
        SDNN | {"observation_space": GEAR_AND_MOTION, "angle_pairs": [(3, 4)]},
    ),
    "sdnn-pairs": (SDNNQLearning, SDNN | {"approximator": replace(SMALL, max_pairs=3)}),
    # Longer than the 120 steps before the file is written.
    "sdnn-warm-up": (SDNNQLearning, SDNN | {"warm_up_steps": 140}),
    "q-lambda": (SDNNQLambda, Q_LAMBDA | {"inputs": "relevant"}),
    "q-lambda-vector": (SDNNQLambda, Q_LAMBDA | {"action_space": TWO_TORQUES, "inputs": "all"}),
    "rbf": (RBFQLearning, RBF),
    "fuzzy": (FuzzyQLearning, FUZZY),
    "fuzzy-vector": (FuzzyQLearning, FUZZY | {"action_space": TWO_TORQUES}),
}
"""Classes that both languages have, and arguments beside `COMMON`, by the names of the files."""


def record_steps(agent, rng, n_steps):
    """Let the agent act and learn in a made-up task; return a mapping for each step.

    The task draws all numbers from ``rng``, so that actions have no consequences.
    """
    steps = []
    angle, speed, other = rng.uniform(-3, 3, 3)

    def observe():
        motion = [np.cos(angle), np.sin(angle), speed, other]
        if isinstance(agent.observation_space, gym.spaces.Box):
            return motion
        return {"gear": int(1 + 2 * abs(speed) / 8), "motion": motion}

    begins = True
    for _ in range(n_steps):
        observation = observe()
        if begins:
            agent.begin_episode()
        action = agent.act(observation)
        greedy = agent.act(observation, explore=False)
        angle, speed, other = angle + 0.2 * speed, rng.uniform(-8, 8), rng.normal()
        next_observation = observe()
        reward, terminated = float(rng.normal()), bool(rng.random() < 0.1)
        agent.learn(Transition(observation, action, reward, next_observation, terminated))
        steps.append(
            {
                "begins": begins,
                "observation": agent.flat_observation(observation).tolist(),
                "action": np.atleast_1d(action).tolist(),
                "greedy": np.atleast_1d(greedy).tolist(),
                "reward": reward,
                "next_observation": agent.flat_observation(next_observation).tolist(),
                "terminated": terminated,
            }
        )
        begins = terminated
    return steps


def write(folder):
    """Write all files to a folder."""
    write_agents(folder / "agents")
    (folder / "files").mkdir(parents=True, exist_ok=True)
    env = gym.make("Pendulum-v1")
    agent = SDNNQLearning(
        env.observation_space, env.action_space, approximator=SMALL, learning=LEARNING, seed=3
    )
    training = Training(agent, env, steps=30, seed=1)
    training.run()
    training.save(folder / "files" / "training.safetensors")
    samples = np.random.default_rng(2).uniform(size=(20, 2))
    model = SDNNRegressor(n_pattern_units=40, n_output_units=9, max_iter=2, random_state=0)
    model.fit(samples, samples[:, 0]).save(folder / "files" / "estimator.safetensors")


def write_agents(folder):
    """Write the files of agents and their steps."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, (agent_class, arguments) in AGENTS.items():
        agent = agent_class(**COMMON | arguments)
        rng = np.random.default_rng(5)
        record_steps(agent, rng, 120)
        agent.progress = 0.5
        if name == "fuzzy":  # as after a run with noise
            agent.scaling = Scaling(ranges=((-1.0, 1.0),) * 3, n_redundant=1)
        agent.save(folder / f"{name}.safetensors")
        steps = record_steps(agent, rng, N_STEPS)
        agent.save(folder / f"{name}-after.safetensors")
        (folder / f"{name}.json").write_text(json.dumps(steps, indent=1) + "\n")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
