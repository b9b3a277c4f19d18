"""Benchmarks: how times are measured, stored and shown; no test compares speeds.

`sdnn bench` measures the package; bench/yardsticks.py adds dense products for comparison.
"""

import importlib.util
import itertools
import json
import math
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from sdnn import _core
from sdnn.benchmarks import measurements, report
from sdnn.cli import main
from sdnn.support.machine import available_instruction_sets, instruction_set

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def quick():
    """The results of a quick run of the command."""
    result = CliRunner().invoke(main, ["bench", "--quick", "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    assert result.stderr == ""
    return json.loads(result.stdout)


def load_script(name):
    """Load a script that measures for the documentation, or writes its tables."""
    path = ROOT / "bench" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(path.parent)
        spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def yardsticks():
    """The loaded script, with its settings of threads undone after its import."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("OPENBLAS_NUM", "MKL_NUM", "OMP_NUM", "BLIS_NUM", "VECLIB_MAXIMUM"):
            patch.setenv(f"{name}_THREADS", "1")
        return load_script("yardsticks")


@pytest.fixture(scope="module")
def with_yardsticks(quick, yardsticks):
    """The results of a quick run of the script, which adds to those of the command."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(yardsticks, "run_benchmarks", lambda **options: quick)
        return yardsticks.measure(quick=True)


def check_fields_and_numbers(value, stored, path=()):
    """Check that ``value`` has the fields of a stored run, and positive and finite numbers.

    ``path`` has the names of fields that lead to the value, for messages.
    """
    assert type(value) is type(stored), path
    if isinstance(value, list):
        for number, item in enumerate(value):
            check_fields_and_numbers(item, stored[0], (*path, number))
    elif isinstance(value, dict):
        depends_on_machine = path[-1:] in MACHINE_FIELDS
        if not depends_on_machine:
            assert value.keys() == stored.keys(), path
        for name, item in value.items():
            stored_item = next(iter(stored.values())) if depends_on_machine else stored[name]
            check_fields_and_numbers(item, stored_item, (*path, name))
        if "median" in value:
            assert value["lower"] <= value["median"] <= value["upper"], path
    elif isinstance(value, int | float) and not isinstance(value, bool):
        assert math.isfinite(value), path
        assert value > 0 or path[-1] == "noise", path


MACHINE_FIELDS = {("caches",), ("values",), ("ratio_to_dense",)}
"""Fields with an item for each cache or instruction set of the machine."""


def test_a_quick_run_has_the_fields_of_the_stored_run(with_yardsticks):
    check_fields_and_numbers(
        with_yardsticks, load_script("performance_tables").stored("performance")
    )


def test_a_quick_run_states_the_version_and_the_instruction_sets(quick):
    assert quick["quick"] is True
    assert quick["sdnn"] == _core.__version__
    levels = list(available_instruction_sets())
    assert quick["instruction_sets"] == levels
    assert quick["best_instruction_set"] == levels[-1]
    assert quick["instruction_set"] == instruction_set()


def test_a_quick_run_measures_the_networks_and_trials_of_the_paper(quick, with_yardsticks):
    # Each input has 200 pattern units for each of its partners: 4 * 3 * 200, and 6 * 5 * 200.
    sizes = [(network["n_inputs"], network["n_columns"]) for network in quick["networks"]]
    assert sizes == [(4, 2400), (6, 6000)]
    levels = list(available_instruction_sets())
    for network in with_yardsticks["networks"]:
        assert (network["n_hidden_units"], network["n_actions"]) == (900, 601), "those of the paper"
        for name in ("values", "ratio_to_dense"):
            assert list(network[name]) == levels
        assert set(network["dense"]) == {"numpy", "core"}
    assert quick["acrobot"]["n_integration_steps"] == 50  # 1 s in steps of 0.02 s
    trials = [(decisions["n_inputs"], decisions["noise"]) for decisions in quick["decisions"]]
    assert trials == [(4, 0.0), (4, 0.02), (6, 0.02)]
    for decisions in quick["decisions"]:
        assert decisions["p50"] <= decisions["p99"] <= decisions["max"]
        assert decisions["max"] <= decisions["max_of_all_runs"]


def test_the_command_and_the_page_show_every_table_and_warn_of_quick_runs(
    quick, with_yardsticks, monkeypatch
):
    monkeypatch.setattr("sdnn.benchmarks.run_benchmarks", lambda **options: quick)
    result = CliRunner().invoke(main, ["bench", "--quick"], catch_exceptions=False)
    assert result.exit_code == 0
    page = load_script("performance_tables")
    text = page.to_markdown(with_yardsticks)
    tables = report.tables(quick)
    for table in (*tables, page.dense_table(with_yardsticks)):
        assert table.title in text
        assert all(len(row) == len(table.header) for row in table.rows)
    for row in itertools.chain(*(table.rows for table in tables)):
        assert row[0].split(",")[0] in result.stdout
    assert report.QUICK_WARNING in text
    assert report.QUICK_WARNING in result.stdout
    assert report.QUICK_WARNING not in page.to_markdown({**with_yardsticks, "quick": False})


def test_measurements_alternate_and_omit_cold_repetitions():
    calls = []

    def times_of(name, n_repetitions):
        calls.append((name, n_repetitions))
        return np.arange(n_repetitions, dtype=np.int64)

    effort = measurements.Effort(n_rounds=2, n_repetitions=3)
    times = measurements.in_turns({name: partial(times_of, name) for name in "ab"}, effort)
    n = measurements.N_COLD + 3
    assert calls == [("a", n), ("b", n), ("a", n), ("b", n)]
    warm_times = list(range(measurements.N_COLD, n))
    assert times["a"].tolist() == warm_times + warm_times


def test_the_core_returns_a_time_for_each_repetition():
    trial = measurements._short_trial(n_inputs=4, noise=0.0, n_episodes=5)
    times = _core.time_decisions(trial, n_episodes=3)
    assert times.dtype == np.int64
    assert times.size == trial.n_decisions
    network_parts = _core.NetworkParts(trial.agent.networks[0], seed=1)
    times = network_parts.time_values(n_repetitions=3)
    assert times.size == 3
    assert (times > 0).all()
    assert _core.DenseProduct(n_rows=5, n_columns=7, seed=1).run(n_repetitions=0).size == 0


def test_unknown_processors_and_caches_are_no_error(tmp_path, monkeypatch, yardsticks):
    monkeypatch.setattr("sdnn.support.machine._PROCESSOR_FILE", tmp_path / "none")
    assert measurements.describe_machine()["processor"]
    assert yardsticks.caches(tmp_path / "none") == {}


def test_caches_of_data_are_read_in_bytes(tmp_path, yardsticks):
    # Linux has such a folder for each cache of a processor.
    caches = [("1", "Data", "32K"), ("1", "Instruction", "64K"), ("3", "Unified", "8M")]
    for number, cache in enumerate(caches):
        folder = tmp_path / f"index{number}"
        folder.mkdir()
        for name, text in zip(("level", "type", "size"), cache, strict=True):
            (folder / name).write_text(text + "\n")
    assert yardsticks.caches(tmp_path) == {"L1d": 32 * 2**10, "L3": 8 * 2**20}


def test_the_page_of_small_processors_shows_the_stored_measurements():
    module = load_script("arm/baselines")
    text = module.PAGE.read_text()
    assert sys.modules["page"].with_tables(text, module.page_tables()) == text, (
        "docs/evidence/boards.md is not what is stored: run bench/arm/baselines.py --redraw"
    )


def test_the_performance_page_shows_the_stored_run():
    module = load_script("performance_tables")
    text = module.PAGE.read_text()
    assert module.stored("performance")["quick"] is False
    assert sys.modules["page"].with_tables(text, module.page_tables()) == text, (
        "docs/evidence/performance.md is not what is stored: run bench/performance_tables.py"
    )
