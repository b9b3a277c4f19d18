"""The rows of the paper's trials stay the same, bit for bit, whatever is renamed or moved."""

import hashlib

from sdnn.reproduction import PaperStudy
from sdnn.runs import ResultStore, run_trials

GOLDEN = "daeab97b4c3adff9796000959c2049d42692378a7d55dc3816a4010ef08760b4"


def digest_of(plan, records):
    """SHA-256 of cases, trials, seeds, decisions and rows, without names and settings."""
    sha = hashlib.sha256()
    for planned in plan:
        record = records[planned.key]
        key, rows = record.key, record.rows
        sha.update(repr((key.case_id, key.trial, key.seed, record.n_decisions)).encode())
        columns = (rows.episode, rows.steps, rows.episode_return, rows.solved)
        for column, kind in zip(columns, ("<i4", "<i4", "<f8", "u1"), strict=True):
            sha.update(column.astype(kind).tobytes())
    return sha.hexdigest()


def test_the_rows_of_a_quick_reproduction_have_the_stored_digest(tmp_path):
    plan = PaperStudy(quick=True).plan()
    with ResultStore(tmp_path) as store:
        outcome = run_trials(plan, store)
        records = {record.key: record for record in store.load()}
    assert outcome.n_run == len(records) == 2 * 9, "trials of each pair of case and agent"
    assert digest_of(plan, records) == GOLDEN
