"""Estimates of time, from stored trials and from a probe of a trial of known speed."""

import pytest

import fake_trial
from made_records import make_record
from sdnn.runs import ResultStore, sweep
from sdnn.runs.sweep import wall_seconds

STUDY = """
[study]
trials = 2
cases = ["s4"]
[base]
budget.episodes = 1005
[axes]
learning.discount = [0.8, 0.9]
"""


def test_forecasts_use_stored_trials_or_else_one_probe(use_trial, study, tmp_path, monkeypatch):
    probed_seeds, clock = [], [0.0]  # seconds of the patched clock

    class Probed(fake_trial.FakeTrial):
        def __init__(self, **options):
            probed_seeds.append(options["seed"])
            super().__init__(**options)

        def advance(self, n):
            clock[0] += 0.1
            super().advance(n)

    monkeypatch.setattr(sweep.time, "thread_time", lambda: clock[0])
    use_trial(Probed)
    mine = study(STUDY)
    out = tmp_path / "out"
    first = mine.combinations["s4", "discount=0.8"].trials[0]
    with ResultStore(out) as store:
        config = first.spec.canonical_json()
        store.add(make_record(0, config, key=first.key, seconds=3.0))
    forecast = sweep.forecast(mine, out, 1)
    by_variant = {trial["variant"]: trial for trial in forecast["trials"]}
    stored = by_variant["discount=0.8"]
    assert (stored["seconds_of_a_trial"], stored["source"]) == (3.0, "1 stored trial")
    probed = 1005 * 0.1 / 10  # 1,005 episodes, of which 10 take 0.1 s on the patched clock
    for name in ("base", "discount=0.9"):
        assert by_variant[name]["seconds_of_a_trial"] == pytest.approx(probed)
        assert by_variant[name]["source"].startswith("the first ")
    # The discount 0.9 is the base's: two configurations are tried, and one of them is probed.
    assert len(probed_seeds) == 2 + 1
    assert forecast["seconds"] == pytest.approx(3.0 + 2 * probed)  # of one trial of 0.8, two of 0.9


def test_budgets_in_steps_and_in_episodes_have_separate_probes(study, tmp_path, monkeypatch):
    def probe(planned):
        seconds = 3.0 if planned.spec.budget.steps is None else 0.01  # of an episode or a step
        return seconds, 5  # the number of episodes that were run

    monkeypatch.setattr(sweep, "_probe", probe)
    mine = study("""
    [study]
    trials = 1
    [base]
    environment = "CartPole-v1"
    [variants.episodes]
    budget.episodes = 100
    protocol.evaluate_every_episodes = 50
    [variants.steps]
    budget.steps = 20000
    protocol.evaluate_every = 10000
    """)
    forecast = sweep.forecast(mine, tmp_path / "out", 1)
    seconds = [trial["seconds_of_a_trial"] for trial in forecast["trials"]]
    assert seconds == [100 * 3.0, 20_000 * 0.01]


def test_forecasts_run_python_trials_one_at_a_time_and_compiled_ones_on_all_cores(monkeypatch):
    monkeypatch.setattr(sweep, "n_cores", lambda: 16)
    compiled, locked = (8.0, True), (4.0, False)  # seconds of a trial, and whether it is compiled
    assert wall_seconds(4 * [compiled], 2) == 16.0
    assert wall_seconds(2 * [compiled], 4) == 8.0, "no trial is cut in parts"
    assert wall_seconds([compiled, *4 * [locked]], 8) == 4 * 4.0
    assert wall_seconds([], 2) == 0.0
    monkeypatch.setattr(sweep, "n_cores", lambda: 2)
    assert wall_seconds(4 * [compiled], 64) == 16.0, "no more at once than there are cores"
