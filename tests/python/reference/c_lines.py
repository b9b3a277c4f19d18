"""Lines of input for programs in which agents act and learn; see DRIVER of c_learners.py."""

import gymnasium as gym
import numpy as np

MISSING = -(2**31)
REFUSED = 2**32 - 1


def lines_of(agent, n_steps, seed, fraction_bits):
    """Lines with episodes that end in every way, and rewards of many sizes."""
    random = np.random.default_rng(seed)
    space, scale = agent.observation_space, 2**fraction_bits

    def after(now):
        if isinstance(space, gym.spaces.Discrete):
            return np.eye(space.n)[random.integers(space.n)]
        high = np.asarray(space.high, float)
        if now is None:
            return random.uniform(-1.2, 1.2, high.size) * high
        return np.clip(now + random.normal(0, 0.1, high.size) * high, -1.2 * high, 1.2 * high)

    lines, now = [], None
    for _ in range(n_steps):
        if now is None:
            now = after(None)
            lines.append([0, *now, 0, *now, 0])
        following = after(now)
        if random.random() < 0.1:
            lines.append([2, *now, 0, *now, 0])
        reward = random.choice([0.0, 1.0, -1.0, random.normal(), 100.0 * random.normal()])
        if random.random() < 0.002:
            reward *= 300.0
        if len(lines) < n_steps // 4:  # then glitches are 2^27 times as large
            reward = np.sign(reward) * (2.0**15 if random.random() < 0.02 else 2.0**-12)
        ends = random.random()
        lines.append([1, *now, reward, *following, ends < 0.03])
        now = None if ends < 0.06 else following
    table = np.array(lines)
    table[:, 1:-1] = np.clip(np.round(table[:, 1:-1] * scale), -(2**31), 2**31 - 1)
    if has_episodes(agent):
        table = with_greedy_episodes(table, random)
    return table.astype("<i4")


def with_durations(lines, random):
    """Lines of steps with durations of all sizes, some after a refused attempt with a short one."""
    n_attempts = (lines[:, 0] == 1) & (random.random(len(lines)) < 0.1)
    attempts = np.repeat(np.arange(len(lines)), n_attempts)
    lines = np.insert(lines, attempts, lines[attempts], axis=0)
    durations = np.exp2(random.uniform(6.1, 24.0, len(lines))).astype(np.int64)
    near = random.integers(66, 72, len(lines)), random.integers(60000, 70000, len(lines))
    durations = np.choose(random.integers(0, 5, len(lines)), [65536, *near, durations, 2**30 - 1])
    refused = attempts + np.arange(attempts.size)
    durations[refused] = random.integers(1, 66, attempts.size)
    lines[:, -1] += (2 * durations).astype("<i4")
    return lines


def has_episodes(agent):
    """Whether greedy functions of the header have the memory of an episode."""
    return agent.history != "none" or agent.missing == "hold"


def with_missing(lines, random, share=0.2):
    """Lines in which some readings are missing, several in a row at times."""
    n = (lines.shape[1] - 3) // 2
    lines = lines.copy()
    for first in (1, n + 2):
        readings = lines[:, first : first + n]
        is_missing = random.random(readings.shape) < share
        is_missing |= np.roll(is_missing, 1, axis=0) & (random.random(readings.shape) < 0.7)
        readings[is_missing] = MISSING
    return lines


def with_greedy_episodes(table, random):
    """Insert greedy steps of other episodes, and of the present one."""
    counts = np.where(random.random(len(table)) < 0.1, random.integers(1, 6, len(table)), 0)
    inserted = np.repeat(np.roll(table, 7, axis=0), counts, axis=0)
    inserted[:, 0] = random.choice([2, 2, 3], len(inserted))
    return np.insert(table, np.repeat(np.arange(len(table)), counts), inserted, axis=0)
