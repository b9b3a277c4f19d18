"""The command ``sdnn reproduce`` with fake trials, and what all commands have in common."""

import csv
import json
import os
import re
import signal
import sqlite3
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest
from click.testing import CliRunner

import sdnn
from fake_trial import FakeTrial
from processes import python
from sdnn.cli import main
from sdnn.reproduction.cases import MOST_EPISODES
from sdnn.reproduction.reproduce import PaperStudy
from sdnn.runs import AGENTS, AgentEntry, register


@pytest.fixture
def invoke(invoke):
    """Call the command with fake trials unless told otherwise."""
    return partial(invoke, trial=FakeTrial)


def test_help_lists_the_commands_and_version_describes_the_environment(invoke):
    help_text = invoke("--help").stdout
    assert all(re.search(rf"^  {name} .*\w\.$", help_text, re.MULTILINE) for name in main.commands)
    version, compiler, *others = invoke("--version").stdout.splitlines()
    assert version == f"sdnn {sdnn.__version__}"
    assert re.fullmatch(r"compiler (GCC|.*[Cc]lang|MSVC) .*\d.*", compiler)
    assert [line.split()[0] for line in others] == [
        "python", "platform", "processor", "instruction", "packages",
    ]  # fmt: skip
    assert f"in use: {sdnn.instruction_set()}" in others[3]


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("reproduce z", "'z'"),
        ("reproduce a --episodes 9", "episodes"),  # fewer than between two evaluations
        ("reproduce a --episodes 3000000000", "--episodes"),
        (f"reproduce a --episodes {MOST_EPISODES + 1} --dry-run", "--episodes"),
        ("reproduce a --fast", "--fast"),
        ("reproduce a --agent dqn", "sdnn-c-robust"),
        ("learn", "learn"),
    ],
)
def test_bad_arguments_exit_with_2_and_write_nothing(refused, tmp_path, command, words):
    assert words in refused(*command.split(), code=2)
    assert list(tmp_path.iterdir()) == []


def test_a_quick_reproduction_writes_marked_files_and_a_summary(invoke, tmp_path):
    result = invoke("reproduce", "a", "--quick", "--out", "out")
    assert result.exit_code == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "experiment-a-quick.png", "experiment-a-quick.svg", "report-quick.html",
        "results-quick.csv", "results-quick.md", "results.sqlite", "table-quick.json",
    ]  # fmt: skip
    assert result.stderr == "", "no progress bars where there is no terminal"
    assert "QUICK LOOK" in result.stdout
    assert "so far" in result.stdout
    # Two trials of each of the two cases of Experiment A.
    assert "4 of 4 trials are stored in out (4 run now)" in " ".join(result.stdout.split())
    again = invoke("reproduce", "a", "--quick", "--out", "out")
    assert "(0 run now)" in " ".join(again.stdout.split())


@pytest.mark.parametrize(
    ("options", "mark"),
    [
        ({}, ""),
        ({"n_trials": 10, "n_episodes": 15_000}, ""),
        ({"quick": True, "n_trials": 2, "n_episodes": 300}, "-quick"),
        ({"n_trials": 2}, "-2-trials"),
        ({"n_episodes": 100}, "-100-episodes"),
        ({"n_trials": 2, "n_episodes": 15_000, "seed": 7}, "-2-trials-seed-7"),
        ({"quick": True, "n_trials": 10}, "-10-trials-quick"),
        ({"agents": ("rbf", "fuzzy")}, "-rbf-fuzzy"),
        ({"agents": ("sdnn-c-robust",)}, "-sdnn-c-robust"),
        ({"agents": ("sdnn-c",), "presets": ("robust",)}, "-sdnn-c-with-robust"),
        ({"presets": ("robust", "general"), "quick": True}, "-robust-general-quick"),
    ],
)
def test_file_names_state_deviations_from_the_paper(options, mark):
    assert PaperStudy("a", **options).file_name("table.json") == f"table{mark}.json"


def test_smaller_reproductions_do_not_overwrite_the_files_of_the_full_one(invoke, tmp_path):
    invoke("reproduce", "a", "--trials", 10, "--out", "out", "--episodes", 15_000)
    files = [path for path in (tmp_path / "out").iterdir() if path.suffix != ".sqlite"]
    before = {path: path.read_bytes() for path in files}
    assert {path.name for path in files} >= {"report.html", "results.csv", "table.json"}
    for options in (("--trials", 2), ("--episodes", 1000), ("--seed", 1)):
        assert invoke("reproduce", "a", "--out", "out", *options).exit_code == 0
    for agent in (("--agent", "sdnn-c", "--preset", "robust"), ("--agent", "sdnn-c-robust")):
        assert invoke("reproduce", "a", "--out", "out", "--quick", *agent).exit_code == 0
    assert {path: path.read_bytes() for path in files} == before
    names = {path.name for path in (tmp_path / "out").glob("table*")}
    assert names == {
        "table.json", "table-2-trials.json", "table-1000-episodes.json", "table-seed-1.json",
        "table-sdnn-c-with-robust-quick.json", "table-sdnn-c-robust-quick.json",
    }  # fmt: skip


def test_a_trial_of_the_most_episodes_is_accepted_and_of_more_refused():
    planned = PaperStudy("a", n_trials=1, n_episodes=MOST_EPISODES).plan()[0]
    planned.spec.make_trial(planned.key.seed)
    with pytest.raises(ValueError, match="episodes"):
        PaperStudy("a", n_trials=1, n_episodes=MOST_EPISODES + 1)


@pytest.fixture
def no_costs(monkeypatch):
    """Replace measurements of costs; return the list of those that were requested."""
    from sdnn.reproduction import cost

    requested = []

    def measure(series, n_inputs, config):
        requested.append((series.id, n_inputs))
        microseconds = (float(n_inputs),) * config.n_rounds
        n_steps = table_bytes = 1
        return microseconds, n_steps, table_bytes

    monkeypatch.setattr(cost, "measure_steps", measure)
    return requested


def test_reproduce_without_arguments_runs_everything_that_is_not_stored(invoke, tmp_path, no_costs):
    invoke("reproduce", "a", "--quick", "--out", "out")
    assert no_costs == []
    result = invoke("reproduce", "--quick", "--out", "out")
    # Two trials of nine pairs of case and agent, of which those of Experiment A are stored.
    assert re.search(r"\b18 of 18 .* out \(14 ", result.stdout.splitlines()[-1])
    assert len(no_costs) == 3 * 7 + 4  # three series of 2 to 8 inputs, one of 2 to 5
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names >= {"experiment-b-quick.svg", "cost-quick.png", "cost-quick.csv"}
    assert "(0 " in invoke("reproduce", "--quick", "--out", "out").stdout
    assert len(no_costs) == 3 * 7 + 4


def test_a_report_covers_all_stored_trials(invoke, tmp_path, no_costs):
    invoke("reproduce", "b", "--quick")
    table = json.loads(invoke("reproduce", "cost", "--quick", "--json").stdout)
    assert [experiment["id"] for experiment in table["experiments"]] == ["b"]
    assert len(table["costs"]) == 3 * 7 + 4
    assert [claim["number"] for claim in table["claims"]] == [1, 2, 3, 4, 5, 6, 7, 8, 9]
    page = (tmp_path / "results" / "report-quick.html").read_text()
    assert "Case IV" in page
    rows = (tmp_path / "results" / "results-quick.csv").read_text().splitlines()
    assert len(rows) == 1 + 4 * 2 * 2 * 30  # cases, agents, trials, evaluations


def test_the_json_output_is_the_written_table(invoke, tmp_path):
    result = invoke("reproduce", "a", "--trials", 3, "--episodes", 1000, "--json", "--seed", 5)
    table = json.loads(result.stdout)
    name = "table-3-trials-1000-episodes-seed-5.json"
    assert table == json.loads((tmp_path / "results" / name).read_text())
    assert table["seed"] == 5
    assert table["quick"] is False
    (experiment,) = table["experiments"]
    assert [case["n_trials"] for case in experiment["cases"]] == [3, 3]
    assert [case["last_episode"] for case in experiment["cases"]] == [1000, 1000]


def test_dry_run_counts_stored_trials_and_writes_nothing(invoke, tmp_path):
    result = invoke("reproduce", "a", "--dry-run")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert len(lines) == 3
    for case, line in zip(("s4", "s6"), lines, strict=False):
        start = f"{case} sdnn-c: 10 trials x 15000 episodes of sdnn-c, 0 of them stored in results"
        assert line.startswith(f"{start}; a trial takes")
    assert lines[2].startswith("in all 20 trials, 0 of them stored; the rest takes")
    assert list(tmp_path.iterdir()) == []
    invoke("reproduce", "a", "--quick")
    plan = json.loads(
        invoke("reproduce", "a", "--quick", "--trials", 5, "--dry-run", "--json").stdout
    )
    assert {row["episodes"] for row in plan["trials"]} == {300}
    assert [(row["planned"], row["stored"]) for row in plan["trials"]] == [(5, 2), (5, 2)]


def test_dry_run_opens_the_store_for_reading_only(invoke, tmp_path, monkeypatch):
    invoke("reproduce", "a", "--quick")
    files = sorted((tmp_path / "results").iterdir())
    opened = []

    def connect(place, **options):
        opened.append(str(place))
        return real_connect(place, **options)

    real_connect = sqlite3.connect
    monkeypatch.setattr("sdnn.runs.store.sqlite3.connect", connect)
    result = invoke("reproduce", "a", "--quick", "--dry-run")
    assert result.stdout.count("2 trials x 300 episodes of sdnn-c, 2 of them") == 2
    opened_files = [place for place in opened if place != ":memory:"]
    assert opened_files
    assert all(place.endswith("?mode=ro") for place in opened_files)
    assert sorted((tmp_path / "results").iterdir()) == files


def test_dry_run_counts_measurements_of_costs(invoke, no_costs):
    n_full, n_quick = 4 * 7, 3 * 7 + 4  # four series of 2 to 8 inputs, one of them up to 5 if quick
    line = "cost of a step: {} measurements, {} of them stored in results"
    planned = line.format(n_full, 0)
    assert invoke("reproduce", "cost", "--dry-run").stdout.splitlines() == [planned]
    assert invoke("reproduce", "--dry-run").stdout.splitlines()[-1] == planned
    last_line = invoke("reproduce", "cost", "--quick").stdout.splitlines()[-1]
    assert re.fullmatch(r"wrote \d+ files: see .*report-quick\.html", last_line)
    forecast = invoke("reproduce", "cost", "--quick", "--dry-run").stdout
    assert forecast.splitlines() == [line.format(n_quick, n_quick)]
    plan = json.loads(invoke("reproduce", "a", "--dry-run", "--json").stdout)
    assert plan["costs"] == {"planned": 0, "stored": 0}


def test_results_of_other_agents_are_written_to_separate_files(invoke, tmp_path, no_costs):
    invoke("reproduce", "a", "--quick", "--out", "out")
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").glob("*-quick.*")}
    result = invoke(
        "reproduce", "a", "--quick", "--out", "out", "--agent", "rbf", "--agent", "fuzzy"
    )
    assert re.search(r"\b8 of 8 .* out \(8 ", result.stdout.splitlines()[-1])
    assert "RBFN, FQL instead of the agents of its cases" in result.stdout
    names = {path.name for path in (tmp_path / "out").iterdir()} - set(before)
    assert names == {
        "experiment-a-rbf-fuzzy-quick.png", "experiment-a-rbf-fuzzy-quick.svg",
        "report-rbf-fuzzy-quick.html", "results-rbf-fuzzy-quick.csv", "results-rbf-fuzzy-quick.md",
        "results.sqlite", "table-rbf-fuzzy-quick.json",
    }  # fmt: skip
    assert {name: (tmp_path / "out" / name).read_bytes() for name in before} == before
    table = json.loads((tmp_path / "out" / "table-rbf-fuzzy-quick.json").read_text())
    assert [(case["case"], case["agent"]) for case in table["experiments"][0]["cases"]] == [
        ("s4", "rbf"), ("s4", "fuzzy"), ("s6", "rbf"), ("s6", "fuzzy"),
    ]  # fmt: skip
    assert [claim["number"] for claim in table["claims"]] == [3]


def test_a_preset_is_run_beside_the_papers_agents(invoke, tmp_path, no_costs):
    result = invoke("reproduce", "a", "--quick", "--out", "out", "--preset", "robust", "--json")
    table = json.loads(result.stdout)
    assert [(case["case"], case["agent"]) for case in table["experiments"][0]["cases"]] == [
        ("s4", "sdnn-c"), ("s4", "sdnn-c-robust"), ("s6", "sdnn-c"), ("s6", "sdnn-c-robust"),
    ]  # fmt: skip
    assert (tmp_path / "out" / "experiment-a-robust-quick.png").exists()
    again = invoke("reproduce", "a", "--quick", "--out", "out", "--preset", "paper", "--dry-run")
    assert again.stdout.count("2 trials x 300 episodes of sdnn-c, 2 of them stored") == 2
    assert "robust" not in again.stdout


def test_costs_are_measured_for_the_selected_agent_only(invoke, no_costs):
    forecast = invoke("reproduce", "cost", "--agent", "rbf", "--dry-run")
    n_planned, n_stored = 2 * 7, 0  # two series of 2 to 8 inputs
    assert re.findall(r"\d+", forecast.stdout) == [str(n_planned), str(n_stored)]
    table = json.loads(invoke("reproduce", "cost", "--agent", "rbf", "--quick", "--json").stdout)
    assert {cost["series"] for cost in table["costs"]} == {"rbf", "rbf-plain"}
    assert {series for series, _ in no_costs} == {"rbf", "rbf-plain"}


@dataclass(frozen=True)
class PumpingConfig:
    """The only setting that every agent has."""

    n_inputs: int = 4


@dataclass(frozen=True)
class ThresholdConfig:
    """The position of the first link's sensor at which the push changes its direction."""

    threshold: float = 0.5


class Pumping:
    """An agent that pushes the elbow the way the first link swings and learns nothing."""

    def __init__(self, observation_space, action_space, *, approximator, learning, seed):
        assert observation_space.shape == (approximator.n_inputs,)
        self._strongest = action_space.high
        self._threshold = learning.threshold

    def begin_episode(self):
        pass

    def act(self, observation, explore=True):
        return self._strongest if observation[2] >= self._threshold else -self._strongest

    def learn(self, transition):
        pass


@pytest.fixture
def pumping():
    """Register the agent `Pumping`."""
    parts = {"approximator": PumpingConfig, "learning": ThresholdConfig, "agent": Pumping}
    register(AgentEntry(id="pumping", title="Pumping", **parts))
    yield
    del AGENTS["pumping"]


@pytest.mark.usefixtures("pumping")
def test_a_registered_agent_class_is_reproduced_with_figures_and_reports(invoke, refused, tmp_path):
    call = partial(invoke, "reproduce", trial=None)
    result = call("b", "--quick", "--agent", "pumping")
    assert result.exit_code == 0
    assert "Pumping" in result.stdout
    folder = tmp_path / "results"
    text = (folder / "results-pumping-quick.csv").read_text()
    rows = list(csv.DictReader(text.splitlines()))
    assert len(rows) == 4 * 2 * 30  # cases, trials, evaluations
    assert {row["agent"] for row in rows} == {"pumping"}
    assert {row["case"] for row in rows} == {"s4", "s4-noise", "s5-noise", "s6-noise"}
    is_solved = [row["solved"] == "1" for row in rows if row["case"] == "s4"]
    assert 0 < sum(is_solved) < len(is_solved), "solved in early episodes, whose goal is wide"
    # The agent is deterministic, so trials differ by the noise of their sensors alone.
    steps = {}
    for row in rows:
        steps.setdefault((row["case"], row["trial"]), []).append(row["steps"])
    assert steps["s4", "0"] == steps["s4", "1"]
    assert steps["s4-noise", "0"] != steps["s4-noise", "1"]
    assert (folder / "experiment-b-pumping-quick.png").read_bytes().startswith(b"\x89PNG")
    markdown = (folder / "results-pumping-quick.md").read_text()
    assert "| Case I: 4 inputs, no noise | Pumping | 2 |" in markdown
    assert "Pumping" in (folder / "report-pumping-quick.html").read_text()
    table = json.loads((folder / "table-pumping-quick.json").read_text())
    assert table["claims"] == [], "the paper has no claims about this agent"
    assert "(0 " in call("b", "--quick", "--agent", "pumping").stdout
    error = refused("reproduce", "cost", "--agent", "pumping", code=2)
    assert "agents whose cost is measured are sdnn-c, fuzzy, rbf, got pumping" in error


def test_an_output_folder_that_is_a_file_is_refused(refused, tmp_path):
    (tmp_path / "out").write_text("mine")
    assert "'out' is a file" in refused("reproduce", "a", "--quick", "--out", "out", code=2)
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize("options", [[], ["--dry-run"]])
def test_a_damaged_result_file_is_reported_in_one_line(refused, tmp_path, options):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "results.sqlite").write_bytes(b"not a database")
    error = refused("reproduce", "a", "--quick", *options, code=1)
    assert error.startswith("Error: ")
    assert str(Path("results/results.sqlite")) in error


def test_a_missing_matplotlib_is_reported_in_one_line(refused, tmp_path, monkeypatch):
    monkeypatch.setattr("sdnn.runs.report.find_spec", lambda name: None)
    assert "pip install matplotlib" in refused("reproduce", "a", "--quick", code=1)
    assert list(tmp_path.iterdir()) == []


def test_failing_trials_exit_with_1_and_write_no_report(invoke, tmp_path):
    class Raising(FakeTrial):
        def __init__(self, *, sensors, **parts):
            super().__init__(**parts)
            self._fails = sensors.n_sensors == 6

        def advance(self, n):
            if self._fails:
                raise RuntimeError("broken")
            super().advance(n)

    result = invoke("reproduce", "a", "--quick", trial=Raising)
    assert result.exit_code == 1
    assert re.search("SDNN-C s6.* 1 .*RuntimeError: broken", result.stderr)
    assert "2 of 4 " in result.stderr
    assert [p.name for p in (tmp_path / "results").iterdir()] == ["results.sqlite"]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_give_their_exit_code_and_the_next_command_resumes(invoke, number, code):
    class Interrupting(FakeTrial):
        """Interrupts the run when it starts, and never ends by itself."""

        def advance(self, n):
            os.kill(os.getpid(), number)
            time.sleep(0.001)

    result = invoke("reproduce", "a", "--quick", "--jobs", 1, trial=Interrupting)
    assert result.exit_code == code
    assert "0 of 4 " in result.stderr
    assert invoke("reproduce", "a", "--quick").exit_code == 0


def test_bad_options_of_the_module_show_no_traceback(tmp_path):
    wrong = python("-m", "sdnn", "reproduce", "a", "--trials", "0", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "Traceback" not in wrong.stderr


@pytest.mark.parametrize("words", [["train", "CartPole-v1"], ["reproduce"], ["--version"]])
def test_an_unknown_instruction_set_is_reported_with_its_variable(tmp_path, monkeypatch, words):
    monkeypatch.setenv("SDNN_INSTRUCTION_SET", "sse9")
    process = python("-m", "sdnn", *words, cwd=tmp_path)
    assert process.returncode == 1
    assert process.stderr.startswith("Error: SDNN_INSTRUCTION_SET must be one of portable")
    assert process.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [["--help"], *([name, "--help"] for name in main.commands)])
def test_command_line_starts_without_heavy_imports(arguments):
    code = (
        "import sys; from sdnn.cli import main\n"
        f"try: main({arguments})\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'gymnasium', 'matplotlib', 'rich', 'PIL', 'sqlite3', 'safetensors'}\n"
        "heavy |= {'filelock', 'sdnn.agents', 'sdnn.runs.run', 'sdnn.runs.engine'}\n"
        # The options of train are fields of a specification, which knows agents.
        f"if {arguments[0]!r} == 'train': heavy -= {{'numpy', 'gymnasium', 'sdnn.agents'}}\n"
        "print('loaded:', sorted(heavy & set(sys.modules)))"
    )
    assert python("-c", code).stdout.splitlines()[-1] == "loaded: []"


def test_a_reproduction_of_ten_episodes_runs_in_a_separate_process(tmp_path):
    # Compiled trials; nothing is learned in ten episodes, one evaluation.
    out = tmp_path / "out"
    command = ("-m", "sdnn", "reproduce", "a", "--trials", "1", "--episodes", "10", "--json")
    process = python(*command, "--out", str(out))
    assert process.stderr == ""
    assert process.returncode == 0
    (experiment,) = json.loads(process.stdout)["experiments"]
    medians = [case["measures"]["final_steps"]["median"] for case in experiment["cases"]]
    assert [median["lower"] for median in medians] == [None] * 2, "a single trial has no interval"
    assert all(case["n_decisions"] > 0 for case in experiment["cases"])


def test_ctrl_c_in_a_command_exits_with_130(monkeypatch):
    def interrupted(**_):
        raise KeyboardInterrupt

    monkeypatch.setattr(main.commands["bench"], "callback", interrupted)
    result = CliRunner().invoke(main, ["bench"])
    assert result.exit_code == 130
    assert "interrupted" in result.output
