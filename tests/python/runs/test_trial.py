"""Trainings against the compiled trials, and the registry that chooses between them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from sdnn import _core
from sdnn.agents import PRESETS
from sdnn.reproduction import (
    AGENTS,
    AgentEntry,
    Case,
    CostSeries,
    ProtocolConfig,
    agent_entry,
    case_config,
    register,
)
from sdnn.runs import AgentSpec, BudgetSpec, EnvironmentSpec, ProtocolSpec, RunSpec
from sdnn.runs.records import TrialRows
from sdnn.runs.trial import TrainingTrial, training_trial

PROTOCOL = ProtocolConfig(n_learning_episodes=60, test_interval=5)
SEED = 11


def config_of(agent, n_sensors=4, noise=0.0, protocol=PROTOCOL):
    return case_config(Case("case", "", n_sensors, noise, (agent,), ""), agent, protocol)


def python_trial(config, monkeypatch):
    """The trial the same agent has when it has none in C++."""
    entry = replace(AGENTS[config.agent], core_trial=None)
    monkeypatch.setitem(AGENTS, config.agent, entry)
    trial = config.make_trial(SEED)
    assert type(trial) is TrainingTrial
    return trial


@pytest.mark.parametrize(
    "agent", ["sdnn-c", "sdnn-c-robust", "sdnn-c-general", "sdnn-c-small", "fuzzy", "rbf"]
)
@pytest.mark.parametrize(("n_sensors", "noise"), [(4, 0.0), (4, 0.02), (5, 0.02), (6, 0.02)])
def test_it_reproduces_the_compiled_trial_bit_for_bit(agent, n_sensors, noise, monkeypatch):
    config = config_of(agent, n_sensors, noise)
    core = config.make_trial(SEED)
    assert type(core).__module__ == _core.__name__
    core.advance(60)
    trial = python_trial(config, monkeypatch)
    for n_episodes in (0, 7, 1, 100):
        trial.advance(n_episodes)
    assert trial.finished
    assert core.finished
    assert trial.episode == core.episode == 60
    assert trial.n_decisions == core.n_decisions
    expected, rows = core.test_rows(), trial.test_rows()
    assert rows.keys() == expected.keys()
    for name, column in expected.items():
        assert rows[name].dtype == column.dtype
        np.testing.assert_array_equal(rows[name], column)
    assert TrialRows.of_tests(**rows).digest() == TrialRows.of_tests(**expected).digest()


def test_the_settings_of_the_task_reach_it(monkeypatch):
    config = config_of("fuzzy")
    config = replace(
        config,
        approximator=replace(config.approximator, n_inputs=6),
        acrobot=replace(config.acrobot, max_decisions=3, penalty=-1.0),
        goal=replace(config.goal, kind="constant", constant_value=0.1),
        sensors=replace(
            config.sensors, noise=0.02, noise_entry="basic_sensors", n_constant=1, n_random=1
        ),
        protocol=replace(config.protocol, limit_bootstraps=False, noisy_tests=False),
    )
    core, trial = config.make_trial(SEED), python_trial(config, monkeypatch)
    core.advance(20)
    trial.advance(20)
    np.testing.assert_array_equal(
        trial.test_rows()["episode_return"], core.test_rows()["episode_return"]
    )
    assert trial.test_rows()["steps"].max() == 3


def test_before_its_first_test_it_has_no_rows(monkeypatch):
    trial = python_trial(config_of("fuzzy"), monkeypatch)
    trial.advance(4)
    assert {name: column.size for name, column in trial.test_rows().items()} == {
        "episode": 0, "steps": 0, "episode_return": 0, "solved": 0,
    }  # fmt: skip


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"protocol": {"n_learning_episodes": 0}}, "n_learning_episodes"),
        ({"protocol": {"test_interval": 0}}, "test_interval"),
        ({"sensors": {"n_sensors": 5}}, "n_inputs must be the number of inputs of the sensors, 5"),
        ({"sensors": {"n_sensors": 7}, "approximator": {"n_inputs": 7}}, "n_sensors"),
        ({"sensors": {"n_sensors": 3}, "approximator": {"n_inputs": 3}}, "n_sensors"),
    ],
)
def test_both_refuse_the_same(compiled, change, message, monkeypatch):
    def make():
        config = config_of("rbf")
        for name, values in change.items():
            config = replace(config, **{name: replace(getattr(config, name), **values)})
        return config.make_trial(SEED) if compiled else python_trial(config, monkeypatch)

    with pytest.raises(ValueError, match=message):
        make()


def test_episodes_cannot_be_taken_back(monkeypatch):
    config = config_of("rbf")
    for trial in (config.make_trial(SEED), python_trial(config, monkeypatch)):
        with pytest.raises(ValueError, match="n_episodes"):
            trial.advance(-1)


@dataclass(frozen=True)
class Nothing:
    n_inputs: int = 4


def entry_of(agent_id, *series):
    costs = tuple(
        CostSeries(id=name, title=name, growth="", learned_bytes=lambda _: 0) for name in series
    )
    return AgentEntry(
        id=agent_id, title="", approximator=Nothing, learning=Nothing, agent=object, costs=costs
    )


def test_an_agent_may_have_other_settings_than_the_defaults():
    config = config_of("sdnn-c-robust", n_sensors=5)
    assert config.approximator == replace(PRESETS["robust"].approximator, n_inputs=5)
    assert config.learning == PRESETS["robust"].learning
    assert config_of("sdnn-c").learning == PRESETS["paper"].learning


def test_asking_a_trials_agent_for_values_changes_nothing_that_follows():
    asked, alone = (config_of("sdnn-c", noise=0.02).make_trial(SEED) for _ in range(2))
    for _ in range(60):
        asked.advance(1)
        values = asked.agent.action_value.values([0.5, 0.5, 0.5, 0.5])
        assert values.shape == (601,)
    alone.advance(60)
    for name, column in alone.test_rows().items():
        np.testing.assert_array_equal(asked.test_rows()[name], column)


def test_ids_are_registered_once():
    before = dict(AGENTS)
    with pytest.raises(ValueError, match="agent 'fuzzy' is already registered"):
        register(entry_of("fuzzy"))
    with pytest.raises(ValueError, match="series 'rbf-plain' is already registered"):
        register(entry_of("new", "rbf-plain"))
    with pytest.raises(ValueError, match="series 'twice' is already registered"):
        register(entry_of("new", "twice", "twice"))
    with pytest.raises(ValueError, match=r"id must be of letters.*got '\.\./x'"):
        register(entry_of("../x"))
    assert before == AGENTS


def test_agents_are_looked_up_by_id():
    assert [(entry.id, entry.title) for entry in AGENTS.values()] == [
        ("sdnn-c", "SDNN-C"), ("fuzzy", "FQL"), ("rbf", "RBFN"),
        ("sdnn-c-robust", "SDNN-C, robust"), ("sdnn-c-general", "SDNN-C, general"),
        ("sdnn-c-small", "SDNN-C, small"),
    ]  # fmt: skip
    assert all(agent_entry(name) is entry for name, entry in AGENTS.items())
    with pytest.raises(
        ValueError,
        match="one of sdnn-c, fuzzy, rbf, sdnn-c-robust, sdnn-c-general, sdnn-c-small, got 'dqn'",
    ):
        agent_entry("dqn")


def test_a_registered_dataclass_is_the_configuration_of_its_agent(monkeypatch):
    monkeypatch.setitem(AGENTS, "new", entry_of("new"))
    config = config_of("new", 5)
    assert config.approximator == Nothing(5)
    assert '"approximator":{"n_inputs":5}' in config.canonical_json()
    assert len(config.config_hash) == 16


@pytest.mark.parametrize(
    ("agent", "n_sensors", "noise", "config_hash"),
    [
        ("sdnn-c", 4, 0.0, "85d5574d89e10639"),
        ("sdnn-c", 6, 0.02, "68edb7948699371d"),
        ("fuzzy", 4, 0.0, "57c01f4510ad5d6d"),
        ("rbf", 4, 0.0, "ba6f9e3e4eab77dd"),
    ],
)
def test_the_papers_settings_have_the_hashes_under_which_results_are_stored(
    agent, n_sensors, noise, config_hash
):
    assert config_of(agent, n_sensors, noise, None).config_hash == config_hash


def spec_of(agent="sdnn-c", **changes):
    given = {
        "agent": AgentSpec(name=agent),
        "protocol": ProtocolSpec(evaluate_every_episodes=5),
        "budget": BudgetSpec(episodes=60),
    }
    return RunSpec(**given | changes)


@pytest.mark.parametrize(
    "spec",
    [
        *map(spec_of, ("sdnn-c", "rbf", "fuzzy")),
        spec_of(
            agent="fuzzy",
            acrobot={"max_decisions": 3, "penalty": -1.0},
            sensors={"n_sensors": 5, "noise": 0.02},
            protocol=ProtocolSpec(
                evaluate_every_episodes=5, limit_bootstraps=False, noisy_evaluations=False
            ),
        ),
    ],
)
def test_both_trials_of_a_specification_have_the_same_rows(spec):
    core, trial = spec.make_trial(SEED), training_trial(spec.replace(seed=SEED))
    assert (type(core).__module__, spec.length) == (_core.__name__, 60)
    core.advance(60)
    trial.advance(60)
    assert trial.n_decisions == core.n_decisions
    assert trial.rows().digest() == TrialRows.of_tests(**core.test_rows()).digest()
    trial.close()


def test_a_specification_that_cpp_does_not_know_is_a_training():
    environment = EnvironmentSpec(id="MountainCar-v0", kwargs={"max_episode_steps": 30}, noise=0.01)
    for protocol, budget, expected in (
        (ProtocolSpec(evaluate_every=40, evaluation_episodes=3), BudgetSpec(steps=90), [1, 2]),
        (ProtocolSpec(evaluate_every_episodes=2), BudgetSpec(episodes=4), [2, 4]),
        (ProtocolSpec(evaluate_every=0, n_envs=2), BudgetSpec(steps=90), []),
    ):
        spec = RunSpec(environment=environment, protocol=protocol, budget=budget)
        trial = spec.make_trial(SEED)
        for _ in trial.pieces(0.0):
            pass
        assert (trial.finished, trial.reason, trial.done) == (True, "done", spec.length)
        assert trial.rows().episode.tolist() == expected
        trial.close()
    target = BudgetSpec(steps=500, target_return=-1000.0)
    trial = RunSpec(
        environment=environment, protocol=ProtocolSpec(evaluate_every=40), budget=target
    ).make_trial(SEED)
    for _ in trial.pieces(0.0):
        pass
    assert (trial.finished, trial.reason, trial.done) == (True, "target", 40)
