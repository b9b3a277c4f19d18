"""The reference results as reported trials: run again, changed, or of another configuration."""

import re

import pytest

from refusals import refuses
from sdnn.reproduction.claims import FILE_NAME, HEADER
from sdnn.reproduction.reference import ReferenceReports
from sdnn.runs import RunError
from sdnn.runs.verification import verify


@pytest.fixture(scope="module")
def first_rows():
    """Return the lines of the first trials of fuzzy Q-learning without noise."""
    from importlib.resources import files

    text = files("sdnn.reproduction").joinpath(FILE_NAME).read_text("utf-8")
    return [line for line in text.splitlines() if re.match(r"s4,fuzzy,\w+,1,[01],", line)]


@pytest.fixture
def written(tmp_path):
    """Write lines below the header."""

    def _written(*lines, header=HEADER):
        path = tmp_path / "mine.csv"
        path.write_text("\n".join([",".join(header), *lines]) + "\n")
        return path

    return _written


def test_the_reference_results_are_all_reported():
    reports = ReferenceReports()
    assert len(reports.keys) == 100 * 9, "trials of each pair of case and agent"
    (trial,) = reports.load([reports.keys[0]])
    assert (trial.problem, trial.rows, trial.covers_tests) == ("", None, True)


def test_a_trial_equals_its_reference_result_and_changes_are_found(written, first_rows):
    digest = first_rows[1].split(",")[HEADER.index("rows_digest")]
    changed = f"{digest[:-1]}{int(digest[-1], 16) ^ 1:x}"
    path = written(first_rows[0], first_rows[1].replace(digest, changed))
    verification = verify(ReferenceReports(path), n_trials=None)
    assert [trial.key.trial for trial, _ in verification.equal] == [0]
    (difference,) = verification.differences
    assert difference.key.trial == 1
    assert changed in difference.details[0]
    assert digest in difference.details[1]


def test_a_reference_result_of_another_configuration_is_named(written, first_rows):
    config_hash = first_rows[0].split(",")[HEADER.index("config_hash")]
    path = written(first_rows[0].replace(config_hash, "0123456789abcdef"))
    verification = verify(ReferenceReports(path))
    (difference,) = verification.differences
    assert "0123456789abcdef" in difference.problem
    assert config_hash in difference.problem


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("case", "s9"), ("trial", "-1"), ("trial", "9" * 30), ("root_seed", "x"),
        ("rows_digest", "12"), ("config_hash", ""),
    ],
)  # fmt: skip
def test_values_that_cannot_be_right_are_named(written, first_rows, column, value):
    cells = first_rows[0].split(",")
    cells[HEADER.index(column)] = value
    refuses(column, ReferenceReports, written(",".join(cells)), error=RunError)


def test_other_files_are_refused(written, first_rows, tmp_path):
    refuses("mine.csv", ReferenceReports, written(header=HEADER[1:]), error=RunError)
    refuses("mine.csv", ReferenceReports, written(first_rows[0], first_rows[0]), error=RunError)
    unknown = first_rows[0].replace("fuzzy", "unknown")
    reports = ReferenceReports(written(unknown))
    refuses("unknown", verify, reports, error=RunError)
    (tmp_path / "mine.csv").write_bytes(b"\xff\xfe")
    refuses("mine.csv", ReferenceReports, tmp_path / "mine.csv", error=RunError)


def test_the_command_verifies_a_file_of_reference_results(invoke, written, first_rows):
    result = invoke("verify", written(*first_rows), "--trials", 1, "--seed", 1)
    assert result.exit_code == 0
    assert re.fullmatch(r"1 of 2 trials recomputed here on \w+: all digests equal\n", result.stdout)
