"""Refusals of `DaskExecutor` and its options without a cluster; tests/cluster has the others."""

import dataclasses
import importlib.util
import os
import socket
import threading
from types import SimpleNamespace

import pytest

from refusals import refuses
from sdnn.reproduction import EXPERIMENTS, plan_trials
from sdnn.runs import ClusterError, DaskExecutor
from sdnn.runs.dask_executor import ended, probe, probes_of
from sdnn.runs.engine import Failed, Finished, run_to_end

pytest.importorskip("distributed", reason="needs Dask")


def plan_two_trials():
    """Plan a short trial of each of two cases."""
    return plan_trials(EXPERIMENTS[0].cases, n_trials=1, root_seed=0, n_episodes=30)


def test_probes_which_compare_builds_differ_between_trials_and_contain_their_settings():
    first, second = plan_two_trials()
    assert probe(first) == probe(first) != probe(second)
    assert first.spec.canonical_json() in probe(first)


def test_trials_that_cannot_be_pickled_are_refused():
    plan = plan_two_trials()
    object.__setattr__(plan[0], "lock", threading.Lock())  # no lock can be pickled
    refuses("lock", probes_of, plan, error=ClusterError)


def test_results_of_another_version_or_trial_count_as_failures():
    first, second = plan_two_trials()
    *_, (_, record) = run_to_end(first)  # its last message is Finished(first, record)

    def result_of(planned, record):
        future = SimpleNamespace(status="finished")
        return ended(SimpleNamespace(planned=planned, future=future), record)

    assert result_of(first, record) == Finished(first, record)
    for planned, other in (
        (second, record),
        (first, dataclasses.replace(record, version="0.0.1")),
        (first, dataclasses.replace(record, config="{}")),
    ):
        assert isinstance(result_of(planned, other), Failed)


@pytest.fixture
def closed_port():
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        yield server.getsockname()[1]  # bound, but nobody listens


@pytest.mark.parametrize(
    ("scheduler", "content"),
    [
        pytest.param("127.0.0.1:{port}", "", id="closed port"),
        pytest.param("carrier-pigeon://loft", "", id="scheme"),
        pytest.param("{folder}/scheduler.json", "", id="missing file"),
        pytest.param("{folder}/scheduler.json", "[]", id="malformed file"),
    ],
)
def test_errors_of_the_connection_name_the_scheduler(tmp_path, closed_port, scheduler, content):
    scheduler = scheduler.format(port=closed_port, folder=tmp_path)
    if content:
        (tmp_path / "scheduler.json").write_text(content)
    executor = DaskExecutor(scheduler, scheduler_timeout=1.0)
    with pytest.raises(ClusterError) as caught:
        list(executor.run(plan_two_trials(), threading.Event()))
    assert scheduler in str(caught.value)


def test_a_missing_dask_names_the_package_to_install(monkeypatch, refused):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "distributed" else find(name)
    )
    error = refused("reproduce", "a", "--executor", "dask", "--scheduler", "h:1", code=1)
    assert 'pip install "dask[distributed]"' in error


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--executor ray", "--executor"),
        ("--executor dask", "--scheduler"),
        ("--scheduler h:1", "--scheduler"),
        ("--scheduler-timeout 3", "--scheduler-timeout"),
        ("--executor dask --scheduler h:1 --jobs 2", "--jobs"),
        ("--executor dask --scheduler h:1 --scheduler-timeout 0", "--scheduler-timeout"),
        ("--executor dask --scheduler=", "scheduler must be"),
    ],
)
def test_conflicting_options_of_executors_exit_with_2(options, words, refused):
    assert words in refused("reproduce", "a", *options.split(), code=2)
    assert os.listdir() == []
