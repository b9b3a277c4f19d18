"""Lines of input for programs in which agents act and learn; see `DRIVER` of c_learners.py.

A line is a row of int32: what to do, an observation of n numbers, a reward, the next observation,
and the end of the transition: twice its duration, plus 1 if it terminated. Observations and rewards
are in fixed point; a duration has the unit 2^-16, and 0 stands for 1.
"""

import gymnasium as gym
import numpy as np

BEGIN_EPISODE, LEARN, GREEDY, GREEDY_IN_NEW_EPISODE = range(4)
"""The task of a line. A line with `LEARN` acts and learns; all others act greedily."""

MISSING = -(2**31)
"""A number of an observation that is missing."""

REFUSED = 2**32 - 1
"""An index of an action where the observation is refused."""


def lines_of(agent, n_steps, seed, fraction_bits):
    """Return lines with episodes that end in every way, and rewards of many sizes."""
    random = np.random.default_rng(seed)
    space = agent.observation_space

    def observation_after(observation):
        """Return an observation near another one, or any one after None, in and outside ranges."""
        if isinstance(space, gym.spaces.Discrete):
            return np.eye(space.n)[random.integers(space.n)]
        high = np.asarray(space.high, float)
        if observation is None:
            return random.uniform(-1.2, 1.2, high.size) * high
        moved = observation + random.normal(0, 0.1, high.size) * high
        return np.clip(moved, -1.2 * high, 1.2 * high)

    lines, observation = [], None
    for _ in range(n_steps):
        if observation is None:
            observation = observation_after(None)
            lines.append([BEGIN_EPISODE, *observation, 0, *observation, 0])
        next_observation = observation_after(observation)
        if random.random() < 0.1:
            lines.append([GREEDY, *observation, 0, *observation, 0])
        reward = random.choice([0.0, 1.0, -1.0, random.normal(), 100.0 * random.normal()])
        if random.random() < 0.002:
            reward *= 300.0
        if len(lines) < n_steps // 4:  # first tiny rewards, and glitches 2^27 times as large
            reward = np.sign(reward) * (2.0**15 if random.random() < 0.02 else 2.0**-12)
        draw = random.random()
        lines.append([LEARN, *observation, reward, *next_observation, draw < 0.03])
        observation = None if draw < 0.06 else next_observation  # half of the ends are truncations
    table = np.array(lines)
    table[:, 1:-1] = np.round(table[:, 1:-1] * 2**fraction_bits)
    table[:, 1:-1] = np.clip(table[:, 1:-1], -(2**31), 2**31 - 1)
    if has_episodes(agent):
        table = with_greedy_episodes(table, random)
    return table.astype("<i4")


def with_durations(lines, random):
    """Return lines with durations of all sizes, some after a copy with one that is too short.

    The shortest duration is 0.001, which is 65.5 in units of 2^-16; the longest that an int32 can
    hold twice, plus 1, is 2^30 - 1.
    """
    n_copies = (lines[:, 0] == LEARN) & (random.random(len(lines)) < 0.1)
    copied = np.repeat(np.arange(len(lines)), n_copies)
    lines = np.insert(lines, copied, lines[copied], axis=0)
    durations = np.exp2(random.uniform(6.1, 24.0, len(lines))).astype(np.int64)
    shortest, near_1 = (
        random.integers(66, 72, len(lines)),
        random.integers(60000, 70000, len(lines)),
    )
    choices = [65536, shortest, near_1, durations, 2**30 - 1]
    durations = np.choose(random.integers(0, 5, len(lines)), choices)
    too_short = copied + np.arange(copied.size)  # where np.insert has put the copies
    durations[too_short] = random.integers(1, 66, copied.size)
    lines[:, -1] += (2 * durations).astype("<i4")
    return lines


def has_episodes(agent):
    """Return whether greedy functions of the header take the memory of an episode."""
    return agent.history != "none" or agent.missing == "hold"


def with_missing(lines, random, share=0.2):
    """Return lines in which some numbers are missing, several in a row at times."""
    n_observed = (lines.shape[1] - 3) // 2
    lines = lines.copy()
    for first in (1, n_observed + 2):
        observations = lines[:, first : first + n_observed]
        is_missing = random.random(observations.shape) < share
        is_missing |= np.roll(is_missing, 1, axis=0) & (random.random(observations.shape) < 0.7)
        observations[is_missing] = MISSING
    return lines


def with_greedy_episodes(table, random):
    """Return lines with greedy steps inserted, of other episodes and of the present one."""
    counts = np.where(random.random(len(table)) < 0.1, random.integers(1, 6, len(table)), 0)
    inserted = np.repeat(np.roll(table, 7, axis=0), counts, axis=0)  # observations of other steps
    inserted[:, 0] = random.choice([GREEDY, GREEDY, GREEDY_IN_NEW_EPISODE], len(inserted))
    return np.insert(table, np.repeat(np.arange(len(table)), counts), inserted, axis=0)
