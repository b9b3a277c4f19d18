"""Saved agents resume exactly; damaged files are refused."""

import copy
import inspect
import itertools
import json
import pickle
import subprocess
import sys
from dataclasses import replace
from functools import partial

import gymnasium as gym
import numpy as np
import pytest

import agent_files
from refusals import refuses
from sdnn import SDNNRegressor
from sdnn.agents import (
    CheckpointCallback,
    FuzzyQLearning,
    FuzzyQLearningConfig,
    JSONLines,
    QLearningConfig,
    RBFQLearning,
    SaveBestAgent,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
    load_agent,
)
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.support.files import read_file, write_file
from stopped_training import states_equal

SMALL = SDNNCConfig(n_pattern_units=20, n_hidden_units=60, n_active_units=20, n_actions=5)
PLANE = gym.spaces.Box(-1.0, 1.0, (2,), dtype=np.float64)
SIX_VARIABLES = gym.spaces.Box(-1.0, 1.0, (6,), dtype=np.float64)
UNBOUNDED = gym.spaces.Box(-np.inf, np.inf, (3,), dtype=np.float64)
TORQUE = gym.spaces.Box(-2.0, 2.0, (1,), dtype=np.float32)
INTEGERS = gym.spaces.Box(-1, 1, (2,), dtype=np.int64)  # 5 actions are rounded to 3 integers
TWO_TORQUES = gym.spaces.Box(-2.0, 2.0, (2,), dtype=np.float32)
BUTTONS = gym.spaces.Discrete(3, start=2)
MIXED = gym.spaces.Dict({"at": PLANE, "lamp": gym.spaces.Discrete(2)})
WITH_ALL_STATE = QLearningConfig(
    n_steps=3,
    epsilon=0.3,
    final_epsilon=0.0,
    n_greedy_steps=0,
    max_action_repeat=6,
    start_steps=15,
    value_range="adaptive",
)
RANDOM_ROUNDING = replace(SMALL, rounding="random", averaging_interval=7)
DECREASING = QLearningConfig(learning_rate=1.0, final_learning_rate=0.2)
TRACES = FuzzyQLearningConfig(trace_decay=0.7, n_greedy_steps=0, epsilon=0.3)

sdnn = partial(SDNNQLearning, approximator=SMALL, learning=WITH_ALL_STATE)
AGENTS = {
    "sdnn": lambda: sdnn(PLANE, TORQUE, approximator=RANDOM_ROUNDING, seed=5),
    "sdnn, vector": lambda: sdnn(PLANE, TWO_TORQUES, seed=5),
    "sdnn, buttons": lambda: sdnn(MIXED, BUTTONS),
    "sdnn, switches": lambda: sdnn(PLANE, gym.spaces.MultiDiscrete([2, 3])),
    "sdnn, whole numbers": lambda: sdnn(PLANE, INTEGERS, seed=5),
    "sdnn, warm-up": lambda: sdnn(UNBOUNDED, TORQUE, warm_up_steps=60),
    "sdnn, adaptive ranges": lambda: sdnn(
        PLANE, TORQUE, observation_range="adaptive", warm_up_steps=60
    ),
    "sdnn, some pairs": lambda: sdnn(
        SIX_VARIABLES, TORQUE, approximator=replace(SMALL, max_pairs=12)
    ),
    "sdnn, tables": lambda: sdnn(PLANE, TORQUE, tables=[np.sign(np.eye(20) - 0.5)] * 2),
    "sdnn, one circular variable": lambda: sdnn(
        gym.spaces.Box(-1.0, 1.0, (1,)), TORQUE, angles=[0]
    ),
    "sdnn, one angle pair": lambda: sdnn(PLANE, TORQUE, angle_pairs=[(1, 0)]),
    "q-lambda": lambda: SDNNQLambda(UNBOUNDED, BUTTONS, warm_up_steps=60, seed=3),
    "actor-critic": lambda: SDNNActorCritic(UNBOUNDED, TWO_TORQUES, seed=1),
    "rbf": lambda: RBFQLearning(
        PLANE, TORQUE, approximator=RBFNetworkConfig(n_actions=7), learning=WITH_ALL_STATE
    ),
    "rbf, vector": lambda: RBFQLearning(
        PLANE, TWO_TORQUES, approximator=RBFNetworkConfig(n_actions=7), learning=WITH_ALL_STATE
    ),
    "fuzzy": lambda: FuzzyQLearning(PLANE, TORQUE, learning=TRACES, seed=2),
    "fuzzy, vector": lambda: FuzzyQLearning(
        PLANE, TWO_TORQUES, approximator=FuzzyRulesConfig(n_sets=4), learning=TRACES
    ),
    "fuzzy, warm-up": lambda: FuzzyQLearning(UNBOUNDED, TORQUE, learning=TRACES, warm_up_steps=60),
}
N_STEPS = 150


def run_steps(agent, first, last, copied_step=None, when="", copy_of=None):
    """Run steps ``first`` to ``last`` with random numbers that depend on their number only.

    In one step the agent is replaced by ``copy_of(agent)``, "before learning" or "after learning".
    Several environments take turns.
    """
    for step in range(first, last):
        environment = step % agent.n_environments
        rng = np.random.default_rng(step)
        observation, next_observation = (
            {"at": rng.uniform(-1, 1, 2), "lamp": int(rng.integers(2))}
            if isinstance(agent.observation_space, gym.spaces.Dict)
            else rng.uniform(-1, 1, agent.observation_space.shape)
            for _ in range(2)
        )
        if step % 17 == 0:
            agent.begin_episode(environment)
        agent.progress = step / N_STEPS
        action = agent.act(observation, environment=environment)
        if step == copied_step and when == "before learning":
            agent = copy_of(agent)
        agent.learn(
            Transition(observation, action, float(rng.normal()), next_observation, step % 17 == 16),
            environment,
        )
        if step % 5 == 0:
            agent.act(observation, explore=False)
        if step == copied_step and when == "after learning":
            agent = copy_of(agent)
    return agent


def check_same_agent(first, second):
    assert states_equal(first, second)
    assert first.description() == second.description()


@pytest.mark.parametrize("path", [".", "/", ""])
def test_paths_without_a_name_are_refused(path):
    agent = SDNNQLambda(gym.spaces.Box(-1, 1, (2,)), gym.spaces.Discrete(3))
    for use in (agent.save, JSONLines, CheckpointCallback, SaveBestAgent, load_agent):
        refuses("path", use, path)


@pytest.mark.parametrize(("n_environments", "n_copies"), [(1, 100), (4, 24)])
@pytest.mark.parametrize("name", AGENTS)
def test_an_agent_saved_or_copied_at_any_step_continues_exactly(
    name, n_environments, n_copies, tmp_path
):
    def new_agent():
        agent = AGENTS[name]()
        agent.n_environments = n_environments
        return agent

    expected = run_steps(new_agent(), 0, N_STEPS)

    def from_file(agent):
        agent.save(tmp_path / "agent.safetensors")
        return load_agent(tmp_path / "agent.safetensors")

    ways = [from_file, lambda agent: pickle.loads(pickle.dumps(agent)), copy.deepcopy]
    # Random steps go through all pairs of a way and a time.
    ways_and_times = itertools.cycle(itertools.product(ways, ("before learning", "after learning")))
    steps = np.random.default_rng(7).permutation(N_STEPS - 1)[:n_copies]
    for step, (copy_of, when) in zip(steps, ways_and_times, strict=False):
        resumed = run_steps(new_agent(), 0, N_STEPS, step, when, copy_of)
        check_same_agent(expected, resumed)


def test_learning_does_not_change_earlier_copies():
    agent = run_steps(AGENTS["sdnn"](), 0, 40)
    for copied in (copy.deepcopy(agent), copy.copy(agent)):
        before = copied.state()
        run_steps(agent, 40, 90)
        for name, array in copied.state().items():
            assert np.array_equal(array, before[name]), name


def test_load_agent_returns_the_class_that_was_saved(tmp_path):
    AGENTS["rbf"]().save(tmp_path / "agent")
    assert type(load_agent(tmp_path / "agent")) is RBFQLearning
    assert isinstance(RBFQLearning.load(tmp_path / "agent"), RBFQLearning)
    refuses("RBFQLearning", SDNNQLearning.load, tmp_path / "agent")


def test_a_subclass_of_an_imported_module_can_be_unpickled(tmp_path, monkeypatch):
    (tmp_path / "my_agents.py").write_text(
        "from sdnn.agents import RBFQLearning\nclass MyAgent(RBFQLearning):\n    pass\n"
    )
    code = (
        "import gymnasium, pickle, sys, my_agents\n"
        "spaces = gymnasium.spaces.Box(-1, 1, (2,)), gymnasium.spaces.Discrete(2)\n"
        "sys.stdout.buffer.write(pickle.dumps(my_agents.MyAgent(*spaces)))\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, check=True
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert type(pickle.loads(process.stdout)).__name__ == "MyAgent"


def test_actions_keep_the_dtype_of_a_discrete_space(tmp_path):
    if "dtype" not in inspect.signature(gym.spaces.Discrete).parameters:
        pytest.skip("Discrete has one type in this version of Gymnasium")
    space = gym.spaces.Discrete(3, start=1, dtype=np.int32)
    agent = RBFQLearning(PLANE, space)
    agent.save(tmp_path / "agent")
    for copied in (agent, load_agent(tmp_path / "agent"), copy.deepcopy(agent)):
        assert copied.action_space == space
        assert copied.act(np.zeros(2)).dtype == np.int32


def test_a_second_class_of_the_same_name_is_refused_except_in_main():
    refuses("RBFQLearning", type, "RBFQLearning", (SDNNQLearning,), {}, error=TypeError)
    # A notebook's cell may run twice, and a module may import the script that imports it.
    for module in ("__main__", "__main__", "script"):
        agent_class = type("DefinedAgain", (RBFQLearning,), {"__module__": module})
    assert type(pickle.loads(pickle.dumps(AGENTS["rbf"]()))) is RBFQLearning
    assert type(copy.deepcopy(agent_class(PLANE, TORQUE))) is agent_class


def test_an_unchanged_class_that_is_defined_again_replaces_the_first_but_a_changed_one_does_not(
    tmp_path,
):
    first, second = (type("MyAgent", (RBFQLearning,), {}) for _ in range(2))
    second(PLANE, TORQUE).save(tmp_path / "agent")
    assert type(first.load(tmp_path / "agent")) is second
    type("MyAgent", (RBFQLearning,), {"__annotations__": {"mass": float}})
    with pytest.raises(ValueError, match="MyAgent"):
        first.load(tmp_path / "agent")


@pytest.mark.parametrize("n_steps", [40, 60])  # within and at the end of a warm-up
@pytest.mark.parametrize(
    "name", ["sdnn", "sdnn, vector", "fuzzy", "sdnn, switches", "sdnn, warm-up"]
)
def test_a_file_without_gymnasium_spaces_is_read(name, n_steps, tmp_path):
    # C++ saves agents without Gymnasium's spaces.
    agent = run_steps(AGENTS[name](), 0, n_steps)
    agent.save(tmp_path / "python")

    def change(description, _):
        del description["observation_space"], description["action_space"]

    loaded = load_agent(write_changed(tmp_path / "python", tmp_path / "cpp", change))
    assert loaded.action_space == agent.action_space
    assert loaded.observation_space == agent.observation_space
    for resumed in (agent, loaded):
        run_steps(resumed, n_steps, 90)
    assert states_equal(agent, loaded)


def test_progress_is_read_from_the_arrays_of_the_file(tmp_path):
    # C++ writes the description of the file that it has read, with the new progress in an array.
    agent = SDNNQLearning(PLANE, TORQUE, approximator=SMALL, learning=DECREASING)
    agent.save(tmp_path / "old")

    def change(_, arrays):
        arrays["agent.progress"] = np.array(0.5)

    loaded = load_agent(write_changed(tmp_path / "old", tmp_path / "new", change))
    assert (loaded.progress, loaded.learning_rate) == (0.5, 0.6)  # half way from 1 to 0.2


@pytest.fixture(scope="module")
def saved_agent(tmp_path_factory):
    """The path of a file of an agent after 30 steps."""
    path = tmp_path_factory.mktemp("saved") / "agent.safetensors"
    run_steps(AGENTS["sdnn"](), 0, 30).save(path)
    return path


def write_changed(path, new_path, change):
    """Copy a file, with description and arrays changed by `change(description, arrays)`."""
    description, arrays = read_file(path, "agent")
    change(description, arrays)
    write_file(new_path, "agent", arrays, description)
    return new_path


@pytest.mark.parametrize(
    ("change", "field"),
    [  # d is the description of the agent, a has the arrays of its state
        (lambda d, a: d.update({"class": "Sarsa"}), "Sarsa"),
        (lambda d, a: d["learning"].update(speed=7.0), "speed"),
        (lambda d, a: d["approximator"].update(n_hidden_units=2**20), "agent.action_value.weights"),
        (
            lambda d, a: d["approximator"].update(n_symbols=[2**30, 0], max_table_bytes=2**62),
            "n_symbols",
        ),
        (lambda d, a: d["approximator"].update(n_inputs=0, max_pairs=2), "n_inputs"),
        (lambda d, a: d["observation"].update(low=[0.0]), "observation.high"),
        (lambda d, a: d["observation"].update(low=[-1.0], high=[1.0]), "observation"),
        (
            lambda d, a: d["action"].update(low=[0.0] * 2, high=[1.0] * 2),
            "agent.action_value.0.weights",
        ),
        (lambda d, a: a.pop("agent.step"), "agent.step"),
        (lambda d, a: a.update({"agent.other": np.zeros(1)}), "agent.other"),
        (lambda d, a: d.update(scaling={"ranges": [[0, 1]], "redundant": 0}), "scaling"),
        (lambda d, a: d.update(scaling={"ranges": [[0, 1], [1, 1]], "redundant": 0}), "ranges"),
    ],
)
def test_inconsistent_files_are_refused_with_the_name_of_the_field(
    saved_agent, tmp_path, change, field
):
    refuses(field, load_agent, write_changed(saved_agent, tmp_path / "changed", change))


def test_a_failed_save_keeps_the_old_file(saved_agent, tmp_path):
    agent = load_agent(saved_agent)
    path = tmp_path / "no folder" / "agent"
    refuses("agent", agent.save, path, error=FileNotFoundError)
    agent.save(tmp_path / "agent")
    before = (tmp_path / "agent").read_bytes()
    agent._observations.space = gym.spaces.Graph(PLANE, None)  # cannot be saved
    refuses("Graph", agent.save, tmp_path / "agent", error=TypeError)
    assert (tmp_path / "agent").read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["agent"]


def test_the_files_read_by_tests_in_cpp_are_up_to_date(tmp_path):
    agent_files.write(tmp_path)
    names, new_names = (
        sorted(path.relative_to(folder) for path in folder.rglob("*.*"))
        for folder in (agent_files.FOLDER, tmp_path)
    )
    assert names == new_names
    for name in names:
        stored, written = agent_files.FOLDER / name, tmp_path / name
        if name.suffix == ".json":
            assert json.loads(stored.read_text()) == json.loads(written.read_text()), name
        elif name.stem == "estimator":
            weights, new_weights = (SDNNRegressor.load(path).weights_ for path in (stored, written))
            np.testing.assert_array_equal(weights, new_weights)
        else:
            check_same_agent(load_agent(stored), load_agent(written))
