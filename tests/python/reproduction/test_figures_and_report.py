"""Figures and reports of experiments, drawn from fake trials."""

import base64
import io
import itertools
import json
import math
import re
from dataclasses import replace
from html import escape

import numpy as np
import pytest
from rich.console import Console

import fake_trial
from refusals import refuses
from sdnn.reports.plots import figure_bytes
from sdnn.reports.statistics import Estimate, running_median
from sdnn.reproduction import PaperStudy, draw_experiment, plan_trials, select_experiments
from sdnn.reproduction.report import Report
from sdnn.runs import AGENTS, ResultStore, measure
from sdnn.runs.engine import TrialsOutcome
from sdnn.runs.figures import SMOOTHED_TESTS, agent_colors
from sdnn.runs.report import describe_call, format_estimate
from sdnn.runs.sweep import run_study
from sdnn.runs.trial import ROW_HEADER, records_digest, trial_rows

(EXPERIMENT,) = select_experiments("a")
PICTURES = {"experiment-a": b"<svg xmlns='http://www.w3.org/2000/svg'/>"}


@pytest.fixture
def results(tmp_path, run, collected):
    """Three fake trials of 3000 episodes, beside trials of another seed in the same store."""
    run(tmp_path, fake_trial.make_plan(2, 3000, root_seed=9))
    run(tmp_path, fake_trial.make_plan(3, 3000))
    return collected(EXPERIMENT, tmp_path, 3, 3000)


def all_text(figure):
    texts = [text.get_text() for text in figure.texts]
    for axes in figure.axes:
        texts += [text.get_text() for text in axes.texts] + [axes.get_title("left")]
    return "\n".join(texts)


def curves_of(axes):
    """Return the lines of a panel as (x, y), the thick one before the thin one."""
    lines = sorted(axes.get_lines(), key=lambda line: -line.get_linewidth())
    return [(line.get_xdata(), line.get_ydata()) for line in lines]


def test_panels_show_medians_and_quartiles_of_the_stored_rows(results):
    figure = draw_experiment(EXPERIMENT, results)
    for axes, result in zip(figure.axes[:2], results, strict=True):
        (_, smooth), (x, thin) = curves_of(axes)
        np.testing.assert_array_equal(x, 10 * np.arange(1, 301))  # episodes of evaluations
        np.testing.assert_array_equal(thin, np.median(result.steps, axis=0))
        np.testing.assert_array_equal(smooth, running_median(thin, SMOOTHED_TESTS))
        (band,) = axes.collections
        (path,) = band.get_paths()
        drawn = {(float(x), float(y)) for x, y in path.vertices}
        lower, upper = (
            running_median(q, SMOOTHED_TESTS) for q in np.percentile(result.steps, (25, 75), axis=0)
        )
        for i in (0, 5, 120, 299):
            episode = 10.0 * (i + 1)
            assert {(episode, lower[i]), (episode, upper[i])} <= drawn
        assert axes.get_ylim() == (0, 50)
        assert axes.get_xlim() == (0, 3000)


def test_short_trials_are_drawn_without_smoothing(tmp_path, run, collected):
    run(tmp_path, fake_trial.make_plan(2, 300))  # episodes; curves are smoothed from 2,000 on
    results = collected(EXPERIMENT, tmp_path, 2, 300)
    for axes, result in zip(draw_experiment(EXPERIMENT, results).axes, results, strict=True):
        ((_, line),) = curves_of(axes)
        np.testing.assert_array_equal(line, np.median(result.steps, axis=0))


def test_a_figure_states_its_trials_and_configurations(results):
    assert [result.n_trials for result in results] == [3, 3], "without trials of another seed"
    text = all_text(draw_experiment(EXPERIMENT, results))
    assert "3 trials x 3,000 episodes instead of 10 x 15,000" in text
    assert "quick" not in text.lower()
    for result in results:
        assert result.config_hash[:8] in text  # figures show 8 digits


def test_a_quick_figure_is_marked_in_its_title_and_panels(results):
    quick = all_text(draw_experiment(EXPERIMENT, results, quick=True))
    assert "QUICK LOOK, not the result" in quick
    assert quick.count("quick") == 2  # a watermark in each panel


def test_figures_are_repeatable_to_the_byte(results):
    png, svg = figure_bytes(draw_experiment(EXPERIMENT, results))
    assert png.startswith(b"\x89PNG")
    assert svg.rstrip().endswith(b"</svg>")
    assert (png, svg) == figure_bytes(draw_experiment(EXPERIMENT, results))


def test_a_reproduction_reads_each_trial_once(monkeypatch, tmp_path, use_trial):
    use_trial(fake_trial.FakeTrial)
    read_trials = []
    make_record = ResultStore._make_record

    def make_and_count(*arguments):
        read_trials.append(make_record(*arguments))
        return read_trials[-1]

    monkeypatch.setattr(ResultStore, "_make_record", make_and_count)
    reproduction = run_study(PaperStudy(quick=True), tmp_path)
    # SDNN-C in Case I belongs to both figures: two trials of nine pairs of case and agent.
    assert [len(experiment["cases"]) for experiment in reproduction.table["experiments"]] == [2, 8]
    assert len(read_trials) == 2 * 9
    with ResultStore(tmp_path) as store:
        assert reproduction.table["digest"] == records_digest(store.load())


def test_an_agent_has_the_same_color_in_every_figure(tmp_path, run, collected):
    def titles_and_colors(*agents):
        other = EXPERIMENT.with_agents(agents)
        run(tmp_path, plan_trials(other.cases, 1, 0, 100))
        figure = draw_experiment(other, collected(other, tmp_path, 1, 100))
        (legend,) = figure.legends
        lines = {line.get_color() for line in figure.axes[0].get_lines()}
        return [text.get_text() for text in legend.get_texts()], lines

    titles, color = titles_and_colors("rbf")
    assert titles == ["RBFN"]
    titles, two_colors = titles_and_colors("rbf", "sdnn-c")
    assert titles == ["RBFN", "SDNN-C"]
    assert color < two_colors
    assert len(two_colors) == 2


def test_any_two_agents_of_a_figure_have_different_colors():
    for pair in itertools.combinations(AGENTS, 2):
        assert len(set(agent_colors(pair).values())) == 2


def test_trials_of_mixed_configurations_are_refused(results):
    (first, *others) = results[0].records
    changed = replace(first, key=first.key._replace(config_hash="other"))
    refuses("configuration", measure, "", (changed, *others))
    refuses("0", measure, "", ())  # the number of trials


def test_measures_of_fake_trials_are_as_worked_by_hand(results):
    summary = results[0]
    # Evaluations come every 10 episodes; once less than 50 steps, a fake trial stays good.
    first_good = [10.0 * (1 + int(np.argmax(steps < 50))) for steps in summary.steps]
    assert summary.values["episodes_to_learn"].tolist() == first_good
    assert summary.medians["episodes_to_learn"].value == np.median(first_good)
    assert summary.medians["final_share_solved"] == Estimate(1.0, 1.0, 1.0)
    assert summary.medians["episode_of_collapse"] == Estimate(math.inf, math.inf, math.inf)
    last_episode = 3000.0  # counts as the collapse of a trial that never collapses
    assert summary.uncensored("episode_of_collapse").tolist() == [last_episode] * 3
    assert summary.to_json()["median_curve_episodes_to_learn"] == np.median(first_good)
    n_decisions = 3 * 3000 * 7  # trials, episodes, decisions of each fake episode
    assert summary.n_decisions == n_decisions
    seconds = sum(record.seconds for record in summary.records)
    assert summary.microseconds_per_decision == pytest.approx(1e6 * seconds / n_decisions)


def test_estimates_are_formatted_with_units_and_censoring():
    assert format_estimate(Estimate(4.0, 3.5, 5.0), "final_steps", 100) == "4 [3.5, 5]"
    assert format_estimate(Estimate(0.98, 0.9, 1.0), "final_share_solved", 100) == (
        "98 % [90, 100]"
    )
    assert format_estimate(Estimate(math.inf, 90, math.inf), "episodes_to_learn", 15000) == (
        ">15,000 [90, >15,000]"
    )
    assert format_estimate(Estimate(4.0, math.nan, math.nan), "final_steps", 100) == "4"


@pytest.fixture
def report(results):
    return Report(experiments=((EXPERIMENT, results),), costs=(), quick=False, seed=0)


def test_tables_show_cases_and_claims(report):
    claims, checks, cases = report.page(PICTURES).tables
    assert cases.title.startswith(EXPERIMENT.title)
    assert [row[0] for row in cases.rows] == [case.title for case in EXPERIMENT.cases]
    for table in (claims, checks, cases):
        assert {len(row) for row in table.rows} == {len(table.header)}
    assert [row[0] for row in claims.rows] == ["1", "2", "8"], "claims with cases of Experiment A"
    assert claims.header[-1] == "ours, so far [95 % interval]"
    # Medians of the fake trials, with their intervals.
    assert claims.rows[0][-1] == "episodes to learn: 50 [30, 50], 60 [50, 60]"
    assert {row[-1] for row in checks.rows} == {"not judged", "not run"}


def test_a_terminal_shows_claims_and_on_demand_all_tables(report):
    brief, full = (Console(width=80, file=io.StringIO()) for _ in range(2))
    page = report.page(PICTURES)
    page.print(brief)
    page.print(full, full=True)
    brief_lines, full_lines = (c.file.getvalue().splitlines() for c in (brief, full))
    assert "episodes to learn: 50 [30," in "\n".join(brief_lines)
    assert max(map(len, brief_lines)) <= 80
    assert len(full_lines) > 3 * len(brief_lines)


def test_json_is_valid_and_marks_censored_values(report):
    first = report.results[0]
    never = replace(first, values=first.values | {"episodes_to_learn": np.array([math.inf])})
    table = replace(report, experiments=((EXPERIMENT, (never,)),)).to_json()
    text = json.dumps(table, allow_nan=False)
    (case,) = json.loads(text)["experiments"][0]["cases"]
    assert case["measures"]["episodes_to_learn"]["trials"] == [f">{first.last_episode}"]


def test_json_has_the_limits_of_claims(report):
    check = report.to_json()["claims"][0]["checks"][0]
    # The paper says "within about 150 learning episodes".
    assert (check["at_least"], check["at_most"]) == (None, 150)


def test_the_markdown_report_shows_all_rows_of_tables(report):
    page = replace(report, quick=True).page(PICTURES)
    markdown = page.to_markdown()
    assert "not their result" in markdown
    lines = [line for line in markdown.splitlines() if line.startswith("|")]
    assert len(lines) == sum(2 + len(table.rows) for table in page.tables)
    assert f"digest of the rows {report.digest[:16]}" in markdown


def test_row_files_list_every_evaluation_once(report, results):
    records = [record for result in results for record in result.records]
    rows = [dict(zip(ROW_HEADER, row, strict=True)) for row in trial_rows(records)]
    assert len(rows) == 2 * 3 * 300  # cases, trials, evaluations
    assert len({(row["case"], row["trial"], row["episode"]) for row in rows}) == len(rows)
    first = records[0].rows
    assert rows[0]["steps"] == first.steps[0]
    assert rows[0]["episode_return"] == first.episode_return[0]
    assert rows[0]["solved"] in (0, 1)


def test_the_html_report_embeds_pictures_tables_and_settings(report, monkeypatch):
    outcome = TrialsOutcome(n_planned=6, n_reused=0, n_run=6, failures=(), interrupted=False)
    monkeypatch.setattr("sdnn.support.machine.description", lambda: "a <machine>")
    page = report.page(PICTURES)
    html = page.to_html(describe_call(outcome, 61, ()))  # 61 seconds
    assert html.startswith("<!doctype html>")
    picture = base64.b64encode(PICTURES["experiment-a"]).decode()
    assert f"data:image/svg+xml;base64,{picture}" in html
    assert not re.search(r'(src|href)="(?!data:)', html)
    assert "a &lt;machine&gt;" in html
    assert "Everything asked for was run in 1 min 1 s" in html
    assert "Smaller than the paper" in html
    for table in page.tables:
        for cell in (*table.header, *(cell for row in table.rows for cell in row)):
            assert escape(cell, quote=False) in html
    for result in report.results:
        assert result.config_hash in html
        assert all(str(record.key.seed) in html for record in result.records)
    later = page.to_html(describe_call(replace(outcome, n_run=2), 61, ()))
    assert "4 of 6 trials were stored before" in later


def test_the_report_names_measures_that_need_longer_trials(tmp_path, run, collected):
    (experiment,) = select_experiments("b")
    run(tmp_path, plan_trials(experiment.cases, n_trials=2, root_seed=0, n_episodes=100))
    results = collected(experiment, tmp_path, 2, 100)
    report = Report(experiments=((experiment, results),), costs=(), quick=True, seed=0)
    page = report.page({"experiment-b": PICTURES["experiment-a"]})
    by_number = {row[0]: row[-1] for row in next(page.tables).rows}
    # A collapse ends a run of 50 evaluations, of which trials of 100 episodes have 10.
    assert by_number["6"] == "episode of collapse, difference: too short to tell"
    assert any("needs more episodes" in note for note in page.notes)


def test_the_html_report_has_pictures_for_narrow_screens(report):
    html = report.page(PICTURES, {"experiment-a": b"narrow"}).to_html("")
    assert "max-width: 640px" in html
    assert base64.b64encode(b"narrow").decode() in html


def test_narrow_figures_have_their_panels_below_each_other(results):
    wide, narrow = (draw_experiment(EXPERIMENT, results, narrow=narrow) for narrow in (False, True))
    for figure, n_columns in ((wide, 2), (narrow, 1)):
        assert figure.axes[0].get_subplotspec().get_gridspec().ncols == n_columns
    assert narrow.get_figwidth() == wide.get_figwidth() / 2
