"""Cells (a name, and a function that returns a fault) about logged transitions in many forms."""

import csv
import json
from types import SimpleNamespace

import gymnasium as gym
import numpy as np

from sdnn.agents import SDNNQLambda, Transition, learn_from
from sdnn.approximators import LinearSDNNConfig

SPACE, BUTTONS = gym.spaces.Box(-1.0, 1.0, (2,), np.float64), gym.spaces.Discrete(3)
NAMES = ("observations", "actions", "rewards", "next_observations", "terminations", "truncations")
OTHER_NAMES = ("obs", "acts", "rews", "next_obs", "terminals", "timeouts")
LENGTH, N_EPISODES = 6, 3


def new_agent():
    config = LinearSDNNConfig(n_pattern_units=20, n_anchor_patterns=4, n_interpolated=6)
    options = {"inputs": "all", "angle_pairs": "none"}
    return SDNNQLambda(SPACE, BUTTONS, approximator=config, seed=1, **options)


def arrays():
    """Return the columns `NAMES` of three episodes, of which the last is truncated."""
    rng = np.random.default_rng(1)
    n = LENGTH * N_EPISODES
    states = rng.uniform(-1, 1, (N_EPISODES, LENGTH + 1, 2))
    ends = np.arange(n) % LENGTH == LENGTH - 1
    is_in_last = np.arange(n) >= n - LENGTH
    before, after = states[:, :-1].reshape(n, 2), states[:, 1:].reshape(n, 2)
    columns = before, rng.integers(3, size=n), rng.normal(size=n), after, ends & ~is_in_last
    return dict(zip(NAMES, (*columns, ends & is_in_last), strict=True))


def rows(columns):
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def transitions(columns):
    return [Transition(*list(row.values())[:5]) for row in rows(columns)]


def episodes(columns):
    """Return episodes in the form of Minari and imitation: one observation more than actions."""
    all_episodes = []
    for first in range(0, len(columns["rewards"]), LENGTH):
        episode = {name: values[first : first + LENGTH] for name, values in columns.items()}
        after = episode.pop("next_observations")
        episode["observations"] = np.concatenate([episode["observations"], after[-1:]])
        all_episodes.append(episode)
    return all_episodes


def file_of_values(columns):
    names = ["observation_0", "observation_1", "action", "reward", "next_observation_0",
             "next_observation_1", "terminated", "truncated"]  # fmt: skip
    with open("log.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        for row in rows(columns):
            writer.writerow(np.concatenate([np.ravel(value) for value in row.values()]))
    return "log.csv"


def file_of_lines(columns):
    with open("log.jsonl", "w") as file:
        for row in rows(columns):
            file.write(json.dumps({name: np.asarray(x).tolist() for name, x in row.items()}) + "\n")
    return "log.jsonl"


def table(columns):
    import pandas as pd

    flat = {
        f"{name}_{i}": values
        for name, column in (("obs", "observations"), ("next_obs", "next_observations"))
        for i, values in enumerate(columns[column].T)
    }
    return pd.DataFrame(flat | {name: columns[name] for name in NAMES if "obs" not in name})


FORMS = {
    "arrays": dict,
    "lists": lambda columns: {name: list(values) for name, values in columns.items()},
    "other names": lambda columns: dict(zip(OTHER_NAMES, columns.values(), strict=True)),
    "flags as numbers": lambda columns: {
        name: values.astype(float) if values.dtype == bool else values
        for name, values in columns.items()
    },
    "actions in columns of floats": lambda columns: (
        columns | {"actions": columns["actions"][:, None].astype(float)}
    ),
    "table": table,
    "csv": file_of_values,
    "json lines": file_of_lines,
    "list of mappings": rows,
    "iterator of mappings": lambda columns: iter(rows(columns)),
    "list of tuples": lambda columns: [tuple(row.values()) for row in rows(columns)],
    "episodes": lambda columns: [SimpleNamespace(**part) for part in episodes(columns)],
    "episodes as mappings": episodes,
    "Minari": lambda columns: SimpleNamespace(
        iterate_episodes=lambda: (SimpleNamespace(**part) for part in episodes(columns))
    ),
}


def _set(name, value):
    """Return a function that sets a number within the second episode to a value."""

    def damage(columns):
        values = columns[name].copy()
        values[LENGTH + 2] = value
        return columns | {name: values}

    return damage


def _texts(columns):
    values = columns["rewards"].astype(object)
    values[LENGTH + 2] = "much"
    return columns | {"rewards": values}


DAMAGES = {
    "action out of its space": _set("actions", 3),
    "reward NaN": _set("rewards", np.nan),
    "reward beyond the largest": _set("rewards", 1e301),
    "observation NaN": _set("observations", np.nan),
    "reward of text": _texts,
    "a variable more": lambda columns: (
        columns | {name: np.pad(columns[name], ((0, 0), (0, 1))) for name in NAMES if "obs" in name}
    ),
    "an action less": lambda columns: columns | {"actions": columns["actions"][:-1]},
}


def log_cells():
    """Yield cells: every form of a log is learned alike, each damaged one refused as a whole."""
    expected = new_agent()
    for transition, is_cut in zip(transitions(arrays()), arrays()["truncations"], strict=True):
        expected.learn(transition)
        if transition.terminated or is_cut:
            expected.begin_episode()
    for form, make in FORMS.items():
        yield f"{form}", _form_cell(make, expected)
        for damage, change in DAMAGES.items():
            if damage != "an action less" or form in ("arrays", "lists", "other names"):
                yield f"{form}: {damage}", _damage_cell(make, change)


def state_of(agent):
    return {name: values.tobytes() for name, values in agent._controller.state().items()}


def _form_cell(make, expected):
    def run():
        agent = new_agent()
        n = learn_from(agent, make(arrays()))
        if n != LENGTH * N_EPISODES:
            return f"{n} transitions were learned"
        return "" if state_of(agent) == state_of(expected) else "another state was learned"

    return run


def _damage_cell(make, change):
    def run():
        agent = new_agent()
        before = state_of(agent)
        try:
            learn_from(agent, make(change(arrays())))
        except (TypeError, ValueError) as error:
            if state_of(agent) != before:
                return "a part was learned"
            return "" if "dataset" in str(error) else f"the place is not named: {error}"
        return "was learned"

    return run
