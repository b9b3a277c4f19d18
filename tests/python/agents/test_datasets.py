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
    given = {"inputs": "all", "angle_pairs": "none"} | options
    return SDNNQLambda(space, BUTTONS, approximator=SMALL, seed=1, **given)


def logged(seed=1, n_episodes=4, length=10):
    """Episodes as Minari has them; the last one was cut off."""
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
    for one in logged():
        for t, reward in enumerate(one.rewards):
            here, after = one.observations[t], one.observations[t + 1]
            terminated = bool(one.terminations[t])
            found = Transition(here, int(one.actions[t]), float(reward), after, terminated)
            yield found, bool(one.truncations[t])


def arrays():
    columns = zip(*(one[:5] for one, _ in transitions()), strict=True)
    names = ("observations", "actions", "rewards", "next_observations", "terminations")
    found = {name: np.array(column) for name, column in zip(names, columns, strict=True)}
    return found | {"truncations": np.array([cut for _, cut in transitions()])}


def lines(path):
    with path.open("w") as file:
        for one, cut in transitions():
            values = {name: np.asarray(value).tolist() for name, value in one._asdict().items()}
            file.write(json.dumps(values | ({"truncated": cut} if cut else {})) + "\n")
    return path


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_dataset_of_minari(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    buffers = [
        minari.data_collector.EpisodeBuffer(
            observations=list(one.observations),
            actions=list(one.actions),
            rewards=list(one.rewards),
            terminations=list(one.terminations),
            truncations=list(one.truncations),
        )
        for one in logged()
    ]
    dataset = minari.create_dataset_from_buffers(
        "place/random-v0", buffer=buffers, observation_space=PLACE, action_space=BUTTONS
    )
    agent, other = new_agent(), new_agent()
    assert learn_from(agent, dataset, epochs=2) == learn_from(other, arrays(), epochs=2)
    assert states_equal(agent, other)


def test_observations_of_parts_and_a_warm_up_from_the_data(tmp_path):
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
def test_lines_that_are_no_transition_are_named(tmp_path, line):
    path = lines(tmp_path / "log.jsonl")
    path.write_text(path.read_text() + line + "\n")
    agent = new_agent()
    error = refuses("41", learn_from, agent, path)
    assert "line" in str(error)
    assert states_equal(agent, new_agent())  # nothing is learned


def test_rows_without_next_observations_follow_each_other():
    """The last step of an episode that was cut off is not learned."""
    columns = arrays()
    following = {name: v for name, v in columns.items() if name != "next_observations"}
    agent, other = new_agent(), new_agent()
    assert learn_from(agent, following) == 39
    learn_from(other, {name: values[:-1] for name, values in columns.items()})
    assert np.array_equal(agent.readout.weights(), other.readout.weights())


def test_a_long_line_is_not_read_whole(tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_bytes(b" " * 2**21)
    refuses("line", learn_from, new_agent(), path)


def test_a_dataset_without_transitions_ends_at_once():
    agent = SDNNQLambda(gym.spaces.Box(0.0, 1.0, (2,)), gym.spaces.Discrete(2))
    assert learn_from(agent, (), epochs=2**31) == 0


def test_arguments_that_cannot_be_used():
    good = arrays()
    refuses("agent", learn_from, "agent", [], error=TypeError)
    torque = gym.spaces.Box(-1.0, 1.0, (1,))
    refuses("agent", learn_from, FuzzyQLearning(PLACE, torque), [], error=TypeError)
    refuses("dataset", learn_from, new_agent(), 7, error=TypeError)
    refuses("dataset", learn_from, new_agent(), {"observations": []})
    refuses("dataset", learn_from, new_agent(), good | {"dones": good["rewards"]})
    refuses("dataset", learn_from, new_agent(), good | {"rewards": good["rewards"][1:]})
    refuses("rewards", learn_from, new_agent(), good | {"rewards": ["a"]})
    refuses("transition", learn_from, new_agent(), ["no transition"], error=TypeError)
    refuses("epochs", learn_from, new_agent(), [], epochs=0)
    with pytest.raises(FileNotFoundError):
        learn_from(new_agent(), "nowhere.jsonl")


@settings(max_examples=20, deadline=None)
@given(cuts=st.lists(st.booleans(), min_size=1, max_size=30), epochs=st.integers(1, 3))
def test_truncated_episodes_are_learned_as_episodes_that_begin_anew(cuts, epochs):
    rng = np.random.default_rng(len(cuts))
    n = len(cuts)
    states = rng.uniform(-1, 1, (n + 1, 2))
    rows = {
        "observations": states[:-1], "actions": rng.integers(3, size=n),
        "rewards": rng.normal(size=n), "next_observations": states[1:],
        "terminations": np.zeros(n, bool),
    }  # fmt: skip
    agent, by_hand = RBFQLearning(PLACE, BUTTONS), RBFQLearning(PLACE, BUTTONS)
    assert learn_from(agent, rows | {"truncations": np.array(cuts)}, epochs=epochs) == n * epochs
    for _ in range(epochs):
        for t in range(n):
            row = (states[t], rows["actions"][t], rows["rewards"][t], states[t + 1], False)
            by_hand.learn(Transition(*row))
            if cuts[t]:
                by_hand.begin_episode()
        by_hand.begin_episode()
    assert states_equal(agent, by_hand)
