"""Trials on a real cluster have the rows of a local run, whatever is lost meanwhile.

Experiment A has two cases: a plan of n trials has 2 n.
"""

import json
import random
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import pytest
from click.testing import CliRunner

import sdnn
from fake_trial import Recorder
from sdnn.cli import main
from sdnn.reproduction import EXPERIMENTS, plan_trials
from sdnn.runs import (
    AGENTS,
    AgentSpec,
    BudgetSpec,
    ClusterError,
    DaskExecutor,
    EnvironmentSpec,
    PlannedTrial,
    ResultStore,
    RunSpec,
    TrialKey,
    WorkerLostError,
    run_trials,
)
from sdnn.runs.engine import Advanced, Failed
from sdnn.runs.trial import records_digest


def make_plan(n_trials=2, n_episodes=30):
    return plan_trials(EXPERIMENTS[0].cases, n_trials, 0, n_episodes)


def run(folder, plan, cluster=None, observer=None, timeout=60.0):
    """Run a plan, on a cluster or here; returns outcome and digest."""
    executor = cluster and DaskExecutor(str(cluster.file), scheduler_timeout=timeout)
    with ResultStore(folder) as store:
        outcome = run_trials(plan, store, executor=executor, observer=observer)
        return outcome, records_digest(store.load())


def test_rows_of_a_cluster_are_those_of_a_local_run(pair, tmp_path):
    recorder, plan = Recorder(), make_plan(3)
    outcome, digest = run(tmp_path / "cluster", plan, pair, recorder)
    assert outcome.n_run == 6
    assert digest == run(tmp_path / "here", plan)[1]
    for planned in plan:
        events = [event for event in recorder.events if event[1] == planned.key]
        assert events[0] == ("advanced", planned.key, 0)
        assert events[-1] == ("finished", planned.key)
    second_outcome, _ = run(tmp_path / "cluster", plan, pair)
    assert (second_outcome.n_reused, second_outcome.n_run) == (6, 0)


def test_two_drivers_of_the_same_trials_get_the_same_rows(pair, tmp_path):
    plan, digests = make_plan(4, 500), {}

    def drive(name):
        digests[name] = run(tmp_path / name, plan, pair)[1]

    drivers = [threading.Thread(target=drive, args=(name,)) for name in ("a", "b")]
    for driver in drivers:
        driver.start()
    for driver in drivers:
        driver.join()
    assert digests["a"] == digests["b"] == run(tmp_path / "here", plan)[1]


def test_reproduce_on_a_cluster_prints_the_digest_of_a_local_run(pair, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["reproduce", "a", "--trials", "1", "--episodes", "10", "--json"]
    dask = ["--executor", "dask", "--scheduler", str(pair.file)]
    here = CliRunner().invoke(main, [*arguments, "--out", "here"])
    there = CliRunner().invoke(main, [*arguments, "--out", "there", *dask])
    assert there.exit_code == 0, there.output
    assert there.stderr == ""
    assert json.loads(there.stdout)["digest"] == json.loads(here.stdout)["digest"]


def test_trials_of_gymnasium_environments_have_the_rows_of_a_local_run(pair, tmp_path):
    env = EnvironmentSpec(id="Pendulum-v1", kwargs={"max_episode_steps": 20})
    spec = RunSpec(environment=env, budget=BudgetSpec(episodes=2))
    plan = [
        PlannedTrial(TrialKey("pendulum", "sdnn-c", trial, trial, spec.config_hash), spec)
        for trial in range(2)
    ]
    outcome, digest = run(tmp_path / "there", plan, pair)
    assert outcome.n_run == 2
    assert digest == run(tmp_path / "here", plan)[1]


def test_long_trials_report_progress_and_free_their_workers_when_interrupted(pair, tmp_path):
    plan = make_plan(1, 10_000_000)

    def run_until_the_first_progress():
        """Run the plan until a trial has done episodes; return the last number of episodes."""
        stop, n_episodes = threading.Event(), 0
        for batch in DaskExecutor(str(pair.file)).run(plan, stop):
            for message in batch:
                assert not isinstance(message, Failed)
                if isinstance(message, Advanced) and message.episode > 0:
                    n_episodes = message.episode
                    stop.set()
        return n_episodes

    assert 0 < run_until_the_first_progress() < 10_000_000
    # An interruption frees the workers: the trials would take minutes. The same ones may be wanted
    # again while a worker still gives them up.
    assert 0 < run_until_the_first_progress() < 10_000_000
    begin = time.monotonic()
    assert run(tmp_path, make_plan(1, 10), pair)[0].n_run == 2
    assert time.monotonic() - begin < 20


def test_a_failing_trial_does_not_stop_the_others(pair, tmp_path):
    plan = list(make_plan(2))
    plan[0] = PlannedTrial(plan[0].key._replace(seed=-1), plan[0].spec)  # seeds are not negative
    outcome, _ = run(tmp_path, plan, pair)
    assert outcome.n_run == 3
    (failure,) = outcome.failures
    assert failure.planned == plan[0]
    assert "seed" in str(failure.error)


def test_an_agent_unknown_to_workers_is_refused_by_name(pair, tmp_path, monkeypatch):
    entry = replace(AGENTS["sdnn-c"], id="mine", core_trial=None)
    monkeypatch.setitem(AGENTS, "mine", entry)
    plan = []
    for key, spec in ((planned.key, planned.spec) for planned in make_plan(1, 10)):
        other = spec.replace(agent=AgentSpec(name="mine", preset=spec.agent.preset))
        plan.append(PlannedTrial(key._replace(agent="mine", config_hash=other.config_hash), other))
    with pytest.raises(ClusterError, match="mine"):
        run(tmp_path, plan, pair, timeout=3.0)


UNFIT_WORKERS = {
    f"it has sdnn 0.0.9, this is sdnn {sdnn.__version__}": """
        from sdnn import _core
        _core.__version__ = "0.0.9"
    """,
    "does not give the rows of this one": """
        from sdnn.runs.trial import TrialRows
        TrialRows.digest = lambda rows: "other"
    """,
    "it cannot run these trials: ModuleNotFoundError": """
        import sys
        class Blocker:
            def find_spec(self, name, path=None, target=None):
                if name.partition(".")[0] == "sdnn":
                    raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        sys.meta_path.insert(0, Blocker())
    """,
}
"""Notes about workers, and the code that makes a worker unfit so."""


def test_workers_with_other_code_get_no_trials(cluster, tmp_path):
    for code in UNFIT_WORKERS.values():
        cluster.add_worker(code)
    recorder = Recorder()
    with pytest.raises(ClusterError, match="worker tcp://"):  # no other workers
        run(tmp_path / "out", make_plan(), cluster, recorder, timeout=8.0)
    for reason in UNFIT_WORKERS:
        assert any(reason in note for note in recorder.notes), (reason, recorder.notes)
    cluster.add_worker()  # which has the code of this process, and runs all trials
    outcome, digest = run(tmp_path / "out", make_plan(6), cluster)
    assert outcome.n_run == 12
    assert not outcome.failures
    assert digest == run(tmp_path / "here", make_plan(6))[1]


KILLED_BY_SEED = """
import os
from dataclasses import replace
from sdnn import _core
from sdnn.runs import AGENTS

class KillsItsWorker:
    def __init__(self, *, seed, **parts):
        self.trial = core_trial(seed=seed, **parts)
        self.kills = seed == {seed}
        self.calls = 0
    def __getattr__(self, name):
        return getattr(self.trial, name)
    def advance(self, n):
        self.trial.advance(n)
        self.calls += 1
        if self.kills and self.calls > 1:  # the probe calls once
            os._exit(1)

core_trial = _core.AcrobotTrial
AGENTS["sdnn-c"] = replace(AGENTS["sdnn-c"], core_trial=KillsItsWorker)
"""
"""Code of a worker that ends where it runs the trial with a seed."""


# A trial is given up after it has killed 1 worker, or 10, where all workers are lost before.
@pytest.mark.parametrize("allowed_failures", ["1", "10"])
def test_a_trial_that_kills_its_workers_does_not_stop_the_others(
    cluster, tmp_path, monkeypatch, allowed_failures
):
    cluster.kill(cluster.scheduler)
    monkeypatch.setitem(
        cluster.settings, "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", allowed_failures
    )
    cluster.start_scheduler()
    plan = make_plan(3)
    for _ in range(2):
        cluster.add_worker(KILLED_BY_SEED.format(seed=plan[1].key.seed))
    outcome, _ = run(tmp_path, plan, cluster)
    assert outcome.n_run == 5
    (failure,) = outcome.failures
    assert failure.planned.key == plan[1].key
    assert isinstance(failure.error, WorkerLostError)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_killed_or_frozen_workers_do_not_change_the_rows(cluster, tmp_path, number):
    plan = make_plan(4, 600)
    hurt_processes = []

    def hurt_a_worker():
        process = random.choice(cluster.computing())
        process.send_signal(number)
        hurt_processes.append(process)

    cluster.add_worker()
    cluster.add_worker()
    recorder = Recorder(on_finished=hurt_a_worker)  # after the second finished trial
    outcome, digest = run(tmp_path / "out", plan, cluster, recorder)
    assert hurt_processes
    assert (outcome.n_run, outcome.failures) == (8, ())
    assert digest == run(tmp_path / "here", plan)[1]


def test_a_command_continues_after_a_lost_scheduler(cluster, tmp_path):
    arguments = ["a", "--trials", "3", "--episodes", "600", "--json"]
    command = [sys.executable, "-m", "sdnn", "reproduce", *arguments]
    command += ["--out", str(tmp_path / "out"), "--executor", "dask"]
    command += ["--scheduler", str(cluster.file), "--scheduler-timeout", "60"]
    cluster.add_worker()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as driver:
        wait_for_rows(tmp_path / "out")
        cluster.kill(cluster.scheduler)
        _, message = driver.communicate(timeout=60)
    assert driver.returncode == 1
    assert "lost the scheduler" in message
    assert "the same command continues" in message
    assert "Traceback" not in message
    cluster.start_scheduler()
    cluster.add_worker()
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    here = CliRunner().invoke(main, ["reproduce", *arguments, "--out", str(tmp_path / "here")])
    assert json.loads(process.stdout)["digest"] == json.loads(here.stdout)["digest"]


def wait_for_rows(folder):
    end = time.monotonic() + 60
    while time.monotonic() < end:
        time.sleep(0.1)
        if (folder / "results.sqlite").exists():
            with ResultStore(folder) as store:
                if store.keys():
                    return
    raise AssertionError("no trial was stored")


def test_a_cluster_without_workers_is_refused_after_the_timeout(cluster, tmp_path):
    with pytest.raises(ClusterError, match="worker"):
        run(tmp_path / "out", make_plan(1), cluster, timeout=2.0)
