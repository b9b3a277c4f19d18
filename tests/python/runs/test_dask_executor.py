import copy
import importlib.util
import json
import os
import socket
import sys
import textwrap
import threading
import time
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

import sdnn
from sdnn.approximators import SDNNCConfig
from sdnn.cli import main
from sdnn.config import ProtocolConfig
from sdnn.progress import ProgressBars
from sdnn.reproduction import plan_trials
from sdnn.reproduction.cases import EXPERIMENTS
from sdnn.runs import (
    AGENTS,
    ClusterError,
    DaskExecutor,
    EnvironmentConfig,
    EnvironmentTrialConfig,
    Observer,
    PlannedTrial,
    ResultStore,
    TrialKey,
    WorkerLostError,
    run_trials,
)
from sdnn.runs.dask_worker import probe
from sdnn.runs.records import records_digest

pytest.importorskip("distributed", reason='needs Dask: pip install "sdnn[dask]"')

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def harness():
    """The module of the cluster, which is also the script that kills its parts."""
    spec = importlib.util.spec_from_file_location("kill_cluster", HERE / "kill_cluster.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["kill_cluster"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pair(harness, tmp_path_factory):
    """A scheduler with two workers, which no test hurts."""
    with harness.Cluster(tmp_path_factory.mktemp("pair")) as cluster:
        cluster.start_scheduler()
        cluster.add_worker("--no-nanny")
        cluster.add_worker("--no-nanny")
        yield cluster


@pytest.fixture
def cluster(harness, tmp_path):
    """A scheduler without workers."""
    folder = tmp_path / "cluster"
    folder.mkdir()
    with harness.Cluster(folder) as cluster:
        cluster.start_scheduler()
        yield cluster


@pytest.fixture
def preload(tmp_path):
    """Options of a worker that runs some Python when it starts."""

    def _preload(code):
        path = tmp_path / f"preload_{len(list(tmp_path.iterdir()))}.py"
        path.write_text(textwrap.dedent(code))
        return ("--no-nanny", "--preload", str(path))

    return _preload


class Recorder(Observer):
    def __init__(self):
        self.notes = []
        self.events = []
        self.threads = set()

    def noted(self, text):
        self.notes.append(text)

    def started(self, planned):
        self._hear("started", planned)

    def advanced(self, planned, episode):
        self._hear("advanced", planned, episode)

    def lost(self, planned):
        self._hear("lost", planned)

    def finished(self, planned):
        self._hear("finished", planned)

    def failed(self, planned, error):
        self._hear("failed", planned)

    def _hear(self, *event):
        self.threads.add(threading.get_ident())
        self.events.append(event)


def make_plan(n_trials=2, n_episodes=30):
    protocol = ProtocolConfig(n_learning_episodes=n_episodes)
    return plan_trials(EXPERIMENTS[0].cases, n_trials, 0, protocol)


def run(folder, plan, cluster=None, observer=None, **options):
    """Run a plan, on a cluster or here; returns outcome and digest."""
    executor = None
    if cluster is not None:
        executor = DaskExecutor(str(cluster.file), **{"scheduler_timeout": 60.0} | options)
    with ResultStore(folder) as store:
        outcome = run_trials(plan, store, executor=executor, observer=observer)
        return outcome, records_digest(store.load())


def test_rows_are_those_of_a_local_run(pair, tmp_path):
    recorder = Recorder()
    plan = make_plan(3)
    outcome, digest = run(tmp_path / "cluster", plan, pair, recorder)
    assert outcome.n_run == 6
    assert digest == run(tmp_path / "here", plan)[1]
    assert recorder.threads == {threading.get_ident()}
    for planned in plan:
        mine = [event for event in recorder.events if event[1] is planned]
        assert mine[0][0] == "started"
        assert mine[-2:] == [("advanced", planned, 30), ("finished", planned)]
    again, _ = run(tmp_path / "cluster", plan, pair)
    assert (again.n_reused, again.n_run) == (6, 0)


def with_agent(planned, agent):
    config = replace(planned.config, agent=agent)
    return PlannedTrial(planned.key._replace(agent=agent, config_hash=config.config_hash), config)


@pytest.fixture
def python_agent(monkeypatch):
    """An agent that is registered here only, and runs in Python."""
    entry = replace(AGENTS["sdnn-c"], id="mine", core_trial=None, costs=())
    monkeypatch.setitem(AGENTS, "mine", entry)


def test_an_agent_that_workers_do_not_know_is_named(pair, tmp_path, monkeypatch, python_agent):
    monkeypatch.setattr("sdnn.runs.dask_executor.REFUSAL_SECONDS", 0.5)
    plan = [with_agent(planned, "mine") for planned in make_plan(1, 10)]
    with pytest.raises(ClusterError, match="cannot run these trials: ValueError: agent must be"):
        run(tmp_path, plan, pair)


def test_a_probe_tells_bits_of_trials_in_cpp_only(python_agent):
    first, second = make_plan(1)
    assert probe(first) == probe(first) != probe(second)
    assert probe(first).startswith(first.config.canonical_json())
    mine = with_agent(first, "mine")
    assert probe(mine) == mine.config.canonical_json()


def test_the_command_prints_the_same_table(pair, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["reproduce", "a", "--trials", "1", "--episodes", "10", "--json"]

    def invoke(*options):
        return CliRunner().invoke(main, [*arguments, *options], catch_exceptions=False)

    here = invoke("--out", "here")
    there = invoke("--out", "there", "--executor", "dask", "--scheduler", str(pair.file))
    assert there.exit_code == 0
    assert there.stderr == ""
    assert json.loads(there.stdout)["digest"] == json.loads(here.stdout)["digest"]


STUDY = """
[study]
title = "Ties"
trials = 2
cases = ["s4"]

[base]
protocol.n_learning_episodes = 10

[axes]
learning.tie_rule = ["lowest", "middle"]
"""


def test_a_sweep_runs_there_too(pair, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(STUDY)

    def invoke(*options):
        arguments = ["sweep", "study.toml", "--json", *options]
        return CliRunner().invoke(main, arguments, catch_exceptions=False)

    there = ("--executor", "dask", "--scheduler", str(pair.file))
    found = json.loads(invoke("--out", "there", *there).stdout)
    assert found["digest"] == json.loads(invoke("--out", "here").stdout)["digest"]
    assert json.loads(invoke("--dry-run", *there).stdout)["jobs"] == 1


def test_a_gymnasium_environment_runs_there_too(pair, tmp_path):
    config = EnvironmentTrialConfig(
        environment=EnvironmentConfig(id="Pendulum-v1", kwargs={"max_episode_steps": 20}),
        approximator=SDNNCConfig(n_inputs=3),
        protocol=ProtocolConfig(n_learning_episodes=2, test_interval=1),
    )
    plan = [
        PlannedTrial(TrialKey("pendulum", "sdnn-c", trial, trial, config.config_hash), config)
        for trial in range(2)
    ]
    assert run(tmp_path / "there", plan, pair)[1] == run(tmp_path / "here", plan)[1]


def test_a_trial_that_raises_is_reported_and_the_others_are_done(pair, tmp_path):
    plan = list(make_plan(2))
    bad = replace(plan[0].config, learning=replace(plan[0].config.learning, discount=2.0))
    key = TrialKey(*plan[0].key[:4], bad.config_hash)
    plan[0] = PlannedTrial(key, bad)
    outcome, _ = run(tmp_path, plan, pair)
    assert outcome.n_run == 3
    ((failed, error),) = ((f.key, f.error) for f in outcome.failures)
    assert failed == key
    assert isinstance(error, ValueError)
    assert "discount must be" in str(error)


def test_a_trial_that_cannot_be_sent_is_reported_and_the_others_are_done(pair, tmp_path):
    plan = list(make_plan(2))
    odd = copy.copy(plan[-1].config)
    object.__setattr__(odd, "lock", threading.Lock())
    plan[-1] = PlannedTrial(plan[-1].key, odd)
    with ProgressBars(Console(file=StringIO())) as observer:
        outcome, _ = run(tmp_path, plan, pair, observer)
    assert outcome.n_run == 3
    (failed,) = outcome.failures
    assert failed.key == plan[-1].key
    assert "lock" in str(failed.error)


OTHER_VERSION = """
from sdnn import _core
_core.__version__ = "0.0.9"
"""
OTHER_BITS = """
from sdnn.runs import TrialRows
TrialRows.digest = lambda rows: "other"
"""
NO_SDNN = """
import sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "sdnn":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Blocker())
"""
UNFIT = {
    "version": (OTHER_VERSION, f"it has sdnn 0.0.9, this is sdnn {sdnn.__version__}"),
    "bits": (OTHER_BITS, "does not give the rows of this one for agent sdnn-c"),
    "missing": (NO_SDNN, "it cannot run these trials: ModuleNotFoundError: No module named 'sdnn"),
}


def test_workers_that_do_not_fit_get_no_trials(cluster, preload, tmp_path, monkeypatch):
    """Where there are only such workers the run fails; with a fitting one it goes on."""
    monkeypatch.setattr("sdnn.runs.dask_executor.REFUSAL_SECONDS", 3.0)
    for code, _ in UNFIT.values():
        cluster.add_worker(*preload(code))
    recorder = Recorder()
    with pytest.raises(ClusterError, match=r"^no worker at .* fits: worker tcp://.*same command"):
        run(tmp_path / "out", make_plan(), cluster, recorder)
    monkeypatch.setattr("sdnn.runs.dask_executor.REFUSAL_SECONDS", 60.0)
    cluster.add_worker("--no-nanny")
    outcome, digest = run(tmp_path / "out", make_plan(6), cluster, recorder)
    assert outcome.n_run == 12
    for _, words in UNFIT.values():
        assert any(words in note for note in recorder.notes), (words, recorder.notes)
    assert digest == run(tmp_path / "here", make_plan(6))[1]
    assert "failed" not in {event[0] for event in recorder.events}


LACKS_A_SETTING = """
import re
from sdnn.runs import TrialConfig

TrialConfig.whole = getattr(TrialConfig, "whole", TrialConfig.canonical_json)
TrialConfig.canonical_json = lambda self: re.sub('"discount":0.8,', "", self.whole())
"""


def test_a_build_that_lacks_a_setting_is_refused_when_one_comes(cluster, preload, tmp_path):
    """A build may pass the probe and yet ignore what only later trials set."""
    plan = make_plan(2)
    other = replace(plan[3].config, learning=replace(plan[3].config.learning, discount=0.8))
    plan = (
        *plan[:3], PlannedTrial(plan[3].key._replace(config_hash=other.config_hash), other)
    )  # fmt: skip
    cluster.add_worker(*preload(LACKS_A_SETTING))
    with pytest.raises(ClusterError, match="does not know all settings of agent sdnn-c; waited 5"):
        run(tmp_path / "out", plan, cluster, scheduler_timeout=5.0)
    cluster.add_worker("--no-nanny")
    outcome, digest = run(tmp_path / "out", plan, cluster)
    assert (outcome.n_reused, outcome.n_run) == (3, 1)
    assert digest == run(tmp_path / "here", plan)[1]


POISON = """
import os
from dataclasses import replace
from sdnn import _core
from sdnn.runs import AGENTS

class Poison:
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
AGENTS["sdnn-c"] = replace(AGENTS["sdnn-c"], core_trial=Poison)
"""


def test_a_trial_that_kills_its_workers_fails_and_the_others_are_done(cluster, preload, tmp_path):
    plan = make_plan(3)
    options = preload(POISON.format(seed=plan[1].key.seed))
    for _ in range(3):
        cluster.add_worker(*options)
    recorder = Recorder()
    outcome, _ = run(tmp_path / "out", plan, cluster, recorder, attempts=2)
    assert outcome.n_run == 5
    (failure,) = outcome.failures
    assert failure.key == plan[1].key
    assert isinstance(failure.error, WorkerLostError)
    assert "workers lost while they had it: 2, the last one tcp://" in str(failure.error)
    assert recorder.events.count(("lost", plan[1])) == 1


def test_an_interruption_frees_the_workers(pair, tmp_path):
    """The trials would take minutes; after the stop the same workers soon run others."""
    plan = make_plan(2, 100_000)
    stop = threading.Event()
    executor = DaskExecutor(str(pair.file))
    messages = []
    for message in executor.run(plan, stop):
        messages.append(message)
        if type(message).__name__ == "Advanced":
            stop.set()
    assert {type(message).__name__ for message in messages} <= {"Started", "Advanced", "Lost"}
    begin = time.monotonic()
    assert run(tmp_path, make_plan(1, 10), pair)[0].n_run == 2
    assert time.monotonic() - begin < 10


def test_an_unwritable_store_ends_the_run(pair, tmp_path):
    from sdnn.runs import StoreError

    class Full(ResultStore):
        def add(self, record, *, is_exact=True):
            raise StoreError("disk full")

    with Full(tmp_path) as store, pytest.raises(StoreError, match="disk full"):
        run_trials(make_plan(4), store, executor=DaskExecutor(str(pair.file)))


def test_the_scheduler_may_die_and_come_back(cluster, tmp_path):
    plan = make_plan(8, 300)
    cluster.add_worker("--no-nanny")

    class Killer(Recorder):
        def finished(self, planned):
            super().finished(planned)
            if sum(event[0] == "finished" for event in self.events) == 2:
                cluster.kill(cluster.scheduler)
                threading.Timer(2.0, restart).start()

    def restart():
        cluster.start_scheduler()
        cluster.add_worker("--no-nanny")

    recorder = Killer()
    outcome, digest = run(tmp_path / "out", plan, cluster, recorder)
    assert outcome.n_run == 16
    assert any(note.startswith("lost the scheduler at ") for note in recorder.notes)
    assert digest == run(tmp_path / "here", plan)[1]


@pytest.fixture
def closed_port():
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        yield server.getsockname()[1]  # bound, but nobody listens


@pytest.mark.parametrize("kind", ["address", "scheme", "missing", "malformed"])
def test_a_bad_address_is_a_clear_error_in_time(tmp_path, closed_port, kind):
    path = tmp_path / "scheduler.json"
    scheduler, words = {
        "address": (f"127.0.0.1:{closed_port}", r"no scheduler at 127.0.0.1:\d+: OSError: Timed"),
        "scheme": ("carrier-pigeon://loft", "cannot use carrier-pigeon://loft as scheduler: unk"),
        "missing": (str(path), "no scheduler at .*scheduler.json: FileNotFoundError"),
        "malformed": (str(path), "scheduler.json is not (yet) a scheduler file"),
    }[kind]
    if kind == "malformed":
        path.write_text("[]")
    recorder = Recorder()
    begin = time.monotonic()
    executor = DaskExecutor(scheduler, scheduler_timeout=1.0)
    with ResultStore(tmp_path / "out") as store, pytest.raises(ClusterError) as caught:
        run_trials(make_plan(1), store, executor=executor, observer=recorder)
    assert time.monotonic() - begin < 15
    if kind == "malformed":
        assert words in str(caught.value)
    else:
        caught.match(words)
    if kind != "scheme":
        caught.match("waited 1 s. What was finished is stored")
        assert len(recorder.notes) <= 1


def test_no_worker_is_a_clear_error_in_time(cluster, tmp_path):
    with pytest.raises(ClusterError, match=r"^no worker at .*; waited 2 s"):
        run(tmp_path / "out", make_plan(1), cluster, scheduler_timeout=2.0)


def test_dask_missing_says_what_to_install(monkeypatch, tmp_path):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "distributed" else find(name)
    )
    with pytest.raises(ClusterError, match=r'pip install "sdnn\[dask\]"'):
        DaskExecutor("127.0.0.1:8786")
    arguments = ["reproduce", "a", "--executor", "dask", "--scheduler", "h:1", "--out", tmp_path]
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    assert result.exit_code == 1
    assert 'pip install "sdnn[dask]"' in result.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scheduler": ""}, "scheduler must be an address or a scheduler file, got ''"),
        ({"scheduler_timeout": 0.0}, "scheduler_timeout must be finite and above 0, got 0.0"),
        ({"worker_timeout": float("nan")}, "worker_timeout must be finite and above 0, got nan"),
        ({"attempts": 0}, "attempts must be at least 1, got 0"),
    ],
)
def test_bad_arguments_are_named(options, words):
    with pytest.raises(ValueError, match=words):
        DaskExecutor(**{"scheduler": "127.0.0.1:8786"} | options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--executor", "ray"], "'ray' is not one of"),
        (["--executor", "dask"], "--executor dask needs --scheduler ADDRESS"),
        (["--scheduler", "h:1"], "--scheduler needs --executor dask"),
        (["--worker-timeout", "3"], "--worker-timeout needs --executor dask"),
        (["--executor", "dask", "--scheduler", "h:1", "--jobs", "2"], "--jobs is for threads"),
        (["--executor", "dask", "--scheduler", "h:1", "--attempts", "0"], "--attempts"),
        (["--executor", "dask", "--scheduler", ""], "scheduler must be an address"),
    ],
)
def test_wrong_usage_is_exit_code_2(options, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["reproduce", "a", *options])
    assert result.exit_code == 2
    assert words in result.stderr
    assert os.listdir() == []


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_hurt_cluster_gives_the_same_rows(harness):
    line = harness.kill_cluster(
        ["a", "--trials", "15", "--episodes", "1000"],
        n_kills=30, n_frozen=3, n_schedulers=5, seed=1,
    )  # fmt: skip
    assert "the same rows" in line
