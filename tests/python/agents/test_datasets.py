"""Learning from logged transitions: files, arrays, datasets of Minari."""

import json
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from refusals import refuses
from sdnn.agents import (
    FuzzyQLearning,
    RBFQLearning,
    SDNNQLambda,
    Transition,
    evaluate,
    learn_from,
)
from sdnn.approximators import LinearSDNNConfig
from stopped_training import states_equal

PLANE = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
THREE_ACTIONS = gym.spaces.Discrete(3)
SMALL = LinearSDNNConfig(n_pattern_units=20, n_anchor_patterns=4, n_interpolated=6)


def new_agent(space=PLANE, **options):
    settings = {"inputs": "all", "angle_pairs": "none"} | options
    return SDNNQLambda(space, THREE_ACTIONS, approximator=SMALL, seed=1, **settings)


def minari_episodes():
    """Yield 4 episodes of 10 steps in the form of Minari; only the last is truncated."""
    rng = np.random.default_rng(1)
    is_last_step, never = np.arange(10) == 9, np.zeros(10, bool)
    for episode in range(4):
        yield SimpleNamespace(
            observations=rng.uniform(-1, 1, (11, 2)),
            actions=rng.integers(3, size=10),
            rewards=rng.normal(size=10),
            terminations=is_last_step if episode < 3 else never,
            truncations=is_last_step if episode == 3 else never,
        )


def logged_transitions():
    """Yield the 40 transitions of the episodes, each with whether it was truncated."""
    for episode in minari_episodes():
        for t, reward in enumerate(episode.rewards):
            observation, next_observation = episode.observations[t : t + 2]
            action, terminated = int(episode.actions[t]), bool(episode.terminations[t])
            yield (
                Transition(observation, action, float(reward), next_observation, terminated),
                bool(episode.truncations[t]),
            )


def log_as_arrays():
    columns = zip(*(transition[:5] for transition, _ in logged_transitions()), strict=True)
    names = ("observations", "actions", "rewards", "next_observations", "terminations")
    log = {name: np.array(column) for name, column in zip(names, columns, strict=True)}
    return log | {"truncations": np.array([truncated for _, truncated in logged_transitions()])}


def write_log(path):
    """Write the transitions as lines of JSON, and return the path."""
    with path.open("w") as file:
        for transition, truncated in logged_transitions():
            row = {name: np.asarray(value).tolist() for name, value in transition._asdict().items()}
            file.write(json.dumps(row | ({"truncated": True} if truncated else {})) + "\n")
    return path


@pytest.mark.filterwarnings("ignore::UserWarning")  # of Minari
def test_a_minari_dataset_is_learned_like_its_arrays(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    buffers = [
        minari.data_collector.EpisodeBuffer(
            observations=list(episode.observations),
            actions=list(episode.actions),
            rewards=list(episode.rewards),
            terminations=list(episode.terminations),
            truncations=list(episode.truncations),
        )
        for episode in minari_episodes()
    ]
    dataset = minari.create_dataset_from_buffers(
        "place/random-v0", buffer=buffers, observation_space=PLANE, action_space=THREE_ACTIONS
    )
    agent, other = new_agent(), new_agent()
    assert learn_from(agent, dataset, epochs=2) == learn_from(other, log_as_arrays(), epochs=2)
    assert states_equal(agent, other)


def test_files_and_episodes_of_dict_observations_are_learned_and_end_a_warm_up(tmp_path):
    rng = np.random.default_rng(1)
    unbounded = gym.spaces.Box(-np.inf, np.inf, (1,))
    space = gym.spaces.Dict({"at": unbounded, "gear": gym.spaces.Discrete(3)})
    path = tmp_path / "log.jsonl"
    rows = [
        {
            "observation": {"at": [rng.normal()], "gear": int(rng.integers(3))},
            "action": int(rng.integers(3)),
            "reward": 1,
            "next_observation": {"at": [rng.normal()], "gear": 2},
            "terminated": True,
        }
        for _ in range(60)
    ]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    agent = new_agent(space, warm_up_steps=50)
    assert learn_from(agent, path) == 60
    assert not agent.is_warming_up
    episode = SimpleNamespace(
        observations={"at": np.zeros((3, 1)), "gear": np.zeros(3, int)},
        actions=np.zeros(2, int), rewards=np.ones(2),
        terminations=np.zeros(2, bool), truncations=np.zeros(2, bool),
    )  # fmt: skip
    minari = SimpleNamespace(iterate_episodes=lambda: iter([episode]))
    assert learn_from(agent, minari) == 2


@pytest.mark.parametrize(
    "line", ["7", "{}", "[" * 9999, '{"observation": [0, 0]}', "nonsense", "\x00", "NaN"]
)
def test_lines_that_are_no_transition_are_refused_with_their_number(tmp_path, line):
    path = write_log(tmp_path / "log.jsonl")
    path.write_text(path.read_text() + line + "\n")
    agent = new_agent()
    error = refuses("41", learn_from, agent, path)  # after the 40 lines of the log
    assert "line" in str(error)
    assert states_equal(agent, new_agent())  # nothing is learned


def test_without_a_column_of_next_observations_those_of_the_next_row_are_learned():
    # The last of 40 transitions, where an episode is truncated, has no next observation.
    columns = log_as_arrays()
    agent, other = new_agent(), new_agent()
    learn_from(other, {name: values[:-1] for name, values in columns.items()})
    del columns["next_observations"]
    assert learn_from(agent, columns) == 39
    assert np.array_equal(agent.readout.weights(), other.readout.weights())


def table(path, text, **encoding):
    names = "observation_0,observation_1,action,reward,next_observation_0,next_observation_1"
    path.write_text(names + ",terminated\n" + text, **encoding)
    return path


def test_empty_cells_and_null_in_files_are_missing_readings(tmp_path):
    csv = table(tmp_path / "log.csv", "0,,1,1.0,0.5,,False\n0.5,,2,1.0,0.25, ,True\n")
    jsonl = tmp_path / "log.jsonl"
    row = {"observation": [0, None], "action": 1, "reward": 1, "next_observation": [0.5, None]}
    last = {"observation": [0.5, None], "action": 2, "reward": 1, "next_observation": [0.25, None]}
    jsonl.write_text("".join(json.dumps(r) + "\n" for r in (row, last | {"terminated": True})))
    here, after, end = [0.0, np.nan], [0.5, np.nan], [0.25, np.nan]
    log = [Transition(here, 1, 1.0, after, False), Transition(after, 2, 1.0, end, True)]
    settings = {"history": "none", "observation_range": (-1, 1)}
    agents = [new_agent(missing="hold", **settings) for _ in range(3)]
    for agent, dataset in zip(agents, (log, csv, jsonl), strict=True):
        assert learn_from(agent, dataset) == 2
        assert states_equal(agent, agents[0])
        refuses("dataset", learn_from, new_agent(), dataset)  # missing="error"
    csv = table(csv, "0,0,,1.0,0.5,0,False\n")  # without an action
    refuses("line", learn_from, agents[0], csv)


def test_a_byte_order_mark_and_blank_lines_are_skipped(tmp_path):
    agents = [new_agent(history="none", observation_range=(-1, 1)) for _ in range(3)]
    learn_from(agents[0], [Transition([0, 0], 1, 1.0, [0.5, 0], True)])
    text = "\n0,0,1,1.0,0.5,0,True\n\n"
    learn_from(agents[1], table(tmp_path / "log.csv", text, encoding="utf-8-sig"))
    path = tmp_path / "log.jsonl"
    row = {"obs": [0, 0], "act": 1, "rew": 1.0, "next_obs": [0.5, 0], "done": True}
    path.write_text(f"\n{json.dumps(row)}\n \n")
    learn_from(agents[2], path)
    assert states_equal(agents[0], agents[1])
    assert states_equal(agents[0], agents[2])


@pytest.mark.parametrize("names", ["0,0,1,1", "observation_0,action", "action,action,reward"])
def test_wrong_names_of_a_table_are_reported_in_their_line(tmp_path, names):
    path = tmp_path / "log.csv"
    for rows in ("", "0,0,0,0\n"):
        path.write_text(names + "\n" + rows)
        assert "line 1 " in str(refuses("dataset", learn_from, new_agent(), path))


def test_rows_of_json_without_next_observations_follow_each_other(tmp_path):
    agents = [new_agent(history="none", observation_range=(-1, 1)) for _ in range(2)]
    path = write_log(tmp_path / "log.jsonl")
    log = [json.loads(line) for line in path.read_text().splitlines()[:30]]
    rows = [{n: v for n, v in row.items() if n != "next_observation"} for row in log]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    assert learn_from(agents[0], path) == learn_from(agents[1], log) == 30
    assert np.array_equal(*(agent.readout.weights() for agent in agents))
    rows[4]["terminated"] = "perhaps"
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    assert "line 5:" in str(refuses("terminated", learn_from, agents[0], path))


def test_a_log_that_does_not_end_the_warm_up_is_warned_of():
    agent = new_agent(observation_range="adaptive", warm_up_steps=100)
    with pytest.warns(UserWarning, match="60"):  # the log has 40 of the 100 transitions needed
        learn_from(agent, log_as_arrays())
    assert agent.is_warming_up
    assert "learned" not in repr(agent)
    with pytest.warns(UserWarning, match="warming up"):
        evaluate(agent, RandomPlaces(), 1)
    learn_from(agent, log_as_arrays(), epochs=2)
    # All 40 + 2 * 40: at its end, at transition 100, the warm-up is learned, too.
    assert "learned 120 steps" in repr(agent)
    evaluate(agent, RandomPlaces(), 1)  # without a warning


class RandomPlaces(gym.Env):
    observation_space, action_space = PLANE, THREE_ACTIONS

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.np_random.uniform(-1, 1, 2), {}

    def step(self, action):
        return self.np_random.uniform(-1, 1, 2), 1.0, True, False, {}


def test_a_line_beyond_a_megabyte_is_refused(tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_bytes(b" " * (2**20 + 1))
    refuses("line", learn_from, new_agent(), path)


def test_2_to_the_31_epochs_of_an_empty_dataset_end_at_once():
    agent = SDNNQLambda(gym.spaces.Box(0.0, 1.0, (2,)), gym.spaces.Discrete(2))
    assert learn_from(agent, (), epochs=2**31) == 0


def test_wrong_agents_datasets_and_columns_are_refused():
    good = log_as_arrays()
    torque = gym.spaces.Box(-1.0, 1.0, (1,))
    refuses("agent", learn_from, FuzzyQLearning(PLANE, torque), [], error=TypeError)
    refuses("dataset", learn_from, new_agent(), {"observations": []})
    refuses("dataset", learn_from, new_agent(), good | {"dones": good["rewards"]})
    refuses("dataset", learn_from, new_agent(), good | {"rewards": good["rewards"][1:]})
    refuses("rewards", learn_from, new_agent(), good | {"rewards": ["a"]})
    refuses("transition", learn_from, new_agent(), ["no transition"], error=TypeError)
    with pytest.raises(FileNotFoundError):
        learn_from(new_agent(), "nowhere.jsonl")


@settings(max_examples=20, deadline=None)
@given(truncated=st.lists(st.booleans(), min_size=1, max_size=30), epochs=st.integers(1, 3))
def test_truncations_and_epochs_begin_new_episodes(truncated, epochs):
    n = len(truncated)
    rng = np.random.default_rng(n)
    states = rng.uniform(-1, 1, (n + 1, 2))
    rows = {
        "observations": states[:-1], "actions": rng.integers(3, size=n),
        "rewards": rng.normal(size=n), "next_observations": states[1:],
        "terminations": np.zeros(n, bool),
    }  # fmt: skip
    agent, by_hand = RBFQLearning(PLANE, THREE_ACTIONS), RBFQLearning(PLANE, THREE_ACTIONS)
    log = rows | {"truncations": np.array(truncated)}
    assert learn_from(agent, log, epochs=epochs) == n * epochs
    for _ in range(epochs):
        for t in range(n):
            by_hand.learn(Transition(*(column[t] for column in rows.values())))
            if truncated[t]:
                by_hand.begin_episode()
        by_hand.begin_episode()
    assert states_equal(agent, by_hand)
