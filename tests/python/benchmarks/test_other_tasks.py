"""Tables of docs/benchmarks.md: from the stored rows, and right in cases worked by hand."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

DOCS = Path(__file__).parents[3] / "docs"
SCRIPTS = Path(__file__).parents[3] / "bench" / "other_tasks"


@pytest.fixture(scope="module")
def scripts():
    """The modules beside the command, whose names are theirs alone while it runs."""
    before = set(sys.modules)
    sys.path.insert(0, str(SCRIPTS))
    try:
        import page
        import report
        import until_solved

        yield page, report, until_solved
    finally:
        sys.path.remove(str(SCRIPTS))
        for name in set(sys.modules) - before:
            file = getattr(sys.modules[name], "__file__", None) or ""
            if Path(file).parent == SCRIPTS:
                del sys.modules[name]


def rows_of(name):
    with (DOCS / name).open(newline="") as file:
        return list(csv.DictReader(file))


def test_page_has_the_tables_of_the_stored_rows(scripts):
    page, report, until_solved = scripts
    tables = report.tables(report.by_trial(rows_of("other-tasks.csv")))
    tables["until solved"] = until_solved.table(rows_of("until-solved.csv"))
    text = (DOCS / "benchmarks.md").read_text()
    assert page.with_tables(text, tables) == text, (
        "run bench/other_tasks/run.py --only-table, and until_solved.py --only-table"
    )


def test_every_row_is_a_whole_trial_of_ten_seeds(scripts):
    _, report, _ = scripts
    trials = report.by_trial(rows_of("other-tasks.csv"))
    assert {tuple(int(looks[0]["seed"]) for looks in seeds) for seeds in trials.values()} == {
        tuple(range(10))
    }
    for seeds in trials.values():
        for looks in seeds:
            steps = [int(look["steps"]) for look in looks]
            assert len(steps) == 20
            assert steps == sorted(set(steps))


def test_page_without_a_mark_is_refused(scripts):
    page, _, _ = scripts
    with pytest.raises(ValueError, match="table: here"):
        page.with_tables("nothing", {"here": "| a |\n"})
    with pytest.raises(ValueError, match="end of table"):
        page.with_tables("<!-- table: here -->", {"here": "| a |\n"})


def test_tables_go_between_their_marks(scripts):
    page, _, _ = scripts
    text = f"before\n<!-- table: here -->\nold\n{page.END}\nafter\n"
    table = page.markdown(("a", "b"), [("1", "2")])
    assert table == "| a | b |\n| --- | --- |\n| 1 | 2 |\n"
    expected = f"before\n<!-- table: here -->\n\n{table}\n{page.END}\nafter\n"
    assert page.with_tables(text, {"here": table}) == expected


def test_shares_by_hand(scripts):
    _, report, _ = scripts
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
    page, report, _ = scripts
    estimate = report.Estimate(1234.5, 1.0, np.inf)
    assert page.interval(estimate, 1) == "1,234.5 [1.0, never]"
