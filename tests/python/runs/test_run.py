"""Runs in folders: exact resuming after stops and kills, later goals, and damaged files."""

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest.mock import Mock

import gymnasium as gym
import numpy as np
import pytest

import drifting_env
from processes import python
from refusals import refuses
from run_specs import run_spec
from sdnn.agents import Callback, Training, load_agent
from sdnn.reproduction import paper_spec
from sdnn.runs import ConfigError, EnvironmentSpec, Run, RunError, RunSpec
from sdnn.runs.errors import RunTerminatedError
from sdnn.runs.store import ResultStore
from sdnn.runs.trial import TrialRows
from sdnn.support.files import lock
from stopped_training import Stop

SMALL = {
    "approximator": {"n_hidden_units": 60, "n_active_units": 20, "n_pattern_units": 20},
    "agent": {"warm_up_steps": 60},
}

CONFIG = run_spec(
    environment=EnvironmentSpec(
        id="tests/Drifting-v0", ranges={"all": (-4.0, 4.0)}, noise=0.02, redundant=1
    ),
    settings=SMALL,
    steps=400,
    seed=3,
    evaluate_every=90,
    evaluation_episodes=2,
    checkpoint_every=70,
)

WARMING_UP = run_spec(CONFIG, environment=EnvironmentSpec(id="tests/Drifting-v0"))


def contents(run):
    """Return the files and rows of a run that must not depend on interruptions."""
    names = ("checkpoint.safetensors", "agent.safetensors")
    files = {name: (run.folder / name).read_bytes() for name in names}
    return files | {"rows": run.rows()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the uninterrupted run of a configuration, which is trained at its first use."""
    folder = tmp_path_factory.mktemp("whole")
    done = []

    def _whole(config):
        run = next((run for run in done if run.spec == config), None)
        if run is None:
            run = Run.create(folder / str(len(done)), config)
            run.train()
            done.append(run)
        return run

    return _whole


def test_a_run_is_created_over_the_partial_file_of_a_killed_one(tmp_path):
    left = tmp_path / "config.json.0123456789abcdef.partial"
    left.touch()
    assert Run.create(tmp_path, CONFIG).folder == tmp_path
    assert not left.exists()
    (tmp_path / "other").mkdir()
    with open(tmp_path / "other" / left.name, "wb") as file:
        assert lock(file.fileno()), "as of a process that still writes"
        refuses("other", Run.create, tmp_path / "other", CONFIG, error=RunError)


def test_a_run_equals_the_training_of_its_configuration(whole, tmp_path):
    run = whole(CONFIG)
    env, evaluation_env = (
        CONFIG.environment.make(stream) for stream in ("sensor_noise", "evaluation_sensor_noise")
    )
    training = Training(
        CONFIG.make_agent(env),
        env,
        steps=400,
        seed=3,
        evaluate_every=90,
        evaluation_env=evaluation_env,
        evaluation_episodes=2,
    )
    rows = training.run().rows
    assert run.rows() == list(rows)
    training.agent.save(tmp_path / "agent.safetensors")
    assert (tmp_path / "agent.safetensors").read_bytes() == contents(run)["agent.safetensors"]
    assert {path.name for path in run.folder.iterdir()} == {
        ".lock", "agent.safetensors", "checkpoint.safetensors", "config.json", "results.sqlite",
    }  # fmt: skip


THREE_ENVIRONMENTS = run_spec(WARMING_UP, n_envs=3)


@pytest.mark.parametrize(
    "config", [CONFIG, WARMING_UP, THREE_ENVIRONMENTS], ids=["noise", "warm-up", "3 environments"]
)
def test_a_run_stopped_at_any_step_resumes_exactly(whole, tmp_path, config):
    expected = contents(whole(config))
    steps = sorted(random.Random(5).sample(range(1, 400), 12))
    run = Run.create(tmp_path / "run", config)
    for step in steps:  # almost always within an episode
        outcome = Run.open(run.folder).train(callbacks=[Stop(step)])
        assert (outcome.n_steps, outcome.reason) == (step, "stopped")
    assert Run.open(run.folder).train().reason == "done"
    assert contents(run) == expected


@pytest.mark.parametrize("steps", [400, 90], ids=["the first evaluation", "the last one"])
def test_sigterm_ends_an_evaluation_which_the_resumed_run_repeats(
    whole, tmp_path, monkeypatch, steps
):
    config = run_spec(WARMING_UP, steps=steps)
    expected = contents(whole(config))
    run = Run.create(tmp_path / "run", config)
    step, n_steps = drifting_env.DriftingEnv.step, 0

    def terminate_in_evaluation(env, action):
        nonlocal n_steps
        n_steps += 1
        if n_steps == 90 + 5:  # the fifth step of the evaluation after 90 steps
            os.kill(os.getpid(), signal.SIGTERM)
        return step(env, action)

    with monkeypatch.context() as patch:
        patch.setattr(drifting_env.DriftingEnv, "step", terminate_in_evaluation)
        with pytest.raises(RunTerminatedError):
            run.train()
    assert n_steps == 90 + 5
    assert Run.open(run.folder).train().reason == "done"
    assert contents(run) == expected


class FailAt(Callback):
    """Raise an error at a step, after the agent has learned and before a checkpoint."""

    def __init__(self, step):
        self._step = step

    def on_step(self, training):
        if training.n_steps == self._step:
            raise ZeroDivisionError


def test_after_an_error_in_a_callback_a_run_resumes_from_its_last_checkpoint(whole, tmp_path):
    run = Run.create(tmp_path / "run", CONFIG)
    with pytest.raises(ZeroDivisionError):
        run.train(callbacks=[FailAt(155)])
    env, evaluation_env = (CONFIG.environment.make() for _ in range(2))
    path = run.folder / "checkpoint.safetensors"
    kept = Training.load(path, env, evaluation_env=evaluation_env)
    assert kept.n_steps == 140  # a checkpoint every 70 steps, the error after 155
    run.train()
    assert contents(run) == contents(whole(CONFIG))


def test_a_run_killed_at_any_instant_resumes_exactly(whole, tmp_path):
    config = run_spec(CONFIG, steps=1500, checkpoint_every=13)
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(config.values()))
    script = Path(__file__).with_name("kill_run.py")
    n_kills, seed = 12, 8
    process = python(script, tmp_path / "run", path, str(n_kills), str(seed))
    assert process.returncode == 0, process.stderr
    n_killed, *n_steps_saved = map(int, process.stdout.split())
    assert n_killed >= n_kills - 2  # a run may end before it is killed
    assert len(set(n_steps_saved)) >= 4, "some runs came further than those before"
    assert contents(Run(tmp_path / "run", config)) == contents(whole(config))


def test_a_target_return_stops_a_run_until_a_new_goal_replaces_it(tmp_path):
    config = run_spec(CONFIG, target_return=-1e9)  # which every evaluation reaches
    run = Run.create(tmp_path / "run", config)
    outcome = run.train()
    assert (outcome.n_steps, outcome.reason) == (90, "target")  # at the first evaluation
    assert outcome.last_evaluation["step"] == 90
    again = Run.open(run.folder).train()  # as if killed right after the evaluation
    assert (again.n_steps, again.reason) == (90, "target")
    outcome = Run.open(run.folder).train(steps=200)
    assert (outcome.n_steps, outcome.reason) == (200, "done")
    reopened = Run.open(run.folder)
    assert [(goal.at_step, goal.steps) for goal in reopened.goals] == [(90, 200)]
    assert reopened.spec == config


def test_a_new_goal_is_kept_when_the_run_is_stopped_again(tmp_path):
    run = Run.create(tmp_path / "run", run_spec(CONFIG, steps=50))
    run.train()
    run.train(steps=120, callbacks=[Stop(80)])
    assert Run.open(run.folder).train().n_steps == 120
    refuses("120", run.train, steps=20, error=ConfigError)  # fewer than the 120 that are done
    refuses("episodes", run.train, steps=200, episodes=20, error=ConfigError)
    assert run.train(episodes=20).n_episodes == 20


def test_a_run_makes_training_and_evaluation_environment_once(tmp_path, monkeypatch):
    noise_streams = []
    make = EnvironmentSpec.make
    monkeypatch.setattr(
        EnvironmentSpec,
        "make",
        lambda self, *args: noise_streams.append(args[0]) or make(self, *args),
    )
    Run.create(tmp_path / "run", run_spec(CONFIG, n_envs=1)).train()
    assert sorted(noise_streams) == ["evaluation_sensor_noise", "sensor_noise"]


def test_create_refuses_folders_with_a_run_or_other_files(whole, tmp_path):
    run = whole(CONFIG)
    before = contents(run)
    with pytest.raises(RunError, match="sdnn resume"):
        Run.create(run.folder, CONFIG)
    assert contents(run) == before
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("mine")
    refuses("run", Run.create, tmp_path / "mine", CONFIG, error=RunError)
    refuses("run", Run.create, tmp_path / "mine" / "thesis.txt", CONFIG, error=RunError)


def test_a_run_with_a_missing_checkpoint_is_not_restarted(tmp_path):
    run = Run.create(tmp_path / "run", CONFIG)
    with ResultStore(run.folder):  # killed before the first checkpoint
        pass
    run.train()
    (run.folder / "checkpoint.safetensors").unlink()
    before = [path.read_bytes() for path in sorted(run.folder.iterdir())]
    refuses("checkpoint.safetensors", Run.open(run.folder).train, steps=1000, error=RunError)
    assert [path.read_bytes() for path in sorted(run.folder.iterdir())] == before


def test_a_run_that_cannot_be_resumed_remains_finished(tmp_path, monkeypatch):
    run = Run.create(tmp_path / "run", run_spec(CONFIG, steps=50))
    run.train()
    refuses("steps", run.train, steps=20, error=ConfigError)
    monkeypatch.delitem(gym.registry, "tests/Drifting-v0")
    refuses("environment.id", Run.open(run.folder).train, steps=100, error=ConfigError)
    with ResultStore(run.folder, read_only=True) as store:
        assert store.keys() == {run.key}


def test_the_time_of_a_run_is_the_sum_over_its_parts(tmp_path):
    run = Run.create(tmp_path / "run", CONFIG)
    parts = []
    for step in (150, 300, 400):
        before = time.thread_time()
        run.train(callbacks=[Stop(step)])
        parts.append(time.thread_time() - before)
    with ResultStore(run.folder, read_only=True) as store:
        (record,) = store.load()
    # The stored time omits that of starting each part.
    assert max(parts) < record.seconds < sum(parts)


def test_runs_refuse_episodes_without_seeds(tmp_path):
    refuses("seeded_episodes", Run.create, tmp_path / "run", paper_spec(), error=ConfigError)
    assert not (tmp_path / "run").exists()


def test_a_run_that_another_process_trains_is_refused(tmp_path, monkeypatch):
    run = Run.create(tmp_path / "run", CONFIG)
    code = f"from sdnn.runs import Run; Run.open({str(run.folder)!r}).train(steps=20)"
    with run._locked():
        refuses("process", run.train, error=RunError)
        other = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert b"RunError" in other.stderr
    assert b"process" in other.stderr
    assert not run.rows()
    assert run.train(steps=20).n_steps == 20 < CONFIG.output.checkpoint_every
    # Some file systems of networks have no locks.
    no_locks = Mock(side_effect=OSError(errno.ENOLCK, "No locks available"))
    monkeypatch.setattr("filelock.lock_descriptor", no_locks)
    assert run.train(steps=40).n_steps == 40


def test_a_run_loads_its_agent_and_evaluates_it_reproducibly(whole):
    run = whole(CONFIG)
    np.testing.assert_array_equal(
        run.agent().q_values([0.5, 0.5, 0.5]),
        load_agent(run.folder / "agent.safetensors").q_values([0.5, 0.5, 0.5]),
    )
    evaluation = run.evaluate(3)
    assert np.array_equal(run.evaluate(3).returns, evaluation.returns)
    assert not np.array_equal(run.evaluate(3, seed=1).returns, evaluation.returns)
    assert len(run.evaluate(2, seed=CONFIG.seed).returns) == 2


def test_missing_and_damaged_files_of_a_run_are_refused_by_name(whole, tmp_path):
    refuses("run", Run.open, tmp_path, error=RunError)
    run = Run.create(tmp_path / "run", CONFIG)
    refuses("checkpoint", run.agent, error=RunError)
    run.train(steps=100)
    path = run.folder / "results.sqlite"
    kept = path.read_bytes()
    with ResultStore(run.folder) as store:  # which keeps only two of the rows
        store.extend(run.key, TrialRows.from_training([]), 2, config="{}", version="0.1")
    refuses("results.sqlite", run.train, steps=200, error=RunError)
    path.write_bytes(b"cake\n" + kept)
    for use in (run.rows, run.train):
        refuses("results.sqlite", use, error=RunError)
    path.write_bytes(kept)
    (run.folder / "checkpoint.safetensors").write_bytes(b"cake")
    refuses("checkpoint.safetensors", run.agent, error=RunError)
    refuses("checkpoint.safetensors", run.train, error=RunError)
    config = run.folder / "config.json"
    values = json.loads(config.read_text())
    for goal in ({"at_step": "x", "steps": 9}, {"at_step": 1}, {"at_step": 1, "steps": -5}, 7):
        config.write_text(json.dumps({**values, "goals": [goal]}))
        with pytest.raises(ConfigError, match=r"config\.json: goals"):
            Run.open(run.folder)
    config.write_text(json.dumps(values, indent=2))
    config.write_text(config.read_text().replace('"steps": 400', '"steps": "many"', 1))
    with pytest.raises(ConfigError, match=r"config\.json: budget\.steps"):
        Run.open(run.folder)


def test_rows_are_readable_before_the_first_checkpoint(tmp_path, whole, monkeypatch):
    monkeypatch.setattr("sdnn.runs.run.STORE_SECONDS", -1.0)  # to store each row at once
    run = Run.create(tmp_path / "run", CONFIG)
    rows_before = []

    class Watch(Callback):
        def on_step(self, training):
            if training.n_steps == CONFIG.output.checkpoint_every - 1:
                rows_before.extend(run.rows())
                assert not (run.folder / "checkpoint.safetensors").exists()

    run.train(callbacks=[Watch()])
    assert rows_before
    assert rows_before == run.rows()[: len(rows_before)]
    assert contents(run) == contents(whole(CONFIG))


def test_a_resumed_run_keeps_the_statistics_of_wrappers(tmp_path):
    def normalized_cart_pole():
        return gym.wrappers.NormalizeObservation(gym.make("CartPole-v1").unwrapped)

    gym.register("tests/Normalized-v0", entry_point=normalized_cart_pole, max_episode_steps=60)
    spec = RunSpec.from_values(
        {
            "environment": "tests/Normalized-v0",
            "budget": {"steps": 200},
            "protocol": {"evaluate_every": 100, "evaluation_episodes": 1},
            "agent": {"warm_up_steps": 50},
        }
    )
    cut, whole = (Run.create(tmp_path / name, spec) for name in ("cut", "whole"))
    cut.train(callbacks=[Stop(117)])
    cut.train()
    whole.train()
    assert cut.rows() == whole.rows()
    assert np.array_equal(cut.evaluate(2).returns, whole.evaluate(2).returns)  # without a warning
