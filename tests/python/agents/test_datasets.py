"""Learning from logged transitions: files, arrays, datasets of Minari."""

import json
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from refusals import refuses
from sdnn.agents import FuzzyQLearning, RBFQLearning, SDNNQLambda, Transition, learn_from
from sdnn.approximators import LinearSDNNConfig
from stopped_training import states_equal

PLACE = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
BUTTONS = gym.spaces.Discrete(3)
SMALL = LinearSDNNConfig(n_pattern_units=20, n_anchor_patterns=4, n_interpolated=6)


def new_agent(space=PLACE, **options):
    settings = {"inputs": "all", "angle_pairs": "none"} | options
    return SDNNQLambda(space, BUTTONS, approximator=SMALL, seed=1, **settings)


def logged(seed=1, n_episodes=4, length=10):
    """Yield episodes in the form of Minari; all are terminated, but the last is truncated."""
    rng = np.random.default_rng(seed)
    for number in range(n_episodes):
        ends = np.arange(length) == length - 1
        yield SimpleNamespace(
            observations=rng.uniform(-1, 1, (length + 1, 2)),
            actions=rng.integers(3, size=length),
            rewards=rng.normal(size=length),
            terminations=ends if number < n_episodes - 1 else np.zeros(length, bool),
            truncations=ends if number == n_episodes - 1 else np.zeros(length, bool),
        )


def transitions():
    """Return the log as transitions, and whether each was the last of a truncated episode."""
    for episode in logged():
        for t, reward in enumerate(episode.rewards):
            here, after = episode.observations[t], episode.observations[t + 1]
            action, terminated = int(episode.actions[t]), bool(episode.terminations[t])
            transition = Transition(here, action, float(reward), after, terminated)
            yield transition, bool(episode.truncations[t])


def arrays():
    columns = zip(*(transition[:5] for transition, _ in transitions()), strict=True)
    names = ("observations", "actions", "rewards", "next_observations", "terminations")
    log = {name: np.array(column) for name, column in zip(names, columns, strict=True)}
    return log | {"truncations": np.array([truncated for _, truncated in transitions()])}


def lines(path):
    with path.open("w") as file:
        for transition, truncated in transitions():
            row = {name: np.asarray(value).tolist() for name, value in transition._asdict().items()}
            file.write(json.dumps(row | ({"truncated": True} if truncated else {})) + "\n")
    return path


@pytest.mark.filterwarnings("ignore::UserWarning")
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
        for episode in logged()
    ]
    dataset = minari.create_dataset_from_buffers(
        "place/random-v0", buffer=buffers, observation_space=PLACE, action_space=BUTTONS
    )
    agent, other = new_agent(), new_agent()
    assert learn_from(agent, dataset, epochs=2) == learn_from(other, arrays(), epochs=2)
    assert states_equal(agent, other)


def test_logs_of_dict_observations_are_learned_and_end_a_warm_up(tmp_path):
    rng = np.random.default_rng(1)
    wide = gym.spaces.Dict({"at": gym.spaces.Box(-np.inf, np.inf, (1,)), "gear": BUTTONS})
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
    agent = new_agent(wide, warm_up_steps=50)
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
    "line", ["", "7", "{}", "[" * 9999, '{"observation": [0, 0]}', "nonsense", "\x00", "NaN"]
)
def test_lines_that_are_no_transition_are_refused_with_their_number(tmp_path, line):
    path = lines(tmp_path / "log.jsonl")
    path.write_text(path.read_text() + line + "\n")
    agent = new_agent()
    error = refuses("41", learn_from, agent, path)  # after the 40 lines of the log
    assert "line" in str(error)
    assert states_equal(agent, new_agent())  # nothing is learned


def test_without_next_observations_the_next_row_has_them():
    # The 40 transitions lack one: the last of the truncated episode has no next observation.
    columns = arrays()
    without_next = {name: v for name, v in columns.items() if name != "next_observations"}
    agent, other = new_agent(), new_agent()
    assert learn_from(agent, without_next) == 39
    learn_from(other, {name: values[:-1] for name, values in columns.items()})
    assert np.array_equal(agent.readout.weights(), other.readout.weights())


def test_a_line_of_two_megabytes_is_refused(tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_bytes(b" " * 2**21)
    refuses("line", learn_from, new_agent(), path)


def test_2_to_the_31_epochs_of_an_empty_dataset_end_at_once():
    agent = SDNNQLambda(gym.spaces.Box(0.0, 1.0, (2,)), gym.spaces.Discrete(2))
    assert learn_from(agent, (), epochs=2**31) == 0


def test_wrong_agents_datasets_and_columns_are_refused():
    good = arrays()
    torque = gym.spaces.Box(-1.0, 1.0, (1,))
    refuses("agent", learn_from, FuzzyQLearning(PLACE, torque), [], error=TypeError)
    refuses("dataset", learn_from, new_agent(), {"observations": []})
    refuses("dataset", learn_from, new_agent(), good | {"dones": good["rewards"]})
    refuses("dataset", learn_from, new_agent(), good | {"rewards": good["rewards"][1:]})
    refuses("rewards", learn_from, new_agent(), good | {"rewards": ["a"]})
    refuses("transition", learn_from, new_agent(), ["no transition"], error=TypeError)
    with pytest.raises(FileNotFoundError):
        learn_from(new_agent(), "nowhere.jsonl")


@settings(max_examples=20, deadline=None)
@given(truncated=st.lists(st.booleans(), min_size=1, max_size=30), epochs=st.integers(1, 3))
def test_truncations_begin_new_episodes(truncated, epochs):
    rng = np.random.default_rng(len(truncated))
    n = len(truncated)
    states = rng.uniform(-1, 1, (n + 1, 2))
    rows = {
        "observations": states[:-1], "actions": rng.integers(3, size=n),
        "rewards": rng.normal(size=n), "next_observations": states[1:],
        "terminations": np.zeros(n, bool),
    }  # fmt: skip
    agent, by_hand = RBFQLearning(PLACE, BUTTONS), RBFQLearning(PLACE, BUTTONS)
    assert (
        learn_from(agent, rows | {"truncations": np.array(truncated)}, epochs=epochs) == n * epochs
    )
    for _ in range(epochs):
        for t in range(n):
            row = (states[t], rows["actions"][t], rows["rewards"][t], states[t + 1], False)
            by_hand.learn(Transition(*row))
            if truncated[t]:
                by_hand.begin_episode()
        by_hand.begin_episode()
    assert states_equal(agent, by_hand)
