"""Goals for the tasks of study.toml, two tasks with two torques and one with a one-hot vector."""

from __future__ import annotations

from typing import NamedTuple

import gymnasium as gym
import numpy as np
from studies import MILESTONES


class Task(NamedTuple):
    """Mean returns that solve a task, and of random actions."""

    solved: float
    random: float

    def score(self, mean_return):
        """Put returns on a scale: 0 is that of random actions, 1 solves the task."""
        return (mean_return - self.random) / (self.solved - self.random)


TASKS = {
    "CartPole": Task(475.0, 22.4),
    "Pendulum": Task(-200.0, -1208.0),
    "MountainCar": Task(-110.0, -200.0),
    "MountainCarContinuous": Task(90.0, -33.1),
    "Acrobot": Task(-100.0, -486.5),
    "LunarLander": Task(200.0, -181.4),
    "LunarLanderContinuous": Task(200.0, -210.4),
    # Solved is what comes near the best of some hundred proportional controllers: -13.6 and -23.6.
    "Reaching": Task(-20.0, -112.2),
    "Wheels": Task(-30.0, -92.7),
    # The shortest path is 18 steps long.
    "Cells": Task(-30.0, -259.7),
    # 2 below the optimum, .05 below the optimum, and the mark of a policy that delivers everywhere.
    "CliffWalking": Task(-17.0, -5042.0),
    "FrozenLake": Task(0.69, 0.014),
    "Taxi": Task(0.0, -765.0),
    # Gymnasium's thresholds; Walker2d has none, and takes Hopper's.
    "InvertedPendulum": Task(950.0, 5.1),
    "Reacher": Task(-3.75, -42.9),
    "Hopper": Task(3800.0, 18.1),
    "HalfCheetah": Task(4800.0, -236.6),
    "Walker2d": Task(3800.0, 2.0),
    "Swimmer": Task(360.0, -0.2),
    "InvertedDoublePendulum": Task(9100.0, 50.1),
    # A task's name, or a whole case.
    "MountainCar goal-only": Task(1.0, 0.0),
}
CLEAN = "clean"


class Goal(NamedTuple):
    """A return that the default agent is to reach after some steps, in a share of the seeds."""

    steps: int
    at_least: float
    share: float


GOALS = {
    "CartPole": Goal(50_000, 475.0, 1.0),
    "Pendulum": Goal(60_000, -200.0, 0.9),
    "MountainCarContinuous": Goal(60_000, 90.0, 1.0),
    "Acrobot": Goal(100_000, -100.0, 0.9),
    "LunarLander": Goal(300_000, 200.0, 0.6),
    "CliffWalking": Goal(20_000, -17.0, 1.0),
    "FrozenLake": Goal(100_000, 0.69, 0.8),
    "Taxi": Goal(200_000, 0.0, 1.0),
    "InvertedPendulum": Goal(100_000, 1000.0, 1.0),
    "CartPole irrelevant-8": Goal(100_000, 475.0, 1.0),
    "CartPole correlated-8": Goal(100_000, 475.0, 1.0),
    "CartPole noise-05-copies": Goal(100_000, 490.0, 0.9),
    "Pendulum irrelevant-8": Goal(120_000, -200.0, 0.9),
    "Pendulum correlated-8": Goal(120_000, -200.0, 0.9),
    "Pendulum noise-05-copies": Goal(100_000, -230.0, 0.9),
    "Cells": Goal(50_000, -30.0, 0.9),
    "CartPole irrelevant-100": Goal(100_000, 475.0, 1.0),
    "Pendulum irrelevant-32": Goal(120_000, -200.0, 0.9),
}
"""By case."""
MILESTONES.update({case: goal.steps for case, goal in GOALS.items()})


def parts_of(case: str) -> tuple[str, str]:
    """Return a case's task, and what is done to its sensors."""
    name, _, condition = case.partition(" ")
    return name, condition or CLEAN


class ReachingEnv(gym.Env):
    """An arm of two links of 1 m on a table: bring its tip to a goal and keep it there.

    An episode has 60 steps of 0.1 s; each step's reward is minus the tip's distance in m. Torques
    work against inertia and friction, and what turns the second link pushes the first one back.
    """

    action_space = gym.spaces.Box(-1.0, 1.0, (2,))
    # Angles, their speeds, and by how much the goal's angles are larger.
    observation_space = gym.spaces.Box(
        np.array([-2, -2, -2, -2, -4, -4], np.float32), np.array([2, 2, 2, 2, 4, 4], np.float32)
    )

    def reset(self, *, seed=None, options=None):
        """Begin anywhere, at rest."""
        super().reset(seed=seed)
        self._angles = self.np_random.uniform(-1.5, 1.5, 2)
        self._goal = self.np_random.uniform(-1.5, 1.5, 2)
        self._speeds = np.zeros(2)
        return self._observation(), {}

    def step(self, action):
        """Apply two torques for 0.1 s."""
        first, second = np.clip(action, -1.0, 1.0)
        torques = np.array([first - 0.5 * second, second])
        self._speeds = np.clip(0.8 * self._speeds + 0.4 * torques, -2.0, 2.0)
        moved = self._angles + 0.1 * self._speeds
        self._angles = np.clip(moved, -2.0, 2.0)
        self._speeds = np.where(moved == self._angles, self._speeds, 0.0)  # at a stop
        distance = float(np.linalg.norm(self._tip(self._angles) - self._tip(self._goal)))
        return self._observation(), -distance, False, False, {}

    def _observation(self):
        missing = self._goal - self._angles
        return np.concatenate([self._angles, self._speeds, missing]).astype(np.float32)

    @staticmethod
    def _tip(angles):
        directions = np.cumsum(angles)
        return np.array([np.cos(directions).sum(), np.sin(directions).sum()])


class WheelsEnv(gym.Env):
    """A cart with a motor for each of its two wheels: drive to a goal and stop there.

    An episode has 60 steps of 0.1 s; each step's reward is minus the distance in m. Equal torques
    drive, opposite ones turn: one wheel's torque is good or bad depending on the other's.
    """

    action_space = gym.spaces.Box(-1.0, 1.0, (2,))
    # Distance, cosine and sine of the goal's bearing, speed, speed of turning.
    observation_space = gym.spaces.Box(
        np.array([0, -1, -1, -1, -4], np.float32), np.array([4, 1, 1, 1, 4], np.float32)
    )

    def reset(self, *, seed=None, options=None):
        """Begin 1 m to 2 m from the goal, in any direction, at rest."""
        super().reset(seed=seed)
        distance, direction = (
            self.np_random.uniform(1.0, 2.0),
            self.np_random.uniform(-np.pi, np.pi),
        )
        self._position = distance * np.array([np.cos(direction), np.sin(direction)])
        self._heading = self.np_random.uniform(-np.pi, np.pi)
        self._speed = self._turning = 0.0
        return self._observation(), {}

    def step(self, action):
        """Apply two torques for 0.1 s."""
        left, right = np.clip(action, -1.0, 1.0)
        self._speed = 0.8 * self._speed + 0.2 * (left + right) / 2
        self._turning = 0.8 * self._turning + 0.8 * (right - left) / 2
        self._heading += 0.1 * self._turning
        ahead = np.array([np.cos(self._heading), np.sin(self._heading)])
        self._position = self._position + 0.1 * self._speed * ahead
        return self._observation(), -float(np.linalg.norm(self._position)), False, False, {}

    def _observation(self):
        distance = np.linalg.norm(self._position)
        bearing = np.arctan2(*-self._position[::-1]) - self._heading
        seen = [min(distance, 4.0), np.cos(bearing), np.sin(bearing), self._speed, self._turning]
        return np.array(seen, np.float32)


class CellsEnv(gym.Env):
    """A square of 10 x 10 cells: walk from one corner to the opposite one.

    The observation is the cell as 100 binary variables, one of which is 1. An action walks to the
    next cell in one of four directions, or stays at the border; each step's reward is -1.
    """

    SIZE = 10
    MOVES = ((1, 0), (-1, 0), (0, 1), (0, -1))

    action_space = gym.spaces.Discrete(len(MOVES))
    observation_space = gym.spaces.MultiBinary(SIZE * SIZE)

    def reset(self, *, seed=None, options=None):
        """Begin in the first cell."""
        super().reset(seed=seed)
        self._cell = np.zeros(2, int)
        return self._observation(), {}

    def step(self, action):
        """Walk."""
        self._cell = np.clip(self._cell + self.MOVES[action], 0, self.SIZE - 1)
        is_last = bool((self._cell == self.SIZE - 1).all())
        return self._observation(), -1.0, is_last, False, {}

    def _observation(self):
        observation = np.zeros(self.SIZE * self.SIZE, np.int8)
        observation[self.SIZE * self._cell[1] + self._cell[0]] = 1
        return observation


gym.register("bench/Reaching-v0", entry_point=ReachingEnv, max_episode_steps=60)
gym.register("bench/Wheels-v0", entry_point=WheelsEnv, max_episode_steps=60)
gym.register("bench/Cells-v0", entry_point=CellsEnv, max_episode_steps=300)
