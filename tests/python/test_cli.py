import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import sdnn
from sdnn.cli import main
from sdnn.experiments import trial


@pytest.fixture(scope="module")
def fake():
    path = Path(__file__).parent / "experiments" / "fake_trial.py"
    spec = importlib.util.spec_from_file_location("fake_trial_of_cli", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def invoke(monkeypatch, tmp_path, fake):
    """Call the command in an empty folder, with fake trials unless told otherwise."""
    monkeypatch.chdir(tmp_path)

    def _invoke(*arguments, make_trial=fake.FakeTrial):
        monkeypatch.setattr(trial, "make_core_trial", make_trial)
        return CliRunner().invoke(main, [str(a) for a in arguments], catch_exceptions=False)

    return _invoke


def test_help_and_version(invoke):
    assert "reproduce" in invoke("--help").stdout
    assert invoke("--version").stdout == f"sdnn {sdnn.__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["reproduce", "z"], "'z' is not one of"),
        (["reproduce", "a", "--trials", 0], "--trials"),
        (["reproduce", "a", "--trials", "many"], "--trials"),
        (["reproduce", "a", "--episodes", -5], "--episodes"),
        (["reproduce", "a", "--episodes", 9], "episodes must be at least 10"),
        (["reproduce", "a", "--jobs", 0], "--jobs"),
        (["reproduce", "a", "--seed", -1], "--seed"),
        (["reproduce", "a", "--fast"], "--fast"),
        (["learn"], "learn"),
    ],
)
def test_wrong_usage_is_exit_code_2(invoke, tmp_path, arguments, words):
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_quick_run_writes_marked_files_and_one_summary_line(invoke, tmp_path):
    result = invoke("reproduce", "a", "--quick", "--out", "out")
    assert result.exit_code == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "experiment-a-quick.png",
        "experiment-a-quick.svg",
        "report-quick.html",
        "results-quick.csv",
        "results-quick.md",
        "results.sqlite",
        "table-quick.json",
    ]
    assert result.stderr == ""  # no progress where there is no terminal
    assert "QUICK LOOK" in result.stdout
    assert "not judged" in result.stdout
    assert "4 of 4 trials are stored in out (4 run now)" in result.stdout.splitlines()[-1]
    assert "(0 run now)" in invoke("reproduce", "a", "--quick", "--out", "out").stdout


@pytest.fixture
def no_costs(monkeypatch):
    """Costs that take no time, and a list of what was asked."""
    from sdnn.benchmarks import agent_cost
    from sdnn.experiments.cost import StepTimes

    asked = []

    def measure(series, n_inputs, config):
        asked.append((series.id, n_inputs))
        times = float(n_inputs) * np.ones(config.n_rounds)
        return StepTimes(microseconds=times, n_steps=1, table_bytes=1)

    monkeypatch.setattr(agent_cost, "measure_steps", measure)
    return asked


def test_all_is_the_default_and_reuses_what_is_stored(invoke, tmp_path, no_costs):
    invoke("reproduce", "a", "--quick", "--out", "out")
    assert no_costs == []
    result = invoke("reproduce", "--quick", "--out", "out")
    assert "18 of 18 trials are stored in out (14 run now)" in result.stdout.splitlines()[-1]
    assert len(no_costs) == 3 * 7 + 4
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names >= {"experiment-b-quick.svg", "cost-quick.png", "cost-quick.csv"}
    assert "(0 run now)" in invoke("reproduce", "--quick", "--out", "out").stdout
    assert len(no_costs) == 3 * 7 + 4


def test_report_covers_what_is_stored_not_only_what_was_asked(invoke, tmp_path, no_costs):
    invoke("reproduce", "b", "--quick")
    table = json.loads(invoke("reproduce", "cost", "--quick", "--json").stdout)
    assert [experiment["id"] for experiment in table["experiments"]] == ["b"]
    assert len(table["costs"]) == 3 * 7 + 4
    assert [claim["number"] for claim in table["claims"]] == [1, 2, 3, 4, 5, 6, 7, 8, 9]
    page = (tmp_path / "results" / "report-quick.html").read_text()
    assert "Case IV" in page
    rows = (tmp_path / "results" / "results-quick.csv").read_text().splitlines()
    assert len(rows) == 1 + 4 * 2 * 2 * 30


def test_results_do_not_depend_on_jobs(invoke):
    one = invoke("reproduce", "a", "--quick", "--jobs", 1, "--json", "--out", "one")
    two = invoke("reproduce", "a", "--quick", "--jobs", 2, "--json", "--out", "two")
    assert json.loads(one.stdout)["digest"] == json.loads(two.stdout)["digest"]


def test_json_is_the_file(invoke, tmp_path):
    result = invoke("reproduce", "a", "--trials", 3, "--episodes", 1000, "--json", "--seed", 5)
    table = json.loads(result.stdout)
    assert table == json.loads((tmp_path / "results" / "table.json").read_text())
    assert table["seed"] == 5
    assert table["quick"] is False
    (experiment,) = table["experiments"]
    assert [case["n_trials"] for case in experiment["cases"]] == [3, 3]
    assert [case["last_episode"] for case in experiment["cases"]] == [1000, 1000]


def test_dry_run_makes_nothing_and_counts_what_is_stored(invoke, tmp_path):
    result = invoke("reproduce", "a", "--dry-run")
    assert result.exit_code == 0
    assert result.stdout.splitlines() == [
        "s4 sdnn-c: 10 trials x 15000 episodes, 0 of them stored in results",
        "s6 sdnn-c: 10 trials x 15000 episodes, 0 of them stored in results",
    ]
    assert list(tmp_path.iterdir()) == []
    invoke("reproduce", "a", "--quick")
    plan = json.loads(
        invoke("reproduce", "a", "--quick", "--trials", 5, "--dry-run", "--json").stdout
    )
    assert plan["n_learning_episodes"] == 300
    assert [(row["planned"], row["stored"]) for row in plan["trials"]] == [(5, 2), (5, 2)]


def test_dry_run_counts_costs_too(invoke, no_costs):
    line = "cost of a step: {} measurements, {} of them stored in results"
    assert invoke("reproduce", "cost", "--dry-run").stdout.splitlines() == [line.format(28, 0)]
    assert invoke("reproduce", "--dry-run").stdout.splitlines()[-1] == line.format(28, 0)
    last_line = invoke("reproduce", "cost", "--quick").stdout.splitlines()[-1]
    assert re.fullmatch(r"wrote \d+ files: see .*report-quick\.html", last_line)
    dry = invoke("reproduce", "cost", "--quick", "--dry-run").stdout
    assert dry.splitlines() == [line.format(25, 25)]
    plan = json.loads(invoke("reproduce", "a", "--dry-run", "--json").stdout)
    assert plan["costs"] == {"planned": 0, "stored": 0}


def test_output_that_is_a_file(invoke, tmp_path):
    (tmp_path / "out").write_text("mine")
    result = invoke("reproduce", "a", "--quick", "--out", "out")
    assert result.exit_code == 2
    assert "'out' is a file" in result.stderr
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize("options", [[], ["--dry-run"]])
def test_damaged_result_file_is_one_clear_line(invoke, tmp_path, options):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "results.sqlite").write_bytes(b"not a database")
    result = invoke("reproduce", "a", "--quick", *options)
    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("Error: ")
    assert str(Path("results/results.sqlite")) in result.stderr


def test_missing_matplotlib_is_one_clear_line(invoke, tmp_path, monkeypatch):
    monkeypatch.setattr("sdnn.experiments.figures.find_spec", lambda name: None)
    result = invoke("reproduce", "a", "--quick")
    assert result.exit_code == 1
    assert 'pip install "sdnn[reproduce]"' in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_failing_trials_are_exit_code_1(invoke, tmp_path, fake):
    def make(config, seed):
        if config.sensors.n_sensors == 6:
            raise RuntimeError("broken")
        return fake.FakeTrial(config, seed)

    result = invoke("reproduce", "a", "--quick", make_trial=make)
    assert result.exit_code == 1
    assert "Error: SDNN-C s6, trial 1 failed: RuntimeError: broken" in result.stderr
    assert "2 of 4 trials are stored" in result.stderr
    assert [p.name for p in (tmp_path / "results").iterdir()] == ["results.sqlite"]


def test_interruption_is_exit_code_130_and_the_command_goes_on(invoke, fake):
    class Interrupting(fake.FakeTrial):
        """Interrupts the run when it starts, and never ends by itself."""

        def __init__(self, config, seed):
            super().__init__(config, seed)
            os.kill(os.getpid(), signal.SIGINT)

        def advance(self, n):
            time.sleep(0.001)

    result = invoke("reproduce", "a", "--quick", "--jobs", 1, make_trial=Interrupting)
    assert result.exit_code == 130
    assert "interrupted; 0 of 4 trials are stored in results" in result.stderr
    assert invoke("reproduce", "a", "--quick").exit_code == 0


def python(*arguments, **options):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, env=environment, **options
    )


def test_module_is_the_command(tmp_path):
    done = python("-m", "sdnn", "reproduce", "a", "--dry-run", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr == ""
    assert "s6 sdnn-c" in done.stdout
    wrong = python("-m", "sdnn", "reproduce", "a", "--trials", "0", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "Traceback" not in wrong.stderr


def test_cmakedir_is_the_installed_package():
    done = python("-m", "sdnn", "--cmakedir")
    assert done.returncode == 0
    assert (Path(done.stdout.strip()) / "sdnnConfig.cmake").is_file()


def test_command_line_starts_without_heavy_imports():
    code = (
        "import sys; import sdnn; before = set(sys.modules); import sdnn.cli;"
        "print([m for m in ('matplotlib', 'rich', 'sqlite3', 'sdnn.experiments.engine')"
        " if m in set(sys.modules) - before])"
    )
    assert python("-c", code).stdout.strip() == "[]"


def test_real_quick_run(tmp_path):
    """The whole way with the trial in C++; ten episodes, so nothing is learned."""
    out = tmp_path / "out"
    command = ("-m", "sdnn", "reproduce", "a", "--trials", "1", "--episodes", "10", "--json")
    done = python(*command, "--out", str(out))
    assert done.stderr == ""
    assert done.returncode == 0
    (experiment,) = json.loads(done.stdout)["experiments"]
    assert [case["measures"]["final_steps"]["median"]["lower"] for case in experiment["cases"]] == [
        None,
        None,
    ]
    assert all(case["n_decisions"] > 0 for case in experiment["cases"])
