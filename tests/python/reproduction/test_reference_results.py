"""Stored reference results, and how they decide claims that ten trials leave undecided."""

import importlib.util
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fake_trial
import sdnn.reproduction.claims as reference_module
import sdnn.reproduction.reproduce as reproduce_module
from refusals import refuses
from sdnn.reproduction import EXPERIMENTS, PaperStudy, plan_trials
from sdnn.reproduction.cases import PAPER_EPISODES
from sdnn.reproduction.claims import (
    CLAIMS,
    HEADER,
    Check,
    CheckOutcome,
    Claim,
    ClaimOutcome,
    ReferenceResult,
    TenTrials,
    Verdict,
    is_paper_scale,
    judge_claims,
    reference_results,
)
from sdnn.reproduction.report import Report
from sdnn.runs import Estimate, ResultStore, measure, run_trials
from sdnn.runs.results import STEP_MEASURES, TrialMeasures
from sdnn.runs.sweep import run_study

_SCRIPT = Path(__file__).parents[3] / "docs" / "studies" / "write_reference_results.py"
_SPEC = importlib.util.spec_from_file_location("write_reference_results", _SCRIPT)
script = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(script)

CASES = {case.id: case for experiment in EXPERIMENTS for case in experiment.cases}


def measured(case_id, values, agent="sdnn-c", **changes):
    """Return measures of trials with these final steps; all their evaluations are solved."""
    n = len(values)
    measures = {
        "episodes_to_learn": np.full(n, 10.0),
        "early_steps": np.full(n, 4.0),
        "episode_of_collapse": np.full(n, math.inf),
        "final_steps": np.array(values, float),
        "final_share_solved": np.ones(n),
    }
    measures |= {name: np.array(numbers, float) for name, numbers in changes.items()}
    return TrialMeasures(case_id=case_id, agent=agent, last_episode=PAPER_EPISODES, values=measures)


def final_steps(case, **limits):
    return Check(measure="final_steps", case=case, paper="", **limits)


@pytest.mark.parametrize("n_good", [3, 5, 8])
def test_the_chance_of_a_claim_is_a_binomial_tail(n_good):
    # The median of ten trials is at most 6 if six of the ten are good.
    p = n_good / 10
    tail = sum(math.comb(10, k) * p**k * (1 - p) ** (10 - k) for k in range(6, 11))
    values = n_good * [4] + (10 - n_good) * [50]
    claim = Claim(1, "", (final_steps("s4", at_most=6),))
    chance = TenTrials([measured("s4", values)]).chance(claim)
    assert chance.value == pytest.approx(tail, abs=4 * math.sqrt(tail * (1 - tail) / 10_000))
    assert chance.lower < chance.value < chance.upper
    assert chance == TenTrials([measured("s4", values)]).chance(claim)


def test_checks_of_a_claim_are_drawn_together():
    draws = TenTrials([measured("s4", 5 * [4] + 5 * [50])])
    few, also_few = final_steps("s4", at_most=6), final_steps("s4", at_most=7)
    many = final_steps("s4", at_least=40)
    never = Estimate(0.0, 0.0, 0.0)
    assert draws.chance(Claim(1, "", (few,))) == draws.chance(Claim(1, "", (few, also_few)))
    assert draws.chance(Claim(1, "", (few, many))) == never
    assert draws.chance(Claim(1, "", (few,)), Claim(2, "", (many,))) == never, "of both claims"


def test_chances_count_censored_values_as_the_last_episode():
    # Claim 6: with a fifth sensor the performance collapses later.
    claim = next(claim for claim in CLAIMS if claim.number == 6)
    never_collapses = measured("s5-noise", [4] * 3)
    also_never = measured("s4-noise", [4] * 3)
    assert TenTrials([never_collapses, also_never]).chance(claim).value == 0.0
    early = measured("s4-noise", [4] * 3, episode_of_collapse=[5000, 6000, 7000])
    assert TenTrials([never_collapses, early]).chance(claim).value == 1.0


def test_chances_without_trials_of_every_subject_are_none():
    difference = Check(measure="final_steps", case="s6-noise", minus="s4", paper="", at_most=2)
    claim = Claim(7, "", (difference,))
    assert TenTrials([measured("s4", [4, 4])]).chance(claim) is None
    growth = Check(series="rbf", n_inputs=8, n_fewer=4, paper="", at_least=16)
    growth = Claim(9, "", (growth,))
    assert TenTrials([measured("s4", [4, 4])]).chance(growth) is None


@pytest.mark.parametrize(
    ("verdict", "verdict_with_more", "chance", "decided"),
    [
        ("holds", None, None, "holds"),
        ("undecided", None, None, "undecided"),
        ("undecided", "holds", 0.5, "holds"),
        ("holds", "does not hold", 0.5, "does not hold"),  # more trials overrule fewer
        ("undecided", "undecided", 0.95, "holds"),
        ("undecided", "undecided", 0.94, "inconclusive"),
        ("undecided", "undecided", 0.06, "inconclusive"),
        ("undecided", "undecided", 0.05, "does not hold"),
        ("not judged", "holds", 1.0, "not judged"),
        ("not run", "holds", 1.0, "not run"),
    ],
)
def test_more_trials_or_the_chance_decide_a_claim(verdict, verdict_with_more, chance, decided):
    def outcome(name, **more):
        checked = CheckOutcome(CLAIMS[0].checks[0], None, Verdict(name))
        return ClaimOutcome(CLAIMS[0], (checked,), **more)

    claim = outcome(
        verdict,
        more=None if verdict_with_more is None else outcome(verdict_with_more),
        chance=None if chance is None else Estimate(chance, chance, chance),
    )
    assert claim.decided == Verdict(decided)


def test_reference_trials_decide_claims_only_with_all_cases():
    split = [4] * 5 + [50] * 5
    results = [measured("s4", split), measured("s6", [4] * 10)]
    reference = [measured("s4", [4] * 15 + [50] * 5), measured("s6", [4] * 20)]
    outcomes = {
        outcome.claim.number: outcome for outcome in judge_claims(results, reference=reference)
    }
    solved_at_end, learned_as_soon = outcomes[2], outcomes[8]  # claims by their numbers
    assert solved_at_end.verdict == Verdict.UNDECIDED
    assert solved_at_end.more.checks[0].estimate.value == 4
    assert solved_at_end.decided == Verdict.HOLDS
    assert learned_as_soon.more is None  # the noisy cases are missing
    without_s6 = judge_claims(results, reference=reference[:1])
    assert [outcome.more for outcome in without_s6] == [None] * len(outcomes)


def test_the_reference_results_have_the_papers_settings_and_scale():
    results = reference_results()
    plan = plan_trials(CASES.values(), 1, results[0].root_seed)
    planned = {(*p.key[:2], p.key.config_hash) for p in plan}
    assert {(result.case_id, result.agent, result.config_hash) for result in results} == planned, (
        "if no row changed, run docs/studies/write_reference_results.py --rekey"
    )
    for result in results:
        assert result.n_trials >= 100
        assert len(set(result.rows_digests)) == result.n_trials
        assert is_paper_scale(result)
        assert result.root_seed != 0  # what `sdnn reproduce` runs by default is not among them


@pytest.mark.parametrize("agent", ["sdnn-c", "fuzzy"])
def test_a_repeated_trial_equals_its_reference_result(tmp_path, agent):
    reference = next(
        result for result in reference_results() if (result.case_id, result.agent) == ("s4", agent)
    )
    plan = plan_trials([CASES["s4"]], 1, reference.root_seed)
    of_agent = [planned for planned in plan if planned.key.agent == agent]
    with ResultStore(tmp_path) as store:
        run_trials(of_agent, store)
        (record,) = store.load()
    assert record.rows.digest()[:16] == reference.rows_digests[0]
    summary = measure("", (record,))
    for name in STEP_MEASURES:
        assert summary.values[name][0] == reference.values[name][0]


@pytest.fixture
def fake_results(tmp_path, run, collected):
    """Twelve fake trials of all episodes in each case of Experiment A."""
    run(tmp_path, plan_trials(EXPERIMENTS[0].cases, 12, 0))
    return collected(EXPERIMENTS[0], tmp_path, 12)


def test_written_reference_results_are_read_unchanged(monkeypatch, tmp_path, fake_results):
    root_seed = 7
    content = script.reference_csv(fake_results, root_seed)
    (tmp_path / "kept.csv").write_bytes(content)
    assert tuple(content.decode().splitlines()[0].split(",")) == HEADER
    monkeypatch.setattr(reference_module, "_FILES", tmp_path)
    monkeypatch.setattr(reference_module, "FILE_NAME", "kept.csv")
    read = reference_module.reference_results.__wrapped__()
    assert [(result.case_id, result.root_seed, result.n_trials) for result in read] == [
        ("s4", root_seed, 12), ("s6", root_seed, 12)
    ]  # fmt: skip
    for result, summary in zip(read, fake_results, strict=True):
        assert result.config_hash == summary.config_hash
        for name in STEP_MEASURES:
            np.testing.assert_array_equal(result.values[name], summary.values[name])


def test_short_trials_are_refused_as_reference_results(fake_results):
    short = replace(fake_results[0], last_episode=300)  # in case s4; the paper has 15,000
    refuses("s4", script.reference_csv, [short], 7)


def report_of(results, reference=()):
    return Report(
        experiments=((EXPERIMENTS[0], tuple(results)),), costs=(), quick=False, seed=0,
        reference=tuple(reference),
    )  # fmt: skip


def test_reports_show_reference_results_where_there_are_any(fake_results):
    picture = {"experiment-a": b"<svg xmlns='http://www.w3.org/2000/svg'/>"}
    without = report_of(fake_results)
    assert "With more trials" not in [table.title for table in without.page(picture).tables]
    assert "With more trials" not in without.page(picture).to_html("")
    assert without.to_json()["claims"][0]["with_more_trials"] is None

    # Claim 2: the median of the final steps is at most 10 in s4 and in s6. It holds by the fake
    # trials (3 to 7 steps), but the larger reference results overrule them: in s4 half of the
    # trials take 4 steps and half 50, so that the median, 27, may as well be 4 or 50.
    half = measured("s4", 10 * [4] + 10 * [50])
    reference = [
        ReferenceResult(**vars(result), config_hash="", root_seed=7, rows_digests=())
        for result in (half, measured("s6", 20 * [4]))
    ]
    report = report_of(fake_results, reference)
    tables = [*report.page(picture).tables]
    assert [row[-1] for row in tables[0].rows if row[0] == "2"] == ["inconclusive"]
    rows = next(table.rows for table in tables if table.title == "With more trials")
    claim_row = next(row for row in rows if row[0] == "2")
    *_, verdict, chance = claim_row
    assert verdict == "inconclusive"
    # 37.7 %: at least six of ten trials take 4 steps, each with probability 1/2, so that the median
    # is at most 10. That is neither nearly always nor hardly ever: inconclusive.
    assert chance.startswith("3")
    first = rows.index(claim_row) + 1
    of_checks = [(trials, ours, word) for *_, trials, ours, word, _ in rows[first : first + 2]]
    assert of_checks == [("20", "27 [4, 50]", "undecided"), ("20", "4 [4, 4]", "holds")]
    claim = next(result for result in report.to_json()["claims"] if result["number"] == 2)
    # "verdict" is by the fake trials alone, "decided" by the reference results, too.
    assert (claim["verdict"], claim["decided"]) == ("holds", "inconclusive")
    page = report.page(picture).to_html("")
    assert "root seed 7" in page
    assert 'class="verdict open">inconclusive</td>' in page


def test_reference_results_are_shown_for_fewer_trials_of_the_same_settings_only(
    monkeypatch, tmp_path, use_trial
):
    use_trial(fake_trial.FakeTrial)

    def shown_results(**request):
        reports = []
        monkeypatch.setattr(
            reproduce_module,
            "Report",
            lambda **parts: reports.append(Report(**parts)) or reports[-1],
        )
        run_study(PaperStudy("a", **request), tmp_path)
        return {(result.case_id, result.n_trials) for result in reports[0].reference}

    n_stored = reference_results()[0].n_trials
    assert shown_results(n_trials=2) == {("s4", n_stored), ("s6", n_stored)}
    assert shown_results(n_trials=2, n_episodes=100) == set()
    assert shown_results(n_trials=n_stored + 1) == set()
