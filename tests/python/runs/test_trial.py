"""Trials in Python and in C++, and the registry of agents."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from refusals import refuses
from sdnn import _core
from sdnn.agents.registry import labels, title_of
from sdnn.reproduction import Case, case_spec
from sdnn.runs import (
    AGENTS,
    AgentEntry,
    BudgetSpec,
    EnvironmentSpec,
    ProtocolSpec,
    RunSpec,
    agent_entry,
    register,
)
from sdnn.runs.trial import TrainingTrial, TrialRows

SEED = 11


def spec_of(agent, n_sensors=4, noise=0.0):
    """Return a specification of 60 episodes on the paper's acrobot, evaluated every 5."""
    spec = case_spec(Case("case", "", n_sensors, noise, (agent,), ""), agent, 60)
    return spec.replace(seed=SEED, protocol=spec.protocol.replace(evaluate_every_episodes=5))


COLUMNS = ("episode", "steps", "episode_return", "solved")


def columns(trial):
    """Return the rows of a trial in Python in the form of the compiled trial's `test_rows`."""
    return {name: getattr(trial.rows(), name) for name in COLUMNS}


def python_trial(spec, monkeypatch):
    """Make a trial in Python, which also runs the agents that have no compiled trial."""
    entry = replace(AGENTS[spec.agent.name], core_trial=None)
    monkeypatch.setitem(AGENTS, spec.agent.name, entry)
    trial = spec.make_trial(SEED)
    assert type(trial) is TrainingTrial
    return trial


# The compiled trial of actor-critic has no running ranges, which the agent in Python has.
EQUAL_AGENTS = [label for label in labels() if not label.startswith("actor-critic")]


@pytest.mark.parametrize("agent", EQUAL_AGENTS)
@pytest.mark.parametrize(("n_sensors", "noise"), [(4, 0.0), (4, 0.02), (5, 0.02), (6, 0.02)])
def test_a_trial_in_python_has_the_bits_of_the_compiled_trial(agent, n_sensors, noise, monkeypatch):
    spec = spec_of(agent, n_sensors, noise)
    core = spec.make_trial(SEED)
    assert type(core).__module__ == _core.__name__
    core.advance(60)
    trial = python_trial(spec, monkeypatch)
    for n_episodes in (0, 7, 1, 100):  # more than the 60 of its budget
        trial.advance(n_episodes)
    assert trial.finished
    assert core.finished
    assert trial.episode == core.episode == 60
    assert trial.n_decisions == core.n_decisions
    expected, rows = core.test_rows(), columns(trial)
    assert rows.keys() == expected.keys()
    for name, column in expected.items():
        assert rows[name].dtype == column.dtype
        np.testing.assert_array_equal(rows[name], column)
    assert TrialRows.of_tests(**rows).digest() == TrialRows.of_tests(**expected).digest()


def test_a_trial_in_python_uses_all_settings_of_task_and_protocol(monkeypatch):
    spec = spec_of("fuzzy")
    kwargs = {
        "acrobot": {"max_decisions": 3, "penalty": -1.0},
        "goal": {"kind": "constant", "constant_value": 0.1},
        "sensors": {
            "noise": 0.02, "noise_entry": "basic_sensors", "n_constant": 1, "n_random": 1
        },
    }  # fmt: skip
    spec = spec.replace(
        environment=spec.environment.replace(kwargs=kwargs),
        protocol=spec.protocol.replace(limit_bootstraps=False, noisy_evaluations=False),
    )
    core, trial = spec.make_trial(SEED), python_trial(spec, monkeypatch)
    core.advance(20)
    trial.advance(20)
    np.testing.assert_array_equal(
        columns(trial)["episode_return"], core.test_rows()["episode_return"]
    )
    assert columns(trial)["steps"].max() == 3, "max_decisions"


def test_a_trial_has_no_rows_before_its_first_evaluation(monkeypatch):
    trial = python_trial(spec_of("fuzzy"), monkeypatch)
    trial.advance(4)  # an evaluation comes every 5 episodes
    assert [column.size for column in columns(trial).values()] == [0] * len(COLUMNS)


def test_a_negative_number_of_episodes_is_refused(monkeypatch):
    spec = spec_of("rbf")
    for trial in (spec.make_trial(SEED), python_trial(spec, monkeypatch)):
        refuses("n_episodes", trial.advance, -1)


@dataclass(frozen=True)
class NoSettings:
    n_inputs: int = 4


def entry_of(agent_id):
    """Return the entry of an agent without settings, which cannot be made."""
    settings = {"approximator": NoSettings, "learning": NoSettings}
    return AgentEntry(id=agent_id, title="", agent=object, **settings)


def test_computing_action_values_does_not_change_the_rows_of_a_trial():
    n_torques = 601  # of the paper
    queried, undisturbed = (spec_of("sdnn-c", noise=0.02).make_trial(SEED) for _ in range(2))
    for _ in range(60):
        queried.advance(1)
        values = queried.agent.networks[0].values([0.5, 0.5, 0.5, 0.5])
        assert values.shape == (n_torques,)
    undisturbed.advance(60)
    for name, column in undisturbed.test_rows().items():
        np.testing.assert_array_equal(queried.test_rows()[name], column)


def test_duplicate_and_invalid_ids_are_not_registered():
    before = dict(AGENTS)
    refuses("fuzzy", register, entry_of("fuzzy"))
    refuses("id", register, entry_of("../x"))
    assert before == AGENTS


def test_agents_and_their_presets_have_labels_and_titles():
    expected_labels = ["sdnn-c", "fuzzy", "rbf", "q-lambda", "actor-critic"]
    expected_labels += ["sdnn-c-general", "sdnn-c-robust"]
    expected_labels += ["sdnn-c-small", "q-lambda-general", "actor-critic-general"]
    assert list(labels()) == expected_labels
    assert [title_of(label) for label in expected_labels] == [
        "SDNN-C", "FQL", "RBFN", "SDNNQLambda", "SDNNActorCritic", "SDNN-C, general",
        "SDNN-C, robust", "SDNN-C, small", "SDNNQLambda, general", "SDNNActorCritic, general",
    ]  # fmt: skip


def test_the_entry_of_a_preset_is_its_agents_and_unknown_agents_are_refused():
    assert all(agent_entry(name) is entry for name, entry in AGENTS.items())
    assert agent_entry("sdnn-c-small") is AGENTS["sdnn-c"]
    refuses("dqn", agent_entry, "dqn")


def test_a_registered_dataclass_configures_its_agent_by_default_and_is_hashed(monkeypatch):
    monkeypatch.setitem(AGENTS, "new", entry_of("new"))
    spec = spec_of("new", 5)
    assert spec.approximator == NoSettings()
    assert '"name":"new"' in spec.canonical_json(), "the text that is hashed"
    assert len(spec.config_hash) == 16


CAR = EnvironmentSpec(id="MountainCar-v0", kwargs={"max_episode_steps": 30}, noise=0.01)


def finished_trial(protocol, budget):
    """Run a trial of MountainCar with episodes of 30 steps to its end, which may be early."""
    trial = RunSpec(environment=CAR, protocol=protocol, budget=budget).make_trial(SEED)
    for _ in trial.training.pieces(0.0):
        pass
    assert trial.finished
    return trial


@pytest.mark.parametrize(
    ("protocol", "budget", "episodes"),
    [
        # Evaluated after 40 and 80 steps: one and two episodes of 30 steps are finished then.
        (ProtocolSpec(evaluate_every=40, evaluation_episodes=3), BudgetSpec(steps=90), [1, 2]),
        (ProtocolSpec(evaluate_every_episodes=2), BudgetSpec(episodes=4), [2, 4]),
        (ProtocolSpec(evaluate_every=0, n_envs=2), BudgetSpec(steps=90), []),
    ],
    ids=["steps", "episodes", "no evaluation"],
)
def test_a_trial_of_a_gymnasium_environment_is_evaluated_by_its_protocol(
    protocol, budget, episodes
):
    trial = finished_trial(protocol, budget)
    assert (trial.reason, trial.done) == ("done", budget.steps or budget.episodes)
    assert trial.rows().episode.tolist() == episodes
    trial.close()


def test_a_trial_ends_at_the_first_evaluation_that_reaches_the_target_return():
    budget = BudgetSpec(steps=500, target_return=-1000.0)  # below every return of 30 steps
    trial = finished_trial(ProtocolSpec(evaluate_every=40), budget)
    assert (trial.reason, trial.done) == ("target", 40)
