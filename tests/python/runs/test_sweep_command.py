"""``sdnn sweep``: files, resuming, sharing with ``reproduce``, forecasts and exit codes."""

import csv
import gzip
import json
import re
import sys

import pytest

import fake_trial

STUDY = """
[study]
title = "Mine"
trials = 2
cases = ["s4", "s6"]
[base]
budget.episodes = 300
[axes]
learning.discount = [0.8, 0.9]
"""
FILES = ["figure.png", "figure.svg", "report.html", "results.csv.gz", "results.md", "table.json"]


@pytest.fixture
def invoke(invoke, tmp_path):
    """Call the command beside a study, with fake trials unless told otherwise."""

    def _invoke(*arguments, trial=fake_trial.FakeTrial, study=STUDY):
        (tmp_path / "mine.toml").write_text(study)
        return invoke(*arguments, trial=trial)

    return _invoke


def test_a_sweep_writes_its_files_and_resumes(invoke, tmp_path):
    result = invoke("sweep", "mine.toml", "--out", "out")
    assert result.exit_code == 0
    assert result.stderr == ""
    names = sorted(p.name for p in (tmp_path / "out").iterdir())
    assert names == sorted([*(f"mine-{name}" for name in [*FILES, "trials.csv"]), "results.sqlite"])
    # Two trials of two cases with the base and the discount 0.8; the discount 0.9 is the base's.
    # Printed: trials that are stored, planned (8 each) and were run now, and the 7 written files.
    assert re.match(r"8 of 8 .* out \(8 .* 7 ", result.stdout.splitlines()[-1])
    assert "not judged" in result.stdout, "the study has no claims"
    again = invoke("sweep", "mine.toml", "--out", "out")
    assert re.search(r"\b8 of 8 .* out \(0 ", again.stdout)
    more = invoke("sweep", "mine.toml", "--out", "out", "--trials", 3)
    assert re.search(r"\b12 of 12 .* out \(4 ", more.stdout)


def test_the_rows_and_trials_of_all_variants_are_written(invoke, tmp_path):
    invoke("sweep", "mine.toml", "--out", "out")
    with gzip.open(tmp_path / "out" / "mine-results.csv.gz", "rt") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 3 * 2 * 30  # cases, variants, trials, evaluations
    assert {row["variant"] for row in rows} == {"base", "discount=0.8", "discount=0.9"}
    with (tmp_path / "out" / "mine-trials.csv").open() as file:
        trials = list(csv.DictReader(file))
    assert [(t["case"], t["variant"], t["trial"]) for t in trials[:3]] == [
        ("s4", "base", "0"), ("s4", "base", "1"), ("s4", "discount=0.8", "0"),
    ]  # fmt: skip
    assert len(trials) == 2 * 3 * 2, "cases, variants, trials"
    table = json.loads((tmp_path / "out" / "mine-table.json").read_text())
    shares = table["results"][0]["measures"]["final_share_solved"]["trials"]
    assert [float(t["final_share_solved"]) for t in trials[:2]] == shares


def test_sweep_and_reproduce_share_stored_trials(invoke):
    invoke("reproduce", "a", "--trials", 2, "--episodes", 300)
    result = invoke("sweep", "mine.toml")
    # The 4 of 8 trials with the base's discount are stored.
    assert re.search(r"\b8 of 8 .* results \(4 ", result.stdout)
    again = invoke("reproduce", "a", "--trials", 2, "--episodes", 300)
    assert "(0 " in again.stdout, "none are run again"


def test_the_json_output_is_the_written_table_for_any_number_of_jobs(invoke, tmp_path):
    of_one_job = invoke("sweep", "mine.toml", "--json", "--jobs", 1, "--out", "one", "--seed", 4)
    of_two_jobs = invoke("sweep", "mine.toml", "--json", "--jobs", 2, "--out", "two", "--seed", 4)
    table = json.loads(of_one_job.stdout)
    assert json.loads(of_two_jobs.stdout)["digest"] == table["digest"]
    assert table == json.loads((tmp_path / "one" / "mine-table.json").read_text())
    assert table["seed"] == 4
    assert table["reference"] == "base"
    other = invoke("sweep", "mine.toml", "--json", "--out", "one")
    assert json.loads(other.stdout)["digest"] != table["digest"]


def test_the_report_shows_the_study_and_escapes_its_title(invoke, tmp_path):
    invoke("sweep", "mine.toml", study=STUDY.replace("Mine", "Mine & <others>"))
    page = (tmp_path / "results" / "mine-report.html").read_text()
    assert "<h1>Mine &amp; &lt;others&gt;</h1>" in page
    assert "discount=0.9 is the same as base." in page
    assert "learning.discount = [0.8, 0.9]" in page
    assert "Settings and seeds" in page
    assert page.count("<img") == 1
    assert page.count('<source media="(max-width: 640px)" srcset="data:image/png') == 1


def test_only_runs_the_selected_variants(invoke):
    result = invoke("sweep", "mine.toml", "--only", "discount=0.8", "--only", "discount=0.8")
    assert re.search(r"\b4 of 4 .* results \(4 ", result.stdout), "two trials of two cases"
    assert " 4 of 6 " in result.stdout, "combinations of a variant and a case"
    completing = invoke("sweep", "mine.toml", "--only", "base")
    assert "(4 " in completing.stdout, "trials that were missing"
    assert " of 6 " not in completing.stdout, "no combination is incomplete"
    wrong = invoke("sweep", "mine.toml", "--only", "discount=0.7")
    assert wrong.exit_code == 2
    assert re.search("discount=0.7.*discount=0.9, discount=0.8, base", wrong.stderr)


@pytest.mark.parametrize(
    ("study", "words"),
    [
        (STUDY.replace("trials", "trails"), "mine.toml:4: study.trails: unknown key"),
        (STUDY.replace("0.8", "1.8"), "mine.toml:9: axes.learning.discount[0]: must be"),
    ],
)
def test_invalid_study_files_exit_with_2_and_write_nothing(invoke, tmp_path, study, words):
    from sdnn import _core

    for options in ([], ["--dry-run"]):
        result = invoke("sweep", "mine.toml", *options, study=study, trial=_core.AcrobotTrial)
        assert result.exit_code == 2
        assert words in result.stderr
        assert [p.name for p in tmp_path.iterdir()] == ["mine.toml"]


def test_a_failing_trial_omits_its_variant_only(invoke, tmp_path):
    class Raising(fake_trial.FakeTrial):
        def __init__(self, *, learning, sensors, **others):
            super().__init__(**others)
            self._fails = learning.discount == 0.8 and sensors.n_sensors == 6

        def advance(self, n):
            if self._fails:
                raise OverflowError("a weight would leave its range")
            super().advance(n)

    result = invoke("sweep", "mine.toml", trial=Raising)
    assert result.exit_code == 1
    failure = " (discount=0.8) failed: OverflowError: a weight would leave its range"
    assert result.stderr.count(failure) == 2, "both trials of the discount 0.8 with 6 sensors"
    assert "6 of 8 " in result.stdout, "trials"
    assert " 1 of 6 " in result.stdout, "incomplete combinations of a variant and a case"
    table = json.loads((tmp_path / "results" / "mine-table.json").read_text())
    assert [(r["case"], r["variant"]) for r in table["results"]] == [
        ("s4", "base"), ("s4", "discount=0.8"), ("s4", "discount=0.9"),
        ("s6", "base"), ("s6", "discount=0.9"),
    ]  # fmt: skip
    only_s6 = STUDY.replace('"s4", ', "")
    options = ("--only", "discount=0.8", "--out", "new")
    result = invoke("sweep", "mine.toml", *options, trial=Raising, study=only_s6)
    assert result.exit_code == 1
    assert "nothing is complete" in result.stderr


def test_dry_run_counts_and_estimates_without_making_a_file(invoke, tmp_path):
    result = invoke("sweep", "mine.toml", "--dry-run")
    assert result.exit_code == 0
    assert [p.name for p in tmp_path.iterdir()] == ["mine.toml"]
    # A line for each of two cases with the base and two discounts, and one for all. The discount
    # 0.9 is the base's: eight trials, two of each case with two different discounts.
    lines = result.stdout.splitlines()
    assert len(lines) == 2 * 3 + 1
    assert lines[0].startswith(
        "s4 base: 2 trials x 300 episodes of sdnn-c, 0 of them stored in results; a trial takes"
    )
    assert "(from the first 300 episodes of one)" in lines[0]
    assert lines[-1].startswith("in all 8 trials, 0 of them stored; the rest takes about")
    invoke("sweep", "mine.toml", "--trials", 1)
    lines = invoke("sweep", "mine.toml", "--dry-run").stdout.splitlines()
    assert "1 of them stored in results" in lines[0]
    assert "(from 1 stored trial)" in lines[0]
    forecast = json.loads(invoke("sweep", "mine.toml", "--dry-run", "--json", "--jobs", 3).stdout)
    assert (forecast["planned"], forecast["stored"], forecast["jobs"]) == (8, 8 // 2, 3)
    assert len(forecast["trials"]) == 2 * 3, "cases and variants"
    invoke("sweep", "mine.toml")
    printed = json.loads(invoke("sweep", "mine.toml", "--dry-run", "--json").stdout)
    assert printed["seconds"] == 0.0
    assert {t["source"] for t in printed["trials"]} == {"2 stored trials"}


def test_a_dry_run_reports_a_trial_that_raises(invoke):
    class Raising(fake_trial.FakeTrial):
        def advance(self, n):
            raise OverflowError("a weight would leave its range")

    result = invoke("sweep", "mine.toml", "--dry-run", trial=Raising)
    assert (result.exit_code, result.stdout) == (1, "")
    for words in ("SDNN-C s4, trial 1", "OverflowError: a weight would leave its range"):
        assert words in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_study_of_an_environment_from_a_module_beside_its_file_runs(
    invoke, tmp_path, monkeypatch
):
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "my_line_world.py").write_text(
        """
import gymnasium as gym
import numpy as np


class Line(gym.Env):
    n_open = n_made = 0
    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
    action_space = gym.spaces.Discrete(2)

    def __init__(self):
        Line.n_open += 1
        Line.n_made += 1

    def close(self):
        Line.n_open -= 1

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._state = self.np_random.uniform(-0.5, 0.5, 2)
        return self._state, {}

    def step(self, action):
        self._state = self._state + [0.2 * action - 0.1, 0.0]
        position = self._state[0]
        return self._state, float(position > 0.9), bool(abs(position) > 0.9), False, {}


gym.register("mine/Line-v0", entry_point=Line, max_episode_steps=30)
"""
    )
    study = """
        [study]
        trials = 2
        [base]
        environment = "my_line_world:mine/Line-v0"
        agent = "sdnn-c"
        budget.episodes = 40
        protocol.evaluate_every_episodes = 4
        [variants.exact]
        [variants.noisy]
        environment.noise = 0.05
        """
    result = invoke("sweep", "mine.toml", "--json", study=study)
    assert result.exit_code == 0
    results = json.loads(result.stdout)["results"]
    assert [(r["case"], r["variant"]) for r in results] == [
        ("my_line_world:mine/Line-v0", "exact"), ("my_line_world:mine/Line-v0", "noisy"),
    ]  # fmt: skip
    line = sys.modules["my_line_world"].Line
    # Two variants: each is tried once, in two environments, and then its two trials are run.
    assert (line.n_made, line.n_open) == (2 * (2 + 2 * 2), 0)
    # Random actions reach the goal, with the reward of 1, in 13 % of the episodes.
    assert results[0]["measures"]["mean_return"]["median"]["value"] > 0.2
