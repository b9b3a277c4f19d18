import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from sdnn.experiments import (
    EXPERIMENTS,
    ProtocolConfig,
    TrialConfig,
    case_config,
    plan_trials,
    select_experiments,
    trial_seed,
)
from sdnn.experiments.cases import AGENTS


def test_experiment_a_is_the_one_of_the_paper():
    (experiment,) = select_experiments("a")
    assert [(c.id, c.n_sensors, c.noise) for c in experiment.cases] == [
        ("s4", 4, 0.0),
        ("s6", 6, 0.0),
    ]
    assert all(case.agents == ("sdnn-c",) for case in experiment.cases)
    assert [claim.number for claim in experiment.claims] == [1, 2]


def test_rows_that_share_an_id_observe_the_same():
    seen = {}
    for experiment in EXPERIMENTS:
        for case in experiment.cases:
            assert seen.setdefault(case.id, (case.n_sensors, case.noise)) == (
                case.n_sensors,
                case.noise,
            )
            assert set(case.agents) <= {agent.id for agent in AGENTS}


def test_unknown_experiment_is_named():
    with pytest.raises(ValueError, match="got 'z'"):
        select_experiments("z")


def test_protocol_defaults_are_the_papers_and_the_cores():
    from sdnn import _core

    core = _core.ProtocolConfig()
    assert asdict(ProtocolConfig()) == {"n_learning_episodes": 15000, "test_interval": 10}
    assert core.n_learning_episodes == 15000
    assert core.test_interval == 10
    assert ProtocolConfig(n_learning_episodes=20).to_core().n_learning_episodes == 20


def test_canonical_json_is_sorted_and_does_not_depend_on_how_numbers_are_typed():
    config = TrialConfig()
    text = config.canonical_json()
    assert text == json.dumps(json.loads(text), sort_keys=True, separators=(",", ":"))
    noise_typed = [0, 0.0, -0.0, np.float64(0.0)]
    hashes = {
        replace(config, sensors=replace(config.sensors, noise=n)).config_hash for n in noise_typed
    }
    assert hashes == {config.config_hash}


def test_config_hash_sees_every_room():
    base = TrialConfig()
    others = [
        replace(base, agent="other"),
        replace(base, network=replace(base.network, n_inputs=5)),
        replace(base, learning=replace(base.learning, discount=0.8)),
        replace(base, acrobot=replace(base.acrobot, gravity=9.81)),
        replace(base, goal=replace(base.goal, scale=50.0)),
        replace(base, sensors=replace(base.sensors, noise=0.02)),
        replace(base, protocol=replace(base.protocol, test_interval=5)),
    ]
    assert len({config.config_hash for config in [base, *others]}) == 1 + len(others)
    assert len(base.config_hash) == 16


def test_case_config_fits_network_to_sensors():
    (experiment,) = select_experiments("a")
    config = case_config(experiment.cases[1], "sdnn-c")
    assert config.network.n_inputs == config.sensors.n_sensors == 6
    assert config.protocol == ProtocolConfig()
    with pytest.raises(ValueError, match="'fql'"):
        case_config(experiment.cases[1], "fql")


def test_trial_seed_follows_its_definition():
    # zlib.crc32(b"s4") == 0x647FCC7F
    sequence = np.random.SeedSequence(7, spawn_key=(0x647FCC7F, 3))
    assert trial_seed(7, "s4", 3) == int(sequence.generate_state(1, np.uint64)[0]) >> 1
    seeds = {trial_seed(r, c, t) for r in (0, 1) for c in ("s4", "s6") for t in range(10)}
    assert len(seeds) == 40
    assert max(seeds) < 2**63


def test_plan_lists_shared_trials_once_and_pairs_agents():
    (experiment,) = select_experiments("a")
    once = plan_trials(experiment.cases, 3, 0)
    assert plan_trials([*experiment.cases, *experiment.cases], 3, 0) == once
    assert [(p.key.trial, p.key.case_id) for p in once] == [
        (t, c) for t in range(3) for c in ("s4", "s6")
    ]
