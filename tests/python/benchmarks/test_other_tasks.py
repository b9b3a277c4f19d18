"""Tables of docs/benchmarks.md: from the stored trials, and right in cases worked by hand."""

import sys
from pathlib import Path

import numpy as np
import pytest

DOCS = Path(__file__).parents[3] / "docs"
BENCH = Path(__file__).parents[3] / "bench"
FOLDERS = (BENCH, BENCH / "other_tasks")


@pytest.fixture(scope="module")
def scripts():
    """The modules beside the command, whose names and agents are theirs alone while it runs."""
    from sdnn.runs.registry import AGENTS

    before, path, agents = set(sys.modules), list(sys.path), dict(AGENTS)
    sys.path[:0] = map(str, FOLDERS)
    try:
        import measured
        import page
        import report
        import run
        import until_solved

        yield measured, page, report, run, until_solved
    finally:
        sys.path[:] = path
        AGENTS.clear()
        AGENTS.update(agents)
        for name in set(sys.modules) - before:
            file = getattr(sys.modules[name], "__file__", None) or ""
            if Path(file).parent in FOLDERS:
                del sys.modules[name]


def test_page_has_the_tables_of_the_stored_trials(scripts):
    measured, page, report, run, until_solved = scripts
    tables = report.tables(report.by_kind(measured.measured(run.KIND, DOCS)))
    solved = report.by_kind(measured.measured(until_solved.KIND, DOCS))
    tables["until solved"] = until_solved.table(solved)
    text = (DOCS / "benchmarks.md").read_text()
    assert page.with_tables(text, tables) == text, (
        "run bench/other_tasks/run.py --only-table, and until_solved.py --only-table"
    )


def test_every_stored_trial_is_whole_and_of_ten_seeds(scripts):
    measured, _, _, run, _ = scripts
    found = measured.measured(run.KIND, DOCS)
    seeds = {}
    for *which, seed in found:
        seeds.setdefault(tuple(which), []).append(seed)
    assert set(map(tuple, seeds.values())) == {tuple(range(10))}
    for trial in found.values():
        assert trial["steps"] == sorted(set(trial["steps"]))
        lengths = {len(trial[name]) for name in ("steps", "cpu_seconds", "mean_return")}
        assert lengths == {20}
        assert trial["bytes"] > 0


def test_every_contender_learns_on_the_engine(scripts, monkeypatch):
    """As it is specified, but for its budget: those that need no other library."""
    *_, run, _ = scripts
    import agents
    import looks
    from tasks import TASKS

    monkeypatch.setattr(looks, "N_EPISODES", 1)
    monkeypatch.setattr(looks, "N_LAST_EPISODES", 2)

    for kind, contender in agents.CONTENDERS.items():
        names = [name for name in contender.tasks if TASKS[name].steps < 100_000]
        if not names or kind in ("sac", "td3", "ppo"):
            continue
        spec = contender.spec(names[-1], "redundant", 1)
        found = run.Curve(spec.replace(budget=spec.budget.replace(steps=40))).learn()
        assert found["steps"] == list(range(2, 41, 2))
        assert np.isfinite(found["mean_return"]).all()
        assert found["bytes"] > 0


def test_a_trial_is_measured_once(scripts, tmp_path):
    measured, *_ = scripts
    measured.measure_missing("lengths", len, [("a", 1), ("b", "c", 0)], tmp_path)
    assert measured.measured("lengths", tmp_path) == {("a", 1): 2, ("b", "c", 0): 3}
    measured.measure_missing("lengths", sum, [("a", 1)], tmp_path)  # which would fail
    assert [file.name for file in tmp_path.iterdir()] == [measured.PACKED]


def test_page_without_a_mark_is_refused(scripts):
    _, page, *_ = scripts
    with pytest.raises(ValueError, match="table: here"):
        page.with_tables("nothing", {"here": "| a |\n"})
    with pytest.raises(ValueError, match="end of table"):
        page.with_tables("<!-- table: here -->", {"here": "| a |\n"})


def test_tables_go_between_their_marks(scripts):
    _, page, *_ = scripts
    text = f"before\n<!-- table: here -->\nold\n{page.END}\nafter\n"
    table = page.markdown(("a", "b"), [("1", "2")])
    assert table == "| a | b |\n| --- | --- |\n| 1 | 2 |\n"
    expected = f"before\n<!-- table: here -->\n\n{table}\n{page.END}\nafter\n"
    assert page.with_tables(text, {"here": table}) == expected


def test_shares_by_hand(scripts):
    _, _, report, *_ = scripts
    clean = [np.array([1.0, 1.0, 4.0]), np.array([2.0])]
    noisy = [np.array([0.5, 0.5, 0.5]), np.array([3.0])]
    rng = np.random.default_rng(0)
    # (0.5 / 1 + 3 / 2) / 2 and (0.5 / 2 + 3 / 2) / 2
    by_median, by_mean = (report.shares(clean, noisy, m, rng) for m in report.MIDDLES.values())
    assert by_median[0] == 1.0
    assert by_mean[0] == 0.875
    # a draw's clean median is 1 or 4, so its share is that or 0.125
    assert set(by_median[1:]) == {1.0, (0.125 + 1.5) / 2}
    # 4 in two of three or in all: 7 of 27 draws
    assert np.mean(by_median[1:] < 1.0) == pytest.approx(7 / 27, abs=0.05)
    assert report.interval_of(by_median).value == 1.0


def test_what_was_never_reached_is_written_so(scripts):
    _, page, report, *_ = scripts
    estimate = report.Estimate(1234.5, 1.0, np.inf)
    assert page.interval(estimate, 1) == "1,234.5 [1.0, never]"
