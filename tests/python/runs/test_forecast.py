"""Estimates of time, from made-up stored trials and from a probe of a trial of known speed."""

from dataclasses import replace

import pytest

from sdnn.runs import AGENTS, BudgetSpec, RunSpec, TrialKey, forecast
from sdnn.runs.forecast import trial_seconds, wall_seconds
from sdnn.runs.trial import TrialTime

CONFIG = RunSpec(budget=BudgetSpec(episodes=1005))
KEY = TrialKey("s4", "sdnn-c", 0, 1, "mine")


def stored(seconds, n_episodes=1000, n_decisions=10_000, **changes):
    return TrialTime(
        key=KEY._replace(**changes), seconds=seconds, n_episodes=n_episodes, n_decisions=n_decisions
    )


def estimate(times, key=KEY, config=CONFIG):
    return trial_seconds(key, config, {key[:2]: ("stored trial", times)})


def test_trials_of_the_same_configuration_count_first():
    times = [stored(2.0), stored(4.0), stored(50.0, config_hash="other")]
    found = estimate(times)
    assert found["lower"] == found["upper"] == pytest.approx(3.0 * 1.005)
    assert found["source"].startswith("2 ")
    assert "this configuration" in found["source"]


def test_then_those_of_the_same_case_and_agent():
    found = estimate([stored(50.0, config_hash="other")])
    assert found["lower"] == found["upper"] == pytest.approx(50.25)
    assert found["source"].startswith("1 stored trial ")
    assert "configuration" not in found["source"]


def test_shorter_trials_give_the_least():
    found = estimate([stored(1.0, n_episodes=100, n_decisions=1000)])
    assert (found["lower"], found["upper"]) == (pytest.approx(10.05), None)
    assert "as in the first 100 episodes" in found["source"]


def test_a_probe_is_made_once_for_a_case_and_agent(fake, monkeypatch):
    made = []

    class Probed(fake.FakeTrial):
        def __init__(self, **options):
            made.append(options["seed"])
            super().__init__(**options)

        def advance(self, n):
            clock[0] += 0.1
            super().advance(n)

    clock = [0.0]
    monkeypatch.setattr(forecast.time, "thread_time", lambda: clock[0])
    monkeypatch.setitem(AGENTS, "sdnn-c", replace(AGENTS["sdnn-c"], core_trial=Probed))
    times = {("s4", "fuzzy"): ("stored trial", [stored(9.0, agent="fuzzy")])}
    found = trial_seconds(KEY, CONFIG, times)
    # 10 episodes in 0.1 s: 0.3 s are reached after 30 or 40.
    assert found["lower"] == pytest.approx(10.05)
    assert found["upper"] is None
    assert found["source"].startswith("1 probe of this configuration: as in the first ")
    whole = CONFIG.replace(budget=BudgetSpec(episodes=20))
    found = trial_seconds(KEY._replace(config_hash="other"), whole, times)
    assert found["lower"] == found["upper"] == pytest.approx(0.2)
    assert found["source"].startswith("1 probe ")
    assert "configuration" not in found["source"]
    assert made == [1]


def test_python_trials_share_a_core(monkeypatch):
    monkeypatch.setattr(forecast, "n_cores", lambda: 16)
    compiled, locked = (8.0, True), (4.0, False)
    assert wall_seconds(4 * [compiled], 2) == 16.0
    assert wall_seconds(2 * [compiled], 4) == 8.0, "no trial is cut in parts"
    assert wall_seconds([compiled, *4 * [locked]], 8) == 16.0
    assert wall_seconds([], 2) == 0.0
    monkeypatch.setattr(forecast, "n_cores", lambda: 2)
    assert wall_seconds(4 * [compiled], 64) == 16.0, "no more at once than there are cores"
