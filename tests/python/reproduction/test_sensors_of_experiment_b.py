"""Experiment B with a number of sensors and a noise that the user chooses."""

import json
import re

import pytest
from click.testing import CliRunner

from sdnn.cli import main
from sdnn.reproduction.cases import PAPER_CASES, case_of_sensors
from sdnn.reproduction.reproduce import PaperStudy
from sdnn.runs.trial import trial_seed


def reproduce(*arguments):
    return CliRunner().invoke(main, ["reproduce", *map(str, arguments)])


def test_sensors_of_the_paper_share_the_trials_of_its_cases():
    assert case_of_sensors(6, 0.02) == PAPER_CASES["s6-noise"]
    assert case_of_sensors(4, 0.0) == PAPER_CASES["s4"]
    study = PaperStudy("b", sensors=5, n_trials=1, n_episodes=10)
    assert set(study.combinations) == {("s5-noise", "sdnn-c"), ("s5-noise", "fuzzy")}


@pytest.mark.parametrize(
    ("n_sensors", "noise", "case_id"),
    [(6, 0.035, "s6-noise-0.035"), (5, 0, "s5"), (4, 0.1, "s4-noise-0.1")],
)
def test_other_sensors_are_a_separate_case_with_other_seeds(n_sensors, noise, case_id):
    (planned,) = PaperStudy(
        "b", sensors=n_sensors, noise=noise, agents=["fuzzy"], n_trials=1, n_episodes=10, seed=3
    ).plan()
    assert planned.key.case_id == case_id
    assert planned.key.seed == trial_seed(3, case_id, 0)
    sensors = planned.spec.environment.paper_settings().sensors
    assert (sensors.n_sensors, sensors.noise) == (n_sensors, noise)


def test_command_prints_the_digest_of_the_rows(tmp_path):
    options = ("b", "--noise", 0.03, "--agent", "fuzzy", "--trials", 1, "--episodes", 20)
    result = reproduce(*options, "--out", tmp_path)
    assert result.exit_code == 0, result.output
    names = [path.name for path in tmp_path.glob("table-*.json")]
    assert names == ["table-fuzzy-s4-noise-0.03-1-trials-20-episodes.json"]
    table = json.loads((tmp_path / names[0]).read_text("utf-8"))
    assert f"; digest of the rows {table['digest'][:16]}; " in result.output
    (case,) = table["experiments"][0]["cases"]
    assert case["title"] == "4 inputs, noise 0.03 (not in the paper)"


@pytest.mark.parametrize("word", ["a", "all", "cost"])
def test_sensors_need_experiment_b(word):
    result = reproduce(word, "--sensors", 5)
    assert result.exit_code == 2
    assert re.search(f"--sensors .*'b'.*'{word}'", result.output)
