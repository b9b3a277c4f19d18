"""The paper's experiments and cases, and the configurations and seeds of their trials."""

import json
import zlib
from dataclasses import replace

import numpy as np

from refusals import refuses
from sdnn.reproduction import EXPERIMENTS, case_spec, paper_spec, plan_trials, select_experiments
from sdnn.runs import AGENTS, ProtocolSpec, trial_seed


def test_experiment_a_has_the_cases_of_the_paper():
    (experiment,) = select_experiments("a")
    assert [(c.id, c.n_sensors, c.noise) for c in experiment.cases] == [
        ("s4", 4, 0.0),
        ("s6", 6, 0.0),
    ]
    assert all(case.agents == ("sdnn-c",) for case in experiment.cases)


def test_experiment_b_has_the_cases_of_the_paper():
    (experiment,) = select_experiments("b")
    assert [(c.id, c.n_sensors, c.noise, c.paper_figure) for c in experiment.cases] == [
        ("s4", 4, 0.0, "Fig. 5"),
        ("s4-noise", 4, 0.02, "Fig. 6a"),
        ("s5-noise", 5, 0.02, "Fig. 6b"),
        ("s6-noise", 6, 0.02, "Fig. 6c"),
    ]
    assert all(case.agents == ("sdnn-c", "fuzzy") for case in experiment.cases)
    assert [e.id for e in select_experiments("all")] == ["a", "b"]
    assert select_experiments("cost") == ()


def test_the_paper_has_ninety_trials():
    cases = [case for experiment in EXPERIMENTS for case in experiment.cases]
    plan = plan_trials(cases, n_trials=10, root_seed=0)
    # 20 of Experiment A and 80 of Experiment B, which share the 10 of SDNN-C in Case I.
    assert len(plan) == 20 + 80 - 10


def test_agents_of_a_case_have_the_same_seeds():
    (experiment,) = select_experiments("b")
    seeds = {}
    for planned in plan_trials(experiment.cases, n_trials=3, root_seed=0):
        seeds.setdefault((planned.key.case_id, planned.key.trial), set()).add(planned.key.seed)
    assert {len(seeds_of_agents) for seeds_of_agents in seeds.values()} == {1}


def test_cases_with_the_same_id_have_the_same_sensors():
    sensors = {}
    for experiment in EXPERIMENTS:
        for case in experiment.cases:
            of_case = case.n_sensors, case.noise
            assert sensors.setdefault(case.id, of_case) == of_case
            assert set(case.agents) <= set(AGENTS)


def test_presets_are_added_to_the_agents_of_a_case():
    with_presets = EXPERIMENTS[0].with_agents([], ["robust", "paper", "robust"])
    # The preset "paper" is the agent of the case, and a preset named twice is added once.
    assert [case.agents for case in with_presets.cases] == 2 * [("sdnn-c", "sdnn-c-robust")]


def test_the_canonical_json_is_sorted_and_the_same_for_equal_numbers():
    config = paper_spec()
    text = config.canonical_json()
    assert text == json.dumps(json.loads(text), sort_keys=True, separators=(",", ":"))
    zeros = [0, 0.0, -0.0, np.float64(0.0)]
    tables = [{"kwargs": {"sensors": {"noise": zero}}} for zero in zeros]
    hashes = {paper_spec(environment=table).config_hash for table in tables}
    assert hashes == {config.config_hash}


def test_the_version_of_an_agent_changes_the_hash(monkeypatch):
    config = paper_spec()
    before = config.config_hash
    monkeypatch.setitem(AGENTS, "sdnn-c", replace(AGENTS["sdnn-c"], version="2"))
    assert '"version":"2"' in config.canonical_json()
    assert config.config_hash != before


def test_the_hash_depends_on_every_table_of_settings():
    base = paper_spec()
    others = [
        paper_spec(agent={"name": "rbf"}),
        base.replace(approximator=replace(base.approximator, lattice=2)),
        base.replace(learning=replace(base.learning, discount=0.8)),
        paper_spec(environment={"kwargs": {"acrobot": {"gravity": 9.81}}}),
        paper_spec(environment={"kwargs": {"goal": {"scale": 50.0}}}),
        paper_spec(environment={"kwargs": {"sensors": {"noise": 0.02}}}),
        base.replace(protocol=ProtocolSpec(evaluate_every_episodes=5)),
    ]
    assert len({spec.config_hash for spec in [base, *others]}) == 1 + len(others)
    assert len(base.config_hash) == 16


def test_a_case_has_one_network_input_per_sensor():
    (experiment,) = select_experiments("a")
    case = experiment.cases[1]
    spec = case_spec(case, "sdnn-c")
    assert spec.core_settings()["approximator"].n_inputs == case.n_sensors == 6
    assert (spec.budget.episodes, spec.protocol.evaluate_every_episodes) == (15_000, 10)
    refuses("'fuzzy'", case_spec, case, "fuzzy")


def test_with_agents_replaces_only_the_agents():
    (experiment,) = select_experiments("b")
    other = experiment.with_agents(["rbf", "sdnn-c", "rbf"])
    assert {case.agents for case in other.cases} == {("rbf", "sdnn-c")}
    with_agents_of_paper = [replace(case, agents=("sdnn-c", "fuzzy")) for case in other.cases]
    assert with_agents_of_paper == list(experiment.cases)
    assert ("s4", "rbf") in other.pairs
    assert experiment.with_agents([]) == experiment


def test_the_seed_of_a_trial_is_a_hash_of_root_seed_case_and_number():
    sequence = np.random.SeedSequence(7, spawn_key=(zlib.crc32(b"s4"), 3))
    assert trial_seed(7, "s4", 3) == int(sequence.generate_state(1, np.uint64)[0]) >> 1
    seeds = {trial_seed(r, c, t) for r in (0, 1) for c in ("s4", "s6") for t in range(10)}
    assert len(seeds) == 2 * 2 * 10
    assert max(seeds) < 2**63, "SQLite stores signed integers"


def test_a_plan_lists_shared_trials_once_and_in_order():
    (experiment,) = select_experiments("a")
    plan = plan_trials(experiment.cases, n_trials=3, root_seed=0)
    assert plan_trials([*experiment.cases, *experiment.cases], n_trials=3, root_seed=0) == plan
    expected_order = [(trial, case_id) for trial in range(3) for case_id in ("s4", "s6")]
    assert [(planned.key.trial, planned.key.case_id) for planned in plan] == expected_order
