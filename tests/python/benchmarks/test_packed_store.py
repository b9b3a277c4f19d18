"""Packed stores are unpacked row for row, and the published ones hold what their pages show."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from made_records import make_record
from sdnn.runs.store import ResultStore

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def packed_store():
    sys.path.insert(0, str(ROOT / "bench"))
    try:
        import packed_store

        yield packed_store
    finally:
        sys.path.remove(str(ROOT / "bench"))
        sys.modules.pop("packed_store", None)


def new_record(trial, returns, **about):
    """Return a stored trial with some returns, a seed of 64 bits and a fraction of seconds."""
    record = make_record(trial, steps=range(48, 48 + len(returns)), returns=returns, **about)
    return replace(record, key=record.key._replace(seed=2**64 - 1 - trial), seconds=0.1 + trial)


def content_of(folder):
    with ResultStore(folder, read_only=True) as store:
        trials = [(replace(record, rows=None), record.rows.checksum()) for record in store.load()]
        return trials, store.measurements("squares"), store.measurements("cubes")


@pytest.mark.parametrize(
    "returns",
    [[10, -5, -250, 0], [0.1, -0.3, 1e300, 5.0], [2.0**60, 1, 0, 3]],
    ids=["integers", "fractions", "large integers"],
)
def test_a_packed_store_is_unpacked_unchanged(packed_store, tmp_path, returns):
    with ResultStore(tmp_path / "original") as store:
        store.add(new_record(1, returns, version="0.0.9"))
        store.add(new_record(0, returns[::-1], finished_at="2026-11-26T00:00:00+00:00"))
        store.add(new_record(2, []))
        store.put("squares", '["a", 1]', {"square": 0.1 + 0.2})
        store.put("cubes", "[2]", {"cube": [8, None]})
    packed = packed_store.pack(tmp_path / "original")
    packed_store.unpack(packed, tmp_path / "unpacked")
    assert content_of(tmp_path / "unpacked") == content_of(tmp_path / "original")
    assert packed_store.pack(tmp_path / "unpacked") == packed
    assert [file.name for file in (tmp_path / "unpacked").iterdir()] == ["results.sqlite"]


def test_unpacking_does_not_overwrite_results(packed_store, tmp_path):
    with ResultStore(tmp_path) as store:
        store.add(new_record(0, [1.0]))
    before = content_of(tmp_path)
    with pytest.raises(FileExistsError, match="choose another folder"):
        packed_store.unpack(packed_store.pack(tmp_path), tmp_path)
    assert content_of(tmp_path) == before
