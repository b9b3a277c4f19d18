"""SDNN-C Q-learning on one page: all of the paper's method in plain NumPy, on the acrobot.

    python docs/examples/sdnn_q_learning.py --n-inputs 6 --noise 0.02 --episodes 300

Numbers such as (1.3) are the sections of docs/explanation/method.md. The library learns the same
weights, bit for bit, and faster; a test compares them.
"""

import argparse
import dataclasses
import math
from itertools import pairwise

import gymnasium as gym
import numpy as np

from sdnn.environments import AcrobotSensors, SensorConfig, TighteningGoal


@dataclasses.dataclass
class Settings:
    """The paper's values. Each field is an option of the command."""

    episodes: int = 200
    seed: int = 1
    n_inputs: int = 4  # l: 4, 5 or 6 sensors of the acrobot
    noise: float = 0.0  # standard deviation on every sensor
    n_pattern_units: int = 200  # m
    n_anchor_patterns: int = 9
    n_interpolated: int = 44  # patterns between two anchors
    n_hidden_units: int = 900  # n
    n_active_units: int = 300  # n', units of a window
    u_low: int = 20  # this many active units stand for q_low
    u_high: int = 280  # and this many for q_high
    q_low: float = -20.0
    q_high: float = 20.0
    initial_threshold: int = 200  # weights and thresholds are in units of c
    learning_rate: float = 0.5  # alpha
    discount: float = 0.9  # gamma
    epsilon: float = 0.1
    n_greedy_steps: int = 10  # at the beginning of an episode


class Random:
    """xoshiro256**, seeded by SplitMix64 (6): one generator for each purpose."""

    def __init__(self, seed, stream, index=0):
        start = self.split_mix(self.split_mix(seed) ^ stream) ^ index
        self.state = [self.split_mix(start + i * 0x9E3779B97F4A7C15) for i in range(4)]

    @staticmethod
    def split_mix(x):
        z = (x + 0x9E3779B97F4A7C15) % 2**64
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
        return z ^ z >> 31

    def bits(self):
        a, b, c, d = self.state
        c, d = c ^ a, d ^ b
        self.state = [a ^ d, b ^ c, c ^ (b << 17) % 2**64, (d << 45 | d >> 19) % 2**64]
        result = b * 5 % 2**64
        return (result << 7 | result >> 57) * 9 % 2**64

    def uniform(self):
        return (self.bits() >> 11) / 2**53

    def below(self, n):
        """Return a whole number below n; bits that would favour small numbers are drawn again."""
        while (drawn := self.bits()) < 2**64 % n:
            pass
        return drawn % n

    def shuffled(self, items):
        items = list(items)
        for i in range(len(items), 1, -1):
            j = self.below(i)
            items[i - 1], items[j] = items[j], items[i - 1]
        return items


CODE_BOOKS, PERMUTATIONS, WEIGHTS, TIES, EXPLORATION = 1, 2, 3, 4, 5  # streams of random numbers


def code_book(s, random):
    """(1.2) Patterns of +1 and -1, one for each bin of an input's range: (n_bins, m)."""
    anchors = -np.ones((s.n_anchor_patterns, s.n_pattern_units), np.int8)
    for anchor in anchors:
        anchor[random.shuffled(range(s.n_pattern_units))[: s.n_pattern_units // 2]] = 1
    book = []
    for anchor, next_anchor in pairwise(anchors):
        differing = random.shuffled(np.flatnonzero(anchor != next_anchor))
        for portion in range(s.n_interpolated + 1):
            pattern = anchor.copy()
            pattern[differing[: portion * len(differing) // (s.n_interpolated + 1)]] *= -1
            book.append(pattern)
    return np.array(book)


def g(u, s):
    """(1.6) The value of u active units: a straight line that saturates at both ends."""
    u = np.clip(u, s.u_low, s.u_high)
    return (s.q_low * (s.u_high - u) + s.q_high * (u - s.u_low)) / (s.u_high - s.u_low)


def g_inverse(q, s):
    """(1.8) The number of active units whose value is nearest to q."""
    q = min(max(q, s.q_low), s.q_high)
    return math.floor(s.u_low + (q - s.q_low) * (s.u_high - s.u_low) / (s.q_high - s.q_low) + 0.5)


class SDNNC:
    """(1) The network. Whole numbers, which floats of 32 bits hold exactly up to 2^24."""

    def __init__(self, s):
        self.settings, inputs = s, range(s.n_inputs)
        self.code_books = [code_book(s, Random(s.seed, CODE_BOOKS, mu)) for mu in inputs]
        pairs = [(mu, nu) for mu in inputs for nu in inputs if mu != nu]
        self.permutations = {
            pair: Random(s.seed, PERMUTATIONS, i).shuffled(range(s.n_pattern_units))
            for i, pair in enumerate(pairs)
        }
        # (1.7) A weight is -1, 0 or 1: the difference of two random bits. 64 bits make those of 32
        # hidden units. Thresholds are large and of alternating sign.
        n, n_columns = s.n_hidden_units, s.n_pattern_units * len(pairs)
        random = Random(s.seed, WEIGHTS)
        random_bits = [[random.bits() for _ in range(0, n, 32)] for _ in range(n_columns)]
        bits = np.array(random_bits, np.uint64)[:, :, None] >> np.arange(0, 64, 2, np.uint64)
        first, second = (bits & 1).astype(np.float32), (bits >> 1 & 1).astype(np.float32)
        self.weights = np.ascontiguousarray((first - second).reshape(n_columns, -1)[:, :n].T)
        self.thresholds = s.initial_threshold * np.where(np.arange(n) % 2 == 0, -1, 1)
        self.step = 1  # a correction, in units of c
        self.first_units = np.arange(n - s.n_active_units + 1)  # (1.4) of each action's window

    def x_sd(self, state):
        """(1.2, 1.3) Every input's pattern, desensitized by every other one: (m l (l - 1),)."""
        patterns = [
            book[min(int(x * len(book)), len(book) - 1)]
            for x, book in zip(state, self.code_books, strict=True)
        ]
        groups = [
            (1 + patterns[nu][permutation]) // 2 * patterns[mu]
            for (mu, nu), permutation in self.permutations.items()
        ]
        return np.concatenate(groups).astype(np.float32)

    def potentials(self, state):
        """(1.4) h of all hidden units: (n,)."""
        return self.weights @ self.x_sd(state) - self.thresholds

    def counts(self, state):
        """(1.5) Active units in the window of each action: (n_actions,)."""
        n_active_before = np.append(0, np.cumsum(self.potentials(state) > 0))
        end_units = self.first_units + self.settings.n_active_units
        return n_active_before[end_units] - n_active_before[self.first_units]

    def values(self, state):
        """(1.6) Q(state, a) of all actions: (n_actions,)."""
        return g(self.counts(state), self.settings)

    def update(self, state, action, q_hat):
        """(1.8) Move Q(state, action) to q_hat; return the number of corrected units."""
        s, first, x_sd = self.settings, self.first_units[action], self.x_sd(state)
        h = self.potentials(state)[first : first + s.n_active_units]
        d = g_inverse(q_hat, s) - int(np.sum(h > 0))
        step, n_corrected = self.step if d > 0 else -self.step, 0
        # In each of |d| equal parts of the window, correct the unit nearest to its threshold that
        # is on the wrong side of it.
        for i in range(abs(d)):
            begin, end = (j * s.n_active_units // abs(d) for j in (i, i + 1))
            candidates = begin + np.flatnonzero((h[begin:end] > 0) == (d < 0))
            if candidates.size:
                unit = first + candidates[np.abs(h[candidates]).argmin()]
                self.weights[unit] += step * x_sd
                self.thresholds[unit] -= step
                n_corrected += 1
        return n_corrected


class QLearning:
    """(5.1) Q-learning with an epsilon-greedy policy."""

    def __init__(self, network, s):
        self.network, self.settings = network, s
        self.ties, self.exploration = Random(s.seed, TIES), Random(s.seed, EXPLORATION)

    def act(self, state, step):
        """The action for step number `step` of an episode, from 0."""
        values, s = self.network.values(state), self.settings
        if step >= s.n_greedy_steps and self.exploration.uniform() < s.epsilon:
            return self.exploration.below(len(values))
        best = np.flatnonzero(values == values.max())
        return int(best[self.ties.below(len(best)) if len(best) > 1 else 0])

    def learn(self, state, action, reward, next_state, terminated):
        """Learn one transition; return the number of corrected units."""
        alpha, gamma = self.settings.learning_rate, self.settings.discount
        target = reward
        if not terminated:
            target = reward + gamma * self.network.values(next_state).max()
        q = self.network.values(state)[action]
        return self.network.update(state, action, (1.0 - alpha) * q + alpha * target)


def train(s, report=print):
    """(5.2) Learn the acrobot swing-up; return the agent."""
    env = TighteningGoal(gym.make("sdnn/AcrobotSwingUp-v0", dtype="float64"))
    env = AcrobotSensors(env, SensorConfig(n_sensors=s.n_inputs, noise=s.noise), seed=s.seed)
    agent = QLearning(SDNNC(s), s)
    for episode in range(1, s.episodes + 1):
        state, _ = env.reset(options={"episode": episode})
        step, over = 0, False
        while not over:
            action = agent.act(state, step)
            torque = -1.0 + 2.0 * action / (len(agent.network.first_units) - 1)
            next_state, reward, terminated, truncated, _ = env.step([torque])
            agent.learn(state, action, reward, next_state, terminated)
            state, step, over = next_state, step + 1, terminated or truncated
        report(f"episode {episode}: {step} steps, goal {'reached' if terminated else 'missed'}")
    return agent


if __name__ == "__main__":
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    for field in dataclasses.fields(Settings):
        option = "--" + field.name.replace("_", "-")
        parser.add_argument(option, type=type(field.default), default=field.default, help=" ")
    train(Settings(**vars(parser.parse_args())))
