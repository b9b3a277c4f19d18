import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from sdnn.experiments import (
    CaseResult,
    PlotUnavailableError,
    ResultStore,
    collect,
    draw_experiment,
    save_figure,
    select_experiments,
    summarize,
)
from sdnn.experiments.report import (
    FAILS,
    HOLDS,
    NOT_JUDGED,
    OPEN,
    ExperimentReport,
    claim_rows,
    format_estimate,
    judge,
    to_json,
    to_markdown,
)
from sdnn.experiments.reproduce import ReproduceRequest, reproduce
from sdnn.experiments.statistics import Estimate

(EXPERIMENT,) = select_experiments("a")


@pytest.fixture
def results(tmp_path, fake, run):
    """Three fake trials of 3000 episodes, beside trials of another seed in the same store."""
    run(tmp_path, fake.make_plan(2, 3000, root_seed=9))
    plan = fake.make_plan(3, 3000)
    run(tmp_path, plan)
    with ResultStore(tmp_path) as store:
        return collect(EXPERIMENT, [p.key for p in plan], store)


def all_text(figure):
    texts = [text.get_text() for text in figure.texts]
    for axes in figure.axes:
        texts += [text.get_text() for text in axes.texts] + [axes.get_title("left")]
    return "\n".join(texts)


def test_panels_hold_the_stored_rows(results):
    figure = draw_experiment(EXPERIMENT, results)
    for axes, result in zip(figure.axes[:2], results, strict=True):
        (line,) = axes.get_lines()
        np.testing.assert_array_equal(line.get_xdata(), 10 * np.arange(1, 301))
        np.testing.assert_array_equal(line.get_ydata(), np.median(result.steps, axis=0))
        (band,) = axes.collections
        (path,) = band.get_paths()
        drawn = {(float(x), float(y)) for x, y in path.vertices}
        lower, upper = np.percentile(result.steps, (25, 75), axis=0)
        for i in (0, 5, 120, 299):
            assert {(10.0 * (i + 1), lower[i]), (10.0 * (i + 1), upper[i])} <= drawn
        assert axes.get_ylim() == (0, 50)
        assert axes.get_xlim() == (0, 3000)


def test_start_has_panels_of_its_own_in_long_runs(results):
    figure = draw_experiment(EXPERIMENT, results)
    assert len(figure.axes) == 4
    for axes, start in zip(figure.axes[:2], figure.axes[2:], strict=True):
        assert start.get_xlim() == (0, 500)
        np.testing.assert_array_equal(
            start.get_lines()[0].get_ydata(), axes.get_lines()[0].get_ydata()
        )
    without = replace(EXPERIMENT, start_panels=False)
    assert len(draw_experiment(without, results).axes) == 2


def test_only_the_planned_trials_are_drawn(results):
    assert [result.n_trials for result in results] == [3, 3]


def test_figure_says_what_it_is(results):
    text = all_text(draw_experiment(EXPERIMENT, results))
    assert "3 trials x 3,000 episodes instead of 10 x 15,000" in text
    assert "quick" not in text.lower()
    for result in results:
        assert result.config_hash[:8] in text
    quick = all_text(draw_experiment(EXPERIMENT, results, quick=True))
    assert "QUICK LOOK, not the result" in quick
    assert quick.count("quick") == 2  # a watermark in each panel


def test_figure_files_are_whole_and_repeatable(results, tmp_path):
    files = save_figure(draw_experiment(EXPERIMENT, results), tmp_path / "one.v1")
    again = save_figure(draw_experiment(EXPERIMENT, results), tmp_path / "two")
    assert [file.name for file in files] == ["one.v1.png", "one.v1.svg"]
    assert files[0].read_bytes().startswith(b"\x89PNG")
    assert files[1].read_text().rstrip().endswith("</svg>")
    for first, second in zip(files, again, strict=True):
        assert first.read_bytes() == second.read_bytes()


def test_missing_matplotlib_is_told_before_any_trial(monkeypatch, tmp_path, fake):
    monkeypatch.setattr("sdnn.experiments.figures.find_spec", lambda name: None)

    def make(config, seed):
        raise AssertionError("a trial was made")

    request = ReproduceRequest(experiments=(EXPERIMENT,), out=tmp_path / "out", quick=True)
    with pytest.raises(PlotUnavailableError, match=re.escape('pip install "sdnn[plot]"')):
        reproduce(request, make, version="0")
    assert not (tmp_path / "out").exists()


def test_mixed_settings_are_refused(results):
    (first, *others) = results[0].records
    odd = replace(first, key=first.key._replace(config_hash="other"))
    with pytest.raises(ValueError, match="share one configuration, got 2"):
        CaseResult(results[0].case, "sdnn-c", (odd, *others))
    with pytest.raises(ValueError, match="got 0"):
        CaseResult(results[0].case, "sdnn-c", ())


def test_summary_of_hand_made_trials(results):
    summary = summarize(results[0])
    steps = results[0].steps
    first_good = [10.0 * (1 + int(np.argmax(row < 50))) for row in steps]
    assert summary.values["episodes_to_learn"].tolist() == first_good
    assert summary.medians["episodes_to_learn"].value == np.median(first_good)
    assert summary.medians["final_share_solved"] == Estimate(1.0, 1.0, 1.0)
    assert summary.median_curve_episodes_to_learn == np.median(first_good)
    assert results[0].n_decisions == 3 * 7 * 3000
    assert results[0].microseconds_per_decision == pytest.approx(
        1e6 * sum(r.seconds for r in results[0].records) / 63000
    )


def scaled(summary, value, lower, upper, n_trials=10, last=15000):
    """The same summary as if it came from trials of the paper's number and length."""
    records = tuple(
        replace(r, rows=replace(r.rows, episode=np.append(r.rows.episode[:-1], np.int32(last))))
        for r in (summary.result.records * n_trials)[:n_trials]
    )
    medians = summary.medians | {"episodes_to_learn": Estimate(value, lower, upper)}
    return replace(summary, result=replace(summary.result, records=records), medians=medians)


@pytest.mark.parametrize(
    ("interval", "verdict"),
    [
        ((100, 80, 150), HOLDS),
        ((140, 120, 160), OPEN),
        ((300, 160, math.inf), FAILS),
    ],
)
def test_claims_are_judged_by_the_interval(results, interval, verdict):
    claim = EXPERIMENT.claims[0]
    summary = summarize(results[0])
    assert judge(claim, scaled(summary, *interval)) == verdict
    assert judge(claim, scaled(summary, *interval, n_trials=9)) == NOT_JUDGED
    assert judge(claim, scaled(summary, *interval, last=14990)) == NOT_JUDGED


def test_estimates_as_text():
    assert format_estimate(Estimate(4.0, 3.5, 5.0), "final_steps", 100) == "4 [3.5, 5]"
    assert format_estimate(Estimate(0.98, 0.9, 1.0), "final_share_solved", 100) == (
        "98 % [90 %, 100 %]"
    )
    assert format_estimate(Estimate(math.inf, 90, math.inf), "episodes_to_learn", 15000) == (
        ">15000 [90, >15000]"
    )
    assert format_estimate(Estimate(4.0, math.nan, math.nan), "final_steps", 100) == "4"


def test_tables_hold_the_claims_and_valid_json(results):
    report = ExperimentReport(EXPERIMENT, tuple(summarize(result) for result in results))
    rows = claim_rows(report)
    assert [(row[0], row[2]) for row in rows] == [
        (number, case.title) for number in "12" for case in EXPERIMENT.cases
    ]
    never = replace(
        report.summaries[0],
        values=report.summaries[0].values | {"episodes_to_learn": np.array([math.inf])},
    )
    table = to_json([ExperimentReport(EXPERIMENT, (never,))], quick=True)
    text = json.dumps(table, allow_nan=False)
    (case,) = json.loads(text)["experiments"][0]["cases"]
    assert case["measures"]["episodes_to_learn"]["trials"] == [">3000"]
    markdown = to_markdown([report], quick=True, footer="seed 0")
    assert "not its result" in markdown
    tables = [line for line in markdown.splitlines() if line.startswith("|")]
    assert len(tables) == 2 * 2 + 2 + 4
