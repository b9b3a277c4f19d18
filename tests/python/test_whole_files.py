"""Files are there as a whole or not at all; what killed processes left is removed, nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sdnn import whole_files
from sdnn.whole_files import PARTIAL_SUFFIX, remove_abandoned_files, whole_file, write_whole

WRITE_SLOWLY = """
import sys, time
from pathlib import Path
from sdnn.whole_files import whole_file

with whole_file(Path(sys.argv[1])) as partial:
    partial.write_bytes(b"half")
    print("half", flush=True)
    time.sleep(600)
"""


def under_way(folder: Path) -> list[Path]:
    return sorted(folder.glob(f"*{PARTIAL_SUFFIX}"))


def test_only_what_a_killed_process_left_is_removed(tmp_path):
    write_whole(tmp_path / "rows.csv", b"old")
    foreign = tmp_path / f"notes{PARTIAL_SUFFIX}"  # whose name we never gave
    foreign.write_bytes(b"mine")
    command = [sys.executable, "-c", WRITE_SLOWLY, str(tmp_path / "rows.csv")]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout.readline() == b"half\n"
            found = under_way(tmp_path)
            assert len(found) == 2
            remove_abandoned_files(tmp_path)
            assert under_way(tmp_path) == found
        finally:
            process.kill()
    remove_abandoned_files(tmp_path)
    assert under_way(tmp_path) == [foreign]
    assert (tmp_path / "rows.csv").read_bytes() == b"old"


@pytest.mark.parametrize(("seconds", "stays"), [(0, True), (3600, False)])
def test_where_files_cannot_be_locked_their_age_counts(tmp_path, monkeypatch, seconds, stays):
    monkeypatch.setattr(whole_files, "fcntl", None)
    left = tmp_path / f"rows.csv.{os.getpid()}.0{PARTIAL_SUFFIX}"
    left.write_bytes(b"half")
    os.utime(left, (time.time() - seconds,) * 2)
    remove_abandoned_files(tmp_path)
    assert left.exists() is stays
    write_whole(tmp_path / "rows.csv", b"whole")
    assert (tmp_path / "rows.csv").read_bytes() == b"whole"


def test_a_file_removed_before_it_was_locked_is_made_again(tmp_path, monkeypatch):
    locks = []

    def removed_first(descriptor: int) -> bool:
        if not locks:
            for path in under_way(tmp_path):
                path.unlink()
        locks.append(descriptor)
        return True

    monkeypatch.setattr(whole_files, "lock", removed_first)
    write_whole(tmp_path / "rows.csv", b"whole")
    assert len(locks) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["rows.csv"]


def test_a_file_that_fails_leaves_the_old_one_and_nothing_else(tmp_path):
    path = tmp_path / "rows.csv"
    write_whole(path, b"old")

    def fail(partial: Path) -> None:
        partial.write_bytes(b"half")
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"), whole_file(path) as partial:
        fail(partial)
    assert [found.name for found in tmp_path.iterdir()] == ["rows.csv"]
    assert path.read_bytes() == b"old"
