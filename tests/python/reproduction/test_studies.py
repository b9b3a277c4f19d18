"""Comparisons of hand-made trials: paired differences, claims, tables and figure."""

import json
import math

import numpy as np
import pytest

from made_records import make_record
from sdnn.reports.plots import figure_bytes
from sdnn.reports.statistics import Estimate
from sdnn.reproduction.claims import Verdict
from sdnn.reproduction.reproduce import judge_variants
from sdnn.runs.figures import draw_study
from sdnn.runs.report import format_estimate
from sdnn.runs.study import compare
from sdnn.runs.sweep import study_json, study_page


def record(study, case, variant, number, steps, returns=None):
    """Return a trial whose evaluations took these steps; one of 50 steps is not solved."""
    return make_record(
        config=study.combinations[case, variant].spec.canonical_json(),
        key=study.keys(case, variant)[number],
        steps=steps,
        returns=np.zeros(len(steps)) if returns is None else returns,
    )


def page_of(comparison):
    return study_page(comparison, "abc", comparison.study.additions(comparison), b"<svg/>")


def json_of(comparison):
    return study_json(comparison, "abc", comparison.study.additions(comparison))


def steps_of(*runs):
    """Return steps of evaluations from pairs: a number of evaluations, and the steps of each."""
    return np.concatenate([np.full(n, steps) for n, steps in runs])


TWO = """
[study]
trials = 4
cases = ["s4-noise"]
reference = "old"
[variants.old]
[variants.new]
title = "the new one"
learning.discount = 0.8
"""
OLD = [((100, 4),), ((100, 4),), ((60, 4), (40, 50)), ((100, 50),)]
NEW = [((100, 4),), ((50, 50), (50, 4)), ((100, 4),), ((95, 4), (5, 50))]


def records_of_old_and_new(study):
    return [
        record(study, "s4-noise", variant, number, steps_of(*runs))
        for variant, trials in (("old", OLD), ("new", NEW))
        for number, runs in enumerate(trials)
    ]


def test_differences_between_variants_are_paired_by_trial(study):
    mine = study(TWO)
    comparison = compare(mine, records_of_old_and_new(mine))
    old, new = (comparison.measured["s4-noise", name] for name in ("old", "new"))
    # Shares of the last 50 evaluations with less than 50 steps, of four trials of each variant:
    # 40 failed ones at the end leave 0.2, five leave 0.9.
    assert old.result.values["final_share_solved"].tolist() == [1.0, 1.0, 0.2, 0.0]
    assert new.result.values["final_share_solved"].tolist() == [1.0, 1.0, 1.0, 0.9]
    assert old.solved_at_end.tolist() == [True, True, False, False]
    assert new.solved_at_end.tolist() == [True, True, True, True]
    assert old.differences == {}
    share = new.differences["final_share_solved"]
    assert share.value == pytest.approx((0 + 0 + 0.8 + 0.9) / 4)
    # Means of four draws out of 0, 0, 0.8, 0.9: all of them 0 or 0.9 with probability 1/256.
    assert share.lower == 0.0
    assert 0.8 <= share.upper <= 0.9
    # A trial has collapsed after the last 50 successive evaluations of which 26 are good: of 60
    # good ones and 40 others, those that end with evaluation 84, at episode 840.
    assert old.result.values["episode_of_collapse"].tolist() == [math.inf, math.inf, 840.0, 0.0]
    assert new.result.values["episode_of_collapse"].tolist() == 4 * [math.inf]
    # A trial without a collapse counts as its last episode: 1000 - 840 and 1000 - 0.
    assert new.differences["episode_of_collapse"].value == (0 + 0 + 160 + 1000) / 4


LENGTHS = """
[study]
trials = 6
cases = ["s4", "s4-noise"]
reference = "short"
[base]
budget.episodes = 1000
[variants.short]
[variants.long]
budget.episodes = 3000
"""


def test_variants_with_longer_trials_only_do_not_differ(study):
    mine = study(LENGTHS)
    runs = {
        ("s4", "short"): ((100, 4),), ("s4", "long"): ((300, 4),),
        ("s4-noise", "short"): ((100, 50),), ("s4-noise", "long"): ((200, 50), (100, 4)),
    }  # fmt: skip
    records = [
        record(mine, case, variant, number, steps_of(*runs_of_trial))
        for (case, variant), runs_of_trial in runs.items()
        for number in range(6)
    ]
    comparison = compare(mine, records)
    for case, name in (("s4", "episode_of_collapse"), ("s4-noise", "episodes_to_learn")):
        longer = comparison.measured[case, "long"]
        assert longer.differences[name].value == 0.0
        assert not longer.differs(name)
    tables = {table.title: table for table in page_of(comparison).tables}
    table = tables["Case I: 4 inputs, no noise"]
    column = table.header.index("episode of collapse")
    collapses = [row[column] for row in table.rows]
    assert collapses == [">1,000 [>1,000, >1,000]", ">3,000 [>3,000, >3,000]"]
    (row,) = tables["Case I: 4 inputs, no noise: minus short, trial by trial"].rows
    assert not any("*" in cell for cell in row), "the mark of a difference"
    png, _ = figure_bytes(draw_study(comparison, "footer"))
    assert png.startswith(b"\x89PNG")


def test_claims_of_each_case_are_censored_at_its_last_episode(study):
    text = LENGTHS.replace('"s4", "s4-noise"', '"s4", "s4-noise", "s6"')
    mine = study(text + "[variants.long.cases.s6]\nbudget.episodes = 5000\n")
    n_tests = {"s4": 300, "s4-noise": 300, "s6": 500}
    records = [
        record(mine, case, "long", number, steps_of((n, 50)))
        for case, n in n_tests.items()
        for number in range(6)
    ]
    comparison = compare(mine, records)
    claim = judge_variants(comparison)["long"][1]  # the episodes to learn in s4 and in s6
    assert [checked.last_episode for checked in claim.checks] == [3000, 5000]
    checks_in_json = json_of(comparison)["claims"][0]["checks"]
    assert [check["ours"]["value"] for check in checks_in_json] == [">3000", ">5000"]


@pytest.mark.parametrize(
    ("value", "lower", "upper", "text"),
    [
        (0.00498, 0.0049, 0.0051, "0.00498 [0.0049, 0.0051]"),  # an interval of 0.0002
        (-0.04, -0.1, 3.0, "0 [-0.1, 3]"),  # of 3.1
        (-159.44, -173.9, -149.8, "-159.4 [-173.9, -149.8]"),  # at least one decimal
        (1234567.8, 1230000.0, 1240000.0, "1,234,567.8 [1,230,000, 1,240,000]"),
        (0.0, 0.0, 0.0, "0 [0, 0]"),
    ],
)
def test_returns_have_two_significant_digits_of_their_interval(value, lower, upper, text):
    assert format_estimate(Estimate(value, lower, upper), "final_return") == text


def test_differences_of_returns_are_formatted_with_their_signs():
    same, mixed = Estimate(0.01, 0.01, 0.01), Estimate(-0.01, -0.02, 0.01)
    assert format_estimate(same, "mean_return", sign="+") == "+0.01 [+0.01, +0.01]"
    assert format_estimate(mixed, "mean_return", sign="+") == "-0.01 [-0.02, +0.01]"


def test_differences_of_fewer_than_six_trials_are_not_called_different(study):
    # Differences of equal variants all have one sign with probability 2 * 0.5**n: 6 % of 5 trials,
    # more than the 5 % outside an interval, but 3 % of 6.
    for n_trials, differs in ((5, False), (6, True)):
        mine = study(TWO, n_trials=n_trials)
        records = [
            record(mine, "s4-noise", variant, n, steps_of((60, steps)))
            for variant, steps in (("old", 50), ("new", 4))
            for n in range(n_trials)
        ]
        new = compare(mine, records).measured["s4-noise", "new"]
        assert new.differences["final_steps"].upper == 4 - 50
        assert new.differs("final_steps") is differs
        assert not new.differs("mean_return")


def test_incomplete_combinations_are_omitted_with_a_warning(study):
    mine = study(TWO)
    records = records_of_old_and_new(mine)
    comparison = compare(mine, records[:-1])  # without the last trial of `new`
    assert list(comparison.measured) == [("s4-noise", "old")]
    assert page_of(comparison).warnings[0].startswith("Not complete: 1 of 2 combinations")
    comparison = compare(mine, records[4:])  # without the four trials of `old`, the reference
    assert comparison.measured["s4-noise", "new"].differences == {}
    assert compare(mine, ()).measured == {}


CLAIMED = """
[study]
trials = 10
cases = ["s4", "s4-noise", "s5-noise", "s6-noise"]
[variants.old]
[variants.new]
learning.discount = 0.8
[variants.fuzzy]
agent = "fuzzy"
"""


def claimed_records(study, n_trials=10):
    """Yield trials that are solved to the end, but those of `old` in Case II collapse half-way.

    So with `old` the claims hold that SDNN-C collapses in Case II and later with more inputs.
    """
    good, lost = steps_of((1500, 4)), steps_of((750, 4), (750, 50))
    for variant in ("old", "new", "fuzzy"):
        for case in ("s4", "s4-noise", "s5-noise", "s6-noise"):
            steps = lost if case == "s4-noise" and variant == "old" else good
            for number in range(n_trials):
                yield record(study, case, variant, number, steps)


@pytest.fixture
def claimed(study):
    mine = study(CLAIMED)
    return compare(mine, claimed_records(mine))


def test_claims_are_judged_for_each_variant(claimed):
    verdicts = {
        variant: {n: c.verdict for n, c in claims.items()}
        for variant, claims in judge_variants(claimed).items()
    }
    assert verdicts == {
        "old": {5: Verdict.HOLDS, 6: Verdict.HOLDS, 7: Verdict.HOLDS},
        "new": {5: Verdict.FAILS, 6: Verdict.FAILS, 7: Verdict.HOLDS},
        "fuzzy": {3: Verdict.HOLDS, 4: Verdict.FAILS},
    }


def test_reports_and_json_of_a_study_show_the_verdicts_of_claims(claimed):
    overview = next(page_of(claimed).tables)
    assert overview.header == ("variant", "claim 3", "claim 4", "claim 5", "claim 6", "claim 7")
    assert overview.rows[1] == ("new", "-", "-", "does not hold", "does not hold", "holds")
    page = page_of(claimed).to_html("")
    # Claims 5 and 6 of `new` and 4 of `fuzzy`; then 5 to 7 of `old`, 7 of `new`, 3 of `fuzzy`.
    assert page.count('class="verdict bad">does not hold</td>') >= 3
    assert page.count('class="verdict good">holds</td>') >= 5
    checks = next(t for t in page_of(claimed).tables if t.title == "Each quantity of the claims")
    assert next(row[:2] for row in checks.rows if row[0] == "fuzzy") == ("fuzzy", "3")
    table = json_of(claimed)
    assert {(c["variant"], c["number"], c["verdict"]) for c in table["claims"]} >= {
        ("new", 5, "does not hold"), ("new", 7, "holds"), ("old", 5, "holds"),
    }  # fmt: skip


def test_chances_are_shown_from_20_trials_on(study):
    def chances(n_trials):
        mine = study(CLAIMED, n_trials=n_trials)
        return compare(mine, claimed_records(mine, n_trials))

    def tables(comparison):
        return {table.title: table for table in page_of(comparison).tables}

    title = "How often ten trials show the claims"
    assert title not in tables(chances(19))
    comparison = chances(20)
    table = tables(comparison)[title]
    assert table.header[1:] == tuple(f"claim {n}" for n in (3, 4, 5, 6, 7))
    always, never = "100 % [100, 100]", "0 % [0, 0]"
    assert table.rows == [
        ("old", "-", "-", always, always, always),
        ("new", "-", "-", never, never, always),
        ("fuzzy", always, never, "-", "-", "-"),
    ]
    chances_in_json = {
        (c["variant"], c["number"]): c["ten_trials_show_it"] for c in json_of(comparison)["claims"]
    }
    assert chances_in_json["new", 6] == {"value": 0.0, "lower": 0.0, "upper": 0.0}
    assert title in page_of(comparison).to_html("")


def test_small_studies_are_not_judged_and_show_claims_of_complete_cases_only(study):
    mine = study(CLAIMED, n_trials=2)
    records = [
        record(mine, case, variant, number, steps_of((60, 4)))
        for case, variant in mine.combinations
        for number in range(2)
        if case != "s5-noise"
    ]
    comparison = compare(mine, records)
    judged = {
        number: claim
        for claims in judge_variants(comparison).values()
        for number, claim in claims.items()
    }
    assert sorted(judged) == [3, 5, 7], "claims that need no trials of s5-noise"
    assert {claim.verdict for claim in judged.values()} == {Verdict.NOT_JUDGED}


OWN = "[base]\nenvironment = 'sdnn/PaperAcrobot-v0'\n"


def test_custom_cases_have_no_claims(study):
    # The case "mine" is the paper's acrobot, whose ten trials solve it in 4 steps to the end.
    mine = study(OWN + "[study]\ntrials = 10\n[cases.mine]\n[variants.a]\n")
    records = [record(mine, "mine", "a", n, steps_of((1500, 4))) for n in range(10)]
    assert not any(judge_variants(compare(mine, records)).values())


MIXED = """
[study]
title = "Both | kinds"
trials = 2
[cases.s4]
[cases.swing]
title = "A pendulum"
environment.id = "Pendulum-v1"
[variants.a]
[variants.b]
learning.discount = 0.5
[variants.c]
learning.tie_rule = "uniform"
"""


@pytest.fixture
def mixed(study):
    mine = study(MIXED)
    records = [
        record(mine, case, variant, number, steps_of((20, 4 + number)), shift + np.arange(20.0))
        for case in ("s4", "swing")
        for variant, shift in (("a", 0.0), ("b", 10.0))
        for number in range(2)
    ]
    return compare(mine, records)


def test_other_environments_are_measured_by_their_returns(mixed):
    swing = mixed.measured["swing", "b"]
    assert tuple(swing.result.values) == ("final_return", "mean_return")
    assert swing.result.values["final_return"].tolist() == 2 * [10 + (18 + 19) / 2]  # last 2 of 20
    assert swing.result.values["mean_return"].tolist() == 2 * [10 + (0 + 19) / 2]
    assert swing.differences["mean_return"].value == 10.0
    assert swing.solved_at_end is None


def test_tables_have_a_row_for_each_variant_in_each_case(mixed):
    tables = {table.title: (table.header, table.rows) for table in page_of(mixed).tables}
    header, rows = tables["Case I: 4 inputs, no noise"]
    assert header[:5] == ("variant", "agent", "trials", "end solved", "episodes to learn")
    # The tie rule of c is that of a: the same trials.
    assert [row[0] for row in rows] == ["a", "b", "c"]
    assert rows[0][:5] == ("a", "SDNN-C", "2", "2 of 2", "10 [10, 10]")
    header, rows = tables["A pendulum: minus a, trial by trial"]
    assert header == ("variant", "final return", "mean return")
    assert rows == [
        ("b", "+10 [+10, +10]", "+10 [+10, +10]"), ("c", "0 [0, 0]", "0 [0, 0]"),
    ]  # fmt: skip
    assert "The variant c is the same as a." in page_of(mixed).notes
    assert page_of(mixed).warnings == []
    text = page_of(mixed).to_markdown()
    assert text.startswith("# Both \\| kinds\n\n3 variants in 2 cases, 2 trials each; reference:")
    assert "| b | +10 [+10, +10] | +10 [+10, +10] |" in text


def test_the_json_table_of_a_study_has_variants_measures_and_differences(mixed):
    table = json.loads(json.dumps(json_of(mixed), allow_nan=False))
    assert [(r["case"], r["variant"], r["n_end_solved"]) for r in table["results"]] == [
        ("s4", "a", 2), ("s4", "b", 2), ("s4", "c", 2),
        ("swing", "a", None), ("swing", "b", None), ("swing", "c", None),
    ]  # fmt: skip
    assert table["variants"][2] == {"id": "c", "title": "c", "same_as": "a"}
    swing = table["results"][4]
    assert swing["measures"]["mean_return"]["trials"] == [19.5, 19.5]
    assert swing["differences"]["mean_return"] == {"value": 10.0, "lower": 10.0, "upper": 10.0}


def test_the_figure_shows_every_trial_and_is_reproducible(mixed):
    figure = draw_study(mixed, "footer")
    assert figure_bytes(figure) == figure_bytes(draw_study(mixed, "footer"))
    assert "filled: the reference, and what" in figure.texts[-1].get_text()
    assert [axes.get_title("left") for axes in figure.axes] == [
        "Case I: 4 inputs, no noise", "A pendulum", "", "",  # two measures of each case
    ]  # fmt: skip
    for axes in figure.axes:
        assert len(axes.collections) == 3, "variants"
        positions_of_trials = [dots.get_offsets() for dots in axes.collections]
        assert all(positions.shape == (2, 2) for positions in positions_of_trials)
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["a", "b", "c"]


def test_a_narrow_figure_has_its_panels_and_names_below_each_other(mixed):
    figure = draw_study(mixed, "footer", narrow=True)
    figure.draw_without_rendering()
    lefts = [round(axes.get_position().x0, 3) for axes in figure.axes]
    tops = [axes.get_position().y1 for axes in figure.axes]
    assert len(set(lefts)) == 1
    assert tops == sorted(tops, reverse=True)
    for axes in figure.axes:
        assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b", "c"]
    width = figure.get_window_extent().x1
    assert all(text.get_window_extent().x1 <= width for text in figure.texts)


def test_many_cases_wrap_to_the_next_row(study):
    mine = study(OWN + "[study]\ntrials = 1\n" + "".join(f"[cases.c{i}]\n" for i in range(7)))
    records = [record(mine, f"c{i}", "base", 0, steps_of((60, 4))) for i in range(7)]
    figure = draw_study(compare(mine, records), "")
    assert len(figure.axes) == 2 * 5 * 2  # two rows of five cases, with two panels for each
    assert sum(axes.get_visible() for axes in figure.axes) == 7 * 2
